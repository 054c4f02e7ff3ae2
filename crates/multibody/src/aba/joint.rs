//! The articulated-body algorithm at one joint, compiled for each number of degrees of freedom.

use nalgebra::Vector3;

use crate::lanes::Real;
use crate::spatial::{ArticulatedInertia, Twist, Wrench};

/// A pivot below this fraction of the inertia that it is cut from is round-off: its degree of freedom has
/// neither inertia nor armature and stays still.
const PIVOT_TOLERANCE: f64 = 1e-14;

/// Calls a function that is generic over (numbers, translations, degrees of freedom) on the links of a slot,
/// with those of their joints.
macro_rules! for_slot {
    ($model:expr, $slot:expr, $function:ident($($argument:expr),* $(,)?)) => {
        match $slot {
            Slot::One(links) => match $model.bodies[links[0]].joint {
                JointKind::Weld => $function::<f64, 0, 0>(links, $($argument),*),
                JointKind::Hinge(_) => $function::<f64, 0, 1>(links, $($argument),*),
                JointKind::Slide(_) => $function::<f64, 1, 1>(links, $($argument),*),
                JointKind::Universal => $function::<f64, 0, 2>(links, $($argument),*),
                JointKind::Ball => $function::<f64, 0, 3>(links, $($argument),*),
                JointKind::Planar => $function::<f64, 2, 3>(links, $($argument),*),
                JointKind::Free => $function::<f64, 3, 6>(links, $($argument),*),
            },
            Slot::Two(links) => $function::<Pair, 0, 2>(links, $($argument),*),
        }
    };
}
pub(super) use for_slot;

/// Component of a wrench along a degree of freedom: the first T are translations, the others rotations.
#[inline(always)]
fn project<S: Real, const T: usize>(k: usize, axis: &Vector3<S>, wrench: &Wrench<S>) -> S {
    if k < T { axis.dot(&wrench.force) } else { axis.dot(&wrench.torque) }
}

/// Factor of an eliminated joint.
pub(super) struct JointFactor<S: Real, const N: usize> {
    /// G = U D^-1.
    pub g: [Wrench<S>; N],
    /// D^-1.
    pub d_inverse: [[S; N]; N],
    /// Inverses of the pivots; 0 where one is round-off.
    pub pivot_inverse: [S; N],
}

/// Eliminates one joint from the articulated inertia: `D = S^T A S + armature`, `A - U D^-1 U^T`.
#[inline(always)]
pub(super) fn factor_joint<S: Real, const T: usize, const N: usize>(
    inertia: &mut ArticulatedInertia<S>,
    axes: &[Vector3<S>; N],
    armature: &[S; N],
) -> JointFactor<S, N> {
    // Loops rather than array functions: those are not inlined.
    let mut u = [Wrench::default(); N];
    let mut d = [[S::zero(); N]; N];
    let mut floor = [S::zero(); N];
    for k in 0..N {
        u[k] = if k < T { inertia.of_translation(&axes[k]) } else { inertia.of_rotation(&axes[k]) };
        let scale = if k < T { inertia.linear.trace() } else { inertia.angular.trace() };
        floor[k] = S::splat(PIVOT_TOLERANCE) * scale;
        for j in 0..=k {
            d[k][j] = project::<S, T>(j, &axes[j], &u[k]);
        }
        d[k][k] += armature[k];
    }
    let (d_inverse, pivot_inverse) = spd_inverse(d, &floor);
    let mut g = [Wrench::default(); N];
    for k in 0..N {
        g[k] = u[0].scaled(d_inverse[0][k]);
        for j in 1..N {
            g[k] += u[j].scaled(d_inverse[j][k]);
        }
        inertia.subtract_outer(&u[k], &g[k]);
    }
    JointFactor { g, d_inverse, pivot_inverse }
}

/// Inverse of a symmetric positive definite matrix given by its lower triangle, by `L D L^T`, and the inverses
/// of its pivots. A pivot at or under its floor has the inverse 0 and gives a zero row and column.
#[inline(always)]
fn spd_inverse<S: Real, const N: usize>(mut a: [[S; N]; N], floor: &[S; N]) -> ([[S; N]; N], [S; N]) {
    let mut pivot_inverse = [S::zero(); N];
    for k in 0..N {
        // a[k][j] for j < k becomes l[k][j]; the sum of l d l takes the eliminated part off the pivot.
        for j in 0..k {
            for i in 0..j {
                let eliminated = a[k][i] * a[j][i];
                a[k][j] -= eliminated;
            }
        }
        for j in 0..k {
            let scaled = a[k][j] * pivot_inverse[j];
            let eliminated = a[k][j] * scaled;
            a[k][k] -= eliminated;
            a[k][j] = scaled;
        }
        pivot_inverse[k] = a[k][k].inverse_above(floor[k]);
    }
    // L^-1, then L^-T D^-1 L^-1.
    let mut l_inverse = [[S::zero(); N]; N];
    for k in 0..N {
        let mut row = [S::zero(); N];
        row[k] = S::one();
        for (j, entry) in row.iter_mut().enumerate().take(k) {
            for i in j..k {
                *entry -= a[k][i] * l_inverse[i][j];
            }
        }
        l_inverse[k] = row;
    }
    let mut inverse = [[S::zero(); N]; N];
    for k in 0..N {
        for j in 0..=k {
            for i in k..N {
                inverse[k][j] += l_inverse[i][k] * pivot_inverse[i] * l_inverse[i][j];
            }
            inverse[j][k] = inverse[k][j];
        }
    }
    (inverse, pivot_inverse)
}

/// `y = tau + S^T P`; gives `D^-1 y` and leaves what the parent feels, `P - G y`, in `wrench`.
#[inline(always)]
pub(super) fn solve_joint_up<S: Real, const T: usize, const N: usize>(
    wrench: &mut Wrench<S>,
    axes: &[Vector3<S>; N],
    g: &[Wrench<S>; N],
    d_inverse: &[[S; N]; N],
    tau: &[S; N],
) -> [S; N] {
    let (mut y, mut x) = ([S::zero(); N], [S::zero(); N]);
    for k in 0..N {
        y[k] = tau[k] + project::<S, T>(k, &axes[k], wrench);
    }
    for k in 0..N {
        x[k] = d_inverse[k][0] * y[0];
        for j in 1..N {
            x[k] += d_inverse[k][j] * y[j];
        }
        *wrench = *wrench - g[k].scaled(y[k]);
    }
    x
}

/// `x = D^-1 y - G^T a` with the parent's change `a` brought to the link's origin; gives the link's change.
#[inline(always)]
pub(super) fn solve_joint_down<S: Real, const T: usize, const N: usize>(
    parent: &Twist<S>,
    axes: &[Vector3<S>; N],
    g: &[Wrench<S>; N],
    x: &mut [S; N],
) -> Twist<S> {
    let mut change = *parent;
    for k in 0..N {
        x[k] -= g[k].torque.dot(&parent.angular) + g[k].force.dot(&parent.linear);
        if k < T {
            change.linear += axes[k] * x[k];
        } else {
            change.angular += axes[k] * x[k];
        }
    }
    change
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_of_a_matrix_with_a_dead_row_skips_it() {
        let a = [[4.0, 0.0, 0.0], [0.0, 0.0, 0.0], [2.0, 0.0, 3.0]];
        let (inverse, pivot_inverse) = spd_inverse(a, &[1e-12; 3]);
        assert_eq!(pivot_inverse.map(|inverse| inverse == 0.0), [false, true, false]);
        let expected = [[3.0 / 8.0, 0.0, -2.0 / 8.0], [0.0; 3], [-2.0 / 8.0, 0.0, 4.0 / 8.0]];
        for (row, expected) in inverse.iter().zip(&expected) {
            for (x, y) in row.iter().zip(expected) {
                assert!((x - y).abs() < 1e-15);
            }
        }
    }
}

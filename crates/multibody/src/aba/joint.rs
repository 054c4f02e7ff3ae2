//! What the articulated-body algorithm does at one joint, compiled for each number of degrees of freedom.

use orchard_geometry::Vec3;

use crate::spatial::{ArticulatedInertia, Twist, Wrench};

/// A pivot below this fraction of the inertia that it is cut from is round-off: its degree of freedom has
/// neither inertia nor armature and stays still.
const PIVOT_TOLERANCE: f64 = 1e-14;

/// Calls a function that is generic over (translations, degrees of freedom) with those of a joint.
macro_rules! for_joint {
    ($joint:expr, $function:ident($($argument:expr),* $(,)?)) => {
        match $joint {
            JointKind::Weld => $function::<0, 0>($($argument),*),
            JointKind::Hinge(_) => $function::<0, 1>($($argument),*),
            JointKind::Slide(_) => $function::<1, 1>($($argument),*),
            JointKind::Universal => $function::<0, 2>($($argument),*),
            JointKind::Planar => $function::<2, 3>($($argument),*),
            JointKind::Free => $function::<3, 6>($($argument),*),
        }
    };
}
pub(super) use for_joint;

/// Component of a wrench along a degree of freedom: the first T are translations, the others rotations.
#[inline]
fn project<const T: usize>(k: usize, axis: &Vec3, wrench: &Wrench) -> f64 {
    if k < T { axis.dot(&wrench.force) } else { axis.dot(&wrench.torque) }
}

/// Eliminates one joint from the articulated inertia: `D = S^T A S + armature`, `A - U D^-1 U^T`.
/// Gives false if a pivot is round-off.
#[inline]
pub(super) fn factor_joint<const T: usize, const N: usize>(
    inertia: &mut ArticulatedInertia,
    axes: &[Vec3],
    armature: impl Fn(usize) -> f64,
    u: &mut [Wrench],
    g: &mut [Wrench],
    d_inverse: &mut [f64],
) -> bool {
    let mut d = [[0.0; N]; N];
    let mut floor = [0.0; N];
    for k in 0..N {
        let axis = &axes[k];
        u[k] = if k < T {
            floor[k] = PIVOT_TOLERANCE * inertia.linear.trace();
            Wrench { torque: inertia.coupling * axis, force: inertia.linear * *axis }
        } else {
            floor[k] = PIVOT_TOLERANCE * inertia.angular.trace();
            Wrench { torque: inertia.angular * *axis, force: inertia.coupling.tr_mul(axis) }
        };
        for j in 0..=k {
            d[k][j] = project::<T>(j, &axes[j], &u[k]);
        }
        d[k][k] += armature(k);
    }
    let (inverse, is_regular) = spd_inverse(d, &floor);
    for k in 0..N {
        g[k] = Wrench::ZERO;
        for j in 0..N {
            g[k] += u[j].scaled(inverse[j][k]);
            d_inverse[k * N + j] = inverse[k][j];
        }
        inertia.angular.subtract_outer(&u[k].torque, &g[k].torque);
        inertia.coupling -= u[k].torque * g[k].force.transpose();
        inertia.linear.subtract_outer(&u[k].force, &g[k].force);
    }
    is_regular
}

/// Inverse of a symmetric positive definite matrix given by its lower triangle, by `L D L^T`. A pivot at or
/// under its floor gives a zero row and column, and false.
#[inline]
fn spd_inverse<const N: usize>(mut a: [[f64; N]; N], floor: &[f64; N]) -> ([[f64; N]; N], bool) {
    let mut is_regular = true;
    let mut pivot_inverse = [0.0; N];
    for k in 0..N {
        // a[k][j] for j < k becomes l[k][j]; the sum of l d l takes the eliminated part off the pivot.
        for j in 0..k {
            for i in 0..j {
                a[k][j] -= a[k][i] * a[j][i];
            }
        }
        for j in 0..k {
            let scaled = a[k][j] * pivot_inverse[j];
            a[k][k] -= a[k][j] * scaled;
            a[k][j] = scaled;
        }
        if a[k][k] > floor[k] {
            pivot_inverse[k] = 1.0 / a[k][k];
        } else {
            is_regular = false;
        }
    }
    // L^-1, then L^-T D^-1 L^-1.
    let mut l_inverse = [[0.0; N]; N];
    for k in 0..N {
        let mut row = [0.0; N];
        row[k] = 1.0;
        for (j, entry) in row.iter_mut().enumerate().take(k) {
            for i in j..k {
                *entry -= a[k][i] * l_inverse[i][j];
            }
        }
        l_inverse[k] = row;
    }
    let mut inverse = [[0.0; N]; N];
    for k in 0..N {
        for j in 0..=k {
            for i in k..N {
                inverse[k][j] += l_inverse[i][k] * pivot_inverse[i] * l_inverse[i][j];
            }
            inverse[j][k] = inverse[k][j];
        }
    }
    (inverse, is_regular)
}

/// `y = tau + S^T P`; leaves `D^-1 y` in `x` and what the parent feels, `P - G y`, in `wrench`.
#[inline]
pub(super) fn solve_joint_up<const T: usize, const N: usize>(
    wrench: &mut Wrench,
    axes: &[Vec3],
    g: &[Wrench],
    d_inverse: &[f64],
    tau: &[f64],
    x: &mut [f64],
) {
    let mut y = [0.0; N];
    for k in 0..N {
        y[k] = tau[k] + project::<T>(k, &axes[k], wrench);
    }
    for k in 0..N {
        x[k] = 0.0;
        for j in 0..N {
            x[k] += d_inverse[k * N + j] * y[j];
        }
        *wrench = *wrench - g[k].scaled(y[k]);
    }
}

/// `x = D^-1 y - G^T a` with the parent's change `a` brought to the link's origin; gives the link's change.
#[inline]
pub(super) fn solve_joint_down<const T: usize, const N: usize>(
    parent: Twist,
    axes: &[Vec3],
    g: &[Wrench],
    x: &mut [f64],
) -> Twist {
    let mut change = parent;
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
        let (inverse, is_regular) = spd_inverse(a, &[1e-12; 3]);
        assert!(!is_regular);
        let expected = [[3.0 / 8.0, 0.0, -2.0 / 8.0], [0.0; 3], [-2.0 / 8.0, 0.0, 4.0 / 8.0]];
        for (row, expected) in inverse.iter().zip(&expected) {
            for (x, y) in row.iter().zip(expected) {
                assert!((x - y).abs() < 1e-15);
            }
        }
    }
}

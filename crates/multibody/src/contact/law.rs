//! Contact law: impulse as a function of the contact velocity, with its cost and derivative.
//!
//! The impulse is the projection of `y = -R^-1 (v - v_hat)` on the friction cone in the norm of R (Castro et
//! al. 2022, section IV). It is minus the gradient of the convex cost `l(v) = 1/2 gamma^T R gamma`.

use orchard_geometry::{Mat3, Vec3};

/// Least normal regularisation as a share of the contact's own inverse inertia. The paper takes
/// `beta^2 / (4 pi^2)` with beta = 1, 0.025, for its solver's conditioning; under light bodies that softens a
/// contact far below its stiffness, and a direct solve in f64 needs only this.
const NEAR_RIGID: f64 = 1e-4;
/// Tangential regularisation as a share of the contact's own inverse inertia (sigma of the paper). A sticking
/// contact creeps at this times the velocity that its friction impulse would give it if free. Sliding adds
/// `friction^2` times it to the normal regularisation, so it is no larger than the normal share.
const TANGENTIAL: f64 = 1e-4;

/// The law of a block of three rows.
#[derive(Debug, Clone)]
pub(super) enum Law {
    /// A contact before its regularisation is known.
    Open { friction: f64, stiffness: f64, gap: f64 },
    /// A contact: two tangents, then the normal.
    Contact {
        friction: f64,
        /// Tangential regularisation [1/kg].
        r_t: f64,
        /// Normal regularisation [1/kg].
        r_n: f64,
        /// Normal velocity at which the normal impulse vanishes [m/s].
        v_hat: f64,
    },
    /// A soft bilateral row, in the first row.
    Spring {
        /// Impulse for each unit of velocity.
        admittance: f64,
        /// Velocity at which the impulse vanishes.
        v_hat: f64,
    },
}

/// Impulse of a contact law at a velocity, with its derivative.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response {
    /// Impulse [N s].
    pub impulse: Vec3,
    /// L of `-d impulse / d v = L L^T`; the columns from `rank` on are zero.
    pub root: Mat3,
    pub rank: usize,
}

impl Response {
    const NONE: Response = Response {
        impulse: Vec3::new(0.0, 0.0, 0.0),
        root: Mat3::new(0., 0., 0., 0., 0., 0., 0., 0., 0.),
        rank: 0,
    };
}

impl Law {
    /// `k x + c v = 0` held over the step: the impulse is `-h (k (x + h v) + c v)`.
    pub fn spring(stiffness: f64, damping: f64, offset: f64, h: f64) -> Law {
        let rate = h * stiffness + damping;
        let v_hat = if rate > 0.0 { -stiffness * offset / rate } else { 0.0 };
        Law::Spring { admittance: h * rate, v_hat }
    }

    /// Chooses the regularisation of a contact whose block of the Delassus matrix has the size `w`.
    ///
    /// An overlap gives the normal impulse `-h k (gap + (h + tau) v_n)`: spring and dissipation at the end of
    /// the step. Surfaces still apart feel only the spring over the predicted overlap, `-h k (gap + h v_n)`,
    /// as dissipation must not act at a distance.
    /// A contact that no impulse can move (`w` is zero) stays open.
    pub fn regularise(&mut self, h: f64, dissipation_time: f64, w: f64) {
        if let Law::Open { friction, stiffness, gap } = *self
            && w > 0.0
        {
            let time = if gap > 0.0 { h } else { h + dissipation_time };
            *self = Law::Contact {
                friction,
                r_t: TANGENTIAL * w,
                r_n: (NEAR_RIGID * w).max(1.0 / (h * stiffness * time)),
                v_hat: -gap / time,
            };
        }
    }

    /// Impulse and derivative at the velocity `v` of the rows.
    // Inlined: a line search wants the impulse only.
    #[inline(always)]
    pub fn respond(&self, v: &Vec3) -> Response {
        match *self {
            Law::Open { .. } => Response::NONE,
            Law::Spring { admittance, v_hat } => Response {
                impulse: Vec3::new(-admittance * (v.x - v_hat), 0.0, 0.0),
                root: Mat3::from_diagonal(&Vec3::new(admittance.sqrt(), 0.0, 0.0)),
                rank: 1,
            },
            Law::Contact { friction, r_t, r_n, v_hat } => respond_on_cone(v, friction, r_t, r_n, v_hat),
        }
    }
}

/// The three regions of the cone: open, sticking, sliding.
#[inline(always)]
fn respond_on_cone(v: &Vec3, friction: f64, r_t: f64, r_n: f64, v_hat: f64) -> Response {
    let y_n = (v_hat - v.z) / r_n;
    let (y_1, y_2) = (-v.x / r_t, -v.y / r_t);
    let y_t = (y_1 * y_1 + y_2 * y_2).sqrt();
    if y_t <= friction * y_n {
        let stiff_t = (1.0 / r_t).sqrt();
        return Response {
            impulse: Vec3::new(y_1, y_2, y_n),
            root: Mat3::from_diagonal(&Vec3::new(stiff_t, stiff_t, (1.0 / r_n).sqrt())),
            rank: 3,
        };
    }
    let ratio = friction * r_t / r_n;
    if y_n <= -ratio * y_t || y_t == 0.0 {
        return Response::NONE;
    }
    // The edge of the cone: gamma = gamma_n (mu t, 1), t the direction of y_t.
    let (t_1, t_2) = (y_1 / y_t, y_2 / y_t);
    let share = 1.0 / (1.0 + friction * ratio);
    let gamma_n = (y_n + ratio * y_t) * share;
    let edge = Vec3::new(friction * t_1, friction * t_2, 1.0);
    // Along the edge the derivative is share / r_n, across the slip direction friction turns with the slip.
    let along = edge * (share / r_n).sqrt();
    let across = Vec3::new(-t_2, t_1, 0.0) * (friction * gamma_n / (y_t * r_t)).sqrt();
    Response {
        impulse: edge * gamma_n,
        root: Mat3::from_columns(&[along, across, Vec3::zeros()]),
        rank: if friction > 0.0 { 2 } else { 1 },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact() -> Law {
        Law::Contact { friction: 0.6, r_t: 0.01, r_n: 0.2, v_hat: 0.05 }
    }

    #[test]
    fn derivative_is_that_of_the_impulse_in_every_region() {
        // Sticking, sliding twice, open.
        for v in [[0.0001, 0.0002, -0.3], [0.3, -0.2, -0.1], [0.5, 0.5, 0.1], [0.001, 0.0, 0.4]] {
            let v = Vec3::from(v);
            let law = contact();
            let root = law.respond(&v).root;
            let eps = 1e-7;
            for k in 0..3 {
                let step = Vec3::ith(k, eps);
                let slope =
                    (law.respond(&(v + step)).impulse - law.respond(&(v - step)).impulse) / (2.0 * eps);
                let expected = -(root * root.transpose()).column(k);
                assert!(
                    (slope - expected).norm() < 1e-5 * (1.0 + expected.norm()),
                    "{v:?} {slope} {expected}"
                );
            }
        }
    }

    #[test]
    fn impulse_is_the_closest_point_of_the_cone() {
        let law = contact();
        let distance = |gamma: &Vec3, y: &Vec3| {
            let d = gamma - y;
            0.01 * (d.x * d.x + d.y * d.y) + 0.2 * d.z * d.z
        };
        for v in [[0.001, 0.002, -0.3], [0.3, -0.2, -0.1], [0.1, 0.1, 0.06], [0.0, 0.001, 0.4]] {
            let v = Vec3::from(v);
            let y = Vec3::new(-v.x / 0.01, -v.y / 0.01, (0.05 - v.z) / 0.2);
            let best = distance(&law.respond(&v).impulse, &y);
            for step in 0..4000 {
                let angle = f64::from(step % 80) * std::f64::consts::TAU / 80.0;
                let normal = f64::from(step / 80) * 0.1;
                let (s, c) = orchard_geometry::math::sin_cos(angle);
                for fill in [0.0, 0.5, 1.0] {
                    let radius = 0.6 * normal * fill;
                    let other = Vec3::new(radius * c, radius * s, normal);
                    assert!(best <= distance(&other, &y) + 1e-12);
                }
            }
        }
    }
}

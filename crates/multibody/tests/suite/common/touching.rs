//! Free bodies that touch the world.

use nalgebra::Translation3;
use orchard_geometry::{Mat3, Pose, Rotation, Shape, Vec3};
use orchard_multibody::*;

use super::{GRAVITY, settings};

pub const H: f64 = 1.0 / 180.0;
pub const STIFFNESS: f64 = 5e4;
pub const ALL: Groups = Groups { member: 1, filter: 1 };

pub fn collider(owner: Owner, shape: Shape, x_owner_shape: Pose, friction: f64) -> Collider {
    Collider { owner, shape, x_owner_shape, groups: ALL, friction, stiffness: 2.0 * STIFFNESS }
}

pub fn free_body(mass: f64, i_com: Mat3) -> Body {
    Body {
        parent: None,
        joint: JointKind::Free,
        x_parent_joint: Pose::identity(),
        inertia: SpatialInertia { mass, p_com: Vec3::zeros(), i_com },
    }
}

/// Pose whose z axis is tilted from the vertical towards +x.
pub fn tilted(angle: f64) -> Pose {
    Pose::from_parts(Translation3::identity(), Rotation::from_scaled_axis(Vec3::y() * angle))
}

pub fn run(model: &Model, data: &mut Data, seconds: f64) -> StepReport {
    let mut report = StepReport::default();
    for _ in 0..(seconds / H).round() as usize {
        step(model, data, &settings(H, GRAVITY), &mut report);
        assert!(report.converged, "{} iterations, residual {:e}", report.newton_iterations, report.residual);
    }
    report
}

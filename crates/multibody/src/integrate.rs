//! Integration of joint coordinates.

use nalgebra::Quaternion;
use orchard_geometry::{Rotation, Vec3};

use crate::kinematics::rotation_by;
use crate::model::{JointKind, Model};

/// Moves the joints for a time `h` with their velocities.
pub(crate) fn move_joints(model: &Model, q: &mut [f64], v: &[f64], h: f64) {
    for run in &model.runs {
        for (q, v) in q[run.qs()].iter_mut().zip(&v[run.dofs()]) {
            *q += h * v;
        }
    }
    for &id in &model.turning {
        let (q, v) = (&mut q[model.qs(id)], &v[model.dofs(id)]);
        match model.body(id).joint {
            JointKind::Free => {
                for (q, v) in q[..3].iter_mut().zip(v) {
                    *q += h * v;
                }
                turn(&mut q[3..], |old| rotation_by(&(Vec3::from_column_slice(&v[3..]) * h)) * old);
            }
            _ => turn(q, |old| old * rotation_by(&(Vec3::from_column_slice(v) * h))),
        }
    }
}

/// Turns a quaternion (x, y, z, w). Its sign never jumps: a twist beyond half a turn keeps its angle.
fn turn(quaternion: &mut [f64], by: impl Fn(Rotation) -> Rotation) {
    let old = Quaternion::new(quaternion[3], quaternion[0], quaternion[1], quaternion[2]);
    let new = by(Rotation::new_normalize(old));
    quaternion.copy_from_slice(new.as_ref().coords.as_slice());
}

//! Proprioception: readings of the robot's own sensors after a step.

use crate::handle::RobotHandle;
use crate::io::Observation;
use orchard_geometry::Intrinsics;
use orchard_multibody::{BodyId, Data, Model};

/// Reads joints, drives and odometry; the camera fills `depth`. Efforts are those of the last step, whose springs and dampers act with the
/// state at its end.
pub fn observe(
    model: &Model,
    data: &Data,
    handle: &RobotHandle,
    time: f64,
    intrinsics: Intrinsics,
) -> Observation {
    let q = |body: BodyId| data.q[model.qs(body).start];
    let v = |body: BodyId| data.v[model.dofs(body).start];
    let effort = |body: BodyId| {
        let dof = model.dofs(body).start;
        data.stiffness[dof] * (data.rest[dof] - q(body)) - data.damping[dof] * data.v[dof] + data.torque[dof]
    };
    let (pose, rate) = (model.qs(handle.planar).start, model.dofs(handle.planar).start);
    Observation {
        time,
        arm_q: handle.arm.map(q),
        arm_v: handle.arm.map(v),
        arm_torque: handle.arm.map(effort),
        finger_q: handle.fingers.map(q),
        finger_force: handle.fingers.map(effort),
        base_pose: std::array::from_fn(|k| data.q[pose + k]),
        base_height: q(handle.height),
        base_velocity: std::array::from_fn(|k| data.v[rate + k]),
        depth: None,
        depth_time: time,
        intrinsics,
    }
}

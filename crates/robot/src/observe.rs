//! Proprioception: readings of the robot's own sensors after a step.

use crate::finger::Finger;
use crate::handle::RobotHandle;
use crate::io::Observation;
use crate::joint_values::JointValues;
use orchard_geometry::Intrinsics;
use orchard_multibody::{BodyId, Data, Model};

/// Reads joints, drives and odometry; the camera fills `depth`, and the cup `cup_pressure`. Efforts are those of the last step, whose springs and dampers act with the
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
    let arm = |read: &dyn Fn(BodyId) -> f64| JointValues::from_fn(handle.arm.len(), |i| read(handle.arm[i]));
    let finger = |read: &dyn Fn(&Finger<BodyId>) -> f64| {
        std::array::from_fn(|i| handle.fingers.get(i).map_or(0.0, read))
    };
    let opening = |finger: &Finger<BodyId>| finger.opening.at(q(finger.drive));
    // By virtual work.
    let force = |finger: &Finger<BodyId>| effort(finger.drive) / finger.opening.rate(q(finger.drive));
    Observation {
        time,
        arm_q: arm(&q),
        arm_v: arm(&v),
        arm_torque: arm(&effort),
        finger_q: finger(&opening),
        finger_force: finger(&force),
        cup_pressure: 0.0,
        base_pose: handle.base_joint.pose(model, data),
        base_height: handle.height.map_or(0.0, q),
        base_velocity: handle.base_joint.velocity(model, data),
        depth: None,
        colour: None,
        depth_time: time,
        intrinsics,
        pictures: None,
    }
}

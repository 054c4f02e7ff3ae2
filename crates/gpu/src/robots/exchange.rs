//! States of robots between the device and f64.

use orchard_multibody::{Data, Model};
use orchard_robot::{BaseJoint, JointValues, RobotHandle, SetPoints, Suction};

use super::cup::fields_of;
use super::{Alone, RobotBatch, row_place};
use crate::layout::{QUAD, robot};

impl RobotBatch {
    /// Places of the quads of a robot's state on the device.
    pub(crate) fn quad_places(world: usize) -> impl Iterator<Item = u32> {
        (0..robot::FIELDS)
            .step_by(QUAD)
            .map(move |field| (row_place(world, field, robot::FIELDS) / QUAD) as u32)
    }

    /// Sets the state of a robot on the host, out of quarantine; the quads of [`Self::state_quads`] are to be sent.
    pub(crate) fn load(
        &mut self,
        world: usize,
        model: &Model,
        handle: &RobotHandle,
        data: &Data,
        set: &SetPoints,
        suction: &Suction,
    ) {
        let mut numbers = vec![(robot::STOPPED, 0.0), (robot::FAULT, 0.0)];
        for (own, &body) in self.alone.model.body_ids().zip(&handle.bodies) {
            for (dof, (q, v)) in self.alone.model.dofs(own).zip(model.qs(body).zip(model.dofs(body))) {
                numbers.extend([(robot::Q + dof, data.q[q]), (robot::V + dof, data.v[v])]);
            }
        }
        let base = match &handle.base_joint {
            BaseJoint::Rail { axis_base, .. } => {
                [axis_base.x * set.base_velocity[0] + axis_base.y * set.base_velocity[1], 0.0, 0.0]
            }
            _ => set.base_velocity,
        };
        for (field, values) in [
            (robot::BASE_TARGET, &base[..]),
            (robot::ARM_TARGET, &set.arm_target[..]),
            (robot::ARM_RATE, &set.arm_rate[..]),
            (robot::FINGER_TARGET, &set.finger_target[..]),
        ] {
            numbers.extend(values.iter().enumerate().map(|(k, value)| (field + k, *value)));
        }
        for (field, value) in numbers {
            self.states[row_place(world, field, robot::FIELDS)] = value as f32;
        }
        for (field, value) in fields_of(suction) {
            self.states[row_place(world, field, robot::FIELDS)] = value;
        }
    }

    /// The quads of a robot's state on the host.
    pub(crate) fn state_quads(&self, world: usize) -> impl Iterator<Item = (u32, [f32; QUAD])> {
        Self::quad_places(world)
            .map(move |at| (at, std::array::from_fn(|k| self.states[QUAD * at as usize + k])))
    }
}

impl Alone {
    /// Writes coordinates and velocities, given as the fields of a robot's state, into a state of a model that holds this robot.
    pub(crate) fn store(
        &self,
        number: impl Fn(usize) -> f32,
        model: &Model,
        handle: &RobotHandle,
        data: &mut Data,
    ) {
        for (own, &body) in self.model.body_ids().zip(&handle.bodies) {
            for (dof, (q, v)) in self.model.dofs(own).zip(model.qs(body).zip(model.dofs(body))) {
                data.q[q] = f64::from(number(robot::Q + dof));
                data.v[v] = f64::from(number(robot::V + dof));
            }
        }
    }
}

/// Set points of the servos, given as the fields of a robot's state.
pub(crate) fn set_points(number: impl Fn(usize) -> f32, handle: &RobotHandle) -> SetPoints {
    let number = |field: usize| f64::from(number(field));
    let base_velocity = match &handle.base_joint {
        BaseJoint::Rail { axis_base, .. } => {
            let speed = number(robot::BASE_TARGET);
            [axis_base.x * speed, axis_base.y * speed, 0.0]
        }
        _ => std::array::from_fn(|k| number(robot::BASE_TARGET + k)),
    };
    let arm = handle.arm.len();
    SetPoints {
        base_velocity,
        arm_target: JointValues::from_fn(arm, |k| number(robot::ARM_TARGET + k)),
        arm_rate: JointValues::from_fn(arm, |k| number(robot::ARM_RATE + k)),
        finger_target: std::array::from_fn(|k| number(robot::FINGER_TARGET + k)),
    }
}

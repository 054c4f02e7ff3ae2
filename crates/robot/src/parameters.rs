//! Config of the inverse kinematics as plain numbers in SI units.

use crate::config::{IkConfig, RobotConfig};

/// Config of the inverse kinematics by damped least squares, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct IkParameters {
    pub iterations: u32,
    pub restarts: u32,
    pub damping: f64,
    pub step_max: f64,
    pub position_tolerance: f64,
    pub angle_tolerance: f64,
    pub home_gain: f64,
}

impl IkParameters {
    pub fn new(config: &IkConfig) -> Self {
        Self {
            iterations: config.iterations.get(),
            restarts: config.restarts.get(),
            damping: config.damping.si(),
            step_max: config.step_max.si(),
            position_tolerance: config.position_tolerance.si(),
            angle_tolerance: config.angle_tolerance.si(),
            home_gain: config.home_gain.si(),
        }
    }
}

/// Config of the inverse kinematics by quadratic programs, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct QpParameters {
    pub acceleration: f64,
    pub angle_weight: f64,
    pub damping: f64,
    pub posture_gain: f64,
    pub influence: f64,
    pub approach_rate: f64,
    pub self_clearance: f64,
    pub self_penalty: f64,
    pub canopy_rows: usize,
    pub iterations: u32,
}

impl QpParameters {
    pub fn new(config: &RobotConfig) -> Self {
        let c = &config.qp;
        Self {
            acceleration: config.arm.acceleration_max.si(),
            angle_weight: c.angle_weight.si(),
            damping: c.damping.si(),
            posture_gain: c.posture_gain.si(),
            influence: c.influence.si(),
            approach_rate: c.approach_rate.si(),
            self_clearance: c.self_clearance.si(),
            self_penalty: c.self_penalty.si(),
            canopy_rows: c.canopy_rows.get() as usize,
            iterations: c.iterations.get(),
        }
    }
}

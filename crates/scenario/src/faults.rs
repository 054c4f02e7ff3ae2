//! Faults of sensors and hand, between a robot and its controller.
//!
//! A filter changes what the controller observes, and what the robot is told. The controller learns of a fault only by that. Limbs that fall
//! and weights on the arm are the world's.

use std::collections::VecDeque;
use std::sync::Arc;

use orchard_geometry::{DepthImage, math};
use orchard_picker::{Controller, Event, Record};
use orchard_robot::{Command, Observation, RobotModel};
use orchard_spec::fault::{FaultKind, FaultSpec};

/// A controller behind a fault.
pub(crate) struct Faulty {
    controller: Box<dyn Controller>,
    robot: Arc<RobotModel>,
    fault: FaultSpec,
    /// Last image before a camera froze.
    image: Option<DepthImage>,
    /// Images that come late, with the times at which they were taken \[s\].
    late: VecDeque<(DepthImage, f64)>,
    /// True while the fingers stand open, where they can stick.
    open: bool,
    /// Number of events of the controller that have been read, and the time until which the fingers lose a fruit \[s\].
    events: usize,
    open_until: f64,
}

impl Faulty {
    /// Puts a controller behind a fault; without a fault it is returned as it is.
    pub fn wrap(
        controller: Box<dyn Controller>,
        fault: Option<&FaultSpec>,
        robot: &Arc<RobotModel>,
    ) -> Box<dyn Controller> {
        let of_world = |fault: &&FaultSpec| {
            matches!(fault.kind, FaultKind::None | FaultKind::LimbFalls | FaultKind::WeightOnArm)
        };
        match fault.filter(|fault| !of_world(fault)) {
            None => controller,
            Some(fault) => Box::new(Self {
                controller,
                robot: robot.clone(),
                fault: fault.clone(),
                image: None,
                late: VecDeque::new(),
                open: false,
                events: 0,
                open_until: f64::NEG_INFINITY,
            }),
        }
    }

    /// Changes an observation as the fault does.
    fn sensed(&mut self, seen: &Observation) -> Observation {
        let mut seen = seen.clone();
        let (lasts, fault) = (self.fault.lasts(seen.time), &self.fault);
        match fault.kind {
            FaultKind::CameraDead if lasts => seen.depth = None,
            FaultKind::CameraFrozen if lasts => {
                seen.depth = seen.depth.and_then(|_| self.image.clone());
            }
            FaultKind::CameraFrozen => self.image = seen.depth.clone().or(self.image.take()),
            FaultKind::CameraLate => {
                if lasts && let Some(depth) = seen.depth.take() {
                    self.late.push_back((depth, seen.depth_time));
                }
                if let Some((_, taken)) = self.late.front()
                    && seen.time >= taken + fault.delay.si()
                    && let Some((depth, taken)) = self.late.pop_front()
                {
                    (seen.depth, seen.depth_time) = (Some(depth), taken);
                }
            }
            FaultKind::CameraBlank if lasts => {
                let blank = |depth: DepthImage| DepthImage::filled(depth.width(), depth.height(), f32::NAN);
                seen.depth = seen.depth.map(blank);
            }
            FaultKind::OdometryJump if seen.time >= fault.from.si() => {
                let (sin, cos) = math::sin_cos(fault.turn.si());
                let turned = |x: f64, y: f64| [cos * x - sin * y, sin * x + cos * y];
                let ([x, y, yaw], [vx, vy, rate]) = (seen.base_pose, seen.base_velocity);
                let ([x, y], [vx, vy]) = (turned(x, y), turned(vx, vy));
                seen.base_pose = [x + fault.distance.si(), y, yaw + fault.turn.si()];
                seen.base_velocity = [vx, vy, rate];
            }
            FaultKind::ReadingNotFinite if lasts => {
                if let Some(first) = seen.arm_q.first_mut() {
                    *first = f64::NAN;
                }
            }
            _ => {}
        }
        seen
    }

    /// Changes a command as the fault does.
    fn obeyed(&mut self, command: Command, time: f64) -> Command {
        let lasts = self.fault.lasts(time);
        match self.fault.kind {
            FaultKind::FingersStuck => {
                let stroke = self.robot.kinematics().finger_stroke();
                self.open = command.finger_q >= stroke || (lasts && self.open);
                Command { finger_q: if self.open { stroke } else { command.finger_q }, ..command }
            }
            FaultKind::FruitLost => {
                let record = self.controller.record();
                let new = record.events.get(self.events..).unwrap_or_default();
                let carries = new.iter().any(|event| matches!(event, Event::StemGaveWay { .. }));
                self.events = record.events.len();
                if carries && lasts {
                    self.open_until = time + 2.0 * self.fault.slip.si();
                }
                let opens = (self.open_until - self.fault.slip.si()..self.open_until).contains(&time);
                let stroke = self.robot.kinematics().finger_stroke();
                Command { finger_q: if opens { stroke } else { command.finger_q }, ..command }
            }
            _ => command,
        }
    }
}

impl Controller for Faulty {
    fn act(&mut self, observation: &Observation) -> Command {
        let seen = self.sensed(observation);
        let command = self.controller.act(&seen);
        self.obeyed(command, observation.time)
    }

    fn record(&self) -> &Record {
        self.controller.record()
    }
}

//! Faults of sensors and hand, between a robot and its controller.
//!
//! A filter changes what the controller observes, and what the robot is told. The controller learns of a fault only by that. Limbs that fall
//! and weights on the arm are the world's.

use std::collections::VecDeque;
use std::sync::Arc;

use orchard_geometry::{DepthImage, Image, math};
use orchard_picker::{Controller, Event, Record};
use orchard_robot::{Command, Observation, RobotModel};
use orchard_spec::fault::{FaultKind, FaultSpec};

/// A controller behind a fault.
pub(crate) struct Faulty {
    controller: Box<dyn Controller>,
    robot: Arc<RobotModel>,
    fault: FaultSpec,
    /// Last image before a camera froze.
    image: Option<Shot>,
    /// Images that come late, with the times at which they were taken \[s\].
    late: VecDeque<(Shot, f64)>,
    /// True while the fingers stand open, where they can stick.
    open: bool,
    /// Number of events of the controller that have been read, and the time until which the fingers lose a fruit \[s\].
    events: usize,
    open_until: f64,
}

/// An image of the camera: depth, and colour if the camera takes some.
#[derive(Clone)]
struct Shot {
    depth: DepthImage,
    colour: Option<Arc<Image<[u8; 3]>>>,
}

impl Shot {
    /// Takes the image out of an observation.
    fn taken_from(seen: &mut Observation) -> Option<Self> {
        let colour = seen.colour.take();
        Some(Self { depth: seen.depth.take()?, colour })
    }

    /// Puts an image into an observation that has none.
    fn shown_in(shot: Option<Self>, seen: &mut Observation) {
        (seen.depth, seen.colour) = shot.map_or((None, None), |shot| (Some(shot.depth), shot.colour));
    }

    /// An image of the same size without a measurement, and black.
    fn blank(self) -> Self {
        let black =
            |image: Arc<Image<[u8; 3]>>| Arc::new(Image::filled(image.width(), image.height(), [0; 3]));
        let depth = DepthImage::filled(self.depth.width(), self.depth.height(), f32::NAN);
        Self { depth, colour: self.colour.map(black) }
    }
}

impl Faulty {
    /// Puts a controller behind a fault; without a fault it is returned as it is.
    pub fn wrap(
        controller: Box<dyn Controller>,
        fault: Option<&FaultSpec>,
        robot: &Arc<RobotModel>,
    ) -> Box<dyn Controller> {
        match fault.filter(|fault| fault.kind.is_between()) {
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
            FaultKind::CameraDead if lasts => Shot::shown_in(None, &mut seen),
            FaultKind::CameraFrozen if lasts => {
                let frozen = Shot::taken_from(&mut seen).and_then(|_| self.image.clone());
                Shot::shown_in(frozen, &mut seen);
            }
            FaultKind::CameraFrozen => {
                let shot = Shot::taken_from(&mut seen);
                Shot::shown_in(shot.clone(), &mut seen);
                self.image = shot.or(self.image.take());
            }
            FaultKind::CameraLate => {
                if lasts && let Some(shot) = Shot::taken_from(&mut seen) {
                    self.late.push_back((shot, seen.depth_time));
                }
                if let Some((_, taken)) = self.late.front()
                    && seen.time >= taken + fault.delay.si()
                    && let Some((shot, taken)) = self.late.pop_front()
                {
                    Shot::shown_in(Some(shot), &mut seen);
                    seen.depth_time = taken;
                }
            }
            FaultKind::CameraBlank if lasts => {
                let blank = Shot::taken_from(&mut seen).map(Shot::blank);
                Shot::shown_in(blank, &mut seen);
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

    fn run_ends_at(&mut self, time: f64) {
        self.controller.run_ends_at(time);
    }

    fn record(&self) -> &Record {
        self.controller.record()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scenario;
    use orchard_geometry::Vec3;
    use orchard_picker::Goal;
    use orchard_spec::Spec;

    /// Stands still and has a record.
    #[derive(Default)]
    struct Still(Record);

    impl Controller for Still {
        fn act(&mut self, seen: &Observation) -> Command {
            Command::still(seen)
        }

        fn record(&self) -> &Record {
            &self.0
        }
    }

    /// Frames of 0.1 s before, in and after a fault from 1 s to 2 s; each brings an image whose depth is its time.
    fn frames(kind: &str, mut each: impl FnMut(f64, &Observation, &mut Faulty)) {
        let scenario = Scenario::of(&[]).expect("built in");
        let time =
            |value: f64| format!("{{ value = {value}, range = [0, 100], unit = 's', source = 'test' }}");
        let text = format!(
            "[fault]\nbase = 'standard'\nkind = '{kind}'\nfrom = {}\nuntil = {}\ndelay = {}",
            time(1.0),
            time(2.0),
            time(0.25)
        );
        let spec: Spec = scenario.spec().overlaid("x", text.parse().expect("TOML")).expect("in range");
        let fault = spec.fault.clone().expect("a fault");
        let mut faulty = Faulty {
            controller: Box::new(Still::default()),
            robot: scenario.robot().clone(),
            fault,
            image: None,
            late: VecDeque::new(),
            open: false,
            events: 0,
            open_until: f64::NEG_INFINITY,
        };
        let still = scenario.world(1, 0, 0).expect("it grows").sense();
        for k in 0..30 {
            let time = 0.1 * f64::from(k);
            let depth = Some(DepthImage::filled(4, 3, time as f32));
            let colour = Some(Arc::new(Image::filled(4, 3, [k as u8 + 1; 3])));
            let base_pose = [1.0, 0.0, 0.0];
            let seen = Observation { time, depth, colour, depth_time: time, base_pose, ..still.clone() };
            let changed = faulty.sensed(&seen);
            each(time, &changed, &mut faulty);
        }
    }

    /// True while the fault of [`frames`] lasts.
    fn lasts(time: f64) -> bool {
        (1.0..2.0).contains(&time)
    }

    /// A controller with a goal is behind the fault too: one whose first joint reads no number says so.
    #[test]
    fn faults_reach_component_tasks() {
        let scenario = Scenario::of(&[("controller", "expert")]).expect("built in");
        let fault = |kind: &str| {
            format!(
                "[fault]\nbase = 'standard'\nkind = '{kind}'\nfrom = {{ value = 0.0, range = [0, 100], unit = 's', source = 'test' }}"
            )
        };
        let seen = scenario.world(1, 0, 0).expect("it grows").sense();
        let tell = |kind: &str| {
            let spec = scenario.spec().overlaid("x", fault(kind).parse().expect("TOML")).expect("in range");
            let goal = Goal::Grasp { p_odom: Vec3::new(1.0, 0.0, 1.0), radius: 0.035 };
            let mut controller =
                scenario.with_spec(spec).controller_with_goal(&goal).expect("it takes goals");
            controller.act(&seen);
            format!("{:?}", controller.record().events)
        };
        assert!(!tell("none").contains("Alarm") && tell("reading_not_finite").contains("ReadingNotFinite"));
    }

    #[test]
    fn a_camera_fails_for_a_time() {
        frames("none", |time, seen, _| assert_eq!(seen.depth, Some(DepthImage::filled(4, 3, time as f32))));
        frames("camera_dead", |time, seen, _| assert_eq!(seen.depth.is_none(), lasts(time)));
        frames("camera_frozen", |time, seen, _| {
            let shown = if lasts(time) { 0.9 } else { time };
            let first = seen.depth.as_ref().map(|depth| f64::from(depth.pixels()[0]));
            assert!(first.is_some_and(|first| (first - shown).abs() < 1e-6), "{time}: {first:?}");
            assert_eq!(seen.depth_time, time);
        });
        frames("camera_blank", |time, seen, _| {
            assert_eq!(seen.depth.as_ref().is_some_and(|depth| depth.pixels()[0].is_nan()), lasts(time));
        });
        let mut images = 0;
        frames("camera_late", |time, seen, _| {
            images += u32::from(seen.depth.is_some());
            let age = time - seen.depth_time;
            assert!(seen.depth.is_none() || age == 0.0 || (0.25..0.35).contains(&age), "{time}: {age}");
            // Late images come in the place of new ones.
            let is_new = seen.depth.is_some() && age == 0.0;
            assert!(!(is_new && lasts(time)), "{time}");
        });
        assert!(images < 30 && images > 24, "{images}");
    }

    #[test]
    fn odometry_jumps_once_and_readings_are_lost() {
        frames("odometry_jump", |time, seen, _| {
            let off = time >= 1.0;
            let (sin, cos) = math::sin_cos(20.0_f64.to_radians());
            let expected = if off { [cos + 0.5, sin, 20.0_f64.to_radians()] } else { [1.0, 0.0, 0.0] };
            let differs = (0..3).any(|k| (seen.base_pose[k] - expected[k]).abs() > 1e-12);
            assert!(!differs, "{time}: {:?}", seen.base_pose);
        });
        frames("reading_not_finite", |time, seen, _| assert_eq!(seen.arm_q[0].is_nan(), lasts(time)));
    }

    /// Fingers that stand open when the fault begins stay so until its end, whatever is commanded.
    #[test]
    fn fingers_stick() {
        frames("fingers_stuck", |time, seen, faulty| {
            let stroke = faulty.robot.kinematics().finger_stroke();
            let closing = Command { finger_q: 0.0, ..Command::still(seen) };
            let opening = Command { finger_q: stroke, ..closing };
            if time < 1.0 {
                assert_eq!(faulty.obeyed(closing, time).finger_q, 0.0);
                assert_eq!(faulty.obeyed(opening, time).finger_q, stroke);
            } else {
                assert_eq!(faulty.obeyed(closing, time).finger_q, if lasts(time) { stroke } else { 0.0 });
            }
        });
    }

    /// A stem that breaks while the fault lasts has the fingers open once, later.
    #[test]
    fn a_fruit_is_lost() {
        let mut open = Vec::new();
        frames("fruit_lost", |time, seen, faulty| {
            let mut record = Record::default();
            if time >= 1.2 {
                record.events.push(Event::StemGaveWay { time: 1.2, id: 0, pull: 20.0 });
            }
            faulty.controller = Box::new(Still(record));
            if faulty.obeyed(Command { finger_q: 0.0, ..Command::still(seen) }, time).finger_q > 0.0 {
                open.push(time);
            }
        });
        assert!((2..=4).contains(&open.len()) && open.iter().all(|t| (1.4..1.85).contains(t)), "{open:?}");
    }
}

//! The changing part of a world, and the step of a frame.

mod exchange;
mod loose;

use crate::build::Parts;
use crate::camera::{CameraTruth, Flight, Shot, Shutter};
use crate::event::{Status, WorldEvent};
use crate::load::WoodLoad;
use crate::sensing::Odometry;
use crate::suction;
use crate::touch::{FruitTouch, fruit_touches};
use loose::{Loose, Within};
use orchard_fruit::{FruitLives, RestRule, Touch, is_gripped};
use orchard_geometry::{Pose, Vec3};
use orchard_multibody::contact::Vicinity;
use orchard_multibody::{Data, Groups, Model, Motion, StepReport, step};
use orchard_robot::{Command, RobotHandle, RobotModel, Servos, Suction};
use orchard_spec::Spec;
use orchard_treephys::Rupture;
use std::collections::VecDeque;
use std::sync::Arc;

/// State of a world: everything that a frame changes.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub data: Data,
    pub rupture: Rupture,
    pub fruit: FruitLives,
    pub servos: Servos,
    /// Vacuum of the suction cup.
    pub suction: Suction,
    pub frame: u32,
    pub status: Status,
    pub events: Vec<WorldEvent>,
    pub gripped: Vec<bool>,
    /// Contacts of each fruit, from the step report.
    pub touches: Vec<FruitTouch>,
    /// Contacts of each fruit in the frame before; scratch of the end of a frame.
    pub touches_before: Vec<FruitTouch>,
    /// Contacts of each fruit as its rules need them; scratch of the end of a frame.
    pub touched: Vec<Touch>,
    pub report: StepReport,
    /// Scratch of loose fruit.
    pub loose: Loose,
    /// Motion at the start of the latest substep.
    pub before: Motion,
    pub image: Option<Arc<CameraTruth>>,
    /// Motion that the image was drawn from.
    pub shot: Option<Shot>,
    /// Motions that the next images will be drawn from.
    pub flight: Flight,
    /// Loads of the robot on the wood.
    pub load: WoodLoad,
    /// Odometry of the base.
    pub odometry: Odometry,
    /// Commands on their way to the robot, oldest first.
    pub commands: VecDeque<Command>,
    /// Scratch of [`World::outlook`](crate::World::outlook).
    pub vicinity: Vicinity,
    /// Speed of each collider, 0 but of the robot's [m/s]; scratch of the same.
    pub speeds: Vec<f64>,
    /// Groups of each collider without the contacts of robot and tree; scratch of the same.
    pub groups_beside: Vec<Groups>,
    /// True while wood and fruit are those of an earlier frame than the robot ([`World::is_behind`](crate::World::is_behind)).
    pub is_behind: bool,
}

impl State {
    /// The start of an episode.
    pub fn new(parts: &Parts, robot: &RobotModel, data: Data, shutter: Shutter) -> Self {
        let n = parts.fruit.len();
        let mut flight = Flight::default();
        flight.end_frame(shutter, 0, &data);
        let load = WoodLoad::at_start(&parts.tree, &parts.model, &data);
        let odometry = Odometry::at(parts.handle.base_joint.pose(&parts.model, &data));
        let commands =
            parts.sensing.as_ref().map(|sensing| sensing.first_commands(robot)).unwrap_or_default();
        Self {
            rupture: Rupture::new(&parts.tree),
            fruit: FruitLives::new(&parts.fruit),
            servos: Servos::new(robot),
            suction: Suction::default(),
            data,
            frame: 0,
            status: Status::Running,
            events: Vec::new(),
            gripped: vec![false; n],
            touches: vec![FruitTouch::default(); n],
            touches_before: vec![FruitTouch::default(); n],
            touched: vec![Touch::default(); n],
            report: StepReport::default(),
            loose: Loose::default(),
            before: Motion::default(),
            image: None,
            shot: None,
            flight,
            load,
            odometry,
            commands,
            vicinity: Vicinity::default(),
            speeds: Vec::new(),
            groups_beside: Vec::new(),
            is_behind: false,
        }
    }

    /// Advances one frame; `start` is the state at the start of the episode.
    pub fn advance(&mut self, spec: &Spec, parts: &Parts, start: &Data, command: &Command) {
        let command = &self.begin(spec, parts, command);
        for left in (0..spec.sim.substeps.get()).rev() {
            if self.data.is_finite() {
                self.substep(spec, parts, command, f64::from(left) * parts.settings.h);
            }
        }
        self.finish(spec, parts, start, command.vacuum);
    }

    /// Begins a frame; returns the command that acts in it.
    pub fn begin(&mut self, spec: &Spec, parts: &Parts, command: &Command) -> Command {
        self.commands.push_back(*command);
        let command = self.commands.pop_front().unwrap_or(*command);
        self.begin_loose(spec, parts);
        self.load.begin_frame();
        self.weigh_on_arm(spec, parts);
        if let Some(wind) = &parts.wind {
            let time = f64::from(self.frame) * spec.sim.frame();
            let Parts { tree, model, fruit, .. } = parts;
            wind.blow(tree, fruit.balls(), &self.rupture, model, &mut self.data, time);
        }
        command
    }

    /// Ends a frame after its motion; `start` is the state at the start of the episode, `valve` the commanded opening between pump and cup.
    pub fn finish(&mut self, spec: &Spec, parts: &Parts, start: &Data, valve: f64) {
        self.count_frame(parts);
        let Parts { tree, model, .. } = parts;
        // Before rupture: a joint that breaks now has borne this frame's moment.
        self.load.end_frame(tree, model, &self.data, start, &self.rupture, spec.sim.frame());
        self.end_frame(spec, parts, valve);
    }

    /// Counts a frame after its motion; the wheels measure their way.
    pub fn count_frame(&mut self, parts: &Parts) {
        self.frame += 1;
        if let Some(sensing) = &parts.sensing {
            let exact = parts.handle.base_joint.pose(&parts.model, &self.data);
            sensing.travel(&mut self.odometry, exact, self.frame);
        }
    }

    /// True if nothing happens to wood and fruit: nothing has broken or come off, is gripped or pressed, or counts frames over a limit.
    pub fn is_calm(&self) -> bool {
        let untouched = FruitTouch::default();
        self.status == Status::Running
            && self.touches.iter().all(|touch| *touch == untouched)
            && !self.gripped.contains(&true)
            && self.rupture.is_calm()
            && self.fruit.are_calm()
    }

    /// `remaining`: what is left of the frame after it \[s\].
    fn substep(&mut self, spec: &Spec, parts: &Parts, command: &Command, remaining: f64) {
        let Parts { model, handle, settings, .. } = parts;
        let (h, gravity) = (settings.h, &settings.gravity);
        let twist = self.data.velocity(handle.base);
        let x_world_base = handle.x_world_base(&self.data);
        let ride_height = parts.ground.ride_height_ahead(&x_world_base, &twist.linear, twist.angular.z);
        let height = ride_height - parts.x_world_odom.translation.z;
        self.servos.apply(model, &mut self.data, handle, command, height, gravity, h, remaining);
        self.rupture.begin_substep(&parts.tree, model, &mut self.data, &spec.wood, h);
        self.data.save_motion(&mut self.before);
        self.keep_velocities(parts);
        let Self { data, fruit, report, suction, .. } = self;
        let pull = suction::begin_substep(suction, parts, data, fruit, report, command.vacuum);
        step(model, &mut self.data, settings, &mut self.report);
        // Each repetition caps at least one more joint.
        while self.servos.cap_overshoot(model, &mut self.data, handle) {
            self.data.restore_motion(&self.before);
            step(model, &mut self.data, settings, &mut self.report);
        }
        if let Some(pull) = pull {
            pull.end_substep(&mut self.data);
        }
        self.load.add_substep(&parts.colliders, &self.report, h);
        self.end_substep(parts, h);
    }

    /// Ends a substep after its motion: stems, which wear by `h` \[s\], sleeping fruit, loose fruit.
    fn end_substep(&mut self, parts: &Parts, h: f64) {
        self.bear(parts, h);
        self.step_loose(parts);
    }

    /// Ends the motion of a frame that was lent: stems, which have worn already, sleeping fruit, and loose fruit, which move here beside the robot and through all substeps.
    pub fn end_lent_motion(&mut self, spec: &Spec, parts: &Parts) {
        self.bear(parts, 0.0);
        let of = spec.sim.substeps.get();
        for substep in 1..of {
            self.step_loose_within(parts, Within { substep, of, h: parts.settings.h });
        }
        self.step_loose(parts);
    }

    /// Notes the tensions of the stems, which wear by `h` \[s\], and keeps sleeping fruit in their places.
    fn bear(&mut self, parts: &Parts, h: f64) {
        let Parts { model, handle, .. } = parts;
        let (x_world_base, velocity) = bucket_motion(&self.data, handle);
        self.fruit.end_substep(&parts.fruit, model, &mut self.data, h, &x_world_base, velocity);
    }

    /// `valve`: the commanded opening between pump and cup.
    fn end_frame(&mut self, spec: &Spec, parts: &Parts, valve: f64) {
        let frame = self.frame;
        let gravity = spec.sim.gravity.si();
        for segment in self.rupture.end_frame(&parts.tree, &parts.model, &mut self.data, &spec.wood, gravity)
        {
            self.events.push(WorldEvent::BranchSnapped { segment, frame });
        }
        parts.fruit.weigh_on(&mut self.data, |segment| self.rupture.is_debris(segment));

        std::mem::swap(&mut self.touches, &mut self.touches_before);
        let sealed = suction::sealed(&self.suction, parts);
        fruit_touches(&parts.colliders, &self.report, sealed, &mut self.touches);
        let (x_world_base, base_velocity) = bucket_motion(&self.data, &parts.handle);
        self.end_touches(spec, parts, &x_world_base);
        self.note_finger_contacts();
        self.note_grips();
        self.note_lost_seals(valve);
        let rest = RestRule {
            speed: spec.sim.sleep_speed.si(),
            frames: (spec.sim.sleep_time.si() * spec.sim.frame_rate.si()).round() as u32,
        };
        let events = self.fruit.end_frame(
            &parts.fruit,
            &parts.model,
            &mut self.data,
            &spec.fruit,
            &self.touched,
            rest,
            base_velocity,
        );
        self.fruit.hand_over(&parts.fruit, &mut self.data, &spec.fruit, &self.touched);
        self.end_loose(spec, parts, rest, &x_world_base);
        self.exchange_bucket(spec, parts, &x_world_base);
        self.events.extend(events.into_iter().map(|event| WorldEvent::of_fruit(event, frame)));
    }

    /// Emits an event for each fruit that the fingers or the cup begin or cease to press on.
    fn note_finger_contacts(&mut self) {
        let frame = self.frame;
        for (fruit, (before, now)) in self.touches_before.iter().zip(&self.touches).enumerate() {
            match (before.by_finger(), now.by_finger()) {
                (false, true) => self.events.push(WorldEvent::FingerContactBegan { fruit, frame }),
                (true, false) => self.events.push(WorldEvent::FingerContactEnded { fruit, frame }),
                _ => {}
            }
        }
    }

    /// Emits `FruitGripped` when both fingers begin to touch a fruit or the cup seals on it, and clears the mark when no finger and no cup touches
    /// it.
    fn note_grips(&mut self) {
        for (i, t) in self.touches.iter().enumerate() {
            let gripped = is_gripped(self.gripped[i], t.grip());
            if gripped && !self.gripped[i] {
                self.events.push(WorldEvent::FruitGripped { fruit: i, frame: self.frame });
            }
            self.gripped[i] = gripped;
        }
    }

    /// Emits an event for the fruit whose seal the cup has lost although its valve is open; a vented cup lets go on purpose.
    fn note_lost_seals(&mut self, valve: f64) {
        if valve.is_nan() || valve <= 0.0 {
            return;
        }
        let frame = self.frame;
        for (fruit, (before, now)) in self.touches_before.iter().zip(&self.touches).enumerate() {
            if before.sealed && !now.sealed {
                self.events.push(WorldEvent::SealLost { fruit, frame });
            }
        }
    }

    /// False if a number of the robot is not finite, or one of its bodies is outside the plausible box.
    pub fn is_robot_plausible(&self, parts: &Parts, extent: f64) -> bool {
        let Self { data, .. } = self;
        parts.handle.bodies.iter().all(|&body| {
            let near = |x: &f64| x.abs() <= extent;
            let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
            finite(&data.q[parts.model.qs(body)])
                && finite(&data.v[parts.model.dofs(body)])
                && data.x_world_body(body).translation.vector.iter().all(near)
        })
    }

    /// Returns a description of the first part that is non-finite or outside the plausible box, if any.
    pub fn implausible(&self, model: &Model, extent: f64) -> Option<String> {
        let data = &self.data;
        let state = data.q.iter().chain(&data.v);
        if let Some(i) = state.clone().position(|x| !x.is_finite()) {
            return Some(format!("joint state {i} is not finite"));
        }
        if !data.is_finite() {
            return Some("the motion of a fruit is not finite".to_owned());
        }
        let far = |p: &Vec3| !p.iter().all(|x| x.abs() <= extent);
        if let Some(i) = data.point_p_world.iter().position(far) {
            return Some(format!("fruit {i} left the plausible box of {extent} m"));
        }
        model
            .body_ids()
            .find(|&id| far(&data.x_world_body(id).translation.vector))
            .map(|id| format!("body {} left the plausible box of {extent} m", id.index()))
    }
}

/// Pose of the bucket's frame, the base, and the velocity of its points.
fn bucket_motion(data: &Data, handle: &RobotHandle) -> (Pose, impl Fn(&Vec3) -> Vec3 + use<>) {
    let twist = data.velocity(handle.base);
    let p_body = data.x_world_body(handle.base).translation.vector;
    let velocity = move |p_world: &Vec3| twist.linear + twist.angular.cross(&(p_world - p_body));
    (handle.x_world_base(data), velocity)
}

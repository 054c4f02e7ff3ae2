//! Core of the controllers of this crate: perception, arm motion, fingers, the current attempt and the record.

use crate::blacklist::Blacklist;
use crate::cloud::SeenPoint;
use crate::config::PickerConfig;
use crate::drive::BaseGoal;
use crate::mobility::Mobility;
use crate::motion::ArmMotion;
use crate::perception::Perception;
use crate::plan::{GraspPlan, Search, Target, look_posture};
use crate::postures::Postures;
use crate::record::{Alarm, AttemptEnd, AttemptId, Event, Record, State};
use crate::robot_state::{Memory, RobotState};
use crate::row::Side;
use crate::task::AssignedTask;
use crate::trail::Trail;
use crate::walls::Walls;
use crate::watch::Watch;
use orchard_geometry::{DepthImage, Intrinsics, Pose, Vec3, inverse_transform};
use orchard_perception::{DetectorConfig, RgbdImage, Track};
use orchard_robot::{ArmKinematics, Command, JointValues, JointVector, Observation, RobotModel, Wrench};

/// Sensing, belief and set points of a picker; its state machine makes the decisions.
#[derive(Debug, Clone)]
pub(crate) struct PickerCore {
    pub arm: ArmKinematics,
    pub mobility: Mobility,
    pub config: PickerConfig,
    pub perception: Perception,
    pub motion: ArmMotion,
    pub postures: Postures,
    pub blacklist: Blacklist,
    pub walls: Walls,
    pub trail: Trail,
    /// Side of a row on which the base works.
    pub side: Side,
    /// Watch for faults; `None` for a controller that keeps none.
    pub watch: Option<Watch>,
    pub fingers: Fingers,
    pub attempt: Option<Attempt>,
    /// Assigned task; `None` for a harvest.
    pub task: Option<AssignedTask>,
    /// True if this frame brought an image taken from the arm's present posture.
    pub fresh_image: bool,
    /// State of the robot when this frame's image was taken, and the camera's intrinsics; `None` without an image.
    pub imaged: Option<(RobotState, Intrinsics)>,
    state: State,
    state_start: f64,
    held_for: f64,
    /// Time for which the arm has been at rest after the end of its motion \[s\].
    rested_for: f64,
    next_attempt: AttemptId,
    last_time: Option<f64>,
    memory: Memory,
    last_command: Command,
    /// Positions \[rad\] and velocities [rad/s] after this frame's motion.
    advanced: Option<(JointVector, JointVector)>,
    record: Record,
}

/// Command to the hand: opening of each finger \[m\], largest force \[N\] and opening of the valve of a suction cup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fingers {
    pub opening: f64,
    pub force: f64,
    pub vacuum: f64,
}

/// A committed target.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Attempt {
    pub id: AttemptId,
    pub track: u32,
    /// Number of images that showed the track.
    pub hits: u32,
    /// Best estimate of the fruit, odom.
    pub target: Target,
    /// Plan of the grasp, base frame.
    pub plan: GraspPlan,
}

/// Velocity of a base that stands still.
pub(crate) const STILL: [f64; 3] = [0.0; 3];

impl PickerCore {
    /// Makes the core for one robot; `state` is the controller's first state.
    pub fn new(robot: &RobotModel, detector: DetectorConfig, config: PickerConfig, state: State) -> Self {
        let arm = robot.kinematics().clone();
        let room = &config.align;
        let deck = Vec3::new(room.body_half_x.si(), room.body_half_y.si(), f64::INFINITY);
        Self {
            mobility: Mobility::of(robot),
            postures: Postures::new(&arm, &robot.bucket(), &config),
            perception: Perception::new(detector, &config, deck),
            motion: ArmMotion::new(arm.home()),
            blacklist: Blacklist::new(&config.blacklist),
            walls: Walls::default(),
            trail: Trail::default(),
            side: Side::default(),
            watch: None,
            fingers: Fingers {
                opening: config.grasp.opening.si(),
                force: config.grasp.force.si(),
                vacuum: 0.0,
            },
            attempt: None,
            task: None,
            fresh_image: false,
            imaged: None,
            state,
            state_start: 0.0,
            held_for: 0.0,
            rested_for: 0.0,
            next_attempt: 0,
            last_time: None,
            memory: Memory::new(&config.sensors),
            last_command: robot.start_command(),
            advanced: None,
            record: Record::default(),
            arm,
            config,
        }
    }

    /// Reads the sensors, processes the image and advances the arm's set point. Returns `None` if a reading is not finite.
    pub fn sense(&mut self, observation: &Observation) -> Option<RobotState> {
        let mut robot = RobotState::read(observation, self.last_time, &self.config.sensors)?;
        let gap = self.config.sensors.longest_step.si();
        let jumped = self.watch.as_mut().is_some_and(|w| w.bridge(&mut robot, self.memory.last(), gap));
        if jumped {
            self.record.events.push(Event::Alarm { time: robot.time, alarm: Alarm::OdometryJump });
        }
        if let Some(last) = self.memory.last() {
            robot.accelerate_from(last);
        }
        if self.last_time.is_none() {
            self.yield_arm(&robot);
            self.record.events.push(Event::StateChanged { time: robot.time, state: self.state });
            self.state_start = robot.time;
        }
        self.last_time = Some(robot.time);
        self.memory.keep(&robot);
        self.trail.keep(&robot);
        self.fresh_image = false;
        self.imaged = None;
        if let Some(depth) = &observation.depth
            && let Some(then) = self.placed(depth, observation.depth_time)
        {
            let then = &then;
            let image = RgbdImage { depth, colour: observation.colour.as_deref() };
            let scans = self.state == State::Scan && self.mobility.is_free();
            let wires = Some(&self.config.wires).filter(|c| scans && c.points.get() > 0);
            let report = self.perception.see(image, &observation.intrinsics, then, &self.arm, wires);
            self.record.images.push(report);
            if let Some(wires) = wires {
                let eye = (then.x_odom_base * self.arm.camera(&then.q)).translation.vector;
                self.walls.see(std::mem::take(&mut self.perception.thin), eye, wires);
            }
            self.fresh_image = (then.q - robot.q).amax() <= self.config.arm.arrived.si();
            self.imaged = Some((then.clone(), observation.intrinsics));
        }
        let before = *self.motion.q();
        self.motion.advance(&self.arm, robot.dt);
        let q = *self.motion.q();
        self.advanced = (robot.dt > 0.0).then(|| (q, (q - before) / robot.dt));
        self.watch_arm(&robot);
        Some(robot)
    }

    /// State of the robot when an image of `time` \[s\] was taken; `None` for an image that cannot be used.
    fn placed(&mut self, depth: &DepthImage, time: f64) -> Option<RobotState> {
        let then = self.memory.at(time);
        if let Some(watch) = &mut self.watch {
            let x_odom_camera = then.map(|then| then.x_odom_base * self.arm.camera(&then.q));
            // Too close to fruit or bucket a camera sees nothing, and at the look posture a leaf may hang before it.
            let excused = match self.state {
                State::Grasp | State::Pull | State::Deposit | State::Retreat => true,
                State::Reach => self.state_start - self.perception.last_sight < watch.blindness(),
                State::Scan | State::Align | State::Safe => false,
            };
            if !watch.take_image(depth, x_odom_camera, self.perception.shows(depth), excused) {
                return None;
            }
        }
        then.cloned()
    }

    /// Tells that a lasting fault begins or is over, or that one has happened.
    pub fn tell(&mut self, alarm: Alarm, begins: bool, time: f64) {
        let told = if begins { Event::Alarm { time, alarm } } else { Event::AlarmEnded { time, alarm } };
        self.record.events.push(told);
    }

    /// Time of the last observation that could be read \[s\].
    pub fn last_time(&self) -> f64 {
        self.last_time.unwrap_or(0.0)
    }

    /// Returns the command of a frame whose sensors could not be read: the last one, with the base and the set points at rest.
    pub fn hold(&self) -> Command {
        Command { base_velocity: STILL, arm_v: JointValues::zeros(self.arm.dof()), ..self.last_command }
    }

    /// Returns the command of the frame.
    pub fn command(&mut self, base_velocity: [f64; 3]) -> Command {
        self.last_command = Command {
            arm_q: self.arm.values(self.motion.q()),
            arm_v: self.arm.values(&self.arm_velocity()),
            base_velocity,
            finger_q: self.fingers.opening,
            finger_force: self.fingers.force,
            vacuum: self.fingers.vacuum,
        };
        self.last_command
    }

    /// Velocity of the arm's set points [rad/s]; zero if the motion has ended or was changed in this frame.
    fn arm_velocity(&self) -> JointVector {
        match &self.advanced {
            Some((q, v)) if q == self.motion.q() && !self.motion.is_over() => *v,
            _ => JointVector::zeros(),
        }
    }

    /// Record of the episode so far.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// Records that a state begins or restarts.
    pub fn enter(&mut self, state: State, robot: &RobotState) {
        self.record.events.push(Event::StateChanged { time: robot.time, state });
        self.state = state;
        self.restart_clock(robot);
    }

    /// Restarts the clock of the present state, against which its timeout counts.
    pub fn restart_clock(&mut self, robot: &RobotState) {
        self.state_start = robot.time;
        self.held_for = 0.0;
    }

    /// Time since the present state began \[s\].
    pub fn elapsed(&self, robot: &RobotState) -> f64 {
        robot.time - self.state_start
    }

    /// True if the commanded motion has ended and the arm is close to its command.
    pub fn arm_arrived(&self, robot: &RobotState) -> bool {
        self.motion.is_over() && (robot.q - self.motion.q()).amax() <= self.config.arm.arrived.si()
    }

    /// True if the arm has arrived, or something has held it off its command for long, or it has long been at rest: joint sensors with an offset measure an arm that has
    /// arrived beside its command.
    pub fn arm_settled(&self, robot: &RobotState) -> bool {
        self.arm_arrived(robot) || self.arm_stalled() || self.rested_for >= self.patience()
    }

    /// Takes note that something holds the base, which was commanded to drive.
    pub fn meet_wall(&mut self, robot: &RobotState) {
        self.walls.meet(robot, &self.last_command.base_velocity, &self.config.drive);
    }

    /// True if a wall bars the base's way to a goal.
    pub fn is_barred(&self, robot: &RobotState, goal: &BaseGoal) -> bool {
        let tree = self.perception.belief.p_odom();
        self.mobility.is_free() && self.walls.bar(robot, goal, &tree, &self.config)
    }

    /// Time without progress after which arm or base counts as stalled \[s\].
    pub fn patience(&self) -> f64 {
        self.config.timeout.stall.si()
    }

    /// Stops the arm where it is, so that it no longer presses on an obstacle short of its set point.
    pub fn yield_arm(&mut self, robot: &RobotState) {
        self.motion = ArmMotion::new(self.arm.clamped(&robot.q));
    }

    /// True if the arm has been held off its command for too long.
    pub fn arm_stalled(&self) -> bool {
        self.held_for >= self.patience()
    }

    fn watch_arm(&mut self, robot: &RobotState) {
        let c = &self.config.arm;
        let off = (robot.q - self.motion.q()).amax() > c.stall_error.si();
        let still = robot.v.amax() < c.stall_speed.si();
        self.held_for = if off && still { self.held_for + robot.dt } else { 0.0 };
        self.rested_for = if still && self.motion.is_over() { self.rested_for + robot.dt } else { 0.0 };
    }

    /// Largest distance of a detection from the target that it is matched to \[m\]; less for an assigned fruit, to tell it from its
    /// neighbours.
    pub fn match_distance(&self) -> f64 {
        self.task.as_ref().map_or(self.config.reach.match_distance.si(), |task| task.target.radius)
    }

    /// True if the gap between the fingers is wide enough for a fruit, or the vacuum shows a sealed cup.
    pub fn holds_fruit(&self, robot: &RobotState) -> bool {
        match self.arm.cup() {
            Some(cup) => cup.is_sealed(robot.vacuum),
            None => robot.width >= self.config.grasp.fruit_width_min.si(),
        }
    }

    /// True if a suction cup comes near the fruit's skin, `left` being its way to the goal of the grasp \[m\]: it goes on slowly and draws, so
    /// that the fruit is pulled into the lip from the first touch. Always false for fingers.
    pub fn touches_down(&self, left: f64) -> bool {
        let skin = left - self.config.approach.overshoot.si();
        self.arm.cup().is_some() && skin <= self.config.suction.draw.si()
    }

    /// True if the vacuum shows a sealed cup; always false for fingers.
    pub fn is_sealed(&self, robot: &RobotState) -> bool {
        self.arm.cup().is_some_and(|cup| cup.is_sealed(robot.vacuum))
    }

    /// Commands the fingers to close, or the cup to draw.
    pub fn close_hand(&mut self) {
        let vacuum = f64::from(u8::from(self.arm.cup().is_some()));
        self.fingers = Fingers { opening: 0.0, force: self.config.grasp.force.si(), vacuum };
    }

    /// True if the closing hand holds something: fingers that have been steady for long enough \[s\], or a sealed cup.
    pub fn has_closed(&self, steady: f64, steady_time: f64, robot: &RobotState) -> bool {
        if self.arm.cup().is_some() { self.holds_fruit(robot) } else { steady >= steady_time }
    }

    /// Commands the fingers to open, or the cup to vent.
    pub fn open_fingers(&mut self) {
        self.open_by(self.config.grasp.opening.si(), self.config.grasp.force.si());
    }

    /// Commands the fingers to an opening \[m\] with at most a force \[N\], or the cup to vent.
    pub fn open_by(&mut self, opening: f64, force: f64) {
        self.fingers = Fingers { opening, force, vacuum: 0.0 };
    }

    /// True if the fingers are open, or the cup is not sealed.
    pub fn fingers_are_open(&self, robot: &RobotState) -> bool {
        if self.arm.cup().is_some() {
            return !self.holds_fruit(robot);
        }
        let c = &self.config.grasp;
        robot.width >= 2.0 * (c.opening.si() - c.steady_width.si())
    }

    /// Force that the hand exerts at the TCP \[N\], base axes.
    pub fn tcp_force(&self, robot: &RobotState) -> Vec3 {
        self.tcp_load(robot).force
    }

    /// Load that the hand puts on its surroundings at the TCP, base axes.
    pub fn tcp_load(&self, robot: &RobotState) -> Wrench {
        let gravity = Vec3::new(0.0, 0.0, -self.config.pull.gravity.si());
        let RobotState { q, v, a, torque, .. } = robot;
        match self.config.sensors.base_motion {
            true => self.arm.tcp_load_on_moving_base(q, v, a, torque, &robot.base_motion(), &gravity),
            false => self.arm.tcp_load(q, a, torque, &gravity),
        }
    }

    /// Force that the hand exerts at the TCP \[N\], base axes, without what the base's own motion takes.
    pub fn tcp_force_in_motion(&self, robot: &RobotState) -> Vec3 {
        let gravity = Vec3::new(0.0, 0.0, -self.config.pull.gravity.si());
        let RobotState { q, v, a, torque, .. } = robot;
        self.arm.tcp_load_on_moving_base(q, v, a, torque, &robot.base_motion(), &gravity).force
    }

    /// Points of the last images in the present base frame.
    pub fn points_base(&self, robot: &RobotState) -> Vec<SeenPoint> {
        self.perception.points().map(|point| point.within(&robot.x_odom_base)).collect()
    }

    /// The attempt's target in the base frame.
    pub fn target_base(&self, robot: &RobotState) -> Option<Target> {
        self.attempt.as_ref().map(|a| to_base(&a.target, robot))
    }

    /// Returns the attempt's plan, corrected for the actual positions of base and fruit; `None` if the arm cannot follow it. The search
    /// for the posture starts at `q_near`.
    pub fn corrected_plan(&self, robot: &RobotState, q_near: &JointVector) -> Option<GraspPlan> {
        let (target, plan) = (self.target_base(robot)?, &self.attempt.as_ref()?.plan);
        let q_look = look_posture(&self.arm, &target, &plan.rotation, q_near, 0.0, &self.config)?;
        Some(GraspPlan { q_look, ..plan.clone() })
    }

    /// Known fruit other than the attempt's target, in the frame of a base at this pose.
    pub fn others_than_target(&self, x_odom_base: &Pose) -> Vec<Target> {
        self.attempt.as_ref().map_or(Vec::new(), |a| self.others(a.track, &a.target, x_odom_base))
    }

    /// Known fruit beside a target (odom), in the frame of a base at this pose. Tracks within `same_fruit` radii of the target are left out, since two fruit cannot hang so near
    /// to each other. Where there are none, the track with the number `own` is left out; else that one has joined a neighbour's sightings, and counts.
    pub fn others(&self, own: u32, target: &Target, x_odom_base: &Pose) -> Vec<Target> {
        let (least, tracks) = (self.config.approach.neighbour_hits.get(), self.perception.tracker.tracks());
        let same = self.config.approach.same_fruit.si() * target.radius;
        let is_target = |t: &Track| (t.p_odom - target.p).norm() < same;
        let is_seen_there = tracks.iter().any(is_target);
        let is_own = |t: &Track| is_target(t) || (t.id == own && !is_seen_there);
        let others = tracks.iter().filter(|t| !is_own(t) && (t.confirmed || t.hits >= least));
        others.map(|t| Target { p: inverse_transform(x_odom_base, &t.p_odom), radius: t.radius }).collect()
    }

    /// Makes a search for approaches to a target (base frame) from the arm's commanded posture, past points and other fruit.
    pub fn search<'a>(
        &'a self,
        target: &'a Target,
        points: &'a [SeenPoint],
        others: &'a [Target],
    ) -> Search<'a> {
        let (arm, config, q_start) = (&self.arm, &self.config, self.motion.q());
        Search { arm, config, target, points, others, refused: &[], q_start, reach_margin: 0.0 }
    }

    /// Starts an attempt.
    pub fn commit(&mut self, robot: &RobotState, track: u32, target: Target, plan: GraspPlan) {
        let id = self.next_attempt;
        self.next_attempt = self.next_attempt.wrapping_add(1);
        let (p_odom, radius) = (target.p, target.radius);
        self.record.events.push(Event::AttemptStarted { time: robot.time, id, p_odom, radius });
        // An assigned target needs no second look.
        let hits = if self.task.is_some() { u32::MAX } else { 0 };
        self.attempt = Some(Attempt { id, track, hits, target, plan });
    }

    /// Updates the attempt's target from its track.
    pub fn update_from_track(&mut self) {
        if let Some(attempt) = &mut self.attempt
            && let Some(track) = self.perception.tracker.tracks().iter().find(|t| t.id == attempt.track)
        {
            attempt.target = Target { p: track.p_odom, radius: track.radius };
            attempt.hits = track.hits;
        }
    }

    /// Records that the fingers hold the fruit.
    pub fn note_grasp(&mut self, robot: &RobotState) {
        if let Some(attempt) = &self.attempt {
            let RobotState { time, width, .. } = *robot;
            self.record.events.push(Event::Grasped { time, id: attempt.id, width });
        }
    }

    /// Records that the hand goes back from an obstacle that it pressed on with `force` \[N\]; it tries this approach last.
    pub fn note_yielding(&mut self, robot: &RobotState, force: f64) {
        if let Some(attempt) = &self.attempt {
            let direction = robot.x_odom_base.rotation * attempt.plan.direction();
            self.blacklist.refuse(attempt.target.p, direction);
            self.record.events.push(Event::Yielded { time: robot.time, id: attempt.id, force });
        }
    }

    /// Records that the stem has broken, after a largest pull \[N\].
    pub fn note_release_of_stem(&mut self, robot: &RobotState, pull: f64) {
        if let Some(attempt) = &self.attempt {
            self.record.events.push(Event::StemGaveWay { time: robot.time, id: attempt.id, pull });
        }
    }

    /// Ends the attempt, if there is one, and blacklists the target of a failed one.
    pub fn conclude(&mut self, robot: &RobotState, end: AttemptEnd) -> Option<Attempt> {
        let attempt = self.attempt.take()?;
        self.record.events.push(Event::AttemptEnded { time: robot.time, id: attempt.id, end });
        self.perception.tracker.forget(attempt.track);
        self.side.note(end);
        if let AttemptEnd::Failed(reason) = end {
            self.blacklist.add(attempt.target.p, attempt.target.radius, reason, robot.time);
        }
        Some(attempt)
    }
}

/// Transforms a target from the odom frame to the base frame.
pub(crate) fn to_base(target: &Target, robot: &RobotState) -> Target {
    Target { p: inverse_transform(&robot.x_odom_base, &target.p), radius: target.radius }
}

#[cfg(test)]
#[path = "picker_core_tests.rs"]
mod tests;

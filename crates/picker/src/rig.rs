//! What every controller of this crate is made of: eyes, arm motion, fingers, the present attempt and the record.

use crate::blacklist::Blacklist;
use crate::config::PickerConfig;
use crate::errand::Errand;
use crate::eyes::Eyes;
use crate::motion::ArmMotion;
use crate::plan::{GraspPlan, Search, Target, look_posture};
use crate::postures::Postures;
use crate::record::{AttemptEnd, AttemptId, Event, Record, State};
use crate::robot_state::{Memory, RobotState};
use orchard_geometry::{Intrinsics, Vec3, inverse_transform};
use orchard_perception::DetectorConfig;
use orchard_robot::{ARM_DOF, ArmKinematics, Command, JointVector, Observation, RobotModel};

/// Senses, belief and set points; a state machine on top decides.
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    pub arm: ArmKinematics,
    pub config: PickerConfig,
    pub eyes: Eyes,
    pub motion: ArmMotion,
    pub postures: Postures,
    pub blacklist: Blacklist,
    pub fingers: Fingers,
    pub attempt: Option<Attempt>,
    /// What it was sent for in place of a harvest.
    pub errand: Option<Errand>,
    /// Whether this frame brought an image from where the arm is now.
    pub fresh_image: bool,
    /// The robot at the moment that this frame's image shows, and the camera.
    pub imaged: Option<(RobotState, Intrinsics)>,
    state: State,
    state_start: f64,
    held_for: f64,
    next_attempt: AttemptId,
    last_time: Option<f64>,
    memory: Memory,
    last_command: Command,
    /// Where this frame's motion led, and how fast.
    advanced: Option<(JointVector, JointVector)>,
    record: Record,
}

/// Finger command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fingers {
    pub opening: f64,
    pub force: f64,
}

/// A committed target.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Attempt {
    pub id: AttemptId,
    pub track: u32,
    /// Images that showed the track.
    pub hits: u32,
    /// Best estimate of the fruit, odom.
    pub target: Target,
    /// How it is going to be grasped, base frame.
    pub plan: GraspPlan,
}

/// A base that stands.
pub(crate) const STILL: [f64; 3] = [0.0; 3];

impl Rig {
    /// For one robot, in the state in which its controller begins.
    pub fn new(robot: &RobotModel, detector: DetectorConfig, config: PickerConfig, state: State) -> Self {
        let arm = robot.kinematics().clone();
        let room = &config.align;
        let deck = Vec3::new(room.body_half_x.si(), room.body_half_y.si(), f64::INFINITY);
        Self {
            postures: Postures::new(&arm, &robot.bucket(), &config),
            eyes: Eyes::new(detector, &config, deck),
            motion: ArmMotion::new(arm.home()),
            blacklist: Blacklist::new(&config.blacklist),
            fingers: Fingers { opening: config.grasp.opening.si(), force: config.grasp.force.si() },
            attempt: None,
            errand: None,
            fresh_image: false,
            imaged: None,
            state,
            state_start: 0.0,
            held_for: 0.0,
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

    /// Reads the sensors, takes the image, moves the arm's set point on. `None` if a sensor reads what is no number.
    pub fn sense(&mut self, observation: &Observation) -> Option<RobotState> {
        let mut robot = RobotState::read(observation, self.last_time, &self.config.sensors)?;
        if let (Some(last), true) = (self.memory.last(), robot.dt > 0.0) {
            robot.a = (robot.v - last.v) / robot.dt;
        }
        if self.last_time.is_none() {
            self.yield_arm(&robot);
            self.record.events.push(Event::StateChanged { time: robot.time, state: self.state });
            self.state_start = robot.time;
        }
        self.last_time = Some(robot.time);
        self.memory.keep(&robot);
        self.fresh_image = false;
        self.imaged = None;
        if let Some(depth) = &observation.depth
            && let Some(then) = self.memory.at(observation.depth_time)
        {
            let report = self.eyes.see(depth, &observation.intrinsics, then, &self.arm);
            self.record.images.push(report);
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

    /// The command of a frame whose sensors could not be read: the last one, standing.
    pub fn hold(&self) -> Command {
        Command { base_velocity: STILL, arm_v: [0.0; ARM_DOF], ..self.last_command }
    }

    /// The frame's command.
    pub fn command(&mut self, base_velocity: [f64; 3]) -> Command {
        self.last_command = Command {
            arm_q: (*self.motion.q()).into(),
            arm_v: self.arm_velocity().into(),
            base_velocity,
            finger_q: self.fingers.opening,
            finger_force: self.fingers.force,
        };
        self.last_command
    }

    /// Velocity of the arm's set points; none where the motion has ended or was changed in this frame.
    fn arm_velocity(&self) -> JointVector {
        match &self.advanced {
            Some((q, v)) if q == self.motion.q() && !self.motion.is_over() => *v,
            _ => JointVector::zeros(),
        }
    }

    /// What it has done so far.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// Notes that a state begins, or begins anew.
    pub fn enter(&mut self, state: State, robot: &RobotState) {
        self.record.events.push(Event::StateChanged { time: robot.time, state });
        self.state = state;
        self.restart_clock(robot);
    }

    /// What the present state may take counts from now on.
    pub fn restart_clock(&mut self, robot: &RobotState) {
        self.state_start = robot.time;
        self.held_for = 0.0;
    }

    /// Time since the present state began [s].
    pub fn elapsed(&self, robot: &RobotState) -> f64 {
        robot.time - self.state_start
    }

    /// Whether the arm follows its command: close, and not told to move.
    pub fn arm_arrived(&self, robot: &RobotState) -> bool {
        self.motion.is_over() && (robot.q - self.motion.q()).amax() <= self.config.arm.arrived.si()
    }

    /// Time without progress after which something is held [s].
    pub fn patience(&self) -> f64 {
        self.config.timeout.stall.si()
    }

    /// Ends the arm's motion where the arm is: a set point beyond what it has met would go on pressing.
    pub fn yield_arm(&mut self, robot: &RobotState) {
        self.motion = ArmMotion::new(self.arm.clamped(&robot.q));
    }

    /// Whether something has been holding the arm off its command.
    pub fn arm_stalled(&self) -> bool {
        self.held_for >= self.patience()
    }

    fn watch_arm(&mut self, robot: &RobotState) {
        let c = &self.config.arm;
        let off = (robot.q - self.motion.q()).amax() > c.stall_error.si();
        let held = off && robot.v.amax() < c.stall_speed.si();
        self.held_for = if held { self.held_for + robot.dt } else { 0.0 };
    }

    /// How far from the target a detection may be that is taken for it: a named fruit is told from its neighbours.
    pub fn match_distance(&self) -> f64 {
        self.errand.as_ref().map_or(self.config.reach.match_distance.si(), |errand| errand.target.radius)
    }

    /// Whether the gap between the fingers is that of a fruit.
    pub fn holds_fruit(&self, robot: &RobotState) -> bool {
        robot.width >= self.config.grasp.fruit_width_min.si()
    }

    /// Tells the fingers to open.
    pub fn open_fingers(&mut self) {
        let opening = self.config.grasp.opening.si();
        self.fingers = Fingers { opening, force: self.config.grasp.force.si() };
    }

    /// Whether the fingers stand where they open to.
    pub fn fingers_are_open(&self, robot: &RobotState) -> bool {
        let c = &self.config.grasp;
        robot.width >= 2.0 * (c.opening.si() - c.steady_width.si())
    }

    /// Force that the hand exerts at the TCP [N], base axes.
    pub fn tcp_force(&self, robot: &RobotState) -> Vec3 {
        let gravity = Vec3::new(0.0, 0.0, -self.config.pull.gravity.si());
        self.arm.tcp_force(&robot.q, &robot.a, &robot.torque, &gravity)
    }

    /// Points of the last images in the present base frame.
    pub fn points_base(&self, robot: &RobotState) -> Vec<Vec3> {
        self.eyes.points().map(|p| inverse_transform(&robot.x_odom_base, p)).collect()
    }

    /// The attempt's target in the base frame.
    pub fn target_base(&self, robot: &RobotState) -> Option<Target> {
        self.attempt.as_ref().map(|a| to_base(&a.target, robot))
    }

    /// The attempt's approach, corrected for where base and fruit really are; `None` where the arm cannot follow it. The
    /// posture is looked for near `q_near`.
    pub fn corrected_plan(&self, robot: &RobotState, q_near: &JointVector) -> Option<GraspPlan> {
        let (target, plan) = (self.target_base(robot)?, &self.attempt.as_ref()?.plan);
        let q_look = look_posture(&self.arm, &target, &plan.rotation, q_near, 0.0, &self.config)?;
        Some(GraspPlan { q_look, ..plan.clone() })
    }

    /// A search for ways to grasp a target (base frame) from where the arm is.
    pub fn search<'a>(&'a self, target: &'a Target, points: &'a [Vec3]) -> Search<'a> {
        let (arm, config, q_start) = (&self.arm, &self.config, self.motion.q());
        Search { arm, config, target, points, q_start, reach_margin: 0.0 }
    }

    /// Starts an attempt.
    pub fn commit(&mut self, robot: &RobotState, track: u32, target: Target, plan: GraspPlan) {
        let id = self.next_attempt;
        self.next_attempt = self.next_attempt.wrapping_add(1);
        let (p_odom, radius) = (target.p, target.radius);
        self.record.events.push(Event::AttemptStarted { time: robot.time, id, p_odom, radius });
        // A place that was named needs no second look.
        let hits = if self.errand.is_some() { u32::MAX } else { 0 };
        self.attempt = Some(Attempt { id, track, hits, target, plan });
    }

    /// Takes over what the tracker has learned since the target was committed.
    pub fn update_from_track(&mut self) {
        if let Some(attempt) = &mut self.attempt
            && let Some(track) = self.eyes.tracker.tracks().iter().find(|t| t.id == attempt.track)
        {
            attempt.target = Target { p: track.p_odom, radius: track.radius };
            attempt.hits = track.hits;
        }
    }

    /// The fingers hold something.
    pub fn note_grasp(&mut self, robot: &RobotState) {
        if let Some(attempt) = &self.attempt {
            let RobotState { time, width, .. } = *robot;
            self.record.events.push(Event::Grasped { time, id: attempt.id, width });
        }
    }

    /// The hand goes back from what it pressed on with a force [N].
    pub fn note_yielding(&mut self, robot: &RobotState, force: f64) {
        if let Some(attempt) = &self.attempt {
            self.record.events.push(Event::Yielded { time: robot.time, id: attempt.id, force });
        }
    }

    /// The stem has given way, after a largest pull [N].
    pub fn note_release_of_stem(&mut self, robot: &RobotState, pull: f64) {
        if let Some(attempt) = &self.attempt {
            self.record.events.push(Event::StemGaveWay { time: robot.time, id: attempt.id, pull });
        }
    }

    /// Ends the attempt, if there is one, and remembers where not to try again.
    pub fn conclude(&mut self, robot: &RobotState, end: AttemptEnd) -> Option<Attempt> {
        let attempt = self.attempt.take()?;
        self.record.events.push(Event::AttemptEnded { time: robot.time, id: attempt.id, end });
        self.eyes.tracker.forget(attempt.track);
        if let AttemptEnd::Failed(reason) = end {
            self.blacklist.add(attempt.target.p, reason, robot.time);
        }
        Some(attempt)
    }
}

/// A target of the odom frame in the base frame.
pub(crate) fn to_base(target: &Target, robot: &RobotState) -> Target {
    Target { p: inverse_transform(&robot.x_odom_base, &target.p), radius: target.radius }
}

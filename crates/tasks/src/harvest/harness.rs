//! Runs an episode of one world with one controller and records the true events.

use std::sync::atomic::{AtomicBool, Ordering};

use orchard_geometry::{Pose, Vec3, transform};
use orchard_robot::{Command, JointValues};
use orchard_world::WorldEvent;

use crate::harvest::attempts::{AttemptLog, History, judge};
use crate::harvest::command_log::CommandLog;
use crate::harvest::contacts::{contact_attempts, knocked_off, was_held};
use crate::harvest::episode::{
    AlarmTime, Belief, DepositEvent, DetachEvent, DetectionTally, EpisodeKey, EpisodeRecord, FruitMoment,
    FruitRecord, FruitState, Outcome, SnapEvent, Yielding,
};
use crate::harvest::hold::HoldWatch;
use crate::harvest::interface::{
    BenchController, BenchWorld, ControllerEvent, FruitTruth, GaveUp, VisibleFruit,
};
use crate::harvest::observe::{FrameInput, NoObserver, Observer};
use crate::harvest::reason::ABANDONED;
use crate::json::{array, finite, larger};
use crate::matching::{Ball, match_detections};
use crate::protocol::Protocol;
use crate::stall::StallWatch;
use crate::zones::{Zone, ZoneFrame, zone_table};

/// Runs an episode; `None` if `stop` was raised before its end. `on_frame` is called after every frame.
pub fn run_episode<W: BenchWorld, C: BenchController>(
    key: EpisodeKey,
    world: &mut W,
    controller: &mut C,
    protocol: &Protocol,
    frame: f64,
    stop: &AtomicBool,
    on_frame: &mut dyn FnMut(),
) -> Option<EpisodeRecord> {
    run_observed_episode(key, world, controller, protocol, frame, stop, on_frame, &mut NoObserver)
}

/// [`run_episode`] with an observer.
#[expect(clippy::too_many_arguments, reason = "one more than run_episode, whose callers have no use for it")]
pub fn run_observed_episode<W: BenchWorld, C: BenchController>(
    key: EpisodeKey,
    world: &mut W,
    controller: &mut C,
    protocol: &Protocol,
    frame: f64,
    stop: &AtomicBool,
    on_frame: &mut dyn FnMut(),
    observer: &mut impl Observer<W>,
) -> Option<EpisodeRecord> {
    let mut log = EpisodeLog::new(world, protocol, frame);
    let mut commands = CommandLog::new(&key);
    let mut stall = StallWatch::new(&protocol.rules, frame);
    let mut outcome = world.quarantine().map(|reason| Outcome::Quarantined { reason });
    let mut last = None;
    controller.run_ends_at(f64::from(key.horizon_frames) * frame);
    while outcome.is_none() {
        let observation = world.observe();
        if stall.stalled(&observation) {
            outcome = Some(Outcome::Stalled);
            break;
        }
        let command = controller.act(&observation);
        // After the controller, which may raise the flag when it fails: then its command is none.
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let events = controller.drain_log();
        let input =
            FrameInput { observation: Some(&observation), controller_events: &events, command: &command };
        observer.before_step(world, &input);
        commands.push(&command, &events);
        log.take_controller(events, world);
        log.step(world, &command, observer);
        on_frame();
        last = Some(command);
        outcome = outcome_of(world, &log.reachable, log.settlings(), log.frames, key.horizon_frames);
    }
    // The loop ends only with an outcome.
    let outcome = outcome.unwrap_or(Outcome::BudgetSpent);
    if let (Outcome::BudgetSpent, Some(command)) = (&outcome, last) {
        let frames = (protocol.rules.settle_time.si() / frame).round() as u32;
        let hold =
            Command { base_velocity: [0.0; 3], arm_v: JointValues::zeros(command.arm_v.len()), ..command };
        log.settle(world, &hold, frames, observer);
    }
    let commands_sha256 = Some(commands.sha256());
    Some(EpisodeRecord { commands_sha256, ..log.finish(key, outcome, world) })
}

/// Returns how an episode ends with the frame just stepped, `None` if it goes on: in quarantine, with no `reachable` fruit left on the tree and
/// none on its way to the bucket, or after `horizon` frames. `settlings` is the number of deposits and drops so far, `frames` that of frames.
pub fn outcome_of<W: BenchWorld>(
    world: &W,
    reachable: &[bool],
    settlings: usize,
    frames: u32,
    horizon: u32,
) -> Option<Outcome> {
    if let Some(reason) = world.quarantine() {
        return Some(Outcome::Quarantined { reason });
    }
    let settled = |f: &FruitTruth| matches!(f.state, FruitState::Deposited | FruitState::Dropped);
    let wanted = reachable.iter().filter(|r| **r).count();
    // The state of all fruit is only read once there were enough events.
    let may_be_over = wanted > 0 && settlings >= wanted;
    if may_be_over && world.fruit().iter().zip(reachable).all(|(f, reachable)| !reachable || settled(f)) {
        return Some(Outcome::AllReachablePicked);
    }
    (frames >= horizon).then_some(Outcome::BudgetSpent)
}

/// Returns the record of a world before its first frame: its fruit, their reach and zones.
pub fn census<W: BenchWorld>(key: EpisodeKey, world: &W, protocol: &Protocol, frame: f64) -> EpisodeRecord {
    EpisodeLog::new(world, protocol, frame).finish(key, Outcome::BudgetSpent, world)
}

/// Returns the record of a world that could not be built: nothing but the reason.
pub fn never_started(key: EpisodeKey, reason: String) -> EpisodeRecord {
    EpisodeRecord {
        key,
        outcome: Outcome::Quarantined { reason },
        frames: 0,
        duration_s: 0.0,
        fruit_total: 0,
        reachable_count: 0,
        reachable: Vec::new(),
        reachable_ik_count: None,
        zone_frame: None,
        zone_census: zone_table(0),
        fruit: Vec::new(),
        attempts: Vec::new(),
        contact_attempts: Vec::new(),
        branches_snapped: Vec::new(),
        fruit_detached: Vec::new(),
        fruit_knocked_off: Vec::new(),
        fruit_deposited: Vec::new(),
        fruit_dropped: Vec::new(),
        seals_lost: Vec::new(),
        fruit_taken_away: Vec::new(),
        detection: DetectionTally::default(),
        max_stem_pull_n: None,
        gave_up: None,
        alarms: Vec::new(),
        commands_sha256: None,
    }
}

/// Log of a running episode.
struct EpisodeLog {
    frame: f64,
    visible_pixels: u32,
    /// Largest impact energy without a bruise \[J\].
    bruise_energy: f64,
    /// Stem tension above which a fruit counts as stem-pulled \[N\].
    stem_pull: f64,
    /// Time without contact that closes a contact attempt \[frames\].
    contact_gap: u32,
    frames: u32,
    /// Largest bruised volume of a fruit that is free of bruises \[m^3\].
    bruise_volume: f64,
    start: Vec<FruitTruth>,
    reachable: Vec<bool>,
    reachable_ik_count: Option<u32>,
    zones: Option<ZoneFrame>,
    attempts: Vec<AttemptLog>,
    history: History,
    hold: HoldWatch,
    detached: Vec<DetachEvent>,
    deposits: Vec<DepositEvent>,
    detection: DetectionTally,
    max_stem_pull: f64,
    gave_up: Option<GaveUp>,
    alarms: Vec<AlarmTime>,
}

impl EpisodeLog {
    fn new<W: BenchWorld>(world: &W, protocol: &Protocol, frame: f64) -> Self {
        let mut start = world.fruit();
        if start.iter().any(|f| !f.p_world.iter().chain([&f.radius]).all(|x| x.is_finite())) {
            // The world was quarantined before its first frame: its fruit cannot be counted.
            start.clear();
        }
        let mut reachable = world.reachable();
        reachable.resize(start.len(), false);
        Self {
            frame,
            visible_pixels: protocol.rules.visible_pixels.get(),
            bruise_energy: protocol.rules.bruise_energy.si(),
            stem_pull: protocol.rules.stem_pull.si(),
            contact_gap: (protocol.rules.contact_gap.si() / frame).round() as u32,
            frames: 0,
            bruise_volume: protocol.rules.bruise_volume.si(),
            zones: ZoneFrame::of_start(&start, &reachable, &protocol.zones),
            start,
            reachable,
            reachable_ik_count: world.reachable_ik_count(),
            attempts: Vec::new(),
            history: History::default(),
            hold: HoldWatch::default(),
            detached: Vec::new(),
            deposits: Vec::new(),
            detection: DetectionTally::default(),
            max_stem_pull: 0.0,
            gave_up: None,
            alarms: Vec::new(),
        }
    }

    fn time(&self) -> f64 {
        f64::from(self.frames) * self.frame
    }

    fn take_controller<W: BenchWorld>(&mut self, events: Vec<ControllerEvent>, world: &W) {
        for event in events {
            match event {
                ControllerEvent::AttemptStarted { p_odom_target, radius } => {
                    self.end_attempt(Some(ABANDONED.to_owned()));
                    self.start_attempt(&p_odom_target, radius, &world.fruit(), &world.x_world_odom());
                }
                ControllerEvent::StateChanged { state } => {
                    let frames = self.frames;
                    if let Some(attempt) = self.running() {
                        attempt.states.push((frames, state.clone()));
                    }
                    self.history.states.push((frames, state));
                }
                ControllerEvent::Grasped { width } => {
                    let time = self.time();
                    if let Some(attempt) = self.running() {
                        attempt.belief.grasp_time = Some(time);
                        attempt.belief.grasp_width_m = finite(width);
                    }
                }
                ControllerEvent::StemGaveWay { pull } => {
                    let time = self.time();
                    if let Some(attempt) = self.running() {
                        attempt.belief.stem_time = Some(time);
                        attempt.belief.pull_n = finite(pull);
                    }
                }
                ControllerEvent::Yielded { force } => {
                    let time = self.time();
                    if let Some(attempt) = self.running() {
                        attempt.belief.yielded.push(Yielding { time, force_n: finite(force) });
                    }
                }
                ControllerEvent::AttemptEnded { failure } => self.end_attempt(failure),
                ControllerEvent::GaveUp { fault } => {
                    let time = self.time();
                    self.gave_up.get_or_insert(GaveUp { time, fault });
                }
                ControllerEvent::Alarm { alarm } => {
                    let from = self.time();
                    self.alarms.push(AlarmTime { alarm, from, until: None });
                }
                ControllerEvent::AlarmEnded { alarm } => {
                    let time = self.time();
                    let lasting = self.alarms.iter_mut().rev().find(|a| a.alarm == alarm);
                    if let Some(told) = lasting.filter(|a| a.until.is_none()) {
                        told.until = Some(time);
                    }
                }
                ControllerEvent::Detected { p_odom, .. } => {
                    self.tally(&p_odom, &world.fruit(), &world.visible_fruit(), &world.x_world_odom());
                }
            }
        }
    }

    fn running(&mut self) -> Option<&mut AttemptLog> {
        self.attempts.last_mut().filter(|a| a.end.is_none())
    }

    fn end_attempt(&mut self, failure: Option<String>) {
        let frames = self.frames;
        if let Some(attempt) = self.running() {
            attempt.end = Some((frames, failure));
        }
    }

    fn start_attempt(
        &mut self,
        p_odom_target: &Vec3,
        radius: f64,
        fruit: &[FruitTruth],
        x_world_odom: &Pose,
    ) {
        let p_world = transform(x_world_odom, p_odom_target);
        let on_tree: Vec<usize> = (0..fruit.len())
            .filter(|&i| matches!(fruit[i].state, FruitState::OnTree | FruitState::OnBrokenLimb))
            .collect();
        let balls: Vec<Ball> = on_tree.iter().map(|&i| ball(&fruit[i])).collect();
        let target = match_detections(&[p_world], &balls)[0].map(|i| on_tree[i]);
        let distance = |i: &usize| (fruit[*i].p_world - p_world).norm();
        let nearest = on_tree.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let belief = Belief {
            radius_m: radius,
            nearest_fruit: nearest.map(|i| i as u32),
            nearest_distance_m: nearest.as_ref().map(distance),
            ..Belief::default()
        };
        let p_zone = target.map_or(p_world, |i| self.start[i].p_world);
        self.attempts.push(AttemptLog {
            start_frame: self.frames,
            p_odom_target: array(p_odom_target),
            fruit: target.map(|i| i as u32),
            zone: self.zone(&p_zone),
            states: Vec::new(),
            end: None,
            belief,
            max_stem_pull: 0.0,
            max_finger_force: 0.0,
            max_wrist_force: 0.0,
        });
        self.hold.begin_attempt();
    }

    fn zone(&self, p_world: &Vec3) -> Option<Zone> {
        self.zones.as_ref().map(|frame| frame.zone(p_world))
    }

    /// Precision is relative to every fruit, recall to fruit with enough visible pixels.
    fn tally(
        &mut self,
        p_odom: &[Vec3],
        fruit: &[FruitTruth],
        visible: &[VisibleFruit],
        x_world_odom: &Pose,
    ) {
        let detections: Vec<Vec3> = p_odom.iter().map(|p| transform(x_world_odom, p)).collect();
        let balls: Vec<Ball> = fruit.iter().map(ball).collect();
        let matched = match_detections(&detections, &balls);
        let hits = matched.iter().flatten().count() as u32;
        let mut seen: Vec<u32> =
            visible.iter().filter(|v| v.pixels >= self.visible_pixels).map(|v| v.fruit).collect();
        seen.sort_unstable();
        seen.dedup();
        let recalled = matched.iter().flatten().filter(|&&f| seen.binary_search(&(f as u32)).is_ok()).count();
        self.detection.images += 1;
        self.detection.true_positives += hits;
        self.detection.false_positives += detections.len() as u32 - hits;
        self.detection.visible += seen.len() as u32;
        self.detection.recalled += recalled as u32;
    }

    /// Called when the time is over: steps with the robot at rest until loose fruit has settled, for at most `frames` frames.
    fn settle<W: BenchWorld>(
        &mut self,
        world: &mut W,
        hold: &Command,
        frames: u32,
        observer: &mut impl Observer<W>,
    ) {
        let end = self.frames;
        for _ in 0..frames {
            let moving = world.fruit().iter().any(|f| f.state == FruitState::Loose);
            if !moving || world.quarantine().is_some() {
                break;
            }
            observer
                .before_step(world, &FrameInput { observation: None, controller_events: &[], command: hold });
            self.step(world, hold, observer);
        }
        self.frames = end;
    }

    /// Advances the world one frame and records its events.
    fn step<W: BenchWorld>(&mut self, world: &mut W, command: &Command, observer: &mut impl Observer<W>) {
        world.step(command);
        let events = world.drain_events();
        observer.after_step(world, &events);
        self.take_world(world, events, command.finger_q);
    }

    /// Records the events of a step; `opening` is the commanded opening of each finger \[m\].
    fn take_world<W: BenchWorld>(&mut self, world: &mut W, events: Vec<WorldEvent>, opening: f64) {
        self.frames += 1;
        let (frame, time) = (self.frames, self.time());
        let of = |fruit: usize| FruitMoment { fruit: fruit as u32, frame, time };
        for event in events {
            match event {
                WorldEvent::FingerContactBegan { fruit, .. } => {
                    self.history.begin_contact(fruit as u32, frame);
                }
                WorldEvent::FingerContactEnded { fruit, .. } => self.history.end_contact(fruit as u32, frame),
                WorldEvent::FruitGripped { fruit, .. } => self.history.gripped.push(of(fruit)),
                WorldEvent::FruitDetached { fruit, tension, release, .. } => {
                    self.history.detached.push(of(fruit));
                    let fruit = fruit as u32;
                    let (tension_n, stem_pulled) = (finite(tension), tension > self.stem_pull);
                    let strength_n = world.stem_strength(fruit).and_then(finite);
                    let stem =
                        DetachEvent { fruit, frame, time, tension_n, stem_pulled, release, strength_n };
                    self.detached.push(stem);
                    let held = was_held(&self.history, fruit, frame, self.contact_gap);
                    self.hold.detached(fruit, held, frame);
                }
                WorldEvent::FruitDeposited { fruit, drop_height, impact_energy, .. } => {
                    self.history.deposited.push(of(fruit));
                    let fruit = fruit as u32;
                    let bruise = world.fruit_bruise(fruit).and_then(finite);
                    let volume = world.bruise_volume(fruit).and_then(finite);
                    self.deposits.push(DepositEvent {
                        fruit,
                        frame,
                        time,
                        drop_height_m: finite(drop_height),
                        impact_energy_j: finite(impact_energy),
                        bruise_energy_j: bruise,
                        bruised: bruise.map(|energy| energy > self.bruise_energy),
                        bruise_volume_m3: volume,
                        over_bruise_volume: volume.map(|volume| volume > self.bruise_volume),
                    });
                }
                WorldEvent::FruitDropped { fruit, .. } => self.history.dropped.push(of(fruit)),
                WorldEvent::SealLost { fruit, .. } => self.history.seals_lost.push(of(fruit)),
                WorldEvent::FruitTakenAway { fruit, .. } => self.history.taken_away.push(of(fruit)),
                WorldEvent::BranchSnapped { segment, .. } => {
                    let segment = segment as u32;
                    let at_union = world.breaks_at_union(segment);
                    self.history.snapped.push(SnapEvent { segment, frame, time, at_union });
                }
                // The largest impact of the fruit is known when it is at rest in the bucket.
                WorldEvent::FruitImpact { .. } => {}
            }
        }
        self.hold.look(world, opening, frame);
        let (pull, hand) = (world.peak_stem_pull(), world.hand_forces());
        self.max_stem_pull = larger(self.max_stem_pull, pull);
        if let Some(attempt) = self.running() {
            attempt.max_stem_pull = larger(attempt.max_stem_pull, pull);
            attempt.max_finger_force = larger(attempt.max_finger_force, hand.finger);
            attempt.max_wrist_force = larger(attempt.max_wrist_force, hand.wrist);
        }
    }

    /// Deposits and drops so far.
    fn settlings(&self) -> usize {
        self.history.deposited.len() + self.history.dropped.len()
    }

    fn finish<W: BenchWorld>(mut self, key: EpisodeKey, outcome: Outcome, world: &W) -> EpisodeRecord {
        let end = world.fruit();
        self.history.held = self.hold.spells.clone();
        let fruit: Vec<FruitRecord> = self
            .start
            .iter()
            .enumerate()
            .map(|(i, f)| FruitRecord {
                id: i as u32,
                p_world: array(&f.p_world),
                radius: f.radius,
                reachable: self.reachable[i],
                zone: self.zone(&f.p_world),
                final_state: end.get(i).map_or(f.state, |e| e.state),
            })
            .collect();
        let mut zone_census = zone_table(0);
        for zone in fruit.iter().filter(|f| f.reachable).filter_map(|f| f.zone) {
            *zone_census.entry(zone).or_insert(0) += 1;
        }
        let reachable: Vec<u32> = fruit.iter().filter(|f| f.reachable).map(|f| f.id).collect();
        let knocked_off = knocked_off(&self.history, self.contact_gap);
        EpisodeRecord {
            key,
            outcome,
            frames: self.frames,
            duration_s: self.time(),
            fruit_total: fruit.len() as u32,
            reachable_count: reachable.len() as u32,
            reachable,
            reachable_ik_count: self.reachable_ik_count,
            contact_attempts: contact_attempts(&self.history, self.contact_gap, self.frame, self.frames),
            attempts: judge(&self.attempts, &self.history, &knocked_off, self.frame, self.frames),
            zone_frame: self.zones,
            zone_census,
            fruit,
            fruit_knocked_off: knocked_off,
            branches_snapped: self.history.snapped,
            fruit_detached: self.detached,
            fruit_deposited: self.deposits,
            fruit_dropped: self.history.dropped,
            seals_lost: self.history.seals_lost,
            fruit_taken_away: self.history.taken_away,
            detection: self.detection,
            max_stem_pull_n: finite(self.max_stem_pull),
            gave_up: self.gave_up,
            alarms: self.alarms,
            commands_sha256: None,
        }
    }
}

fn ball(fruit: &FruitTruth) -> Ball {
    Ball { p_world: fruit.p_world, radius: fruit.radius }
}

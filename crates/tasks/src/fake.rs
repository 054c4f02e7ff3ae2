//! Test fixtures: a scripted world with a controller, and hand-made records. Feature `fake` makes them public.

pub mod progress;

use orchard_bench::digest::config_hash;
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_geometry::{Image, Intrinsics, Pose, Vec3};
use orchard_robot::{Command, JointValues, Observation};
use orchard_scenario::Names;
use orchard_spec::{Purpose, Stream};
use orchard_world::WorldEvent;

use crate::backend::Backend;
use crate::harvest::episode::{
    AttemptOutcome, AttemptRecord, Belief, ContactAttemptRecord, ContactOutcome, EpisodeKey, EpisodeRecord,
    FruitRecord, FruitState, Outcome,
};
use crate::harvest::harness::never_started;
use crate::harvest::interface::{
    BenchController, BenchWorld, ControllerEvent, FruitTruth, HandForces, VisibleFruit,
};
use crate::harvest::matrix::Dials;
use crate::harvest::plan::{Condition, ConditionParams, Plan};
use crate::harvest::run::WorldFactory;
use crate::protocol::Protocol;
use crate::seeds::SeedSetLabel;
use crate::zones::Zone;

/// Frame length of the fake world \[s\].
pub const FRAME: f64 = 0.5;

/// An observation of a robot at rest.
pub fn observation(time: f64) -> Observation {
    Observation {
        time,
        arm_q: JointValues::zeros(7),
        arm_v: JointValues::zeros(7),
        arm_torque: JointValues::zeros(7),
        finger_q: [0.0; 2],
        finger_force: [0.0; 2],
        cup_pressure: 0.0,
        base_pose: [0.0; 3],
        base_height: 0.0,
        base_velocity: [0.0; 3],
        depth: None,
        colour: None,
        depth_time: time,
        intrinsics: Intrinsics { width: 1, height: 1, fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0 },
        pictures: None,
    }
}

/// A world that ignores commands. Every 10 frames the next fruit is gripped; 2 frames later it is detached, 3 frames later
/// released, 4 frames later deposited or, for every third fruit, dropped.
pub struct FakeWorld {
    /// Frames stepped.
    pub frame: u32,
    /// Every fruit.
    pub fruit: Vec<FruitTruth>,
    /// True if an arm joint moves in every frame.
    pub moving: bool,
    /// Frame from which the world is quarantined.
    pub breaks_at: Option<u32>,
    events: Vec<WorldEvent>,
}

/// Pose of the odom frame in the fake world.
pub fn x_world_odom() -> Pose {
    Pose::new(Vec3::new(1.0, 2.0, 0.0), Vec3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2))
}

impl FakeWorld {
    /// Makes a world of 4 to 6 fruit.
    pub fn new(seed: u64, world: u32) -> Self {
        let mut stream = Stream::new(seed, world, Purpose::Test);
        let fruit = (0..stream.integer(4, 6))
            .map(|_| FruitTruth {
                p_world: Vec3::new(stream.unit(), stream.unit(), 1.0 + stream.unit()),
                radius: 0.03,
                state: FruitState::OnTree,
            })
            .collect();
        Self { frame: 0, fruit, moving: true, breaks_at: None, events: Vec::new() }
    }
}

impl BenchWorld for FakeWorld {
    fn observe(&mut self) -> Observation {
        let mut seen = observation(f64::from(self.frame) * FRAME);
        if self.moving {
            seen.arm_q[0] = f64::from(self.frame % 2);
        }
        if self.frame.is_multiple_of(5) {
            seen.depth = Some(Image::filled(1, 1, 1.0));
        }
        seen
    }

    fn step(&mut self, _: &Command) {
        let (index, phase) = ((self.frame / 10) as usize, self.frame % 10);
        self.frame += 1;
        let Some(fruit) = self.fruit.get_mut(index) else { return };
        let (id, frame) = (index as u32, self.frame);
        match phase {
            2 => {
                self.events.push(WorldEvent::FingerContactBegan { fruit: index, frame });
                self.events.push(WorldEvent::FruitGripped { fruit: index, frame });
            }
            5 => self.events.push(WorldEvent::FingerContactEnded { fruit: index, frame }),
            4 => {
                fruit.state = FruitState::Loose;
                self.events.push(WorldEvent::FruitDetached {
                    fruit: index,
                    frame,
                    tension: f64::from(20 + 10 * (id % 2)),
                    release: None,
                });
            }
            6 if id % 3 == 2 => {
                fruit.state = FruitState::Dropped;
                self.events.push(WorldEvent::FruitDropped { fruit: index, frame, speed: 3.0 });
                self.events.push(WorldEvent::BranchSnapped { segment: 40 + index, frame });
            }
            6 => {
                fruit.state = FruitState::Deposited;
                self.events.push(WorldEvent::FruitDeposited {
                    fruit: index,
                    frame,
                    drop_height: 0.05,
                    impact_energy: f64::NAN,
                });
            }
            _ => {}
        }
    }

    fn drain_events(&mut self) -> Vec<WorldEvent> {
        std::mem::take(&mut self.events)
    }

    fn fruit(&self) -> Vec<FruitTruth> {
        self.fruit.clone()
    }

    fn visible_fruit(&self) -> Vec<VisibleFruit> {
        // Fruit 0 shows enough pixels, fruit 1 one too few.
        vec![VisibleFruit { fruit: 0, pixels: 50 }, VisibleFruit { fruit: 1, pixels: 13 }]
    }

    fn x_world_odom(&self) -> Pose {
        x_world_odom()
    }

    fn reachable(&self) -> Vec<bool> {
        (0..self.fruit.len()).map(|i| i != 3).collect()
    }

    fn peak_stem_pull(&self) -> f64 {
        f64::from(self.frame % 10)
    }

    fn hand_forces(&self) -> HandForces {
        let force = f64::from(self.frame % 10);
        HandForces { finger: force, wrist: 0.5 * force }
    }

    fn fruit_bruise(&self, fruit: u32) -> Option<f64> {
        Some(if fruit == 0 { 0.1 } else { 0.01 })
    }

    fn quarantine(&self) -> Option<String> {
        self.breaks_at
            .filter(|&frame| self.frame >= frame)
            .map(|frame| format!("not finite at frame {frame}"))
    }
}

/// A controller whose log matches the fake world: an attempt from frame 10 k + 1 to 10 k + 8.
pub struct FakeController {
    /// Fruit centres \[m, odom\], known to tests only.
    pub targets: Vec<Vec3>,
    log: Vec<ControllerEvent>,
}

impl FakeController {
    /// Makes the controller that harvests a world.
    pub fn new(world: &FakeWorld) -> Self {
        let targets =
            world.fruit.iter().map(|f| orchard_geometry::inverse_transform(&x_world_odom(), &f.p_world));
        Self { targets: targets.collect(), log: Vec::new() }
    }
}

impl BenchController for FakeController {
    fn act(&mut self, observation: &Observation) -> Command {
        let frame = (observation.time / FRAME).round() as usize;
        if observation.depth.is_some() {
            // Fruit 0 is found, one detection is false.
            let p_odom = vec![self.targets[0], Vec3::new(50.0, 0.0, 0.0)];
            self.log.push(ControllerEvent::Detected { p_odom, radius: vec![0.03; 2] });
        }
        if let Some(target) = self.targets.get(frame / 10) {
            match frame % 10 {
                1 => {
                    self.log.push(ControllerEvent::AttemptStarted { p_odom_target: *target, radius: 0.03 });
                    self.log.push(ControllerEvent::StateChanged { state: "reach".into() });
                }
                3 => self.log.push(ControllerEvent::Grasped { width: 0.06 }),
                5 => {
                    self.log.push(ControllerEvent::StemGaveWay { pull: 12.0 });
                    self.log.push(ControllerEvent::StateChanged { state: "deposit".into() });
                }
                8 => self.log.push(ControllerEvent::AttemptEnded { failure: None }),
                _ => {}
            }
        }
        Command {
            arm_q: observation.arm_q,
            arm_v: JointValues::zeros(7),
            base_velocity: [0.0; 3],
            finger_q: 0.0,
            finger_force: 0.0,
            vacuum: 0.0,
        }
    }

    fn drain_log(&mut self) -> Vec<ControllerEvent> {
        std::mem::take(&mut self.log)
    }
}

/// Makes fake worlds; world 2 of every seed cannot be built.
pub struct FakeFactory;

impl WorldFactory for FakeFactory {
    type World = FakeWorld;
    type Controller = FakeController;

    fn build(&self, key: &EpisodeKey) -> Result<(FakeWorld, FakeController), String> {
        if key.world == 2 {
            return Err("no static equilibrium".into());
        }
        let world = FakeWorld::new(key.seed, key.world);
        let controller = FakeController::new(&world);
        Ok((world, controller))
    }
}

/// A plan of 2 seeds x 4 fake worlds x 30 s.
pub fn plan() -> Plan {
    Plan {
        scenario: Names::paper("fake"),
        scenario_hash: "hash".into(),
        profile: "quick".into(),
        conditions: vec![Condition {
            name: "nominal".into(),
            params: ConditionParams {
                dials: Dials { fruit_count: 5, foliage_density: 0.6, terrain_amplitude_m: 0.0 },
                trees: 4,
                horizon_s: 30.0,
                repeats: 1,
            },
        }],
        sweeps: Vec::new(),
        seed_set: SeedSetLabel::custom(),
        seeds: vec![7, 8],
        frame: FRAME,
        config_hash: config_hash(&[("fake.toml", "")]),
        protocol: Protocol::paper(),
        backend: Backend::Cpu,
    }
}

/// The key of a hand-made record.
pub fn key() -> EpisodeKey {
    EpisodeKey {
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.into(),
        config_hash: "hash".into(),
        scenario: Names::paper("fake"),
        condition: "nominal".into(),
        seed: 1,
        world: 0,
        repeat: 0,
        horizon_frames: 60,
        backend: Backend::Cpu,
    }
}

/// A record with the given fruit, (final state, reachable), all in the middle inner zone, and nothing else.
pub fn record(fruit: &[(FruitState, bool)]) -> EpisodeRecord {
    let mut record = never_started(key(), String::new());
    record.outcome = Outcome::BudgetSpent;
    record.max_stem_pull_n = Some(0.0);
    record.fruit = fruit
        .iter()
        .enumerate()
        .map(|(i, &(final_state, reachable))| FruitRecord {
            id: i as u32,
            p_world: [0.1 * i as f64, 0.3, 1.1],
            radius: 0.03,
            reachable,
            zone: Some(Zone::MiddleInner),
            final_state,
        })
        .collect();
    record.fruit_total = fruit.len() as u32;
    record.reachable = record.fruit.iter().filter(|f| f.reachable).map(|f| f.id).collect();
    record.reachable_count = record.reachable.len() as u32;
    record.zone_census.insert(Zone::MiddleInner, record.reachable_count);
    record
}

/// An attempt in the middle inner zone: placed after `cycle` seconds, or blocked; `gripped` and `detached` are numbers of
/// fruit.
pub fn attempt(cycle: Option<f64>, gripped: u32, detached: u32) -> AttemptRecord {
    AttemptRecord {
        id: 0,
        start_frame: 0,
        end_frame: 1,
        start_time: 0.0,
        end_time: FRAME,
        p_odom_target: [0.0; 3],
        fruit: None,
        zone: Some(Zone::MiddleInner),
        outcome: if cycle.is_some() { AttemptOutcome::Placed } else { AttemptOutcome::Failed },
        failure_reason: cycle.is_none().then(|| "blocked".to_owned()),
        gripped: (0..gripped).collect(),
        detached: (0..detached).collect(),
        placed: cycle.iter().map(|_| 0).collect(),
        cycle_time: cycle,
        states: Vec::new(),
        belief: Belief::default(),
        held: Vec::new(),
        knocked_off: Vec::new(),
        snapped: Vec::new(),
        max_stem_pull_n: Some(0.0),
        max_finger_force_n: Some(0.0),
        max_wrist_force_n: Some(0.0),
    }
}

/// A contact attempt of one frame at a fruit.
pub fn contact_attempt(fruit: u32, outcome: ContactOutcome) -> ContactAttemptRecord {
    let detached = !matches!(outcome, ContactOutcome::LeftOnTree | ContactOutcome::RunEnded);
    ContactAttemptRecord {
        fruit,
        start_frame: 1,
        end_frame: 1,
        start_time: FRAME,
        end_time: FRAME,
        gripped: detached && outcome != ContactOutcome::KnockedOff,
        detached,
        outcome,
    }
}

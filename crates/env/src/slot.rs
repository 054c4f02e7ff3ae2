//! One environment: a world with its episode.

use orchard_geometry::Vec3;
use orchard_policy::{DepthReading, Encoding, Motion, Reading, Values};
use orchard_robot::{Command, JointValues, Pictures};
use orchard_scenario::Scenario;
use orchard_tasks::component::{Gentle, ReachAndGrasp};
use orchard_tasks::protocol::Protocol;
use orchard_tasks::stall::StallWatch;
use orchard_world::{World, WorldEvent};
use serde::{Deserialize, Serialize};

mod drive;
mod pictures;
mod saved;

use crate::alone::Alone;
use crate::component::{Learnable, Trial};
use crate::damage::Damage;
use crate::error::EnvError;
use crate::harvest::Harvest;
use crate::instruction::instruction;
use crate::interface::Interface;
use crate::privileged;
use crate::report::{Ending, Report, Statistics};
use crate::rules::LearningRules;
use crate::settings::Task;
use crate::starts::Starts;

/// Worlds that are tried for a target.
const TRIES: u32 = 32;

/// Parts that all environments share.
pub(crate) struct Shared {
    pub scenario: Scenario,
    pub protocol: Protocol,
    pub rules: LearningRules,
    pub interface: Interface,
    pub encoding: Encoding,
    /// True if depth images stay on the device that draws them.
    pub images_elsewhere: bool,
    /// True if a graphics device draws the pictures: whoever moves the worlds has it draw them.
    pub pictures_elsewhere: bool,
    /// Hash of scenario, protocol and settings, by which saved states know where they belong.
    pub identity: String,
    /// Starts by world: the world at rest with its first episode, or `None` if the task has no target in it.
    pub starts: Starts<Option<(Box<World>, Episode)>>,
}

/// An environment.
pub(crate) struct Slot {
    /// Place in the list, and index of its first world.
    env: usize,
    first: u32,
    running: Option<(Box<World>, Episode)>,
    values: Vec<Values>,
    pub report: Report,
}

/// An episode under way.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Episode {
    seed: u64,
    /// Number of the episode since the seed was given.
    number: u32,
    task: State,
    stall: StallWatch,
    /// The arm's set points \[rad\].
    set: JointValues,
    /// The latest pictures.
    pictures: Option<Pictures>,
    /// The task in words, where they are drawn from truth.
    sentence: Option<String>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
enum State {
    Harvest(Harvest),
    Reach(Trial<ReachAndGrasp>),
    Gentle(Trial<Gentle>),
}

/// A step under way.
pub(crate) struct Stepping {
    /// Frames taken.
    frames: u32,
    /// Frame of the last image that the camera delivers in it.
    last_image: Option<u32>,
    /// True after a frame in which pictures are taken.
    pub are_pictures_due: bool,
    damage: Damage,
    ending: Option<Ending>,
}

impl Stepping {
    /// Number of the next frame, from 0; none if the step or the episode is over.
    pub fn next_frame(&self, shared: &Shared) -> Option<u32> {
        let goes_on = self.ending.is_none() && self.frames < shared.interface.policy.frames;
        goes_on.then_some(self.frames)
    }

    /// True after the frame whose image is the last one of the step.
    pub fn is_image_due(&self) -> bool {
        self.last_image == Some(self.frames)
    }
}

impl Slot {
    pub fn new(env: usize, first: u32) -> Self {
        Self { env, first, running: None, values: Vec::new(), report: Report::default() }
    }

    /// Arrays of the latest observation.
    pub fn values(&self) -> &[Values] {
        &self.values
    }

    /// Seed and index of the world; none before the first reset.
    pub fn world(&self, shared: &Shared) -> Option<(u64, u32)> {
        let (world, episode) = self.running.as_ref()?;
        Some((shared.starts.world_of(episode.seed, self.first, episode.number).0, world.index()))
    }

    /// Seed and number of the episode that a reset begins: the first of a seed, or the next one.
    fn next(&self, seed: Option<u64>) -> (u64, u32) {
        match (seed, &self.running) {
            (Some(seed), _) => (seed, 0),
            (None, Some((_, episode))) => (episode.seed, episode.number.wrapping_add(1)),
            (None, None) => (0, 0),
        }
    }

    /// Index of the world in which a reset begins the next episode, unless there is no target in it.
    pub fn next_world(&self, seed: Option<u64>, shared: &Shared) -> u32 {
        let (seed, number) = self.next(seed);
        shared.starts.world_of(seed, self.first, number).1
    }

    /// Begins an episode: the first of a seed, or the next one.
    pub fn reset(&mut self, seed: Option<u64>, shared: &Shared) -> Result<(), EnvError> {
        let (seed, number) = self.next(seed);
        let tries = shared.interface.pool.map_or(TRIES, |pool| TRIES.min(pool.trees));
        for tried in 0..tries {
            let number = number.wrapping_add(tried);
            let (of_seed, index) = shared.starts.world_of(seed, self.first, number);
            let start = shared.starts.of(index, || shared.start(of_seed, index))?;
            let Some((world, episode)) = start else { continue };
            self.running = Some((world, Episode { seed, number, ..episode }));
            self.report = Report::default();
            self.look(shared);
            return Ok(());
        }
        let (seed, world) = shared.starts.world_of(seed, self.first, number);
        let task = shared.interface.task.name();
        Err(EnvError::NoTarget { env: self.env, task, tried: tries, world, seed })
    }

    /// Checks that the episode goes on.
    pub fn goes_on(&self) -> Result<(), EnvError> {
        let env = self.env;
        match self.running {
            None => Err(EnvError::NotStarted { env }),
            Some(_) if self.report.terminated || self.report.truncated => Err(EnvError::Ended { env }),
            Some(_) => Ok(()),
        }
    }

    /// Checks that an action can be taken.
    pub fn check(&self, action: &[f32], shared: &Shared) -> Result<(), EnvError> {
        self.goes_on()?;
        let env = self.env;
        match shared.encoding.refused(action) {
            Some((channel, value)) => Err(EnvError::Action { env, channel: channel.name.clone(), value }),
            None => Ok(()),
        }
    }

    /// Takes an action that [`Self::check`] allows.
    pub fn step(&mut self, action: &[f32], alone: &Alone, shared: &Shared) {
        let Some(motion) = self.motion(action, shared) else { return };
        self.advance(alone, shared, |frame, _| motion.command(frame));
        self.keep(&motion);
    }

    /// The motion of an action; none before the first reset.
    pub fn motion(&self, action: &[f32], shared: &Shared) -> Option<Motion> {
        let (_, episode) = self.running.as_ref()?;
        Some(shared.encoding.motion(action, &episode.set))
    }

    /// Keeps the end of a motion that was taken as the arm's set points.
    pub fn keep(&mut self, motion: &Motion) {
        if let Some((_, episode)) = &mut self.running {
            // The last command is there but for rounding.
            episode.set = motion.end();
        }
    }

    /// Takes the frames of an action, if the episode goes on, with a command for each.
    pub fn advance(
        &mut self,
        alone: &Alone,
        shared: &Shared,
        mut command: impl FnMut(u32, &mut World) -> Command,
    ) {
        let Some(mut stepping) = self.begin_step(shared) else { return };
        while let Some(frame) = stepping.next_frame(shared) {
            let Some((mut world, episode)) = self.running.take() else { return };
            let command = command(frame, &mut world);
            self.running = Some((alone.step(world, &command), episode));
            self.after_frame(&mut stepping, &command, shared);
            if let (Some((world, _)), true) = (&mut self.running, stepping.is_image_due()) {
                world.observe();
            }
            if stepping.are_pictures_due {
                self.take_pictures_here(shared);
            }
        }
        self.end_step(&stepping, shared);
    }

    /// Begins a step of some frames; none before the first reset.
    pub fn begin_step(&mut self, shared: &Shared) -> Option<Stepping> {
        let (world, episode) = self.running.as_mut()?;
        // Only the last image of a step is seen.
        let seen = shared.interface.policy.spaces.depth;
        let frames = shared.interface.policy.frames;
        let last_image = (1..=frames).rev().find(|&k| seen && world.delivers_in(k));
        episode.task.begin_step(world);
        Some(Stepping {
            frames: 0,
            last_image,
            are_pictures_due: false,
            damage: Damage::default(),
            ending: None,
        })
    }

    /// Number of frames that a step can take before somebody looks at wood or fruit, and true if somebody does after the last of them. The episode does not end before, unless something happens to the tree. None is left after the end
    /// of the step.
    pub fn frames_ahead(&self, stepping: &Stepping, shared: &Shared) -> (u32, bool) {
        let (Some((world, episode)), Some(_)) = (&self.running, stepping.next_frame(shared)) else {
            return (0, false);
        };
        let ends = episode.task.frames_left(world, shared).min(episode.stall.frames_left());
        let left = (shared.interface.policy.frames - stepping.frames).min(ends);
        let looked = (1..=left).find(|&frames| self.is_looked_at(world, stepping, frames, shared));
        (looked.unwrap_or(left), looked.is_some())
    }

    /// True if task or observations look at wood or fruit so many frames later in a step.
    fn is_looked_at(&self, world: &World, stepping: &Stepping, frames: u32, shared: &Shared) -> bool {
        let next = stepping.frames + frames;
        let pictures = shared.encoding.pictures();
        stepping.last_image == Some(next)
            || pictures.is_some_and(|request| request.is_due(world.frame() + frames))
            || (shared.ends_with_tree() && next == shared.interface.policy.frames)
    }

    /// The world, to move it.
    pub fn world_mut(&mut self) -> Option<&mut World> {
        self.running.as_mut().map(|(world, _)| &mut **world)
    }

    /// Judges a frame of a step after the world has moved under a command.
    pub fn after_frame(&mut self, stepping: &mut Stepping, command: &Command, shared: &Shared) {
        let Some((world, episode)) = &mut self.running else { return };
        episode.set = command.arm_q;
        stepping.frames += 1;
        let events = world.drain_events();
        stepping.damage.take(&events);
        stepping.ending = episode.task.after_frame(world, &events, shared);
        let request = shared.encoding.pictures();
        stepping.are_pictures_due = request.is_some_and(|request| request.is_due(world.frame()));
        if stepping.ending.is_none() && episode.stall.stalled(&world.sense()) {
            stepping.ending = Some(Ending::STALLED);
        }
    }

    /// Ends a step: its report, and what is observed after it.
    pub fn end_step(&mut self, stepping: &Stepping, shared: &Shared) {
        let Some((world, episode)) = &self.running else { return };
        let (damage, ending) = (&stepping.damage, stepping.ending.clone());
        self.report = shared.judge(world, &episode.task, damage, ending, &self.report.statistics);
        self.look(shared);
    }

    /// Reads the sensors.
    pub fn look(&mut self, shared: &Shared) {
        let Some((world, episode)) = &self.running else { return };
        let depth = world.camera_truth().map(|truth| DepthReading {
            image: (!shared.images_elsewhere).then(|| truth.measured()),
            time: f64::from(truth.sight.frame) * world.spec().sim.frame(),
        });
        let target = match &episode.task {
            State::Harvest(_) => None,
            State::Reach(trial) => Some(ReachAndGrasp::told(trial.target())),
            State::Gentle(trial) => Some(Gentle::told(trial.target())),
        };
        let (pictures, description) = (episode.pictures.as_ref(), episode.sentence.as_deref());
        let reading = Reading { sensed: &world.sense(), depth, pictures, target, description };
        self.values = shared.encoding.read(&reading);
        if shared.interface.privileged {
            let (goal, left) = episode.task.goal(world);
            self.values.push(privileged::read(world, goal, left));
        }
    }
}

impl Shared {
    /// True if the rewards or observations of a step are told by wood or fruit at its end.
    pub fn ends_with_tree(&self) -> bool {
        self.interface.privileged || self.interface.task == Task::Harvest
    }

    /// The first episode of a seed in a world, at its start; `None` if the world has no target.
    pub fn start(&self, seed: u64, index: u32) -> Result<Option<(Box<World>, Episode)>, EnvError> {
        let mut world = self.build(seed, index)?;
        let Some(task) = State::new(&world, seed, self) else { return Ok(None) };
        let mut stall = StallWatch::new(&self.protocol.rules, world.spec().sim.frame());
        stall.stalled(&world.sense());
        match world.delivers().filter(|_| self.interface.policy.spaces.depth) {
            Some(sight) if self.images_elsewhere => world.deliver_undrawn(sight),
            Some(_) => drop(world.observe()),
            None => {}
        }
        let request = self.encoding.pictures().filter(|_| !self.pictures_elsewhere);
        let pictures = request.map(|request| world.take_pictures(request));
        let (set, sentence) = (self.encoding.start(), task.sentence(&world, self, seed));
        Ok(Some((Box::new(world), Episode { seed, number: 0, task, stall, set, pictures, sentence })))
    }

    fn build(&self, seed: u64, index: u32) -> Result<World, EnvError> {
        self.scenario.world(seed, index, 0).map_err(|source| EnvError::World { world: index, source })
    }

    /// Reward, cost and end of a step.
    fn judge(
        &self,
        world: &World,
        task: &State,
        damage: &Damage,
        ending: Option<Ending>,
        before: &Statistics,
    ) -> Report {
        let cost = damage.cost(&self.rules.cost);
        let (mut terms, deposited, completeness) = match task {
            State::Harvest(harvest) => {
                (harvest.end_step(world), harvest.deposited(), harvest.completeness(world))
            }
            State::Reach(trial) => (trial.end_step(world), 0, trial.completeness()),
            State::Gentle(trial) => (trial.end_step(world), 0, trial.completeness()),
        };
        let weights = &self.interface.reward;
        // The damage is the last term.
        terms[weights.len() - 1] = -cost;
        for (value, term) in terms.iter_mut().zip(weights) {
            // Ways in a world in quarantine are not numbers.
            *value = if value.is_finite() { *value * term.weight } else { 0.0 };
        }
        // The task's success is the first.
        let reward = if self.interface.sparse { terms[0] } else { terms.iter().sum() };
        let mut total = before.damage;
        total.branches_snapped += damage.branches_snapped;
        total.fruit_dropped += damage.fruit_dropped;
        total.spurs_torn += damage.spurs_torn;
        let statistics = Statistics {
            total_reward: before.total_reward + reward,
            total_cost: before.total_cost + cost,
            length: before.length + 1,
            time: f64::from(world.frame()) * self.interface.policy.frame,
            deposited,
            completeness,
            damage: total,
        };
        Report {
            reward,
            terms,
            cost,
            terminated: ending.as_ref().is_some_and(|ending| ending.terminated),
            truncated: ending.as_ref().is_some_and(|ending| !ending.terminated),
            is_success: ending.as_ref().is_some_and(|ending| ending.success),
            outcome: ending.map(|ending| ending.outcome.to_owned()),
            statistics,
        }
    }
}

impl State {
    /// The task at the start of a world; none if the world has no target for it.
    fn new(world: &World, seed: u64, shared: &Shared) -> Option<Self> {
        match shared.interface.task {
            Task::Harvest => {
                let horizon = (shared.interface.horizon / shared.interface.policy.frame).round() as u32;
                Some(Self::Harvest(Harvest::new(world, horizon)))
            }
            Task::Reach => Trial::new(world, &shared.protocol.component, seed).map(Self::Reach),
            Task::Gentle => Trial::new(world, &shared.protocol.component, seed).map(Self::Gentle),
        }
    }

    /// Point to which the task leads, and the number of reachable fruit left on the tree.
    fn goal(&self, world: &World) -> (Option<Vec3>, usize) {
        match self {
            Self::Harvest(harvest) => harvest.goal(world),
            Self::Reach(trial) => (Some(world.fruit_truth()[trial.target().fruit as usize].p_world), 0),
            Self::Gentle(trial) => (Some(trial.target().p_world.into()), 0),
        }
    }

    /// The task in words drawn from truth, which ranked tasks do not have.
    fn sentence(&self, world: &World, shared: &Shared, seed: u64) -> Option<String> {
        let Self::Reach(trial) = self else { return None };
        let asked = shared.interface.policy.spaces.description;
        let fruit = trial.target().fruit as usize;
        asked.then(|| instruction(world, fruit, &shared.rules.instruction, seed))
    }

    fn begin_step(&mut self, world: &World) {
        match self {
            Self::Harvest(harvest) => harvest.begin_step(world),
            Self::Reach(trial) => trial.begin_step(world),
            Self::Gentle(trial) => trial.begin_step(world),
        }
    }

    fn after_frame(&mut self, world: &World, events: &[WorldEvent], shared: &Shared) -> Option<Ending> {
        match self {
            Self::Harvest(harvest) => harvest.after_frame(world, events),
            Self::Reach(trial) => trial.after_frame(world, events, &shared.protocol.component),
            Self::Gentle(trial) => trial.after_frame(world, events, &shared.protocol.component),
        }
    }

    fn frames_left(&self, world: &World, shared: &Shared) -> u32 {
        match self {
            Self::Harvest(harvest) => harvest.frames_left(world),
            Self::Reach(trial) => trial.frames_left(world, &shared.protocol.component),
            Self::Gentle(trial) => trial.frames_left(world, &shared.protocol.component),
        }
    }

    fn fits(&self, world: &World) -> bool {
        match self {
            Self::Harvest(harvest) => harvest.fits(world),
            Self::Reach(trial) => trial.fits(world),
            Self::Gentle(trial) => trial.fits(world),
        }
    }
}

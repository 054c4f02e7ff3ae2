//! Many environments of a task.

use std::ops::Range;

use orchard_picker::{Controller, Goal};
use orchard_policy::{Encoding, SettingError, Spaces, Target, Values};
use orchard_scenario::Scenario;
use orchard_tasks::component::{Component, Gentle, ReachAndGrasp};
use orchard_tasks::protocol::Protocol;
use orchard_world::World;
use rayon::prelude::*;

use crate::alone::Alone;
use crate::component::Learnable;
use crate::driven::{Driven, Via};
use crate::error::EnvError;
use crate::interface::Interface;
use crate::mover::Mover;
use crate::report::Report;
use crate::rules::LearningRules;
use crate::settings::{Settings, Task, WORLDS};
use crate::slot::{Shared, Slot};
use crate::starts::Starts;
use crate::together::Crew;
use crate::{harvest, privileged};

/// A task on many worlds: each environment has a world of its own and steps it by actions.
///
/// The bits of an environment depend on scenario, settings, seed, the index of its world and its actions, and on nothing else: not on the
/// other environments, nor on the number of threads (worlds run in parallel on the current rayon pool).
pub struct TaskEnv {
    shared: Shared,
    slots: Vec<Slot>,
    mover: Mover,
    /// Moves each world under a controller, and under actions where `mover` moves none together.
    alone: Alone,
}

impl TaskEnv {
    /// Makes one environment for each index of a range of worlds. The first reset builds them.
    ///
    /// # Errors
    /// Settings that do not fit, rules that the protocol does not have, or worlds beyond [`WORLDS`].
    pub fn new(scenario: &Scenario, settings: &Settings, worlds: Range<u32>) -> Result<Self, EnvError> {
        let mover = |frames: usize| Mover::new(scenario, settings.backend, worlds.len(), frames);
        Self::under(scenario, settings, worlds.clone(), mover)
    }

    /// Makes one environment whose world takes a berth on a graphics device, or beside it. It advances with the worlds of other threads: its steps wait for theirs.
    ///
    /// # Errors
    /// As [`Self::new`].
    #[cfg(feature = "gpu")]
    pub fn in_berth(
        scenario: &Scenario,
        settings: &Settings,
        world: u32,
        berth: orchard_lockstep::Berth,
    ) -> Result<Self, EnvError> {
        let env = Self::under(scenario, settings, world..world + 1, |_| Ok(Mover::Cpu))?;
        Ok(Self { alone: Alone::Berth(berth), ..env })
    }

    /// Makes environments whose worlds `mover` moves; it is told the frames of a step.
    fn under(
        scenario: &Scenario,
        settings: &Settings,
        worlds: Range<u32>,
        mover: impl FnOnce(usize) -> Result<Mover, EnvError>,
    ) -> Result<Self, EnvError> {
        if worlds.end > WORLDS || worlds.is_empty() {
            let problem = format!("they are at least one, from 0 and below {WORLDS}");
            let value = format!("{}..{}", worlds.start, worlds.end);
            return Err(SettingError { option: "worlds", value, problem }.into());
        }
        let (spec, robot) = (scenario.spec(), scenario.robot());
        if let Some(fault) = spec.fault.as_ref().filter(|fault| fault.kind.is_between()) {
            let problem = "it acts between a robot and its controller, and here a policy sees and moves the robot itself; limb_falls and weight_on_arm are possible".to_owned();
            return Err(SettingError { option: "fault", value: fault.kind.to_string(), problem }.into());
        }
        let mut protocol = Protocol::of_scenario(scenario)?;
        // An episode has the first target of its world; the others take long to find.
        for targets in [&mut protocol.component.grasp.targets, &mut protocol.component.gentle.targets] {
            *targets = targets.with_value(1).unwrap_or_else(|_| targets.clone());
        }
        let rules = LearningRules::v1();
        let view = spec.camera.view();
        let size = [view.width.get() as usize, view.height.get() as usize];
        let spaces = Spaces { target: settings.task.target(), ..settings.spaces.clone() };
        let encoding = Encoding::new(robot, &spaces, size, spec.sim.frame_rate.si())?;
        let (horizon, reward) = match settings.task {
            Task::Harvest => (protocol.full.horizon.si(), harvest::terms(&rules.harvest)),
            Task::Reach => (ReachAndGrasp::time(&protocol.component), ReachAndGrasp::terms(&rules)),
            Task::Gentle => (Gentle::time(&protocol.component), Gentle::terms(&rules)),
        };
        let mut policy = encoding.interface().clone();
        policy.observation.extend(settings.privileged.then(privileged::field));
        let interface = Interface {
            version: rules.version.clone(),
            task: settings.task,
            task_description: Target::sentence(settings.task.target()),
            robot: scenario.names().scene.robot.clone(),
            scenario: scenario.scene_hash(),
            horizon,
            sparse: settings.sparse,
            reward,
            privileged: settings.privileged,
            pool: settings.pool,
            policy,
        };
        let identity = format!("{interface:?} {protocol:?}");
        let identity = orchard_bench::digest::config_hash(&[("env", &identity)]);
        let mover = mover(interface.policy.frames as usize)?;
        let pictures_elsewhere = !mover.is_cpu();
        let slots = worlds.enumerate().map(|(env, world)| Slot::new(env, world)).collect();
        let scenario = scenario.clone();
        Ok(Self {
            shared: Shared {
                scenario,
                protocol,
                rules,
                interface,
                encoding,
                images_elsewhere: false,
                pictures_elsewhere,
                identity,
                starts: Starts::new(settings.pool)?,
            },
            slots,
            mover,
            alone: Alone::Here,
        })
    }

    /// Number of environments.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// False: there is at least one.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// The conventions of actions, observations and rewards.
    pub fn interface(&self) -> &Interface {
        &self.shared.interface
    }

    /// Begins an episode in every environment that the mask names: with a seed the first one of that seed, without one the next. Before any
    /// seed was given, the seed is 0.
    ///
    /// # Errors
    /// A list of another length, a world that cannot be built or a task without a target in it; the first such environment is named. The
    /// others have begun their episodes then.
    pub fn reset(&mut self, seeds: &[Option<u64>], mask: &[bool]) -> Result<(), EnvError> {
        self.counted("seeds", seeds.len(), 1)?;
        self.counted("entries of the reset mask", mask.len(), 1)?;
        let shared = &self.shared;
        if let Some(pool) = shared.interface.pool {
            let chosen = self.slots.iter().zip(seeds).zip(mask).filter(|(_, chosen)| **chosen);
            let worlds = chosen.map(|((slot, seed), _)| slot.next_world(*seed, shared));
            shared.starts.prepare(worlds, |world| shared.start(pool.seed, world));
        }
        let done: Vec<Result<(), EnvError>> = self
            .slots
            .par_iter_mut()
            .zip(seeds)
            .zip(mask)
            .filter(|(_, chosen)| **chosen)
            .map(|((slot, seed), _)| slot.reset(*seed, shared))
            .collect();
        let entered = self.enter(mask);
        done.into_iter().collect::<Result<(), _>>().and(entered)
    }

    /// Lets the worlds of some environments enter their lanes.
    fn enter(&mut self, mask: &[bool]) -> Result<(), EnvError> {
        let Self { slots, mover, alone, shared } = self;
        let chosen = slots.iter().zip(mask).enumerate().filter(|(_, (_, chosen))| **chosen);
        let entering: Vec<_> = chosen.filter_map(|(lane, (slot, _))| Some((lane, slot.truth()?))).collect();
        entering.iter().try_for_each(|(_, world)| alone.enter(world))?;
        let entered = mover.enter(&entering, shared.interface.pool.is_some());
        // Those that have entered begin their episodes all the same.
        let settled = self.settle_pictures(mask);
        entered.and(settled).and(self.look_again(mask))
    }

    /// Draws the missing first pictures of some environments, and moves those that were drawn here into the device's arrays, if pictures stay there.
    fn settle_pictures(&mut self, mask: &[bool]) -> Result<(), EnvError> {
        let Self { slots, mover, shared, .. } = self;
        let each = slots.iter_mut().zip(mask).enumerate().filter(|(_, (_, chosen))| **chosen);
        mover.settle_pictures(each.map(|(lane, (slot, _))| (lane, slot)).collect(), shared)
    }

    /// Draws the latest images of some environments where those of all others are drawn.
    fn look_again(&mut self, mask: &[bool]) -> Result<(), EnvError> {
        let Self { slots, mover, shared, .. } = self;
        if mover.is_cpu() || !shared.interface.policy.spaces.depth {
            return Ok(());
        }
        let each = slots.iter_mut().zip(mask).enumerate().filter(|(_, (_, chosen))| **chosen);
        let mut chosen: Vec<(usize, &mut Slot)> = each.map(|(lane, (slot, _))| (lane, slot)).collect();
        let worlds = chosen.iter_mut().filter_map(|(lane, slot)| Some((*lane, slot.world_mut()?)));
        let mut worlds: Vec<_> = worlds.collect();
        mover.look_again(&mut worlds)?;
        chosen.par_iter_mut().for_each(|(_, slot)| slot.look(shared));
        Ok(())
    }

    /// Takes one action in every environment that the mask names; `actions` has the numbers of all environments, one after another.
    ///
    /// # Errors
    /// A list of another length, a number that is not finite, an environment without an episode or after its end; then none has stepped.
    pub fn step(&mut self, actions: &[f32], mask: &[bool]) -> Result<(), EnvError> {
        let size = self.shared.interface.policy.action.len();
        self.counted("numbers of actions", actions.len(), size)?;
        self.counted("entries of the mask", mask.len(), 1)?;
        let shared = &self.shared;
        let each = self.slots.par_iter().zip(actions.par_chunks_exact(size)).zip(mask);
        let refused = each.filter(|(_, chosen)| **chosen);
        let refused = refused.map(|((slot, action), _)| slot.check(action, shared).err());
        if let Some(refused) = refused.find_map_first(|refused| refused) {
            return Err(refused);
        }
        if !self.mover.is_cpu() {
            return self.step_together(actions, mask);
        }
        let alone = &self.alone;
        self.slots
            .par_iter_mut()
            .zip(actions.par_chunks_exact(size))
            .zip(mask)
            .filter(|(_, chosen)| **chosen)
            .for_each(|((slot, action), _)| slot.step(action, alone, shared));
        Ok(())
    }

    /// As [`Self::step`], some frames at a time. The environments of a crew advance together; while one crew is on the device, the other's frames are judged here.
    fn step_together(&mut self, actions: &[f32], mask: &[bool]) -> Result<(), EnvError> {
        let Self { shared, slots, mover, .. } = self;
        let (shared, lanes) = (&*shared, slots.len());
        let size = shared.interface.policy.action.len();
        let mut each = slots.iter_mut().zip(actions.chunks_exact(size)).zip(mask).enumerate();
        let mut crews = Vec::new();
        for number in 0..mover.crews() {
            let own = each.by_ref().take(mover.lanes(number, lanes)).enumerate();
            let chosen = own.filter(|(_, (_, (_, chosen)))| **chosen);
            let chosen = chosen.map(|(lane, (index, ((slot, action), _)))| ([index, lane], slot, action));
            let mut crew = Crew::new(number, chosen.collect(), shared, mover);
            crew.begin(mover)?;
            crews.push(crew);
        }
        while crews.iter().any(|crew| crew.is_under_way) {
            for crew in crews.iter_mut().filter(|crew| crew.is_under_way) {
                crew.end(mover)?;
                crew.begin(mover)?;
            }
        }
        Ok(())
    }

    /// Counts of frames by the place where they were computed; `None` on the CPU.
    #[cfg(feature = "gpu")]
    pub fn tally(&self) -> Option<orchard_lockstep::Tally> {
        self.mover.tally()
    }

    /// Keeps the times of a frame's parts from now on, or no more ([`Self::profile`]); nothing on the CPU.
    #[cfg(feature = "gpu")]
    pub fn keep_profile(&mut self, detail: Option<orchard_lockstep::Detail>) {
        self.mover.keep_profile(detail);
    }

    /// Times of the parts of a frame on a device since [`Self::keep_profile`]; `None` if none are kept, and on the CPU.
    #[cfg(feature = "gpu")]
    pub fn profile(&self) -> Option<orchard_lockstep::Profile> {
        self.mover.profile()
    }

    /// Makes the scenario's controller for the present episode of an environment, with the task's goal if it has one.
    ///
    /// # Errors
    /// The environment has no episode, or the controller takes no goals.
    ///
    /// # Panics
    /// There is no such environment.
    pub fn controller(&self, env: usize) -> Result<Box<dyn Controller>, EnvError> {
        let scenario = &self.shared.scenario;
        if self.slots[env].truth().is_none() {
            return Err(EnvError::NotStarted { env });
        }
        let Some(goal) = self.goal(env) else { return Ok(scenario.controller()) };
        scenario.controller_with_goal(&goal).ok_or_else(|| {
            let problem = format!("it takes no goals, which {} needs", self.interface().task.name());
            SettingError { option: "controller", value: scenario.names().controller.clone(), problem }.into()
        })
    }

    /// Takes a step of one environment under a controller, which sees what it sees in the benchmark. Observation and report follow as
    /// after an action. Its frames are computed on the CPU, whatever the backend is, but for an environment in a berth ([`Self::in_berth`]).
    ///
    /// # Errors
    /// The environment has no episode, or it has ended; the device was lost.
    ///
    /// # Panics
    /// There is no such environment.
    pub fn drive(
        &mut self,
        env: usize,
        controller: &mut dyn Controller,
        via: Via,
    ) -> Result<Driven, EnvError> {
        self.slots[env].goes_on()?;
        self.catch_up(env..env + 1)?;
        self.mover.renew(env);
        let driven = self.slots[env].drive(controller, via, &self.alone, &self.shared);
        let own: Vec<bool> = (0..self.slots.len()).map(|k| k == env).collect();
        self.settle_pictures(&own)?;
        if self.shared.images_elsewhere {
            self.look_again(&own)?;
        }
        Ok(driven)
    }

    /// Keeps the observations on the graphics device from now on, in arrays of a row an environment ([`Self::device_arrays`]). Depth images and pictures are drawn into them; all else is sent by [`Self::send`]. [`Self::observation`] has no depth images then, and no pictures whose rows have whole words.
    /// `shared`: in memory that other interfaces can open.
    ///
    /// # Errors
    /// The worlds move on the processor; the device has no room, or cannot share memory.
    #[cfg(feature = "gpu")]
    pub fn keep_on_device(&mut self, shared: bool) -> Result<(), EnvError> {
        let policy = &self.shared.interface.policy;
        // Pictures of arrays that are replaced.
        let pictures = self.mover.read_pictures(&self.slots)?;
        for (slot, pictures) in self.slots.iter_mut().zip(pictures) {
            if let Some(pictures) = pictures {
                slot.set_pictures(pictures);
            }
        }
        self.mover.keep_there(&policy.observation, self.slots.len(), shared)?;
        self.shared.images_elsewhere = policy.spaces.depth;
        let all = vec![true; self.slots.len()];
        self.settle_pictures(&all)?;
        self.look_again(&all)
    }

    /// The arrays on the device, one for each field of [`orchard_policy::Interface::observation`] but text; none if there are none.
    #[cfg(feature = "gpu")]
    pub fn device_arrays(&mut self) -> Option<&mut [Option<orchard_gpu::DeviceArray>]> {
        self.mover.observed().map(crate::on_device::OnDevice::arrays)
    }

    /// Sends the latest observations to the arrays on the device, and waits until they are there.
    ///
    /// # Errors
    /// The device was lost.
    #[cfg(feature = "gpu")]
    pub fn send(&mut self) -> Result<(), EnvError> {
        let Self { shared, slots, mover, .. } = self;
        let Some(observed) = mover.observed() else { return Ok(()) };
        let sent = observed.send(&shared.interface.policy.observation, slots);
        sent.map_err(|e| EnvError::Device(e.to_string()))
    }

    /// The world of an environment, for truth and scoring; none before the first reset. On a device its wood and fruit are read now if they are behind.
    ///
    /// # Errors
    /// The device was lost.
    ///
    /// # Panics
    /// There is no such environment.
    pub fn truth(&mut self, env: usize) -> Result<Option<&World>, EnvError> {
        self.catch_up(env..env + 1)?;
        Ok(self.slots[env].truth())
    }

    /// Brings wood and fruit of some environments up to their robots.
    fn catch_up(&mut self, envs: Range<usize>) -> Result<(), EnvError> {
        let Self { slots, mover, .. } = self;
        let each = slots.iter_mut().enumerate().skip(envs.start).take(envs.len());
        mover.catch_up(each.filter_map(|(lane, slot)| Some((lane, slot.world_mut()?))).collect())
    }

    /// The latest observation of an environment: an array for each field of [`orchard_policy::Interface::observation`]; none before the first reset.
    ///
    /// # Panics
    /// There is no such environment.
    pub fn observation(&self, env: usize) -> &[Values] {
        self.slots[env].values()
    }

    /// Reward, cost and end of the latest step of an environment; zeros after a reset.
    ///
    /// # Panics
    /// There is no such environment.
    pub fn report(&self, env: usize) -> &Report {
        &self.slots[env].report
    }

    /// The goal of an environment's present episode; none for a task without one, and before the first reset.
    ///
    /// # Panics
    /// There is no such environment.
    pub fn goal(&self, env: usize) -> Option<Goal> {
        self.slots[env].goal()
    }

    /// Seed and index of an environment's world; none before the first reset.
    ///
    /// # Panics
    /// There is no such environment.
    pub fn world(&self, env: usize) -> Option<(u64, u32)> {
        self.slots[env].world(&self.shared)
    }

    /// The state of every environment as bytes. On a device the environments go on from it as they do after [`Self::restore`].
    ///
    /// # Errors
    /// An environment without an episode; the device was lost.
    pub fn snapshot(&mut self) -> Result<Vec<Vec<u8>>, EnvError> {
        self.catch_up(0..self.slots.len())?;
        (0..self.slots.len()).for_each(|lane| self.mover.renew(lane));
        let mut pictures = self.mover.read_pictures(&self.slots)?;
        pictures.resize(self.slots.len(), None);
        let each = self.slots.par_iter().zip(pictures);
        each.map(|(slot, pictures)| slot.save(pictures, &self.shared)).collect()
    }

    /// Goes back to states, one an environment.
    ///
    /// # Errors
    /// There is not one an environment, or one is damaged or belongs to another scenario, setting or world; then nothing has changed.
    pub fn restore(&mut self, states: &[Vec<u8>]) -> Result<(), EnvError> {
        self.counted("states", states.len(), 1)?;
        let shared = &self.shared;
        let restored: Vec<Result<Slot, EnvError>> =
            self.slots.par_iter().zip(states).map(|(slot, bytes)| slot.restored(bytes, shared)).collect();
        self.slots = restored.into_iter().collect::<Result<_, _>>()?;
        self.enter(&vec![true; self.slots.len()])
    }

    fn counted(&self, what: &'static str, given: usize, each: usize) -> Result<(), EnvError> {
        let envs = self.slots.len();
        if given == envs * each { Ok(()) } else { Err(EnvError::Count { what, given, envs }) }
    }
}

//! What a scaling run consists of.

use orchard_gpu::{Choice, Gpu};
use orchard_spec::randomisation::Mode;

use super::axes::AxesPlan;
use super::rules::{Effort, ScalingRules};
use super::run::ScalingError;
use super::solver::{Backend, SolverName};
use super::trees;
use crate::protocol::Protocol;

/// One batch that is timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// What differs between its worlds.
    pub mode: Mode,
    /// Its worlds: the first so many of the mode.
    pub worlds: u32,
    /// How they are advanced.
    pub solver: SolverName,
}

/// When a cell is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// It would take longer [s].
    pub cell_time: f64,
    /// It would take a larger part of the memory that is free.
    pub memory_share: f64,
}

/// How a batch goes on that does not begin anew with every course.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoingOn {
    /// For how long the device is kept busy before that [s].
    pub wake: f64,
    /// Frames before the first course.
    pub warm_up: u32,
    /// Frames from the kick after which no course begins.
    pub most: u32,
}

/// A scaling run: every mode x number of worlds x solver.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalingPlan {
    /// Profile.
    pub profile: String,
    /// What advances the batches.
    pub backend: Backend,
    /// Seed of all trees and kicks.
    pub seed: u64,
    /// What differs between the worlds of a batch, in order.
    pub modes: Vec<Mode>,
    /// Numbers of worlds, ascending.
    pub worlds: Vec<u32>,
    /// Worlds with a plant of their own: those beyond repeat the plants of the first.
    pub kinds: u32,
    /// Solvers, in order.
    pub solvers: Vec<SolverName>,
    /// Frames of a course.
    pub frames: u32,
    /// Whether courses follow each other. Else each begins anew, at the kick.
    pub going_on: Option<GoingOn>,
    /// Largest joint rate of a kick [rad/s].
    pub kick: f64,
    /// Times that a cell is measured.
    pub repeats: u32,
    /// Time for all of them [s].
    pub cell_time: f64,
    /// When a cell is left out; never, without.
    pub limits: Option<Limits>,
    /// Kinds of randomisation that are timed one by one.
    pub axes: Option<AxesPlan>,
    /// What every row says.
    pub note: Option<String>,
    /// Version of protocol and configs.
    pub config_version: String,
}

impl ScalingPlan {
    /// The protocol's plan, with every solver of this build on a backend, on the first tuning seed.
    pub fn of_protocol(protocol: &Protocol, profile: &str, effort: &Effort, backend: Backend) -> Self {
        let rules: &ScalingRules = &protocol.scaling;
        let device = &rules.device;
        let frame = trees::spec_of(Mode::Homogeneous).sim.frame();
        let most = (device.simulated.si() / frame).round() as u32;
        let (frames, going_on) = match backend {
            Backend::Cpu => (&rules.frames, None),
            Backend::Gpu => {
                let (wake, warm_up) = (device.wake.si(), device.warm_up.get());
                (&device.frames, Some(GoingOn { wake, warm_up, most }))
            }
        };
        Self {
            profile: profile.to_owned(),
            backend,
            seed: protocol.tuning_seeds.first().copied().unwrap_or_default(),
            modes: Mode::ALL.to_vec(),
            worlds: effort.worlds(),
            kinds: rules.kinds.get(),
            solvers: SolverName::built_for(backend),
            frames: frames.get(),
            going_on,
            kick: rules.kick.si(),
            repeats: effort.repeats.get(),
            cell_time: effort.cell_time.si(),
            limits: None,
            axes: None,
            note: None,
            config_version: protocol.version.clone(),
        }
    }

    /// The large sweep, or as much of it as shows that everything works.
    pub fn study(protocol: &Protocol, backend: Backend, quick: bool) -> Self {
        let study = &protocol.scaling.study;
        let (profile, effort) =
            if quick { ("study-quick", &study.quick) } else { ("study", study.effort(backend)) };
        let limits = Limits { cell_time: study.cell_limit.si(), memory_share: study.memory_share.si() };
        Self {
            limits: Some(limits),
            axes: Some(AxesPlan::of_rules(&study.axes)),
            ..Self::of_protocol(protocol, profile, effort, backend)
        }
    }

    /// Opens the device that the plan needs, if it needs one. On an adapter in software little is left of the plan.
    ///
    /// # Errors
    /// There is none, or it cannot be used.
    pub fn with_device(self, rules: &ScalingRules) -> Result<(Self, Option<Gpu>), ScalingError> {
        if self.backend == Backend::Cpu {
            return Ok((self, None));
        }
        let gpu = Gpu::open(Choice::Any).map_err(ScalingError::NoDevice)?;
        let is_software = gpu.info().is_software;
        Ok((if is_software { self.for_software(rules) } else { self }, Some(gpu)))
    }

    /// What an adapter in software can do.
    pub(super) fn for_software(mut self, rules: &ScalingRules) -> Self {
        let most = rules.device.software_worlds.get();
        self.worlds.retain(|worlds| *worlds <= most);
        self.frames = rules.device.software_frames.get();
        self.going_on = self.going_on.map(|going_on| GoingOn { wake: 0.0, ..going_on });
        self.note = Some(format!(
            "an adapter in software, which is for tests: at most {most} worlds, courses of {} frames",
            self.frames
        ));
        self
    }

    /// All cells, mode by mode, from few worlds to many, solver by solver.
    pub fn cells(&self) -> Vec<Cell> {
        self.modes.iter().flat_map(|&mode| self.cells_of(mode)).collect()
    }

    /// Those of a mode.
    pub(super) fn cells_of(&self, mode: Mode) -> Vec<Cell> {
        let of = |&worlds: &u32| self.solvers.iter().map(move |&solver| Cell { mode, worlds, solver });
        self.worlds.iter().flat_map(of).collect()
    }

    /// Checks that every cell can be timed.
    ///
    /// # Errors
    /// No cell, worlds that do not ascend from 1, no repeat, no frame, a solver that this build lacks.
    pub fn check(&self) -> Result<(), ScalingError> {
        let counts = self.repeats > 0
            && self.frames > 0
            && self.kinds > 0
            && self.worlds.first().is_some_and(|&first| first > 0);
        if !counts || !self.worlds.is_sorted_by(|a, b| a < b) || self.cells().is_empty() {
            return Err(ScalingError::NoCells);
        }
        match self.solvers.iter().find(|solver| !solver.is_built()) {
            Some(&solver) => Err(ScalingError::NotBuilt(solver)),
            None => Ok(()),
        }
    }
}

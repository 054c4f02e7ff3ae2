//! Plans of the scaling task.

use std::sync::Arc;

use orchard_geometry::math;
use orchard_scenario::Scenario;
use orchard_spec::Spec;
use orchard_spec::randomisation::{Axis, Mode};
use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;

use crate::device::{self, Gpu};
use crate::error::ScalingError;
use crate::rules::{AxesRules, Effort, ScalingRules};
use crate::solver::SolverName;

/// One batch that is timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// Mode: the differences between the worlds.
    pub mode: Mode,
    /// Number of worlds.
    pub worlds: u32,
    /// Solver.
    pub solver: SolverName,
}

/// Limits beyond which a cell is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Longest estimated time of a cell \[s\].
    pub cell_time: f64,
    /// Largest part of the free memory that a cell may need.
    pub memory_share: f64,
}

/// Timing rules for a batch whose courses follow each other without a reset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContinuousTiming {
    /// Time that the device is kept busy before timing starts \[s\].
    pub wake: f64,
    /// Frames before the first course.
    pub warm_up: u32,
    /// Largest number of frames from the kick to the start of a course.
    pub most: u32,
}

/// Plan for timing the kinds of randomisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxesPlan {
    /// Worlds of a batch.
    pub worlds: u32,
    /// Factors on the damping of the first and of the last world.
    pub damping: (f64, f64),
}

impl AxesPlan {
    /// Returns the plan of the protocol.
    pub fn of_rules(rules: &AxesRules) -> Self {
        Self { worlds: rules.worlds.get(), damping: rules.damping.si() }
    }

    /// Factor on the damping of a world: equal steps of ratio from the first world to the last.
    pub(crate) fn damping_factor(&self, index: u32) -> f64 {
        let (low, high) = self.damping;
        let steps = f64::from(self.worlds.saturating_sub(1).max(1));
        low * math::pow(high / low, f64::from(index) / steps)
    }
}

/// A scaling run: every mode x number of worlds x solver.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalingPlan {
    /// Config of the worlds: that of the scenario; if it has no randomisation, with every axis at strength 1.
    pub spec: Arc<Spec>,
    /// Profile.
    pub profile: String,
    /// Backend that advances the batches.
    pub backend: Backend,
    /// Seed of all trees and kicks.
    pub seed: u64,
    /// Modes: the differences between the worlds of a batch, in order.
    pub modes: Vec<Mode>,
    /// Numbers of worlds, ascending.
    pub worlds: Vec<u32>,
    /// Number of different trees; further worlds repeat them.
    pub kinds: u32,
    /// Solvers, in order.
    pub solvers: Vec<SolverName>,
    /// Frames of a course.
    pub frames: u32,
    /// Timing rules if courses follow each other; `None` if each course starts again at the kick.
    pub continuous: Option<ContinuousTiming>,
    /// Largest joint rate of a kick \[rad/s\].
    pub kick: f64,
    /// Repeats of a cell.
    pub repeats: u32,
    /// Time for all repeats of a cell \[s\].
    pub cell_time: f64,
    /// Limits beyond which a cell is left out; none where no cell is.
    pub limits: Option<Limits>,
    /// Plan for timing single kinds of randomisation.
    pub axes: Option<AxesPlan>,
    /// Remark of every row.
    pub note: Option<String>,
    /// Version of protocol and configs.
    pub config_version: String,
}

impl ScalingPlan {
    /// Makes the plan of an effort of the protocol for the worlds of a scenario: all solvers of this build for a backend, first tuning
    /// seed.
    ///
    /// # Errors
    /// The protocol does not have the scenario's rules, or its tree is digitised.
    pub fn new(
        scenario: &Scenario,
        profile: &str,
        effort: &Effort,
        backend: Backend,
    ) -> Result<Self, ScalingError> {
        if scenario.digitised_tree().is_some() {
            return Err(ScalingError::DigitisedTree);
        }
        let protocol = Protocol::of_scenario(scenario)?;
        let rules = ScalingRules::of(&protocol)?;
        let (device, spec) = (&rules.device, randomised(scenario.spec()));
        let most = (device.simulated.si() / spec.sim.frame()).round() as u32;
        let (frames, continuous) = match backend {
            Backend::Cpu => (&rules.frames, None),
            Backend::Gpu => {
                let (wake, warm_up) = (device.wake.si(), device.warm_up.get());
                (&device.frames, Some(ContinuousTiming { wake, warm_up, most }))
            }
        };
        Ok(Self {
            spec: Arc::new(spec),
            profile: profile.to_owned(),
            backend,
            seed: protocol.tuning_seeds.first().copied().unwrap_or_default(),
            modes: Mode::ALL.to_vec(),
            worlds: effort.worlds(),
            kinds: rules.kinds.get(),
            solvers: SolverName::built_for(backend),
            frames: frames.get(),
            continuous,
            kick: rules.kick.si(),
            repeats: effort.repeats.get(),
            cell_time: effort.cell_time.si(),
            limits: None,
            axes: None,
            note: None,
            config_version: protocol.version,
        })
    }

    /// Makes the plan of the large sweep, or of a short version as a smoke test.
    ///
    /// # Errors
    /// As [`ScalingPlan::new`].
    pub fn study(scenario: &Scenario, backend: Backend, quick: bool) -> Result<Self, ScalingError> {
        let study = ScalingRules::of(&Protocol::of_scenario(scenario)?)?.study;
        let (profile, effort) =
            if quick { ("study-quick", &study.quick) } else { ("study", study.effort(backend)) };
        let limits = Limits { cell_time: study.cell_limit.si(), memory_share: study.memory_share.si() };
        Ok(Self {
            limits: Some(limits),
            axes: Some(AxesPlan::of_rules(&study.axes)),
            ..Self::new(scenario, profile, effort, backend)?
        })
    }

    /// Opens the device if the plan needs one. On a software adapter the plan is reduced.
    ///
    /// # Errors
    /// No usable device.
    pub fn with_device(self, rules: &ScalingRules) -> Result<(Self, Option<Gpu>), ScalingError> {
        if self.backend == Backend::Cpu {
            return Ok((self, None));
        }
        let gpu = device::open().map_err(ScalingError::NoDevice)?;
        let is_software = gpu.info().is_software;
        Ok((if is_software { self.for_software(rules) } else { self }, Some(gpu)))
    }

    /// Reduces the plan for a software adapter, whose clocks need no warming.
    pub(crate) fn for_software(mut self, rules: &ScalingRules) -> Self {
        let most = rules.device.software_worlds.get();
        self.worlds.retain(|worlds| *worlds <= most);
        self.frames = rules.device.software_frames.get();
        self.continuous =
            self.continuous.map(|continuous| ContinuousTiming { wake: 0.0, warm_up: 0, ..continuous });
        self.note = Some(format!(
            "a software adapter, for tests only: at most {most} worlds, courses of {} frames",
            self.frames
        ));
        self
    }

    /// All cells, by mode, ascending number of worlds, and solver.
    pub fn cells(&self) -> Vec<Cell> {
        self.modes.iter().flat_map(|&mode| self.cells_of(mode)).collect()
    }

    /// Returns the cells of a mode.
    pub(crate) fn cells_of(&self, mode: Mode) -> Vec<Cell> {
        let of = |&worlds: &u32| self.solvers.iter().map(move |&solver| Cell { mode, worlds, solver });
        self.worlds.iter().flat_map(of).collect()
    }

    /// Checks that every cell can be timed.
    ///
    /// # Errors
    /// No cell, numbers of worlds that do not ascend from at least 1, no repeat, no frame, or a solver that this build lacks.
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

/// Returns a config with every axis of the randomisation at strength 1, unless the config already randomises something.
fn randomised(spec: &Spec) -> Spec {
    let mut spec = spec.clone();
    if Axis::ALL.iter().all(|&axis| spec.randomisation.strength(axis).si() == 0.0) {
        for &axis in Axis::ALL {
            let strength = spec.randomisation.strength_mut(axis);
            if let Ok(full) = strength.with_value(1.0) {
                *strength = full;
            }
        }
    }
    spec
}

//! Cost of each kind of randomisation alone: settled worlds that differ in this kind only, compared with as many identical worlds.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use orchard_batch::TreeWorld;
use orchard_spec::randomisation::{Axis, Mode};
use orchard_statistics::quantile::{ascending, quantile};
use rayon::ThreadPool;
use serde::{Deserialize, Serialize};

use crate::cell::{BatchStart, time};
use crate::device::Gpu;
use crate::error::ScalingError;
use crate::plan::{AxesPlan, ScalingPlan};
use crate::solver::SolverName;
use crate::trees::{Worlds, settled, spec_of, switch_off};

/// A kind of randomisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisKind {
    /// Density of wood.
    Mass,
    /// Young's modulus of wood.
    Stiffness,
    /// Damping of wood.
    Damping,
    /// Bend, droop, lean, forks and twist.
    HabitAngles,
    /// Size, mass and number of fruit; size and density of leaves.
    FruitAndLeaves,
    /// Lengths and radii of the whole tree and of each segment.
    Size,
}

impl AxisKind {
    /// All kinds of axes.
    pub const ALL: [Self; 6] =
        [Self::Mass, Self::Stiffness, Self::Damping, Self::HabitAngles, Self::FruitAndLeaves, Self::Size];

    /// Name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mass => "mass",
            Self::Stiffness => "stiffness",
            Self::Damping => "damping",
            Self::HabitAngles => "habit-angles",
            Self::FruitAndLeaves => "fruit-and-leaves",
            Self::Size => "size",
        }
    }

    /// Returns the axes of the randomisation that this kind varies; damping has none.
    fn axes(self) -> &'static [Axis] {
        match self {
            Self::Mass => &[Axis::WoodDensity],
            Self::Stiffness => &[Axis::YoungsModulus],
            Self::Damping => &[],
            Self::HabitAngles => &[Axis::SegmentBend, Axis::Droop, Axis::Lean, Axis::ForkSpread, Axis::Twist],
            Self::FruitAndLeaves => {
                &[Axis::FruitSize, Axis::FruitMass, Axis::FruitVisible, Axis::LeafSize, Axis::LeafDensity]
            }
            Self::Size => &[Axis::Scale, Axis::Stockiness, Axis::SegmentLength, Axis::SegmentRadius],
        }
    }
}

/// Cost of one kind of randomisation under a solver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxisRow {
    /// The kind.
    pub axis: AxisKind,
    /// Solver.
    pub solver: SolverName,
    /// Worlds, settled.
    pub worlds: u32,
    /// Frames of one world per second: the median of the repeats.
    pub env_steps_per_s: f64,
    /// That rate over the rate of as many identical worlds, timed alternately: the median of the repeats.
    pub relative: f64,
    /// Smallest and largest of the repeats.
    pub spread: [f64; 2],
    /// Remark.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Times every kind under every solver of a plan. `None` if `stop` was raised.
pub(crate) fn rows(
    plan: &ScalingPlan,
    axes: &AxesPlan,
    gpu: Option<&Gpu>,
    pool: &ThreadPool,
    stop: &AtomicBool,
) -> Result<Option<Vec<AxisRow>>, ScalingError> {
    let worlds = |kind| {
        pool.install(|| worlds_of(plan, axes, kind))
            .map_err(|reason| ScalingError::World { mode: Mode::DistinctDimensions, reason })
    };
    let identical = worlds(None)?;
    let kinds = AxisKind::ALL.into_iter().map(|kind| worlds(Some(kind))).collect::<Result<Vec<_>, _>>()?;
    let once =
        ScalingPlan { repeats: 1, cell_time: plan.cell_time / f64::from(plan.repeats), ..plan.clone() };
    let mut rows = Vec::new();
    for &solver in &plan.solvers {
        let rate = |worlds: &[TreeWorld]| -> Result<Option<f64>, ScalingError> {
            let worlds =
                Worlds { count: worlds.len() as u32, world: &|index| worlds[index as usize].clone() };
            let timed = time(&once, &BatchStart { worlds, solver, gpu }, pool, stop)?;
            Ok(timed.and_then(|timed| timed.rates.first().copied()))
        };
        let mut figures = vec![(Vec::new(), Vec::new()); kinds.len()];
        for _ in 0..plan.repeats {
            let Some(base) = rate(&identical)? else { return Ok(None) };
            for (worlds, (rates, relative)) in kinds.iter().zip(&mut figures) {
                let Some(rate) = rate(worlds)? else { return Ok(None) };
                rates.push(rate);
                relative.push(rate / base);
            }
        }
        rows.extend(AxisKind::ALL.into_iter().zip(figures).map(|(axis, (rates, relative))| {
            let at = |of: &[f64], p: f64| quantile(&ascending(of.iter().copied()), p).unwrap_or_default();
            AxisRow {
                axis,
                solver,
                worlds: axes.worlds,
                env_steps_per_s: at(&rates, 0.5) * f64::from(axes.worlds),
                relative: at(&relative, 0.5),
                spread: [at(&relative, 0.0), at(&relative, 1.0)],
                note: plan.note.clone(),
            }
        }));
    }
    Ok(Some(rows))
}

/// Builds settled worlds that differ in one kind; with `None`, identical worlds.
pub(crate) fn worlds_of(
    plan: &ScalingPlan,
    axes: &AxesPlan,
    kind: Option<AxisKind>,
) -> Result<Vec<TreeWorld>, String> {
    let Some(kind) = kind else {
        let world = settled(&Arc::new(spec_of(plan, Mode::Homogeneous)), plan.seed, 0)?;
        return Ok(vec![world; axes.worlds as usize]);
    };
    let mut spec = (*plan.spec).clone();
    spec.randomisation.mode = Mode::DistinctDimensions;
    for &axis in Axis::ALL.iter().filter(|axis| !kind.axes().contains(axis)) {
        switch_off(&mut spec, axis);
    }
    (0..axes.worlds)
        .map(|index| {
            let mut own = spec.clone();
            if kind == AxisKind::Damping {
                let damping = &mut own.wood.damping_time;
                *damping = damping.with_value(damping.value() * axes.damping_factor(index))?;
            }
            settled(&Arc::new(own), plan.seed, index)
        })
        .collect()
}

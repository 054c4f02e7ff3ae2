//! The scaling task: stepping rate of batches of trees.

use indicatif::{ProgressBar, ProgressStyle};
use orchard_bench::store::Store;
use orchard_bench::{OtherPlan, Session};
use orchard_scaling::{
    Omitted, RESULT, Row, Scaling, ScalingError, ScalingPlan, ScalingProgress, ScalingRules, SolverName,
    run as run_plan,
};
use orchard_scenario::Scenario;
use orchard_spec::randomisation::Mode;
use orchard_tasks::plan_file::{Backend, TaskPlan};
use orchard_tasks::protocol::Protocol;

use super::ProfileName;
use super::task::AnyTask;
use crate::columns::columns;
use crate::failure::Failure;

/// The planned scaling task.
pub struct Timing {
    plan: ScalingPlan,
    rules: ScalingRules,
}

impl Timing {
    /// Plans the task.
    pub fn new(scenario: &Scenario, profile: &str, backend: Backend) -> Result<Self, Failure> {
        let rules = ScalingRules::of(&Protocol::of_scenario(scenario)?)?;
        let efforts = [(ProfileName::Quick, &rules.quick), (ProfileName::Full, &rules.full)];
        let Some((_, effort)) = efforts.into_iter().find(|(name, _)| name.name() == profile) else {
            return Err(Failure::BadInput(format!("scaling: no profile {profile}")));
        };
        let plan = ScalingPlan::new(scenario, profile, effort, backend)
            .and_then(|plan| plan.check().map(|()| plan))
            .map_err(|e| Failure::BadInput(e.to_string()))?;
        Ok(Self { plan, rules })
    }
}

/// Checks that there is a device if a plan needs one.
pub fn check_device(plans: &[TaskPlan], scenario: &Scenario) -> Result<(), Failure> {
    let needs = |plan: &&TaskPlan| matches!(plan, TaskPlan::Scaling { backend: Backend::Gpu, .. });
    match plans.iter().find(needs) {
        None => Ok(()),
        Some(_) => {
            let rules = ScalingRules::of(&Protocol::of_scenario(scenario)?)?;
            let plan = ScalingPlan::new(scenario, "quick", &rules.quick, Backend::Gpu);
            plan.and_then(|plan| plan.with_device(&rules)).map(|_| ()).map_err(failure)
        }
    }
}

fn failure(e: ScalingError) -> Failure {
    match e {
        ScalingError::Interrupted { .. } => Failure::Interrupted(e.to_string()),
        e => Failure::Failed(e.to_string()),
    }
}

impl AnyTask for Timing {
    /// Accepts any folder, since every run overwrites the result file.
    fn check(&self, _: &Store) -> Result<(), OtherPlan> {
        Ok(())
    }

    fn run(&self, session: &Session<'_>) -> Result<(), Failure> {
        let (plan, gpu) = self.plan.clone().with_device(&self.rules).map_err(failure)?;
        let bar = Cells::new(&plan);
        let result = run_plan(&plan, gpu.as_ref(), session.store, session.threads, session.stop, &bar);
        bar.clear();
        let scaling = result.map_err(failure)?;
        say!("{}", report(&scaling, &self.rules).trim_end());
        say!("results: {}\n", session.store.path().join(RESULT).display());
        Ok(())
    }

    fn merge(&self, _: &[&Store], _: &Store) -> Result<(), Failure> {
        say!("{RESULT} belongs to one machine and is not merged");
        Ok(())
    }
}

/// Progress bar over the cells. Building a mode's worlds counts as much as its cells of one size.
pub struct Cells {
    bar: ProgressBar,
    /// Cells that building a mode's worlds counts as.
    solvers: u64,
}

impl Cells {
    /// Makes a bar at zero progress.
    pub fn new(plan: &ScalingPlan) -> Self {
        let solvers = plan.solvers.len() as u64;
        let bar = ProgressBar::new(plan.cells().len() as u64 + solvers * plan.modes.len() as u64);
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}  {elapsed} (about {eta} left)")
        {
            bar.set_style(style);
        }
        Self { bar, solvers }
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    fn say(&self, line: String) {
        if self.bar.is_hidden() {
            note!("{line}");
        }
        self.bar.set_message(line);
    }
}

impl ScalingProgress for Cells {
    fn building(&self, mode: Mode, worlds: u32) {
        self.say(format!("scaling, {}: up to {worlds} worlds", name(mode)));
        self.bar.inc(self.solvers);
    }

    fn row(&self, row: &Row) {
        self.bar.set_message(format!("scaling, {}: {} x {}", name(row.mode), row.worlds, row.solver.name()));
        self.bar.inc(1);
    }

    fn omitted(&self, omitted: &Omitted) {
        let Omitted { solver, mode, worlds, why } = omitted;
        self.say(format!("scaling, {}: {worlds} x {} skipped: {why}", name(*mode), solver.name()));
        self.bar.inc(1);
    }

    fn axes(&self) {
        self.say("scaling: single kinds of randomisation".to_owned());
    }
}

/// Name of a mode in files.
pub fn name(mode: Mode) -> &'static str {
    match mode {
        Mode::Homogeneous => "homogeneous",
        Mode::SharedDimensions => "shared-dimensions",
        Mode::DistinctDimensions => "distinct-dimensions",
        Mode::DistinctTopology => "distinct-topology",
    }
}

/// All figures as tables, one per mode.
fn report(scaling: &Scaling, rules: &ScalingRules) -> String {
    let from = match &scaling.adapter {
        Some(adapter) => format!("{}, courses of {} frames", adapter.name, scaling.frames),
        None => {
            let Scaling { threads, instructions, frames, .. } = scaling;
            format!("{threads} threads, lanes of f32 by {instructions}, {frames} frames from a kick")
        }
    };
    let mut text = format!(
        "scaling: {from}, {} substeps per frame; env-steps (frames of one world) and frames of the whole batch per second, memory of \
         the batch\n",
        scaling.substeps
    );
    if let Some(note) = scaling.rows.first().and_then(|row| row.note.as_ref()) {
        text += &format!("{note}\n");
    }
    for mode in Mode::ALL {
        text += &of_mode(scaling, rules, mode);
    }
    for solver in &scaling.left_out {
        text += &format!("\nthis build lacks the solver {}: {}\n", solver.name(), solver.needs());
    }
    let unfinite: u32 = scaling.rows.iter().map(|row| row.unfinite).sum();
    if unfinite > 0 {
        text += &format!("\nWRONG: {unfinite} worlds were not finite at the end of a course\n");
    }
    text += &format!("\n{:.0} s", scaling.wall_s);
    if let Some(peak) = scaling.peak_memory_mib {
        text += &format!(", at most {peak:.0} MiB");
    }
    text
}

/// One row per number of worlds: rates of every solver, the paper's rate, memory.
fn of_mode(scaling: &Scaling, rules: &ScalingRules, mode: Mode) -> String {
    let own: Vec<&Row> = scaling.rows.iter().filter(|row| row.mode == mode).collect();
    let Some(last) = own.last() else { return String::new() };
    let solvers: Vec<SolverName> =
        SolverName::ALL.into_iter().filter(|solver| own.iter().any(|row| row.solver == *solver)).collect();
    let mut head = vec!["worlds".to_owned()];
    head.extend(solvers.iter().map(|solver| format!("{} env-steps/s", solver.name())));
    head.push("paper".to_owned());
    head.extend(solvers.iter().map(|solver| format!("{} frames/s", solver.name())));
    // Solvers in f64 share a figure.
    let kinds = [
        ("MiB lanes", &[SolverName::Lanes][..]),
        ("MiB f64", &[SolverName::Aba, SolverName::Cg, SolverName::Cholesky]),
        ("MiB device", &[SolverName::DeviceAba, SolverName::DeviceCg]),
    ];
    let kinds: Vec<_> =
        kinds.into_iter().filter(|(_, of)| of.iter().any(|solver| solvers.contains(solver))).collect();
    head.extend(kinds.iter().map(|(name, _)| (*name).to_owned()));
    let mut worlds: Vec<u32> = own.iter().map(|row| row.worlds).collect();
    worlds.dedup();
    let mut rows = vec![head];
    for worlds in worlds {
        let of = |solver: SolverName| own.iter().find(|row| row.worlds == worlds && row.solver == solver);
        let rate = |solver: &SolverName, rate: fn(&Row) -> f64| figure(of(*solver).map(|row| rate(row)));
        let memory = |of_kind: &[SolverName]| {
            figure(of_kind.iter().find_map(|solver| of(*solver)).and_then(|row| row.memory_mib))
        };
        let mut row = vec![worlds.to_string()];
        row.extend(solvers.iter().map(|solver| rate(solver, |row| row.env_steps_per_s)));
        row.push(rules.published.at(mode, worlds).map_or_else(String::new, |paper| {
            if paper.low == paper.high {
                figure(Some(paper.low))
            } else {
                format!("{} to {}", figure(Some(paper.low)), figure(Some(paper.high)))
            }
        }));
        row.extend(solvers.iter().map(|solver| rate(solver, |row| row.step_rate_per_s)));
        row.extend(kinds.iter().map(|(_, of_kind)| memory(of_kind)));
        rows.push(row);
    }
    format!(
        "\n{}: {:.1} segments and {:.1} fruit per tree\n{}",
        name(mode),
        last.segments_per_tree,
        last.fruit_per_tree,
        columns(&rows, &[])
    )
}

/// Three significant digits, or all digits before the point.
fn figure(value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(value) if value.abs() >= 100.0 => format!("{value:.0}"),
        Some(value) if value.abs() >= 10.0 => format!("{value:.1}"),
        Some(value) => format!("{value:.2}"),
    }
}

//! `orchard verify`: runs a trajectory of a third-party controller in open loop.

use std::path::{Path, PathBuf};

use orchard_bench::store::{write_bytes, write_json};
use orchard_robot::RobotModel;
use orchard_scenario::Scenario;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::verify::{
    METRICS, Report, Trajectory, TreeOutcome, VerifyError, VerifyPlan, record_controller, run as run_plan,
};

use crate::args::{Part, ScenarioArgs, controller};
use crate::commands::bench_v1::bar::{Bar, RecordProgress};
use crate::commands::bench_v1::{Seeds, default_threads};
use crate::failure::Failure;
use crate::headline::fine_table;
use crate::interrupt;
use crate::program::Program;

/// Runs a trajectory of joints and base in open loop on trees, and reports the damage.
#[derive(clap::Args)]
#[command(after_help = "The trajectory is a table (.csv) with the columns\n  \
time,q1,q2,q3,q4,q5,q6,q7,vx,vy,wz,finger_q,finger_force\n\
or JSON lines (.jsonl) of {\"time\":0,\"arm_q\":[7 angles],\"base_velocity\":[vx,vy,wz],\"finger_q\":0.04,\"finger_force\":70}:\n\
seconds, radians, m/s and rad/s in the base frame, metres of each finger, newtons. Times must ascend; between rows all values\n\
are interpolated linearly at 60 Hz; the last posture is held for 1.5 s. There is no feedback. See docs/verify.md.\n\n\
The report has 95 % intervals over trees of: branches snapped, fruit knocked off and dropped, peak and integrated bending moment\n\
over rupture moment, impulse and peak force of the robot's contacts with wood. The JSON file has the same bytes on every run, for any\n\
number of threads. Ctrl-C leaves no file.\n\n\
Examples:\n  orchard verify --trajectory assets/trajectories/baseline-reach.csv --trees 20 --out verify.json\n  \
orchard verify --trajectory mine.jsonl --seeds 1,2,3 --trees 6 --preset paper\n  \
orchard verify --record mine.csv --seconds 12 --preset paper")]
pub struct Args {
    /// Trajectory file (.csv or .jsonl)
    #[arg(
        long,
        value_name = "FILE.csv|.jsonl",
        required_unless_present = "record",
        conflicts_with = "record"
    )]
    trajectory: Option<PathBuf>,
    /// Trees per seed
    #[arg(long, default_value_t = 6, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    trees: u32,
    /// Seeds: `tuning` (three seeds for tuning), `v1` (the five official seeds, not for tuning), or a list A,B,..
    #[arg(long, default_value = "20250704", value_name = "tuning|v1|A,B,..")]
    seeds: Seeds,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// JSON file for the report [default: only the table is printed]
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Instead, record the controller's commands on tree 0 of the first seed as a .csv trajectory
    #[arg(long, value_name = "FILE.csv")]
    record: Option<PathBuf>,
    /// Length of the recording [s]
    #[arg(long, default_value_t = 12.0, value_name = "SECONDS", allow_negative_numbers = true)]
    seconds: f64,
    /// Frames (1/60 s) between rows of the recording
    #[arg(long, default_value_t = 6, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=3600))]
    every: u32,
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    if args.record.is_none() {
        let blind = "not used: a trajectory runs in open loop, without camera, detector and controller";
        args.scenario.refuse(&[Part::Camera, Part::Detector, Part::Controller], blind)?;
    }
    let scenario = args.scenario.resolve_or(program, "randomised")?;
    let protocol = Protocol::of_scenario(&scenario)?;
    let robot = scenario.robot().clone();
    let seeds = args.seeds.resolve(&protocol).map_err(Failure::BadInput)?;
    let longest = protocol.verify.longest.si();
    if let Some(file) = &args.record {
        return record(args, file, seeds[0], &scenario, longest);
    }
    let Some(file) = &args.trajectory else {
        return Err(Failure::BadInput("--trajectory FILE is missing".into()));
    };
    let trajectory = read(file, &robot, longest)?;
    if let Some(out) = &args.out {
        check_folder(out)?;
    }
    let plan = VerifyPlan { scenario, trajectory, seeds, trees: args.trees, protocol };
    for warning in plan.trajectory.warnings() {
        note!("warning: {warning}");
    }
    let stop = interrupt::listen()?;
    let threads = args.threads.map_or_else(default_threads, |threads| threads as usize);
    let bar = Bar::new("verify", plan.worlds().len(), u64::from(plan.frames()), shown);
    let outcome = run_plan(&plan, threads, stop, &bar);
    bar.clear();
    let trees = outcome.map_err(|e| match e {
        VerifyError::Plan(e) => Failure::BadInput(e.to_string()),
        VerifyError::Interrupted { .. } => Failure::Interrupted(e.to_string()),
        VerifyError::Threads(_) => Failure::Failed(e.to_string()),
    })?;
    let name = file.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
    let report = Report::of_run(&plan, &name, trees);
    say!("{}", table(&report).trim_end());
    if let Some(out) = &args.out {
        write_json(out, &report).map_err(|e| Failure::Failed(e.to_string()))?;
        say!("report: {}", out.display());
    }
    Ok(())
}

/// Reads a trajectory; the extension of the file name gives the format.
fn read(file: &Path, robot: &RobotModel, longest: f64) -> Result<Trajectory, Failure> {
    let name = file.display().to_string();
    let bad = |problem: String| Failure::BadInput(format!("--trajectory {problem}"));
    let read = match file.extension().and_then(|extension| extension.to_str()) {
        Some("csv") => Trajectory::from_csv,
        Some("jsonl") => Trajectory::from_json_lines,
        _ => return Err(bad(format!("{name}: the file name must end in .csv or .jsonl"))),
    };
    let text =
        orchard_input::text(file, orchard_input::TRAJECTORY).map_err(|e| bad(format!("{name}: {e}")))?;
    read(&name, &text, robot, longest).map_err(|e| bad(e.to_string()))
}

fn check_folder(file: &Path) -> Result<(), Failure> {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            Err(Failure::BadInput(format!("{}: there is no folder {}", file.display(), folder.display())))
        }
        _ => Ok(()),
    }
}

fn shown(outcome: &TreeOutcome) -> RecordProgress {
    let outcome_text = match &outcome.quarantined {
        Some(reason) => format!("quarantined: {reason}"),
        None => format!(
            "{} snapped, {} fruit knocked off, peak moment {:.2} x rupture moment, impulse {:.1} N s",
            outcome.branches_snapped,
            outcome.fruit_knocked_off,
            outcome.peak_moment_ratio,
            outcome.contact_impulse_n_s
        ),
    };
    let frames = (outcome.duration_s * FRAMES_PER_SECOND).round() as u64;
    RecordProgress {
        steps: frames,
        line: format!("seed {} tree {}: {outcome_text}", outcome.seed, outcome.world),
    }
}

/// Control rate, used only for the progress bar.
const FRAMES_PER_SECOND: f64 = 60.0;

fn table(report: &Report) -> String {
    let order = METRICS.iter().map(|definition| (definition.info.name, definition.info.unit));
    format!(
        "{}: {} rows, {:.1} s, on {} trees of preset {}\n{}",
        report.trajectory.file,
        report.trajectory.rows,
        report.trajectory.duration_s,
        report.trees.len(),
        report.preset,
        fine_table(order, &report.metrics)
    )
}

fn record(args: &Args, file: &Path, seed: u64, scenario: &Scenario, longest: f64) -> Result<(), Failure> {
    if !(0.1..=longest).contains(&args.seconds) {
        let line = format!("--seconds {}: the allowed range is [0.1, {longest}] s", args.seconds);
        return Err(Failure::BadInput(line));
    }
    if file.extension().is_none_or(|extension| extension != "csv") {
        return Err(Failure::BadInput(format!(
            "--record {}: the file name must end in .csv",
            file.display()
        )));
    }
    check_folder(file)?;
    let world = scenario.world(seed, 0, 0);
    let mut world = world.map_err(|e| Failure::BadInput(format!("seed {seed}, tree 0: {e}")))?;
    let mut picker = controller(scenario)?;
    let frames = (args.seconds / world.spec().sim.frame()).round() as u32;
    let trajectory = record_controller(&mut world, scenario.robot(), &mut *picker, frames, args.every)
        .map_err(|e| Failure::Failed(e.to_string()))?;
    write_bytes(file, trajectory.to_csv().as_bytes()).map_err(|e| Failure::Failed(e.to_string()))?;
    say!("{} rows: {}", trajectory.rows().len(), file.display());
    Ok(())
}

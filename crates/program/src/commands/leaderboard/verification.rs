//! Verification of a submission, with progress and resumption.

use std::path::{Path, PathBuf};
use std::process;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use orchard_bench::store::Store;
use orchard_bench::{Session, gather};
use orchard_leaderboard::{Checked, Class, Head, Refusal, Submission, drawn, head, official};
use orchard_picker::foreign;
use orchard_scenario::{OptionValue, Scenario};
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::harvest::replays::Replays;
use orchard_tasks::harvest::{Harvest, WorldFactory};
use orchard_tasks::plan_file::PlanFile;
use orchard_tasks::seeds::SeedSetName;

use super::AddArgs;
use super::board_file::BoardFile;
use crate::commands::bench_v1::bar::{Bar, RecordProgress};
use crate::commands::bench_v1::default_threads;
use crate::failure::Failure;
use crate::program::Program;

/// Verifies a result against the official plan of the scenario under its controller. Episodes that were simulated again are kept beside
/// the board until the verification ends, so that an interrupted one resumes.
pub fn verified(
    args: &AddArgs,
    result: &Path,
    scenario: &Scenario,
    program: &Program,
    board: &BoardFile,
    stop: &AtomicBool,
) -> Result<(Submission, Checked), Failure> {
    let refused = |e: Refusal| refused(result, &e);
    let head = head(result).map_err(refused)?;
    let (scenario, is_own) = match program.under(scenario, &head.controller) {
        Ok(scenario) => (scenario, true),
        Err(_) => under_stored(result, &head, scenario)?,
    };
    let harvest = Harvest::new(scenario)?;
    let extent = official(harvest.protocol(), args.board.seed_set.name())
        .ok_or_else(|| Failure::BadInput("--seed-set: a board has a whole set".to_owned()))?;
    let plan = harvest.plan_of(extent)?;
    let submission = Submission::read(result, &plan).map_err(refused)?;
    let threads = args.threads.map_or_else(default_threads, |threads| threads as usize);

    let trees = submission.records.iter().filter(|record| record.key.repeat == 0).count();
    let bar = Bar::new("trees", trees, 1, |record: &EpisodeRecord| shown(record, 1, "the tree of its seed"));
    let checked = submission.check_trees(&plan, &harvest, threads, stop, &bar);
    bar.clear();
    checked.map_err(refused)?;

    let check = Check { args, submission: &submission, plan: &plan, board, threads, stop };
    let ended = match (&args.run_program, is_own) {
        // The program may print what it likes: its commands are played back here as well.
        (Some(path), _) => check.run_program(path, &head).and_then(|folder| {
            check
                .simulate("replay", &Replays::new(&harvest, &folder))
                .map(|episodes| (Class::ReRun, episodes))
        }),
        (None, true) => check.simulate("re-run", &harvest).map(|episodes| (Class::ReRun, episodes)),
        (None, false) if submission.has_commands() => check
            .simulate("replay", &submission.replays(&harvest))
            .map(|episodes| (Class::Replayed, episodes)),
        (None, false) => Ok((Class::Claimed, 0)),
    };
    if !matches!(ended, Err(Failure::Interrupted(_))) {
        let _ = std::fs::remove_dir_all(check.folder());
    }
    let (class, episodes) = ended?;
    Ok((submission, Checked { class, episodes: episodes as u32 }))
}

/// The scenario under a controller that this program does not have: under the policy whose files the result stores, which can be run again
/// (true), or with the config texts that the result gives.
fn under_stored(result: &Path, head: &Head, scenario: &Scenario) -> Result<(Scenario, bool), Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(format!("{}: refused: {e}", result.display()));
    let store = Store::open(result).map_err(|e| bad(&e))?;
    let plan = PlanFile::read(&store).map_err(|e| bad(&e))?;
    let stored = plan.scenario("harvest").ok_or_else(|| bad(&"plan.json has no scenario of the harvest"))?;
    if !stored.controller_files.is_empty() {
        let own = scenario.under_stored(stored, &[], PlanFile::FILE).map_err(|e| bad(&e))?;
        return Ok((own, true));
    }
    let kind = foreign(&head.controller, stored.controller_configs.clone());
    let controller = OptionValue::new(&head.controller, "summary.json: controller");
    let scenario = scenario.under(&controller, &[Arc::new(kind)]).map_err(|e| bad(&e))?;
    Ok((scenario, false))
}

fn refused(result: &Path, e: &Refusal) -> Failure {
    match e {
        Refusal::Interrupted => Failure::Interrupted(e.to_string()),
        Refusal::Threads(_) | Refusal::Run(_) => Failure::Failed(e.to_string()),
        e => Failure::BadInput(format!("{}: refused: {e}", result.display())),
    }
}

/// Inputs that all simulations of a verification share.
struct Check<'a> {
    args: &'a AddArgs,
    submission: &'a Submission,
    plan: &'a Plan,
    board: &'a BoardFile,
    threads: usize,
    stop: &'a AtomicBool,
}

impl Check<'_> {
    /// Folder of the episodes that are simulated again: that of the board and the records.
    fn folder(&self) -> PathBuf {
        let name = format!("verifying-{}", &self.submission.records_sha256[..16]);
        self.board.path().with_extension(name)
    }

    /// Simulates all episodes again, or a sample, and compares them; returns their number.
    fn simulate<F: WorldFactory>(&self, what: &'static str, factory: &F) -> Result<usize, Failure> {
        let result = self.args.results.first().map_or(Path::new(""), |path| path);
        let total = self.submission.records.len();
        let chosen: Vec<usize> = match self.args.sample {
            None => (0..total).collect(),
            Some(count) => drawn(random()?, total, count as usize),
        };
        let failed = |e: &dyn std::fmt::Display| Failure::Failed(e.to_string());
        let store = Store::open(&self.folder().join(what)).map_err(|e| failed(&e))?;
        let _lock = store.lock().map_err(|e| failed(&e))?;
        let session = Session::whole(&store, self.threads, self.stop);
        let longest = self.plan.episodes().iter().map(|key| u64::from(key.horizon_frames)).max().unwrap_or(0);
        let bar = Bar::new(what, chosen.len(), longest, |record: &EpisodeRecord| {
            shown(record, u64::from(record.frames), "simulated again")
        });
        let repeated = self.submission.repeat(self.plan, factory, &chosen, &session, &bar);
        bar.clear();
        repeated.map_err(|e| refused(result, &e))?;
        Ok(chosen.len())
    }

    /// Runs the whole matrix with another program and compares its records; returns the folder of its result.
    fn run_program(&self, path: &Path, head: &Head) -> Result<PathBuf, Failure> {
        note!(
            "warning: {} is executed with your rights; run a program that you do not trust in a sandbox",
            path.display()
        );
        let folder = self.folder().join("program");
        let set = self.args.board.seed_set.name();
        let bench: &[&str] = match set {
            SeedSetName::FieldV1 => &["bench-field"],
            _ => &["bench-v1", "--tasks", "harvest"],
        };
        let status = process::Command::new(path)
            .args(bench)
            .args(["--profile", "full", "--seeds", set.name()])
            .args(["--controller", &head.controller, "--threads", &self.threads.to_string(), "--out"])
            .arg(&folder)
            .args(self.args.scenario.words())
            .stdout(process::Stdio::null())
            .status()
            .map_err(|e| Failure::BadInput(format!("--run-program {}: {e}", path.display())))?;
        if self.stop.load(std::sync::atomic::Ordering::Relaxed) {
            return Err(refused(path, &Refusal::Interrupted));
        }
        if !status.success() {
            return Err(Failure::BadInput(format!(
                "--run-program {}: it ended with {status}",
                path.display()
            )));
        }
        let failed =
            |e: &dyn std::fmt::Display| Failure::BadInput(format!("--run-program {}: {e}", path.display()));
        let store = Store::open(&folder).map_err(|e| failed(&e))?;
        let records = gather::<EpisodeRecord>(&self.plan.episodes(), &[&store]).map_err(|e| failed(&e))?;
        self.submission.compare(&records).map_err(|e| failed(&e))?;
        Ok(folder)
    }
}

/// A number that nobody can know beforehand.
fn random() -> Result<u64, Failure> {
    getrandom::u64().map_err(|e| Failure::Failed(format!("no random number from the system: {e}")))
}

fn shown(record: &EpisodeRecord, steps: u64, done: &str) -> RecordProgress {
    let key = &record.key;
    let line =
        format!("{}, seed {} tree {} repeat {}: {done}", key.condition, key.seed, key.world, key.repeat);
    RecordProgress { steps, line }
}

//! `orchard leaderboard`: results of controllers, verified and ranked.

mod table;

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use orchard_bench::store::{write_bytes, write_json};
use orchard_leaderboard::{
    Added, Board, Budget, Entry, LeaderboardRules, Refusal, Verified, head, official, ranking, verify,
};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::plan::Plan;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::SeedSetName;

use crate::args::{Part, ScenarioArgs};
use crate::commands::bench_v1::bar::{Bar, RecordProgress};
use crate::commands::bench_v1::default_threads;
use crate::failure::Failure;
use crate::interrupt;
use crate::program::Program;

/// Verifies results and adds them to a leaderboard, or shows a leaderboard.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Add(AddArgs),
    Show(ShowArgs),
}

/// Verifies results and adds them to a board.
#[derive(clap::Args)]
#[command(
    after_help = "A submission is a result of the whole official matrix and a damage budget per tree. Make the result with this build:\n  \
orchard bench-v1 --tasks harvest --profile full --seeds v1 --controller NAME --out DIR\n\n\
Checks: versions, config hash and seeds are those of this build; every episode of the matrix is complete; the summary equals, byte by\n\
byte, the summary of the episodes; the records are consistent; a sample of episodes, drawn from the hash of all records, has the same\n\
bytes when run again. A result that fails a check is refused with the reason and exit code 2, and the board is unchanged.\n\
A new result replaces the entry of the same name. The same records under the same budget are refused.\n\n\
Files:\n  FILE.json   the board\n  FILE.md     the table\n  FILE.svg    completeness against damage, with the Pareto front\n\n\
Examples:\n  orchard leaderboard add results/bench-v1-full-expert-v1 --budget gentle\n  \
orchard leaderboard add DIR --snapped 0.05 --dropped 0.5 --name careful --sample 20\n  \
orchard leaderboard add DIR --budget paper --seed-set tuning      for practice"
)]
struct AddArgs {
    /// Result folders
    #[arg(value_name = "RESULT", required = true)]
    results: Vec<PathBuf>,
    #[command(flatten)]
    budget: BudgetArgs,
    #[command(flatten)]
    board: BoardArgs,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Name of the submission on the board [default: the name of the controller]
    #[arg(long, value_name = "NAME", value_parser = name)]
    name: Option<String>,
    /// Number of episodes to run again; a number above the total means all [default: by protocol, 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    sample: Option<u32>,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

/// Prints a board, ranked under each entry's own budget or under one budget for all.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  orchard leaderboard show\n  orchard leaderboard show --budget gentle")]
struct ShowArgs {
    #[command(flatten)]
    budget: BudgetArgs,
    #[command(flatten)]
    board: BoardArgs,
    #[command(flatten)]
    scenario: ScenarioArgs,
}

/// Damage budget per tree.
#[derive(clap::Args)]
struct BudgetArgs {
    /// Budget of the protocol, per tree: gentle (snapped <= 0.1, dropped <= 1) or paper (snapped <= 0.2, dropped <= 6)
    #[arg(long, value_name = "NAME", conflicts_with_all = ["snapped", "dropped"])]
    budget: Option<String>,
    /// Custom budget: largest number of branches snapped per tree
    #[arg(long, value_name = "B", requires = "dropped", allow_negative_numbers = true)]
    snapped: Option<f64>,
    /// Custom budget: largest number of fruit dropped per tree
    #[arg(long, value_name = "D", requires = "snapped", allow_negative_numbers = true)]
    dropped: Option<f64>,
}

/// Options that select a board.
#[derive(clap::Args)]
struct BoardArgs {
    /// Seed set of the board; a board has one seed set
    #[arg(long, value_enum, default_value_t = SetName::V1)]
    seed_set: SetName,
    /// File of the board [default: results/leaderboard-SEEDSET.json]
    #[arg(long, value_name = "FILE.json")]
    board: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SetName {
    V1,
    Tuning,
}

impl SetName {
    fn name(self) -> SeedSetName {
        match self {
            SetName::V1 => SeedSetName::V1,
            SetName::Tuning => SeedSetName::Tuning,
        }
    }
}

/// Longest name of a submission \[characters\]; longer names would break the table.
const LONGEST_NAME: usize = 40;

fn name(text: &str) -> Result<String, String> {
    let text = text.trim();
    // Characters without special meaning in Markdown and SVG.
    let plain = text.chars().all(|c| c.is_alphanumeric() || " -_.+()".contains(c));
    if (1..=LONGEST_NAME).contains(&text.chars().count()) && plain {
        Ok(text.to_owned())
    } else {
        Err(format!("must have 1 to {LONGEST_NAME} letters, digits, spaces or -_.+()"))
    }
}

impl BudgetArgs {
    /// The budget, if one is given.
    fn read(&self, protocol: &Protocol) -> Result<Option<Budget>, Failure> {
        let rules = &LeaderboardRules::of(protocol)?;
        if let Some(class) = &self.budget {
            let known: Vec<&str> = rules.budgets.keys().map(String::as_str).collect();
            return Budget::of_class(rules, class).map(Some).ok_or_else(|| {
                Failure::BadInput(format!("--budget {class}: the budgets are {}", known.join(", ")))
            });
        }
        match (self.snapped, self.dropped) {
            (Some(snapped), Some(dropped)) => Budget::of_figures(snapped, dropped)
                .map(Some)
                .map_err(|e| Failure::BadInput(format!("--snapped, --dropped: {e}"))),
            _ => Ok(None),
        }
    }
}

impl BoardArgs {
    fn file(&self) -> Result<PathBuf, Failure> {
        let default = || match self.seed_set {
            SetName::V1 => "results/leaderboard-v1.json".into(),
            SetName::Tuning => "results/leaderboard-tuning.json".into(),
        };
        let file = self.board.clone().unwrap_or_else(default);
        if file.extension().is_some_and(|extension| extension == "json") {
            Ok(file)
        } else {
            Err(Failure::BadInput(format!("--board {}: the file name must end in .json", file.display())))
        }
    }

    /// Reads the board; none if the file does not exist.
    fn read(&self, protocol: &Protocol, scenario: &Scenario) -> Result<Option<Board>, Failure> {
        let file = self.file()?;
        let bad = |e: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {e}", file.display()));
        let text = match fs::read_to_string(&file) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(bad(&e)),
        };
        let board = Board::from_json(&text).map_err(|e| bad(&e))?;
        board.check(&protocol.version, self.seed_set.name(), scenario).map_err(|e| bad(&e))?;
        Ok(Some(board))
    }
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    match &args.command {
        Command::Add(args) => add(args, program),
        Command::Show(args) => show(args, program),
    }
}

fn show(args: &ShowArgs, program: &Program) -> Result<(), Failure> {
    let scenario = args.scenario.resolve(program)?;
    let protocol = Protocol::of_scenario(&scenario)?;
    let budget = args.budget.read(&protocol)?;
    let file = args.board.file()?;
    let board = args.board.read(&protocol, &scenario)?;
    let board = board.ok_or_else(|| Failure::BadInput(format!("{}: no such board", file.display())))?;
    say!("{}", table::short(&board, budget.as_ref()).trim_end());
    Ok(())
}

fn add(args: &AddArgs, program: &Program) -> Result<(), Failure> {
    args.scenario.refuse(&[Part::Controller], "a result names its controller")?;
    let scenario = args.scenario.resolve(program)?;
    let protocol = Protocol::of_scenario(&scenario)?;
    let rules = LeaderboardRules::of(&protocol)?;
    let budget = args.budget.read(&protocol)?.ok_or_else(|| {
        let known: Vec<&str> = rules.budgets.keys().map(String::as_str).collect();
        let known = known.join(" or ");
        Failure::BadInput(format!("the budget is missing: give --budget {known}, or --snapped B --dropped D"))
    })?;
    if args.name.is_some() && args.results.len() > 1 {
        return Err(Failure::BadInput(
            "--name: only with a single RESULT, because names are unique on a board".to_owned(),
        ));
    }
    let file = args.board.file()?;
    let seed_set = args.board.seed_set.name();
    let mut board = args
        .board
        .read(&protocol, &scenario)?
        .unwrap_or_else(|| Board::new(&protocol.version, seed_set, &scenario));
    let stop = interrupt::listen()?;
    for result in &args.results {
        let verified = checked(args, result, &scenario, program, stop)?;
        let name = args.name.as_deref().unwrap_or(&verified.summary.controller);
        let refused = |e: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {e}", result.display()));
        let entry = Entry::new(name, budget.clone(), &verified).map_err(|e| refused(&e))?;
        let name = entry.name.clone();
        match board.add(entry).map_err(|e| refused(&e))? {
            Added::New => say!("{}: verified, on the board as {name}", result.display()),
            Added::InPlaceOf(old) => say!(
                "{}: verified, on the board as {name}; it replaces a result of completeness {:.3}",
                result.display(),
                old.completeness
            ),
        }
        say!("episodes run again with the same bytes: {}", verified.sample.join(", "));
        save(&board, &file)?;
    }
    say!("\n{}", table::short(&board, None).trim_end());
    say!("board: {}", file.display());
    Ok(())
}

/// Verifies a result against the official plan of the scenario under its controller.
fn checked(
    args: &AddArgs,
    result: &Path,
    scenario: &Scenario,
    program: &Program,
    stop: &std::sync::atomic::AtomicBool,
) -> Result<Verified, Failure> {
    let refused = |e: Refusal| match e {
        Refusal::Interrupted => Failure::Interrupted(e.to_string()),
        Refusal::Threads(_) => Failure::Failed(e.to_string()),
        e => Failure::BadInput(format!("{}: refused: {e}", result.display())),
    };
    let head = head(result).map_err(refused)?;
    let scenario = program.under(scenario, &head.controller).map_err(|e| {
        Failure::BadInput(format!(
            "{}: refused: this program cannot run its episodes again: {e}. Submit your own controller with the program that \
             contains it (docs/leaderboard.md)",
            result.display()
        ))
    })?;
    let harvest = Harvest::new(scenario)?;
    let protocol = harvest.protocol();
    let seed_set = args.board.seed_set.name();
    let extent = official(protocol, seed_set)
        .ok_or_else(|| Failure::BadInput("--seed-set: must be a named seed set".to_owned()))?;
    let plan = harvest.plan_of(extent)?;
    let sample = args.sample.unwrap_or(LeaderboardRules::of(protocol)?.sample.get()) as usize;
    let threads = args.threads.map_or_else(default_threads, |threads| threads as usize);
    let bar = Bar::new("run again", sample.min(plan.episodes().len()), longest(&plan), shown);
    let verified = verify(result, &plan, &harvest, sample, threads, stop, &bar);
    bar.clear();
    verified.map_err(refused)
}

/// Frames of the longest episode.
fn longest(plan: &Plan) -> u64 {
    plan.episodes().iter().map(|key| u64::from(key.horizon_frames)).max().unwrap_or(0)
}

fn shown(record: &EpisodeRecord) -> RecordProgress {
    let key = &record.key;
    let line = format!(
        "{}, seed {} tree {} repeat {}: the same bytes",
        key.condition, key.seed, key.world, key.repeat
    );
    RecordProgress { steps: u64::from(record.frames), line }
}

/// Writes the board, its table and its figure, each atomically.
fn save(board: &Board, file: &Path) -> Result<(), Failure> {
    let failed = |e: &dyn std::fmt::Display| Failure::Failed(e.to_string());
    if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder)
            .map_err(|e| Failure::BadInput(format!("--board {}: {e}", folder.display())))?;
    }
    let figure = orchard_report::pareto(board).map_err(|e| failed(&e))?;
    write_json(file, board).map_err(|e| failed(&e))?;
    let text = format!("# Leaderboard\n\n{}", table::whole(board));
    write_bytes(&file.with_extension("md"), text.as_bytes()).map_err(|e| failed(&e))?;
    write_bytes(&file.with_extension("svg"), figure.svg.as_bytes()).map_err(|e| failed(&e))
}

#[cfg(test)]
#[path = "leaderboard/tests.rs"]
mod tests;

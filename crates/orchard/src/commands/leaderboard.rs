//! `orchard leaderboard`: results of controllers, verified and ranked.

mod figure;
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

/// Puts results on a leaderboard, verified, or shows it.
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

/// Verifies results and puts them on a board.
#[derive(clap::Args)]
#[command(
    after_help = "A submission is a result of the whole official matrix and a budget of damage a tree. Make the result with this very build:\n  \
orchard bench-v1 --tasks harvest --profile full --seeds v1 --controller NAME --out DIR\n\n\
Verified are: versions, config hash and seeds; that every episode of the matrix is there, whole; that the summary is, byte by byte, what\n\
the episodes give; that records agree with themselves; and a sample of episodes, drawn by the hash of all of them, that are run again and\n\
must have the same bytes. A result that fails is refused with the reason: exit code 2, and the board is as it was.\n\
A name that is on the board already makes way for the new result; the same records under the same budget are refused.\n\n\
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
    /// Name of the submission on the board [default: the controller's]
    #[arg(long, value_name = "NAME", value_parser = name)]
    name: Option<String>,
    /// Episodes to run again; more than there are means all [default: by protocol, 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    sample: Option<u32>,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

/// Shows a board in order: each entry under its own budget, or all under one.
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

/// Damage a tree at most.
#[derive(clap::Args)]
struct BudgetArgs {
    /// Budget of the protocol: gentle, snapped <= 0.1 and dropped <= 1 a tree; paper, 0.2 and 6
    #[arg(long, value_name = "NAME", conflicts_with_all = ["snapped", "dropped"])]
    budget: Option<String>,
    /// Budget of one's own: branches snapped a tree at most
    #[arg(long, value_name = "B", requires = "dropped", allow_negative_numbers = true)]
    snapped: Option<f64>,
    /// Budget of one's own: fruit dropped a tree at most
    #[arg(long, value_name = "D", requires = "snapped", allow_negative_numbers = true)]
    dropped: Option<f64>,
}

/// Options that select a board.
#[derive(clap::Args)]
struct BoardArgs {
    /// Seeds of the board; those of different sets are never on one board
    #[arg(long, value_enum, default_value_t = SetName::V1)]
    seed_set: SetName,
    /// The board [default: results/leaderboard-SEEDSET.json]
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
    // Characters without a meaning in Markdown and SVG.
    let plain = text.chars().all(|c| c.is_alphanumeric() || " -_.+()".contains(c));
    if (1..=LONGEST_NAME).contains(&text.chars().count()) && plain {
        Ok(text.to_owned())
    } else {
        Err(format!("a name has 1 to {LONGEST_NAME} letters, digits, spaces or -_.+()"))
    }
}

impl BudgetArgs {
    /// The budget, if one is given.
    fn read(&self, protocol: &Protocol) -> Result<Option<Budget>, Failure> {
        let rules = &LeaderboardRules::of(protocol)?;
        if let Some(class) = &self.budget {
            let known: Vec<&str> = rules.budgets.keys().map(String::as_str).collect();
            return Budget::of_class(rules, class).map(Some).ok_or_else(|| {
                Failure::BadInput(format!("--budget {class}: there are {}", known.join(", ")))
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
            Err(Failure::BadInput(format!("--board {}: a name that ends in .json is needed", file.display())))
        }
    }

    /// The board in its file; none where there is no file.
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
    let board =
        board.ok_or_else(|| Failure::BadInput(format!("{}: there is no such board", file.display())))?;
    say!("{}", table::short(&board, budget.as_ref()).trim_end());
    Ok(())
}

fn add(args: &AddArgs, program: &Program) -> Result<(), Failure> {
    args.scenario.refuse(&[Part::Controller], "every result names its own")?;
    let scenario = args.scenario.resolve(program)?;
    let protocol = Protocol::of_scenario(&scenario)?;
    let rules = LeaderboardRules::of(&protocol)?;
    let budget = args.budget.read(&protocol)?.ok_or_else(|| {
        let known: Vec<&str> = rules.budgets.keys().map(String::as_str).collect();
        let known = known.join(" or ");
        Failure::BadInput(format!("a submission has a budget: --budget {known}, or --snapped B --dropped D"))
    })?;
    if args.name.is_some() && args.results.len() > 1 {
        return Err(Failure::BadInput("--name is for one RESULT: names are unique on a board".to_owned()));
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
                "{}: verified, on the board as {name} in the place of a result of completeness {:.3}",
                result.display(),
                old.completeness
            ),
        }
        say!("run again with the same bytes: {}", verified.sample.join(", "));
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
            "{}: refused: this program cannot run its episodes again: {e}. A controller of your own is put on a board by your own \
             program; docs/leaderboard.md tells how",
            result.display()
        ))
    })?;
    let harvest = Harvest::new(scenario)?;
    let protocol = harvest.protocol();
    let seed_set = args.board.seed_set.name();
    let extent = official(protocol, seed_set)
        .ok_or_else(|| Failure::BadInput("--seed-set: a board has a whole set".to_owned()))?;
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
    let svg = figure::svg(board)?;
    write_json(file, board).map_err(|e| failed(&e))?;
    let text = format!("# Leaderboard\n\n{}", table::whole(board));
    write_bytes(&file.with_extension("md"), text.as_bytes()).map_err(|e| failed(&e))?;
    write_bytes(&file.with_extension("svg"), svg.as_bytes()).map_err(|e| failed(&e))
}

#[cfg(test)]
#[path = "leaderboard/tests.rs"]
mod tests;

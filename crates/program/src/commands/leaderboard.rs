//! `orchard leaderboard`: results of controllers, verified and ranked.

mod board_file;
mod json;
mod table;
mod verification;

use std::path::PathBuf;

use clap::{Subcommand, ValueEnum};
use orchard_leaderboard::{
    Added, Board, Budget, Checked, Class, Entry, LeaderboardRules, check_name, ranking,
};
use orchard_scenario::Scenario;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::SeedSetName;

use self::board_file::BoardFile;
use crate::args::{Part, ScenarioArgs};
use crate::commands::bench_field;
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
the episodes give; that records agree with themselves; that every tree is the one of its seed. Then every episode is simulated again and\n\
must have the same bytes. The board shows the classes apart:\n  \
re-run    the controller was run again: one of this program, or the program of --run-program PATH, which is executed\n  \
replayed  the submitted commands were played back; that the controller found them blind is not proven\n  \
claimed   the result has no commands, so nothing but its trees was simulated\n\
A result that fails is refused with the reason: exit code 2, and the board is as it was. An interrupted verification resumes.\n\
A name that is on the board is refused without --replace; the same records are refused under another name or budget.\n\n\
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
    /// Number of episodes to simulate again, drawn at random and noted in the entry [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    sample: Option<u32>,
    /// Program that has the controller of the result; it is executed, so trust it or run it in a sandbox
    #[arg(long, value_name = "PATH")]
    run_program: Option<PathBuf>,
    /// Put the result in the place of the entry of the same name
    #[arg(long)]
    replace: bool,
    /// Threads [default: as many as the machine has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

/// Shows a board in order: each entry under its own budget, or all under one.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  orchard leaderboard show\n  orchard leaderboard show --budget gentle\n  orchard leaderboard show --json"
)]
struct ShowArgs {
    /// Print the ranked entries as JSON
    #[arg(long)]
    json: bool,
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
    /// Budget of the protocol, branches snapped and fruit dropped a tree: gentle, 0.1 and 1; paper, 0.2 and 6; in the field also grower, 0.05 and
    /// 0.15; trial, 0.25 and 0.5
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
    FieldV1,
    Tuning,
}

impl SetName {
    fn name(self) -> SeedSetName {
        match self {
            SetName::V1 => SeedSetName::V1,
            SetName::FieldV1 => SeedSetName::FieldV1,
            SetName::Tuning => SeedSetName::Tuning,
        }
    }
}

fn name(text: &str) -> Result<String, String> {
    let text = text.trim();
    check_name(text).map(|()| text.to_owned())
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
    /// The scenario in the benchmark of the board's seeds.
    fn of_benchmark(&self, scenario: Scenario) -> Scenario {
        match self.seed_set {
            SetName::FieldV1 => scenario.on_protocol(bench_field::PROTOCOL),
            SetName::V1 | SetName::Tuning => scenario,
        }
    }

    fn file(&self) -> Result<BoardFile, Failure> {
        let default = || PathBuf::from(format!("results/leaderboard-{}.json", self.seed_set.name()));
        BoardFile::new(self.board.clone().unwrap_or_else(default), self.seed_set.name())
    }
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    match &args.command {
        Command::Add(args) => add(args, program),
        Command::Show(args) => show(args, program),
    }
}

fn show(args: &ShowArgs, program: &Program) -> Result<(), Failure> {
    let scenario = args.board.of_benchmark(args.scenario.resolve(program)?);
    let protocol = Protocol::of_scenario(&scenario)?;
    let budget = args.budget.read(&protocol)?;
    let file = args.board.file()?;
    let board = file.read(&protocol, &scenario)?.ok_or_else(|| file.bad(&"there is no such board"))?;
    if args.json {
        say!("{}", json::text(&board, budget.as_ref())?);
    } else {
        say!("{}", table::short(&board, budget.as_ref()).trim_end());
    }
    Ok(())
}

fn add(args: &AddArgs, program: &Program) -> Result<(), Failure> {
    args.scenario.refuse(&[Part::Controller], "every result names its own")?;
    let scenario = args.board.of_benchmark(args.scenario.resolve(program)?);
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
    // A board that cannot take the result is found before the result is verified.
    file.read(&protocol, &scenario)?;
    let stop = interrupt::listen()?;
    for result in &args.results {
        let (submission, checked) = verification::verified(args, result, &scenario, program, &file, stop)?;
        let name = args.name.as_deref().unwrap_or(&submission.summary.controller);
        let refused = |e: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {e}", result.display()));
        let entry = Entry::new(name, budget.clone(), &submission, checked).map_err(|e| refused(&e))?;
        entry.check().map_err(|e| refused(&e))?;
        let name = entry.name.clone();
        let seed_set = args.board.seed_set.name();
        let empty = || Board::new(&protocol.version, seed_set, &scenario);
        let (added, board) = {
            let _lock = file.lock()?;
            let mut board = file.read(&protocol, &scenario)?.unwrap_or_else(empty);
            let added = board.add(entry, args.replace).map_err(|e| refused(&e))?;
            file.save(&board)?;
            (added, board)
        };
        let Checked { class, episodes } = checked;
        let extent = match class {
            Class::Claimed => String::new(),
            _ => format!(", {episodes} of {} episodes", submission.records.len()),
        };
        let place = match added {
            Added::New => String::new(),
            Added::InPlaceOf(old) => {
                format!(" in the place of a result of completeness {:.3}", old.completeness)
            }
        };
        say!("{}: {}{extent}; on the board as {name}{place}", result.display(), class.name());
        say!("\n{}", table::short(&board, None).trim_end());
    }
    say!("board: {}", file.path().display());
    Ok(())
}

#[cfg(test)]
#[path = "leaderboard/tests.rs"]
mod tests;

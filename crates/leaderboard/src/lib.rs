//! The leaderboard: submissions are results of a controller with a budget of damage; they are verified and ranked.
//!
//! A result is taken if it is the whole official matrix of this very build, if its summary is what its records give, if its trees are those
//! of its seeds, and if its episodes, run or replayed again, have the same bytes. `docs/leaderboard.md` describes how to submit.

mod board;
#[cfg(test)]
mod board_tests;
mod consistency;
mod difference;
mod entry;
mod official;
mod rank;
mod refusal;
mod rules;
mod sample;
#[cfg(test)]
mod tests;
mod verify;

pub use board::{Added, Board, BoardError};
pub use difference::{Difference, first_difference};
pub use entry::{Budget, Checked, Class, Entry, check_name};
pub use official::official;
pub use rank::{Ranked, pareto_front, ranking};
pub use refusal::Refusal;
pub use rules::{BudgetRules, LeaderboardRules};
pub use sample::drawn;
pub use verify::{Head, Submission, head};

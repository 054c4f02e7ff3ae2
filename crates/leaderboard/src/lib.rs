//! The leaderboard: verifies and ranks submissions. A submission is the result of a controller with a damage budget.
//!
//! A result is accepted if it is the whole official matrix, made by this build, if its summary follows from its records, and if a
//! sample of its episodes has the same bytes when run again. `docs/leaderboard.md` describes how to submit.

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
pub use entry::{Budget, Entry};
pub use official::official;
pub use rank::{Ranked, pareto_front, ranking};
pub use refusal::Refusal;
pub use rules::{BudgetRules, LeaderboardRules};
pub use verify::{Head, Verified, head, verify};

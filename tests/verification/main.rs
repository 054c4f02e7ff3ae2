//! Physics against closed forms, balances and the paper's own cases: one file a law.

mod balance;
mod cantilever;
mod damping;
mod fixture;
mod frequencies;
mod integrator;
mod ledger;
mod modes;
mod paper_cases;
mod rails;
mod rams;
mod spin;
mod stem_pendulum;
mod symmetry;
mod twig;

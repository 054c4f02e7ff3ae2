//! Rules of the benchmark, for tests: its config file is read as text, since this crate does not depend on the tasks.

use serde::Deserialize;

use crate::rules::{BootstrapRules, PairedRules};

#[derive(Deserialize)]
struct Rules {
    bootstrap: BootstrapRules,
    paired: PairedRules,
}

fn rules() -> Rules {
    toml::from_str(include_str!("../configs/bench/v1.toml")).unwrap()
}

/// Table `[bootstrap]`.
pub fn bootstrap() -> BootstrapRules {
    rules().bootstrap
}

/// Table `[paired]`.
pub fn paired() -> PairedRules {
    rules().paired
}

//! The program `orchard` with one controller more: `expert-unwatched`, the expert without its watch, for comparison.
//!
//! `cargo run --release -p orchardbench --example expert-unwatched -- bench-field --conditions faults --controller expert-unwatched`

use orchard_picker::{ExpertConfig, ExpertPicker};
use orchardbench::{Program, custom};

fn main() -> std::process::ExitCode {
    let unwatched = custom("expert-unwatched", "1", |robot, detector| {
        let config = ExpertConfig::preset();
        let config = config.tuned(robot).unwrap_or(config);
        ExpertPicker::new(robot, detector.clone(), config).without_watch()
    });
    Program::new().with(unwatched).main()
}

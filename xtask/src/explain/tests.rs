//! A short real episode, told.

use super::*;
use clap::Parser;
use orchard_bench::harvest::Harvest;
use orchard_bench::store::Store;
use orchard_bench::{Silent, run as run_plan};
use orchard_picker::Kind;
use std::sync::atomic::AtomicBool;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: Args,
}

fn explain(line: &[&str]) -> Result<(), Failure> {
    let line = [&["explain"], line].concat();
    run(&Line::try_parse_from(line).unwrap_or_else(|e| panic!("{e}")).args)
}

fn refused(line: &[&str]) -> String {
    match explain(line) {
        Err(Failure::BadInput(problem)) => problem,
        other => panic!("{other:?}"),
    }
}

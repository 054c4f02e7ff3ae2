//! `orchard report`: a result folder as one HTML page and SVG figures.

mod folder;
mod pictures;
mod records;

use std::path::{Path, PathBuf};

use anyhow::Context;
use orchard_bench::store::StoreError;
use orchard_report::{Figures, PaperFigures, Pictures, page};

use crate::failure::Failure;
use crate::out_folder::open_folder;
use crate::program::Program;

/// Writes a result folder's report: one HTML page with tables, figures and pictures, and the figures as SVG files.
#[derive(clap::Args)]
#[command(
    after_help = "Reads those of summary.json, detect.json, reach-and-grasp.json, gentle.json, compute.json and scaling.json that exist;\n\
                  a section without data names the command that makes it. Files:\n  \
                  DIR/report.html      the page: self-contained, opens in any browser without a network\n  \
                  DIR/figures/*.svg    its figures, the same bytes\n\
                  Figures are drawn from the JSON files alone. Pictures need the episodes' records and the same code version, because\n\
                  trees are grown and one episode is simulated again; --no-pictures leaves them out.\n\
                  Exit code 2: no result in the folder, an unreadable file, a summary or record that does not match its checksum, a\n\
                  command log that is not the one of its record, or a folder in use by a run.\n\n\
                  Examples:\n  orchard bench-v1 && orchard report results/bench-v1-quick\n  \
                  orchard report results/full --no-pictures"
)]
pub struct Args {
    /// Result folder of bench-v1
    #[arg(value_name = "DIR")]
    dir: PathBuf,
    /// Write figures and tables only, without simulation
    #[arg(long)]
    no_pictures: bool,
}

/// Names of the page and of the folder of its figures, under the result folder.
pub const PAGE: &str = "report.html";
const FIGURES: &str = "figures";

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    let written = write(&args.dir, args.no_pictures, program)?;
    say!(
        "report: {}, {} figures in {}",
        written.page.display(),
        written.figures,
        args.dir.join(FIGURES).display()
    );
    Ok(())
}

/// The written report.
pub struct Written {
    /// The page.
    pub page: PathBuf,
    /// Number of figures.
    pub figures: usize,
}

/// Writes the report of a folder.
pub fn write(dir: &Path, no_pictures: bool, program: &Program) -> Result<Written, Failure> {
    // Read once before the lock, which makes a file: a folder without results is left as it is.
    folder::read(dir).map_err(Failure::BadInput)?;
    let (store, _lock) = open_folder("report", dir)?;
    let results = folder::read(dir).map_err(Failure::BadInput)?;
    records::check(dir, &results).map_err(Failure::BadInput)?;
    let (protocol, paper) = (folder::protocol(dir, program), PaperFigures::paper());
    let figures = Figures::draw(&results, &protocol, &paper).context("cannot draw")?;
    let shown = if no_pictures {
        Pictures {
            left_out: Some("Pictures were left out (--no-pictures).".to_owned()),
            ..Pictures::default()
        }
    } else {
        pictures::draw(dir, &results, program)?
    };
    let html = page(&results, &figures, &shown, &protocol, &paper);
    let failed = |e: StoreError| Failure::BadInput(e.to_string());
    store.make_folder(FIGURES).map_err(failed)?;
    let count = figures.all().count();
    for figure in figures.all() {
        store
            .write_bytes(&format!("{FIGURES}/{}.svg", figure.stem), figure.svg.as_bytes())
            .map_err(failed)?;
    }
    store.write_bytes(PAGE, html.as_bytes()).map_err(failed)?;
    let page = dir.join(PAGE);
    Ok(Written { page, figures: count })
}

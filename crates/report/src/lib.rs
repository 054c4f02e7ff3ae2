//! Results of the benchmark for people: figures as SVG, and one self-contained HTML page.
//!
//! results (as the files hold them) -> figures -> page. Nothing here opens a file, reads a clock or simulates: the same results give
//! the same bytes. `docs/report.md` says how to read a page.

mod asked;
mod axis;
mod bars;
mod chart;
#[cfg(test)]
mod example;
mod figure;
mod figures;
mod page;
#[cfg(test)]
mod page_tests;
mod pictures;
mod published;
mod results;
mod sections;
mod table;
mod words;

pub use asked::{Demands, Judged, demands};
pub use figure::{Figure, FigureError};
pub use figures::{Figures, detection, pareto, populations};
pub use page::page;
pub use pictures::{Moment, Pick, Picture, Pictures};
pub use published::{At, PaperFigures, PaperTrees, PaperZones, REPORT_TOML};
pub use results::{Results, main_condition};

//! Results of the benchmark for people: figures as SVG, and one self-contained HTML page.
//!
//! results (the content of the files) -> figures -> page. Nothing here opens a file, reads a clock or simulates: the same results give
//! the same bytes. `docs/report.md` explains the page.

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
mod requirements;
mod results;
mod sections;
mod table;
mod words;

pub use figure::{Figure, FigureError};
pub use figures::{Figures, ScreenedParameter, detection, pareto, populations, precision_recall, screening};
pub use page::page;
pub use pictures::{Moment, Pick, Picture, Pictures};
pub use published::{DialFigure, PaperFigures, PaperTrees, PaperZones, REPORT_TOML};
pub use requirements::{ConditionRequirements, JudgedRequirement, judge_requirements};
pub use results::{Results, main_condition};

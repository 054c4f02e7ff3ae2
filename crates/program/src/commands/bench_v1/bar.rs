//! Progress display of a run.

use std::sync::{Mutex, PoisonError};

use indicatif::{ProgressBar, ProgressStyle};
use orchard_bench::Progress;

use crate::output::Escaped;

/// Progress bar on a terminal, otherwise a line for each record.
pub struct Bar<R> {
    bar: ProgressBar,
    total: usize,
    /// Steps of a complete record.
    steps: u64,
    done: Mutex<usize>,
    show: fn(&R) -> RecordProgress,
}

/// Progress information of one record.
pub struct RecordProgress {
    /// Steps of the record.
    pub steps: u64,
    /// One line.
    pub line: String,
}

impl<R> Bar<R> {
    /// Bar over `total` records of at most `steps` steps each. It counts steps; a record that ends early counts as complete.
    pub fn new(task: &'static str, total: usize, steps: u64, show: fn(&R) -> RecordProgress) -> Self {
        let bar = ProgressBar::new(total as u64 * steps);
        if let Ok(style) = ProgressStyle::with_template(
            "{prefix} {bar:30} {percent:>3} %  {msg}  {elapsed} (about {eta} left)",
        ) {
            bar.set_style(style);
        }
        bar.set_prefix(task);
        bar.set_message(format!("0/{total}"));
        Self { bar, total, steps, done: Mutex::new(0), show }
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    fn say(&self, line: &str) {
        if self.bar.is_hidden() {
            note!("{line}");
        } else {
            self.bar.println(Escaped(line).to_string());
        }
    }
}

impl<R> Progress<R> for Bar<R> {
    fn step(&self) {
        self.bar.inc(1);
    }

    fn record(&self, record: &R, reused: bool) {
        let RecordProgress { steps, line } = (self.show)(record);
        let computed = if reused { 0 } else { steps };
        self.bar.inc(self.steps.saturating_sub(computed));
        // A poisoned counter means that another thread panicked, which ends the run anyway.
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        *done += 1;
        self.bar.set_message(format!("{done}/{}", self.total));
        self.say(&format!("{done}/{}  {line}{}", self.total, if reused { " (stored)" } else { "" }));
    }

    fn note(&self, line: &str) {
        self.say(&format!("note: {line}"));
    }
}

//! One submission on the board.

use orchard_statistics::Metric;
use orchard_tasks::harvest::matrix::NOMINAL;
use serde::{Deserialize, Serialize};

use crate::refusal::Refusal;
use crate::rules::LeaderboardRules;
use crate::verify::Submission;

/// Damage a tree that a submission may do at most, on average over its nominal episodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Name in the protocol; null of one's own figures.
    pub class: Option<String>,
    /// Branches snapped a tree.
    pub snapped: f64,
    /// Fruit dropped a tree.
    pub dropped: f64,
}

impl Budget {
    /// A budget of the protocol; `None` if it has no such.
    pub fn of_class(rules: &LeaderboardRules, class: &str) -> Option<Self> {
        let budget = rules.budgets.get(class)?;
        let (snapped, dropped) = (budget.snapped.si(), budget.dropped.si());
        Some(Self { class: Some(class.to_owned()), snapped, dropped })
    }

    /// A budget of one's own.
    ///
    /// # Errors
    /// A figure that is not a number from 0 up.
    pub fn of_figures(snapped: f64, dropped: f64) -> Result<Self, String> {
        for (name, value) in [("snapped", snapped), ("dropped", dropped)] {
            if !value.is_finite() || value < 0.0 {
                return Err(format!("{name} = {value} is not a number from 0 up, a tree"));
            }
        }
        Ok(Self { class: None, snapped, dropped })
    }

    /// True if an amount of damage a tree is within the budget.
    pub fn admits(&self, snapped: f64, dropped: f64) -> bool {
        snapped <= self.snapped && dropped <= self.dropped
    }
}

impl std::fmt::Display for Budget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(class) = &self.class {
            write!(f, "{class}: ")?;
        }
        write!(f, "snapped <= {}, dropped <= {}", self.snapped, self.dropped)
    }
}

/// Class of an entry: the way in which it was verified. `docs/leaderboard.md` states what each proves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// The controller was run again and gave the same records.
    ReRun,
    /// The submitted commands gave the same records; that a controller found them blind is not proven.
    Replayed,
    /// Nothing was simulated except the trees.
    Claimed,
}

impl Class {
    /// All classes, the strongest first.
    pub const ALL: [Self; 3] = [Self::ReRun, Self::Replayed, Self::Claimed];

    /// Name, as boards and tables give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::ReRun => "re-run",
            Self::Replayed => "replayed",
            Self::Claimed => "claimed",
        }
    }
}

/// Extent of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checked {
    /// The way in which episodes were verified.
    pub class: Class,
    /// Number of episodes verified in this way. Fewer than all are a sample that the verifier drew at random.
    pub episodes: u32,
}

/// A verified submission. Figures are those of the nominal condition; damage and completeness by the definitions of the benchmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Name, unique on its board.
    pub name: String,
    /// Controller that harvested.
    pub controller: String,
    /// Budget that was chosen for it.
    pub budget: Budget,
    /// True if the damage of the entry is within its budget.
    pub within_budget: bool,
    /// Harvest completeness.
    pub completeness: f64,
    /// 95 % interval.
    pub completeness_ci95: [Option<f64>; 2],
    /// Branches snapped a tree.
    pub snapped_per_tree: f64,
    /// Fruit dropped a tree.
    pub dropped_per_tree: f64,
    /// Fruit deposited a minute.
    pub throughput_fruit_per_min: Option<f64>,
    /// Placed contact attempts over contact attempts, which the world counts.
    pub place_success_per_contact_attempt: Option<f64>,
    /// Placed attempts over attempts, as the controller declares them.
    pub place_success_per_attempt: Option<f64>,
    /// Episodes of all conditions.
    pub episodes: u32,
    /// Of these, with a quarantined world.
    pub quarantined: u32,
    /// Of these, in which the controller gave up: a network, for example, that gave no usable action.
    pub gave_up: u32,
    /// Code version.
    pub code_version: String,
    /// SHA-256 of all config texts.
    pub config_hash: String,
    /// SHA-256 over the names and bytes of all record files.
    pub records_sha256: String,
    /// Extent of its verification.
    pub checked: Checked,
}

/// Longest name on a board \[characters\], our own choice; longer names would break the table.
const LONGEST_NAME: usize = 40;

/// Checks a name on a board: letters, digits and a few signs that mean nothing in Markdown, SVG and HTML.
///
/// # Errors
/// The rule, in one line.
pub fn check_name(text: &str) -> Result<(), String> {
    let plain = text.chars().all(|c| c.is_alphanumeric() || " -_.+()".contains(c));
    if (1..=LONGEST_NAME).contains(&text.chars().count()) && plain && text.trim() == text {
        Ok(())
    } else {
        Err(format!("a name has 1 to {LONGEST_NAME} letters, digits, spaces or -_.+()"))
    }
}

impl Entry {
    /// A verified result under a name and a budget.
    ///
    /// # Errors
    /// The result has no nominal figures: for example, no tree had a reachable fruit.
    pub fn new(
        name: &str,
        budget: Budget,
        submission: &Submission,
        checked: Checked,
    ) -> Result<Self, Refusal> {
        let summary = &submission.summary;
        let nominal = summary.conditions.get(NOMINAL);
        let metric = |name: &str| -> Option<&Metric> { nominal?.metrics.get(name) };
        let mean = |name: &'static str| metric(name).and_then(|m| m.mean);
        let needed = |name: &'static str| mean(name).ok_or(Refusal::NothingToRank { metric: name });
        let (snapped, dropped) = (needed("branches_snapped_per_tree")?, needed("fruit_dropped_per_tree")?);
        Ok(Self {
            name: name.to_owned(),
            controller: summary.controller.clone(),
            within_budget: budget.admits(snapped, dropped),
            budget,
            completeness: needed("harvest_completeness")?,
            completeness_ci95: metric("harvest_completeness").map_or([None; 2], |m| m.ci95),
            snapped_per_tree: snapped,
            dropped_per_tree: dropped,
            throughput_fruit_per_min: mean("throughput_fruit_per_min"),
            place_success_per_contact_attempt: mean("place_success_per_contact_attempt"),
            place_success_per_attempt: mean("place_success_per_attempt"),
            episodes: summary.conditions.values().map(|c| c.episodes.len() as u32).sum(),
            quarantined: summary.quarantined,
            gave_up: summary.gave_up.values().sum(),
            code_version: summary.code_version.clone(),
            config_hash: summary.config_hash.clone(),
            records_sha256: submission.records_sha256.clone(),
            checked,
        })
    }

    /// Checks what a board file edited by hand can hold: names, ranges, and figures that contradict each other.
    ///
    /// # Errors
    /// The first problem, with the field and the allowed range.
    pub fn check(&self) -> Result<(), String> {
        let is = |holds: bool, problem: String| if holds { Ok(()) } else { Err(problem) };
        let in_range = |field: &str, value: f64, high: f64| {
            is((0.0..=high).contains(&value), format!("{field} = {value} is outside [0, {high}]"))
        };
        for (field, text) in [("name", &self.name), ("controller", &self.controller)] {
            check_name(text).map_err(|problem| format!("{field} {text:?}: {problem}"))?;
        }
        let class = self.budget.class.as_deref().unwrap_or("own");
        check_name(class).map_err(|problem| format!("budget.class {class:?}: {problem}"))?;
        for (field, value, high) in [
            ("completeness", Some(self.completeness), 1.0),
            ("completeness_ci95", self.completeness_ci95[0], self.completeness),
            ("place_success_per_contact_attempt", self.place_success_per_contact_attempt, 1.0),
            ("place_success_per_attempt", self.place_success_per_attempt, 1.0),
            ("throughput_fruit_per_min", self.throughput_fruit_per_min, f64::MAX),
            ("snapped_per_tree", Some(self.snapped_per_tree), f64::MAX),
            ("dropped_per_tree", Some(self.dropped_per_tree), f64::MAX),
            ("budget.snapped", Some(self.budget.snapped), f64::MAX),
            ("budget.dropped", Some(self.budget.dropped), f64::MAX),
        ] {
            value.map_or(Ok(()), |value| in_range(field, value, high))?;
        }
        if let Some(high) = self.completeness_ci95[1] {
            let holds = (self.completeness..=1.0).contains(&high);
            is(holds, format!("completeness_ci95 ends at {high}, outside [{}, 1]", self.completeness))?;
        }
        is(self.episodes > 0, "episodes = 0: an entry has at least one".to_owned())?;
        for (field, count) in [
            ("quarantined", self.quarantined),
            ("gave_up", self.gave_up),
            ("checked.episodes", self.checked.episodes),
        ] {
            is(count <= self.episodes, format!("{field} = {count} is outside [0, {}]", self.episodes))?;
        }
        is(
            self.records_sha256.len() == 64 && self.records_sha256.bytes().all(|b| b.is_ascii_hexdigit()),
            "records_sha256 is no SHA-256".to_owned(),
        )?;
        let plain = |text: &str| text.bytes().all(|b| b.is_ascii_alphanumeric() || b"+.-_".contains(&b));
        is(plain(&self.code_version), format!("code_version {:?} has other characters", self.code_version))?;
        is(plain(&self.config_hash), format!("config_hash {:?} has other characters", self.config_hash))?;
        let within = self.budget.admits(self.snapped_per_tree, self.dropped_per_tree);
        is(within == self.within_budget, "within_budget is not what its figures say".to_owned())
    }

    /// Damage a tree: branches snapped and fruit dropped.
    pub fn damage(&self) -> f64 {
        self.snapped_per_tree + self.dropped_per_tree
    }
}

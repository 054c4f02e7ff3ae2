//! The benchmark's matrix: its conditions, in sweeps and groups.
//!
//! A condition is a list of changes of the scenario, which the protocol holds as data. A sweep varies one dial of the worlds. Except for the
//! effect of the dial, trees, fruit sites and start poses are those of the reference condition, so that conditions can be compared tree by
//! tree. A group holds conditions that differ in other ways: in the population of the trees, the camera, the robot.

use std::collections::BTreeMap;

use orchard_quantity::Quantity;
use orchard_scenario::{Changes, Scenario};
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};

/// Name of the preset's own condition.
pub const NOMINAL: &str = "nominal";
/// Name of the nominal condition that runs until no reachable fruit is left.
pub const EXHAUSTION: &str = "exhaustion";
/// Group of the other conditions that run so long.
const EXHAUSTIONS: &str = "exhaustions";

/// True of a condition that runs until no reachable fruit is left: `exhaustion` and `exhaustion-CONDITION`.
pub fn is_exhaustion(name: &str) -> bool {
    name.strip_prefix(EXHAUSTION).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
}

/// Name of a condition that runs until no reachable fruit is left.
fn exhaustion_of(name: &str) -> String {
    format!("{EXHAUSTION}-{name}")
}

/// Most values of a sweep, our own choice: each is a condition, and conditions are compared with each other.
const MOST_VALUES: usize = 100;

/// A sweep: values of one figure of the worlds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepRules {
    /// Path of the figure in the world's config, such as `foliage.density`.
    pub path: String,
    /// Values of the figure, in its unit.
    pub values: Vec<Quantity>,
    /// Condition that the others are compared with, and that they are like but for the dial; without it the nominal one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// Changes that go with every value of the dial, such as the table that the figure belongs to. A sweep that has them takes 0 as the dial's value in
    /// the reference.
    #[serde(default, skip_serializing_if = "Changes::is_empty")]
    pub on: Changes,
    /// Changes in the place of the figure at the value 0, for a dial that has another value in the reference.
    #[serde(default, skip_serializing_if = "Changes::is_empty")]
    pub off: Changes,
}

impl SweepRules {
    /// Values of the dial.
    pub fn dial(&self) -> Vec<f64> {
        self.values.iter().map(Quantity::value).collect()
    }

    fn reference(&self) -> &str {
        self.reference.as_deref().unwrap_or(NOMINAL)
    }
}

/// The condition `exhaustion`, which is the nominal one until nothing reachable is left, and those like it for other conditions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExhaustionRules {
    /// Longest episode.
    pub horizon: Quantity,
    /// Changes of the scenario that each of these conditions makes, after those of the condition that it is named after.
    #[serde(default, skip_serializing_if = "Changes::is_empty")]
    pub with: Changes,
    /// Single conditions that have one as well, named `exhaustion-CONDITION`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub of: Vec<String>,
}

/// Name of the condition of a sweep with its dial at a value.
fn at(sweep: &str, value: f64) -> String {
    format!("{sweep}-{value}")
}

/// The conditions of a protocol: its sweeps, and groups of single conditions.
#[derive(Debug, Clone, Copy)]
pub struct MatrixRules<'a> {
    /// Sweeps by name.
    pub sweeps: &'a BTreeMap<String, SweepRules>,
    /// Groups of conditions by name, and in them what each condition changes.
    pub groups: &'a BTreeMap<String, BTreeMap<String, Changes>>,
    /// Conditions that run until no reachable fruit is left.
    pub exhaustion: &'a ExhaustionRules,
}

impl<'a> MatrixRules<'a> {
    /// Returns the first problem, as (field, problem).
    pub(crate) fn problem(self) -> Option<(String, String)> {
        for (name, sweep) in self.sweeps {
            let wrong = |problem: String| Some((format!("sweeps.{name}"), problem));
            let values = sweep.dial();
            if values.is_empty() {
                return wrong("no value".to_owned());
            }
            if values.len() > MOST_VALUES {
                return wrong(format!("{} values are more than {MOST_VALUES}", values.len()));
            }
            if !values.is_sorted_by(|a, b| a < b) {
                return wrong("values must ascend without duplicates".to_owned());
            }
            let (first, others) = sweep.values.split_first()?;
            if others.iter().any(|value| value.unit() != first.unit()) {
                return wrong("values must have one unit".to_owned());
            }
            let reference = sweep.reference();
            if reference != NOMINAL && self.single(reference).is_none() {
                let known: Vec<&str> = self.singles().map(|(name, _)| name.as_str()).collect();
                let problem =
                    format!("{reference} is no condition; there are {NOMINAL}, {}", known.join(", "));
                return Some((format!("sweeps.{name}.reference"), problem));
            }
        }
        if let Some(name) = self.exhaustion.of.iter().find(|name| self.single(name).is_none()) {
            return Some(("exhaustion.of".to_owned(), format!("{name} is no single condition")));
        }
        // A name stands in names of files.
        let names = self.names();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-.".contains(c);
        if let Some(name) = names.iter().find(|name| name.is_empty() || !name.chars().all(plain)) {
            let problem = format!("the name '{name}' has other characters than letters, digits, - and .");
            return Some(("conditions".to_owned(), problem));
        }
        let twice = (1..names.len()).find(|&i| names[..i].contains(&names[i]));
        twice.map(|i| ("conditions".to_owned(), format!("the name {} is there twice", names[i])))
    }

    /// Names that [`Matrix::choose`] accepts for any worlds: sweeps, groups, conditions, and `SWEEP-VALUE` for every value of a sweep.
    fn names(self) -> Vec<String> {
        let of = |(name, sweep): (&'a String, &'a SweepRules)| {
            sweep.dial().into_iter().map(move |value| at(name, value))
        };
        let mut names: Vec<String> = self.sweeps.keys().chain(self.groups.keys()).cloned().collect();
        names.push(NOMINAL.to_owned());
        names.extend(self.singles().map(|(name, _)| name.clone()));
        names.extend(self.sweeps.iter().flat_map(of));
        names.push(EXHAUSTION.to_owned());
        names.extend(self.exhaustion.of.iter().map(|name| exhaustion_of(name)));
        names.extend((!self.exhaustion.of.is_empty()).then(|| EXHAUSTIONS.to_owned()));
        names
    }

    /// Checks names of conditions, groups and sweeps.
    pub(crate) fn check_names(self, names: &[String]) -> Result<(), String> {
        let known = self.names();
        match names.iter().find(|name| !known.contains(name)) {
            _ if names.is_empty() => Err("no condition".to_owned()),
            Some(name) => {
                Err(ConditionError::Unknown { name: name.clone(), known: known.join(", ") }.to_string())
            }
            None => Ok(()),
        }
    }

    /// Conditions outside sweeps.
    fn singles(self) -> impl Iterator<Item = (&'a String, &'a Changes)> {
        self.groups.values().flatten()
    }

    fn single(self, name: &str) -> Option<&'a Changes> {
        self.singles().find(|(own, _)| *own == name).map(|(_, changes)| changes)
    }
}

/// Values of the dials of a condition.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Dials {
    /// Requested number of fruit per tree.
    pub fruit_count: u32,
    /// Foliage density, the paper's dial.
    pub foliage_density: f64,
    /// Terrain amplitude \[m\]; 0 is the plane.
    pub terrain_amplitude_m: f64,
}

impl Dials {
    /// Reads the dials of a config.
    pub fn of(spec: &Spec) -> Self {
        Self {
            fruit_count: spec.fruit.count.get(),
            foliage_density: spec.foliage.density.si(),
            terrain_amplitude_m: if spec.terrain.enabled { spec.terrain.amplitude.si() } else { 0.0 },
        }
    }
}

/// A condition of the matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct MatrixCondition {
    /// Name.
    pub name: String,
    /// Changes of the scenario, applied in this order.
    pub changes: Vec<Changes>,
    /// Figure of the world that it sets in the end: path, and value in the figure's unit.
    pub figure: Option<(String, f64)>,
}

impl MatrixCondition {
    /// The condition's scenario.
    ///
    /// # Errors
    /// A change that the scenario does not allow.
    pub fn of(&self, scenario: &Scenario) -> Result<Scenario, ConditionError> {
        let wrong = |problem: String| ConditionError::OutOfRange { condition: self.name.clone(), problem };
        let mut changed = scenario.clone();
        for changes in &self.changes {
            changed = changed.changed(changes, "the protocol").map_err(|e| wrong(e.to_string()))?;
        }
        let Some((path, value)) = &self.figure else { return Ok(changed) };
        let set = changed.spec().with_figures("", &[(path, *value)]);
        let set = set.map_err(|e| wrong(format!("{}: {}", e.field, e.problem)))?;
        Ok(changed.with_spec(set))
    }
}

/// A sweep of the matrix: conditions along one dial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MatrixSweep {
    /// Name, which is also its dial's.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// The condition that the others are compared with.
    pub reference: String,
    /// Conditions, by ascending value.
    pub points: Vec<SweepPoint>,
}

/// A condition of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepPoint {
    /// The condition.
    pub condition: String,
    /// Value of the dial.
    pub value: f64,
}

/// All conditions and sweeps.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// Conditions, the nominal one first.
    pub conditions: Vec<MatrixCondition>,
    /// Sweeps.
    pub sweeps: Vec<MatrixSweep>,
    /// Groups by name, with the names of their conditions.
    pub groups: Vec<(String, Vec<String>)>,
}

/// A condition that cannot be run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConditionError {
    /// A name that is not in the matrix.
    #[error("{name} is neither a condition nor a group or sweep of them; the names are {known}")]
    Unknown {
        /// The name.
        name: String,
        /// Sweeps, groups and conditions of the matrix.
        known: String,
    },
    /// A name that is no condition's.
    #[error("no condition {0}")]
    None(String),
    /// Worlds that the config does not allow.
    #[error("{condition}: {problem}")]
    OutOfRange {
        /// The condition.
        condition: String,
        /// The field, its value and the allowed range.
        problem: String,
    },
}

impl Matrix {
    /// The matrix with a scenario as the nominal condition.
    ///
    /// # Errors
    /// A sweep along a figure that its reference condition does not have.
    pub fn of(rules: MatrixRules<'_>, scenario: &Scenario) -> Result<Self, ConditionError> {
        let condition = |name: &str, changes: Vec<Changes>| MatrixCondition {
            name: name.to_owned(),
            changes,
            figure: None,
        };
        let mut conditions = vec![condition(NOMINAL, Vec::new())];
        conditions.extend(rules.singles().map(|(name, changes)| condition(name, vec![changes.clone()])));
        let mut sweeps = Vec::new();
        for (name, sweep) in rules.sweeps {
            let like: Vec<Changes> = rules.single(sweep.reference()).into_iter().cloned().collect();
            let mut on = like.clone();
            on.extend(Some(&sweep.on).filter(|on| !on.is_empty()).cloned());
            let stands = Self::stands(sweep, &like, name, scenario)?;
            let point = |value: f64| {
                let is_reference = value == stands;
                let condition = if is_reference { sweep.reference().to_owned() } else { at(name, value) };
                SweepPoint { condition, value }
            };
            let points: Vec<SweepPoint> = sweep.dial().into_iter().map(point).collect();
            let others = points.iter().filter(|point| point.condition != sweep.reference());
            conditions.extend(others.map(|point| {
                let name = point.condition.clone();
                if point.value == 0.0 && !sweep.off.is_empty() {
                    let changes = like.iter().chain([&sweep.off]).cloned().collect();
                    return MatrixCondition { name, changes, figure: None };
                }
                let figure = Some((sweep.path.clone(), point.value));
                MatrixCondition { name, changes: on.clone(), figure }
            }));
            let unit = sweep.values.first().map_or("", |value| value.unit().symbol()).to_owned();
            let reference = sweep.reference().to_owned();
            sweeps.push(MatrixSweep { name: name.clone(), unit, reference, points });
        }
        let with = Some(&rules.exhaustion.with).filter(|with| !with.is_empty()).cloned();
        conditions.push(condition(EXHAUSTION, with.iter().cloned().collect()));
        let groups = rules.groups.iter().map(|(name, of)| (name.clone(), of.keys().cloned().collect()));
        let mut groups: Vec<(String, Vec<String>)> = groups.collect();
        let to_the_end = |name: &String| {
            let changes = rules.single(name).cloned().into_iter().chain(with.clone()).collect();
            condition(&exhaustion_of(name), changes)
        };
        let exhaustions: Vec<MatrixCondition> = rules.exhaustion.of.iter().map(to_the_end).collect();
        if !exhaustions.is_empty() {
            groups.push((EXHAUSTIONS.to_owned(), exhaustions.iter().map(|c| c.name.clone()).collect()));
        }
        conditions.extend(exhaustions);
        Ok(Self { conditions, sweeps, groups })
    }

    /// Value of a sweep's dial in its reference condition, which makes the changes `like`.
    fn stands(
        sweep: &SweepRules,
        like: &[Changes],
        name: &str,
        scenario: &Scenario,
    ) -> Result<f64, ConditionError> {
        let wrong = |problem: String| ConditionError::OutOfRange { condition: name.to_owned(), problem };
        let laid = |spec: &Spec, changes: &Changes| {
            changes.of_world(spec, "the protocol").map_err(|e| wrong(e.to_string()))
        };
        let mut reference = (**scenario.spec()).clone();
        for changes in like {
            reference = laid(&reference, changes)?;
        }
        if !sweep.on.is_empty() && laid(&reference, &sweep.on)? != reference {
            return Ok(0.0);
        }
        let figure = reference.figure(&sweep.path);
        let figure = figure.ok_or_else(|| wrong(format!("the world has no figure {}", sweep.path)))?;
        let unit = sweep.values.first().map(Quantity::unit);
        match unit.filter(|unit| *unit != figure.unit()) {
            None => Ok(figure.value()),
            Some(unit) => {
                Err(wrong(format!("{} is in {}, not {}", sweep.path, figure.unit().symbol(), unit.symbol())))
            }
        }
    }

    /// A condition by its name.
    pub fn condition(&self, name: &str) -> Option<&MatrixCondition> {
        self.conditions.iter().find(|condition| condition.name == name)
    }

    /// Resolves names of conditions, groups and sweeps to conditions, each once, in the order of the matrix. `SWEEP-VALUE` is the
    /// sweep's reference condition where that is its value.
    ///
    /// # Errors
    /// A name that is neither.
    pub fn choose(&self, names: &[String]) -> Result<Vec<&MatrixCondition>, ConditionError> {
        let of_sweep = |name: &str| self.sweeps.iter().find(|sweep| sweep.name == name);
        let mut chosen: Vec<&str> = Vec::new();
        for name in names {
            let group = self.groups.iter().find(|(own, _)| own == name);
            if let Some(condition) = self.condition(name) {
                chosen.push(&condition.name);
            } else if let Some(sweep) = of_sweep(name) {
                chosen.extend(sweep.points.iter().map(|p| p.condition.as_str()));
            } else if let Some((_, conditions)) = group {
                chosen.extend(conditions.iter().map(String::as_str));
            } else if let Some(reference) = self.reference_by(name) {
                chosen.push(reference);
            } else {
                return Err(ConditionError::Unknown { name: name.clone(), known: self.known() });
            }
        }
        Ok(self.conditions.iter().filter(|condition| chosen.contains(&condition.name.as_str())).collect())
    }

    /// The sweeps restricted to some conditions; sweeps with fewer than two of them are left out.
    pub fn sweeps_of(&self, conditions: &[&str]) -> Vec<MatrixSweep> {
        let cut = |sweep: &MatrixSweep| {
            let mut sweep = sweep.clone();
            sweep.points.retain(|point| conditions.contains(&point.condition.as_str()));
            sweep
        };
        self.sweeps.iter().map(cut).filter(|sweep| sweep.points.len() > 1).collect()
    }

    /// The reference condition of a sweep, if the name is `SWEEP-VALUE` with its value.
    fn reference_by(&self, name: &str) -> Option<&str> {
        self.sweeps.iter().find_map(|sweep| {
            let mut points = sweep.points.iter().filter(|point| point.condition == sweep.reference);
            points.any(|point| at(&sweep.name, point.value) == name).then_some(sweep.reference.as_str())
        })
    }

    fn known(&self) -> String {
        let groups = self.groups.iter().map(|(name, _)| name.as_str());
        let sweeps = self.sweeps.iter().map(|sweep| sweep.name.as_str()).chain(groups);
        let conditions = self.conditions.iter().map(|condition| condition.name.as_str());
        sweeps.chain(conditions).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
#[path = "matrix_tests.rs"]
mod tests;

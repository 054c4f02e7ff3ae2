//! The benchmark's matrix: its conditions, grouped in sweeps.
//!
//! A sweep varies one dial of the worlds. Except for the effect of the dial, trees, fruit sites and start poses are those of the nominal
//! condition, so that conditions can be compared tree by tree.

use orchard_quantity::{Count, Quantity};
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};

use crate::harvest::metrics::METRICS;

/// Name of the preset's own condition.
pub const NOMINAL: &str = "nominal";
/// Name of the nominal condition that runs until no reachable fruit is left.
pub const EXHAUSTION: &str = "exhaustion";

/// Most values of a sweep, our own choice: each is a condition, and conditions are compared with each other.
const MOST_VALUES: usize = 100;

/// The values of each dial, and the tested metrics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweeps {
    /// Foliage densities, the paper's dial; those of the detection task too.
    pub foliage: Vec<Quantity>,
    /// Requested number of fruit per tree.
    pub fruit: Vec<Count>,
    /// Amplitudes of the ground.
    pub terrain: Vec<Quantity>,
    /// Metrics for the paired tests against the nominal condition.
    pub tested: Vec<String>,
}

impl Sweeps {
    /// Foliage densities.
    pub fn densities(&self) -> Vec<f64> {
        self.foliage.iter().map(Quantity::si).collect()
    }

    /// Returns the first problem of the values, as (field, problem).
    pub(crate) fn problem(&self) -> Option<(&'static str, String)> {
        let fields = ["sweeps.foliage", "sweeps.fruit", "sweeps.terrain"];
        for (field, dial) in fields.into_iter().zip(Dial::ALL) {
            let values = dial.values(self);
            if values.is_empty() {
                return Some((field, "no value".to_owned()));
            }
            if values.len() > MOST_VALUES {
                return Some((field, format!("{} values are more than {MOST_VALUES}", values.len())));
            }
            if !values.is_sorted_by(|a, b| a < b) {
                return Some((field, "values must ascend without duplicates".to_owned()));
            }
        }
        let unknown = self.tested.iter().find(|name| !METRICS.iter().any(|m| m.info.name == **name));
        unknown.map(|name| ("sweeps.tested", format!("{name} is not a metric of the harvest")))
    }

    /// Names that [`Matrix::choose`] accepts for any worlds: sweeps, conditions, and `DIAL-VALUE` for every value of a sweep.
    fn names(&self) -> Vec<String> {
        let of = |dial: Dial| dial.values(self).into_iter().map(move |value| dial.condition(value));
        let mut names: Vec<String> = Dial::ALL.map(|dial| dial.name().to_owned()).into();
        names.push(NOMINAL.to_owned());
        names.extend(Dial::ALL.into_iter().flat_map(of));
        names.push(EXHAUSTION.to_owned());
        names
    }

    /// Checks names of conditions and sweeps.
    pub(crate) fn check_names(&self, names: &[String]) -> Result<(), String> {
        let known = self.names();
        match names.iter().find(|name| !known.contains(name)) {
            _ if names.is_empty() => Err("no condition".to_owned()),
            Some(name) => {
                Err(ConditionError::Unknown { name: name.clone(), known: known.join(", ") }.to_string())
            }
            None => Ok(()),
        }
    }
}

/// The dial of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dial {
    Foliage,
    Fruit,
    Terrain,
}

impl Dial {
    const ALL: [Self; 3] = [Self::Foliage, Self::Fruit, Self::Terrain];

    /// Name of its sweep.
    fn name(self) -> &'static str {
        match self {
            Self::Foliage => "foliage",
            Self::Fruit => "fruit",
            Self::Terrain => "terrain",
        }
    }

    /// Name of the condition with the dial at a value.
    fn condition(self, value: f64) -> String {
        format!("{}-{value}", self.name())
    }

    /// Unit in names of conditions and in results.
    fn unit(self) -> &'static str {
        match self {
            Self::Foliage => "1",
            Self::Fruit => "fruit",
            Self::Terrain => "m",
        }
    }

    /// Values in a sweep.
    fn values(self, sweeps: &Sweeps) -> Vec<f64> {
        match self {
            Self::Foliage => sweeps.densities(),
            Self::Fruit => sweeps.fruit.iter().map(|count| f64::from(count.get())).collect(),
            Self::Terrain => sweeps.terrain.iter().map(Quantity::si).collect(),
        }
    }

    /// Returns its value in some worlds.
    fn of(self, dials: &Dials) -> f64 {
        match self {
            Self::Foliage => dials.foliage_density,
            Self::Fruit => f64::from(dials.fruit_count),
            Self::Terrain => dials.terrain_amplitude_m,
        }
    }

    /// Returns the dials with this one set to a value.
    fn turned(self, dials: Dials, value: f64) -> Dials {
        match self {
            Self::Foliage => Dials { foliage_density: value, ..dials },
            Self::Fruit => Dials { fruit_count: value as u32, ..dials },
            Self::Terrain => Dials { terrain_amplitude_m: value, ..dials },
        }
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

    /// Returns a config with these dial values.
    ///
    /// # Errors
    /// A value outside the range that the config allows.
    pub fn turn(&self, spec: &Spec) -> Result<Spec, String> {
        let mut spec = spec.clone();
        let named = |field: &'static str| move |e: String| format!("{field}: {e}");
        spec.fruit.count = spec.fruit.count.with_value(self.fruit_count).map_err(named("fruit.count"))?;
        spec.foliage.density =
            spec.foliage.density.with_value(self.foliage_density).map_err(named("foliage.density"))?;
        spec.terrain.enabled = self.terrain_amplitude_m > 0.0;
        if spec.terrain.enabled {
            let amplitude = spec.terrain.amplitude.with_value(self.terrain_amplitude_m);
            spec.terrain.amplitude = amplitude.map_err(named("terrain.amplitude"))?;
        }
        Ok(spec)
    }
}

/// A condition of the matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct MatrixCondition {
    /// Name.
    pub name: String,
    /// Worlds.
    pub dials: Dials,
}

/// A sweep of the matrix: conditions along one dial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MatrixSweep {
    /// Name, which is also its dial's.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
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
}

/// A condition that cannot be run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConditionError {
    /// A name that is not in the matrix.
    #[error("{name} is neither a condition nor a sweep; the names are {known}")]
    Unknown {
        /// The name.
        name: String,
        /// Sweeps and conditions of the matrix.
        known: String,
    },
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
    /// The matrix with a config's own worlds as the nominal condition.
    pub fn of(rules: &Sweeps, spec: &Spec) -> Self {
        let nominal = Dials::of(spec);
        let condition = |name: &str, dials| MatrixCondition { name: name.to_owned(), dials };
        let mut conditions = vec![condition(NOMINAL, nominal)];
        let mut sweeps = Vec::new();
        for dial in Dial::ALL {
            let point = |value: f64| {
                let is_nominal = value == dial.of(&nominal);
                let name = if is_nominal { NOMINAL.to_owned() } else { dial.condition(value) };
                SweepPoint { condition: name, value }
            };
            let points: Vec<SweepPoint> = dial.values(rules).into_iter().map(point).collect();
            let others = points.iter().filter(|point| point.condition != NOMINAL);
            conditions.extend(others.map(|p| condition(&p.condition, dial.turned(nominal, p.value))));
            sweeps.push(MatrixSweep { name: dial.name().to_owned(), unit: dial.unit().to_owned(), points });
        }
        conditions.push(condition(EXHAUSTION, nominal));
        Self { conditions, sweeps }
    }

    /// A condition by its name.
    pub fn condition(&self, name: &str) -> Option<&MatrixCondition> {
        self.conditions.iter().find(|condition| condition.name == name)
    }

    /// Resolves names of conditions and sweeps to conditions, each once, in the order of the matrix. `DIAL-VALUE` is the
    /// nominal condition where that is its value.
    ///
    /// # Errors
    /// A name that is neither.
    pub fn choose(&self, names: &[String]) -> Result<Vec<&MatrixCondition>, ConditionError> {
        let of_sweep = |name: &str| self.sweeps.iter().find(|sweep| sweep.name == name);
        let mut chosen: Vec<&str> = Vec::new();
        for name in names {
            match (self.condition(name), of_sweep(name)) {
                (Some(condition), _) => chosen.push(&condition.name),
                (None, Some(sweep)) => chosen.extend(sweep.points.iter().map(|p| p.condition.as_str())),
                (None, None) if self.names_nominal(name) => chosen.push(NOMINAL),
                (None, None) => {
                    return Err(ConditionError::Unknown { name: name.clone(), known: self.known() });
                }
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

    /// True if the name is `DIAL-VALUE` with the nominal value of the dial.
    fn names_nominal(&self, name: &str) -> bool {
        Dial::ALL.iter().zip(&self.sweeps).any(|(dial, sweep)| {
            let nominal = |point: &&SweepPoint| point.condition == NOMINAL;
            sweep.points.iter().filter(nominal).any(|point| dial.condition(point.value) == name)
        })
    }

    fn known(&self) -> String {
        let sweeps = self.sweeps.iter().map(|sweep| sweep.name.as_str());
        let conditions = self.conditions.iter().map(|condition| condition.name.as_str());
        sweeps.chain(conditions).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Protocol;

    fn matrix() -> Matrix {
        Matrix::of(&Protocol::paper().sweeps, &Spec::paper())
    }

    fn names(chosen: &[&MatrixCondition]) -> Vec<String> {
        chosen.iter().map(|condition| condition.name.clone()).collect()
    }

    #[test]
    fn the_matrix_is_the_papers() {
        let all: Vec<String> = matrix().conditions.iter().map(|c| c.name.clone()).collect();
        let expected = [
            "nominal",
            "foliage-0",
            "foliage-0.3",
            "foliage-1",
            "foliage-1.5",
            "fruit-20",
            "fruit-60",
            "terrain-0.05",
            "terrain-0.1",
            "terrain-0.2",
            "exhaustion",
        ];
        assert_eq!(all, expected);
        let values: Vec<Vec<f64>> =
            matrix().sweeps.iter().map(|sweep| sweep.points.iter().map(|p| p.value).collect()).collect();
        assert_eq!(
            values,
            [vec![0.0, 0.3, 0.6, 1.0, 1.5], vec![20.0, 40.0, 60.0], vec![0.0, 0.05, 0.1, 0.2]]
        );
        // The nominal condition is in every sweep once.
        for sweep in matrix().sweeps {
            assert_eq!(sweep.points.iter().filter(|p| p.condition == NOMINAL).count(), 1, "{}", sweep.name);
        }
    }

    #[test]
    fn sweeps_and_conditions_are_chosen_by_name() {
        let matrix = matrix();
        let choose = |list: &[&str]| {
            let list: Vec<String> = list.iter().map(|name| (*name).to_owned()).collect();
            matrix.choose(&list).map(|chosen| names(&chosen)).map_err(|e| e.to_string())
        };
        assert_eq!(choose(&["terrain-0.2", "nominal"]).unwrap(), ["nominal", "terrain-0.2"]);
        assert_eq!(choose(&["fruit", "nominal"]).unwrap(), ["nominal", "fruit-20", "fruit-60"]);
        // `DIAL-VALUE` with the nominal value is the nominal condition.
        assert_eq!(choose(&["fruit-40", "foliage-0.6", "terrain-0"]).unwrap(), ["nominal"]);
        assert!(choose(&["fruit-41"]).is_err());
        assert!(choose(&[]).unwrap().is_empty());
        let e = choose(&["windy"]).unwrap_err();
        assert!(
            e.starts_with(
                "windy is neither a condition nor a sweep; the names are foliage, fruit, terrain, nominal"
            ),
            "{e}"
        );
        // A sweep with only one condition is left out.
        assert!(matrix.sweeps_of(&["nominal", "exhaustion"]).is_empty());
        let cut = matrix.sweeps_of(&["nominal", "fruit-60"]);
        assert_eq!((cut.len(), cut[0].name.as_str(), cut[0].points.len()), (1, "fruit", 2));
    }

    #[test]
    fn names_are_checked_without_worlds() {
        let sweeps = Protocol::paper().sweeps;
        let check = |list: &[&str]| {
            sweeps.check_names(&list.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(
            check(&["nominal", "exhaustion", "fruit", "fruit-40", "fruit-20", "terrain-0.05"]),
            Ok(())
        );
        assert_eq!(check(&[]), Err("no condition".to_owned()));
        let e = check(&["nominal", "fruit-41"]).unwrap_err();
        assert!(
            e.starts_with(
                "fruit-41 is neither a condition nor a sweep; the names are foliage, fruit, terrain,"
            ),
            "{e}"
        );
    }

    #[test]
    fn dials_turn_a_config_and_nothing_else() {
        let spec = Spec::paper();
        assert_eq!(Dials::of(&spec).turn(&spec).as_ref(), Ok(&spec));
        let dials = Dials { fruit_count: 20, foliage_density: 1.5, terrain_amplitude_m: 0.1 };
        let turned = dials.turn(&spec).unwrap();
        assert_eq!(Dials::of(&turned), dials);
        assert_eq!(Dials::of(&spec).turn(&turned).map(|spec| Dials::of(&spec)), Ok(Dials::of(&spec)));
        let e = Dials { terrain_amplitude_m: 3.0, ..dials }.turn(&spec).unwrap_err();
        assert!(e.starts_with("terrain.amplitude: ") && e.contains("0.2"), "{e}");
    }
}

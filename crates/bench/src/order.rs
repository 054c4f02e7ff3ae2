//! What was asked of each task, as `plan.json` holds it: results are a function of it, the configs and the code.

use std::collections::BTreeMap;
use std::fs;

use orchard_perception::DetectorConfig;
use orchard_spec::camera::CameraSpec;
use serde::{Deserialize, Serialize};

use crate::episode::{CODE_VERSION, SCHEMA_VERSION};
use crate::harvest::Extent;
use crate::scaling::Backend;
use crate::shard::Shard;
use crate::store::{Store, StoreError};

/// What a command asks of one task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "task", rename_all = "kebab-case")]
pub enum Order {
    /// Conditions of the matrix.
    Harvest {
        /// Who harvests.
        controller: String,
        /// How much.
        #[serde(flatten)]
        extent: Extent,
    },
    /// Single images of every tree.
    Detect {
        /// Which trees.
        #[serde(flatten)]
        trees: Trees,
        /// The camera.
        camera: Box<CameraSpec>,
        /// Name of the detector's config.
        detector_name: String,
        /// The detector.
        detector: Box<DetectorConfig>,
    },
    /// Hold named fruit.
    ReachAndGrasp {
        /// Who reaches.
        controller: String,
        /// Which trees.
        #[serde(flatten)]
        trees: Trees,
    },
    /// Push through the canopy.
    Gentle {
        /// Who pushes.
        controller: String,
        /// Which trees.
        #[serde(flatten)]
        trees: Trees,
    },
    /// Time batches of trees.
    Scaling {
        /// How much.
        profile: String,
        /// What advances the batches.
        #[serde(default)]
        backend: Backend,
    },
}

/// The trees of a task that knows no conditions.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trees {
    /// Profile whose defaults these are.
    pub profile: String,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees a seed.
    pub trees: u32,
}

impl Order {
    /// The task's name.
    pub fn task(&self) -> &'static str {
        match self {
            Self::Harvest { .. } => "harvest",
            Self::Detect { .. } => "detect",
            Self::ReachAndGrasp { .. } => "reach-and-grasp",
            Self::Gentle { .. } => "gentle",
            Self::Scaling { .. } => "scaling",
        }
    }
}

/// An order with what it was given to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Noted {
    /// [`CODE_VERSION`].
    pub code_version: String,
    /// The part of the work that this folder was asked for.
    pub shard: Shard,
    /// The order.
    pub order: Order,
}

/// `plan.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanFile {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The last order of each task, by its name.
    pub tasks: BTreeMap<String, Noted>,
}

/// A `plan.json` that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct PlanFileError {
    file: String,
    problem: String,
}

impl PlanFile {
    /// Its file under the result folder.
    pub const FILE: &'static str = "plan.json";

    /// Reads that of a folder.
    ///
    /// # Errors
    /// None there, not as this code writes it, or another schema.
    pub fn read(store: &Store) -> Result<Self, PlanFileError> {
        let path = store.path().join(Self::FILE);
        let bad = |problem: String| PlanFileError { file: path.display().to_string(), problem };
        let bytes = fs::read(&path).map_err(|e| bad(format!("{e}; is this a result of bench-v1?")))?;
        let head: serde_json::Value =
            serde_json::from_slice(&bytes).map_err(|e| bad(format!("no plan of bench-v1: {e}")))?;
        if head.get("schema_version") != Some(&serde_json::json!(SCHEMA_VERSION)) {
            let found = head.get("schema_version").map_or_else(|| "none".to_owned(), ToString::to_string);
            return Err(bad(format!("schema version {found}; this code reads {SCHEMA_VERSION}")));
        }
        serde_json::from_slice(&bytes).map_err(|e| bad(format!("no plan of bench-v1: {e}")))
    }

    /// Notes orders in a folder, beside those of other tasks.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn note(store: &Store, orders: &[Order], shard: Shard) -> Result<(), StoreError> {
        // What cannot be read is of other code or damaged; the records tell for themselves.
        let mut tasks = Self::read(store).map(|file| file.tasks).unwrap_or_default();
        for order in orders {
            let noted = Noted { code_version: CODE_VERSION.to_owned(), shard, order: order.clone() };
            tasks.insert(order.task().to_owned(), noted);
        }
        store.write(Self::FILE, &Self { schema_version: SCHEMA_VERSION, tasks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_spec::Spec;

    fn orders() -> Vec<Order> {
        let trees = || Trees { profile: "quick".into(), seeds: vec![7, 8], trees: 2 };
        let extent = Extent {
            profile: "quick".into(),
            conditions: vec!["nominal".into(), "fruit".into()],
            seeds: vec![7],
            trees: 1,
            repeats: 1,
            horizon_s: 0.1,
        };
        vec![
            Order::Harvest { controller: "baseline".into(), extent },
            Order::Detect {
                trees: trees(),
                camera: Box::new(Spec::paper().camera),
                detector_name: "paper".into(),
                detector: Box::new(DetectorConfig::paper()),
            },
            Order::Gentle { controller: "expert".into(), trees: trees() },
            Order::Scaling { profile: "full".into(), backend: Backend::Gpu },
        ]
    }

    #[test]
    fn orders_come_back_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let shard: Shard = "2/3".parse().unwrap();
        let orders = orders();
        PlanFile::note(&store, &orders[..2], shard).unwrap();
        // A later task leaves the earlier ones in place.
        PlanFile::note(&store, &orders[2..], Shard::WHOLE).unwrap();
        let file = PlanFile::read(&store).unwrap();
        assert_eq!(file.tasks.keys().collect::<Vec<_>>(), ["detect", "gentle", "harvest", "scaling"]);
        for order in orders {
            let noted = &file.tasks[order.task()];
            assert_eq!(
                noted.shard.is_whole(),
                !matches!(order, Order::Harvest { .. } | Order::Detect { .. })
            );
            assert_eq!(noted.order, order);
        }
    }

    #[test]
    fn what_is_no_plan_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let e = PlanFile::read(&store).unwrap_err().to_string();
        assert!(e.contains("plan.json: ") && e.ends_with("is this a result of bench-v1?"), "{e}");
        for (text, problem) in [
            ("", "no plan of bench-v1"),
            ("{}", "schema version none"),
            ("{\"schema_version\": 1}", "schema version 1; this code reads"),
            ("{\"schema_version\": 4, \"tasks\": 5}", "no plan of bench-v1"),
        ] {
            fs::write(folder.path().join(PlanFile::FILE), text).unwrap();
            let e = PlanFile::read(&store).unwrap_err().to_string();
            assert!(e.contains(problem), "{text}: {e}");
        }
    }
}

//! Report on a trajectory over all trees.

use std::collections::BTreeMap;

use orchard_bench::digest::{config_hash, config_text};
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_statistics::{Metric, MetricDefinition, MetricInfo, estimate};
use orchard_statistics::{Resamples, Share};
use serde::{Deserialize, Serialize};

use crate::seeds::SeedSetLabel;
use crate::verify::run::{TreeOutcome, VerifyPlan};

/// A whole verification.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Layout version.
    pub schema_version: u32,
    /// Code version.
    pub code_version: String,
    /// SHA-256 of world, robot and protocol.
    pub config_hash: String,
    /// Preset of the trees.
    pub preset: String,
    /// The trajectory.
    pub trajectory: TrajectoryLine,
    /// Commands that exceed the robot's limits.
    pub warnings: Vec<String>,
    /// Version of protocol and configs.
    pub config_version: String,
    /// Seed set.
    pub seed_set: SeedSetLabel,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Number of trees that could not be built or became implausible; they are in no metric.
    pub quarantined: u32,
    /// Estimates by name.
    pub metrics: BTreeMap<String, Metric>,
    /// Every tree.
    pub trees: Vec<TreeOutcome>,
}

/// Name, hash and size of a trajectory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryLine {
    /// Name of the file, without its folder.
    pub file: String,
    /// SHA-256 of the rows as a table.
    pub sha256: String,
    /// Rows.
    pub rows: u32,
    /// Time of the last row \[s\].
    pub duration_s: f64,
}

/// All metrics: means over the trees that were not quarantined.
pub const METRICS: &[MetricDefinition<TreeOutcome>] = &[
    MetricDefinition {
        info: MetricInfo {
            name: "branches_snapped_per_tree",
            title: "Branches snapped a tree",
            unit: "branches",
            numerator: "ruptures of wood",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, f64::from(t.branches_snapped)),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "trees_with_a_snap",
            title: "Trees with a snap",
            unit: "1",
            numerator: "1 for a tree of which wood ruptured",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, f64::from(t.branches_snapped.min(1))),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "fruit_knocked_off_per_tree",
            title: "Fruit knocked off a tree",
            unit: "fruit",
            numerator: "fruit that came off its stem",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, f64::from(t.fruit_knocked_off)),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "fruit_dropped_per_tree",
            title: "Fruit dropped a tree",
            unit: "fruit",
            numerator: "fruit off its stem at the end and neither at rest in the bucket nor between the fingers",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, f64::from(t.fruit_dropped)),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "peak_moment_ratio",
            title: "Peak moment ratio",
            unit: "1",
            numerator: "largest bending moment of a joint over its rupture moment",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, t.peak_moment_ratio),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "peak_moment_excess",
            title: "Peak moment excess",
            unit: "1",
            numerator: "largest rise of a joint's moment ratio over its value at the start",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, t.peak_moment_excess),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "moment_excess_s",
            title: "Moment excess",
            unit: "s",
            numerator: "rise of the moment ratio over its value at the start, summed over time",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, t.moment_excess_s),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "contact_impulse_n_s",
            title: "Contact impulse",
            unit: "N s",
            numerator: "force of the robot on live wood, summed over time",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, t.contact_impulse_n_s),
    },
    MetricDefinition {
        info: MetricInfo {
            name: "peak_contact_force_n",
            title: "Peak contact force",
            unit: "N",
            numerator: "largest sum of contact forces of the robot on live wood at one moment",
            denominator: "1",
            note: "",
        },
        share: |t| tree(t, t.peak_contact_force_n),
    },
];

fn tree(tree: &TreeOutcome, value: f64) -> Share {
    if tree.quarantined.is_some() { Share::default() } else { Share { numerator: value, denominator: 1.0 } }
}

impl Report {
    /// Sums up the outcomes of a plan; `file` is the trajectory's name.
    pub fn of_run(plan: &VerifyPlan, file: &str, trees: Vec<TreeOutcome>) -> Self {
        let of_seed = |seed: &u64| (0..trees.len()).filter(|&i| trees[i].seed == *seed).collect();
        let groups: Vec<Vec<usize>> = plan.seeds.iter().map(of_seed).collect();
        let resamples = Resamples::draw(&groups, &plan.protocol.bootstrap);
        let protocol = config_text(&plan.protocol);
        let trajectory = &plan.trajectory;
        Self {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: config_hash(&[("scene", &plan.scenario.scene_hash()), ("protocol", &protocol)]),
            preset: plan.scenario.names().scene.preset.clone(),
            trajectory: TrajectoryLine {
                file: file.to_owned(),
                sha256: config_hash(&[("trajectory", &trajectory.to_csv())]),
                rows: trajectory.rows().len() as u32,
                duration_s: trajectory.duration(),
            },
            warnings: trajectory.warnings().to_vec(),
            config_version: plan.protocol.version.clone(),
            seed_set: plan.protocol.label(&plan.seeds, plan.trees),
            seeds: plan.seeds.clone(),
            quarantined: trees.iter().filter(|tree| tree.quarantined.is_some()).count() as u32,
            metrics: estimate(METRICS, &trees, &resamples),
            trees,
        }
    }
}

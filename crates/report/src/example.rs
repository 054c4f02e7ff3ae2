//! A synthetic result with every kind of content, for tests.

use std::collections::BTreeMap;

use orchard_bench::compute::{Compute, Machine, RecordCost, TaskCost};
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_scaling::{Adapter, AxisKind, AxisRow, MemoryBasis, Omitted, Row, Scaling, SolverName};
use orchard_scenario::{Names, SceneNames};
use orchard_spec::randomisation::Mode;
use orchard_spec::{Purpose, Spec, Stream};
use orchard_statistics::Metric;
use orchard_statistics::ranking::{CurvePoint, ReliabilityBin};
use orchard_statistics::{Design, Share, Undefined, compare, variance_components};
use orchard_tasks::component::{
    ComponentRun, ComponentSummary, ReachAndGrasp, TreeLine, metrics as component_metrics,
};
use orchard_tasks::detect::{
    AblationSummary, Calibration, DensitySummary, DetectSummary, ERRORS, METRICS as DETECT_METRICS,
    RankedBin, RankedFruit, RankingSummary, SitsOn, Spread, VariantSummary,
};
use orchard_tasks::harvest::episode::Outcome;
use orchard_tasks::harvest::matrix::{Dials, SweepPoint};
use orchard_tasks::harvest::metrics::infos;
use orchard_tasks::harvest::plan::ConditionParams;
use orchard_tasks::harvest::summary::ScenarioLine;
use orchard_tasks::harvest::summary::{
    Adjusted, ConditionSummary, EpisodeLine, StateSummary, Summary, Sweep, SweepComparison, ZoneSummary,
};
use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::{SeedSetLabel, SeedSetName};
use orchard_tasks::zones::{Zone, zone_table};

use crate::pictures::{Moment, Pick, Picture, Pictures};
use crate::results::Results;

/// Builds the whole synthetic result.
pub fn results() -> Results {
    Results {
        harvest: Some(harvest()),
        detect: Some(detect()),
        components: vec![component("reach-and-grasp"), component("gentle")],
        compute: Some(compute()),
        scaling: vec![scaling(Backend::Cpu)],
    }
}

fn stream(number: u32) -> Stream {
    Stream::new(1, number, Purpose::Test)
}

fn tuning() -> SeedSetLabel {
    SeedSetLabel { name: SeedSetName::Tuning, whole: true }
}

fn metric(mean: f64, half: f64, n: u64) -> Metric {
    Metric { mean: Some(mean), ci95: [Some((mean - half).max(0.0)), Some(mean + half)], n, undefined: None }
}

fn nothing() -> Metric {
    Metric { mean: None, ci95: [None, None], n: 0, undefined: Some(Undefined::NothingToMeasure) }
}

/// A synthetic condition whose metrics fall with its difficulty.
fn condition(number: u32, difficulty: f64, params: ConditionParams) -> ConditionSummary {
    let mut s = stream(number);
    let episodes: Vec<EpisodeLine> = (0..18)
        .map(|i| {
            let deposited = (6.0 * s.unit() * (1.0 - 0.4 * difficulty)).round() as u32;
            EpisodeLine {
                file: format!("episodes/baseline-{number}-{i}.json"),
                seed: 20250704 + i / 6,
                world: (i % 6) as u32,
                repeat: 0,
                outcome: Outcome::BudgetSpent,
                duration_s: 75.0,
                fruit: 40,
                reachable: 18,
                reachable_by_ik: Some(16),
                completeness: Some(f64::from(deposited) / 18.0),
                stem_pulled: 0,
                bruised: 1,
                attempts: 6,
                contact_attempts: 7,
                deposited,
                dropped: s.integer(0, 2),
                snapped: s.integer(0, 9) / 9,
            }
        })
        .collect();
    let mean = |name: &str| match name {
        "harvest_completeness" => 0.24 - 0.1 * difficulty,
        "place_success_per_contact_attempt" => 0.6 - 0.2 * difficulty,
        "place_success_per_attempt" => 0.7 - 0.2 * difficulty,
        "throughput_fruit_per_min" => 3.4 - difficulty,
        "mean_cycle_time_s" => 7.9 + difficulty,
        "branches_snapped_per_tree" => 0.1 + 0.1 * difficulty,
        "fruit_dropped_per_tree" => 0.9 + 0.4 * difficulty,
        "max_stem_pull_n" | "detach_tension_max_n" => 41.0,
        "detach_tension_p95_n" => 36.0,
        name if name.contains("per_tree") => 3.0,
        _ => 0.9 - 0.1 * difficulty,
    };
    let mut metrics: BTreeMap<String, Metric> = infos()
        .map(|info| (info.name.to_owned(), metric(mean(info.name), 0.15 * mean(info.name), 18)))
        .collect();
    metrics.insert("mean_drop_height_m".to_owned(), nothing());
    let mut zones = zone_table(ZoneSummary::default());
    for (zone, placed) in Zone::ALL.into_iter().zip([4, 5, 11, 9, 6, 0]) {
        let attempts = if placed == 0 { 0 } else { 15 };
        zones.insert(
            zone,
            ZoneSummary {
                reachable: 54,
                deposited: placed,
                attempts,
                placed,
                place_success: (attempts > 0).then(|| f64::from(placed) / f64::from(attempts)),
                completeness: Some(f64::from(placed) / 54.0),
                place_success_ci95: if attempts > 0 { [Some(0.1), Some(0.8)] } else { [None; 2] },
                completeness_ci95: [Some(0.02), Some(0.3)],
            },
        );
    }
    let state = |mean: f64| StateSummary {
        attempts: 108,
        mean_s: Some(mean),
        placed: 60,
        mean_placed_s: Some(1.1 * mean),
    };
    ConditionSummary {
        params,
        outcomes: [("budget_spent".to_owned(), 18)].into(),
        metrics,
        variance: None,
        zones,
        failures: [("no_fruit_at_detection", 21), ("grasp_stalled", 12), ("slipped", 9), ("run_ended", 6)]
            .map(|(reason, n)| (reason.to_owned(), n))
            .into(),
        contact_outcomes: [("placed", 63), ("left_on_tree", 33), ("knocked_off", 6), ("dropped", 24)]
            .map(|(outcome, n)| (outcome.to_owned(), n))
            .into(),
        alarms: [("fruit_lost".to_owned(), 2)].into(),
        states: [("align", 1.8), ("reach", 1.5), ("grasp", 2.4), ("pull", 1.6), ("deposit", 3.6)]
            .map(|(name, mean)| (name.to_owned(), state(mean)))
            .into(),
        between_attempts_s: Some(3.9),
        episodes,
    }
}

/// Dial settings of the nominal condition.
fn nominal() -> ConditionParams {
    ConditionParams {
        dials: Dials { fruit_count: 40, foliage_density: 0.6, terrain_amplitude_m: 0.0 },
        trees: 6,
        horizon_s: 75.0,
        repeats: 1,
    }
}

fn harvest() -> Summary {
    let mut conditions = BTreeMap::new();
    let mut main = condition(0, 0.4, nominal());
    let design = Design::of((0..18).map(|i| (i / 6, (i / 2) as u32)));
    let values: Vec<Option<f64>> = main.episodes.iter().map(|e| Some(f64::from(e.deposited))).collect();
    main.variance =
        Some([("fruit_deposited_per_tree".to_owned(), variance_components(&design, &values))].into());
    conditions.insert("nominal".to_owned(), main);
    let exhaustion = ConditionParams { horizon_s: 600.0, ..nominal() };
    conditions.insert("exhaustion".to_owned(), condition(1, 0.0, exhaustion));
    let mut sweeps = BTreeMap::new();
    let dials: [(&str, &str, &[f64], f64); 3] = [
        ("foliage", "1", &[0.0, 0.3, 0.6, 1.0, 1.5], 0.6),
        ("fruit", "fruit", &[20.0, 40.0, 60.0], 40.0),
        ("terrain", "m", &[0.0, 0.05, 0.1, 0.2], 0.0),
    ];
    let mut number = 2;
    for (name, unit, values, at_nominal) in dials {
        let mut points = Vec::new();
        for &value in values {
            let condition_name =
                if value == at_nominal { "nominal".to_owned() } else { format!("{name}-{value}") };
            if value != at_nominal {
                let difficulty = value / values[values.len() - 1];
                conditions.insert(condition_name.clone(), condition(number, difficulty, nominal()));
            }
            number += 1;
            points.push(SweepPoint { condition: condition_name, value });
        }
        let others = points.iter().filter(|point| point.condition != "nominal");
        let comparisons = others.map(|point| comparison(point, values)).collect();
        sweeps.insert(
            name.to_owned(),
            Sweep { dial: name.to_owned(), unit: unit.to_owned(), points, comparisons },
        );
    }
    Summary {
        backend: Backend::Cpu,
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.to_owned(),
        config_hash: "0123456789abcdef".repeat(4),
        config_version: "v1".to_owned(),
        preset: "paper".to_owned(),
        scenario: ScenarioLine { names: Names::paper("baseline"), hash: "0123456789abcdef".repeat(4) },
        profile: "full".to_owned(),
        controller: "baseline".to_owned(),
        seed_set: tuning(),
        seeds: Protocol::paper().tuning_seeds,
        quarantined: 0,
        gave_up: BTreeMap::new(),
        conditions,
        sweeps,
    }
}

fn comparison(point: &SweepPoint, values: &[f64]) -> SweepComparison {
    let mut s = stream(100 + (100.0 * point.value) as u32);
    let design = Design::of((0..18).map(|i| (i / 6, i as u32)));
    let mut draw = |mean: f64| -> Vec<Share> {
        (0..18).map(|_| Share { numerator: mean + 0.3 * s.unit(), denominator: 1.0 }).collect()
    };
    let (first, second) = (draw(0.5), draw(0.5 - 0.3 * point.value / values[values.len() - 1]));
    let protocol = Protocol::paper();
    let test = compare(&design, &first, &second, &protocol.bootstrap, &protocol.paired);
    let holm = Adjusted {
        wilcoxon: test.wilcoxon.as_ref().map(|w| w.p_value),
        permutation: test.permutation.as_ref().map(|p| p.p_value),
    };
    SweepComparison {
        metric: "place_success_per_attempt".to_owned(),
        reference: "nominal".to_owned(),
        condition: point.condition.clone(),
        test,
        holm,
    }
}

fn spread(value: f64) -> Spread {
    Spread { value: Some(value), ci95: [Some(0.9 * value), Some(1.1 * value)], n: 1450 }
}

/// Rankings that are worse in denser leaves.
fn ranking(foliage: f64) -> RankingSummary {
    let ap = |radii: f64| 0.7 + 0.2 * radii - 0.2 * foliage;
    let by_radii = [0.5, 1.0].map(|radii: f64| (radii.to_string(), radii));
    let step = |k: u32| CurvePoint {
        score: 1.0 - 0.09 * f64::from(k),
        recall: 0.09 * f64::from(k + 1),
        precision: 1.0 - 0.01 * f64::from(k) * (1.0 + foliage),
    };
    let bin = |k: u32| ReliabilityBin {
        score: [k, k + 1].map(|edge| 0.1 * f64::from(edge)),
        n: 100 * k,
        mean_score: (k > 0).then(|| 0.05 + 0.1 * f64::from(k)),
        right: (k > 0).then(|| 0.1 * f64::from(k)),
    };
    let ranked =
        RankedFruit { fruit: 200, ap: by_radii.clone().map(|(key, radii)| (key, Some(ap(radii)))).into() };
    let share = |k: u32| [k, k + 1].map(|edge| 0.2 * f64::from(edge));
    RankingSummary {
        ap: by_radii.clone().map(|(key, radii)| (key, spread(ap(radii)))).into(),
        curves: by_radii.map(|(key, _)| (key, (0..10).map(step).collect())).into(),
        by_visible_fraction: (0..5)
            .map(|k| RankedBin { visible_fraction: share(k), ranked: ranked.clone() })
            .collect(),
        by_zone: zone_table(ranked),
        calibration: Calibration {
            brier: metric(0.08, 0.01, 4500),
            expected_error: Some(0.05),
            bins: (0..10).map(bin).collect(),
        },
    }
}

fn detect() -> DetectSummary {
    let results = |difficulty: f64| VariantSummary {
        images: 144,
        detections: 1500,
        true_positives: 1450,
        false_positives: [(SitsOn::Wood, 12), (SitsOn::Leaf, 38)].into(),
        metrics: DETECT_METRICS
            .iter()
            .map(|m| (m.info.name.to_owned(), metric(0.98 - 0.1 * difficulty, 0.02, 1500)))
            .collect(),
        errors: ERRORS
            .iter()
            .map(|e| {
                let value = 0.002 + 0.001 * difficulty;
                (
                    e.name.to_owned(),
                    Spread { value: Some(value), ci95: [Some(0.9 * value), Some(1.1 * value)], n: 1450 },
                )
            })
            .collect(),
    };
    let protocol = Protocol::paper();
    let density = |foliage: f64| DensitySummary {
        foliage,
        leaves: 1000,
        results: results(foliage),
        radius_correlation: spread(0.8 - 0.2 * foliage),
        ranking: ranking(foliage),
        recall_by_visible_fraction: Vec::new(),
        zones: zone_table(orchard_tasks::detect::ZoneSummary::default()),
    };
    DetectSummary {
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.to_owned(),
        config_hash: "fedcba9876543210".repeat(4),
        preset: "paper".to_owned(),
        scene: SceneNames::paper(),
        profile: "full".to_owned(),
        config_version: "v1".to_owned(),
        seed_set: tuning(),
        seeds: protocol.tuning_seeds.clone(),
        camera: Spec::paper().camera,
        detector: "paper".to_owned(),
        trees: Vec::new(),
        quarantined: 0,
        densities: [0.0, 0.3, 0.6, 1.0, 1.5].map(density).into(),
        ablation: AblationSummary {
            foliage: 0.6,
            seed: Some(20250704),
            variants: [("all", 0.2), ("without_isolation", 0.9)]
                .map(|(name, d)| (name.to_owned(), results(d)))
                .into(),
        },
    }
}

fn component(task: &str) -> ComponentSummary {
    ComponentSummary {
        run: ComponentRun {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: "0".repeat(64),
            scenario: Names::paper("baseline"),
            task: task.to_owned(),
            backend: Backend::Cpu,
        },
        config_version: "v1".to_owned(),
        profile: "full".to_owned(),
        seed_set: tuning(),
        seeds: Protocol::paper().tuning_seeds,
        trees: vec![TreeLine {
            file: format!("{task}/20250704-000.json"),
            seed: 20250704,
            world: 0,
            never_built: None,
            trials: 4,
            successes: 3,
        }],
        outcomes: [("success".to_owned(), 3), ("time_over".to_owned(), 1)].into(),
        failures: [("grasp_stalled".to_owned(), 1)].into(),
        gave_up: BTreeMap::new(),
        metrics: component_metrics::<ReachAndGrasp>()
            .iter()
            .map(|m| (m.info.name.to_owned(), metric(0.75, 0.2, 4)))
            .collect(),
    }
}

fn machine() -> Machine {
    Machine {
        os: "linux".to_owned(),
        arch: "x86_64".to_owned(),
        cpu: Some("A processor".to_owned()),
        logical_cpus: 2,
    }
}

fn compute() -> Compute {
    let cost = TaskCost {
        machine: machine(),
        threads: 2,
        wall_s: 71.3,
        env_steps: 81_000,
        step_rate_per_s: Some(570.0),
        env_steps_per_s: Some(1136.0),
        world_seconds_per_s: Some(18.9),
        peak_memory_mib: Some(212.0),
        records_per_core_hour: Some(25.0),
        records: vec![RecordCost { file: "episodes/a.json".to_owned(), wall_s: Some(3.0) }],
    };
    let tasks = [
        ("harvest".to_owned(), cost.clone()),
        ("detect".to_owned(), TaskCost { world_seconds_per_s: None, ..cost }),
    ];
    Compute { schema_version: SCHEMA_VERSION, tasks: tasks.into() }
}

/// A synthetic scaling run on a backend; on a device it includes cells that exceeded the device's limits.
pub fn scaling(backend: Backend) -> Scaling {
    let is_device = backend == Backend::Gpu;
    let solvers: &[(SolverName, f64)] = if is_device {
        &[(SolverName::DeviceAba, 0.1)]
    } else {
        &[(SolverName::Lanes, 1.0), (SolverName::Aba, 3.0)]
    };
    let most = if is_device { 17 } else { 10 };
    let modes = [(Mode::Homogeneous, 1.0), (Mode::SharedDimensions, 0.97), (Mode::DistinctDimensions, 0.9)];
    let mut rows = Vec::new();
    for &(solver, slower) in solvers {
        for (mode, factor) in modes {
            for worlds in (0..most).map(|power| 1_u32 << power) {
                let full = f64::from(worlds) / (1.0 + f64::from(worlds) / 40.0);
                let env_steps_per_s = 250.0 * factor * full / slower;
                let step_rate_per_s = env_steps_per_s / f64::from(worlds);
                rows.push(Row {
                    solver,
                    mode,
                    worlds,
                    step_rate_per_s,
                    env_steps_per_s,
                    substeps_per_s: 3.0 * env_steps_per_s,
                    spread: [0.9 * step_rate_per_s, 1.1 * step_rate_per_s],
                    processor_us_per_env_step: 1e6 / env_steps_per_s,
                    memory_mib: Some(20.0 + 3.0 * f64::from(worlds)),
                    memory_basis: MemoryBasis::Growth,
                    grow_s: 0.01 * f64::from(worlds),
                    pack_s: 1e-4 * f64::from(worlds),
                    segments_per_tree: 150.0,
                    fruit_per_tree: 40.0,
                    repeats: 3,
                    courses: 3,
                    unfinite: 0,
                    note: None,
                });
            }
        }
    }
    let omitted = is_device.then(|| Omitted {
        solver: SolverName::DeviceAba,
        mode: Mode::DistinctTopology,
        worlds: 65536,
        why: "estimated time 90 s, limit 60 s".to_owned(),
    });
    let axes = AxisKind::ALL.map(|axis| AxisRow {
        axis,
        solver: solvers[0].0,
        worlds: 8,
        env_steps_per_s: 2000.0,
        relative: 0.95,
        spread: [0.9, 1.0],
        note: None,
    });
    let axes = if is_device { axes.to_vec() } else { Vec::new() };
    Scaling {
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.to_owned(),
        config_version: "v1".to_owned(),
        profile: "full".to_owned(),
        backend,
        adapter: is_device.then(|| Adapter {
            name: "Device".to_owned(),
            driver: "driver 1".to_owned(),
            api: "Vulkan".to_owned(),
            is_software: false,
        }),
        machine: machine(),
        instructions: "avx2".to_owned(),
        threads: 2,
        seed: 20250704,
        frame_s: 1.0 / 60.0,
        substeps: 3,
        frames: 60,
        wall_s: 30.0,
        peak_memory_mib: Some(500.0),
        left_out: Vec::new(),
        rows,
        omitted: omitted.into_iter().collect(),
        axes,
    }
}

/// Placeholder pictures.
pub fn pictures() -> Pictures {
    let picture = |alt: &str| Picture {
        png: b"\x89PNG\r\n\x1a\n".to_vec(),
        size: [4, 3],
        alt: alt.to_owned(),
        caption: "a picture".to_owned(),
    };
    Pictures {
        trees: vec![picture("a tree")],
        pick: Some(Pick {
            title: "Attempt 0 of seed 20250704, tree 0: placed".to_owned(),
            moments: vec![Moment {
                caption: "1.2 s REACH".to_owned(),
                detail: "fingers 80 mm open".to_owned(),
                outside: picture("seen from outside"),
                wrist: picture("seen by the wrist camera"),
            }],
        }),
        left_out: None,
    }
}

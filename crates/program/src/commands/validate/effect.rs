//! Suite `effect`: the nominal harvest under preset `calibrated` beside `paper`.

use orchard_scenario::Scenario;
use orchard_spec::Preset;
use orchard_statistics::{Design, Metric, Resamples, metric::interval_ends, quantile};
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::protocol::Protocol;

use super::harvests::{Size, harvests, metric, shares};
use crate::rows::{Effort, Measured, Row};

/// Size of a cell, in full and quick.
const SIZES: [Size; 2] = [Size { trees: 6, horizon: 75.0 }, Size { trees: 2, horizon: 4.0 }];

/// Controllers that harvest.
const CONTROLLERS: [&str; 2] = ["expert", "baseline"];

/// The preset that is measured, and its peer.
const PRESETS: [Preset; 2] = [Preset::Calibrated, Preset::Paper];

/// The harvest's metrics that are compared.
const METRICS: [&str; 6] = [
    "harvest_completeness",
    "place_success_per_contact_attempt",
    "branches_snapped_per_tree",
    "fruit_dropped_per_tree",
    "max_stem_pull_n",
    "spurs_torn_per_tree",
];

/// Harvests the trees of both presets with each controller, and compares.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let size = SIZES[usize::from(effort == Effort::Quick)];
    let mut scenarios = Vec::new();
    for controller in CONTROLLERS {
        for preset in PRESETS {
            scenarios.push(Scenario::of(&[("preset", preset.name()), ("controller", controller)])?);
        }
    }
    let records = harvests("effect", &scenarios, size)?;
    let pairs = CONTROLLERS.iter().zip(records.chunks_exact(PRESETS.len()));
    Ok(pairs.flat_map(|(controller, of)| rows(controller, [&of[0], &of[1]])).collect::<Vec<Row>>().into())
}

/// The rows of one controller, of its records under each preset.
fn rows(controller: &str, records: [&[EpisodeRecord]; 2]) -> Vec<Row> {
    let resamples = records.map(|of| {
        let design = Design::of(of.iter().map(|episode| (episode.key.seed, episode.key.world)));
        Resamples::of(design, &Protocol::paper().bootstrap)
    });
    let row = |name: &str, unit: &str, of: [Metric; 2]| {
        let [own, peer] = of;
        let row = Row::measured(&format!("effect.{controller}.{name}"), own.mean.unwrap_or(f64::NAN), unit);
        let row = Row { ci95: interval(&own), ..row };
        match peer.mean {
            Some(mean) => Row { peer_ci95: interval(&peer), ..row.beside(PRESETS[1].name(), mean) },
            None => row,
        }
    };
    let compared = METRICS.iter().map(|name| {
        let of = metric(name);
        let estimate = |i: usize| Metric::of(&shares(of, records[i]), &resamples[i]);
        row(name, of.info.unit, [estimate(0), estimate(1)])
    });
    let tension = row(
        "median_release_tension",
        "N",
        [median_tension(records[0], &resamples[0]), median_tension(records[1], &resamples[1])],
    );
    compared.chain([tension]).collect()
}

/// Median tension of a stem when its fruit came off, whatever took it off, over the fruit of all trees.
fn median_tension(records: &[EpisodeRecord], resamples: &Resamples) -> Metric {
    let of_tree: Vec<Vec<f64>> = records
        .iter()
        .map(|episode| episode.fruit_detached.iter().filter_map(|event| event.tension_n).collect())
        .collect();
    let median = |trees: &[usize]| {
        let tensions = trees.iter().flat_map(|&tree| of_tree[tree].iter().copied());
        quantile::quantile(&quantile::ascending(tensions), 0.5)
    };
    let interval = resamples.interval_of(median);
    Metric {
        mean: median(&(0..of_tree.len()).collect::<Vec<usize>>()),
        ci95: interval_ends(interval.ok()),
        n: of_tree.iter().map(Vec::len).sum::<usize>() as u64,
        undefined: interval.err(),
    }
}

fn interval(metric: &Metric) -> Option<[f64; 2]> {
    let [low, high] = metric.ci95;
    low.zip(high).map(|(low, high)| [low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_compares_both_presets() {
        let rows = measure(Effort::Quick).unwrap().rows;
        assert_eq!(rows.len(), CONTROLLERS.len() * (METRICS.len() + 1));
        let of = |name: &str| rows.iter().find(|row| row.name == name).unwrap();
        // Four seconds are too short to place a fruit, and long enough for intervals of two trees.
        for controller in CONTROLLERS {
            let completeness = of(&format!("effect.{controller}.harvest_completeness"));
            assert_eq!((completeness.value, completeness.ci95), (Some(0.0), Some([0.0, 0.0])));
            assert_eq!((completeness.peer.as_deref(), completeness.peer_value), (Some("paper"), Some(0.0)));
            assert_eq!((completeness.peer_ci95, completeness.ratio), (Some([0.0, 0.0]), None));
            assert!(of(&format!("effect.{controller}.max_stem_pull_n")).value.unwrap() > 0.0);
        }
        assert!(rows.iter().all(|row| row.pass.is_none() && row.target.is_none()));
    }
}

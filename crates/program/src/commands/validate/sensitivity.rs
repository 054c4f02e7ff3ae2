//! Suite `sensitivity`: which uncertain parameters of preset `calibrated` move the harvest of the expert.

mod parameters;

use orchard_report::ScreenedParameter;
use orchard_scenario::Scenario;
use orchard_spec::Preset;
use orchard_statistics::bootstrap::ratio;
use orchard_statistics::morris::{Screened, Trajectory};
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::protocol::Protocol;
use parameters::{Parameter, Parameters};

use super::harvests::{Size, harvests, metric, shares};
use crate::rows::{Effort, Measured, Row};

/// Size of an evaluation, in full and quick.
const SIZES: [Size; 2] = [Size { trees: 2, horizon: 40.0 }, Size { trees: 1, horizon: 1.0 }];

/// Trajectories, in full and quick.
const TRAJECTORIES: [u32; 2] = [6, 2];

/// Seed of the trajectories.
const SEED: u64 = 1;

/// The metrics that parameters may move.
const METRICS: [&str; 3] = ["harvest_completeness", "fruit_dropped_per_tree", "branches_snapped_per_tree"];

/// Screens the parameters of `configs/measured/sensitivity.toml`.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let which = usize::from(effort == Effort::Quick);
    let scenario = Scenario::of(&[("preset", Preset::Calibrated.name()), ("controller", "expert")])?;
    let text = include_str!("../../../configs/measured/sensitivity.toml");
    let parameters = Parameters::read("measured/sensitivity.toml", text, scenario.spec())?;
    let count = parameters.parameters.len();
    let walks: Vec<Trajectory> =
        (0..TRAJECTORIES[which]).map(|number| Trajectory::draw(count, SEED, number)).collect();
    let mut scenarios = Vec::new();
    for point in walks.iter().flat_map(|walk| &walk.points) {
        scenarios.push(scenario.with_spec(parameters.applied(scenario.spec(), point)?));
    }
    // Every evaluation has the same trees, start poses and draws.
    let records = harvests("sensitivity", &scenarios, SIZES[which])?;
    let mut measured = Measured::default();
    for name in METRICS {
        let screened = screened(name, &parameters.parameters, &walks, &records)?;
        measured.rows.extend(rows(name, &screened));
        let of = screened
            .iter()
            .map(|(parameter, screened)| ScreenedParameter { name: &parameter.name, screened: *screened });
        let info = &metric(name).info;
        measured.pictures.push(orchard_report::screening(info, &of.collect::<Vec<_>>())?);
    }
    Ok(measured)
}

/// The parameters with what they do to a metric, the strongest first.
fn screened<'a>(
    name: &str,
    parameters: &'a [Parameter],
    walks: &[Trajectory],
    records: &[Vec<EpisodeRecord>],
) -> anyhow::Result<Vec<(&'a Parameter, Screened)>> {
    // NaN, where a metric is undefined, is refused below.
    let value =
        |trees: &Vec<EpisodeRecord>| ratio(shares(metric(name), trees).into_iter()).unwrap_or(f64::NAN);
    let values: Vec<f64> = records.iter().map(value).collect();
    let effects: Vec<Vec<f64>> = walks
        .iter()
        .zip(values.chunks_exact(parameters.len() + 1))
        .map(|(walk, of)| walk.effects(of))
        .collect();
    let rules = Protocol::paper().bootstrap;
    let mut screened = Vec::new();
    for (i, parameter) in parameters.iter().enumerate() {
        let own: Vec<f64> = effects.iter().map(|effects| effects[i]).collect();
        screened.push((parameter, Screened::of(&own, &rules)?));
    }
    screened.sort_by(|(_, a), (_, b)| b.mu_star.total_cmp(&a.mu_star));
    Ok(screened)
}

/// Two rows of each parameter: `mu*` and `sigma`.
fn rows(name: &str, screened: &[(&Parameter, Screened)]) -> Vec<Row> {
    let unit = metric(name).info.unit;
    let row = |figure: &str, parameter: &Parameter, value: f64, ci95: [f64; 2]| {
        let row = Row::measured(&format!("sensitivity.{name}.{figure}.{}", parameter.path), value, unit);
        Row { ci95: Some(ci95), ..row }
    };
    let mu_star = screened.iter().map(|(parameter, of)| {
        let Parameter { low, high, unit, .. } = parameter;
        let note = format!("from {low} to {high} {}: on average {:+.3}", unit.symbol(), of.mu);
        Row { note: Some(note), ..row("mu_star", parameter, of.mu_star, of.mu_star_ci95) }
    });
    let sigma = screened.iter().map(|(parameter, of)| row("sigma", parameter, of.sigma, of.sigma_ci95));
    mu_star.chain(sigma).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_spec::Spec;

    #[test]
    fn a_quick_run_has_a_row_and_a_place_in_the_picture_for_every_parameter() {
        let measured = measure(Effort::Quick).unwrap();
        let text = include_str!("../../../configs/measured/sensitivity.toml");
        let read = Parameters::read("x", text, &Spec::preset(Preset::Calibrated)).unwrap().parameters;
        assert_eq!(measured.rows.len(), METRICS.len() * 2 * read.len());
        assert_eq!(measured.pictures.len(), METRICS.len());
        for parameter in &read {
            for name in METRICS {
                let of = |figure: &str| format!("sensitivity.{name}.{figure}.{}", parameter.path);
                for row in [of("mu_star"), of("sigma")] {
                    let row = measured.rows.iter().find(|found| found.name == row).unwrap();
                    assert!(row.value.is_some() && row.ci95.is_some(), "{row:?}");
                }
            }
            assert!(measured.pictures.iter().all(|picture| picture.svg.contains(&parameter.name)));
        }
    }

    /// The strongest come first, and each effect is that of its own parameter.
    #[test]
    fn parameters_are_ranked_by_mu_star() {
        let text = include_str!("../../../configs/measured/sensitivity.toml");
        let read = Parameters::read("x", text, &Spec::preset(Preset::Calibrated)).unwrap().parameters;
        let walks: Vec<Trajectory> = (0..3).map(|n| Trajectory::draw(read.len(), 2, n)).collect();
        // A tree snaps 3 branches for every third of the range of parameter 4, and none otherwise.
        let snapping = |point: &Vec<f64>| {
            let mut record = orchard_tasks::harvest::never_started(key(), String::new());
            let snap = orchard_tasks::harvest::episode::SnapEvent {
                segment: 0,
                frame: 0,
                time: 0.0,
                at_union: false,
            };
            record.branches_snapped = vec![snap; (9.0 * point[4]).round() as usize];
            vec![record]
        };
        let records: Vec<Vec<EpisodeRecord>> =
            walks.iter().flat_map(|walk| &walk.points).map(snapping).collect();
        let ranked = screened("branches_snapped_per_tree", &read, &walks, &records).unwrap();
        assert_eq!(ranked[0].0.path, read[4].path);
        assert!((ranked[0].1.mu_star - 9.0).abs() < 1e-9 && (ranked[0].1.mu - 9.0).abs() < 1e-9);
        assert!(ranked[1..].iter().all(|(_, of)| of.mu_star == 0.0));
        let rows = rows("branches_snapped_per_tree", &ranked);
        assert_eq!(rows[0].name, format!("sensitivity.branches_snapped_per_tree.mu_star.{}", read[4].path));
    }

    fn key() -> orchard_tasks::harvest::episode::EpisodeKey {
        let harvest = orchard_tasks::harvest::Harvest::new(Scenario::of(&[]).unwrap()).unwrap();
        harvest.plan("test", vec![1], 1, 1.0).episodes().remove(0)
    }
}

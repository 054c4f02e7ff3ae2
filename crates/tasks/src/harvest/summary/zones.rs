//! Results by canopy zone, pooled over trees.

use orchard_statistics::metric::interval_ends;
use orchard_statistics::{Resamples, Share};
use serde::{Deserialize, Serialize};

use crate::harvest::episode::EpisodeRecord;
use crate::zones::{Zone, ZoneTable, zone_table};

/// One zone, pooled over trees.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ZoneSummary {
    /// Reachable fruit at the start.
    pub reachable: u32,
    /// Reachable fruit deposited.
    pub deposited: u32,
    /// Attempts on targets in the zone.
    pub attempts: u32,
    /// Of these, placed.
    pub placed: u32,
    /// Placed over attempts; null without attempts.
    pub place_success: Option<f64>,
    /// 95 % bootstrap interval over trees x seeds; null if the metric is defined for fewer than two trees.
    pub place_success_ci95: [Option<f64>; 2],
    /// Deposited over reachable; null without reachable fruit.
    pub completeness: Option<f64>,
    /// 95 % bootstrap interval.
    pub completeness_ci95: [Option<f64>; 2],
}

/// Counts of one episode in one zone.
#[derive(Clone, Copy, Default)]
struct Tally {
    reachable: u32,
    deposited: u32,
    attempts: u32,
    placed: u32,
}

/// All zones; `resamples` index into the episodes.
pub fn zones(episodes: &[&EpisodeRecord], resamples: &Resamples) -> ZoneTable<ZoneSummary> {
    let mut table = zone_table(ZoneSummary::default());
    for (zone, summary) in &mut table {
        let tallies: Vec<Tally> = episodes.iter().map(|episode| tally(episode, *zone)).collect();
        let sum = |of: fn(&Tally) -> u32| tallies.iter().map(of).sum::<u32>();
        let rate = |of: fn(&Tally) -> u32, over: fn(&Tally) -> u32| {
            let share = |t: &Tally| Share { numerator: f64::from(of(t)), denominator: f64::from(over(t)) };
            let shares: Vec<Share> = tallies.iter().map(share).collect();
            let rate = (sum(over) > 0).then(|| f64::from(sum(of)) / f64::from(sum(over)));
            (rate, interval_ends(resamples.interval(&shares).ok()))
        };
        let (place_success, place_success_ci95) = rate(|t| t.placed, |t| t.attempts);
        let (completeness, completeness_ci95) = rate(|t| t.deposited, |t| t.reachable);
        *summary = ZoneSummary {
            reachable: sum(|t| t.reachable),
            deposited: sum(|t| t.deposited),
            attempts: sum(|t| t.attempts),
            placed: sum(|t| t.placed),
            place_success,
            place_success_ci95,
            completeness,
            completeness_ci95,
        };
    }
    table
}

fn tally(episode: &EpisodeRecord, zone: Zone) -> Tally {
    let here = |other: Option<Zone>| other == Some(zone);
    Tally {
        reachable: episode.zone_census.get(&zone).copied().unwrap_or(0),
        deposited: episode.deposited().filter(|fruit| fruit.reachable && here(fruit.zone)).count() as u32,
        attempts: episode.attempts.iter().filter(|attempt| here(attempt.zone)).count() as u32,
        placed: episode.placed().filter(|attempt| here(attempt.zone)).count() as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::record;
    use crate::harvest::episode::FruitState;
    use crate::protocol::Protocol;
    use orchard_statistics::Design;

    /// Trees with 0, 1 and 2 of 2 fruit: the rate is that of all fruit, and the interval lies within what trees can give.
    #[test]
    fn a_zone_has_rates_with_intervals() {
        let tree = |world: u32| {
            let state = |i| if i < world { FruitState::Deposited } else { FruitState::OnTree };
            let mut tree = record(&[(state(0), true), (state(1), true)]);
            tree.key.world = world;
            tree
        };
        let trees = [tree(0), tree(1), tree(2)];
        let episodes: Vec<&EpisodeRecord> = trees.iter().collect();
        let design = Design::of(episodes.iter().map(|e| (e.key.seed, e.key.world)));
        let table = zones(&episodes, &Resamples::of(design, &Protocol::paper().bootstrap));
        let zone = &table[&Zone::MiddleInner];
        assert_eq!((zone.reachable, zone.deposited, zone.completeness), (6, 3, Some(0.5)));
        // All resampled trees are empty, or full, in one of 27.
        assert_eq!(zone.completeness_ci95, [Some(0.0), Some(1.0)]);
        assert_eq!((zone.place_success, zone.place_success_ci95), (None, [None, None]));
        assert_eq!(table[&Zone::UpperOuter].completeness_ci95, [None, None]);
    }
}

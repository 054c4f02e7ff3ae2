//! Canopy zones: a 3 x 2 grid (vertical x radial), calibrated for each tree from its reachable fruit.
//!
//! OrchardBench, "Canopy-zone breakdown": the trunk axis is at the horizontal median of the reachable
//! fruit; thirds are cut between the 5th and the 95th height percentile; inner and outer part at the median
//! distance from the axis. Fruit below or above the percentiles belongs to the lower or the upper third.

use std::collections::BTreeMap;

use orchard_geometry::{Vec3, math};
use orchard_quantity::Quantity;
use orchard_statistics::quantile::{ascending, quantile};
use orchard_world::truth::FruitTruth;
use serde::{Deserialize, Serialize};

/// Percentiles between which a canopy is cut into vertical thirds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZoneRules {
    /// Height percentile of the lower end.
    pub low_percentile: Quantity,
    /// Height percentile of the upper end.
    pub high_percentile: Quantity,
}

/// One cell of the canopy grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Zone {
    /// Lower third, near the trunk axis.
    LowerInner,
    /// Lower third, far from the axis.
    LowerOuter,
    /// Middle third, near the axis.
    MiddleInner,
    /// Middle third, far from the axis.
    MiddleOuter,
    /// Upper third, near the axis.
    UpperInner,
    /// Upper third, far from the axis.
    UpperOuter,
}

impl Zone {
    /// All zones, from the lower inner to the upper outer.
    pub const ALL: [Zone; 6] = [
        Zone::LowerInner,
        Zone::LowerOuter,
        Zone::MiddleInner,
        Zone::MiddleOuter,
        Zone::UpperInner,
        Zone::UpperOuter,
    ];
}

/// A value for every zone.
pub type ZoneTable<T> = BTreeMap<Zone, T>;

/// A table with the same value in every zone.
pub fn zone_table<T: Clone>(value: T) -> ZoneTable<T> {
    Zone::ALL.iter().map(|&zone| (zone, value.clone())).collect()
}

/// Frame that defines the canopy zones of one tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ZoneFrame {
    /// Horizontal position of the trunk axis in the world \[m\].
    pub axis_world: [f64; 2],
    /// Low height percentile in the world \[m\].
    pub z_low: f64,
    /// High height percentile in the world \[m\].
    pub z_high: f64,
    /// Median distance from the axis \[m\].
    pub split_radius: f64,
}

impl ZoneFrame {
    /// Calibrates a frame from the reachable fruit's centres \[m, world\]; `None` without fruit.
    pub fn calibrate(p_world: &[Vec3], rules: &ZoneRules) -> Option<Self> {
        let median = |values: Vec<f64>| quantile(&ascending(values), 0.5);
        let axis =
            [median(p_world.iter().map(|p| p.x).collect())?, median(p_world.iter().map(|p| p.y).collect())?];
        let heights = ascending(p_world.iter().map(|p| p.z));
        Some(Self {
            axis_world: axis,
            z_low: quantile(&heights, rules.low_percentile.si())?,
            z_high: quantile(&heights, rules.high_percentile.si())?,
            split_radius: median(p_world.iter().map(|p| distance(&axis, p)).collect())?,
        })
    }

    /// Calibrates a frame from a world's fruit at the start of an episode, of which `reachable` tells which count; fruit beyond the list do not.
    pub fn of_start(fruit: &[FruitTruth], reachable: &[bool], rules: &ZoneRules) -> Option<Self> {
        let points: Vec<Vec3> =
            fruit.iter().zip(reachable).filter(|(_, counts)| **counts).map(|(f, _)| f.p_world).collect();
        Self::calibrate(&points, rules)
    }

    /// The zone of a point \[m, world\]. In a canopy without vertical extent all points are in the middle third.
    pub fn zone(&self, p_world: &Vec3) -> Zone {
        let extent = self.z_high - self.z_low;
        let height = p_world.z - self.z_low;
        let inner = distance(&self.axis_world, p_world) <= self.split_radius;
        if extent > 0.0 && 3.0 * height < extent {
            if inner { Zone::LowerInner } else { Zone::LowerOuter }
        } else if extent > 0.0 && 3.0 * height > 2.0 * extent {
            if inner { Zone::UpperInner } else { Zone::UpperOuter }
        } else if inner {
            Zone::MiddleInner
        } else {
            Zone::MiddleOuter
        }
    }
}

fn distance(axis: &[f64; 2], p: &Vec3) -> f64 {
    math::hypot(p.x - axis[0], p.y - axis[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Protocol;

    fn calibrate(points: &[[f64; 3]]) -> Option<ZoneFrame> {
        let points: Vec<Vec3> = points.iter().map(|&p| Vec3::from(p)).collect();
        ZoneFrame::calibrate(&points, &Protocol::paper().zones)
    }

    /// 21 fruit at heights 0, 1, .. 20 on a circle about (2, -1): percentiles 1 and 19, thirds at 7 and 13.
    #[test]
    fn thirds_and_halves_fall_where_the_definition_says() {
        let points: Vec<[f64; 3]> = (0..21)
            .map(|i| {
                // Four directions of radius 1 and 3, and the last fruit on the axis.
                let r = if i % 2 == 0 { 1.0 } else { 3.0 };
                let (dx, dy) = [(r, 0.0), (-r, 0.0), (0.0, r), (0.0, -r)][(i / 2) % 4];
                if i == 20 { [2.0, -1.0, 20.0] } else { [2.0 + dx, -1.0 + dy, i as f64] }
            })
            .collect();
        let frame = calibrate(&points).unwrap();
        assert_eq!(frame.axis_world, [2.0, -1.0]);
        assert!((frame.z_low - 1.0).abs() < 1e-12 && (frame.z_high - 19.0).abs() < 1e-12);
        // Distances: one 0, ten 1, ten 3; the median (the eleventh) is 1.
        assert_eq!(frame.split_radius, 1.0);
        let at = |dx: f64, z: f64| frame.zone(&Vec3::new(2.0 + dx, -1.0, z));
        assert_eq!(at(0.5, 6.9), Zone::LowerInner);
        assert_eq!(at(0.5, -4.0), Zone::LowerInner);
        assert_eq!(at(0.5, 7.1), Zone::MiddleInner);
        assert_eq!(at(1.5, 12.9), Zone::MiddleOuter);
        assert_eq!(at(1.5, 13.1), Zone::UpperOuter);
        assert_eq!(at(1.0, 99.0), Zone::UpperInner);
    }

    #[test]
    fn none_one_and_two_fruit() {
        assert_eq!(calibrate(&[]), None);
        let p = [0.4, 0.1, 1.3];
        assert_eq!(calibrate(&[p]).unwrap().zone(&p.into()), Zone::MiddleInner);
        // Two fruit are equally far from their midpoint: both inner, one lower and one upper.
        let (a, b) = ([0.0, 0.0, 1.0], [1.0, 0.0, 2.0]);
        let frame = calibrate(&[a, b]).unwrap();
        assert_eq!(frame.zone(&a.into()), Zone::LowerInner);
        assert_eq!(frame.zone(&b.into()), Zone::UpperInner);
    }

    #[test]
    fn tables_name_their_zones() {
        let json = serde_json::to_string(&zone_table(0_u32)).unwrap();
        assert!(json.starts_with(r#"{"lower_inner":0,"lower_outer":0,"middle_inner":0"#), "{json}");
    }
}

//! Axes: their ends and ticks.

use std::ops::Range;

use orchard_geometry::math;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// An axis with its ticks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    /// Label: the quantity, with its unit.
    pub label: String,
    /// Ends, as drawn.
    pub ends: [f64; 2],
    /// Ticks: position, as drawn, and label.
    pub ticks: Vec<(f64, String)>,
    /// True if values are drawn as decimal logarithms.
    pub logarithmic: bool,
}

/// Round steps, as multiples of a power of ten.
const STEPS: [f64; 4] = [1.0, 2.0, 2.5, 5.0];

impl Axis {
    /// Builds an axis from 0 to the next round number above all values, in about `steps` steps.
    pub fn from_zero(label: impl Into<String>, values: impl Iterator<Item = f64>, steps: u32) -> Self {
        let largest = values.filter(|x| x.is_finite()).fold(0.0, f64::max);
        let largest = if largest > 0.0 { largest } else { 1.0 };
        let step = step(largest, steps);
        let count = ((largest / step) - 1e-9).ceil().max(1.0) as u32;
        let ticks = (0..=count).map(|i| f64::from(i) * step).map(|x| (x, tick_label(x, step))).collect();
        Self { label: label.into(), ends: [0.0, f64::from(count) * step], ticks, logarithmic: false }
    }

    /// Builds an axis with ticks only at `places` (ascending), with a margin before the first and after the last.
    pub fn at(label: impl Into<String>, places: &[f64]) -> Self {
        let ends = match places {
            [] => [0.0, 1.0],
            [one] => [one - 1.0, one + 1.0],
            [first, .., last] => {
                let room = 0.06 * (last - first);
                [first - room, last + room]
            }
        };
        let ticks = places.iter().map(|&x| (x, format!("{x}"))).collect();
        Self { label: label.into(), ends, ticks, logarithmic: false }
    }

    /// Builds a logarithmic axis of whole decades about all values, which are above 0.
    pub fn decades(label: impl Into<String>, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = spread(values);
        let (first, last) = (log10(low).floor() as i32, (log10(high) - 1e-9).ceil() as i32);
        let ticks = (first..=last.max(first + 1)).map(|power| (f64::from(power), power_of_ten(power)));
        let ticks: Vec<_> = ticks.collect();
        let ends = [ticks[0].0, ticks[ticks.len() - 1].0];
        Self { label: label.into(), ends, ticks, logarithmic: true }
    }

    /// Builds a logarithmic axis with ticks at powers of two about all values, which are above 0: at most `most` ticks.
    pub fn doublings(label: impl Into<String>, values: impl Iterator<Item = f64>, most: usize) -> Self {
        let (low, high) = spread(values);
        let power = |x: f64| math::ln(x) / std::f64::consts::LN_2;
        let (first, last) = ((power(low) + 1e-9).floor() as i32, (power(high) - 1e-9).ceil() as i32);
        let every = ((last - first) as usize).div_ceil(most.max(1)).max(1);
        let place = |power: i32| f64::from(power) * std::f64::consts::LN_2 / std::f64::consts::LN_10;
        let ticks =
            (first..=last).step_by(every).map(|p| (place(p), format!("{}", math::pow(2.0, f64::from(p)))));
        let room = 0.04 * (place(last) - place(first)).max(1.0);
        Self {
            label: label.into(),
            ends: [place(first) - room, place(last) + room],
            ticks: ticks.collect(),
            logarithmic: true,
        }
    }

    /// Returns the place of a value, as drawn: its decimal logarithm on a logarithmic axis.
    pub fn place(&self, value: f64) -> f64 {
        if self.logarithmic { log10(value) } else { value }
    }

    /// Returns the label of the tick at a place; empty if there is none.
    pub fn label_at(&self, place: f64) -> String {
        let near = self.ticks.iter().find(|(at, _)| (at - place).abs() < 1e-9 * (1.0 + place.abs()));
        near.map_or_else(String::new, |(_, text)| text.clone())
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, limit: (i32, i32)) -> i32 {
        let [low, high] = self.ends;
        let part = if high > low { (place - low) / (high - low) } else { 0.0 };
        limit.0 + (part * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.iter().map(|(place, _)| *place).collect()
    }

    fn range(&self) -> Range<f64> {
        self.ends[0]..self.ends[1]
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, place: &f64) -> String {
        self.label_at(*place)
    }
}

fn log10(x: f64) -> f64 {
    math::ln(x) / std::f64::consts::LN_10
}

fn spread(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let sound = values.filter(|x| x.is_finite() && *x > 0.0);
    let (low, high) = sound.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
    if high > 0.0 { (low, high) } else { (1.0, 10.0) }
}

/// Smallest round step that covers a length in `steps` steps.
fn step(length: f64, steps: u32) -> f64 {
    let least = length / f64::from(steps.max(1));
    let mut decade = math::pow(10.0, log10(least).floor());
    // A power of ten with a rounding error would be printed with it.
    if decade < 1.0 {
        decade = 1.0 / (1.0 / decade).round();
    }
    STEPS.map(|step| step * decade).into_iter().find(|step| *step >= least - 1e-12).unwrap_or(10.0 * decade)
}

/// Formats a value with as many digits as the step has.
fn tick_label(x: f64, step: f64) -> String {
    let digits = (0..6).find(|&digits| {
        let scaled = step * math::pow(10.0, f64::from(digits));
        (scaled - scaled.round()).abs() < 1e-6
    });
    format!("{x:.*}", digits.unwrap_or(6) as usize)
}

fn power_of_ten(power: i32) -> String {
    match power {
        0..=3 => format!("{}", 10_u32.pow(power as u32)),
        4..=5 => format!("{} k", 10_u32.pow(power as u32 - 3)),
        6..=8 => format!("{} M", 10_u32.pow(power as u32 - 6)),
        9.. => format!("1e{power}"),
        below => format!("{:.*}", below.unsigned_abs() as usize, math::pow(10.0, f64::from(below))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_what_is_drawn_and_count_evenly() {
        let axis = |values: &[f64]| Axis::from_zero("x", values.iter().copied(), 5);
        let texts = |axis: &Axis| axis.ticks.iter().map(|(_, text)| text.clone()).collect::<Vec<_>>();
        assert_eq!(texts(&axis(&[0.27])), ["0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(texts(&axis(&[0.12])), ["0.000", "0.025", "0.050", "0.075", "0.100", "0.125"]);
        assert_eq!(texts(&axis(&[7.0])), ["0", "2", "4", "6", "8"]);
        assert_eq!(texts(&axis(&[1.0])), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(axis(&[]).ends, [0.0, 1.0]);
        assert_eq!(axis(&[f64::NAN, 0.0]).ends, [0.0, 1.0]);
        for largest in [1e-3, 0.7, 3.3, 12.0, 4400.0] {
            let [low, high] = axis(&[largest]).ends;
            assert!(low == 0.0 && high >= largest && high <= 2.0 * largest, "{largest}: {high}");
        }
    }

    #[test]
    fn logarithms() {
        let axis = Axis::decades("x", [30.0, 4400.0].into_iter());
        assert_eq!(axis.ends, [1.0, 4.0]);
        assert_eq!(axis.label_at(4.0), "10 k");
        assert!((axis.place(1000.0) - 3.0).abs() < 1e-12);
        let axis = Axis::doublings("x", [1.0, 512.0].into_iter(), 5);
        assert_eq!(
            axis.ticks.iter().map(|(_, text)| &**text).collect::<Vec<_>>(),
            ["1", "4", "16", "64", "256"]
        );
        assert!(axis.place(512.0) < axis.ends[1]);
        assert_eq!(Axis::decades("x", std::iter::empty()).ends, [0.0, 1.0]);
    }

    #[test]
    fn a_dial_has_its_own_ticks() {
        let axis = Axis::at("foliage", &[0.0, 0.3, 1.5]);
        assert_eq!(axis.label_at(0.3), "0.3");
        assert_eq!(axis.label_at(0.4), "");
        assert!(axis.ends[0] < 0.0 && axis.ends[1] > 1.5);
    }
}

//! The simulator's figures of wind, by the names of their rows.

use anyhow::Context;
use orchard_geometry::{Vec3, math};
use orchard_spec::wind::WindSpec;
use orchard_spec::{Preset, Spec};
use orchard_treephys::trials::{radius_of_frequency, response_in_wind, straight_limb};
use orchard_treephys::wind::{Sail, Wind, spectrum};

/// Seed of the winds; wind i is its world i.
const SEED: u64 = 1;

/// Mean speed at the canopy's height [m/s].
const SPEED: f64 = 5.0;

/// A figure by its row's name.
pub fn figure(name: &str) -> anyhow::Result<f64> {
    let spec = Spec::preset(Preset::MeasuredWood);
    let wind = spec.wind.as_ref().context("the preset has no wind")?;
    match name {
        "speed_at_2_m" => profile(wind, 2.0),
        "speed_at_1_m" => profile(wind, 1.0),
        "deviation" => deviation(wind),
        "spectrum" => octave(wind),
        "own_frequency" => own_frequency(&spec, wind),
        "leaf_exponent" => exponent(wind, |sail, speed| sail.on_leaves(0, speed)),
        "wood_exponent" => exponent(wind, |sail, speed| sail.on_wood(0, speed)),
        _ => anyhow::bail!("measured/wind.toml: no figure has the name '{name}'"),
    }
}

fn blowing(wind: &WindSpec) -> anyhow::Result<WindSpec> {
    let speed = wind.speed.with_value(SPEED).map_err(anyhow::Error::msg)?;
    Ok(WindSpec { speed, ..wind.clone() })
}

fn drawn(wind: &WindSpec, world: u32) -> anyhow::Result<Wind> {
    Wind::draw(wind, SEED, world).context("there is no wind")
}

/// Mean speed at a height under a canopy of 4 m over that at its height.
fn profile(wind: &WindSpec, height: f64) -> anyhow::Result<f64> {
    let canopy_height = wind.canopy_height.with_value(4.0).map_err(anyhow::Error::msg)?;
    let wind = WindSpec { canopy_height, ..blowing(wind)? };
    Ok(drawn(&wind, 0)?.profile(height))
}

/// Standard deviation along the wind over the asked one.
fn deviation(wind: &WindSpec) -> anyhow::Result<f64> {
    let spec = blowing(wind)?;
    let (sin, cos) = math::sin_cos(spec.bearing.si());
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for world in 0..40 {
        let wind = drawn(&spec, world)?;
        for k in 0..200 {
            let k = f64::from(k);
            let p_world = Vec3::new(0.0, 37.0 * k, spec.canopy_height.si());
            let along = wind.velocity(&p_world, 11.0 * k).dot(&Vec3::new(cos, sin, 0.0));
            n += 1.0;
            sum += along;
            squares += along * along;
        }
    }
    let mean: f64 = sum / n;
    Ok((squares / n - mean * mean).sqrt() / (spec.intensity.si() * SPEED))
}

/// Variance of the gusts in an octave over that of von Karman's spectrum, of the octave furthest from 1.
fn octave(wind: &WindSpec) -> anyhow::Result<f64> {
    const WINDS: u32 = 300;
    const STEPS: u32 = 200;
    let spec = blowing(wind)?;
    let (length, deviation) = (spec.length.si(), spec.intensity.si() * SPEED);
    let mut lines = Vec::new();
    for world in 0..WINDS {
        lines.extend(drawn(&spec, world)?.lines());
    }
    let mut furthest = 1.0_f64;
    for octave in -8..8 {
        let low = math::exp(f64::from(octave) * math::ln(2.0)) * SPEED / length;
        let inside = lines.iter().filter(|(f, _)| (low..2.0 * low).contains(f));
        let found = inside.map(|(_, variance)| variance).sum::<f64>() / f64::from(WINDS);
        let df = low / f64::from(STEPS);
        let at = |i: u32| spectrum(deviation, length, SPEED, low + (f64::from(i) + 0.5) * df);
        let asked: f64 = (0..STEPS).map(|i| df * at(i)).sum();
        let ratio = found / asked;
        if asked > 0.02 * deviation * deviation && (ratio - 1.0).abs() > (furthest - 1.0).abs() {
            furthest = ratio;
        }
    }
    Ok(furthest)
}

/// Frequency of a limb's strongest response over its own.
fn own_frequency(spec: &Spec, wind: &WindSpec) -> anyhow::Result<f64> {
    const OWN: f64 = 2.0;
    let mut wood = spec.wood.clone();
    wood.young = None;
    let limb = straight_limb(8, 1.0, radius_of_frequency(&wood, 1.0, OWN));
    let wind = blowing(wind)?;
    let gusts = drawn(&wind, 0)?;
    Ok(response_in_wind(&limb, &wood, &spec.sim, (&wind, &gusts), OWN)? / OWN)
}

/// Exponent of a drag with the speed, from 8 to 12 m/s.
fn exponent(wind: &WindSpec, drag: impl Fn(&Sail, f64) -> f64) -> anyhow::Result<f64> {
    let spec = Spec::preset(Preset::CalibratedYoung);
    let tree = orchard_treegen::grow(&spec, SEED, 0)?;
    let leafy = tree.leaves.first().context("the tree has no leaf")?.segment;
    let one = orchard_treegen::Skeleton {
        segments: vec![orchard_treegen::Segment { parent: None, ..tree.segments[leafy].clone() }],
        leaves: vec![orchard_treegen::LeafSite { segment: 0, ..tree.leaves[0].clone() }],
        ..straight_limb(0, 1.0, 1.0)
    };
    let sail = Sail::new(wind, &one, &spec.wood, spec.fruit.air_density.si());
    Ok(math::ln(drag(&sail, 12.0) / drag(&sail, 8.0)) / math::ln(1.5))
}

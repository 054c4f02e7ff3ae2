//! A robot in trees that the wind moves, against the f64 worlds.

use super::*;

/// A preset's world as [`seen`], in a wind of 6 m/s.
fn seen_in_wind(preset: Preset) -> Arc<Spec> {
    let mut spec = (*seen(preset)).clone();
    spec.wind = Spec::preset(Preset::Calibrated).wind;
    let wind = spec.wind.as_mut().unwrap();
    wind.speed = wind.speed.with_value(6.0).unwrap();
    Arc::new(spec)
}

/// Each substep from the same state has the contacts of f64 while the wind blows on wood and fruit.
#[test]
fn substeps_in_wind_have_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let off = compare_substeps(&gpu, &seen_in_wind(Preset::Paper), 2, 220);
    assert!(off.loaded[0] > 50 && off.is_as_in_f64(), "{off:?}");
}

//! Wind: the spectrum and variance of its gusts, its profile, and what it does to a limb.

use super::damping::{LENGTH, LINKS, wood};
use super::fixture::Wood;
use orchard_geometry::{Vec3, math};
use orchard_spec::wind::WindSpec;
use orchard_spec::{Preset, Spec};
use orchard_treegen::LeafSite;
use orchard_treephys::trials::{radius_of_frequency, response_in_wind, straight_limb};
use orchard_treephys::wind::{Places, Sail, Wind, spectrum};

/// The wind of the presets at a speed.
fn wind_at(speed: f64) -> WindSpec {
    let spec = Spec::preset(Preset::MeasuredWood).wind.unwrap();
    WindSpec { speed: spec.speed.with_value(speed).unwrap(), ..spec }
}

const SPEED: f64 = 5.0;

#[test]
fn no_speed_is_no_wind_and_draws_repeat() {
    assert_eq!(Wind::draw(&wind_at(0.0), 1, 0), None);
    let (a, b) = (Wind::draw(&wind_at(SPEED), 1, 0), Wind::draw(&wind_at(SPEED), 1, 0));
    assert_eq!(a, b);
    let (a, b) = (a.unwrap(), b.unwrap());
    let p = Vec3::new(0.3, -0.2, 1.1);
    assert_eq!(a.velocity(&p, 7.25).map(f64::to_bits), b.velocity(&p, 7.25).map(f64::to_bits));
    for other in [(2, 0), (1, 1)] {
        let other = Wind::draw(&wind_at(SPEED), other.0, other.1).unwrap();
        assert_ne!(a.velocity(&p, 7.25), other.velocity(&p, 7.25));
    }
}

/// 40 winds sampled at 200 places and times each, far apart: mean, and variance of each component. A wind's own variance over space is exact; the
/// error is that of 8000 samples of which perhaps a quarter are independent, 5 % at 2 standard errors.
#[test]
fn gusts_have_the_asked_mean_and_variance() {
    let spec = wind_at(SPEED);
    let asked = spec.intensity.si() * SPEED;
    let z = spec.canopy_height.si();
    let (mut n, mut sum, mut squares) = (0.0, Vec3::zeros(), Vec3::zeros());
    for world in 0..40 {
        let wind = Wind::draw(&spec, 3, world).unwrap();
        for k in 0..200 {
            let k = f64::from(k);
            let u = wind.velocity(&Vec3::new(0.0, 37.0 * k, z), 11.0 * k);
            n += 1.0;
            sum += u;
            squares += u.component_mul(&u);
        }
    }
    let mean = sum / n;
    let variance = squares / n - mean.component_mul(&mean);
    println!("mean {mean:?}, deviation over asked {:?}", variance.map(|v| v.sqrt() / asked));
    let bearing = spec.bearing.si();
    let along = Vec3::new(math::cos(bearing), math::sin(bearing), 0.0) * SPEED;
    assert!((mean - along).norm() < 0.03 * SPEED, "{mean:?}");
    for v in variance.iter() {
        assert!((v / (asked * asked) - 1.0).abs() < 0.05, "{variance:?}");
    }
}

/// Lines of 300 winds in octaves of f L / U against the integral of von Karman's spectrum, where at least 2 % of the variance lies. 300 winds
/// have 7200 wave numbers; an octave with 2 % of them has a standard error of 10 %.
#[test]
fn gusts_have_von_karmans_spectrum() {
    let spec = wind_at(SPEED);
    let (length, deviation) = (spec.length.si(), spec.intensity.si() * SPEED);
    const WINDS: u32 = 300;
    let lines: Vec<(f64, f64)> =
        (0..WINDS).flat_map(|w| Wind::draw(&spec, 5, w).unwrap().lines().collect::<Vec<_>>()).collect();
    let mut octaves = 0;
    for octave in -6..6 {
        let low = math::exp(f64::from(octave) * math::ln(2.0)) * SPEED / length;
        let found: f64 =
            lines.iter().filter(|(f, _)| (low..2.0 * low).contains(f)).map(|(_, v)| v).sum::<f64>()
                / f64::from(WINDS);
        let steps = 200;
        let df = low / f64::from(steps);
        let asked: f64 = (0..steps)
            .map(|i| df * spectrum(deviation, length, SPEED, low + (f64::from(i) + 0.5) * df))
            .sum();
        println!("octave {octave}: {found:.4} against {asked:.4}");
        if asked > 0.02 * deviation * deviation {
            octaves += 1;
            assert!((found / asked - 1.0).abs() < 0.25, "octave {octave}: {found} against {asked}");
        }
    }
    assert!(octaves >= 5, "{octaves}");
    let whole: f64 = lines.iter().map(|(_, v)| v).sum::<f64>() / f64::from(WINDS);
    assert!((whole / (deviation * deviation) - 1.0).abs() < 1e-9, "{whole}");
}

/// The profile is whole at the canopy's height and falls to the shares that its attenuation says.
#[test]
fn the_profile_is_continuous_at_the_canopy() {
    let spec = wind_at(SPEED);
    let (h, a) = (spec.canopy_height.si(), spec.attenuation.si());
    let wind = Wind::draw(&spec, 1, 0).unwrap();
    assert!((wind.profile(h) - 1.0).abs() < 1e-12);
    assert!((wind.profile(h * 1.000_001) - 1.0).abs() < 1e-5);
    assert!((wind.profile(0.5 * h) - math::exp(-0.5 * a)).abs() < 1e-12);
    assert!(wind.profile(2.0 * h) > 1.1 && wind.profile(0.0) > 0.0);
}

/// Segments are no farther from their place than asked, and share it with a parent or start it; at no distance each has its own.
#[test]
fn segments_share_the_air_of_a_place_nearby() {
    const SPACING: f64 = 0.4;
    let skeleton = orchard_treegen::grow(&Spec::preset(Preset::MeasuredWood), 1, 0).unwrap();
    let count = skeleton.segments.len();
    let places = Places::new(&skeleton, SPACING);
    assert!(places.p_world().len() < count / 2, "{}", places.p_world().len());
    for (i, segment) in skeleton.segments.iter().enumerate() {
        let middle = segment.p_base_world + segment.heading() * (0.5 * segment.length);
        let own = places.of_segment(i);
        let away = (places.p_world()[own] - middle).norm();
        let is_shared = segment.parent.is_some_and(|parent| places.of_segment(parent) == own);
        assert!(if is_shared { away <= SPACING } else { away == 0.0 }, "segment {i}: {away} m");
    }
    assert_eq!(Places::new(&skeleton, 0.0).p_world().len(), count);
}

/// A limb of 2 Hz at the height of the canopy, without leaves.
fn limb_in_the_wind(speed: f64) -> (Wood, Wind, Sail) {
    let law = wood(0.03, 0.03);
    let radius = radius_of_frequency(&law, LENGTH, 2.0);
    let mut skeleton = straight_limb(LINKS, LENGTH, radius);
    let spec = wind_at(speed);
    for segment in &mut skeleton.segments {
        segment.p_base_world.z = spec.canopy_height.si();
    }
    let mut limb = Wood::new(&skeleton, law);
    limb.settings.gravity = Vec3::zeros();
    let wind = Wind::draw(&spec, 9, 0).unwrap();
    let sail = Sail::new(&spec, &skeleton, &limb.spec, 1.2);
    (limb, wind, sail)
}

/// The response of a limb of 2 Hz between 1 and 5 Hz peaks within 10 % of its own frequency, over 2 minutes of wind.
#[test]
fn a_limb_answers_at_its_own_frequency() {
    let (law, own) = (wood(0.03, 0.03), 2.0);
    let limb = straight_limb(LINKS, LENGTH, radius_of_frequency(&law, LENGTH, own));
    let spec = wind_at(SPEED);
    let wind = Wind::draw(&spec, 9, 0).unwrap();
    let found = response_in_wind(&limb, &law, &Spec::paper().sim, (&spec, &wind), own).unwrap();
    println!("peak at {found:.2} Hz");
    assert!((found / own - 1.0).abs() < 0.1, "{found}");
}

/// At the strongest wind the energy of the limb stays bounded: its largest value in the second half minute is at most three times that of the first,
/// and when the wind stops it dies out.
#[test]
fn energy_stays_bounded_in_the_strongest_wind() {
    let (mut limb, wind, sail) = limb_in_the_wind(12.0);
    let energy = |limb: &mut Wood| {
        limb.data.rest.fill(0.0);
        orchard_multibody::energy(&limb.model, &limb.data, &Vec3::zeros()).total()
    };
    let mut halves = [0.0_f64; 2];
    for frame in 0..3600 {
        let Wood { tree, rupture, model, data, .. } = &mut limb;
        sail.blow(&wind, tree, rupture, model, data, f64::from(frame) / 60.0);
        for _ in 0..3 {
            limb.substep();
        }
        let half = &mut halves[usize::from(frame >= 1800)];
        *half = half.max(energy(&mut limb));
    }
    println!("largest energies {halves:?} J");
    assert!(halves[0] > 0.0 && halves[1] <= 3.0 * halves[0], "{halves:?}");
    limb.data.body_force_world.fill(Vec3::zeros());
    for _ in 0..20 * 180 {
        limb.substep();
    }
    assert!(energy(&mut limb) < 1e-6 * halves[1]);
}

/// A twig of 17 g with 0.1 m^2 of leaves in the strongest wind stays below the mean speed of the air: it gives way, and does not flutter up.
#[test]
fn a_leafy_twig_stays_slower_than_the_air() {
    let (mut limb, wind, _) = limb_in_the_wind(12.0);
    const LEAVES: usize = 4;
    let mut skeleton = straight_limb(LINKS, LENGTH, 0.0025);
    let x_segment_leaf = orchard_geometry::Pose::identity();
    for leaf in 0..LINKS * LEAVES {
        let segment = leaf / LEAVES;
        skeleton.leaves.push(LeafSite { segment, x_segment_leaf, length: 0.08, width: 0.05, size_class: 1 });
    }
    let area: f64 = skeleton.leaves.iter().map(LeafSite::area).sum();
    assert!((area - 0.1).abs() < 0.001, "{area}");
    let sail = Sail::new(&wind_at(12.0), &skeleton, &limb.spec, 1.2);
    let mut fastest = 0.0_f64;
    for frame in 0..1800 {
        let Wood { tree, rupture, model, data, .. } = &mut limb;
        sail.blow(&wind, tree, rupture, model, data, f64::from(frame) / 60.0);
        for _ in 0..3 {
            limb.substep();
            let body = limb.tree.bodies[LINKS - 1];
            let p_com_world = limb.data.com_p_world(body);
            fastest = fastest.max(limb.data.point_velocity_world(body, &p_com_world).norm());
        }
    }
    println!("fastest {fastest} m/s");
    assert!(fastest < 12.0, "{fastest}");
}

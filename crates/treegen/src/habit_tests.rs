use super::*;
use crate::grow;
use orchard_spec::Spec;

/// Rounding of a product of some dozens of rotations.
const ROUNDING: f64 = 1e-13;

fn neutral(n: usize) -> Habit {
    Habit {
        length: vec![1.0; n],
        radius: vec![1.0; n],
        bend: vec![(0.0, 0.0); n],
        droop: 0.0,
        lean_world: Vec3::zeros(),
        fork_spread: 1.0,
        twist: 0.0,
    }
}

fn tree() -> Vec<Segment> {
    grow(&Spec::paper(), 42, 0).unwrap().segments
}

/// A trunk and a level limb of some internodes of 1 m.
fn arm(internodes: usize) -> Vec<Segment> {
    let internode = |i: usize| Internode {
        parent: i.checked_sub(1),
        heading: if i == 0 { Vec3::z() } else { Vec3::x() },
        length: 1.0,
        width: 1.0,
        order: u8::from(i > 0),
        unit: None,
    };
    let limb: Vec<Internode> = (0..=internodes).map(internode).collect();
    assemble::segments(&limb, &vec![0.01; internodes + 1])
}

fn angle(a: &Vec3, b: &Vec3) -> f64 {
    math::atan2(a.cross(b).norm(), a.dot(b))
}

/// Droop d an internode makes a level limb an arc: its k-th internode points k d below the level.
#[test]
fn droop_compounds_along_a_limb() {
    let droop = 0.03;
    let bent = turned(&arm(8), &Habit { droop, ..neutral(9) });
    assert_eq!(bent[0].heading, Vec3::z());
    for (k, internode) in bent.iter().enumerate().skip(1) {
        let (sin, cos) = math::sin_cos(droop * k as f64);
        assert!((internode.heading - Vec3::new(cos, 0.0, -sin)).norm() < ROUNDING, "internode {k}");
    }
}

/// A bend of one segment turns all that grows on it and nothing else.
#[test]
fn a_bend_turns_all_that_grows_beyond() {
    let mut habit = neutral(9);
    habit.bend[4] = (0.2, 1.0);
    let bent = turned(&arm(8), &habit);
    for (k, internode) in bent.iter().enumerate().skip(1) {
        let expected = if k < 4 { 0.0 } else { 0.2 };
        assert!((angle(&internode.heading, &Vec3::x()) - expected).abs() < ROUNDING);
    }
    assert!((bent[4].heading - bent[8].heading).norm() < ROUNDING);
}

#[test]
fn fork_spread_multiplies_every_branching_angle_and_no_other() {
    let segments = tree();
    let wide = turned(&segments, &Habit { fork_spread: 1.18, ..neutral(segments.len()) });
    for (i, segment) in segments.iter().enumerate() {
        let Some(parent) = segment.parent else { continue };
        let base = angle(&segments[parent].heading(), &segment.heading());
        let factor = if segment.order > segments[parent].order { 1.18 } else { 1.0 };
        let now = angle(&wide[parent].heading, &wide[i].heading);
        assert!((now - base * factor).abs() < ROUNDING, "segment {i}: {base} -> {now}");
    }
}

/// The n-th limb of the leader rolls by n times the twist about the leader; angles to the parent stay.
#[test]
fn twist_rolls_successive_laterals() {
    let segments = tree();
    let twist = 0.3;
    let rolled = turned(&segments, &Habit { twist, ..neutral(segments.len()) });
    let mut limbs = 0;
    for (i, segment) in segments.iter().enumerate() {
        let Some(parent) = segment.parent else { continue };
        let along = segments[parent].heading();
        let before = angle(&along, &segment.heading());
        assert!((angle(&rolled[parent].heading, &rolled[i].heading) - before).abs() < ROUNDING);
        if segments[parent].order == 0 && segment.order == 1 {
            let expected = Rotation::from_scaled_axis(along * (twist * f64::from(limbs))) * segment.heading();
            assert!((rolled[i].heading - expected).norm() < ROUNDING, "limb {limbs}");
            limbs += 1;
        }
    }
    assert!(limbs >= 3);
}

#[test]
fn lean_turns_the_whole_tree() {
    let segments = tree();
    let lean_world = Vec3::new(0.05, -0.06, 0.0);
    let leaning = turned(&segments, &Habit { lean_world, ..neutral(segments.len()) });
    let rotation = Rotation::from_scaled_axis(lean_world);
    for (segment, internode) in segments.iter().zip(&leaning) {
        assert!((rotation * segment.heading() - internode.heading).norm() < ROUNDING);
    }
}

#[test]
fn no_segment_gets_thicker_than_its_parent() {
    let segments = tree();
    let factors: Vec<f64> = (0..segments.len()).map(|i| if i % 3 == 0 { 0.76 } else { 1.3 }).collect();
    let radii = thickened(&segments, &factors);
    let mut clamped = 0;
    for (i, segment) in segments.iter().enumerate() {
        assert!(segment.parent.is_none_or(|parent| radii[i] <= radii[parent]));
        clamped += usize::from(radii[i] != segment.radius * factors[i]);
    }
    assert!(clamped > 0, "the factors never met the clamp");
}

#[test]
fn every_change_is_not_neutral() {
    assert!(neutral(3).is_neutral());
    let mut bent = neutral(3);
    bent.bend[2].0 = 1e-9;
    let changed = [
        bent,
        Habit { length: vec![1.0, 1.1, 1.0], ..neutral(3) },
        Habit { radius: vec![1.0, 1.1, 1.0], ..neutral(3) },
        Habit { droop: 0.1, ..neutral(3) },
        Habit { lean_world: Vec3::x(), ..neutral(3) },
        Habit { fork_spread: 1.1, ..neutral(3) },
        Habit { twist: 0.1, ..neutral(3) },
    ];
    assert!(changed.iter().all(|habit| !habit.is_neutral()));
}

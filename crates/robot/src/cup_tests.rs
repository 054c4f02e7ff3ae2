use super::*;
use crate::RobotModel;

const SUBSTEP: f64 = 1.0 / 180.0;

fn cup() -> Cup {
    RobotModel::named("rail-xarm6-suction").unwrap().cup().unwrap()
}

/// Place of a ball's centre that presses evenly on the lip by `depth` \[m\].
fn centred(cup: &Cup, radius: f64, depth: f64) -> Vec3 {
    let reach = radius + cup.half_thickness - depth;
    Vec3::new(0.0, 0.0, (reach * reach - cup.lip_radius * cup.lip_radius).sqrt())
}

fn nothing(_: usize) -> f64 {
    0.0
}

fn seal(cup: &Cup, p_lip: &Vec3, radius: f64, under: impl Fn(usize) -> f64) -> Seal {
    cup.seal(cup.openings(p_lip, radius, under))
}

#[test]
fn the_vacuum_of_a_closed_cup_rises_as_the_closed_form() {
    let cup = cup();
    let seal = seal(&cup, &centred(&cup, 0.035, 1e-3), 0.035, nothing);
    assert_eq!(seal, Seal { leak: 0.0, closed: 1.0 });
    let (mut vacuum, mut time) = (0.0, 0.0);
    while vacuum < 0.6 * cup.vacuum_max {
        vacuum = cup.vacuum_after(vacuum, 1.0, &seal, SUBSTEP);
        time += SUBSTEP;
        let wanted = cup.vacuum_max * (1.0 - math::exp(-time / cup.rise_time));
        assert!((vacuum - wanted).abs() < 1e-9 * cup.vacuum_max, "{time} {vacuum} {wanted}");
    }
    assert!((time - -cup.rise_time * math::ln(0.4)).abs() < SUBSTEP, "{time}");
    for _ in 0..90 {
        vacuum = cup.vacuum_after(vacuum, 0.0, &seal, SUBSTEP);
    }
    assert!(vacuum < 0.001 * cup.vacuum_max, "vented: {vacuum}");
    assert!(cup.vacuum_after(1.0e4, f64::NAN, &seal, 1.0) < 1.0);
}

#[test]
fn a_leak_halves_the_vacuum_where_the_config_says_and_fills_the_cup_sooner() {
    let cup = cup();
    let leaky = Seal { leak: cup.leak_half, closed: 1.0 };
    assert!((cup.vacuum_after(0.0, 1.0, &leaky, 10.0) - 0.5 * cup.vacuum_max).abs() < 1.0);
    let step = |seal: &Seal| cup.vacuum_after(cup.vacuum_max, 0.0, seal, SUBSTEP);
    assert!(step(&cup.open()) < step(&leaky) && step(&leaky) < step(&Seal { leak: 0.0, closed: 1.0 }));
    assert_eq!(cup.force(5.0e4, &cup.open()), 0.0);
}

/// Tilt, offset, a small ball and something under the lip each open it.
#[test]
fn what_lies_badly_leaks() {
    let cup = cup();
    let radius = 0.035;
    let good = centred(&cup, radius, 1e-3);
    let leak = |p: &Vec3, radius: f64| seal(&cup, p, radius, nothing).leak;
    assert_eq!(leak(&good, radius), 0.0);
    // The ball touches one side and stands off on the other, ever more.
    let mut before = 0.0;
    for offset in [0.012, 0.016, 0.020] {
        let p = good + Vec3::new(offset, 0.0, 0.0);
        let now = leak(&p, radius);
        assert!(now > before, "{offset}: {now} {before}");
        before = now;
    }
    let off = |height: f64| good + Vec3::new(0.0, 0.0, height);
    assert!(cup.lies_on(&good, radius, false) && !cup.lies_on(&off(0.003), radius, false));
    assert!(cup.lies_on(&off(0.003), radius, true) && !cup.lies_on(&off(0.01), radius, true));
    assert!(!cup.lies_on(&-good, radius, true));
    let small = 0.8 * cup.curve_radius_min;
    assert!(leak(&centred(&cup, small, 1e-3), small) > 0.0);
    let leaf = seal(&cup, &good, radius, |i| if i < 2 { cup.leaf_gap } else { 0.0 });
    assert!(leaf.leak > 0.0 && leaf.closed < 1.0);
    let weak = cup.vacuum_after(0.0, 1.0, &leaf, 10.0);
    assert!(cup.force(weak, &leaf) < 0.7 * cup.vacuum_max * cup.area(), "{weak}");
}

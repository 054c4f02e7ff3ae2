//! A fruit at the suction cup of a robot, on the device against f64.

use orchard_geometry::{inverse_transform, math};
use orchard_robot::{Cup, RobotHandle, Suction};

use super::in_hand::Grip;
use super::laid::{FRUIT, laid_on_cup};
use super::*;

/// Frames in which the vacuum builds up.
const RISING: u32 = 60;
const SECOND: u32 = 60;

/// A robot with a cup whose lip lies on a fruit off its stem, from the substep on in which the valve opens.
fn laid(gpu: &Gpu, spec: &Arc<Spec>) -> (Grip, Cup) {
    let robot = RobotModel::named("rail-xarm6-suction").unwrap();
    let (world, command) = laid_on_cup(spec, &robot);
    let cup = world.handle().cup.clone().unwrap();
    let command = Command { vacuum: 1.0, ..command };
    (Grip::on(gpu, world, &robot, command), cup)
}

/// A cup that holds its fruit under its whole vacuum.
fn sealed(gpu: &Gpu, spec: &Arc<Spec>) -> (Grip, Cup) {
    let (mut grip, cup) = laid(gpu, spec);
    grip.step_here(RISING);
    assert!(grip.world.is_held(FRUIT), "the cup holds no fruit");
    (grip, cup)
}

fn x_world_lip(handle: &RobotHandle, data: &Data, cup: &Cup) -> Pose {
    data.x_world_body(handle.wrist()) * cup.x_wrist_lip
}

/// Place of the fruit in the frame of the lip.
fn p_lip(grip: &Grip, data: &Data, cup: &Cup) -> Vec3 {
    let x_world_lip = x_world_lip(grip.world.handle(), data, cup);
    inverse_transform(&x_world_lip, &data.point_p_world[grip.point()])
}

/// While the vacuum builds up and the arm turns with the fruit, each substep from the same state has the contacts, the vacuum and the closed points of f64. The twelve points of the lip slide
/// slowly on the fruit, so that rounding shifts shares of their load between them: the limit of their forces is our own choice.
#[test]
fn substeps_of_a_cup_on_a_fruit_are_those_of_f64() {
    const SUBSTEPS: u32 = 120;
    let Some(gpu) = device() else { return };
    let (mut grip, _) = laid(&gpu, &seen(Preset::Paper));
    let mut off = Off::default();
    let mut vacuum_off = 0.0_f64;
    grip.command.arm_q[0] += 0.3;
    grip.command.arm_q[4] += 0.6;
    grip.compare(SUBSTEPS, &mut off, |grip, _, _| {
        let (there, here) = (grip.suction(), grip.world.suction());
        assert_eq!((there.fruit, there.closed), (here.fruit, here.closed));
        vacuum_off = vacuum_off.max((there.vacuum - here.vacuum).abs() / here.vacuum);
    });
    assert!(grip.world.is_held(FRUIT), "it is not held");
    assert!(
        off.loaded[1] >= 6 * SUBSTEPS as usize
            && off.iterations < 20
            && off.gap < 2e-6
            && off.normal < 1e-5
            && off.force < 1e-2
            && off.change < 1e-3
            && vacuum_off < 1e-5,
        "{off:?}, vacuum {vacuum_off}"
    );
}

/// The cup draws with its vacuum times its area: pulled along its axis with four fifths of this the fruit stays, shifted as in f64, with more it comes off.
#[test]
fn a_cup_holds_to_the_force_of_its_vacuum() {
    const LOST: f64 = 0.01;
    let Some(gpu) = device() else { return };
    let (mut grip, cup) = sealed(&gpu, &Arc::new(Spec::paper()));
    let limit = cup.vacuum_max * cup.area();
    let axis = x_world_lip(grip.world.handle(), grip.world.data(), &cup).rotation * Vec3::z();
    let held = grip.world.clone();
    let (lift, before) = (held.data().point_force_world[grip.point()], p_lip(&grip, held.data(), &cup));
    for (share, is_lost) in [(0.8, false), (1.05, true)] {
        // The pull rises slowly: a sudden one swings the fruit on the lip.
        let pull =
            |frame: u32| lift + axis * (share * limit * f64::from(frame.min(SECOND)) / f64::from(SECOND));
        grip.world = held.clone();
        let point = grip.point();
        for frame in 0..2 * SECOND {
            grip.world.data_mut().point_force_world[point] = pull(frame);
            grip.plant();
            grip.advance(1);
            *grip.world.data_mut() = grip.read().0;
        }
        let there = (p_lip(&grip, grip.world.data(), &cup) - before).norm();
        grip.world = held.clone();
        for frame in 0..2 * SECOND {
            grip.world.data_mut().point_force_world[point] = pull(frame);
            grip.step_here(1);
        }
        let here = (p_lip(&grip, grip.world.data(), &cup) - before).norm();
        for (gone, place) in [(there, "the device"), (here, "f64")] {
            assert_eq!(gone > LOST, is_lost, "{share} of {limit} N on {place}: it went by {gone} m");
        }
        assert!(is_lost || (there - here).abs() < 1e-5, "{share} of {limit} N: {there} m, {here} m");
    }
}

/// A valve that closes, or that is not a number, vents a closed cup by exp(-t / tau), and the fruit falls off.
#[test]
fn a_vented_cup_lets_go() {
    let Some(gpu) = device() else { return };
    let (mut grip, cup) = sealed(&gpu, &Arc::new(Spec::paper()));
    let time = grip.world.spec().sim.frame();
    let held = grip.world.clone();
    for valve in [0.0, f64::NAN] {
        grip.world = held.clone();
        let point = grip.point();
        grip.command.vacuum = valve;
        grip.plant();
        grip.advance(1);
        grip.read();
        let wanted = cup.vacuum_max * math::exp(-time / cup.rise_time);
        let found = grip.suction().vacuum;
        assert!((found - wanted).abs() < 1e-3 * wanted, "valve {valve}: {found} Pa, {wanted} Pa");
        // Nothing bears its weight.
        grip.world.data_mut().point_force_world[point] = Vec3::zeros();
        grip.plant();
        grip.advance(SECOND);
        let after = grip.read().0;
        let fallen = p_lip(&grip, &after, &cup).norm();
        assert!(fallen > 0.5, "valve {valve}: it is {fallen} m away");
        assert_eq!(grip.suction(), Suction::default(), "valve {valve}");
    }
}

/// Leaves under some points of the lip leave gaps of their own there: the vacuum is that of the pump against these leaks.
#[test]
fn leaves_under_the_lip_let_air_in() {
    let Some(gpu) = device() else { return };
    let (mut grip, cup) = sealed(&gpu, &Arc::new(Spec::paper()));
    grip.under_lip.leaves = 0b1011;
    let opened = Suction { closed: 0, ..*grip.world.suction() };
    grip.plant_with(&opened);
    grip.advance(RISING);
    grip.read();
    let leak = 3.0 * cup.leaf_gap * cup.spacing();
    let (found, wanted) = (grip.suction(), cup.vacuum_max / (1.0 + leak / cup.leak_half));
    assert!((found.vacuum - wanted).abs() < 1e-3 * wanted, "{found:?}, {wanted} Pa");
    assert_eq!(found.closed, ((1 << cup.lip_p_lip.len()) - 1) & !0b1011);
    // Leaves that come later find closed points.
    grip.under_lip.leaves = 0b1000_1011;
    grip.advance(1);
    grip.read();
    assert_eq!(grip.suction().closed, found.closed);
}

/// A fruit that the cup holds creeps as in f64, by some micrometres a second.
#[test]
fn a_fruit_at_a_cup_stays() {
    const APART: f64 = 5e-6;
    let Some(gpu) = device() else { return };
    let (mut grip, cup) = sealed(&gpu, &seen(Preset::Paper));
    grip.plant();
    grip.advance(SECOND);
    let after = grip.read().0;
    grip.step_here(SECOND);
    let [there, here] = [&after, grip.world.data()].map(|data| p_lip(&grip, data, &cup));
    assert!((there - here).norm() < APART, "{there:?} {here:?}");
}

/// The processor tells that something presses on a point of the lip. In the first substep of the frame this point stays open, unless it was closed already.
#[test]
fn what_is_told_to_press_lets_air_in() {
    const POINT: u64 = 1 << 3;
    let Some(gpu) = device() else { return };
    let (mut grip, cup) = sealed(&gpu, &seen(Preset::Paper));
    let all = (1 << cup.lip_p_lip.len()) - 1;
    let before = Suction { closed: 0, ..*grip.world.suction() };
    grip.plant_with(&before);
    // A frame has one substep here.
    for (pressed, closed) in [(POINT, all & !POINT), (0, all), (POINT, all)] {
        grip.under_lip.pressed = pressed;
        grip.advance(1);
        grip.read();
        assert_eq!(grip.suction().closed, closed, "{pressed:b}: {:?}", grip.suction());
    }
}

//! Contacts of the robot with what stands still and with itself, against the f64 worlds.

use super::*;

/// A robot that moves its arm to a posture.
fn arm_to(name: &str, posture: &[f64]) -> (RobotModel, Command) {
    let robot = RobotModel::named(name).unwrap();
    let mut command = robot.start_command();
    command.arm_q.iter_mut().zip(posture).for_each(|(q, goal)| *q = *goal);
    (robot, command)
}

/// A world as [`seen`], with the robot far from the tree.
fn far() -> Arc<Spec> {
    let mut spec = (*seen(Preset::Paper)).clone();
    let distance = &mut spec.episode.start.distance;
    *distance = distance.with_ends(3.0, 3.0).unwrap();
    Arc::new(spec)
}

/// Largest differences of normals, of forces and of velocities.
struct Limits {
    normal: f64,
    force: f64,
    change: f64,
}

/// Those of other contacts.
const LIMITS: Limits = Limits { normal: 1e-5, force: 1e-3, change: 1e-3 };
/// Between hard bodies a rounding of the gap by 0.5 um is some tenths of a newton.
const HARD: Limits = Limits { force: 5e-3, change: 2e-3, ..LIMITS };
/// The normal of two small balls has the rounding of their places. Rates of stems have one of 1e-3 rad/s without any contact, and the least change by contacts is 0.08.
const TRELLIS: Limits = Limits { normal: 1e-4, change: 1.5e-2, ..LIMITS };

/// Asserts that substeps have the contacts of f64, at least `least` of the robot with itself or what stands still under load.
fn assert_same(off: &Off, least: usize, limits: &Limits) {
    assert!(
        off.crowded == 0
            && off.loaded[3] >= least
            && off.gap < 2e-6
            && off.normal < limits.normal
            && off.force < limits.force
            && off.change < limits.change,
        "{off:?}"
    );
}

/// A hand presses on the ground with a box and a capsule.
#[test]
fn a_hand_on_the_ground_has_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let arm = arm_to("husky-ur5e-2f85", &[0.0, 1.7, 0.0, -0.5, 0.0, 2.0]);
    let off = compare_under(&gpu, &far(), arm, 1, 280);
    assert_same(&off, 50, &LIMITS);
}

/// A hand of boxes is pressed on the chassis, a box.
#[test]
fn a_hand_on_its_chassis_has_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let arm = arm_to("ridgeback-fr3", &[2.6, 1.7, 0.0, -1.2, 0.0, 2.0, 0.8]);
    let off = compare_under(&gpu, &far(), arm, 1, 260);
    assert_same(&off, 100, &HARD);
}

/// A suction hand is pressed on its own arm and on its base: balls and capsules.
#[test]
fn a_suction_hand_on_its_arm_has_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let arm = arm_to("rail-xarm6-suction", &[-1.57, 0.5, 0.5, 0.0, 1.0, 1.0]);
    let off = compare_under(&gpu, &far(), arm, 1, 180);
    assert_same(&off, 100, &HARD);
}

/// Robots drive into the wires and posts of a trellis.
#[test]
fn wires_and_posts_have_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let off = compare_substeps(&gpu, &seen(Preset::VTrellis), 2, 200);
    assert_same(&off, 50, &TRELLIS);
}

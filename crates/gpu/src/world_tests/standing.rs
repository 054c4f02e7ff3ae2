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

/// Asserts that substeps have the contacts of f64, at least `least` of the robot with itself or what stands still under load.
fn assert_same(off: &Off, least: usize, change: f64) {
    assert!(
        off.crowded == 0
            && off.loaded[3] >= least
            && off.gap < 2e-6
            && off.normal < 1e-4
            // A rounding of the gap of two hard bodies by 0.3 um is some tenths of a newton.
            && off.force < 5e-3
            && off.change < change,
        "{off:?}"
    );
}

/// A hand presses on the ground with a box and a capsule.
#[test]
fn a_hand_on_the_ground_has_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let arm = arm_to("husky-ur5e-2f85", &[0.0, 1.7, 0.0, -0.5, 0.0, 2.0]);
    let off = compare_under(&gpu, &far(), arm, 1, 280);
    assert_same(&off, 50, 1e-3);
}

/// A hand of boxes is pressed on the chassis, a box.
#[test]
fn a_hand_on_its_chassis_has_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let arm = arm_to("ridgeback-fr3", &[2.6, 1.7, 0.0, -1.2, 0.0, 2.0, 0.8]);
    let off = compare_under(&gpu, &far(), arm, 1, 260);
    assert_same(&off, 100, 2e-3);
}

/// A suction hand is pressed on its own arm and on its base: balls and capsules.
#[test]
fn a_suction_hand_on_its_arm_has_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let arm = arm_to("rail-xarm6-suction", &[-1.57, 0.5, 0.5, 0.0, 1.0, 1.0]);
    let off = compare_under(&gpu, &far(), arm, 1, 180);
    assert_same(&off, 100, 1e-3);
}

/// Robots drive into the wires and posts of a trellis. Rates of its stems have a rounding of 1e-3 rad/s without any contact, and the least change by contacts is 0.08.
#[test]
fn wires_and_posts_have_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let off = compare_substeps(&gpu, &seen(Preset::VTrellis), 2, 200);
    assert_same(&off, 50, 1.5e-2);
}

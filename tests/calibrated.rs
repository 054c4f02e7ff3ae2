//! Worlds of the calibrated presets run.

use std::sync::Arc;

use orchard_robot::RobotModel;
use orchard_spec::{Preset, Spec};
use orchard_world::{Status, World};

/// A dwarf bears its crop, the whole weight of it, at rest and for a second.
#[test]
fn a_dwarf_bears_its_crop() {
    let robot = Arc::new(RobotModel::paper());
    let mut world = World::new(Arc::new(Spec::preset(Preset::Calibrated)), robot.clone(), 1, 0).unwrap();
    let hanging =
        |world: &World| world.fruit().points.iter().filter(|p| world.data().tethered[p.index()]).count();
    let before = hanging(&world);
    // The fewest of the measured trees bore 80.
    assert!(before >= 80, "{before}");
    for _ in 0..60 {
        world.step(&robot.start_command());
    }
    assert_eq!(*world.status(), Status::Running);
    assert!(world.rupture().breaks().is_empty());
    assert!(world.rupture().peak_ratio() < 1.0, "{}", world.rupture().peak_ratio());
    let events = world.drain_events();
    assert_eq!(hanging(&world), before, "{events:?}");
}

#[test]
fn young_and_mature_trees_stand() {
    let robot = Arc::new(RobotModel::paper());
    for preset in [Preset::CalibratedYoung, Preset::CalibratedMature] {
        let mut world = World::new(Arc::new(Spec::preset(preset)), robot.clone(), 1, 0).unwrap();
        for _ in 0..20 {
            world.step(&robot.start_command());
        }
        assert_eq!(*world.status(), Status::Running, "{preset}");
        assert!(world.rupture().breaks().is_empty(), "{preset}");
    }
}

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

/// Trees whose weak twigs a long step of the statics makes overshoot come to rest as well.
#[test]
fn weak_twigs_come_to_rest() {
    let robot = Arc::new(RobotModel::paper());
    for index in [2, 32, 42, 56] {
        let world = World::new(Arc::new(Spec::preset(Preset::Calibrated)), robot.clone(), 1, index);
        assert!(world.is_ok(), "world {index}: {:?}", world.err());
    }
}

/// At rest no two hanging fruit of a cluster preset overlap by more than fruit that grew against each other, and few had to be left out for that.
#[test]
fn fruit_hang_beside_each_other() {
    let robot = Arc::new(RobotModel::paper());
    for index in 0..4 {
        let spec = Spec::preset(Preset::Calibrated);
        let (count, flat) = (spec.fruit.count.get() as usize, spec.fruit.cluster.as_ref().unwrap().flat.si());
        let world = World::new(Arc::new(spec), robot.clone(), 7, index).unwrap();
        let set = world.fruit();
        assert!(set.len() >= count * 9 / 10 && set.len() <= count, "{} of {count}", set.len());
        let p_world = |i: usize| world.data().point_p_world[set.points[i].index()];
        for i in 0..set.len() {
            for j in 0..i {
                let reach = set.fruit[i].radius + set.fruit[j].radius;
                let overlap = 1.0 - (p_world(i) - p_world(j)).norm() / reach;
                assert!(overlap <= flat, "world {index}, fruit {i} and {j}: {overlap}");
            }
        }
    }
}

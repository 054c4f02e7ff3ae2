//! The hot loop allocates nothing once its buffers have grown.
//!
//! Each run is stepped twice from the same state: buffers grow the first time, allocations are counted the second
//! time, on the thread that steps.

use allocation_counter::measure;
use orchard_batch::{Batch, TreeWorld};
use orchard_fruit::Phase;
use orchard_geometry::Vec3;
use orchard_multibody::{StepReport, step};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_treephys::step_settings;
use orchard_world::World;
use std::sync::Arc;

fn world(seed: u64) -> World {
    World::new(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), seed, 0).unwrap()
}

fn hold() -> Command {
    RobotModel::paper().start_command()
}

/// Contacts that press.
fn pressing(report: &StepReport) -> usize {
    report.contacts.iter().filter(|c| c.force_world != Vec3::zeros()).count()
}

/// Substeps of a world's multibody state as it is; gives the allocations of the second time and the most contacts
/// that pressed at once.
fn substeps(world: &World, count: usize) -> (u64, usize) {
    let (model, settings) = (world.model(), step_settings(&world.spec().sim));
    let mut data = world.data().clone();
    let (start, mut report, mut most) = (data.state(), StepReport::default(), 0);
    let mut run = |data: &mut _| {
        for _ in 0..count {
            step(model, data, &settings, &mut report);
            most = most.max(pressing(&report));
        }
    };
    run(&mut data);
    data.restore(model, &start).unwrap();
    let allocations = measure(|| run(&mut data)).count_total;
    (allocations, most)
}

/// A default tree with its fruit, struck at a scaffold.
#[test]
fn a_moving_tree_allocates_nothing() {
    let mut world = world(42);
    let scaffold = world.skeleton().segments.iter().position(|s| s.order == 1).unwrap();
    let dofs = world.model().dofs(world.tree().bodies[scaffold]);
    world.data_mut().v[dofs].fill(1.0);
    assert_eq!(substeps(&world, 180).0, 0);
}

/// All fruit off the stem: it falls, hits the ground and rolls, each fruit a contact.
#[test]
fn many_contacts_allocate_nothing() {
    let mut world = world(42);
    world.data_mut().tethered.fill(false);
    for collider in world.fruit().colliders.clone() {
        world.data_mut().groups[collider.index()] = orchard_world::groups::LOOSE_GROUPS;
    }
    let (allocations, contacts) = substeps(&world, 240);
    assert!(contacts >= 8, "{contacts} contacts at most");
    assert_eq!(allocations, 0);
}

/// Whole frames of a robot that drives through the canopy, with servos, stems and joints watched. A frame in which
/// something breaks or comes off is another matter: groups of colliders change, events are listed (impacts are none here). So is
/// one in which fruit is loose and awake: it fills an engine.
#[test]
fn a_frame_of_a_world_allocates_nothing() {
    let mut spec = Spec::paper();
    spec.fruit.impact_floor = spec.fruit.impact_floor.with_value(100.0).unwrap();
    let mut world = World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 10, 0).unwrap();
    let drive = Command { base_velocity: [1.1, 0.0, 0.0], ..hold() };
    let (start, mut touching) = (world.snapshot(), 0);
    let mut run = |world: &mut World| {
        for _ in 0..600 {
            world.step(&drive);
            touching += usize::from(pressing(world.report()) > 0);
        }
    };
    run(&mut world);
    let events = world.drain_events();
    assert!(events.is_empty(), "the robot broke something: choose another seed: {events:?}");
    world.restore(&start).unwrap();
    assert_eq!(measure(|| run(&mut world)).count_total, 0);
    assert!(touching > 60, "contact in {touching} frames");
}

/// A fruit on the lip of a suction cup, sealed and held, among leaves.
#[test]
fn a_frame_with_a_fruit_on_the_cup_allocates_nothing() {
    let robot = RobotModel::named("rail-xarm6-suction").unwrap();
    let hold = Command { vacuum: 1.0, ..robot.start_command() };
    let mut world = World::new(Arc::new(Spec::paper()), Arc::new(robot), 7, 0).unwrap();
    let (fruit, point) = (0, world.fruit().points[0].index());
    while world.fruit_lives().phase(fruit) == Phase::Hanging {
        world.data_mut().point_force_world[point] = Vec3::z() * 60.0;
        world.step(&hold);
    }
    let cup = world.handle().cup.clone().unwrap();
    let x_world_lip = world.data().x_world_body(world.handle().wrist()) * cup.x_wrist_lip;
    let reach = world.fruit().fruit[fruit].radius + cup.half_thickness - 1e-3;
    let along = (reach * reach - cup.lip_radius * cup.lip_radius).sqrt();
    let data = world.data_mut();
    data.point_force_world[point] = Vec3::zeros();
    data.point_p_world[point] = x_world_lip.transform_point(&Vec3::new(0.0, 0.0, along).into()).coords;
    data.point_v_world[point] = Vec3::zeros();
    let run = |world: &mut World| (0..60).for_each(|_| world.step(&hold));
    run(&mut world);
    assert!(world.is_held(fruit), "the cup holds nothing");
    world.drain_events();
    assert_eq!(measure(|| run(&mut world)).count_total, 0);
    assert!(world.is_held(fruit));
}

/// Fruit that has come to rest costs no allocation again.
#[test]
fn a_frame_with_sleeping_fruit_allocates_nothing() {
    let mut world = world(3);
    let points: Vec<usize> = world.fruit().points[..4].iter().map(|p| p.index()).collect();
    for _ in 0..600 {
        for &point in &points {
            let pull = if world.data().tethered[point] { 60.0 } else { 0.0 };
            world.data_mut().point_force_world[point] = Vec3::new(0.0, 0.0, pull);
        }
        world.step(&hold());
    }
    for i in 0..points.len() {
        assert!(matches!(world.fruit_lives().phase(i), Phase::Asleep(_)), "fruit {i}");
    }
    let hold = hold();
    assert_eq!(measure(|| (0..60).for_each(|_| world.step(&hold))).count_total, 0);
}

/// Trees in lanes, and the same trees in f64, swinging so gently that nothing breaks.
#[test]
fn batches_allocate_nothing() {
    let spec = Arc::new(Spec::paper());
    let mut worlds: Vec<TreeWorld> =
        (0..20).map(|index| TreeWorld::grow(spec.clone(), 7, index).unwrap()).collect();
    for world in &mut worlds {
        world.data_mut().v.fill(0.1);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let mut batch = Batch::new(&worlds).unwrap();
        assert_eq!(batch.step(1), []);
        assert_eq!(measure(|| assert_eq!(batch.step(30), [])).count_total, 0);
        worlds.truncate(2);
        for world in &mut worlds {
            world.step();
            let frames = measure(|| (0..30).for_each(|_| assert_eq!(world.step(), [])));
            assert_eq!(frames.count_total, 0);
        }
    });
}

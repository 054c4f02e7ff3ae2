use crate::World;
use crate::event::WorldEvent;
use orchard_fruit::Phase;
use orchard_geometry::{Pose, Vec3, transform};
use orchard_multibody::forward_kinematics;
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use std::sync::Arc;

/// A world of the suction robot with a fruit off its stem at the lip of the cup, pressed on it by `depth` \[m\] and off its axis by `offset`.
struct Bench {
    world: World,
    command: Command,
    fruit: usize,
}

impl Bench {
    fn new(depth: f64, offset: f64) -> Self {
        let spec = Arc::new(Spec::paper());
        let robot = Arc::new(RobotModel::named("rail-xarm6-suction").unwrap());
        let mut world = World::new(spec, robot.clone(), 7, 0).unwrap();
        let fruit = 0;
        let parts = world.parts.clone();
        let cup = parts.handle.cup.clone().unwrap();
        let point = parts.fruit.points[fruit].index();
        while world.fruit_lives().phase(fruit) == Phase::Hanging {
            world.state.data.point_force_world[point] = Vec3::z() * 60.0;
            world.step(&robot.start_command());
        }
        world.drain_events();
        let data = &mut world.state.data;
        data.point_force_world[point] = Vec3::zeros();
        forward_kinematics(&parts.model, data);
        let x_world_lip = data.x_world_body(parts.handle.wrist()) * cup.x_wrist_lip;
        let reach = parts.fruit.fruit[fruit].radius + cup.half_thickness - depth;
        let along = (reach * reach - cup.lip_radius * cup.lip_radius).sqrt();
        data.point_p_world[point] = transform(&x_world_lip, &Vec3::new(offset, 0.0, along));
        data.point_v_world[point] = Vec3::zeros();
        Self { world, command: Command { vacuum: 1.0, ..robot.start_command() }, fruit }
    }

    fn point(&self) -> usize {
        self.world.parts.fruit.points[self.fruit].index()
    }

    /// Weight of the fruit \[N\], made up so that the fruit floats.
    fn float(&mut self) -> Vec3 {
        let mass = self.world.parts.fruit.fruit[self.fruit].mass;
        Vec3::new(0.0, 0.0, mass * self.world.spec().sim.gravity.si())
    }

    fn axis(&self) -> Vec3 {
        let parts = &self.world.parts;
        let cup = parts.handle.cup.as_ref().unwrap();
        (self.world.state.data.x_world_body(parts.handle.wrist()) * cup.x_wrist_lip).rotation * Vec3::z()
    }

    /// Steps under an external force on the fruit \[N\], given from the axis of the cup.
    fn step(&mut self, force: impl Fn(&Vec3) -> Vec3) {
        let total = self.float() + force(&self.axis());
        let point = self.point();
        self.world.state.data.point_force_world[point] = total;
        self.world.step(&self.command);
        assert_eq!(self.world.state.data.point_force_world[point], total, "the cup takes its force back");
    }

    fn settle(&mut self) {
        for _ in 0..60 {
            self.step(|_| Vec3::zeros());
        }
    }

    fn is_held(&self) -> bool {
        self.world.is_held(self.fruit)
    }

    fn vacuum(&self) -> f64 {
        self.world.state.suction.vacuum
    }

    /// Force that `at` (per newton) brings the fruit off with, raised slowly \[N\].
    fn pull_off(&mut self, at: impl Fn(&Vec3) -> Vec3) -> f64 {
        self.settle();
        let mut force = 0.0;
        while self.is_held() && force < 200.0 {
            force += 0.1;
            self.step(|axis| at(axis) * force);
        }
        force
    }
}

/// Along its axis a cup lets go at pressure times area.
#[test]
fn the_pull_off_force_is_pressure_times_area() {
    let mut bench = Bench::new(1e-3, 0.0);
    bench.settle();
    assert!(bench.is_held());
    let area = bench.world.parts.handle.cup.as_ref().unwrap().area();
    let wanted = bench.vacuum() * area;
    let force = bench.pull_off(|axis| *axis);
    assert!((force / wanted - 1.0).abs() < 0.03, "{force} N, {wanted} N");
}

/// Across the axis a ball rolls over the rim of a rigid ring at F tan a, where sin a is the ring's radius over the distance of its points from
/// the ball's centre. A soft lip lets go sooner, since the seal opens as the ball shifts, but carries several times the fruit's weight.
#[test]
fn across_the_cup_a_fruit_that_is_too_heavy_comes_off() {
    let mut bench = Bench::new(1e-3, 0.0);
    bench.settle();
    let cup = bench.world.parts.handle.cup.clone().unwrap();
    let reach = bench.world.parts.fruit.fruit[0].radius + cup.half_thickness;
    let tangent = cup.lip_radius / (reach * reach - cup.lip_radius * cup.lip_radius).sqrt();
    let limit = bench.vacuum() * cup.area() * tangent;
    let force = bench.pull_off(|axis| axis.cross(&Vec3::y()).normalize());
    let weight = bench.float().norm();
    assert!(force > 3.0 * weight && force < limit, "{force} N, {limit} N");
}

#[test]
fn without_vacuum_nothing_is_held() {
    let mut bench = Bench::new(1e-3, 0.0);
    bench.command.vacuum = 0.0;
    for _ in 0..120 {
        bench.world.step(&bench.command);
    }
    assert!(!bench.is_held());
    let events = bench.world.drain_events();
    assert!(!events.iter().any(|e| matches!(e, WorldEvent::FruitGripped { .. })), "{events:?}");
    assert!(events.iter().any(|e| matches!(e, WorldEvent::FruitDropped { .. })), "{events:?}");
}

#[test]
fn a_sealed_fruit_is_held_against_gravity_until_the_cup_is_vented() {
    let mut bench = Bench::new(1e-3, 0.0);
    for _ in 0..120 {
        bench.world.step(&bench.command);
    }
    assert!(bench.is_held());
    assert!(bench.world.observe().cup_pressure < -7.0e4);
    let gripped = |e: &WorldEvent| matches!(e, WorldEvent::FruitGripped { .. });
    assert!(bench.world.drain_events().iter().any(gripped));
    bench.command.vacuum = 0.0;
    for _ in 0..90 {
        bench.world.step(&bench.command);
    }
    assert!(!bench.is_held());
    assert!(bench.world.drain_events().iter().any(|e| matches!(e, WorldEvent::FruitDropped { .. })));
}

/// A fruit far off the cup's axis leaves a gap, and the vacuum does not rise.
#[test]
fn a_cup_off_centre_does_not_seal() {
    let mut bench = Bench::new(1e-3, 0.016);
    bench.step(|_| Vec3::zeros());
    bench.step(|_| Vec3::zeros());
    assert!(bench.vacuum() < 1.0e4, "{}", bench.vacuum());
}

/// A leaf through the lip leaves its gap at the points that it passes, and the cup reaches less vacuum.
#[test]
fn a_leaf_under_the_lip_weakens_the_seal() {
    let mut clean = Bench::new(1e-3, 0.0);
    clean.settle();
    let mut bench = Bench::new(1e-3, 0.0);
    let mut parts = (*bench.world.parts).clone();
    let cup = parts.handle.cup.clone().unwrap();
    let data = &bench.world.state.data;
    let x_world_lip = data.x_world_body(parts.handle.wrist()) * cup.x_wrist_lip;
    // Flat in the plane of the lip, its tip over the edge.
    let leaf = &mut parts.skeleton.leaves[0];
    // On the trunk, which does not sway.
    leaf.segment = 0;
    let petiole = Vec3::new(-0.5 * cup.lip_radius - leaf.length, 0.0, 0.0);
    let x_world_leaf = x_world_lip * Pose::from_parts(petiole.into(), Default::default());
    leaf.x_segment_leaf = data.x_world_body(parts.tree.bodies[leaf.segment]).inverse() * x_world_leaf;
    bench.world.parts = Arc::new(parts);
    bench.settle();
    assert!(bench.vacuum() < 0.8 * clean.vacuum(), "{} {}", bench.vacuum(), clean.vacuum());
}

#[test]
fn a_snapshot_carries_the_vacuum() {
    let mut bench = Bench::new(1e-3, 0.0);
    for _ in 0..5 {
        bench.world.step(&bench.command);
    }
    let bytes = bench.world.snapshot().to_bytes();
    let mut other = bench.world.clone();
    other.reset();
    other.restore(&crate::snapshot::Snapshot::from_bytes(&bytes).unwrap()).unwrap();
    assert!(other.state.suction.vacuum > 0.0);
    for world in [&mut bench.world, &mut other] {
        for _ in 0..20 {
            world.step(&bench.command);
        }
    }
    assert_eq!(other.snapshot().to_bytes(), bench.world.snapshot().to_bytes());
}

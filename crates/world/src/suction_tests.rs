use crate::World;
use crate::event::WorldEvent;
use crate::touch::Part;
use orchard_fruit::Phase;
use orchard_geometry::{Pose, Rotation, Vec3, transform};
use orchard_multibody::{ContactReport, forward_kinematics};
use orchard_robot::{Command, IkTarget, RobotModel};
use orchard_spec::Spec;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// A world of the suction robot with a fruit off its stem at the lip of the cup, pressed on it by `depth` \[m\] and off its axis by `offset`.
struct Bench {
    world: World,
    command: Command,
    fruit: usize,
}

fn robot() -> Arc<RobotModel> {
    Arc::new(RobotModel::named("rail-xarm6-suction").unwrap())
}

fn world(robot: &Arc<RobotModel>) -> World {
    World::new(Arc::new(Spec::paper()), robot.clone(), 7, 0).unwrap()
}

impl Bench {
    fn new(depth: f64, offset: f64) -> Self {
        let robot = robot();
        Self::on(world(&robot), robot.start_command(), depth, offset)
    }

    /// Puts the fruit in front of the cup where the arm is, while the arm follows a command.
    fn on(mut world: World, command: Command, depth: f64, offset: f64) -> Self {
        let fruit = 0;
        let parts = world.parts.clone();
        let cup = parts.handle.cup.clone().unwrap();
        let point = parts.fruit.points[fruit].index();
        while world.fruit_lives().phase(fruit) == Phase::Hanging {
            world.state.data.point_force_world[point] = Vec3::z() * 60.0;
            world.step(&command);
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
        Self { world, command: Command { vacuum: 1.0, ..command }, fruit }
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

    /// Lays a leaf flat in the plane of the lip, its tip over the edge.
    fn lay_leaf(&mut self) {
        let mut parts = (*self.world.parts).clone();
        let cup = parts.handle.cup.clone().unwrap();
        let data = &self.world.state.data;
        let x_world_lip = data.x_world_body(parts.handle.wrist()) * cup.x_wrist_lip;
        let leaf = &mut parts.skeleton.leaves[0];
        // On the trunk, which does not sway.
        leaf.segment = 0;
        let petiole = Vec3::new(-0.5 * cup.lip_radius - leaf.length, 0.0, 0.0);
        let x_world_leaf = x_world_lip * Pose::from_parts(petiole.into(), Default::default());
        leaf.x_segment_leaf = data.x_world_body(parts.tree.bodies[leaf.segment]).inverse() * x_world_leaf;
        self.world.parts = Arc::new(parts);
    }

    fn settle(&mut self) {
        for _ in 0..60 {
            self.step(|_| Vec3::zeros());
        }
    }

    fn is_held(&self) -> bool {
        self.world.is_held(self.fruit)
    }

    /// True if the cup has lost a seal since the events were last drained.
    fn loses_seals(&mut self) -> bool {
        let fruit = self.fruit;
        let lost = |e: &WorldEvent| matches!(e, WorldEvent::SealLost { fruit: i, .. } if *i == fruit);
        self.world.drain_events().iter().any(lost)
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
    // The lip bears nothing then, and follows the fruit for a moment; pulled on, it loses the seal.
    for _ in 0..30 {
        bench.step(|axis| axis * (1.2 * force));
    }
    assert!(bench.loses_seals(), "it came off with the valve open");
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
    let events = bench.world.drain_events();
    assert!(events.iter().any(|e| matches!(e, WorldEvent::FruitDropped { .. })));
    let lost = |e: &WorldEvent| matches!(e, WorldEvent::SealLost { .. });
    assert!(!events.iter().any(lost), "it was let go on purpose: {events:?}");
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
    bench.lay_leaf();
    bench.settle();
    assert!(bench.vacuum() < 0.8 * clean.vacuum(), "{} {}", bench.vacuum(), clean.vacuum());
}

/// A leaf that a sealed lip is drawn across does not come between lip and fruit, and does once the lip has been lifted.
#[test]
fn no_leaf_gets_under_a_lip_that_is_closed() {
    let mut bench = Bench::new(1e-3, 0.0);
    bench.settle();
    let sealed = bench.vacuum();
    bench.lay_leaf();
    bench.settle();
    assert!((bench.vacuum() - sealed).abs() < 1.0, "{} {sealed}", bench.vacuum());
    // Off the lip for a moment, then back on it.
    let point = bench.point();
    let (axis, p_world) = (bench.axis(), bench.world.state.data.point_p_world[point]);
    bench.world.state.data.point_p_world[point] = p_world + axis * 0.01;
    bench.step(|_| Vec3::zeros());
    bench.world.state.data.point_p_world[point] = p_world;
    bench.world.state.data.point_v_world[point] = Vec3::zeros();
    bench.settle();
    assert!(bench.vacuum() < 0.8 * sealed, "{} {sealed}", bench.vacuum());
}

/// The robot with an edge of its lip pressed on a branch, and the command that holds it there; `None` if the arm does not come to press on the
/// branch.
fn against_branch(world: &World, segment: usize) -> Option<(World, Command)> {
    let (robot, parts) = (world.robot(), world.parts.clone());
    let cup = parts.handle.cup.clone()?;
    let s = &parts.skeleton.segments[segment];
    let x_base_segment = parts.handle.x_world_base(&world.state.data).inverse()
        * world.state.data.x_world_body(parts.tree.bodies[segment]);
    let p_base = transform(&x_base_segment, &Vec3::new(0.0, 0.0, 0.5 * s.length));
    // Level, the branch under the lip's edge to the right; the lip aims beyond the branch's skin.
    let level = Rotation::from_axis_angle(&Vec3::y_axis(), FRAC_PI_2);
    let rotation = level * Rotation::from_axis_angle(&Vec3::z_axis(), PI);
    let p_lip = p_base + Vec3::y() * cup.lip_radius - Vec3::x() * (s.radius + cup.half_thickness - PRESS);
    let pose = Pose::from_parts(p_lip.into(), rotation);
    let arm = robot.kinematics();
    let q = arm.solve(&IkTarget::Pose(pose), &arm.home()).ok()?;
    let command = Command { arm_q: arm.values(&q), ..robot.start_command() };
    let mut world = world.clone();
    for _ in 0..180 {
        world.step(&command);
    }
    let presses = |c: &ContactReport| {
        let pair = [parts.colliders[c.a.index()], parts.colliders[c.b.index()]];
        pair.contains(&Part::Wood)
            && pair.iter().any(|part| matches!(part, Part::Cup(_)))
            && c.force_world != Vec3::zeros()
    };
    world.report().contacts.iter().any(presses).then_some((world, command))
}

/// Depth by which the lip aims beyond the skin of a branch \[m\].
const PRESS: f64 = 0.01;

/// Wood under the edge of the lip keeps it open there: the vacuum stays too low to hold the fruit.
#[test]
fn wood_under_the_lip_prevents_the_seal() {
    let mut clean = Bench::new(1e-3, 0.0);
    clean.settle();
    assert!(clean.is_held());
    let in_reach = |tree| {
        let world = World::new(Arc::new(Spec::paper()), robot(), 7, tree).unwrap();
        (0..world.parts.skeleton.segments.len()).find_map(|i| against_branch(&world, i))
    };
    let (world, command) = (0..8).find_map(in_reach).expect("a branch in reach");
    let mut bench = Bench::on(world, command, 1e-3, 0.0);
    bench.settle();
    assert!(bench.vacuum() < 0.5 * clean.vacuum(), "{} {}", bench.vacuum(), clean.vacuum());
    assert!(!bench.is_held());
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

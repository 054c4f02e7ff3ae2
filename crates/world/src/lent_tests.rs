use std::sync::Arc;

use orchard_fruit::Phase;
use orchard_geometry::{Vec3, transform};
use orchard_multibody::Owner;
use orchard_robot::{Command, RobotModel};
use orchard_spec::{Purpose, Spec, Stream};

use crate::{Moved, Stay, World, WorldEvent};

/// The paper's world on uneven ground.
fn uneven() -> Arc<Spec> {
    let mut spec = Spec::paper();
    spec.terrain = spec.terrain.with_amplitude(0.05).unwrap();
    Arc::new(spec)
}

/// In a frame that may be lent, and in frames that need not be watched, the robot does not press on uneven ground, although set points jump at random and the arm is at its limits.
#[test]
fn a_robot_that_may_touch_uneven_ground_stays_here() {
    let (spec, robot) = (uneven(), Arc::new(RobotModel::named("husky-ur5e-2f85").unwrap()));
    let mut draws = Stream::new(1, 0, Purpose::Test);
    let (mut stayed, mut pressed, mut unwatched) = (0, 0, 0);
    for index in 0..2 {
        let mut world = World::new(spec.clone(), robot.clone(), 20_250_704, index).unwrap();
        // The hand is by the ground.
        let low = [0.0, 1.7, 0.0, -0.5, 0.0, 2.0];
        let mut command = robot.start_command();
        let mut unwatched_until = 0;
        for frame in 0..600 {
            if frame % 12 == 0 {
                for (q, low) in command.arm_q.iter_mut().zip(low) {
                    *q = low + draws.uniform(-1.0, 1.0);
                }
            }
            let stays = world.outlook(&[command]).stays.is_some();
            let ahead = world.outlook(&[command; 6]);
            if !ahead.is_watched {
                unwatched_until = frame + ahead.frames;
            }
            unwatched += u32::from(frame < unwatched_until);
            world.step(&command);
            let model = world.model();
            let is_robots = |id| {
                let collider = model.collider(id);
                matches!(collider.owner, Owner::Body(body) if world.handle().bodies.contains(&body))
            };
            let is_ground = |id| matches!(model.collider(id).owner, Owner::World);
            let presses = world.report().contacts.iter().any(|contact| {
                let pair = [contact.a, contact.b];
                contact.force_world.norm() > 0.0
                    && pair.into_iter().any(is_robots)
                    && pair.into_iter().any(is_ground)
            });
            assert!(stays || !presses, "world {index}, frame {frame}");
            assert!(frame >= unwatched_until || !presses, "world {index}, frame {frame}");
            (stayed, pressed) = (stayed + u32::from(stays), pressed + u32::from(presses));
        }
    }
    assert!(pressed > 10 && stayed < 1150 && unwatched > 50, "{pressed} {stayed} {unwatched}");
}

/// Takes the first fruit off their stems, all in one frame, and puts them somewhere at rest.
fn put(world: &mut World, places: &[Vec3]) {
    let command = world.robot().start_command();
    let points: Vec<usize> = world.fruit().points[..places.len()].iter().map(|p| p.index()).collect();
    while points.iter().any(|&point| world.data().tethered[point]) {
        for &point in &points {
            world.data_mut().point_force_world[point] = Vec3::new(0.0, 0.0, 60.0);
        }
        world.step(&command);
    }
    for (&point, p_world) in points.iter().zip(places) {
        let data = world.data_mut();
        data.point_force_world[point] = Vec3::zeros();
        data.point_p_world[point] = *p_world;
        data.point_v_world[point] = Vec3::zeros();
    }
}

/// A frame with a fruit off its stem may be lent, but not where one in the hand is beside uneven ground or another one.
#[test]
fn a_fruit_off_its_stem_is_lent_where_it_meets_no_other_and_no_uneven_ground() {
    let robot = Arc::new(RobotModel::paper());
    let command = robot.start_command();
    let world = World::new(Arc::new(Spec::paper()), robot.clone(), 3, 0).unwrap();
    let on_bumps = World::new(uneven(), robot, 3, 0).unwrap();
    let stays_in = |world: &World, places: &[Vec3], frames: u32| {
        let mut world = world.clone();
        put(&mut world, places);
        (0..frames).for_each(|_| world.step(&command));
        let phases: Vec<Phase> = (0..places.len()).map(|i| world.fruit_lives().phase(i)).collect();
        (phases, world.outlook(&[command]).stays)
    };
    let stays = |places: &[Vec3], frames: u32| stays_in(&world, places, frames);
    let aloft = Vec3::new(-2.0, 2.0, 1.5);
    let [radius, other] = [0, 1].map(|i| world.fruit().fruit[i].radius);
    assert_eq!(stays(&[aloft], 0), (vec![Phase::InHand], None));
    let low = Vec3::new(aloft.x, aloft.y, radius + 1e-3);
    assert_eq!(stays(&[low], 0), (vec![Phase::InHand], None));
    let height = on_bumps.terrain().unwrap().height(low.x, low.y).unwrap();
    let on_bump = Vec3::new(low.x, low.y, height + low.z);
    assert_eq!(stays_in(&on_bumps, &[on_bump], 0), (vec![Phase::InHand], Some(Stay::Near)));
    let beside = aloft + Vec3::x() * (radius + other + 1e-3);
    assert_eq!(stays(&[aloft, beside], 0), (vec![Phase::InHand; 2], Some(Stay::Near)));
    assert_eq!(stays(&[aloft], 5), (vec![Phase::Free], None));
}

/// Takes a frame in which robot and fruit at the hand move as in another world.
fn take_back_as_in(world: &mut World, other: &World, command: &Command) {
    let lives = world.fruit_lives().clone();
    let points = world.fruit().points.clone();
    world.take_back(command, |_, _, data| {
        let moved = other.data();
        (data.q, data.v) = (moved.q.clone(), moved.v.clone());
        for (i, point) in points.iter().map(|point| point.index()).enumerate() {
            if !matches!(lives.phase(i), Phase::Free | Phase::Asleep(_)) {
                data.point_p_world[point] = moved.point_p_world[point];
                data.point_v_world[point] = moved.point_v_world[point];
                data.point_w_world[point] = moved.point_w_world[point];
            }
        }
        Moved {
            set_points: *other.set_points(),
            suction: *other.suction(),
            contacts: other.report().contacts.clone(),
            impulse: 0.0,
            peak_force: 0.0,
            v_fruit_before: Vec::new(),
            stem_wear: Vec::new(),
        }
    });
}

/// In a frame that was lent, fruit in a bucket that drives, turns and stops, and one that falls into it, move as in the same frame computed here: of the bucket's way through the substeps
/// only the ends are known.
#[test]
fn free_fruit_move_beside_a_robot_that_was_lent() {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let mut world = World::new(spec, robot, 3, 0).unwrap();
    let bucket = world.handle().bucket;
    let place = |x: f64, y: f64, z: f64| {
        let p_base = bucket.p_base + Vec3::new(x, y, z).component_mul(&bucket.half);
        transform(&world.handle().x_world_base(world.data()), &p_base)
    };
    let places = [place(-0.6, -0.5, 0.0), place(0.6, -0.5, 0.5), place(0.0, 0.5, 0.3), place(0.1, -0.4, 3.0)];
    put(&mut world, &places);
    let mut command = world.robot().start_command();
    let (mut free, mut deposited) = (0, 0);
    let (mut off, mut off_by_speed, mut off_by_spin) = (0.0_f64, 0.0_f64, 0.0_f64);
    for frame in 0..240 {
        command.base_velocity = match frame {
            30..90 => [0.6, 0.1, 0.5],
            130..170 => [-0.5, 0.0, -0.4],
            _ => [0.0; 3],
        };
        command.arm_q[0] += 0.004;
        let mut lent = world.clone();
        world.step(&command);
        take_back_as_in(&mut lent, &world, &command);
        let events = [world.drain_events(), lent.drain_events()].map(|events| {
            let is_deposit = |event: &&WorldEvent| matches!(event, WorldEvent::FruitDeposited { .. });
            events.iter().filter(is_deposit).count()
        });
        assert_eq!(events[0], events[1], "frame {frame}");
        deposited += events[0];
        for i in 0..places.len() {
            let phases = [&world, &lent].map(|world| world.fruit_lives().phase(i));
            assert_eq!(phases[0] == Phase::Free, phases[1] == Phase::Free, "fruit {i}, frame {frame}");
            free += usize::from(phases[0] == Phase::Free);
            let point = world.fruit().points[i].index();
            let [a, b] = [world.data(), lent.data()];
            off = off.max((a.point_p_world[point] - b.point_p_world[point]).norm());
            off_by_speed = off_by_speed.max((a.point_v_world[point] - b.point_v_world[point]).norm());
            off_by_spin = off_by_spin.max((a.point_w_world[point] - b.point_w_world[point]).norm());
        }
    }
    assert!(free > 500 && deposited >= 3, "{free} {deposited}");
    assert!(
        off < 5e-6 && off_by_speed < 5e-4 && off_by_spin < 0.05,
        "{off} m, {off_by_speed} m/s, {off_by_spin} rad/s"
    );
}

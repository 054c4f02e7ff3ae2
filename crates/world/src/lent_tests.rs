use std::sync::Arc;

use orchard_fruit::Phase;
use orchard_geometry::Vec3;
use orchard_multibody::Owner;
use orchard_robot::RobotModel;
use orchard_spec::{Purpose, Spec, Stream};

use crate::{Stay, World};

/// In a frame that may be lent, and in frames that need not be watched, the robot presses on nothing but tree and fruit, although set points jump at random and the arm is at its limits.
#[test]
fn a_robot_that_may_touch_itself_or_the_ground_stays_here() {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let mut draws = Stream::new(1, 0, Purpose::Test);
    let (mut stayed, mut pressed, mut unwatched) = (0, 0, 0);
    for index in 0..2 {
        let mut world = World::new(spec.clone(), robot.clone(), 20_250_704, index).unwrap();
        let start = robot.start_command();
        let mut command = start;
        let mut unwatched_until = 0;
        for frame in 0..600 {
            if frame % 12 == 0 {
                for k in 0..command.arm_q.len() {
                    command.arm_q[k] = start.arm_q[k] + draws.uniform(-2.5, 2.5);
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
            let is_trees = |id| world.tree().colliders.contains(&id) || world.fruit().colliders.contains(&id);
            let presses = world.report().contacts.iter().any(|contact| {
                let pair = [contact.a, contact.b];
                contact.force_world.norm() > 0.0
                    && pair.into_iter().any(is_robots)
                    && !pair.into_iter().any(is_trees)
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

/// A frame with a fruit in the hand may be lent, but not beside the ground or another fruit off its stem; one with a fruit out of the hand may not.
#[test]
fn a_fruit_in_the_hand_is_lent_where_it_meets_the_robot_alone() {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let command = robot.start_command();
    let world = World::new(spec, robot, 3, 0).unwrap();
    let stays = |places: &[Vec3], frames: u32| {
        let mut world = world.clone();
        put(&mut world, places);
        (0..frames).for_each(|_| world.step(&command));
        let phases: Vec<Phase> = (0..places.len()).map(|i| world.fruit_lives().phase(i)).collect();
        (phases, world.outlook(&[command]).stays)
    };
    let aloft = Vec3::new(-2.0, 2.0, 1.5);
    let [radius, other] = [0, 1].map(|i| world.fruit().fruit[i].radius);
    assert_eq!(stays(&[aloft], 0), (vec![Phase::InHand], None));
    let low = Vec3::new(aloft.x, aloft.y, radius + 1e-3);
    assert_eq!(stays(&[low], 0), (vec![Phase::InHand], Some(Stay::Near)));
    let beside = aloft + Vec3::x() * (radius + other + 1e-3);
    assert_eq!(stays(&[aloft, beside], 0), (vec![Phase::InHand; 2], Some(Stay::Near)));
    assert_eq!(stays(&[aloft], 5), (vec![Phase::Free], Some(Stay::Loose)));
}

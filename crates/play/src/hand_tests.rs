use super::*;
use crate::FrameDigest;
use crate::grip::{Reach, nearest};
use crate::rules::PlayRules;
use crate::session::Session;
use orchard_geometry::transform;
use orchard_scenario::Scenario;

fn session() -> Session {
    let scenario = Scenario::of(&[]).unwrap();
    let bare = scenario.spec().with_figures("bare", &[("foliage.density", 0.0)]).unwrap();
    Session::new(scenario.with_spec(bare).world(20250704, 0, 0).unwrap(), None)
}

/// Place and direction of a ray from 3 m away at a point.
fn ray_at(p_world: &Vec3) -> (Vec3, Vec3) {
    let along = Vec3::new(0.6, 0.8, 0.0);
    (p_world - along * 3.0, along)
}

/// Grabs the tip of the thinnest twig that a ray meets.
fn grab_twig(session: &mut Session) -> Vec3 {
    let skeleton = session.world().skeleton();
    let mut twigs: Vec<usize> = (0..skeleton.segments.len()).collect();
    twigs.sort_by(|&a, &b| skeleton.segments[a].radius.total_cmp(&skeleton.segments[b].radius));
    for segment in twigs {
        let world = session.world();
        let tip = Vec3::z() * world.skeleton().segments[segment].length;
        let p_tip = transform(world.data().x_world_body(world.tree().bodies[segment]), &tip);
        let (p, along) = ray_at(&p_tip);
        if matches!(Grip::along(world, &p, &along, 0.0, Reach::Tree), Some(Grip::Wood { segment: s, .. }) if s == segment)
        {
            return session.grab(&p, &along, false, Reach::Tree).unwrap();
        }
    }
    panic!("no twig in sight");
}

#[test]
fn nearest_points_of_a_ray_and_a_line() {
    let (a, b) = (Vec3::new(2.0, -1.0, 0.5), Vec3::new(2.0, 1.0, 0.5));
    let (on_ray, on_line) = nearest(&Vec3::zeros(), &Vec3::x(), &a, &b);
    assert!((on_ray - 2.0).abs() < 1e-15 && (on_line - Vec3::new(2.0, 0.0, 0.5)).norm() < 1e-15);
    let (_, end) = nearest(&Vec3::zeros(), &Vec3::x(), &(a + Vec3::y() * 3.0), &(b + Vec3::y() * 3.0));
    assert!((end - (a + Vec3::y() * 3.0)).norm() < 1e-15);
}

#[test]
fn a_ray_grabs_what_it_meets_first_and_nothing_in_the_air() {
    let mut session = session();
    let fruit = session.world().fruit_truth();
    let grabbed = fruit.iter().filter(|apple| {
        let (p, along) = ray_at(&apple.p_world);
        session
            .grab(&p, &along, false, Reach::Tree)
            .is_some_and(|place| (place - apple.p_world).norm() < 1e-12)
    });
    assert!(grabbed.count() * 2 > fruit.len());
    assert!(session.grab(&Vec3::new(0.0, 0.0, 30.0), &Vec3::z(), true, Reach::All).is_none());
    assert!(session.grab(&Vec3::new(0.0, 0.0, 30.0), &Vec3::zeros(), true, Reach::All).is_none());
    assert!(session.told().pull.is_none());
}

/// The pointer rests on a twig of some grams, then moves 10 cm: the twig follows, and comes to rest where the wood's force is the spring's.
#[test]
fn a_twig_follows_the_pointer_and_comes_to_rest() {
    let mut session = session();
    let place = grab_twig(&mut session);
    let target = place + Vec3::new(0.0, 0.0, -0.05);
    session.pull_to(&target);
    let mut last = Vec3::zeros();
    for frame in 0..240 {
        session.step();
        let pull = session.told().pull.unwrap();
        let p = Vec3::from(pull.p_world);
        assert!((p - target).norm() < 0.06, "frame {frame}: it swings {p}");
        if frame > 230 {
            assert!((p - last).norm() < 1e-4, "frame {frame}: it moves {}", (p - last).norm());
            let spring = PlayRules::v1().hand.stiffness.si() * (target - p).norm();
            assert!((pull.force - spring).abs() < 0.05 * spring.max(0.1), "{} {spring}", pull.force);
        }
        last = p;
    }
    assert_eq!(session.told().snapped, 0);
}

/// Pulled as far as the room allows, wood snaps, and the hand lets go of what has broken.
#[test]
fn a_branch_snaps_and_the_hand_lets_go() {
    let mut session = session();
    let place = grab_twig(&mut session);
    let mut frames = 0;
    while session.told().pull.is_some() {
        frames += 1;
        session.pull_to(&(place + Vec3::new(0.0, 0.0, -0.01 * f64::from(frames))));
        session.step();
        let told = session.told();
        assert!(told.fault.is_none() && frames < 600, "{told:?}");
        let force = told.pull.map_or(0.0, |pull| pull.force);
        assert!(force <= PlayRules::v1().hand.largest_force.si() * (1.0 + 1e-12));
    }
    assert!(session.told().snapped > 0);
    (0..60).for_each(|_| session.step());
    assert!(session.told().fault.is_none());
}

#[test]
fn a_pulled_apple_comes_off_its_stem() {
    let mut session = session();
    let fruit = session.world().fruit_truth();
    let (apple, place) = fruit
        .iter()
        .enumerate()
        .find_map(|(k, apple)| {
            let (p, along) = ray_at(&apple.p_world);
            let grip = Grip::along(session.world(), &p, &along, 0.0, Reach::Tree)?;
            (grip == Grip::Fruit { fruit: k })
                .then(|| session.grab(&p, &along, false, Reach::Tree).map(|place| (k, place)))?
        })
        .unwrap();
    session.pull_to(&(place + Vec3::new(0.0, 0.0, -1.0)));
    let frames = (0..300).take_while(|_| {
        session.step();
        session.told().pull.is_some()
    });
    assert!(frames.count() < 299);
    assert!(!session.world().data().tethered[session.world().fruit().points[apple].index()]);
}

/// A grip that was let go leaves no force behind; a hand that never pulled leaves every bit.
#[test]
fn an_empty_hand_leaves_every_bit() {
    let digests = |grabs: bool| -> Vec<FrameDigest> {
        let mut session = session();
        if grabs {
            grab_twig(&mut session);
            session.release();
        }
        (0..10).map(|_| session.step_watched()).collect()
    };
    assert_eq!(digests(true), digests(false));
    let mut session = session();
    grab_twig(&mut session);
    session.pull_to(&Vec3::new(f64::NAN, 0.0, 0.0));
    (0..10).for_each(|_| session.step());
    let data = session.world().data();
    let forces = data.body_force_world.iter().chain(&data.body_torque_world).chain(&data.point_force_world);
    assert!(session.told().fault.is_none() && forces.clone().all(|force| *force == Vec3::zeros()));
}

/// Pulled sideways at its chassis, the robot gives way, and comes to rest again when the hand lets go.
#[test]
fn the_robot_can_be_pulled_and_stays_finite() {
    let mut session = session();
    let base = session.world().handle().x_world_base(session.world().data()).translation.vector;
    let p = base + Vec3::new(0.0, 0.0, 5.0);
    assert!(
        session
            .grab(&p, &-Vec3::z(), false, Reach::Tree)
            .is_none_or(|place| (place - base).xy().norm() > 0.1)
    );
    let place = session.grab(&p, &-Vec3::z(), false, Reach::All).unwrap();
    assert!((place - base).xy().norm() < 0.01 && place.z > 0.05, "{place}");
    for _ in 0..120 {
        session.pull_to(&(place + Vec3::new(0.0, 2.0, 0.0)));
        session.step();
    }
    let force = session.told().pull.unwrap().force;
    assert!(force > 10.0 && force <= PlayRules::v1().hand.largest_force.si() * (1.0 + 1e-12), "{force}");
    let pulled = session.world().handle().x_world_base(session.world().data()).translation.vector;
    session.release();
    (0..120).for_each(|_| session.step());
    assert!(session.told().fault.is_none());
    println!("pulled by {force} N: {}", pulled - base);
}

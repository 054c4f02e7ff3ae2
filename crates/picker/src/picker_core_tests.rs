use super::*;
use crate::expert::ExpertConfig;
use orchard_perception::Sighting;
use orchard_robot::RobotModel;

fn core(robot: &str) -> PickerCore {
    let robot = RobotModel::named(robot).expect("built in");
    let config = ExpertConfig::preset().tuned(&robot).expect("in range").shared;
    PickerCore::new(&robot, DetectorConfig::paper(), config, State::Scan)
}

/// A cup draws from some way before the fruit's skin on, which lies before the goal by the overshoot; fingers never do.
#[test]
fn a_cup_draws_before_it_touches() {
    let cup = core("rail-xarm6-suction");
    let skin = cup.config.approach.overshoot.si();
    let draw = cup.config.suction.draw.si();
    assert!(draw > 0.0 && !cup.touches_down(skin + draw + 1e-3) && cup.touches_down(skin + draw - 1e-3));
    assert!(!core("ridgeback-fr3").touches_down(0.0));
}

/// A rail that accelerates under the arm presses on nothing.
#[test]
fn the_rails_acceleration_is_no_force_at_the_hand() {
    let mut core = core("rail-xarm6-suction");
    let (q, change) = (core.arm.home(), 0.8);
    let felt = Vec3::new(0.0, -change, -core.config.pull.gravity.si());
    let robot = RobotState {
        dt: 1.0 / 60.0,
        q,
        torque: core.arm.gravity_torque(&q, &felt),
        base_acceleration: [0.0, change, 0.0],
        ..RobotState::still(1.0)
    };
    assert!(core.tcp_force(&robot).norm() < 1e-6, "{}", core.tcp_force(&robot));
    core.config.sensors.base_motion = false;
    // Without the base's motion the arm's own inertia looks like a push along the rail.
    assert!(core.tcp_force(&robot).y.abs() > 0.1, "{}", core.tcp_force(&robot));
}

/// An arm whose joint sensors have an offset between the limits of an arm that has arrived and one that is held settles once it has rested for the patience; one that still
/// moves does not.
#[test]
fn an_arm_with_an_offset_settles() {
    let mut core = core("ridgeback-fr3");
    let c = &core.config.arm;
    let offset = 0.5 * (c.arrived.si() + c.stall_error.si());
    let moves = 2.0 * c.stall_speed.si();
    let dt = 1.0 / 60.0;
    let mut robot = RobotState { dt, q: core.arm.home(), ..RobotState::still(0.0) };
    robot.q[0] += offset;
    let frames = (core.patience() / dt).ceil() as u32;
    for (v, settles) in [(moves, false), (0.0, true)] {
        robot.v[0] = v;
        for frame in 0..frames + 2 {
            assert!(!core.arm_settled(&robot) || (settles && frame >= frames), "{v} {frame}");
            core.watch_arm(&robot);
        }
        assert_eq!(core.arm_settled(&robot), settles);
        assert!(!core.arm_arrived(&robot) && !core.arm_stalled());
    }
}

/// A track within 1.5 radii of the target is not counted as a neighbour. A track farther off is, also if it carries the target's number.
#[test]
fn a_target_is_no_neighbour_of_its_own() {
    let target = Target { p: Vec3::new(1.0, 0.0, 1.0), radius: 0.03 };
    for (own, ghost, neighbours) in [(0.0, 0.04, 0), (0.0, 0.062, 1), (0.062, 0.0, 1), (0.04, 0.062, 1)] {
        let mut core = core("ridgeback-fr3");
        let at = |y: f64| Sighting { p_odom: target.p + Vec3::y() * y, radius: 0.03, score: 1.0 };
        core.perception.tracker.update(0.0, &[at(own), at(ghost)]);
        let tracks = core.perception.tracker.tracks();
        let own_id = tracks.iter().find(|t| t.p_odom == at(own).p_odom).expect("seen").id;
        let others = core.others(own_id, &target, &Pose::identity());
        assert_eq!(others.len(), neighbours, "own {own} other {ghost}");
        assert!(others.iter().all(|other| (other.p - target.p).norm() > 0.06));
    }
    // A track that has moved with its fruit stays the target's if nothing is seen where that was.
    let mut core = core("ridgeback-fr3");
    core.perception
        .tracker
        .update(0.0, &[Sighting { p_odom: target.p + Vec3::y() * 0.07, radius: 0.03, score: 1.0 }]);
    let own = core.perception.tracker.tracks()[0].id;
    assert!(core.others(own, &target, &Pose::identity()).is_empty());
}

/// Of two fruit at the same distance on both sides the expert takes the one of which the detector is sure, the baseline the same in both cases.
#[test]
fn sure_fruit_come_first() {
    for (config, follows) in [(ExpertConfig::preset().shared, true), (PickerConfig::baseline(), false)] {
        let chosen = [(0.95, 0.45), (0.45, 0.95)].map(|(left, right)| {
            let robot = RobotModel::paper();
            let config = config.tuned(&robot).expect("in range");
            let mut core = PickerCore::new(&robot, DetectorConfig::paper(), config, State::Scan);
            let tree = core.perception.belief.p_odom();
            let at =
                |y: f64, score: f64| Sighting { p_odom: tree + Vec3::new(-0.4, y, 1.0), radius: 0.03, score };
            for image in 0..4 {
                core.perception.tracker.update(0.2 * f64::from(image), &[at(0.5, left), at(-0.5, right)]);
            }
            let choice = core.choose(&RobotState::still(1.0)).expect("within reach");
            choice.target.p.y > 0.0
        });
        assert_eq!(chosen[0] != chosen[1], follows, "{chosen:?}");
        assert!(!follows || chosen[0]);
    }
}

/// The arm stays where it is until the first image has come.
#[test]
fn the_arm_waits_for_the_first_image() {
    let mut core = core("ridgeback-fr3");
    let mut scan = crate::scan::Scan::at_start();
    let robot = RobotState { q: *core.motion.q(), dt: 1.0 / 60.0, ..RobotState::still(0.0) };
    core.motion = crate::motion::ArmMotion::new(core.arm.home() + JointVector::repeat(0.1));
    let start = *core.motion.goal();
    core.look_around(&mut scan, &robot);
    assert_eq!(*core.motion.goal(), start);
    core.perception.images = 1;
    core.look_around(&mut scan, &robot);
    assert_ne!(*core.motion.goal(), start);
}

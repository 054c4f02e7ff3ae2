use super::*;
use crate::expert::ExpertConfig;
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

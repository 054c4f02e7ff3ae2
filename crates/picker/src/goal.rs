//! Component tasks: a controller is given a fruit to hold or a point to reach.

use crate::plan::Target;
use crate::task::{AssignedTask, GoalConfig, PushTask};
use crate::{BaselinePicker, Controller, ExpertConfig, ExpertPicker, Kind};
use orchard_geometry::Vec3;
use orchard_perception::DetectorConfig;
use orchard_robot::RobotModel;

/// Goal of a component task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Hold the fruit at a position between the fingers.
    Grasp {
        /// Centre of the fruit, with the error of a detector, odom \[m\].
        p_odom: Vec3,
        /// Radius of the fruit, with the error of a detector \[m\].
        radius: f64,
    },
    /// Bring the point between the finger pads to a position from a given side and hold it there.
    Reach {
        /// Position, odom \[m\].
        p_odom: Vec3,
        /// Horizontal direction from the base's stand-off to the position, from the x axis of odom \[rad\].
        heading_odom: f64,
    },
}

/// Makes the controller of a component task. Every controller pushes to a point with the baseline's state machine; `expert` takes the
/// direction with the fewest seen points, slows and yields by the force at the hand, and tries detours.
pub(crate) fn controller(
    kind: Kind,
    goal: &Goal,
    robot: &RobotModel,
    detector: DetectorConfig,
) -> Box<dyn Controller> {
    let goals = GoalConfig::paper();
    let task = match *goal {
        Goal::Grasp { p_odom, radius } => AssignedTask { target: Target { p: p_odom, radius }, push: None },
        Goal::Reach { p_odom, heading_odom } => {
            let compliance = (kind == Kind::Expert).then_some(goals.compliance);
            let push = PushTask { heading_odom, rules: goals.push, compliance };
            AssignedTask { target: Target { p: p_odom, radius: 0.0 }, push: Some(push) }
        }
    };
    match (kind, goal) {
        (Kind::Expert, Goal::Grasp { .. }) => {
            Box::new(ExpertPicker::with_task(robot, detector, ExpertConfig::preset(), task))
        }
        _ => Box::new(BaselinePicker::with_task(robot, detector, kind.picker_config(), task)),
    }
}

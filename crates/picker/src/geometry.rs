//! Figures of the pickers' configs that follow from a robot's geometry.
//!
//! The configs hold sizes for the paper's robot. Another robot gets them shifted by what its own shapes and link lengths differ from those,
//! so that a robot with the same hand keeps the same figures, bit for bit. Figures of the robot's own config (`[tuning.picker]`) come on top.

use crate::config::PickerConfig;
use orchard_quantity::Quantity;
use orchard_robot::{BaseJoint, RobotModel};

/// Sizes of a robot that the config depends on \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Geometry {
    /// Farthest extent of hand and fingers from the approach axis, along the hand's x and y.
    hand_half: [f64; 2],
    /// Farthest extent of hand and fingers beyond the tool point.
    tip: f64,
    /// Distance from the hand's frame to the tool point along the approach.
    hand_length: f64,
    /// Farthest extent of chassis and bucket from the base's origin, along x and y.
    body_half: [f64; 2],
    /// Distance of the shoulder ahead of the base's origin.
    shoulder_x: f64,
    /// Length of the arm from its second joint to the tool point.
    arm_length: f64,
}

impl Geometry {
    fn of(robot: &RobotModel) -> Self {
        let arm = robot.kinematics();
        let hand = arm.hand_box();
        let farthest = |low: f64, high: f64| low.abs().max(high.abs());
        let lip = arm.cup().map_or(f64::NEG_INFINITY, |cup| cup.half_thickness);
        let footprint = robot.footprint();
        let body = |k: usize| footprint.iter().map(|p| p[k].abs()).fold(0.0, f64::max);
        Self {
            hand_half: [0, 1].map(|k| farthest(hand.min[k], hand.max[k])),
            tip: hand.max.z.max(lip),
            hand_length: arm.hand_length(),
            body_half: [body(0), body(1)],
            shoulder_x: arm.shoulder().x,
            arm_length: arm.length(),
        }
    }
}

impl PickerConfig {
    /// Returns the config for a robot's geometry. A size beyond its range stays as it is.
    pub(crate) fn fitted(&self, robot: &RobotModel) -> Self {
        let (own, usual) = (Geometry::of(robot), Geometry::of(&RobotModel::paper()));
        let mut config = self.clone();
        let approach = &mut config.approach;
        shift(&mut approach.sweep_half_x, own.hand_half[0] - usual.hand_half[0]);
        shift(&mut approach.sweep_half_y, own.hand_half[1] - usual.hand_half[1]);
        shift(&mut approach.sweep_tip, own.tip - usual.tip);
        shift(&mut approach.hand_length, own.hand_length - usual.hand_length);
        shift(&mut approach.sweep_length, own.hand_length - usual.hand_length);
        // Only a base that drives chooses where to stand.
        if matches!(robot.base_joint(), BaseJoint::Planar(_)) {
            let align = &mut config.align;
            shift(&mut align.body_half_x, own.body_half[0] - usual.body_half[0]);
            shift(&mut align.body_half_y, own.body_half[1] - usual.body_half[1]);
            let longer = own.arm_length / usual.arm_length - 1.0;
            for standoff in &mut align.standoffs {
                let of_arm = standoff.si() - usual.shoulder_x;
                shift(standoff, own.shoulder_x - usual.shoulder_x + of_arm * longer);
            }
        }
        config
    }
}

/// Adds a difference \[m\] to a length that is given in metres.
fn shift(length: &mut Quantity, difference: f64) {
    if difference != 0.0
        && let Ok(shifted) = length.with_value(length.value() + difference)
    {
        *length = shifted;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_with_the_papers_hand_keep_its_figures() {
        let config = PickerConfig::baseline();
        for name in [RobotModel::PAPER, "fr3-fixed"] {
            assert_eq!(config.fitted(&RobotModel::named(name).unwrap()), config, "{name}");
        }
    }

    /// The holder has a radius of 35 mm and is 0.14 m long; the Franka hand is 0.1034 m long and much wider along its fingers.
    #[test]
    fn another_hand_changes_the_volume_that_is_swept() {
        let (config, robot) = (PickerConfig::baseline(), RobotModel::named("rail-xarm6-suction").unwrap());
        let (before, after) = (&config.approach, &config.fitted(&robot).approach);
        let longer = after.hand_length.si() - before.hand_length.si();
        assert!((longer - (0.14 - 0.1034)).abs() < 1e-9, "{longer}");
        assert!(after.sweep_half_y.si() < before.sweep_half_y.si() - 0.05, "{}", after.sweep_half_y.si());
        assert_eq!(config.fitted(&robot).align, config.align);
    }

    /// A longer arm on the paper's base stands off in proportion, counted from the shoulder.
    #[test]
    fn a_longer_arm_stands_farther_off() {
        let paper = RobotModel::paper();
        let urdf = paper.urdf().replace("xyz=\"0 -0.316 0\"", "xyz=\"0 -0.416 0\"");
        let longer = RobotModel::from_urdf(&urdf, paper.config()).unwrap();
        let ratio = longer.kinematics().length() / paper.kinematics().length();
        assert!(ratio > 1.05, "{ratio}");
        let config = PickerConfig::baseline();
        let fitted = config.fitted(&longer);
        assert_eq!(fitted.approach, config.approach);
        for (before, after) in config.align.standoffs.iter().zip(&fitted.align.standoffs) {
            let expected = 0.15 + (before.si() - 0.15) * ratio;
            assert!((after.si() - expected).abs() < 1e-9, "{} {expected}", after.si());
        }
    }
}

//! Component tasks: a controller is given a fruit to hold or a point to reach.

use orchard_geometry::Vec3;

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

//! Wood: density, stiffness, damping, drag and rupture.

use orchard_quantity::{Count, Quantity};
use serde::{Deserialize, Serialize};

/// Material of the branches and how they break.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WoodSpec {
    /// Green density.
    pub density: Quantity,
    /// Young's modulus E.
    pub youngs_modulus: Quantity,
    /// Modulus of rupture, sigma_r.
    pub rupture_stress: Quantity,
    /// Stiffness-proportional damping, Kd = c_d Kp.
    pub damping_time: Quantity,
    /// Least joint stiffness.
    pub stiffness_min: Quantity,
    /// Largest joint stiffness.
    pub stiffness_max: Quantity,
    /// Velocity-proportional drag of a link's translation, c_v.
    pub linear_drag: Quantity,
    /// Velocity-proportional drag of a link's rotation, c_omega.
    pub angular_drag: Quantity,
    /// Friction coefficient of bark.
    pub friction: Quantity,
    /// Frames in a row over the rupture moment before a joint breaks.
    pub rupture_frames: Count,
    /// Factor on linear drag of a broken sub-tree.
    pub broken_linear_drag_scale: Quantity,
    /// Factor on angular drag of a broken sub-tree.
    pub broken_angular_drag_scale: Quantity,
    /// Friction moment at the break over the sub-tree's gravity moment.
    pub broken_friction_ratio: Quantity,
    /// Factor that the friction reaches at the end of its ramp.
    pub broken_friction_ramp: Quantity,
    /// Length of the ramp.
    pub broken_friction_ramp_time: Quantity,
    /// Residual damping of a broken joint over the sub-tree's inertia about it.
    pub broken_residual_damping: Quantity,
    /// Largest residual damping of a broken joint.
    pub broken_residual_damping_max: Quantity,
    /// Rate of a broken joint at which its brake reaches `broken_rate_brake`.
    pub broken_rate_limit: Quantity,
    /// Decay rate that the brake imposes at the rate limit; it goes with the fourth power of the rate.
    pub broken_rate_brake: Quantity,
    /// Rate below which joint friction acts as a viscous damper.
    pub friction_regularisation: Quantity,
}

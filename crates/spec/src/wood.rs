//! Wood: density, stiffness, damping, drag and rupture.

use orchard_quantity::{Count, Quantity};
use serde::{Deserialize, Serialize};

/// Law of the stiffness of the joint at a segment's base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JointLaw {
    /// E I / l of the segment at every joint: the paper's law. Overstates deflection, by 32 % at 5 links.
    Paper,
    /// Bending of half a segment on either side of the joint; of the segment's own half alone at a branch root.
    Corrected,
    /// `per_level_stiffness * exp(-per_level_decay * order)`, independent of the section: the paper's second law.
    PerLevel,
}

/// Limits on applied forces that keep a light, freed body from being flung; no limit acts on a body at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RailsSpec {
    /// Speed that one substep of an applied force may reach, and above which the brake acts.
    pub speed_limit: Quantity,
    /// Angular speed that one substep of an applied moment may reach, and above which the brake acts.
    pub spin_limit: Quantity,
    /// Decay rate of the speed above the limit.
    pub brake: Quantity,
    /// Speed at which the part of a force along the velocity begins to fade; it is gone at the limit.
    pub fade_speed: Quantity,
    /// Angular speed at which the part of a moment along the angular velocity begins to fade; it is gone at the limit.
    pub fade_spin: Quantity,
}

/// Material and rupture of branches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WoodSpec {
    /// Green density.
    pub density: Quantity,
    /// Young's modulus E.
    pub youngs_modulus: Quantity,
    /// Modulus of rupture, sigma_r.
    pub rupture_stress: Quantity,
    /// Law of the joints' stiffness.
    pub joint_law: JointLaw,
    /// Rigid mode: every joint is a weld, and nothing bends or breaks.
    pub rigid: bool,
    /// Stiffness of a joint of branch order 0 under the per-level law.
    pub per_level_stiffness: Quantity,
    /// Exponent by which the per-level stiffness falls with each branch order.
    pub per_level_decay: Quantity,
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
    /// Contact stiffness of a limb across the grain.
    pub contact_stiffness: Quantity,
    /// Consecutive frames above the rupture moment before a joint breaks.
    pub rupture_frames: Count,
    /// Factor on linear drag of a broken sub-tree.
    pub broken_linear_drag_scale: Quantity,
    /// Factor on angular drag of a broken sub-tree.
    pub broken_angular_drag_scale: Quantity,
    /// Friction moment at the break over the sub-tree's gravity moment.
    pub broken_friction_ratio: Quantity,
    /// Factor that the friction reaches at the end of its ramp.
    pub broken_friction_ramp: Quantity,
    /// Duration of the ramp.
    pub broken_friction_ramp_time: Quantity,
    /// Residual damping of a broken joint over the sub-tree's inertia about it.
    pub broken_residual_damping: Quantity,
    /// Largest residual damping of a broken joint.
    pub broken_residual_damping_max: Quantity,
    /// Rate of a broken joint at which its brake reaches `broken_rate_brake`.
    pub broken_rate_limit: Quantity,
    /// Decay rate that the brake imposes at the rate limit; it grows with the fourth power of the rate.
    pub broken_rate_brake: Quantity,
    /// Rate below which joint friction acts as a viscous damper.
    pub friction_regularisation: Quantity,
    /// Rails on applied forces.
    pub rails: RailsSpec,
}

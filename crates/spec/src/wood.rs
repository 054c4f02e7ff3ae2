//! Wood: density, stiffness, damping, drag and rupture.

use orchard_quantity::{Count, Normal, Quantity, Span};
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

/// Damping by the share of critical damping of a limb's sway, in place of `damping_time`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModalDampingSpec {
    /// Damping ratio of a limb without leaves.
    pub ratio: Quantity,
    /// Damping ratio of a limb that bears a leaf anywhere.
    pub ratio_in_leaf: Quantity,
}

/// Young wood: thickness stands for age, which a skeleton does not tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YoungWoodSpec {
    /// Young's modulus of the shoots of a season.
    pub youngs_modulus: Quantity,
    /// Rupture stress of the shoots of a season.
    pub rupture_stress: Quantity,
    /// Diameters up to which wood is a season's shoot, and from which it is mature; modulus and strength change evenly between them.
    pub diameter: Span,
}

/// Scatter of the wood: factors on the means.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScatterSpec {
    /// Green density of a segment over the mean.
    pub density: Normal,
    /// Young's modulus of a tree over the mean.
    pub modulus_tree: Normal,
    /// Young's modulus of a segment over its tree's.
    pub modulus: Normal,
    /// Rupture stress of a tree over the mean.
    pub rupture_tree: Normal,
    /// Rupture stress of a segment over its tree's.
    pub rupture: Normal,
    /// Largest share of its rupture moment that a joint bears at rest. A joint that was drawn weaker gets the strength that its tree shows by
    /// standing with its crop.
    pub rest_load: Quantity,
}

/// Strength of the union between a branch and the wood that bears it, over that of the branch's own section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnionSpec {
    /// Aspect ratio, the branch's diameter over that of the wood that bears it, up to which the union is as strong as the branch.
    pub codominant: Quantity,
    /// Strength of the union of two equal stems; it falls evenly to this from the aspect ratio `codominant` to 1, and no further.
    pub equal_stems: Quantity,
}

impl UnionSpec {
    /// Strength of a union at an aspect ratio, over that of the branch's section: 1 up to `codominant`.
    pub fn strength(&self, aspect: f64) -> f64 {
        let (onset, least) = (self.codominant.si(), self.equal_stems.si());
        if aspect <= onset {
            return 1.0;
        }
        let part = if onset < 1.0 { ((aspect - onset) / (1.0 - onset)).min(1.0) } else { 1.0 };
        1.0 - (1.0 - least) * part
    }
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
    /// Damping by modal ratios; absent for that of `damping_time`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modal_damping: Option<ModalDampingSpec>,
    /// Softness of young wood; absent for one modulus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub young: Option<YoungWoodSpec>,
    /// Scatter from tree to tree and along a tree; absent for uniform wood.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<ScatterSpec>,
    /// Strength of branch unions; absent where only sections break.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub union: Option<UnionSpec>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_union_is_as_strong_as_its_branch_until_the_stems_are_nearly_equal() {
        let text = "codominant = { value = 0.7, range = [0, 1], unit = '1', source = 'x' }\n\
                    equal_stems = { value = 0.74, range = [0, 1], unit = '1', source = 'x' }";
        let union: UnionSpec = orchard_quantity::from_toml("x", text).unwrap();
        for (aspect, strength) in [(0.0, 1.0), (0.7, 1.0), (0.85, 0.87), (1.0, 0.74), (1.4, 0.74)] {
            assert!((union.strength(aspect) - strength).abs() < 1e-12, "{aspect}");
        }
    }
}

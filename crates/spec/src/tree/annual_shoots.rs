//! Parameters of the grammar of annual shoots.

use orchard_quantity::{Count, Normal, Quantity, Span};
use serde::{Deserialize, Serialize};

/// Apple tree of annual shoots (growth units): a leader that makes one shoot a season, limbs and laterals on
/// its phyllotactic spiral. Distributions marked "a tree" are drawn once a tree, the others at every use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnnualShootsSpec {
    /// Diameter of the trunk's first link, a tree. It replaces `tree.trunk_radius`.
    pub trunk_diameter: Normal,
    /// Length of the leader on a trunk of the mean diameter, a tree. It replaces `tree.height`.
    pub leader_length: Normal,
    /// Exponent by which the leader's length follows the trunk's diameter.
    pub leader_exponent: Quantity,
    /// Relative lengths of the leader's shoots, one a season. The tree is as many seasons old.
    pub leader_shoots: Vec<Normal>,
    /// Factor on the number of laterals, a tree.
    pub vigour: Normal,
    /// Length of bare trunk below the lowest branch, a tree.
    pub bare_trunk: Normal,
    /// Part of the leader's length above which no limb grows.
    pub limb_zone: Quantity,
    /// Number of limbs on the leader, a tree.
    pub limbs: Normal,
    /// Number of tiers (heights at which several limbs stand), a tree.
    pub limb_tiers: Normal,
    /// Length of a limb's first shoot on a trunk of the mean diameter.
    pub limb_shoot: Normal,
    /// Exponent by which the limb's first shoot follows the trunk's diameter.
    pub limb_exponent: Quantity,
    /// Length of a limb's first shoot over that of a limb a season older.
    pub limb_gradient: Quantity,
    /// Length of a limb's shoot over that of the season before.
    pub limb_decay: Normal,
    /// Chance that a limb's shoot ends in a fork.
    pub fork_chance: Quantity,
    /// Length of a fork's first shoot over that of the shoot it ends.
    pub fork_ratio: Normal,
    /// Angle between the leader and a branch on it.
    pub branch_angle: Normal,
    /// Angle between another axis and a branch on it.
    pub lateral_angle: Normal,
    /// Roll from one node to the next.
    pub divergence: Normal,
    /// Chance that a node bears no lateral.
    pub blind_nodes: Quantity,
    /// Distance between the nodes of the leader at vigour 1.
    pub leader_nodes: Normal,
    /// Distance between the nodes of a limb at vigour 1.
    pub limb_nodes: Normal,
    /// Distance between the nodes of a lateral at vigour 1.
    pub lateral_nodes: Normal,
    /// Seasons for which laterals stay on a tree before they are pruned away.
    pub lateral_seasons: Count,
    /// Length classes of a lateral's first shoot.
    pub first_shoot: ClassWeights,
    /// Length classes of a lateral's later shoots.
    pub later_shoot: ClassWeights,
    /// Chance that a lateral makes a shoot in a season after its first.
    pub persistence: Quantity,
    /// Relative number of pipes that were cut off at the tip of leader or limb.
    pub cut_tip: Normal,
    /// Pipes of shed branches a metre of leader or limb, in the unit of `cut_tip`.
    pub scars: Quantity,
    /// Largest part of living tips among the pipes at an axis' base; on an axis with more tips they are thinner than
    /// `tree.tip_radius`.
    pub tip_share: Quantity,
    /// Length of a short shoot.
    pub short_shoot: Normal,
    /// Length of a medium shoot.
    pub medium_shoot: Normal,
    /// Length of a long shoot.
    pub long_shoot: Normal,
    /// Chance that a lateral's first shoot ends in an inflorescence.
    pub floral_first: Quantity,
    /// Chance that a lateral's later shoot ends in an inflorescence.
    pub floral_later: Quantity,
    /// Bend of a branch's shoot towards the ground (negative: away from it).
    pub droop: Normal,
    /// Largest random bend between two shoots.
    pub wobble: Quantity,
    /// Number of branch orders, the leader's order 0 included.
    pub branch_orders: Count,
    /// Most growth units of a tree; buds beyond it stay dormant.
    pub growth_units_max: Count,
    /// Lengths of simulated links: shorter branches are spurs on a link, longer pieces are cut.
    pub link_length: Span,
    /// Distance between fruit sites along wood that bears them.
    pub fruit_site_spacing: Quantity,
    /// Length of the stubs on which fruit sites stand off limbs.
    pub fruit_stub: Quantity,
    /// Number of fruit sites along a limb over the cross-section of its base: a slender limb bears fruit near its base only.
    pub fruit_per_area: Quantity,
    /// Length of a lateral, from its base, that bears fruit.
    pub fruit_reach: Quantity,
    /// Size of the tree's parts by the trunk's diameter and by their lengths.
    pub allometry: Allometry,
}

/// Laws by which thickness, number, length and angle of branches follow the trunk's diameter and the branches' lengths.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Allometry {
    /// Thickness of limbs.
    pub limb: Thickness,
    /// Thickness of laterals.
    pub lateral: Thickness,
    /// Branch orders whose axes have a base of their own, from 1 on; the pipes of such an axis give the diameters of higher orders on it.
    pub own_bases: Count,
    /// Exponent by which the leader tapers: its diameter above the tip's follows the limbs and the length that are left.
    pub leader_taper: Quantity,
    /// Part of the leader's taper that stands at its limbs, by their lengths.
    pub leader_pipes: Quantity,
    /// Angle that all branches on the leader of a tree have more than others, a tree.
    pub tree_angle: Normal,
    /// Change of a branch's angle from one that is ten times as short; a branch of 10 cm keeps its angle.
    pub angle_by_length: Quantity,
    /// Exponent by which the number of limbs follows the trunk's diameter.
    pub limbs_exponent: Quantity,
    /// Exponent by which the number of laterals follows the trunk's diameter.
    pub vigour_exponent: Quantity,
    /// Exponent by which the limb zone, as a part of the leader's length, follows the trunk's diameter.
    pub zone_exponent: Quantity,
}

/// Diameter at the base of an axis by its length, the trunk and the wood on which it stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thickness {
    /// Diameter at the base of an axis of 40 cm on a trunk of the mean diameter.
    pub base_diameter: Quantity,
    /// Exponent by which an axis' length follows the diameter of its base.
    pub length_exponent: Quantity,
    /// Exponent by which the diameter of the base follows the trunk's.
    pub trunk_exponent: Quantity,
    /// Factor on the diameter of the base.
    pub base_factor: Normal,
    /// Largest diameter of the base over that of the wood on which the axis stands.
    pub base_share: Quantity,
}

/// Chances of the length classes; the remainder is the chance of a long shoot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassWeights {
    /// Chance of a short shoot.
    pub short: Quantity,
    /// Chance of a medium shoot.
    pub medium: Quantity,
}

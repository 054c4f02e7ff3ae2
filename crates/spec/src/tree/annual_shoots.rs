//! Parameters of the grammar of annual shoots.

use orchard_quantity::{Count, Normal, Quantity, Span};
use serde::{Deserialize, Serialize};

/// Apple tree of annual shoots (growth units): a leader that makes one shoot a season, limbs and laterals on
/// its phyllotactic spiral. Distributions marked "a tree" are drawn once a tree, the others at every use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnnualShootsSpec {
    /// Diameter of the trunk's first link, a tree. It takes the place of `tree.trunk_radius`.
    pub trunk_diameter: Normal,
    /// Length of the leader on a trunk of the mean diameter, a tree. It takes the place of `tree.height`.
    pub leader_length: Normal,
    /// Exponent by which the leader's length follows the trunk's diameter.
    pub leader_exponent: Quantity,
    /// Relative lengths of the leader's shoots, a season each. Their number is the tree's age in seasons.
    pub leader_shoots: Vec<Normal>,
    /// Factor on the number of laterals, a tree.
    pub vigour: Normal,
    /// Length of bare trunk below the lowest branch, a tree.
    pub bare_trunk: Normal,
    /// Part of the leader's length above which it sets no limb.
    pub limb_zone: Quantity,
    /// Limbs on the leader, a tree.
    pub limbs: Normal,
    /// Heights at which limbs stand together, a tree.
    pub limb_tiers: Normal,
    /// Length of a limb's first shoot on a trunk of the mean diameter.
    pub limb_shoot: Normal,
    /// Exponent by which it follows the trunk's diameter.
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
    /// The same on a limb.
    pub limb_nodes: Normal,
    /// The same on a lateral.
    pub lateral_nodes: Normal,
    /// Seasons for which laterals stay on a tree before they are pruned away.
    pub lateral_seasons: Count,
    /// Length classes of a lateral's first shoot.
    pub first_shoot: ClassWeights,
    /// Length classes of its later shoots.
    pub later_shoot: ClassWeights,
    /// Chance that a lateral makes a shoot in a season after its first.
    pub persistence: Quantity,
    /// Pipes that were cut off at the tip of leader or limb, relative to each other.
    pub cut_tip: Normal,
    /// Pipes of shed branches a metre of leader or limb, in the unit of `cut_tip`.
    pub scars: Quantity,
    /// Largest part of the trunk's pipes that living tips make up; where there are more, they are thinner than
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
    /// Chance that one of its later shoots does.
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
    /// Length of the stubs by which fruit sites stand off limbs.
    pub fruit_stub: Quantity,
    /// Fruit sites along a limb over the cross-section of its base: a slender limb bears near its base only.
    pub fruit_per_area: Quantity,
    /// Length of a lateral, from its base, that bears fruit.
    pub fruit_reach: Quantity,
}

/// Chances of the length classes; what `short` and `medium` leave is long.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassWeights {
    /// Of a short shoot, under 5 cm.
    pub short: Quantity,
    /// Of a medium shoot, 5 to 20 cm.
    pub medium: Quantity,
}

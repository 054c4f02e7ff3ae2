//! Growth of a tree: grammar, pipe model and fruit sites.

pub mod annual_shoots;
mod trained;

pub use trained::{ShootSpec, UprightsSpec, VTrellisSpec};

use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

/// Grammar, pipe model and placement of the tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TreeSpec {
    /// The grammar that grows the tree, with its parameters.
    pub grammar: Grammar,
    /// Height of the highest tip after rescaling.
    pub height: Quantity,
    /// Least height of a branch's lowest point above the ground.
    pub clearance: Quantity,
    /// Radius of every internode without children.
    pub tip_radius: Quantity,
    /// Radius of the trunk's first internode.
    pub trunk_radius: Quantity,
    /// Exponent beta of the pipe model.
    pub pipe_exponent: Quantity,
    /// Fruit sites on one internode that may carry fruit, evenly spaced, the last at its tip.
    pub fruit_sites: Count,
    /// Radius of spurs in pictures.
    pub spur_radius: Quantity,
}

/// Grammar that a config chooses: `[tree.grammar.NAME]` holds the parameters of the one that it names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(clippy::large_enum_variant, reason = "a config holds one")]
pub enum Grammar {
    /// Ternary bracketed L-system with Honda's angles; no random number.
    Ternary(TernarySpec),
    /// Stochastic apple tree with a central leader.
    CentralLeader(CentralLeaderSpec),
    /// Two leaders that lean into the alleys, for a V-trellis.
    VTrellis(VTrellisSpec),
    /// Upright fruiting offshoots on a level trunk.
    Uprights(UprightsSpec),
    /// Stochastic apple tree of annual shoots, fitted to measured trees.
    AnnualShoots(Box<annual_shoots::AnnualShootsSpec>),
}

/// Ternary bracketed parametric L-system. Lengths are relative: the tree is rescaled to its height.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TernarySpec {
    /// Derivations n; the tree has 1 + 2 (3^n - 1) internodes.
    pub derivations: Count,
    /// Branching angle a.
    pub branch_angle: Quantity,
    /// Divergence d1, between the first and the second branch.
    pub divergence_1: Quantity,
    /// Divergence d2, between the second and the third branch.
    pub divergence_2: Quantity,
    /// Factor lr on the length of every internode a derivation.
    pub elongation: Quantity,
    /// Factor vr on the drawn width of every internode a derivation.
    pub thickening: Quantity,
    /// Length of the axiom's internode.
    pub trunk_length: Quantity,
    /// Length F0 of a new internode.
    pub internode_length: Quantity,
    /// Roll between the axiom's internode and its apex.
    pub axiom_roll: Quantity,
}

/// Stochastic central-leader apple grammar. Intervals marked "a tree" are drawn once a tree, the others at
/// every use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CentralLeaderSpec {
    /// Number of limbs on the leader, one at the end of each of its tiers.
    pub limbs: CountSpan,
    /// Number of these limbs, from the lowest up, that are scaffolds; the others are laterals of the upper leader.
    pub scaffolds: CountSpan,
    /// Length of the first tier, the bare trunk below the lowest scaffold.
    pub trunk_length: Span,
    /// Length of the second tier.
    pub base_internode: Quantity,
    /// Factor on a tier's length, and on a limb's, from one tier to the next.
    pub leader_decay: Quantity,
    /// Internodes of the leader in a tier that ends in a scaffold.
    pub leader_internodes: CountSpan,
    /// Length over `base_internode` of the tiers above the scaffolds, one internode each.
    pub upper_internode: Quantity,
    /// Length of a limb, its outermost twigs included, over `base_internode`, before `leader_decay`.
    pub scaffold_length: Span,
    /// Roll from one branch of an axis to the next, a tree.
    pub divergence: Span,
    /// Angle between leader and limb.
    pub crotch_angle: Span,
    /// Angle between an axis and a lateral.
    pub lateral_angle: Span,
    /// Buds that an axis sets.
    pub fork_children: CountSpan,
    /// Internodes of an axis of order 1 or more.
    pub axis_internodes: CountSpan,
    /// Factor on an internode's length for each node along its axis and each branching, a tree.
    pub length_decay: Span,
    /// Downward bend an internode (gravimorphism), a tree.
    pub droop: Span,
    /// Factor on `droop` from upright to weeping, a tree.
    pub form: Span,
    /// Part of an axis's accumulated droop that its last internode bends back up, a tree.
    pub upturn: Span,
    /// Chance that a lateral bud aborts, a tree.
    pub bud_abortion: Span,
    /// Largest random bend at a node, a tree.
    pub wobble: Span,
    /// Shortest internode before rescaling; an axis ends where the next internode would be shorter.
    pub internode_min: Quantity,
    /// Number of branch orders, the leader's order 0 included.
    pub branch_orders: Count,
    /// Most internodes of a tree; buds beyond it stay dormant.
    pub segments_max: Count,
}

/// An interval of whole numbers, both ends included, with the allowed range of both ends.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "RawCountSpan")]
pub struct CountSpan {
    low: u32,
    high: u32,
    range: [u32; 2],
    unit: String,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCountSpan {
    low: u32,
    high: u32,
    range: [u32; 2],
    unit: String,
    source: String,
}

impl TryFrom<RawCountSpan> for CountSpan {
    type Error = String;

    fn try_from(raw: RawCountSpan) -> Result<Self, String> {
        let [least, most] = raw.range;
        for end in [raw.low, raw.high] {
            if !(least..=most).contains(&end) {
                return Err(format!("{end} is outside the allowed range [{least}, {most}] {}", raw.unit));
            }
        }
        if raw.low > raw.high {
            return Err(format!("low {} is above high {}", raw.low, raw.high));
        }
        Ok(Self { low: raw.low, high: raw.high, range: raw.range, unit: raw.unit, source: raw.source })
    }
}

impl CountSpan {
    /// Lowest number.
    pub fn low(&self) -> u32 {
        self.low
    }

    /// Highest number.
    pub fn high(&self) -> u32 {
        self.high
    }

    /// Key of the source in `docs/references.bib`.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Draws a number uniformly.
    pub fn draw(&self, stream: &mut crate::Stream) -> u32 {
        stream.integer(self.low, self.high)
    }
}

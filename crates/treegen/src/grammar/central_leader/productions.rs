//! Growing points and productions.

use super::CentralLeader;
use crate::grammar::pieces::{branch, wobble, wobbling_internode};
use crate::lsystem::{Command, Grammar, Module};
use orchard_spec::tree::{CentralLeaderSpec, CountSpan};

/// Growing points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Apex {
    /// Tip of the leader, about to draw one internode.
    Leader {
        /// Number of limbs below it.
        tier: u32,
        /// Number of internodes that the tier still lacks.
        left: u32,
        /// Length of the tier's internodes \[m\].
        length: f64,
    },
    /// Tip of an axis, about to draw one internode.
    Axis(Axis),
    /// A lateral bud.
    Bud {
        /// Branch order of the axis that it becomes.
        order: u32,
        /// Length of that axis's first internode \[m\].
        length: f64,
    },
}

/// Parameters of an axis' tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Branch order.
    order: u32,
    /// Number of internodes drawn.
    drawn: u32,
    /// Number of internodes of the complete axis.
    internodes: u32,
    /// Number of buds of the complete axis.
    buds: u32,
    /// Length of the next internode \[m\].
    length: f64,
}

impl Axis {
    /// Number of buds at node `node` (1 is the first internode's tip): one a node on the nodes before the tip, distal
    /// nodes first; if there are more buds than such nodes, one on every node and the rest at the tip.
    fn buds_at(&self, node: u32) -> u32 {
        let (nodes, buds) = (self.internodes, self.buds);
        if buds < nodes {
            u32::from(node < nodes && node + buds >= nodes)
        } else if node < nodes {
            1
        } else {
            buds - nodes + 1
        }
    }
}

impl CentralLeader<'_> {
    fn axis(&mut self, order: u32, internodes: u32, length: f64) -> Axis {
        // The last order sets no buds.
        let buds = if order + 1 < self.spec.branch_orders.get() {
            self.spec.fork_children.draw(&mut self.stream)
        } else {
            0
        };
        Axis { order, drawn: 0, internodes, buds, length }
    }

    fn draw_count(&mut self, which: fn(&CentralLeaderSpec) -> &CountSpan) -> u32 {
        which(self.spec).draw(&mut self.stream)
    }

    /// A limb of the leader. Each internode has `length_decay` times the length of the one before, also from
    /// axis to lateral, so that the longest path from the leader to a tip tends to the drawn length: the sum of that series.
    fn limb(&mut self, tier: u32, tier_scale: f64, successor: &mut Vec<Module<Apex>>) {
        let internodes = self.draw_count(|s| &s.axis_internodes);
        let reach =
            self.spec.base_internode.si() * tier_scale * self.stream.within(self.spec.scaffold_length.si());
        let angle = self.stream.within(self.spec.crotch_angle.si());
        let aborted = self.stream.chance(self.tree.bud_abortion) && tier >= self.tree.scaffolds;
        if !aborted && self.spec.branch_orders.get() > 1 && self.bound.commit(internodes) {
            let axis = self.axis(1, internodes, reach * (1.0 - self.tree.length_decay));
            branch(self.tree.divergence, angle, Apex::Axis(axis), successor);
        }
    }

    /// Tip of the leader at the start of a tier. Above the last limb it draws one last, bare internode.
    fn tier(&mut self, tier: u32) -> Option<Apex> {
        let base = self.spec.base_internode.si();
        let (internodes, length) = if tier == 0 {
            (self.draw_count(|s| &s.leader_internodes), self.stream.within(self.spec.trunk_length.si()))
        } else if tier < self.tree.scaffolds {
            (self.draw_count(|s| &s.leader_internodes), base * self.tier_scale(tier - 1))
        } else {
            (1, base * self.spec.upper_internode.si())
        };
        let fits = tier <= self.tree.limbs && self.bound.commit(internodes);
        fits.then(|| Apex::Leader { tier, left: internodes, length: length / f64::from(internodes) })
    }

    /// `leader_decay` to the power `tier`.
    fn tier_scale(&self, tier: u32) -> f64 {
        (0..tier).fold(1.0, |scale, _| scale * self.spec.leader_decay.si())
    }

    /// Production of the leader's tip: an internode; at the end of a tier a limb and the next tier.
    fn grow_leader(&mut self, tier: u32, left: u32, length: f64, successor: &mut Vec<Module<Apex>>) {
        // The leader zigzags about the vertical.
        wobbling_internode(&mut self.stream, self.tree.wobble, length, successor);
        if left > 1 {
            successor.push(Module::Apex(Apex::Leader { tier, left: left - 1, length }));
        } else {
            if tier < self.tree.limbs {
                self.limb(tier, self.tier_scale(tier), successor);
            }
            successor.extend(self.tier(tier + 1).map(Module::Apex));
        }
    }

    /// Production of an axis' tip: an internode, the buds at its node, the tip again.
    fn grow_axis(&mut self, axis: Axis, successor: &mut Vec<Module<Apex>>) {
        if axis.drawn == axis.internodes || axis.length < self.spec.internode_min.si() {
            return;
        }
        let (bend, _) = wobble(&mut self.stream, self.tree.wobble);
        // The last internode bends back a part of the accumulated droop.
        let last = axis.drawn > 0 && axis.drawn + 1 == axis.internodes;
        let droop =
            if last { -self.tree.upturn * self.tree.droop * f64::from(axis.drawn) } else { self.tree.droop };
        successor.extend(bend.map(Module::Turtle));
        successor.extend([Command::Droop(droop), Command::Forward(axis.length)].map(Module::Turtle));
        let tip = Axis { drawn: axis.drawn + 1, length: axis.length * self.tree.length_decay, ..axis };
        for _ in 0..axis.buds_at(tip.drawn) {
            let angle = self.stream.within(self.spec.lateral_angle.si());
            let bud = Apex::Bud { order: axis.order + 1, length: tip.length };
            branch(self.tree.divergence, angle, bud, successor);
        }
        successor.push(Module::Apex(Apex::Axis(tip)));
    }

    /// Production of a bud: nothing, or an axis.
    fn grow_bud(&mut self, order: u32, length: f64, successor: &mut Vec<Module<Apex>>) {
        let internodes = self.draw_count(|s| &s.axis_internodes);
        if !self.stream.chance(self.tree.bud_abortion) && self.bound.commit(internodes) {
            let axis = self.axis(order, internodes, length);
            successor.push(Module::Apex(Apex::Axis(axis)));
        }
    }
}

impl Grammar for CentralLeader<'_> {
    type Apex = Apex;

    /// Number of derivations after which a tree of this config has no apex left: the leader's tiers, then one bud and
    /// one axis an order, each with a last rewriting that removes the spent apex.
    fn derivations(&self) -> u32 {
        let axis = self.spec.axis_internodes.high() + 2;
        self.spec.leader_internodes.high() * (self.tree.limbs + 1)
            + axis * (self.spec.branch_orders.get() + 1)
    }

    /// `/(phase) Leader`
    fn axiom(&mut self) -> Vec<Module<Apex>> {
        let phase = self.stream.uniform(0.0, std::f64::consts::TAU);
        let trunk = self.tier(0);
        std::iter::once(Module::Turtle(Command::Roll(phase))).chain(trunk.map(Module::Apex)).collect()
    }

    fn grow(&mut self, apex: Apex, successor: &mut Vec<Module<Apex>>) {
        match apex {
            Apex::Leader { tier, left, length } => self.grow_leader(tier, left, length, successor),
            Apex::Axis(axis) => self.grow_axis(axis, successor),
            Apex::Bud { order, length } => self.grow_bud(order, length, successor),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bud_has_its_node() {
        for internodes in 1..=5 {
            for buds in 0..=6 {
                let axis = Axis { order: 1, drawn: 0, internodes, buds, length: 1.0 };
                assert_eq!((1..=internodes).map(|node| axis.buds_at(node)).sum::<u32>(), buds);
            }
        }
    }
}

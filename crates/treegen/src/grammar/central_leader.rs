//! Stochastic apple grammar with a central leader.
//!
//! In the spirit of MAppleT (Costes et al. 2008), as the paper describes it: the leader sets scaffold limbs
//! on a phyllotactic spiral, every limb forks into laterals that arch down, buds abort at random.
//! `docs/computation/growth.md` lists the productions.

use orchard_spec::{
    Stream,
    tree::{CentralLeaderSpec, CountSpan},
};

use crate::lsystem::{Command, Grammar, Module};

/// The grammar of one tree: the parameters drawn once a tree, and the stream for all other draws.
#[derive(Debug, Clone)]
pub struct CentralLeader<'a> {
    spec: &'a CentralLeaderSpec,
    stream: Stream,
    limbs: u32,
    scaffolds: u32,
    divergence: f64,
    length_decay: f64,
    /// Droop an internode with the tree's form in it [rad].
    droop: f64,
    upturn: f64,
    bud_abortion: f64,
    wobble: f64,
    /// Internodes drawn, and those that the living axes will still draw.
    committed: u32,
}

/// The growing points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Apex {
    /// Tip of the leader, about to draw one internode.
    Leader {
        /// Limbs below it.
        tier: u32,
        /// Internodes that the tier still lacks.
        left: u32,
        /// Length of the tier's internodes [m].
        length: f64,
    },
    /// Tip of an axis, about to draw one internode.
    Axis(Axis),
    /// A lateral bud.
    Bud {
        /// Branch order of the axis that it becomes.
        order: u32,
        /// Length of that axis's first internode [m].
        length: f64,
    },
}

/// Parameters of an axis' tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Branch order.
    order: u32,
    /// Internodes drawn.
    drawn: u32,
    /// Internodes when fully grown.
    internodes: u32,
    /// Buds when fully grown.
    buds: u32,
    /// Length of the next internode [m].
    length: f64,
}

impl Axis {
    /// Buds at node `node` (1 the first internode's tip): one a node on the nodes before the tip, the
    /// distal ones first; where that is too few, one on every node and the rest at the tip.
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

impl<'a> CentralLeader<'a> {
    /// Draws the parameters of one tree.
    pub fn new(spec: &'a CentralLeaderSpec, mut stream: Stream) -> Self {
        let limbs = spec.limbs.draw(&mut stream);
        let scaffolds = spec.scaffolds.draw(&mut stream).min(limbs);
        let divergence = stream.within(spec.divergence.si());
        let length_decay = stream.within(spec.length_decay.si());
        let droop = stream.within(spec.droop.si()) * stream.within(spec.form.si());
        let upturn = stream.within(spec.upturn.si());
        let bud_abortion = stream.within(spec.bud_abortion.si());
        let wobble = stream.within(spec.wobble.si());
        Self {
            spec,
            stream,
            limbs,
            scaffolds,
            divergence,
            length_decay,
            droop,
            upturn,
            bud_abortion,
            wobble,
            committed: 0,
        }
    }

    /// Reserves the internodes of a new axis, if the bound on the tree's size allows them.
    fn commit(&mut self, internodes: u32) -> bool {
        let fits = self.committed + internodes <= self.spec.segments_max.get();
        self.committed += if fits { internodes } else { 0 };
        fits
    }

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

    /// A bend of random size about a random axis across the heading: `/(p) &(w) /(-p)`, and its inverse.
    fn draw_wobble(&mut self) -> ([Command; 3], [Command; 3]) {
        let phase = self.stream.uniform(0.0, std::f64::consts::TAU);
        let angle = self.stream.uniform(0.0, self.wobble);
        let bend = |angle| [Command::Roll(phase), Command::Pitch(angle), Command::Roll(-phase)];
        (bend(angle), bend(-angle))
    }

    /// One internode of the leader. The node bends and straightens again, so that the leader zigzags about
    /// the vertical.
    fn leader_internode(&mut self, length: f64, successor: &mut Vec<Module<Apex>>) {
        let (bend, unbend) = self.draw_wobble();
        successor.extend(bend.map(Module::Turtle));
        successor.push(Module::Turtle(Command::Forward(length)));
        successor.extend(unbend.map(Module::Turtle));
    }

    /// A branch: `/(divergence) [ &(angle) apex ]`.
    fn branch(&self, angle: f64, apex: Apex, successor: &mut Vec<Module<Apex>>) {
        successor.extend(
            [Command::Roll(self.divergence), Command::Push, Command::Pitch(angle)].map(Module::Turtle),
        );
        successor.extend([Module::Apex(apex), Module::Turtle(Command::Pop)]);
    }

    /// A limb of the leader. Its internodes each have `length_decay` times the length of the one before, from
    /// axis to lateral too, so that the longest way out tends to the drawn length: the sum of that series.
    fn limb(&mut self, tier: u32, tier_scale: f64, successor: &mut Vec<Module<Apex>>) {
        let internodes = self.draw_count(|s| &s.axis_internodes);
        let reach =
            self.spec.base_internode.si() * tier_scale * self.stream.within(self.spec.scaffold_length.si());
        let angle = self.stream.within(self.spec.crotch_angle.si());
        let aborted = self.stream.chance(self.bud_abortion) && tier >= self.scaffolds;
        if !aborted && self.spec.branch_orders.get() > 1 && self.commit(internodes) {
            let axis = self.axis(1, internodes, reach * (1.0 - self.length_decay));
            self.branch(angle, Apex::Axis(axis), successor);
        }
    }

    /// The tip of the leader at the start of a tier. Above the last limb it is a last, bare internode.
    fn tier(&mut self, tier: u32) -> Option<Apex> {
        let base = self.spec.base_internode.si();
        let (internodes, length) = if tier == 0 {
            (self.draw_count(|s| &s.leader_internodes), self.stream.within(self.spec.trunk_length.si()))
        } else if tier < self.scaffolds {
            (self.draw_count(|s| &s.leader_internodes), base * self.tier_scale(tier - 1))
        } else {
            (1, base * self.spec.upper_internode.si())
        };
        let fits = tier <= self.limbs && self.commit(internodes);
        fits.then(|| Apex::Leader { tier, left: internodes, length: length / f64::from(internodes) })
    }

    /// `leader_decay` to the power `tier`.
    fn tier_scale(&self, tier: u32) -> f64 {
        (0..tier).fold(1.0, |scale, _| scale * self.spec.leader_decay.si())
    }

    /// Production of the leader's tip: an internode; at the end of a tier a limb and the next tier.
    fn grow_leader(&mut self, tier: u32, left: u32, length: f64, successor: &mut Vec<Module<Apex>>) {
        self.leader_internode(length, successor);
        if left > 1 {
            successor.push(Module::Apex(Apex::Leader { tier, left: left - 1, length }));
        } else {
            if tier < self.limbs {
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
        let (bend, _) = self.draw_wobble();
        // The last internode takes back a part of what the others gathered.
        let last = axis.drawn > 0 && axis.drawn + 1 == axis.internodes;
        let droop = if last { -self.upturn * self.droop * f64::from(axis.drawn) } else { self.droop };
        successor.extend(bend.map(Module::Turtle));
        successor.extend([Command::Droop(droop), Command::Forward(axis.length)].map(Module::Turtle));
        let tip = Axis { drawn: axis.drawn + 1, length: axis.length * self.length_decay, ..axis };
        for _ in 0..axis.buds_at(tip.drawn) {
            let angle = self.stream.within(self.spec.lateral_angle.si());
            let bud = Apex::Bud { order: axis.order + 1, length: tip.length };
            self.branch(angle, bud, successor);
        }
        successor.push(Module::Apex(Apex::Axis(tip)));
    }

    /// Production of a bud: nothing, or an axis.
    fn grow_bud(&mut self, order: u32, length: f64, successor: &mut Vec<Module<Apex>>) {
        let internodes = self.draw_count(|s| &s.axis_internodes);
        if !self.stream.chance(self.bud_abortion) && self.commit(internodes) {
            let axis = self.axis(order, internodes, length);
            successor.push(Module::Apex(Apex::Axis(axis)));
        }
    }
}

impl Grammar for CentralLeader<'_> {
    type Apex = Apex;

    /// Derivations after which no tree of this config has an apex left: the leader's tiers, then one bud and
    /// one axis an order, each with a last rewriting that removes the spent apex.
    fn derivations(&self) -> u32 {
        let axis = self.spec.axis_internodes.high() + 2;
        self.spec.leader_internodes.high() * (self.limbs + 1) + axis * (self.spec.branch_orders.get() + 1)
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
    use crate::lsystem::{Grammar as _, derive};
    use orchard_spec::{Purpose, Spec, tree::Grammar};

    #[test]
    fn no_apex_is_left() {
        let Grammar::CentralLeader(spec) = Spec::paper().tree.grammar else { panic!("another grammar") };
        for world in 0..50 {
            let mut grammar = CentralLeader::new(&spec, Stream::new(5, world, Purpose::Growth));
            let derivations = grammar.derivations();
            let string = derive(&mut grammar, derivations);
            assert!(string.iter().all(|m| matches!(m, Module::Turtle(_))), "world {world}");
        }
    }

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

//! V-trellis: a short trunk forks into two leaders that lean into the alleys, each with arms along its wires.
//!
//! The row runs along the world's x axis: a leader, its arms and its wires lie in one plane that contains it.
//! `docs/computation/growth.md` lists the productions.

use super::pieces::{Bound, branch_aside, wobbling_internode};
use super::shoot::{self, ShootApex};
use crate::lsystem::{Command, Grammar, Module};
use orchard_spec::{Stream, tree::VTrellisSpec};
use std::f64::consts::{FRAC_PI_2, PI};

/// The grammar of one tree.
#[derive(Debug, Clone)]
pub struct VTrellis<'a> {
    spec: &'a VTrellisSpec,
    stream: Stream,
    bound: Bound,
}

/// Growing points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Apex {
    /// Tip of the trunk, about to draw one internode.
    Trunk {
        /// Internodes still to draw.
        left: u32,
    },
    /// Tip of a leader, about to draw one internode.
    Leader(Leader),
    /// Growing point of an arm.
    Arm(ShootApex),
}

/// Parameters of a leader's tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leader {
    /// Internodes still to draw.
    left: u32,
    /// Length of each \[m\].
    length: f64,
    /// Roll to the side of the next arm \[rad\]: a quarter turn to either side.
    side: f64,
}

impl<'a> VTrellis<'a> {
    /// Makes the grammar of a config.
    pub fn new(spec: &'a VTrellisSpec, stream: Stream) -> Self {
        Self { spec, stream, bound: Bound::new(spec.segments_max.get()) }
    }

    /// `Trunk(n) -> F(l) Trunk(n - 1)`; the last one forks: `F(l) [/(0) &(b) Leader] [/(pi) &(b) Leader]`, with b the
    /// leaders' angle from the vertical. The turtle's left axis is the row's direction, so that both leaders lean
    /// straight into the alleys.
    fn grow_trunk(&mut self, left: u32, successor: &mut Vec<Module<Apex>>) {
        let length = self.spec.fork_height.si() / f64::from(self.trunk_internodes());
        successor.push(Module::Turtle(Command::Forward(length)));
        if left > 1 {
            successor.push(Module::Apex(Apex::Trunk { left: left - 1 }));
            return;
        }
        for roll in [0.0, PI] {
            let nodes = self.spec.leader_nodes.draw(&mut self.stream).max(1);
            let side = if self.stream.chance(0.5) { FRAC_PI_2 } else { -FRAC_PI_2 };
            if self.bound.commit(nodes) {
                let length = self.spec.leader_length.si() / f64::from(nodes);
                let leader = Apex::Leader(Leader { left: nodes, length, side });
                branch_aside(roll, FRAC_PI_2 - self.spec.lean.si(), leader, successor);
            }
        }
    }

    /// `Leader(n, l, s) -> W F(l) W' [/(s +- stray) &(a) Arm] Leader(n - 1, l, -s)`; the last node sets no arm.
    fn grow_leader(&mut self, leader: Leader, successor: &mut Vec<Module<Apex>>) {
        let spec = self.spec;
        wobbling_internode(&mut self.stream, spec.leader_wobble.si(), leader.length, successor);
        if leader.left == 1 {
            return;
        }
        let stray = spec.arm_stray.si();
        let roll = leader.side + self.stream.uniform(-stray, stray);
        let angle = self.stream.within(spec.arm_angle.si());
        let length = self.stream.within(spec.arm_length.si());
        if !self.stream.chance(spec.bud_abortion.si())
            && let Some(arm) = shoot::open(&spec.arm, length, &mut self.stream, &mut self.bound)
        {
            branch_aside(roll, angle, Apex::Arm(arm), successor);
        }
        successor.push(Module::Apex(Apex::Leader(Leader {
            left: leader.left - 1,
            side: -leader.side,
            ..leader
        })));
    }

    fn trunk_internodes(&self) -> u32 {
        self.spec.trunk_internodes.get().max(1)
    }
}

impl Grammar for VTrellis<'_> {
    type Apex = Apex;

    /// Trunk, leader and the arm of its last node.
    fn derivations(&self) -> u32 {
        self.trunk_internodes() + self.spec.leader_nodes.high().max(1) + shoot::derivations(&self.spec.arm)
    }

    /// `Trunk(n)`
    fn axiom(&mut self) -> Vec<Module<Apex>> {
        let left = self.trunk_internodes();
        self.bound.commit(left);
        vec![Module::Apex(Apex::Trunk { left })]
    }

    fn grow(&mut self, apex: Apex, successor: &mut Vec<Module<Apex>>) {
        match apex {
            Apex::Trunk { left } => self.grow_trunk(left, successor),
            Apex::Leader(leader) => self.grow_leader(leader, successor),
            Apex::Arm(apex) => {
                shoot::grow(&self.spec.arm, apex, &mut self.stream, &mut self.bound, Apex::Arm, successor);
            }
        }
    }
}

//! Upright fruiting offshoots: a trunk laid down along the lowest wire of a row, with upright shoots.
//!
//! The row runs along the world's x axis, the trunk bends into it. `docs/computation/growth.md` lists the productions.

use super::pieces::{Bound, branch_aside};
use super::shoot::{self, ShootApex};
use crate::lsystem::{Command, Grammar, Module};
use orchard_geometry::math;
use orchard_spec::{Stream, tree::UprightsSpec};
use std::f64::consts::FRAC_PI_2;

/// The grammar of one tree.
#[derive(Debug, Clone)]
pub struct Uprights<'a> {
    spec: &'a UprightsSpec,
    stream: Stream,
    bound: Bound,
}

/// Growing points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Apex {
    /// Tip of the level trunk, about to draw one internode.
    Trunk {
        /// Internodes still to draw.
        left: u32,
    },
    /// Growing point of an upright.
    Upright(ShootApex),
}

impl<'a> Uprights<'a> {
    /// Makes the grammar of a config.
    pub fn new(spec: &'a UprightsSpec, stream: Stream) -> Self {
        Self { spec, stream, bound: Bound::new(spec.segments_max.get()) }
    }

    /// Trunk up to the beginning of its level part: `F(h) { &(90 deg / n) F(b) }`, n times, with h such that the level part has the
    /// configured height (h at least b).
    fn bent_trunk(&self) -> Vec<Command> {
        let n = self.spec.bend_internodes.get().max(1);
        let internode = self.spec.bend_length.si() / f64::from(n);
        let bend = FRAC_PI_2 / f64::from(n);
        let rise: f64 = (1..=n).map(|k| internode * math::cos(bend * f64::from(k))).sum();
        let mut commands = vec![Command::Forward((self.spec.trunk_height.si() - rise).max(internode))];
        for _ in 0..n {
            commands.extend([Command::Pitch(bend), Command::Forward(internode)]);
        }
        commands
    }

    /// `Trunk(n) -> F(s) [/(stray) &(-90 deg +- stray) Upright] Trunk(n - 1)`. On the level trunk the
    /// turtle's up axis points to the sky.
    fn grow_trunk(&mut self, left: u32, successor: &mut Vec<Module<Apex>>) {
        let spec = self.spec;
        successor.push(Module::Turtle(Command::Forward(self.stream.within(spec.spacing.si()))));
        let stray = spec.upright_stray.si();
        let roll = self.stream.uniform(-stray, stray);
        let angle = self.stream.uniform(-stray, stray) - FRAC_PI_2;
        // Uprights are topped above the wires.
        let length = self.stream.within(spec.upright_length.si()).min(spec.topped_length.si());
        let aborts = self.stream.chance(spec.bud_abortion.si()) && left > 1;
        if !aborts && let Some(tip) = shoot::open(&spec.upright, length, &mut self.stream, &mut self.bound) {
            branch_aside(roll, angle, Apex::Upright(tip), successor);
        }
        if left > 1 {
            successor.push(Module::Apex(Apex::Trunk { left: left - 1 }));
        }
    }
}

impl Grammar for Uprights<'_> {
    type Apex = Apex;

    /// The level trunk and the upright of its last node.
    fn derivations(&self) -> u32 {
        self.spec.uprights.high().max(1) + shoot::derivations(&self.spec.upright)
    }

    /// `/(90 deg)`, which turns the bend into the row, the bent trunk, `Trunk(n)`
    fn axiom(&mut self) -> Vec<Module<Apex>> {
        let left = self.spec.uprights.draw(&mut self.stream).max(1);
        self.bound.commit(left + 1 + self.spec.bend_internodes.get().max(1));
        std::iter::once(Command::Roll(FRAC_PI_2))
            .chain(self.bent_trunk())
            .map(Module::Turtle)
            .chain([Module::Apex(Apex::Trunk { left })])
            .collect()
    }

    fn grow(&mut self, apex: Apex, successor: &mut Vec<Module<Apex>>) {
        match apex {
            Apex::Trunk { left } => self.grow_trunk(left, successor),
            Apex::Upright(apex) => {
                let wrap = Apex::Upright;
                shoot::grow(&self.spec.upright, apex, &mut self.stream, &mut self.bound, wrap, successor);
            }
        }
    }
}

//! Ternary bracketed L-system with Honda's branching angles and length ratios.
//!
//! The paper's grammar equation, after Prusinkiewicz and Lindenmayer 1990, figure 2.8. It draws no random numbers.

use orchard_spec::tree::TernarySpec;

use crate::lsystem::{Command, Grammar, Module};

/// The grammar with its angles \[rad\], lengths and factors.
#[derive(Debug, Clone)]
pub struct Ternary {
    derivations: u32,
    branch_angle: f64,
    divergence: [f64; 2],
    elongation: f64,
    thickening: f64,
    trunk_length: f64,
    internode_length: f64,
    axiom_roll: f64,
}

/// The apex `A`; it has no parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Apex;

impl Ternary {
    /// Makes the grammar of a config.
    pub fn new(spec: &TernarySpec) -> Self {
        Self {
            derivations: spec.derivations.get(),
            branch_angle: spec.branch_angle.si(),
            divergence: [spec.divergence_1.si(), spec.divergence_2.si()],
            elongation: spec.elongation.si(),
            thickening: spec.thickening.si(),
            trunk_length: spec.trunk_length.si(),
            internode_length: spec.internode_length.si(),
            axiom_roll: spec.axiom_roll.si(),
        }
    }
}

impl Grammar for Ternary {
    type Apex = Apex;

    fn derivations(&self) -> u32 {
        self.derivations
    }

    /// `!(1) F(trunk) /(roll) A`
    fn axiom(&mut self) -> Vec<Module<Apex>> {
        vec![
            Module::Turtle(Command::Width(1.0)),
            Module::Turtle(Command::Forward(self.trunk_length)),
            Module::Turtle(Command::Roll(self.axiom_roll)),
            Module::Apex(Apex),
        ]
    }

    /// `A -> !(vr) F(F0) [&(a) F(F0) A] /(d1) [&(a) F(F0) A] /(d2) [&(a) F(F0) A]`: four internodes and three
    /// apices for one apex, hence 1 + 4 (1 + 3 + ... + 3^(n-1)) = 1 + 2 (3^n - 1) internodes in all.
    fn grow(&mut self, _: Apex, successor: &mut Vec<Module<Apex>>) {
        let internode = Command::Forward(self.internode_length);
        successor.extend([Command::Width(self.thickening), internode].map(Module::Turtle));
        for divergence in [None, Some(self.divergence[0]), Some(self.divergence[1])] {
            successor.extend(divergence.map(|d| Module::Turtle(Command::Roll(d))));
            successor
                .extend([Command::Push, Command::Pitch(self.branch_angle), internode].map(Module::Turtle));
            successor.extend([Module::Apex(Apex), Module::Turtle(Command::Pop)]);
        }
    }

    /// `F(l) -> F(l lr)`, `!(w) -> !(w vr)`.
    fn mature(&self, command: Command) -> Command {
        match command {
            Command::Forward(length) => Command::Forward(length * self.elongation),
            Command::Width(width) => Command::Width(width * self.thickening),
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{lsystem::derive, turtle::interpret};
    use orchard_spec::{Preset, Spec, tree::Grammar};

    fn canonical() -> TernarySpec {
        match Spec::preset(Preset::Ternary).tree.grammar {
            Grammar::Ternary(spec) => spec,
            other => panic!("another grammar: {other:?}"),
        }
    }

    #[test]
    fn internodes_elongate_and_thicken() {
        let spec = canonical();
        let drawn = interpret(&derive(&mut Ternary::new(&spec), 2));
        let (lr, vr) = (spec.elongation.si(), spec.thickening.si());
        // Equal but for the order of two multiplications.
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-15, "{a} {b}");
        near(drawn[0].length, spec.trunk_length.si() * lr * lr);
        near(drawn[0].width, vr * vr);
        near(drawn[1].length, spec.internode_length.si() * lr);
        near(drawn[1].width, vr * vr);
        near(drawn[3].length, spec.internode_length.si());
        near(drawn[3].width, vr);
    }

    #[test]
    fn internode_count_is_exact() {
        let spec = canonical();
        let mut power = 1;
        for n in 0..=6 {
            assert_eq!(interpret(&derive(&mut Ternary::new(&spec), n)).len(), 1 + 2 * (power - 1), "n = {n}");
            power *= 3;
        }
    }
}

//! Parametric L-systems: strings of modules and their parallel rewriting.
//!
//! Prusinkiewicz and Lindenmayer, "The Algorithmic Beauty of Plants", chapter 1.

/// A command to the turtle. Lengths are in metres, angles in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// `F(l)`: draw an internode of length l along the heading.
    Forward(f64),
    /// `!(w)`: set the width of internodes drawn from here on.
    Width(f64),
    /// `&(a)`: turn the heading away from the up axis, about the left axis.
    Pitch(f64),
    /// `/(d)`: roll about the heading.
    Roll(f64),
    /// Bend the heading towards the ground (away from it where negative), never past the vertical.
    Droop(f64),
    /// `[`: push the turtle's state; the following internodes are one branch order higher.
    Push,
    /// `]`: pop the state.
    Pop,
    /// Begin a growth unit, which ends at the next one or at the closing bracket.
    Unit(Unit),
}

/// A growth unit: the shoot that one apex makes in one season.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit {
    /// Season in which it grew, from 0.
    pub season: u8,
    /// Kind of the axis that it lengthens.
    pub axis: AxisKind,
    /// True if it ends in an inflorescence.
    pub floral: bool,
}

/// Kind of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisKind {
    /// Trunk and leader.
    Leader,
    /// A structural branch.
    Limb,
    /// Any other axis.
    Lateral,
}

/// One letter of the string: a turtle command, or an apex that the grammar rewrites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Module<A> {
    /// A turtle command.
    Turtle(Command),
    /// A growing point with the grammar's own parameters; the turtle ignores it.
    Apex(A),
}

/// Axiom and productions of one context-free L-system. A stochastic grammar owns its random stream.
pub trait Grammar {
    /// The growing points and their parameters.
    type Apex: Copy;

    /// Number of derivations for a tree of this grammar.
    fn derivations(&self) -> u32;

    /// The string before the first derivation.
    fn axiom(&mut self) -> Vec<Module<Self::Apex>>;

    /// Production of an apex: appends its successor to `successor`.
    fn grow(&mut self, apex: Self::Apex, successor: &mut Vec<Module<Self::Apex>>);

    /// Production of a turtle command: by default the command itself.
    fn mature(&self, command: Command) -> Command {
        command
    }
}

/// Derives the axiom `derivations` times. Every module of a string is rewritten in one derivation, left to
/// right, which fixes the order of a stochastic grammar's draws.
pub fn derive<G: Grammar>(grammar: &mut G, derivations: u32) -> Vec<Module<G::Apex>> {
    let mut string = grammar.axiom();
    for _ in 0..derivations {
        let mut next = Vec::with_capacity(2 * string.len());
        for module in string {
            match module {
                Module::Turtle(command) => next.push(Module::Turtle(grammar.mature(command))),
                Module::Apex(apex) => grammar.grow(apex, &mut next),
            }
        }
        string = next;
    }
    string
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lindenmayer's algae, a -> ab, b -> a: its string lengths are the Fibonacci numbers.
    struct Algae;

    impl Grammar for Algae {
        type Apex = char;

        fn derivations(&self) -> u32 {
            7
        }

        fn axiom(&mut self) -> Vec<Module<char>> {
            vec![Module::Apex('a')]
        }

        fn grow(&mut self, apex: char, successor: &mut Vec<Module<char>>) {
            successor.push(Module::Apex('a'));
            if apex == 'a' {
                successor.push(Module::Apex('b'));
            }
        }
    }

    #[test]
    fn rewriting_is_parallel() {
        let lengths: Vec<usize> = (0..8).map(|n| derive(&mut Algae, n).len()).collect();
        assert_eq!(lengths, [1, 2, 3, 5, 8, 13, 21, 34]);
    }
}

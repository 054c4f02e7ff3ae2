//! Stochastic apple grammar with a central leader.
//!
//! In the spirit of MAppleT (Costes et al. 2008), as the paper describes it: the leader sets scaffold limbs
//! on a phyllotactic spiral, every limb forks into laterals that arch down, buds abort at random.
//! `docs/computation/growth.md` lists the productions.

mod parameters;
mod productions;

pub use productions::{Apex, Axis};

use super::pieces::Bound;
use orchard_spec::{Stream, tree::CentralLeaderSpec};
use parameters::Parameters;

/// The grammar of one tree: the parameters drawn once a tree, and the stream for all other draws.
#[derive(Debug, Clone)]
pub struct CentralLeader<'a> {
    spec: &'a CentralLeaderSpec,
    tree: Parameters,
    stream: Stream,
    bound: Bound,
}

impl<'a> CentralLeader<'a> {
    /// Draws the parameters of one tree.
    pub fn new(spec: &'a CentralLeaderSpec, mut stream: Stream) -> Self {
        let tree = Parameters::draw(spec, &mut stream);
        Self { spec, tree, stream, bound: Bound::new(spec.segments_max.get()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lsystem::{Grammar as _, Module, derive};
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
}

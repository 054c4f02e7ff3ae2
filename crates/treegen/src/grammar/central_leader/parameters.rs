//! Parameters that a tree draws once, for all its productions.

use orchard_spec::{Stream, tree::CentralLeaderSpec};

/// Parameters of one tree.
#[derive(Debug, Clone)]
pub(super) struct Parameters {
    pub limbs: u32,
    pub scaffolds: u32,
    /// Roll from branch to branch \[rad\].
    pub divergence: f64,
    pub length_decay: f64,
    /// Droop an internode times the tree's form \[rad\].
    pub droop: f64,
    pub upturn: f64,
    pub bud_abortion: f64,
    /// Largest bend at a node \[rad\].
    pub wobble: f64,
}

impl Parameters {
    /// Draws the parameters. The order of the draws is part of the seed version.
    pub fn draw(spec: &CentralLeaderSpec, stream: &mut Stream) -> Self {
        let limbs = spec.limbs.draw(stream);
        let scaffolds = spec.scaffolds.draw(stream).min(limbs);
        let divergence = stream.within(spec.divergence.si());
        let length_decay = stream.within(spec.length_decay.si());
        let droop = stream.within(spec.droop.si()) * stream.within(spec.form.si());
        let upturn = stream.within(spec.upturn.si());
        let bud_abortion = stream.within(spec.bud_abortion.si());
        let wobble = stream.within(spec.wobble.si());
        Self { limbs, scaffolds, divergence, length_decay, droop, upturn, bud_abortion, wobble }
    }
}

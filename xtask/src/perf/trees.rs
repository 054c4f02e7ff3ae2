//! Suite `trees`: how fast trees grow.

use orchard_spec::Spec;
use orchard_treegen::grow;

use super::timing::rate;
use crate::rows::{Effort, Measured, Row};

/// Whole default trees, a new one each time, on one core.
pub fn measure(_: Effort) -> anyhow::Result<Measured> {
    let spec = Spec::paper();
    let per_second = rate(|world| {
        std::hint::black_box(grow(&spec, 1, world)?);
        Ok(())
    })?;
    Ok(vec![Row::measured("trees.grow", per_second, "trees/s")].into())
}

//! Suite `wood`: material, beams, damping, sway and rupture of wood against measurements and closed forms.

mod figures;

use super::target;
use crate::rows::{Effort, Measured};

const MEASURED_TOML: &str = include_str!("../../../configs/measured/wood.toml");

/// Compares the figures of wood.
pub fn measure(_: Effort) -> anyhow::Result<Measured> {
    Ok(target::rows("wood", MEASURED_TOML, figures::figure)?.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_a_figure_or_says_why_not() {
        let rows = measure(Effort::Full).unwrap().rows;
        assert!(rows.len() > 15);
        target::tests::assert_all_meet(rows);
    }
}

//! Scratch of the linear solvers.

use super::cg::ConjugateGradients;
#[cfg(feature = "cholesky")]
use super::cholesky::SparseFactor;
use super::system::System;
use crate::aba::vectors::{Change, Impulse};

/// Factors and scratch of the solvers other than the articulated-body algorithm.
#[derive(Debug, Clone, Default)]
pub(crate) struct LinearScratch {
    pub system: System,
    pub(super) cg: ConjugateGradients,
    pub(super) impulse: Impulse,
    pub(super) change: Change,
    #[cfg(feature = "cholesky")]
    pub cholesky: Option<SparseFactor>,
}

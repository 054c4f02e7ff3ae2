//! Solvers of a substep.

/// Solver of the linear system of a substep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Solver {
    /// The articulated-body algorithm: exact, and the fastest.
    #[default]
    Aba,
    /// Matrix-free conjugate gradients, preconditioned by each joint's own block of the inertia: for comparison.
    ConjugateGradients,
}

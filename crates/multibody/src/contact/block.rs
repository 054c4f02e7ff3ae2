//! Blocks of the contact problem: three rows of a contact, or the row of a coupling.

use orchard_geometry::{Mat3, Vec3};

use super::law::Law;
use crate::spatial::Wrench;

/// Three unit impulses (one for each row of a block) on one side of a block.
#[derive(Debug, Clone, Copy)]
pub(super) enum Load {
    /// On the world.
    None,
    /// On a link, at its origin.
    Body { body: usize, wrenches: [Wrench; 3] },
    /// On a point body: the columns, at `r_spin` from its centre if it takes part in rotation.
    Point { point: usize, impulses: Mat3, r_spin: Option<Vec3> },
    /// On a degree of freedom, in the first row only.
    Dof { body: usize, dof: usize, factor: f64 },
}

/// Three rows of the contact problem.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    pub law: Law,
    /// Velocity of the rows before any contact impulse.
    pub v_free: Vec3,
    /// Impulse to start the solve from.
    pub guess: Vec3,
    /// Root mean square of the block's own inverse inertia [1/kg], which scales the regularisation.
    pub w: f64,
    /// Unit impulses along the rows.
    pub loads: [Load; 2],
}

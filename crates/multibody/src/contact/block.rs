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
    /// On a point body: the columns, at `r` from its centre.
    Point { point: usize, impulses: Mat3, r: Vec3, turns: Turns },
    /// On a degree of freedom, in the first row only.
    Dof { body: usize, dof: usize, factor: f64 },
}

/// Parts that a force beside the centre of a point body turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turns {
    /// Nothing.
    Nothing,
    /// The ball alone.
    Ball,
    /// The link of its tether, and the ball with it.
    Link(usize),
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

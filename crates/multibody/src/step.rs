//! One substep: kinematics, free solution, contacts, integration.

use orchard_geometry::Vec3;

use crate::contact::ContactReport;
use crate::data::Data;
use crate::model::Model;

/// Numbers of a substep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSettings {
    /// Length of the substep [s].
    pub h: f64,
    /// Gravity [m/s^2], world.
    pub gravity: Vec3,
    /// Contact stiffness [N/m].
    pub contact_stiffness: f64,
    /// Contact dissipation time [s].
    pub contact_dissipation_time: f64,
    /// Gap below which a pair of colliders becomes a contact candidate [m]; at least `h` times the fastest
    /// approach keeps bodies from sinking in before they are seen.
    pub contact_margin: f64,
}

/// What a substep did. Reuse it: its buffers are kept.
#[derive(Debug, Clone, Default)]
pub struct StepReport {
    /// Contacts that were candidates of the step; the force of an open one is zero.
    pub contacts: Vec<ContactReport>,
    /// Newton iterations of the contact solve; 0 where nothing touches.
    pub newton_iterations: usize,
    /// Residual of the contact solve relative to its impulses.
    pub residual: f64,
    /// Whether the contact solve met its tolerance.
    pub converged: bool,
}

/// Advances a world by one substep.
///
/// Velocities change first, then positions with the new velocities. Kinematics are brought up to date at the
/// start and at the end, so that the accessors of [`Data`] agree with `q` and `v` after the call; the cost is
/// paid once, since kinematics of an unchanged state are not computed again.
pub fn step(model: &Model, data: &mut Data, settings: &StepSettings, report: &mut StepReport) {
    let _ = (model, data, settings, report);
    todo!()
}

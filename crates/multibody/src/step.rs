//! One substep: kinematics, free solution, contacts, integration.

use orchard_geometry::Vec3;

use crate::data::{Data, forward_kinematics};
use crate::model::Model;
pub use crate::settings::{Integrator, StepReport, StepSettings};
use crate::substep::{advance, free_change};
use crate::{contact, midpoint};

/// Advances a world by one substep.
///
/// Velocities change first, then positions with the new velocities (with the mean of old and new under
/// [`Integrator::ImplicitMidpoint`]). Kinematics are brought up to date at the
/// start and at the end, so that the accessors of [`Data`] agree with `q` and `v` after the call; the cost is
/// paid once, since kinematics of an unchanged state are not computed again.
pub fn step(model: &Model, data: &mut Data, settings: &StepSettings, report: &mut StepReport) {
    forward_kinematics(model, data);
    free_spin(model, data, settings.h);
    match settings.integrator {
        Integrator::LinearlyImplicitEuler => {
            report.free = free_change(model, data, settings.h, &settings.gravity, settings.solver);
            contact::solve_contacts(model, data, settings, report);
            advance(model, data, settings.h);
        }
        Integrator::ImplicitMidpoint => midpoint::advance_by_midpoint(model, data, settings, report),
    }
    forward_kinematics(model, data);
}

/// Spin without contacts: lost implicitly off the tether; on it none, or that of the link.
fn free_spin(model: &Model, data: &mut Data, h: f64) {
    for index in 0..model.points.len() {
        if data.spins(model, index) {
            data.point_w_world[index] /= 1.0 + h * data.point_spin_damping[index];
        } else {
            let link = data.turns_with(model, index);
            data.point_w_world[index] = link.map_or_else(Vec3::zeros, |link| data.velocity(link).angular);
        }
    }
}

//! The spec's time, gravity and contact as settings of a multibody step.

use orchard_geometry::Vec3;
use orchard_multibody::{ContactPath, Integrator, Solver, StepSettings};
use orchard_spec::sim::SimSpec;

/// Settings of a substep that a spec describes.
pub fn step_settings(sim: &SimSpec) -> StepSettings {
    StepSettings {
        h: sim.substep(),
        gravity: Vec3::new(0.0, 0.0, -sim.gravity.si()),
        contact_dissipation_time: sim.contact_dissipation_time.si(),
        contact_margin: sim.contact_margin.si(),
        integrator: Integrator::default(),
        solver: Solver::default(),
        contact_path: ContactPath::default(),
    }
}

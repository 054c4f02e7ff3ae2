//! Static equilibrium.

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::Model;

/// Why no equilibrium was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StaticsError {
    /// The iteration ran out, or the state ran away (a buckling tree).
    #[error("no equilibrium after {iterations} iterations: the last one still moved by {step:e}")]
    NotConverged {
        /// Iterations made.
        iterations: usize,
        /// Largest change of a coordinate in the last one [rad or m].
        step: f64,
    },
}

/// Moves the sprung joints and the tethered point bodies to static equilibrium under gravity and the inputs,
/// at rest; the other degrees of freedom are held, and contacts are left out. Converged when no coordinate
/// moves by more than `tolerance` [rad or m] in an iteration. Gives the number of iterations.
///
/// # Errors
/// [`StaticsError::NotConverged`]; the state is then the last iterate.
pub fn equilibrium(
    model: &Model,
    data: &mut Data,
    gravity: &Vec3,
    tolerance: f64,
) -> Result<usize, StaticsError> {
    let _ = (model, data, gravity, tolerance);
    todo!()
}

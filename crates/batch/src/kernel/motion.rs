//! Motion of a link as the pass from root to leaf hands it on.

use super::instructions::Instructions;
use super::lane::Lane3;

/// A link's state.
pub(super) struct Here<S: Instructions> {
    pub axes: [Lane3<S>; 3],
    pub w: Lane3<S>,
    /// Velocity, position and bias accelerations at the origin.
    pub v: Lane3<S>,
    pub p: Lane3<S>,
    pub b_w: Lane3<S>,
    pub b_v: Lane3<S>,
    /// Differences of position, velocity and linear bias between origin and tip.
    pub d: Lane3<S>,
    pub v_d: Lane3<S>,
    pub b_d: Lane3<S>,
    /// Velocity of the end of the link's axis.
    pub w_cross_z: Lane3<S>,
}

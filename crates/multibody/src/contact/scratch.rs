//! Buffers of the contact solve.

use orchard_geometry::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

use super::block::Block;
use super::broad::BroadPhase;
use super::delassus::Delassus;
use super::matrix_free::Coordinates;
use super::narrow::NarrowScratch;
use super::newton::Newton;
use super::paths::Paths;
use super::report::ContactReport;
use super::touch::Touch;

/// Buffers of the contact solve.
#[derive(Debug, Clone, Default)]
pub(crate) struct ContactScratch {
    pub(super) broad: BroadPhase,
    pub(super) narrow: NarrowScratch,
    pub(super) touches: Vec<Touch>,
    /// Contact points with their contact frames (columns: two tangents, then the normal).
    pub(super) contacts: Vec<(ContactReport, Mat3)>,
    /// Contacts of the last step, whose forces are the first guess of the next. They change how fast the
    /// solve converges, and its result only below its tolerance.
    pub(super) last: Vec<ContactReport>,
    pub(super) last_couplings: Vec<Vec3>,
    pub(super) blocks: Vec<Block>,
    pub(super) paths: Paths,
    pub(super) delassus: Delassus,
    pub(super) coordinates: Coordinates,
    pub(super) newton: Newton,
}

/// First guess of the next contact solve: the only part of [`ContactScratch`] that outlives a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct WarmStart {
    contacts: Vec<ContactReport>,
    couplings: Vec<Vec3>,
}

impl ContactScratch {
    pub fn warm_start(&self) -> WarmStart {
        WarmStart { contacts: self.last.clone(), couplings: self.last_couplings.clone() }
    }

    pub fn set_warm_start(&mut self, warm_start: &WarmStart) {
        self.last.clone_from(&warm_start.contacts);
        self.last_couplings.clone_from(&warm_start.couplings);
    }
}

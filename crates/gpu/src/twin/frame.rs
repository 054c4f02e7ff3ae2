//! A frame: substeps, each inwards and outwards, with the trunk's part between those of the warps.

use super::Lane;
use super::outward::{Found, Way};
use crate::layout::{notice, world};
use crate::schedule::PARTS;

/// The trunk's part.
const TRUNK: usize = 0;

impl Lane<'_> {
    /// One frame of a running world.
    pub(super) fn frame(&mut self) {
        if self.world(world::STOPPED).to_bits() != 0 {
            return;
        }
        if self.world(world::NOTICE).to_bits() & notice::STALE as u32 != 0 {
            (TRUNK..PARTS).for_each(|part| {
                self.outward(part, Way::Look);
            });
        }
        let mut found = Found::default();
        for substep in 0..self.memory.rules.substeps {
            self.memory.substep = substep;
            (1..PARTS).for_each(|part| self.inward(part));
            self.inward(TRUNK);
            let is_last = substep + 1 == self.memory.rules.substeps;
            let way = if is_last { Way::Test } else { Way::Advance };
            for part in TRUNK..PARTS {
                let Found { notice, peak } = self.outward(part, way);
                found = Found { notice: found.notice | notice, peak: found.peak.max(peak) };
            }
        }
        self.set_world(world::NOTICE, f32::from_bits(found.notice as u32));
        let peak = self.world(world::PEAK).max(found.peak);
        self.set_world(world::PEAK, peak);
    }
}

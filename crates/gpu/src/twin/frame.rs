//! A frame: substeps, each level by level inwards to the trunk and outwards again.

use super::Lane;
use super::outward::{Found, Way};
use crate::layout::{notice, world};
use crate::schedule::PARTS;

impl Lane<'_> {
    /// One frame of a running world; or of settling, with rules of its own, for those that are reset: each substep starts at rest.
    pub(super) fn frame(&mut self) {
        let settles = self.memory.settles;
        if self.world(world::STOPPED).to_bits() != 0 || settles && self.world(world::RESET) == 0.0 {
            return;
        }
        if self.world(world::NOTICE).to_bits() & notice::STALE as u32 != 0 {
            (0..PARTS).for_each(|part| {
                self.outward(part, Way::Look);
            });
        }
        let mut found = Found::default();
        for substep in 0..self.memory.rules.substeps {
            self.memory.substep = substep;
            (0..PARTS).rev().for_each(|part| self.inward(part));
            let is_last = substep + 1 == self.memory.rules.substeps && !settles;
            let way = if is_last { Way::Test } else { Way::Advance };
            for part in 0..PARTS {
                let Found { notice, peak } = self.outward(part, way);
                found = Found { notice: found.notice | notice, peak: found.peak.max(peak) };
            }
        }
        self.conclude(found);
    }

    /// Notes what the parts of a world have found.
    pub(super) fn conclude(&mut self, found: Found) {
        // Settling has left motions of another substep.
        let left = if self.memory.settles { notice::STALE } else { found.notice };
        self.set_world(world::NOTICE, f32::from_bits(left as u32));
        let peak = self.world(world::PEAK).max(found.peak);
        self.set_world(world::PEAK, peak);
    }
}

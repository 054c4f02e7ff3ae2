//! Places in the bucket, filled in turn.

use crate::expert::config::PlaceConfig;
use crate::postures::{ACROSS, hand_down};
use orchard_geometry::Vec3;
use orchard_robot::{ArmKinematics, Bucket, JointVector};

/// Postures over each place and lowered to it, layer upon layer, and how many have been used.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Slots {
    postures: Vec<[JointVector; 2]>,
    filled: usize,
}

impl Slots {
    pub fn new(arm: &ArmKinematics, bucket: &Bucket, carry: &JointVector, c: &PlaceConfig) -> Self {
        let mut postures = Vec::new();
        for layer in 0..c.layers.get() {
            let release = c.release.si() + f64::from(layer) * c.layer.si();
            let heights = [c.above.si().max(release), release];
            for x in &c.along {
                for y in &c.across {
                    let place = bucket.p_base + Vec3::new(x.si(), y.si(), 0.0);
                    postures.extend(hand_down(arm, &place, heights, &ACROSS, carry));
                }
            }
        }
        Self { postures, filled: 0 }
    }

    /// Over the next free place and down in it; once all are full the top layer's are used again. `None` where the
    /// arm reaches no place.
    pub fn next(&self) -> Option<[JointVector; 2]> {
        self.postures.get(self.filled).or(self.postures.last()).copied()
    }

    /// A fruit has been let go.
    pub fn fill(&mut self) {
        self.filled += 1;
    }
}

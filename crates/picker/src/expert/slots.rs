//! Places for fruit in the bucket, filled in turn.

use crate::expert::config::PlaceConfig;
use crate::postures::{ACROSS, hand_down};
use orchard_geometry::Vec3;
use orchard_robot::{ArmKinematics, Bucket, JointVector};

/// Postures above each place and lowered to it, layer upon layer, and the number of filled places.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Slots {
    bucket: Bucket,
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
        Self { bucket: *bucket, postures, filled: 0 }
    }

    /// True if a point of the base frame lies above or in the bucket.
    pub fn covers(&self, p_base: &Vec3) -> bool {
        let off = (p_base - self.bucket.p_base).abs();
        off.x < self.bucket.half.x && off.y < self.bucket.half.y
    }

    /// Returns the postures above the next free place and lowered to it; once all are filled, the last one again. `None` if the arm reaches
    /// no place.
    pub fn next(&self) -> Option<[JointVector; 2]> {
        self.postures.get(self.filled).or(self.postures.last()).copied()
    }

    /// Counts a place as filled.
    pub fn fill(&mut self) {
        self.filled += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use crate::postures::Postures;
    use orchard_robot::RobotModel;

    /// All places are reached, inside the bucket and hand down; those of a layer are a fruit's width apart, and a
    /// layer lies over the one before.
    #[test]
    fn places_fill_the_bucket_layer_upon_layer() {
        let (robot, config) = (RobotModel::paper(), ExpertConfig::preset());
        let (arm, bucket, c) = (robot.kinematics(), robot.bucket(), &config.place);
        let carry = Postures::new(arm, &bucket, &config.shared).carry();
        let mut slots = Slots::new(arm, &bucket, &carry, c);
        let in_layer = c.along.len() * c.across.len();
        assert_eq!(slots.postures.len(), in_layer * c.layers.get() as usize);
        let x_low: Vec<_> = slots.postures.iter().map(|[_, low]| arm.tcp(low)).collect();
        for (i, x) in x_low.iter().enumerate() {
            let p = x.translation.vector;
            let height = c.release.si() + c.layer.si() * (i / in_layer) as f64;
            // Tolerance of the inverse kinematics.
            assert!((p.z - height).abs() < 1e-3);
            let off = (p - bucket.p_base).abs();
            assert!(off.x < bucket.half.x && off.y < bucket.half.y);
            assert!((x.rotation * Vec3::z()).z < -0.999);
            let layer = &x_low[i - i % in_layer..i];
            assert!(layer.iter().all(|other| (other.translation.vector - p).norm() > 0.065));
        }
        // Full: the last place is used again.
        let last = slots.postures.last().copied();
        for _ in 0..100 {
            slots.fill();
        }
        assert_eq!(slots.next(), last);
    }
}

//! Places for fruit in the bucket, filled in turn.

use crate::expert::config::PlaceConfig;
use crate::postures::{ACROSS, hand_down};
use orchard_geometry::Vec3;
use orchard_robot::{ArmKinematics, Bucket, JointVector};

/// A place, by the postures above it and at the height at which a fruit is let go there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slot {
    pub above: JointVector,
    pub low: JointVector,
    /// Length by which the slow end of the way down is longer than at a place of the layers \[m\]: the hand does not know where the fruit lands.
    pub unsure: f64,
}

/// Places in layers, and the number of fruit in the bucket, as far as the hand knows.
///
/// Once all places are filled, further fruit are laid on top, in turn; the hand then goes down until it lands, for somebody may have emptied the bucket.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Slots {
    bucket: Bucket,
    places: Vec<Slot>,
    on_top: Vec<Slot>,
    filled: usize,
    /// Height of a layer \[m\].
    layer: f64,
}

impl Slots {
    pub fn new(arm: &ArmKinematics, bucket: &Bucket, carry: &JointVector, c: &PlaceConfig) -> Self {
        let height = |layer: u32| c.release.si() + f64::from(layer) * c.layer.si();
        let of_layer = |above: f64, release: f64, unsure: f64| {
            let across = |x: f64| c.across.iter().map(move |y| Vec3::new(x, y.si(), 0.0));
            let offs = c.along.iter().flat_map(move |x| across(x.si()));
            offs.filter_map(move |off| {
                let postures =
                    hand_down(arm, &(bucket.p_base + off), [above.max(release), release], &ACROSS, carry);
                postures.map(|[above, low]| Slot { above, low, unsure })
            })
        };
        let layers = c.layers.get();
        let places = (0..layers).flat_map(|layer| of_layer(c.above.si(), height(layer), 0.0)).collect();
        let on_top =
            of_layer(c.above.si().max(height(layers)), height(0), height(layers) - height(0)).collect();
        Self { bucket: *bucket, places, on_top, filled: 0, layer: c.layer.si() }
    }

    /// True if a point of the base frame lies above or in the bucket.
    pub fn covers(&self, p_base: &Vec3) -> bool {
        self.bucket.covers(p_base)
    }

    /// Returns the next free place, or one on top of a full bucket. `None` if the arm reaches no place.
    pub fn next(&self) -> Option<Slot> {
        let over = self.filled.saturating_sub(self.places.len());
        let on_top = || self.on_top.get(over % self.on_top.len().max(1));
        self.places.get(self.filled).or_else(on_top).copied()
    }

    /// Counts a fruit that was let go `height` \[m\] above the low posture of its place. If the bucket counts as full, and the hand came down to its floor, the bucket was
    /// empty, and the count begins anew.
    pub fn fill(&mut self, height: f64) {
        let was_emptied = self.filled >= self.places.len() && height < self.layer;
        self.filled = if was_emptied { 1 } else { self.filled + 1 };
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
        assert_eq!(slots.places.len(), in_layer * c.layers.get() as usize);
        let x_low: Vec<_> = slots.places.iter().map(|slot| arm.tcp(&slot.low)).collect();
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
        for place in 0..slots.places.len() {
            assert_eq!(slots.next(), Some(slots.places[place]));
            slots.fill(0.0);
        }
    }

    /// On a full bucket fruit are laid in turn, with a way down to the floor; a hand that comes down to it knows that the bucket was emptied.
    #[test]
    fn an_emptied_bucket_is_felt() {
        let (robot, config) = (RobotModel::paper(), ExpertConfig::preset());
        let (arm, bucket, c) = (robot.kinematics(), robot.bucket(), &config.place);
        let carry = Postures::new(arm, &bucket, &config.shared).carry();
        let mut slots = Slots::new(arm, &bucket, &carry, c);
        let (in_layer, layers) = (c.along.len() * c.across.len(), c.layers.get() as usize);
        (0..in_layer * layers).for_each(|_| slots.fill(0.0));
        let on_top: Vec<Slot> = (0..in_layer)
            .map(|_| {
                let slot = slots.next().expect("within reach");
                slots.fill(c.layer.si() * layers as f64);
                slot
            })
            .collect();
        for (i, slot) in on_top.iter().enumerate() {
            let depth = arm.tcp(&slot.low).translation.vector.z - c.release.si();
            assert!(depth.abs() < 1e-3 && (slot.unsure - c.layer.si() * layers as f64).abs() < 1e-12);
            assert!(!on_top[..i].contains(slot), "{i}");
        }
        assert_eq!(slots.next(), Some(on_top[0]), "in turn");
        slots.fill(0.5 * c.layer.si());
        assert_eq!(slots.next(), Some(slots.places[1]), "the fruit lies on the floor");
    }
}

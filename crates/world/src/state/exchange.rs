//! Exchange of the bucket: a helper takes a full one off the field and leaves an empty one.

use super::State;
use crate::build::Parts;
use crate::event::WorldEvent;
use orchard_fruit::{Phase, Resting};
use orchard_geometry::{Pose, Vec3, inverse_transform};
use orchard_spec::Spec;

/// Place of fruit off the field, as a share of the way to the edge of the plausible box: high above a corner of the ground, beyond the range of depth cameras; our choice.
const ASIDE: f64 = 0.95;

impl State {
    /// Takes the fruit that sleep in the bucket off the field, once they are `fruit.bucket_exchange` and the hand is not over the bucket.
    pub(super) fn exchange_bucket(&mut self, spec: &Spec, parts: &Parts, x_world_base: &Pose) {
        let Some(full) = &spec.fruit.bucket_exchange else { return };
        let (set, bucket) = (&parts.fruit, &parts.handle.bucket);
        let lies_in_it = |i: &usize| match self.fruit.phase(*i) {
            Phase::Asleep(Resting::Base(p_base)) => self.fruit.is_deposited(*i) && bucket.contains(&p_base),
            _ => false,
        };
        let fruit: Vec<usize> = (0..set.len()).filter(lies_in_it).collect();
        let p_hand = parts.handle.x_world_tcp(&self.data).translation.vector;
        if fruit.len() < full.get() as usize || bucket.covers(&inverse_transform(x_world_base, &p_hand)) {
            return;
        }
        let edge = ASIDE * spec.sim.plausible_extent.si();
        let frame = self.frame;
        for i in fruit {
            let along = 2.0 * edge * (i as f64 + 0.5) / set.len() as f64 - edge;
            self.fruit.take_away(set, &mut self.data, i, Vec3::new(-edge, along, edge));
            self.events.push(WorldEvent::FruitTakenAway { fruit: i, frame });
        }
    }
}

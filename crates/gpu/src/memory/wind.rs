//! Wind of the worlds of a batch.

use std::f64::consts::TAU;

use orchard_batch::TreeWorld;
use orchard_geometry::math;

use super::{Memory, Place};
use crate::layout::{QUAD, air, link, pull, tile, wave, world};
use crate::schedule::PARTS;

impl Memory {
    /// Places and drag areas of a world's links and fruit, and the waves of its gusts; nothing in still air.
    pub(super) fn load_wind(&mut self, given: &TreeWorld, number: usize, lane: usize, place: &Place) {
        let plant = given.plant();
        let Some(weather) = &plant.weather else { return };
        let (wind, places) = (weather.wind(), weather.sail().places());
        let place_of = |segment| f32::from_bits(places.of_segment(segment) as u32);
        let of_tile = self.header(number, tile::STARTS + PARTS);
        let airs = of_tile * (link::FIELDS + self.laws.behind_links()[0]);
        for (segment, row) in place.rows.iter().enumerate() {
            let [wood, leaves] = weather.sail().of(segment);
            let per_mass = 1.0 / plant.model.body(plant.tree.bodies[segment]).inertia.mass;
            for (field, value) in [
                (air::WOOD, wood as f32),
                (air::LEAVES, leaves as f32),
                (air::PER_MASS, per_mass as f32),
                (air::PLACE, place_of(segment)),
            ] {
                let at = self.behind_links_at(number, airs + row * air::FIELDS + field, lane);
                self.links[at] = value;
            }
        }
        let waves = airs + of_tile * air::FIELDS;
        let stride = wave::FIELDS + 2 * QUAD * self.rules.fours as usize;
        for (k, of_wave) in wind.waves().enumerate() {
            let back = of_wave.turns_back(&wind.mean(), plant.spec.sim.frame());
            let mut numbers = vec![(wave::BACK, f32::from_bits(back))];
            for axis in 0..3 {
                numbers.push((wave::COSINE + axis, of_wave.cosine[axis] as f32));
                numbers.push((wave::SINE + axis, of_wave.sine[axis] as f32));
            }
            for (n, p_world) in places.p_world().iter().enumerate() {
                let (sine, cosine) = math::sin_cos(TAU * of_wave.turns_at(p_world));
                let at = wave::FIELDS + 2 * QUAD * (n / QUAD) + n % QUAD;
                numbers.extend([(at, cosine as f32), (at + QUAD, sine as f32)]);
            }
            for (field, value) in numbers {
                let at = self.behind_links_at(number, waves + k * stride + field, lane);
                self.links[at] = value;
            }
        }
        for (n, p_world) in places.p_world().iter().enumerate() {
            let profile = waves + self.rules.waves as usize * stride + n;
            let at = self.behind_links_at(number, profile, lane);
            self.links[at] = wind.profile(p_world.z) as f32;
        }
        for (fruit, &row) in plant.fruit.fruit.iter().zip(&*place.fruit_rows) {
            let at = self.fruit_at(number, row, self.laws.pull_field() + pull::PLACE, lane);
            self.fruit[at] = place_of(fruit.segment);
        }
        let at = self.world_at(number, world::BEGAN, lane);
        self.worlds[at] = f32::from_bits(given.frame().wrapping_neg());
    }
}

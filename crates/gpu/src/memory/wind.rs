//! Wind of the worlds of a batch.

use std::f64::consts::TAU;

use orchard_batch::TreeWorld;

use super::Memory;
use crate::layout::{air, link, tile, wave, world};
use crate::schedule::PARTS;

/// Units of a turn.
const UNITS: f64 = 4_294_967_296.0;

impl Memory {
    /// Drag areas of a world's links, which are in these rows, and the waves of its gusts; nothing in still air.
    pub(super) fn load_wind(&mut self, given: &TreeWorld, number: usize, lane: usize, rows: &[usize]) {
        let plant = given.plant();
        let Some(weather) = &plant.weather else { return };
        let of_tile = self.header(number, tile::STARTS + PARTS);
        let airs = of_tile * (link::FIELDS + self.laws.behind_links()[0]);
        for (segment, row) in rows.iter().enumerate() {
            let [wood, leaves] = weather.sail().of(segment);
            for (field, value) in [(air::WOOD, wood), (air::LEAVES, leaves)] {
                let at = self.behind_links_at(number, airs + row * air::FIELDS + field, lane);
                self.links[at] = value as f32;
            }
        }
        let waves = airs + of_tile * air::FIELDS;
        let turns_of_mean = weather.wind().mean() * plant.spec.sim.frame() / TAU;
        for (k, of_wave) in weather.wind().waves().enumerate() {
            let back = of_wave.wave.dot(&turns_of_mean);
            // A whole turn leaves the phase as it is, so that the fraction is enough.
            let back = ((back - back.floor()) * UNITS).round() as u64 as u32;
            let mut numbers = vec![(wave::BACK, f32::from_bits(back))];
            for axis in 0..3 {
                numbers.push((wave::TURNS + axis, (of_wave.wave[axis] / TAU) as f32));
                numbers.push((wave::COSINE + axis, of_wave.cosine[axis] as f32));
                numbers.push((wave::SINE + axis, of_wave.sine[axis] as f32));
            }
            for (field, value) in numbers {
                let at = self.behind_links_at(number, waves + k * wave::FIELDS + field, lane);
                self.links[at] = value;
            }
        }
        let at = self.world_at(number, world::BEGAN, lane);
        self.worlds[at] = f32::from_bits(given.frame().wrapping_neg());
    }
}

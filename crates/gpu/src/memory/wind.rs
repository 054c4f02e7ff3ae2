//! Wind of the worlds of a batch.

use std::f64::consts::TAU;

use orchard_batch::{Plant, TreeWorld};
use orchard_geometry::math;

use super::{Memory, Place};
use crate::layout::{QUAD, air, link, tile, wave};
use crate::schedule::PARTS;

/// Number of groups of four places at which a tree samples the air; 0 in still air.
pub(super) fn fours(plant: &Plant) -> usize {
    plant.weather.as_ref().map_or(0, |weather| weather.sail().places().p_world().len().div_ceil(QUAD))
}

impl Memory {
    /// Returns what the device needs of a world's wind: drag areas of the links, waves of the gusts, and shares of the mean speed. Each quad comes with its place in the buffer of links. Empty in still air.
    pub(super) fn wind_quads(&self, plant: &Plant, place: &Place) -> Vec<(u32, [f32; QUAD])> {
        let Some(weather) = &plant.weather else { return Vec::new() };
        let (wind, places) = (weather.wind(), weather.sail().places());
        let of_tile = self.header(place.tile, tile::STARTS + PARTS);
        let at = |field| (self.behind_links_at(place.tile, field, place.lane) / QUAD) as u32;
        let airs = of_tile * (link::FIELDS + self.laws.behind_links()[0]);
        let mut quads = Vec::new();
        for (segment, row) in place.rows.iter().enumerate() {
            let [wood, leaves] = weather.sail().of(segment);
            let per_mass = 1.0 / plant.model.body(plant.tree.bodies[segment]).inertia.mass;
            let of_air = f32::from_bits(places.of_segment(segment) as u32);
            let own = [wood as f32, leaves as f32, per_mass as f32, of_air];
            quads.push((at(airs + row * air::FIELDS + air::WOOD), own));
        }
        let waves = airs + of_tile * air::FIELDS;
        let stride = wave::FIELDS + 2 * QUAD * self.rules.fours as usize;
        let fours = places.p_world().chunks(QUAD);
        for (k, of_wave) in wind.waves().enumerate() {
            let back = of_wave.turns_back(&wind.mean(), plant.spec.sim.frame());
            let [c, s] = [of_wave.cosine, of_wave.sine].map(|along| along.map(|x| x as f32));
            let first = waves + k * stride;
            quads.push((at(first + wave::COSINE), [c.x, c.y, c.z, f32::from_bits(back)]));
            quads.push((at(first + wave::SINE), [s.x, s.y, s.z, 0.0]));
            for (n, four) in fours.clone().enumerate() {
                let (mut sines, mut cosines) = ([0.0; QUAD], [0.0; QUAD]);
                for (p_world, own) in four.iter().zip(sines.iter_mut().zip(&mut cosines)) {
                    let (sine, cosine) = math::sin_cos(TAU * of_wave.turns_at(p_world));
                    (*own.0, *own.1) = (sine as f32, cosine as f32);
                }
                let phases = first + wave::FIELDS + 2 * QUAD * n;
                quads.extend([(at(phases), cosines), (at(phases + QUAD), sines)]);
            }
        }
        for (n, four) in fours.enumerate() {
            let mut profile = [0.0; QUAD];
            four.iter().zip(&mut profile).for_each(|(p, own)| *own = wind.profile(p.z) as f32);
            quads.push((at(waves + self.rules.waves as usize * stride + n * QUAD), profile));
        }
        quads
    }

    /// Frame before the first one of a world's wind, by the count of its own frames in this batch, as bits.
    pub(super) fn began(&self, place: &Place, given: &TreeWorld) -> u32 {
        self.rules.frame.wrapping_sub(place.missed).wrapping_sub(given.frame())
    }
}

//! Air of one world in f32, some frames at a time.

use crate::kernel::{Gusts, WAVE_STEPS, WaveNumbers};
use crate::layout::{Aligned, LINE};
use orchard_geometry::math;
use orchard_treephys::wind::Weather;

/// Frames of a block.
const FRAMES: usize = 2 * WAVE_STEPS + 1;

/// Velocity of the air at the places of a world, in the frames of a block. Blocks follow the world's own clock, so that its air does not depend on other worlds.
#[derive(Debug, Clone)]
pub(crate) struct Breeze {
    /// Number of places, rounded up to whole vectors of any width.
    width: usize,
    waves: Vec<WaveNumbers>,
    /// Phase of each wave at each place at time 0 \[turns\], `[wave][place]`.
    phases: Aligned,
    /// Mean speed over that at the height of the canopy, by place.
    profile: Aligned,
    /// Mean velocity at the height of the canopy [m/s].
    mean: [f32; 3],
    /// Velocity of the air [m/s], `[frame][axis][place]`.
    block: Aligned,
    /// Number of the block.
    number: Option<i64>,
}

impl Breeze {
    /// The air of a world with frames of a length \[s\].
    pub fn new(weather: &Weather, frame: f64) -> Self {
        let (wind, places) = (weather.wind(), weather.sail().places().p_world());
        let width = places.len().next_multiple_of(LINE);
        let mut breeze = Self {
            width,
            waves: Vec::new(),
            phases: Aligned::zeros(wind.waves().count() * width),
            profile: Aligned::zeros(width),
            mean: [0, 1, 2].map(|k| wind.mean()[k] as f32),
            block: Aligned::zeros(FRAMES * 3 * width),
            number: None,
        };
        for (k, p_world) in places.iter().enumerate() {
            breeze.profile.as_mut_slice()[k] = wind.profile(p_world.z) as f32;
        }
        for (wave, phases) in wind.waves().zip(breeze.phases.as_mut_slice().chunks_exact_mut(width)) {
            for (phase, p_world) in phases.iter_mut().zip(places) {
                *phase = wave.turns_at(p_world) as f32;
            }
            let of_frame = wave.wave.dot(&wind.mean()) * frame;
            breeze.waves.push(WaveNumbers {
                back: wave.turns_back(&wind.mean(), frame),
                cosine: [0, 1, 2].map(|k| wave.cosine[k] as f32),
                sine: [0, 1, 2].map(|k| wave.sine[k] as f32),
                steps: std::array::from_fn(|k| {
                    let (sin, cos) = math::sin_cos((k + 1) as f64 * of_frame);
                    [cos as f32, sin as f32]
                }),
            });
        }
        breeze
    }

    /// The work for the block with a frame of the world's clock; `None` if it is done. `scratch` is memory for [`Gusts`].
    pub fn advance_to<'a>(&'a mut self, clock: i64, scratch: &'a mut Aligned) -> Option<Gusts<'a>> {
        let number = clock.div_euclid(FRAMES as i64);
        if self.number.replace(number) == Some(number) {
            return None;
        }
        let Self { waves, phases, profile, block, .. } = self;
        Some(Gusts {
            clock: number * FRAMES as i64 + WAVE_STEPS as i64,
            waves,
            phases: phases.as_slice(),
            profile: profile.as_slice(),
            mean: self.mean,
            block: block.as_mut_slice(),
            scratch,
        })
    }

    /// Velocity of the air [m/s] in a frame of the block, by axis and place.
    pub fn at(&self, clock: i64) -> [&[f32]; 3] {
        let frame = clock.rem_euclid(FRAMES as i64) as usize;
        let axes = &self.block.as_slice()[frame * 3 * self.width..][..3 * self.width];
        [0, 1, 2].map(|axis| &axes[axis * self.width..][..self.width])
    }

    /// Memory \[bytes\].
    pub fn bytes(&self) -> usize {
        let numbers = [&self.phases, &self.profile, &self.block].map(|part| part.as_slice().len());
        size_of::<f32>() * numbers.into_iter().sum::<usize>() + size_of_val(self.waves.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::Isa;
    use crate::tree_world::TreeWorld;
    use orchard_spec::{Preset, Spec};
    use std::f64::consts::PI;
    use std::sync::Arc;

    /// In every frame of a block, at the start and after half an hour, in every set of instructions. The bound is a few units in the last place of the sum of 72
    /// waves, and half of 2^-32 turns of each wave's phase a frame.
    #[test]
    fn it_is_the_wind_of_f64() {
        let mut spec = Spec::preset(Preset::MeasuredWood);
        let wind = spec.wind.as_mut().unwrap();
        wind.speed = wind.speed.with_value(12.0).unwrap();
        let world = TreeWorld::grow(Arc::new(spec), 7, 0).unwrap();
        let frame = world.plant().spec.sim.frame();
        let weather = world.plant().weather.as_ref().unwrap();
        for isa in Isa::available() {
            let (mut breeze, mut scratch) =
                (Breeze::new(weather, frame), Gusts::scratch(weather.wind().waves().count()));
            let amplitude: f64 =
                weather.wind().waves().map(|wave| wave.cosine.norm() + wave.sine.norm()).sum();
            for clock in (0..2 * FRAMES as i64).chain(108_000..108_000 + FRAMES as i64) {
                if let Some(gusts) = breeze.advance_to(clock, &mut scratch) {
                    isa.run(gusts);
                }
                for (k, p_world) in weather.sail().places().p_world().iter().enumerate() {
                    let truth = weather.wind().velocity(p_world, clock as f64 * frame);
                    for (axis, found) in breeze.at(clock).iter().enumerate() {
                        let error = (f64::from(found[k]) - truth[axis]).abs();
                        let bound = 2e-5 + amplitude * PI / 4_294_967_296.0 * clock as f64;
                        assert!(error < bound, "{isa:?}, frame {clock}: {error} m/s");
                    }
                }
            }
        }
    }
}

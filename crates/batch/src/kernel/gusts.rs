//! Gusts of one world in f32 (`docs/computation/batch.md`, Wind). The entries of a vector are places here, not worlds.

use super::instructions::Instructions;
use super::lane::{Lane, Lane3, add, axmy, axpy, scale, store3, sub};
use super::{Task, polynomial};
use crate::layout::{Aligned, LINE};
use pulp::bytemuck;

/// Frames on either side of the middle of a block.
pub(crate) const WAVE_STEPS: usize = 8;
/// Frames on either side that are summed up at once: their sums fit into 16 registers.
const AT_ONCE: usize = 2;
/// Numbers of a wave at a place in the middle of a block.
const FIELDS: usize = 6;

/// Coefficients of sin(pi x) / x and cos(pi x) by the square of x, |x| <= 1/2 (interpolated at the Chebyshev nodes), to 5e-8.
const TURN_SINE: [f32; 5] = [7.765_591e-2, -5.982_904e-1, 2.550_077_4, -5.167_71, std::f32::consts::PI];
const TURN_COSINE: [f32; 5] = [2.196_824_2e-1, -1.331_873, 4.058_411, -4.934_793, 1.0];
/// 1.5 * 2^23: a sum with it is rounded to a whole number.
const ROUNDING: f32 = 12_582_912.0;
/// One turn over 2^32.
const PER_TURN: f32 = 2.328_306_4e-10;

/// A wave of the gusts, `cosine cos t + sine sin t`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WaveNumbers {
    /// Turns back per frame, times 2^32.
    pub back: u32,
    /// Amplitudes at the height of the canopy [m/s].
    pub cosine: [f32; 3],
    pub sine: [f32; 3],
    /// Cosine and sine of the phase of 1, 2, ... frames.
    pub steps: [[f32; 2]; WAVE_STEPS],
}

/// The air at all places of a world in the frames of a block.
#[derive(Debug)]
pub(crate) struct Gusts<'a> {
    /// Frame in the middle of the block.
    pub clock: i64,
    pub waves: &'a [WaveNumbers],
    /// Phase at time 0 \[turns\], `[wave][place]`.
    pub phases: &'a [f32],
    /// Mean speed over that at the height of the canopy, by place.
    pub profile: &'a [f32],
    /// Mean velocity at the height of the canopy [m/s].
    pub mean: [f32; 3],
    /// Result [m/s], `[frame][axis][place]`.
    pub block: &'a mut [f32],
    /// Memory for the waves at a vector of places.
    pub scratch: &'a mut Aligned,
}

impl Gusts<'_> {
    /// Scratch for a number of waves and vectors of any width.
    pub fn scratch(waves: usize) -> Aligned {
        Aligned::zeros(waves * FIELDS * LINE)
    }
}

impl Task for Gusts<'_> {
    type Output = ();

    #[inline(always)]
    fn with<S: Instructions>(self, simd: S) {
        let scratch: &mut [S::Vector] = bytemuck::cast_slice_mut(self.scratch.as_mut_slice());
        let at_waves = scratch.as_chunks_mut::<FIELDS>().0;
        let phases: &[S::Vector] = bytemuck::cast_slice(self.phases);
        let block: &mut [S::Vector] = bytemuck::cast_slice_mut(self.block);
        let profile: &[S::Vector] = bytemuck::cast_slice(self.profile);
        let width = profile.len();
        let mean = self.mean.map(|mean| Lane::splat(simd, mean));
        for (k, profile) in profile.iter().enumerate() {
            let profile = Lane::load(simd, *profile);
            let mut middle = [Lane::splat(simd, 0.0); 3];
            for (n, (wave, at_wave)) in self.waves.iter().zip(at_waves.iter_mut()).enumerate() {
                let (gust, lag) =
                    in_the_middle(simd, wave, self.clock, Lane::load(simd, phases[n * width + k]));
                middle = add(middle, gust);
                store3::<S>(&mut at_wave[..3], gust);
                store3::<S>(&mut at_wave[3..], lag);
            }
            let places = Places { profile, mean, width, k };
            places.set(block, WAVE_STEPS, middle);
            for first in (0..WAVE_STEPS).step_by(AT_ONCE) {
                let mut even = [[Lane::splat(simd, 0.0); 3]; AT_ONCE];
                let mut odd = even;
                for (wave, at_wave) in self.waves.iter().zip(at_waves.iter()) {
                    let [gust, lag] =
                        [0, 3].map(|from| [0, 1, 2].map(|axis| Lane::load(simd, at_wave[from + axis])));
                    for step in 0..AT_ONCE {
                        let [cos, sin] = wave.steps[first + step];
                        even[step] = axpy(Lane::splat(simd, cos), gust, even[step]);
                        odd[step] = axpy(Lane::splat(simd, sin), lag, odd[step]);
                    }
                }
                for step in 0..AT_ONCE {
                    places.set(block, WAVE_STEPS + 1 + first + step, add(even[step], odd[step]));
                    places.set(block, WAVE_STEPS - 1 - first - step, sub(even[step], odd[step]));
                }
            }
        }
    }
}

/// A vector of places.
struct Places<S: Instructions> {
    profile: Lane<S>,
    mean: Lane3<S>,
    /// Number of vectors, and which of them.
    width: usize,
    k: usize,
}

impl<S: Instructions> Places<S> {
    /// Sets the air of a frame. (Not a closure: one that is called often is compiled apart, without the instructions of `S`.)
    #[inline(always)]
    fn set(&self, block: &mut [S::Vector], frame: usize, gust: Lane3<S>) {
        let air = scale(self.profile, add(self.mean, gust));
        for axis in 0..3 {
            block[(3 * frame + axis) * self.width + self.k] = air[axis].value;
        }
    }
}

/// Velocity of a wave, and that of a quarter turn later in time.
#[inline(always)]
fn in_the_middle<S: Instructions>(
    simd: S,
    wave: &WaveNumbers,
    clock: i64,
    phase: Lane<S>,
) -> (Lane3<S>, Lane3<S>) {
    // Whole numbers keep the phase exact in any frame.
    let back = (wave.back.wrapping_mul(clock as u32) as i32) as f32 * PER_TURN;
    let turns = phase - Lane::splat(simd, back);
    let rounding = Lane::splat(simd, ROUNDING);
    let part = turns - ((turns + rounding) - rounding);
    // Sine and cosine of the whole turn from those of half of it.
    let square = part * part;
    let s = part * polynomial(simd, &TURN_SINE, square);
    let c = polynomial(simd, &TURN_COSINE, square);
    let double = s + s;
    let (sine, cosine) = (double * c, double.take_from(s, Lane::splat(simd, 1.0)));
    let [of_cosine, of_sine] =
        [wave.cosine, wave.sine].map(|amplitude| amplitude.map(|a| Lane::splat(simd, a)));
    (axpy(cosine, of_cosine, scale(sine, of_sine)), axmy(cosine, of_sine, scale(sine, of_cosine)))
}

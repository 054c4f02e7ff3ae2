//! Draws of the axes, from the same words as `orchard_spec::randomisation` in f64. A number is rounded to f32 once. At the ends of a truncated normal distribution
//! one draw in some ten million falls on the other side of the end; then all later draws of its stream differ.

use std::f32::consts::TAU;

use super::Lane;
use super::chacha::Stream;
use super::math::{Vec3, e_to, ln, ln_1p, sin_cos};
use crate::layout::{QUAD, axis, base, dial};

/// Number of the 53 bits of a uniform number that are in the second word.
const HIGH_BITS: u32 = 21;
/// Weights of the lowest bit of the second word, and of the lowest bit of all.
const HIGH_UNIT: f32 = 1.0 / (1_u32 << 21) as f32;
const LOW_UNIT: f32 = 1.0 / (1_u64 << 53) as f32;
/// Largest number of draws from a truncated normal distribution; then the mean is used (`Stream::cut_normal`).
const REDRAWS: u32 = 1000;
/// Below this number u, ln(1 - u) is computed from u itself, since the difference 1 - u would round.
const NEAR_ONE: f32 = 0.25;

/// Lower 32 of the 53 bits.
fn low_word([low, high]: [u32; 2]) -> f32 {
    (high << HIGH_BITS | low >> (32 - HIGH_BITS)) as f32 * LOW_UNIT
}

/// Uniform number in [0, 1).
pub(super) fn unit_of(pair: [u32; 2]) -> f32 {
    ((pair[1] >> (32 - HIGH_BITS)) as f32).mul_add(HIGH_UNIT, low_word(pair))
}

/// One minus that number, with the precision of a small number.
fn rest_of(pair: [u32; 2]) -> f32 {
    let high = (1 << HIGH_BITS) - (pair[1] >> (32 - HIGH_BITS));
    (high as f32).mul_add(HIGH_UNIT, -low_word(pair)).max(LOW_UNIT)
}

/// Factor at some strength: exactly 1 at strength 0.
fn at_strength(factor: f32, strength: f32) -> f32 {
    e_to(strength * ln(factor))
}

impl Lane<'_> {
    fn uniform_of(&self, stream: &mut Stream, low: f32, high: f32) -> f32 {
        (high - low).mul_add(unit_of(self.next_pair(stream)), low)
    }

    /// Normal deviate (Box-Muller).
    fn normal_of(&self, stream: &mut Stream) -> f32 {
        let pair = self.next_pair(stream);
        let u = unit_of(pair);
        let log = if u < NEAR_ONE { ln_1p(-u) } else { ln(rest_of(pair)) };
        (-2.0 * log).sqrt() * sin_cos(TAU * unit_of(self.next_pair(stream)))[1]
    }

    /// First quad of an axis's entry in the table.
    pub(super) fn dial_at(&self, axis: usize) -> usize {
        (base::FIELDS + axis * dial::FIELDS) / QUAD
    }

    /// Strength of an axis, and the two numbers of its distribution.
    fn dial_of(&self, entry: usize) -> [f32; 3] {
        let [strength, low, high, _] = self.memory.table[entry + dial::STRENGTH / QUAD].map(f32::from_bits);
        [strength, low, high]
    }

    /// Ends of a distribution, or limits of its result.
    pub(super) fn limits_of(&self, entry: usize) -> [f32; 2] {
        let [least, most, ..] = self.memory.table[entry + dial::LEAST / QUAD].map(f32::from_bits);
        [least, most]
    }

    /// Factor that an axis draws for a tree.
    pub(super) fn factor_of(&self, axis: usize) -> f32 {
        let mut stream = self.stream_of(axis);
        let [strength, low, high] = self.dial_of(stream.entry);
        at_strength(self.uniform_of(&mut stream, low, high), strength)
    }

    /// Angle that an axis draws for a tree [rad].
    pub(super) fn angle_drawn(&self, axis: usize) -> f32 {
        let mut stream = self.stream_of(axis);
        let [strength, low, high] = self.dial_of(stream.entry);
        self.uniform_of(&mut stream, low, high) * strength
    }

    /// Rotation vector of the lean of the tree [rad].
    pub(super) fn lean_drawn(&self) -> Vec3 {
        let mut stream = self.stream_of(axis::LEAN);
        let [strength, low, high] = self.dial_of(stream.entry);
        let angle = self.uniform_of(&mut stream, low, high) * strength;
        let [sine, cosine] = sin_cos(self.uniform_of(&mut stream, 0.0, TAU));
        Vec3::new(cosine * angle, sine * angle, 0.0)
    }

    /// Next factor of a truncated normal distribution. At strength 0 nothing is drawn; no other axis uses this stream.
    pub(super) fn next_factor(&self, stream: &mut Stream) -> f32 {
        let [strength, mean, sd] = self.dial_of(stream.entry);
        if strength == 0.0 {
            return 1.0;
        }
        let [least, most] = self.limits_of(stream.entry);
        let mut factor = mean;
        for _ in 0..REDRAWS {
            let drawn = sd.mul_add(self.normal_of(stream), mean);
            if drawn >= least && drawn <= most {
                factor = drawn;
                break;
            }
        }
        at_strength(factor, strength)
    }

    /// Next bend [rad], and the azimuth of its axis [rad].
    pub(super) fn next_bend(&self, stream: &mut Stream) -> [f32; 2] {
        let [strength, _, sd] = self.dial_of(stream.entry);
        if strength == 0.0 {
            return [0.0; 2];
        }
        let angle = sd * self.normal_of(stream) * strength;
        [angle, self.uniform_of(stream, 0.0, TAU)]
    }
}

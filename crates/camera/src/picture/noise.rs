//! Value noise for textures.

use super::figures::{OCTAVES, SECOND_CELLS, SECOND_WEIGHT, THIRD_CELLS, THIRD_WEIGHT};
use orchard_geometry::Vec3;
use orchard_spec::{Purpose, Stream};

/// Number of entries of the table: those that a byte can name.
pub const SIZE: usize = 256;

/// Smooth noise over space and constant variation by instance, from the random stream `Appearance`.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    pub(super) values: [f64; SIZE],
    pub(super) order: [u8; SIZE],
}

impl Noise {
    pub(super) fn new() -> Self {
        let mut rng = Stream::new(0, 0, Purpose::Appearance);
        let values = std::array::from_fn(|_| rng.unit());
        let mut order: [u8; SIZE] = std::array::from_fn(|i| i as u8);
        rng.shuffle(&mut order);
        Self { values, order }
    }

    fn lattice(&self, cell: [i64; 3]) -> f64 {
        self.values[usize::from(cell.into_iter().fold(0, |h, c| self.step(h, c)))]
    }

    /// Index in the table after hashing one more coordinate.
    #[inline]
    fn step(&self, h: u8, c: i64) -> u8 {
        self.order[usize::from(h.wrapping_add(c as u8))]
    }

    /// Value in [0, 1) of an instance; channels are independent.
    pub(super) fn of(&self, instance: u32, channel: i64) -> f64 {
        self.lattice([i64::from(instance), channel, i64::from(instance >> 8)])
    }

    /// Trilinear value noise in [0, 1), one cell a unit.
    pub(super) fn at(&self, p: &Vec3) -> f64 {
        // Both planes of the cell across each axis, and their weights; neighbours share the steps to them.
        let ends = |x: f64| {
            let (base, t) = cell(x);
            let smooth = t * t * (3.0 - 2.0 * t);
            [(base, 1.0 - smooth), (base.wrapping_add(1), smooth)]
        };
        let ([x0, x1], [y0, y1], [z0, z1]) = (ends(p.x), ends(p.y), ends(p.z));
        let (at_x0, at_x1) = (self.step(0, x0.0), self.step(0, x1.0));
        let along_z = |h: u8, y: (i64, f64), weight: f64| (self.step(h, y.0), weight * y.1);
        let edges = [
            along_z(at_x0, y0, x0.1),
            along_z(at_x1, y0, x1.1),
            along_z(at_x0, y1, x0.1),
            along_z(at_x1, y1, x1.1),
        ];
        let plane = |mut sum: f64, (c, weight): (i64, f64)| {
            for (h, along_xy) in edges {
                sum += along_xy * weight * self.values[usize::from(self.step(h, c))];
            }
            sum
        };
        let lower = plane(0.0, z0);
        // On a plane of the lattice, such as level ground, the other plane has weight 0.
        if z1.1 == 0.0 { lower } else { plane(lower, z1) }
    }

    /// Sum of three octaves.
    pub(super) fn rough(&self, p: &Vec3) -> f64 {
        let second = SECOND_WEIGHT * self.at(&(p * SECOND_CELLS));
        let third = THIRD_WEIGHT * self.at(&(p * THIRD_CELLS));
        (self.at(p) + second + third) / OCTAVES
    }
}

/// Floor of a number, and what is above it, 0 to 1: the standard library's floor is a call on processors without an instruction for it.
#[inline]
fn cell(x: f64) -> (i64, f64) {
    let towards_zero = x as i64;
    let floor = if (towards_zero as f64) > x { towards_zero.wrapping_sub(1) } else { towards_zero };
    (floor, (x - floor as f64).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_those_of_the_floor() {
        for x in [0.0, -0.0, 0.25, -0.25, 3.0, -3.0, 1e15 + 0.5, -1e15 - 0.5, -1e-300] {
            assert_eq!(cell(x), (x.floor() as i64, x - x.floor()), "{x}");
        }
        assert!([f64::MAX, f64::MIN].map(cell).iter().all(|(_, t)| (0.0..=1.0).contains(t)));
        assert!(cell(f64::NAN).1.is_nan());
    }
}

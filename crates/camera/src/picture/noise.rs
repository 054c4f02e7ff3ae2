//! Value noise for textures.

use orchard_geometry::Vec3;
use orchard_spec::{Purpose, Stream};

/// Entries of the table, a power of two.
const SIZE: usize = 256;

/// Smooth noise over space and steady variation over instances, from the stream of appearances.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    values: Vec<f64>,
    order: Vec<usize>,
}

impl Noise {
    pub(super) fn new() -> Self {
        let mut rng = Stream::new(0, 0, Purpose::Appearance);
        let values = (0..SIZE).map(|_| rng.unit()).collect();
        let mut order: Vec<usize> = (0..SIZE).collect();
        rng.shuffle(&mut order);
        Self { values, order }
    }

    fn lattice(&self, cell: [i64; 3]) -> f64 {
        let step = |h: usize, c: i64| self.order[(h + c.rem_euclid(SIZE as i64) as usize) % SIZE];
        self.values[step(step(step(0, cell[0]), cell[1]), cell[2])]
    }

    /// A value in [0, 1) that belongs to an instance; `channel` gives independent ones.
    pub(super) fn of(&self, instance: u32, channel: i64) -> f64 {
        self.lattice([i64::from(instance), channel, i64::from(instance >> 8)])
    }

    /// Trilinear value noise in [0, 1), one cell a unit.
    pub(super) fn at(&self, p: &Vec3) -> f64 {
        let floor = p.map(f64::floor);
        let smooth = (p - floor).map(|t| t * t * (3.0 - 2.0 * t));
        let base = [floor.x as i64, floor.y as i64, floor.z as i64];
        let mut sum = 0.0;
        for corner in 0..8_usize {
            let mut weight = 1.0;
            let mut cell = base;
            for k in 0..3 {
                let upper = corner >> k & 1;
                weight *= if upper == 1 { smooth[k] } else { 1.0 - smooth[k] };
                cell[k] = cell[k].saturating_add(upper as i64);
            }
            sum += weight * self.lattice(cell);
        }
        sum
    }

    /// Three octaves.
    pub(super) fn rough(&self, p: &Vec3) -> f64 {
        (self.at(p) + 0.5 * self.at(&(p * 2.1)) + 0.25 * self.at(&(p * 4.3))) / 1.75
    }
}

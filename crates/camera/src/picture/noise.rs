//! Value noise for textures.

use orchard_geometry::Vec3;
use orchard_spec::{Purpose, Stream};

/// Number of entries of the table, a power of two.
const SIZE: usize = 256;

/// Smooth noise over space and constant variation by instance, from the random stream `Appearance`.
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
        self.values[self.step(self.step(self.step(0, cell[0]), cell[1]), cell[2])]
    }

    /// Index in the table after hashing one more coordinate.
    fn step(&self, h: usize, c: i64) -> usize {
        self.order[(h + c.rem_euclid(SIZE as i64) as usize) % SIZE]
    }

    /// Value in [0, 1) of an instance; channels are independent.
    pub(super) fn of(&self, instance: u32, channel: i64) -> f64 {
        self.lattice([i64::from(instance), channel, i64::from(instance >> 8)])
    }

    /// Trilinear value noise in [0, 1), one cell a unit.
    pub(super) fn at(&self, p: &Vec3) -> f64 {
        let floor = p.map(f64::floor);
        let smooth = (p - floor).map(|t| t * t * (3.0 - 2.0 * t));
        // Both planes of the cell across each axis, and their weights; neighbours share the steps to them.
        let ends = |k: usize| {
            let base = floor[k] as i64;
            [(base, 1.0 - smooth[k]), (base.saturating_add(1), smooth[k])]
        };
        let (x, y, z) = (ends(0), ends(1), ends(2));
        let at_x = x.map(|(c, _)| self.step(0, c));
        let at_xy = at_x.map(|h| y.map(|(c, _)| self.step(h, c)));
        let mut sum = 0.0;
        for (k, (c, along_z)) in z.into_iter().enumerate() {
            // On a plane of the lattice, such as level ground, the other plane has weight 0.
            if k == 1 && along_z == 0.0 {
                break;
            }
            for (j, (_, along_y)) in y.into_iter().enumerate() {
                for (i, (_, along_x)) in x.into_iter().enumerate() {
                    sum += along_x * along_y * along_z * self.values[self.step(at_xy[i][j], c)];
                }
            }
        }
        sum
    }

    /// Sum of three octaves.
    pub(super) fn rough(&self, p: &Vec3) -> f64 {
        (self.at(p) + 0.5 * self.at(&(p * 2.1)) + 0.25 * self.at(&(p * 4.3))) / 1.75
    }
}

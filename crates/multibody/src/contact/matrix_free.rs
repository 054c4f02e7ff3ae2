//! The matrix-free path: the unknown is the generalised velocity change itself, and each Newton direction comes
//! from conjugate gradients preconditioned by the articulated-body factor.
//!
//! In the coordinates `e = C^-1 L^T u` of [`super::paths`] that preconditioner is the identity: A becomes I, and
//! `A + J^T G J` becomes `I + Y G Y^T`, which is applied path by path and never assembled. Unlike impulses, velocity
//! changes have no null space: more rows than degrees of freedom do no harm.

use orchard_geometry::Vec3;

use super::block::Block;
use super::law::Response;
use super::newton::{Direction, Unknown};
use super::paths::Paths;
use crate::vectors::{add_scaled, dot};

/// A direction is solved for to the present residual (a Newton step then still squares it), to no less than this
/// at first and no more than [`TIGHTEST`].
const LOOSEST: f64 = 1e-1;
/// Smallest relative residual that a direction is solved to.
const TIGHTEST: f64 = 1e-8;
/// Conjugate-gradient iterations of a direction for each of its coordinates; without round-off one is enough.
const MAX_ITERATIONS_PER_COORDINATE: usize = 4;

/// The velocity change in the paths' coordinates, and buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Coordinates {
    e: Vec<f64>,
    /// `Y gamma - e`.
    residual: Vec<f64>,
    /// The Newton direction.
    de: Vec<f64>,
    r: Vec<f64>,
    d: Vec<f64>,
    hd: Vec<f64>,
}

/// [`Coordinates`] on the paths of a step.
pub(super) struct MatrixFree<'a> {
    pub paths: &'a Paths,
    pub coordinates: &'a mut Coordinates,
}

impl Unknown for MatrixFree<'_> {
    fn start(&mut self, blocks: &[Block], change: &mut [Vec3]) {
        let Coordinates { e, residual, de, r, d, hd } = &mut *self.coordinates;
        for buffer in [&mut *e, residual, de, r, d, hd] {
            buffer.clear();
            buffer.resize(self.paths.dimension(), 0.0);
        }
        for (k, block) in blocks.iter().enumerate() {
            self.paths.add_impulse(k, &block.guess, e);
        }
        for (k, change) in change.iter_mut().enumerate() {
            *change = self.paths.velocity(k, e);
        }
    }

    fn residual(&mut self, _blocks: &[Block], responses: &[Response]) -> f64 {
        let Coordinates { e, residual, .. } = &mut *self.coordinates;
        residual.fill(0.0);
        for (k, response) in responses.iter().enumerate() {
            if response.rank > 0 {
                self.paths.add_impulse(k, &response.impulse, residual);
            }
        }
        let scale = f64::max(dot(e, e), dot(residual, residual));
        add_scaled(residual, e, -1.0);
        if scale > 0.0 { (dot(residual, residual) / scale).sqrt() } else { 0.0 }
    }

    fn direction(&mut self, responses: &[Response], residual: f64, change: &mut [Vec3]) -> Direction {
        let paths = self.paths;
        let Coordinates { e, residual: rhs, de, r, d, hd } = &mut *self.coordinates;
        de.fill(0.0);
        r.copy_from_slice(rhs);
        d.copy_from_slice(rhs);
        let mut rr = dot(r, r);
        let share = residual.clamp(TIGHTEST, LOOSEST);
        let goal = rr * share * share;
        let mut iterations = 0;
        while rr > goal && iterations < MAX_ITERATIONS_PER_COORDINATE * r.len() {
            iterations += 1;
            hd.copy_from_slice(d);
            for (k, response) in responses.iter().enumerate() {
                if response.rank > 0 {
                    let slope = response.root * response.root.tr_mul(&paths.velocity(k, d));
                    paths.add_impulse(k, &slope, hd);
                }
            }
            let length = rr / dot(d, hd);
            add_scaled(de, d, length);
            add_scaled(r, hd, -length);
            let next = dot(r, r);
            let turn = next / rr;
            rr = next;
            for (d, r) in d.iter_mut().zip(&*r) {
                *d = r + *d * turn;
            }
        }
        for (k, change) in change.iter_mut().enumerate() {
            *change = paths.velocity(k, de);
        }
        Direction { slope: dot(de, e), curvature: dot(de, de), iterations }
    }

    fn advance(&mut self, length: f64) {
        let Coordinates { e, de, .. } = &mut *self.coordinates;
        add_scaled(e, de, length);
    }
}

//! Newton's method on the contact impulses.
//!
//! The impulses p solve `p = gamma(v_free + W p)`, the optimality of the convex cost
//! `1/2 p^T W p + sum l(v_free + W p)`. A step solves `(I + G W) dp = gamma - p` with `G = -d gamma/d v = L L^T`
//! as `dp = r - L (I + L^T W L)^-1 L^T W r`, which needs only a Cholesky factor as large as the rows that
//! carry load; open contacts drop out.

use orchard_geometry::{Mat3, Vec3};

use super::Block;
use super::delassus::Delassus;
use super::law::Response;

/// Residual at which the impulses count as solved, relative to them, both scaled by the square root of W.
const TOLERANCE: f64 = 1e-10;
/// Newton iterations before the solve gives up and keeps its best impulses.
const MAX_ITERATIONS: usize = 100;
/// The line search ends when the slope has fallen to this share of the slope at its start.
const SLOPE_SHARE: f64 = 0.1;
/// Evaluations of one line search.
const MAX_EVALUATIONS: usize = 30;

/// How a solve ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outcome {
    pub iterations: usize,
    pub residual: f64,
    pub converged: bool,
}

/// Solution and buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Newton {
    /// Impulse of each block, on the friction cone.
    pub impulses: Vec<Vec3>,
    p: Vec<Vec3>,
    v: Vec<Vec3>,
    responses: Vec<Response>,
    residual: Vec<Vec3>,
    w_residual: Vec<Vec3>,
    dp: Vec<Vec3>,
    dv: Vec<Vec3>,
    /// Block and column of L behind each active row.
    active: Vec<(usize, usize)>,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
}

impl Newton {
    /// Solves for the impulses of all blocks, from their first guesses.
    pub fn solve(&mut self, blocks: &[Block], delassus: &Delassus) -> Outcome {
        let count = blocks.len();
        for buffer in [&mut self.v, &mut self.residual, &mut self.w_residual, &mut self.dp, &mut self.dv] {
            buffer.clear();
            buffer.resize(count, Vec3::zeros());
        }
        self.p.clear();
        self.p.extend(blocks.iter().map(|block| block.guess));
        delassus.multiply(&self.p, &mut self.v);
        for (v, block) in self.v.iter_mut().zip(blocks) {
            *v += block.v_free;
        }
        let mut iterations = 0;
        let outcome = loop {
            let residual = self.evaluate(blocks);
            let converged = residual <= TOLERANCE;
            if converged || iterations == MAX_ITERATIONS {
                break Outcome { iterations, residual, converged };
            }
            iterations += 1;
            self.find_direction(delassus);
            let length = self.search_line(blocks);
            for k in 0..count {
                self.p[k] += self.dp[k] * length;
                self.v[k] += self.dv[k] * length;
            }
        };
        self.impulses.clear();
        self.impulses.extend(self.responses.iter().map(|response| response.impulse));
        outcome
    }

    /// Responses and residual at the present velocities; gives the relative size of the residual.
    fn evaluate(&mut self, blocks: &[Block]) -> f64 {
        self.responses.clear();
        let (mut size, mut of_p, mut of_gamma) = (0.0, 0.0, 0.0);
        for (k, block) in blocks.iter().enumerate() {
            let response = block.law.respond(&self.v[k]);
            self.residual[k] = response.impulse - self.p[k];
            size += block.w * self.residual[k].norm_squared();
            of_p += block.w * self.p[k].norm_squared();
            of_gamma += block.w * response.impulse.norm_squared();
            self.responses.push(response);
        }
        let scale = f64::max(of_p, of_gamma);
        if scale > 0.0 { (size / scale).sqrt() } else { 0.0 }
    }

    /// The Newton step `dp`, and the velocities `dv = W dp` that it changes.
    fn find_direction(&mut self, delassus: &Delassus) {
        delassus.multiply(&self.residual, &mut self.w_residual);
        self.active.clear();
        for (k, response) in self.responses.iter().enumerate() {
            self.active.extend((0..response.rank).map(|column| (k, column)));
        }
        let size = self.active.len();
        self.matrix.clear();
        self.matrix.resize(size * size, 0.0);
        self.rhs.clear();
        for &(k, column) in &self.active {
            self.rhs.push(self.responses[k].root.column(column).dot(&self.w_residual[k]));
        }
        // Lower triangle of I + L^T W L, column after column.
        let mut column_start = 0;
        for (b, of_b) in self.responses.iter().enumerate() {
            let mut row_start = column_start;
            for (a, of_a) in self.responses.iter().enumerate().skip(b) {
                let product: Mat3 = of_a.root.tr_mul(delassus.block(a, b)) * of_b.root;
                for i in 0..of_a.rank {
                    for j in 0..of_b.rank {
                        self.matrix[(column_start + j) * size + row_start + i] = product[(i, j)];
                    }
                }
                row_start += of_a.rank;
            }
            column_start += of_b.rank;
        }
        for k in 0..size {
            self.matrix[k * size + k] += 1.0;
        }
        cholesky_solve(&mut self.matrix, &mut self.rhs);
        self.dp.copy_from_slice(&self.residual);
        for (&(k, column), x) in self.active.iter().zip(&self.rhs) {
            self.dp[k] -= self.responses[k].root.column(column) * *x;
        }
        delassus.multiply(&self.dp, &mut self.dv);
    }

    /// Slope of the cost at a length along the step.
    fn slope(&self, blocks: &[Block], length: f64) -> f64 {
        let mut slope = 0.0;
        for (k, block) in blocks.iter().enumerate() {
            let gamma = block.law.respond(&(self.v[k] + self.dv[k] * length)).impulse;
            slope += self.dv[k].dot(&(self.p[k] + self.dp[k] * length - gamma));
        }
        slope
    }

    /// Length that minimises the cost along the step, to a share of its first slope: the full step unless
    /// it overshoots, else the root of the slope by the Illinois variant of the false position.
    fn search_line(&self, blocks: &[Block]) -> f64 {
        let (mut low, mut slope_low) = (0.0, self.slope(blocks, 0.0));
        let (mut high, mut slope_high) = (1.0, self.slope(blocks, 1.0));
        let goal = SLOPE_SHARE * slope_low.abs();
        if slope_high <= goal {
            return 1.0;
        }
        if slope_low >= 0.0 {
            // Descent is lost in round-off.
            return 1.0;
        }
        for _ in 0..MAX_EVALUATIONS {
            let length = low - slope_low * (high - low) / (slope_high - slope_low);
            let slope = self.slope(blocks, length);
            if slope.abs() <= goal {
                return length;
            }
            if slope < 0.0 {
                (low, slope_low) = (length, slope);
                slope_high *= 0.5;
            } else {
                (high, slope_high) = (length, slope);
                slope_low *= 0.5;
            }
        }
        low
    }
}

/// Solves a symmetric positive definite system in place; the lower triangle, column after column.
fn cholesky_solve(matrix: &mut [f64], x: &mut [f64]) {
    let size = x.len();
    for j in 0..size {
        let (done, rest) = matrix.split_at_mut(j * size);
        let column = &mut rest[..size];
        for left in done.chunks_exact(size) {
            let factor = left[j];
            if factor != 0.0 {
                for (entry, other) in column[j..].iter_mut().zip(&left[j..]) {
                    *entry -= factor * other;
                }
            }
        }
        let scale = 1.0 / column[j].sqrt();
        column[j..].iter_mut().for_each(|entry| *entry *= scale);
    }
    for j in 0..size {
        let column = &matrix[j * size..(j + 1) * size];
        x[j] /= column[j];
        let pivot = x[j];
        for (entry, factor) in x[j + 1..].iter_mut().zip(&column[j + 1..]) {
            *entry -= factor * pivot;
        }
    }
    for j in (0..size).rev() {
        let column = &matrix[j * size..(j + 1) * size];
        let below: f64 = x[j + 1..].iter().zip(&column[j + 1..]).map(|(entry, factor)| entry * factor).sum();
        x[j] = (x[j] - below) / column[j];
    }
}

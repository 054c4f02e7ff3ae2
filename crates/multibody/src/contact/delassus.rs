//! The direct path: the unknown is the impulses p, on the assembled Delassus matrix `W = J A^-1 J^T`.
//!
//! `u = A^-1 J^T p`, and a direction solves `(I + G W) dp = r`, `r = gamma - p`, as
//! `dp = r - L (I + L^T W L)^-1 L^T W r`, which needs only a dense Cholesky factor as large as the rows that
//! carry load; open contacts drop out.

use orchard_geometry::{Mat3, Vec3};

use super::law::Response;
use super::newton::{Direction, Unknown};
use super::paths::Paths;
use super::rows::Block;

/// The matrix, the impulses and buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Delassus {
    count: usize,
    /// W, block row after block row.
    blocks: Vec<Mat3>,
    p: Vec<Vec3>,
    residual: Vec<Vec3>,
    w_residual: Vec<Vec3>,
    dp: Vec<Vec3>,
    /// Block and column of L behind each active row.
    active: Vec<(usize, usize)>,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
}

impl Delassus {
    /// Multiplies the paths out.
    pub fn assemble(&mut self, paths: &Paths, count: usize) {
        self.count = count;
        self.blocks.clear();
        self.blocks.resize(count * count, Mat3::zeros());
        for row in 0..count {
            for column in 0..=row {
                let block = paths.inverse_inertia(row, column);
                self.blocks[row * count + column] = block;
                self.blocks[column * count + row] = block.transpose();
            }
        }
    }

    /// Velocity changes of the rows under impulses: `W p`.
    fn multiply(&self, p: &[Vec3], out: &mut [Vec3]) {
        for (row, out) in self.blocks.chunks_exact(self.count).zip(out) {
            *out = row.iter().zip(p).fold(Vec3::zeros(), |sum, (block, p)| sum + block * p);
        }
    }

    /// Lower triangle of `I + L^T W L`, column after column, and `L^T W r`.
    fn assemble_active(&mut self, responses: &[Response]) {
        self.active.clear();
        for (k, response) in responses.iter().enumerate() {
            self.active.extend((0..response.rank).map(|column| (k, column)));
        }
        let size = self.active.len();
        self.matrix.clear();
        self.matrix.resize(size * size, 0.0);
        self.rhs.clear();
        for &(k, column) in &self.active {
            self.rhs.push(responses[k].root.column(column).dot(&self.w_residual[k]));
        }
        let mut column_start = 0;
        let active = |(_, response): &(usize, &Response)| response.rank > 0;
        for (b, of_b) in responses.iter().enumerate().filter(active) {
            let mut row_start = column_start;
            for (a, of_a) in responses.iter().enumerate().skip(b).filter(active) {
                let product: Mat3 = of_a.root.tr_mul(&self.blocks[a * self.count + b]) * of_b.root;
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
    }
}

impl Unknown for Delassus {
    fn start(&mut self, blocks: &[Block], change: &mut [Vec3]) {
        for buffer in [&mut self.residual, &mut self.w_residual, &mut self.dp] {
            buffer.clear();
            buffer.resize(blocks.len(), Vec3::zeros());
        }
        self.p.clear();
        self.p.extend(blocks.iter().map(|block| block.guess));
        self.multiply(&self.p, change);
    }

    fn residual(&mut self, blocks: &[Block], responses: &[Response]) -> f64 {
        let (mut size, mut of_p, mut of_gamma) = (0.0, 0.0, 0.0);
        for (k, (block, response)) in blocks.iter().zip(responses).enumerate() {
            self.residual[k] = response.impulse - self.p[k];
            size += block.w * self.residual[k].norm_squared();
            of_p += block.w * self.p[k].norm_squared();
            of_gamma += block.w * response.impulse.norm_squared();
        }
        let scale = f64::max(of_p, of_gamma);
        if scale > 0.0 { (size / scale).sqrt() } else { 0.0 }
    }

    fn direction(&mut self, responses: &[Response], _residual: f64, change: &mut [Vec3]) -> Direction {
        let mut w_residual = std::mem::take(&mut self.w_residual);
        self.multiply(&self.residual, &mut w_residual);
        self.w_residual = w_residual;
        self.assemble_active(responses);
        cholesky_solve(&mut self.matrix, &mut self.rhs);
        self.dp.copy_from_slice(&self.residual);
        for (&(k, column), x) in self.active.iter().zip(&self.rhs) {
            self.dp[k] -= responses[k].root.column(column) * *x;
        }
        self.multiply(&self.dp, change);
        let along = |p: &[Vec3]| change.iter().zip(p).map(|(dv, p)| dv.dot(p)).sum();
        Direction { slope: along(&self.p), curvature: along(&self.dp), iterations: 0 }
    }

    fn advance(&mut self, length: f64) {
        for (p, dp) in self.p.iter_mut().zip(&self.dp) {
            *p += dp * length;
        }
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

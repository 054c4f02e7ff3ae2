//! The direct path: the unknown is the impulses p, on the assembled Delassus matrix `W = J A^-1 J^T`.
//!
//! `u = A^-1 J^T p`, and a direction solves `(I + G W) dp = r`, `r = gamma - p`, as
//! `dp = r - L (I + L^T W L)^-1 L^T W r`, which needs only a dense Cholesky factor as large as the rows under
//! load; open contacts drop out.

use orchard_geometry::{Mat3, Vec3};

use super::block::Block;
use super::law::Response;
use super::newton::{Direction, Unknown};
use super::paths::Paths;

/// The matrix, the impulses and buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Delassus {
    count: usize,
    /// W, block row after block row, where a known row or column crosses.
    blocks: Vec<Mat3>,
    /// Blocks whose row and column of W are computed.
    is_known: Vec<bool>,
    p: Vec<Vec3>,
    residual: Vec<Vec3>,
    w_residual: Vec<Vec3>,
    dp: Vec<Vec3>,
    /// Blocks on which the impulses of the last product were not zero.
    loaded: Vec<usize>,
    /// Block and column of L behind each active row.
    active: Vec<(usize, usize)>,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
}

impl Delassus {
    /// Clears the matrix.
    pub fn clear(&mut self, count: usize) {
        self.count = count;
        self.blocks.resize(count * count, Mat3::zeros());
        self.is_known.clear();
        self.is_known.resize(count, false);
    }

    /// Multiplies the paths out for the column and row of a block, unless they are computed. Blocks that are never
    /// under load need none.
    fn know(&mut self, paths: &Paths, column: usize) {
        if std::mem::replace(&mut self.is_known[column], true) {
            return;
        }
        for row in 0..self.count {
            if row == column || !self.is_known[row] {
                let block = paths.inverse_inertia(row, column);
                self.blocks[row * self.count + column] = block;
                self.blocks[column * self.count + row] = block.transpose();
            }
        }
    }

    /// Velocity changes of the rows under impulses: `W p`.
    fn multiply(&mut self, paths: &Paths, p: &[Vec3], out: &mut [Vec3]) {
        self.loaded.clear();
        for k in (0..p.len()).filter(|&k| p[k] != Vec3::zeros()) {
            self.loaded.push(k);
            self.know(paths, k);
        }
        for (row, out) in self.blocks.chunks_exact(self.count).zip(out) {
            *out = self.loaded.iter().fold(Vec3::zeros(), |sum, &k| sum + row[k] * p[k]);
        }
    }

    /// Lower triangle of `I + L^T W L`, column after column, and `L^T W r`.
    fn assemble_active(&mut self, paths: &Paths, responses: &[Response]) {
        self.active.clear();
        for (k, response) in responses.iter().enumerate().filter(|(_, response)| response.rank > 0) {
            self.active.extend((0..response.rank).map(|column| (k, column)));
            self.know(paths, k);
        }
        let size = self.active.len();
        // Entries above the diagonal are stale and are not read.
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
                let block = &self.blocks[a * self.count + b];
                for j in 0..of_b.rank {
                    let response = block * of_b.root.column(j);
                    let first = (column_start + j) * size + row_start;
                    for (i, entry) in self.matrix[first..first + of_a.rank].iter_mut().enumerate() {
                        *entry = of_a.root.column(i).dot(&response);
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

/// [`Delassus`] on the paths of a step.
pub(super) struct Direct<'a> {
    pub paths: &'a Paths,
    pub delassus: &'a mut Delassus,
}

impl Unknown for Direct<'_> {
    fn start(&mut self, blocks: &[Block], change: &mut [Vec3]) {
        let matrix = &mut *self.delassus;
        matrix.clear(blocks.len());
        for buffer in [&mut matrix.residual, &mut matrix.w_residual, &mut matrix.dp] {
            buffer.clear();
            buffer.resize(blocks.len(), Vec3::zeros());
        }
        let mut p = std::mem::take(&mut matrix.p);
        p.clear();
        p.extend(blocks.iter().map(|block| block.guess));
        matrix.multiply(self.paths, &p, change);
        matrix.p = p;
    }

    fn residual(&mut self, blocks: &[Block], responses: &[Response]) -> f64 {
        let Delassus { p, residual, .. } = &mut *self.delassus;
        let (mut size, mut of_p, mut of_gamma) = (0.0, 0.0, 0.0);
        for (k, (block, response)) in blocks.iter().zip(responses).enumerate() {
            residual[k] = response.impulse - p[k];
            size += block.w * residual[k].norm_squared();
            of_p += block.w * p[k].norm_squared();
            of_gamma += block.w * response.impulse.norm_squared();
        }
        let scale = f64::max(of_p, of_gamma);
        if scale > 0.0 { (size / scale).sqrt() } else { 0.0 }
    }

    fn direction(&mut self, responses: &[Response], _residual: f64, change: &mut [Vec3]) -> Direction {
        let matrix = &mut *self.delassus;
        let (residual, mut dp) = (std::mem::take(&mut matrix.residual), std::mem::take(&mut matrix.dp));
        let mut w_residual = std::mem::take(&mut matrix.w_residual);
        matrix.multiply(self.paths, &residual, &mut w_residual);
        matrix.w_residual = w_residual;
        matrix.assemble_active(self.paths, responses);
        cholesky_solve(&mut matrix.matrix, &mut matrix.rhs);
        dp.copy_from_slice(&residual);
        for (&(k, column), x) in matrix.active.iter().zip(&matrix.rhs) {
            dp[k] -= responses[k].root.column(column) * *x;
        }
        matrix.multiply(self.paths, &dp, change);
        (matrix.residual, matrix.dp) = (residual, dp);
        let along = |p: &[Vec3]| change.iter().zip(p).map(|(dv, p)| dv.dot(p)).sum();
        Direction { slope: along(&matrix.p), curvature: along(&matrix.dp), iterations: 0 }
    }

    fn advance(&mut self, length: f64) {
        for (p, dp) in self.delassus.p.iter_mut().zip(&self.delassus.dp) {
            *p += dp * length;
        }
    }
}

/// Solves a symmetric positive definite system in place; the lower triangle, column after column.
fn cholesky_solve(matrix: &mut [f64], x: &mut [f64]) {
    let size = x.len();
    for j in 0..size {
        let (done, rest) = matrix.split_at_mut(j * size);
        let column = &mut rest[j..size];
        // Four columns at a time: the entries are loaded and stored once for all.
        let mut fours = done.chunks_exact(4 * size);
        for four in &mut fours {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &four[k * size + j..(k + 1) * size]);
            let (f_a, f_b, f_c, f_d) = (a[0], b[0], c[0], d[0]);
            for ((((entry, a), b), c), d) in column.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *entry = *entry - f_a * a - f_b * b - f_c * c - f_d * d;
            }
        }
        for left in fours.remainder().chunks_exact(size) {
            let factor = left[j];
            for (entry, other) in column.iter_mut().zip(&left[j..]) {
                *entry -= factor * other;
            }
        }
        let scale = 1.0 / column[0].sqrt();
        column.iter_mut().for_each(|entry| *entry *= scale);
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

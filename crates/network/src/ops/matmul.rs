//! Products of matrices.

use std::borrow::Cow;

use crate::call::{Call, Done, one};
use crate::tensor::{Tensor, Values, count, rows, spread, spread_strides};

/// Rows and columns of a tile that is summed up in registers.
const TILE_ROWS: usize = 4;
const TILE_COLUMNS: usize = 8;

/// Sizes of a product of matrices: `a` is rows x depth, `b` is depth x columns, each row by row without gaps.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub rows: usize,
    pub depth: usize,
    pub columns: usize,
    /// From row to row of the product.
    pub stride: usize,
}

/// Computes a product of matrices into `c`. Each number is summed from 0 in the order of the depth, whatever the sizes: so its bits do not depend
/// on how the work is split.
pub fn multiply(a: &[f32], b: &[f32], c: &mut [f32], sizes: Sizes) {
    let Sizes { rows, depth, columns, stride } = sizes;
    if rows < TILE_ROWS || depth == 0 {
        for i in 0..rows {
            let row = &mut c[i * stride..i * stride + columns];
            row.fill(0.0);
            for (&x, b) in a[i * depth..(i + 1) * depth].iter().zip(b.chunks_exact(columns.max(1))) {
                for (sum, &y) in row.iter_mut().zip(b) {
                    *sum += x * y;
                }
            }
        }
        return;
    }
    let mut panel = vec![[0.0_f32; TILE_COLUMNS]; depth];
    let turned = turn(a, rows, depth);
    for left in (0..columns).step_by(TILE_COLUMNS) {
        let width = TILE_COLUMNS.min(columns - left);
        for (row, b) in panel.iter_mut().zip(b.chunks_exact(columns)) {
            row[..width].copy_from_slice(&b[left..left + width]);
        }
        for (block, a) in turned.chunks_exact(depth.max(1)).enumerate() {
            let sums = tile(a, &panel);
            let top = block * TILE_ROWS;
            for (i, sums) in sums.iter().enumerate().take(rows - top) {
                let at = (top + i) * stride + left;
                c[at..at + width].copy_from_slice(&sums[..width]);
            }
        }
    }
}

/// The rows of a matrix in blocks of a tile's height, each column by column; rows beyond the last are zeros.
fn turn(a: &[f32], rows: usize, depth: usize) -> Vec<[f32; TILE_ROWS]> {
    let blocks = rows.div_ceil(TILE_ROWS);
    let mut turned = vec![[0.0; TILE_ROWS]; blocks * depth];
    for (i, row) in a.chunks_exact(depth.max(1)).enumerate().take(rows) {
        for (k, &x) in row.iter().enumerate() {
            turned[(i / TILE_ROWS) * depth + k][i % TILE_ROWS] = x;
        }
    }
    turned
}

#[inline(always)]
fn tile(a: &[[f32; TILE_ROWS]], b: &[[f32; TILE_COLUMNS]]) -> [[f32; TILE_COLUMNS]; TILE_ROWS] {
    let mut sums = [[0.0_f32; TILE_COLUMNS]; TILE_ROWS];
    for (a, b) in a.iter().zip(b) {
        for (sums, &x) in sums.iter_mut().zip(a) {
            for (sum, &y) in sums.iter_mut().zip(b) {
                *sum += x * y;
            }
        }
    }
    sums
}

/// Products of the last two dimensions, for every index of the others. A vector is one row on the left, one column on the right.
pub fn matmul(call: &Call<'_>) -> Done {
    let (a, b) = (call.input(0)?.shape(), call.input(1)?.shape());
    let (x, y) = (call.numbers(0)?, call.numbers(1)?);
    let (a_outer, height, depth) = match a {
        [outer @ .., rows, depth] => (outer, *rows, *depth),
        [depth] => (a.split_at(0).0, 1, *depth),
        [] => return Err("a single number has no rows".to_owned()),
    };
    let (b_outer, first, columns) = match b {
        [outer @ .., depth, columns] => (outer, *depth, *columns),
        [depth] => (b.split_at(0).0, *depth, 1),
        [] => return Err("a single number has no columns".to_owned()),
    };
    if depth != first {
        return Err(format!("shapes {a:?} and {b:?} do not fit together"));
    }
    let outer = spread(a_outer, b_outer)?;
    let mut shape = outer.clone();
    shape.extend((a.len() > 1).then_some(height));
    shape.extend((b.len() > 1).then_some(columns));
    let n = count(&shape)?;
    call.spend(&[n, depth])?;
    let mut product = vec![0.0; n];
    let sizes = |rows: usize| Sizes { rows, depth, columns, stride: columns };
    if y.len() == depth * columns {
        // One matrix on the right serves all rows on the left.
        multiply(x, y, &mut product, sizes(n.checked_div(columns).unwrap_or(0)));
        return one(Tensor::of(shape, Values::F32(product)));
    }
    let each = |own: &[usize], size: usize| -> Vec<isize> {
        spread_strides(own, &outer).into_iter().map(|step| step * size as isize).collect()
    };
    let (a_size, b_size) = (height * depth, depth * columns);
    let mut parts = product.chunks_exact_mut((height * columns).max(1));
    rows(&outer, [&each(a_outer, a_size), &each(b_outer, b_size)], |at, n, step| {
        for (i, part) in (0..n as isize).zip(&mut parts) {
            let [p, q] = [0, 1].map(|k| (at[k] + i * step[k]) as usize);
            multiply(&x[p..p + a_size], &y[q..q + b_size], part, sizes(height));
        }
    });
    one(Tensor::of(shape, Values::F32(product)))
}

/// alpha A B + beta C; A and B may be turned.
pub fn gemm(call: &Call<'_>) -> Done {
    let [a, b] = [matrix(call, 0, "transA")?, matrix(call, 1, "transB")?];
    let (&[rows, depth], &[first, columns]) = (a.shape(), b.shape()) else { unreachable!("matrices") };
    if depth != first {
        return Err(format!("shapes {:?} and {:?} do not fit together", a.shape(), b.shape()));
    }
    call.spend(&[rows, depth, columns])?;
    let (alpha, beta) = (call.float("alpha", 1.0), call.float("beta", 1.0));
    let mut product = vec![0.0; count(&[rows, columns])?];
    let sizes = Sizes { rows, depth, columns, stride: columns };
    multiply(a.as_f32().unwrap_or_default(), b.as_f32().unwrap_or_default(), &mut product, sizes);
    if alpha != 1.0 {
        product.iter_mut().for_each(|x| *x *= alpha);
    }
    if let Some(c) = call.optional(2) {
        let shape = [rows, columns];
        if spread(c.shape(), &shape)? != shape {
            return Err(format!("shape {:?} does not fit the product's {shape:?}", c.shape()));
        }
        let c = c.strided(shape.to_vec(), 0, &spread_strides(c.shape(), &shape))?;
        let c = crate::call::numbers(&c, 2)?;
        product.iter_mut().zip(c).for_each(|(x, &c)| *x += beta * c);
    }
    one(Tensor::of(vec![rows, columns], Values::F32(product)))
}

/// A matrix, turned if an attribute says so.
fn matrix<'a>(call: &Call<'a>, i: usize, turned: &str) -> Result<Cow<'a, Tensor>, String> {
    call.numbers(i)?;
    let tensor = call.input(i)?;
    let &[rows, columns] = tensor.shape() else {
        return Err(format!("input {i} has shape {:?}, which is no matrix", tensor.shape()));
    };
    match call.flag(turned, false) {
        true => tensor.strided(vec![columns, rows], 0, &[1, columns as isize]).map(Cow::Owned),
        false => Ok(Cow::Borrowed(tensor)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_has_the_same_bits_row_by_row_and_in_tiles() {
        let number = |i: usize| (((i * 7919) % 1009) as f32 - 500.0) / 37.0;
        for (rows, depth, columns) in [(9, 33, 21), (4, 8, 8), (5, 1, 3), (7, 0, 4), (6, 5, 0)] {
            let a: Vec<f32> = (0..rows * depth).map(number).collect();
            let b: Vec<f32> = (0..depth * columns).map(|i| number(i + 5)).collect();
            let mut whole = vec![f32::NAN; rows * columns];
            multiply(&a, &b, &mut whole, Sizes { rows, depth, columns, stride: columns });
            for i in 0..rows {
                let mut row = vec![f32::NAN; columns];
                let a = &a[i * depth..(i + 1) * depth];
                multiply(a, &b, &mut row, Sizes { rows: 1, depth, columns, stride: columns });
                assert_eq!(row, whole[i * columns..(i + 1) * columns]);
            }
        }
    }
}

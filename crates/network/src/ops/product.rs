//! The product of two matrices, tile by tile, on the widest vectors of the processor.
//!
//! Vectors lie along the columns of the product, so each number is summed by itself: its bits are the same on vectors of every width.

use pulp::{Arch, Simd, WithSimd};

/// Sizes of a product of matrices: `a` is rows x depth, `b` is depth x columns, each row by row without gaps.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub rows: usize,
    pub depth: usize,
    pub columns: usize,
    /// From row to row of the product.
    pub stride: usize,
}

/// Rows of a tile that is summed up in registers.
const TILE_ROWS: usize = 4;

/// Computes a product of matrices into `c`. Each number is summed from 0 in the order of the depth, whatever the sizes: so its bits do not depend
/// on how the work is split.
pub fn multiply(a: &[f32], b: &[f32], c: &mut [f32], sizes: Sizes) {
    Turned::new(a, sizes.rows, sizes.depth).multiply(b, c, sizes);
}

/// A matrix that stands on the left of products, turned for tiles.
pub struct Turned<'a> {
    rows: &'a [f32],
    /// The rows in blocks of a tile's height, each column by column, with zeros beyond the last row; none for a matrix that is lower than a tile.
    blocks: Vec<[f32; TILE_ROWS]>,
}

impl<'a> Turned<'a> {
    /// Turns a matrix of rows without gaps.
    pub fn new(a: &'a [f32], rows: usize, depth: usize) -> Self {
        let blocks = if rows < TILE_ROWS { 0 } else { rows.div_ceil(TILE_ROWS) };
        let mut turned = vec![[0.0; TILE_ROWS]; blocks * depth];
        for (i, row) in a.chunks_exact(depth.max(1)).enumerate().take(if blocks > 0 { rows } else { 0 }) {
            for (k, &x) in row.iter().enumerate() {
                turned[(i / TILE_ROWS) * depth + k][i % TILE_ROWS] = x;
            }
        }
        Self { rows: a, blocks: turned }
    }

    /// Computes its product with `b` into `c`.
    pub fn multiply(&self, b: &[f32], c: &mut [f32], sizes: Sizes) {
        Arch::new().dispatch(Product { a: self, b, c, sizes });
    }
}

/// A product that is to be computed.
struct Product<'a> {
    a: &'a Turned<'a>,
    b: &'a [f32],
    c: &'a mut [f32],
    sizes: Sizes,
}

impl WithSimd for Product<'_> {
    type Output = ();

    /// Columns of a tile, by measurement: with AVX2 16 columns give 52 products a nanosecond, 8 give 43, 32 give 24. With AVX-512 8 give 44; 16 give 1.6, because Rust 1.95 keeps
    /// the sums in memory.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        match S::F32_LANES {
            8 => self.compute::<16>(),
            _ => self.compute::<8>(),
        }
    }
}

impl Product<'_> {
    #[inline(always)]
    fn compute<const COLUMNS: usize>(self) {
        let Self { a, b, c, sizes: Sizes { rows, depth, columns, stride } } = self;
        if a.blocks.is_empty() {
            for i in 0..rows {
                let row = &mut c[i * stride..i * stride + columns];
                row.fill(0.0);
                for (&x, b) in a.rows[i * depth..(i + 1) * depth].iter().zip(b.chunks_exact(columns.max(1))) {
                    for (sum, &y) in row.iter_mut().zip(b) {
                        *sum += x * y;
                    }
                }
            }
            return;
        }
        let mut panel = vec![[0.0_f32; COLUMNS]; depth];
        for left in (0..columns).step_by(COLUMNS) {
            let width = COLUMNS.min(columns - left);
            for (row, b) in panel.iter_mut().zip(b.chunks_exact(columns)) {
                match b[left..].first_chunk() {
                    Some(whole) => *row = *whole,
                    None => row[..width].copy_from_slice(&b[left..left + width]),
                }
            }
            for (block, a) in a.blocks.chunks_exact(depth).enumerate() {
                let sums = tile(a, &panel);
                let top = block * TILE_ROWS;
                for (i, sums) in sums.iter().enumerate().take(rows - top) {
                    let at = (top + i) * stride + left;
                    match width == COLUMNS {
                        true => c[at..at + COLUMNS].copy_from_slice(sums),
                        false => c[at..at + width].copy_from_slice(&sums[..width]),
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn tile<const COLUMNS: usize>(a: &[[f32; TILE_ROWS]], b: &[[f32; COLUMNS]]) -> [[f32; COLUMNS]; TILE_ROWS] {
    let mut sums = [[0.0_f32; COLUMNS]; TILE_ROWS];
    for (a, b) in a.iter().zip(b) {
        for (sums, &x) in sums.iter_mut().zip(a) {
            for (sum, &y) in sums.iter_mut().zip(b) {
                *sum += x * y;
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vectors of every width give the bits of a product row by row.
    #[test]
    fn a_product_has_the_same_bits_row_by_row_and_in_tiles() {
        let number = |i: usize| (((i * 7919) % 1009) as f32 - 500.0) / 37.0;
        for (rows, depth, columns) in [(9, 33, 45), (4, 8, 8), (5, 1, 3), (7, 0, 4), (6, 5, 0), (8, 7, 64)] {
            let a: Vec<f32> = (0..rows * depth).map(number).collect();
            let b: Vec<f32> = (0..depth * columns).map(|i| number(i + 5)).collect();
            let whole = |compute: &dyn Fn(Product<'_>)| {
                let mut whole = vec![f32::NAN; rows * columns];
                let sizes = Sizes { rows, depth, columns, stride: columns };
                compute(Product { a: &Turned::new(&a, rows, depth), b: &b, c: &mut whole, sizes });
                whole
            };
            let widths = [
                whole(&|product| product.compute::<8>()),
                whole(&|product| product.compute::<16>()),
                whole(&|product| Arch::new().dispatch(product)),
            ];
            for i in 0..rows {
                let mut row = vec![f32::NAN; columns];
                let a = &a[i * depth..(i + 1) * depth];
                multiply(a, &b, &mut row, Sizes { rows: 1, depth, columns, stride: columns });
                for whole in &widths {
                    assert_eq!(row, whole[i * columns..(i + 1) * columns]);
                }
            }
        }
    }
}

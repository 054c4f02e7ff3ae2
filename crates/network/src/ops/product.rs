//! The product of two matrices, tile by tile, on the widest vectors of the processor.
//!
//! Vectors lie along the columns of the product, so each number is summed by itself: its bits are the same on vectors of every width.

use pulp::{Arch, Scalar, Simd, WithSimd, bytemuck};

/// Sizes of a product of matrices: `a` is rows x depth, `b` is depth x columns, each row by row without gaps.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub rows: usize,
    pub depth: usize,
    pub columns: usize,
}

/// Computes a product of matrices into `c`. Each number is summed from 0 in the order of the depth, whatever the sizes: so its bits do not depend
/// on how the work is split.
pub fn multiply(a: &[f32], b: &[f32], c: &mut [f32], Sizes { rows, depth, columns }: Sizes) {
    let starts: Vec<usize> = (0..depth).map(|k| k * columns).collect();
    let right = Right { numbers: b, starts: &starts, columns, count: 1, step: 0 };
    Turned::new(a, rows, depth).multiply(&right, c, columns, End::default());
}

/// Matrices on the right of products.
#[derive(Clone, Copy)]
pub struct Right<'a> {
    pub numbers: &'a [f32],
    /// Index of the first number of each row of the first matrix.
    pub starts: &'a [usize],
    pub columns: usize,
    /// Number of matrices, and from each to the next.
    pub count: usize,
    pub step: usize,
}

/// Steps that end a product: a bias, and positive parts.
#[derive(Clone, Copy, Default)]
pub struct End<'a> {
    /// Added to the rows, a number for each.
    pub bias: Option<&'a [f32]>,
    /// True if only positive parts are wanted.
    pub positive: bool,
}

impl End<'_> {
    /// Without a bias 0 is added, which changes no bit: a sum that begins at 0 is never -0.
    /// Numbers are chosen by vectors: for plain comparisons the compiler writes relaxed maxima into WebAssembly, which not every engine reads.
    #[inline(always)]
    fn of<S: Simd>(self, simd: S, row: usize, sum: S::f32s) -> S::f32s {
        let (sum, zero) = (
            simd.add_f32s(sum, simd.splat_f32s(self.bias.map_or(0.0, |bias| bias[row]))),
            simd.splat_f32s(0.0),
        );
        match self.positive {
            true => simd.select_f32s(simd.greater_than_f32s(sum, zero), sum, zero),
            false => sum,
        }
    }
}

/// The positive part; 0 for what is not a number, on every processor.
#[inline(always)]
pub fn positive(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

/// Rows of a tile that is summed up in registers.
const TILE_ROWS: usize = 4;

/// A matrix that stands on the left of products, turned for tiles.
pub struct Turned<'a> {
    rows: &'a [f32],
    height: usize,
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
        Self { rows: a, height: rows, blocks: turned }
    }

    /// Computes its products with other matrices into `c`, side by side; `stride` is from row to row.
    pub fn multiply(&self, right: &Right<'_>, c: &mut [f32], stride: usize, end: End<'_>) {
        Arch::new().dispatch(Product { left: self, right, c, stride, end });
    }
}

/// Products that are to be computed.
struct Product<'a> {
    left: &'a Turned<'a>,
    right: &'a Right<'a>,
    c: &'a mut [f32],
    stride: usize,
    end: End<'a>,
}

impl WithSimd for Product<'_> {
    type Output = ();

    /// Vectors beside each other in a tile, by measurement: with AVX-512 2 give 90 to 108 products a nanosecond, 3 and 4 no more; with AVX2 2
    /// give 50, 3 give 31. Numbers that are no vectors stand 8 beside each other, which the compiler may join.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match S::F32_LANES {
            _ if self.left.height < TILE_ROWS => self.compute_rows(simd),
            1 => self.compute::<S, 8>(simd),
            _ => self.compute::<S, 2>(simd),
        }
    }
}

impl Product<'_> {
    /// Row by row, for few rows.
    #[inline(always)]
    fn compute_rows<S: Simd>(self, simd: S) {
        let Self { left, right, c, stride, end: all } = self;
        let &Right { numbers, starts, columns, count, step } = right;
        let (depth, lanes) = (starts.len(), S::F32_LANES);
        for (row, i) in (0..left.height).flat_map(|row| (0..count).map(move |i| (row, i))) {
            let a = &left.rows[row * depth..][..depth];
            let to = &mut c[row * stride + i * columns..][..columns];
            let end = |sum: S::f32s| all.of(simd, row, sum);
            let mut edge = 0;
            while edge < columns {
                // The last vector begins early rather than ends late.
                if columns - edge < lanes {
                    edge = columns.saturating_sub(lanes);
                }
                // Without depth there are no numbers.
                let from = numbers.get(i * step + edge..).unwrap_or_default();
                let to = &mut to[edge..];
                edge += match to.len() {
                    n if n >= 8 * lanes => line::<S, 8>(simd, a, (from, starts), to, end),
                    n if n >= 2 * lanes => line::<S, 2>(simd, a, (from, starts), to, end),
                    n if n >= lanes => line::<S, 1>(simd, a, (from, starts), to, end),
                    n => {
                        for (x, to) in to.iter_mut().enumerate() {
                            let products = a.iter().zip(starts).map(|(a, start)| a * from[start + x]);
                            *to = all.of(Scalar, row, products.fold(0.0, |sum, product| sum + product));
                        }
                        n
                    }
                };
            }
        }
    }

    #[inline(always)]
    fn compute<S: Simd, const VECTORS: usize>(self, simd: S) {
        let Self { left, right, c, stride, end } = self;
        let &Right { numbers, starts, columns, count, step } = right;
        let (depth, wide) = (starts.len(), S::F32_LANES * VECTORS);
        let width = wide.min(columns);
        let mut panel = vec![[simd.splat_f32s(0.0); VECTORS]; depth];
        // The last tile begins early rather than ends late.
        let last = columns.saturating_sub(wide);
        let edges = |i: usize| (0..columns).step_by(wide).map(move |edge| (i, edge.min(last)));
        for (i, edge) in (0..count).flat_map(edges) {
            let from = numbers.get(i * step + edge..).unwrap_or_default();
            for (row, &start) in panel.iter_mut().zip(starts) {
                match S::as_simd_f32s(&from[start..]).0.first_chunk() {
                    Some(whole) => *row = *whole,
                    None => bytemuck::cast_slice_mut(row)[..width].copy_from_slice(&from[start..][..width]),
                }
            }
            for top in (0..left.height).step_by(TILE_ROWS) {
                let a = &left.blocks[top / TILE_ROWS * depth..][..depth];
                let mut sums = tile::<S, VECTORS>(simd, a, &panel);
                for (row, sums) in (top..left.height).zip(&mut sums) {
                    for sum in &mut *sums {
                        *sum = end.of(simd, row, *sum);
                    }
                    let (to, sums) =
                        (&mut c[row * stride + i * columns + edge..], bytemuck::cast_slice(sums));
                    match width < wide {
                        true => to[..width].copy_from_slice(&sums[..width]),
                        false => to[..wide].copy_from_slice(sums),
                    }
                }
            }
        }
    }
}

/// Products of a row of the left matrix with some vectors side by side.
#[inline(always)]
fn line<S: Simd, const VECTORS: usize>(
    simd: S,
    a: &[f32],
    (from, starts): (&[f32], &[usize]),
    to: &mut [f32],
    end: impl Fn(S::f32s) -> S::f32s,
) -> usize {
    let mut sums = [simd.splat_f32s(0.0); VECTORS];
    let wide = S::F32_LANES * VECTORS;
    for (&x, &start) in a.iter().zip(starts) {
        let (x, b) = (simd.splat_f32s(x), &S::as_simd_f32s(&from[start..]).0[..VECTORS]);
        for (sum, &y) in sums.iter_mut().zip(b) {
            *sum = simd.add_f32s(*sum, simd.mul_f32s(x, y));
        }
    }
    for sum in &mut sums {
        *sum = end(*sum);
    }
    to[..wide].copy_from_slice(bytemuck::cast_slice(&sums));
    wide
}

#[inline(always)]
fn tile<S: Simd, const VECTORS: usize>(
    simd: S,
    a: &[[f32; TILE_ROWS]],
    b: &[[S::f32s; VECTORS]],
) -> [[S::f32s; VECTORS]; TILE_ROWS] {
    let mut sums = [[simd.splat_f32s(0.0); VECTORS]; TILE_ROWS];
    for (a, b) in a.iter().zip(b) {
        for (sums, &x) in sums.iter_mut().zip(a) {
            let x = simd.splat_f32s(x);
            for (sum, &y) in sums.iter_mut().zip(b) {
                *sum = simd.add_f32s(*sum, simd.mul_f32s(x, y));
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Scalar128b, Scalar256b, Scalar512b};

    /// Vectors of every width give the bits of sums one by one.
    #[test]
    fn a_product_has_the_same_bits_one_by_one_and_in_tiles() {
        let number = |i: usize| (((i * 7919) % 1009) as f32 - 500.0) / 37.0;
        for (rows, depth, columns) in [
            (9, 33, 45),
            (4, 8, 8),
            (5, 1, 3),
            (7, 0, 70),
            (2, 0, 70),
            (6, 5, 0),
            (8, 7, 64),
            (3, 9, 21),
            (1, 40, 1),
        ] {
            let a: Vec<f32> = (0..rows * depth).map(number).collect();
            // Two matrices, the second 3 numbers behind the first; the rows overlap.
            let b = if depth > 0 { depth * 2 + columns + 3 } else { 0 };
            let b: Vec<f32> = (0..b).map(|i| number(i + 5)).collect();
            let starts: Vec<usize> = (0..depth).map(|k| 2 * k).collect();
            let bias: Vec<f32> = (0..rows).map(|i| number(i + 9)).collect();
            for (bias, positive) in [(None, false), (Some(bias.as_slice()), true)] {
                let whole = |compute: &dyn Fn(Product<'_>)| {
                    let mut whole = vec![f32::NAN; rows * (2 * columns + 1)];
                    let right = Right { numbers: &b, starts: &starts, columns, count: 2, step: 3 };
                    let (left, end) = (&Turned::new(&a, rows, depth), End { bias, positive });
                    compute(Product { left, right: &right, c: &mut whole, stride: 2 * columns + 1, end });
                    whole.iter().map(|x| x.to_bits()).collect::<Vec<u32>>()
                };
                let mut plain = vec![f32::NAN.to_bits(); rows * (2 * columns + 1)];
                for (i, j, x) in
                    (0..rows).flat_map(|i| (0..2).flat_map(move |j| (0..columns).map(move |x| (i, j, x))))
                {
                    let products = (0..depth).map(|k| a[i * depth + k] * b[2 * k + 3 * j + x]);
                    let sum = products.fold(0.0, |sum, product| sum + product);
                    let sum = bias.map_or(sum, |bias| sum + bias[i]);
                    let sum = if positive && sum <= 0.0 { 0.0 } else { sum };
                    plain[i * (2 * columns + 1) + j * columns + x] = sum.to_bits();
                }
                assert_eq!(plain, whole(&|product| product.with_simd(Scalar)));
                assert_eq!(plain, whole(&|product| product.with_simd(Scalar128b)));
                assert_eq!(plain, whole(&|product| product.with_simd(Scalar256b)));
                assert_eq!(plain, whole(&|product| product.with_simd(Scalar512b)));
                assert_eq!(plain, whole(&|product| Arch::new().dispatch(product)));
            }
        }
    }
}

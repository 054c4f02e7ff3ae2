//! Articulated inertia: its entries in memory, and point masses added to it.

use super::instructions::Instructions;
use super::lane::{Lane, Lane3, dot, scale};
use crate::layout::load;

/// Places of the entries of a symmetric matrix.
pub(super) const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Adds `-m [r][r]`, `m [r]`, `m 1`.
#[inline(always)]
pub(super) fn add_point_mass<S: Instructions>(
    simd: S,
    load: &mut [S::Vector; load::FIELDS],
    mass: Lane<S>,
    r: Lane3<S>,
) {
    let mr = scale(mass, r);
    let square = dot(mr, r);
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        let entry = &mut load[load::ANGULAR + k];
        let own = mr[i].take_from(r[j], Lane::load(simd, *entry));
        *entry = if i == j { own + square } else { own }.value;
    }
    for (column, row, value) in
        [(0, 1, mr[2]), (0, 2, -mr[1]), (1, 0, -mr[2]), (1, 2, mr[0]), (2, 0, mr[1]), (2, 1, -mr[0])]
    {
        let entry = &mut load[load::COUPLING + 3 * column + row];
        *entry = (Lane::load(simd, *entry) + value).value;
    }
    for k in [0, 3, 5] {
        load[load::LINEAR + k] = (Lane::load(simd, load[load::LINEAR + k]) + mass).value;
    }
}

//! The tests at the end of a frame.

use super::instructions::Instructions;
use super::lane::{Lane, dot, load3};
use super::{Found, View};
use crate::layout::{fruit, fruit_work, limit, link, stem as stem_fields};

/// Findings in any world of the tile.
#[inline(always)]
pub(super) fn find<S: Instructions>(simd: S, view: &View<S>) -> Found {
    let zero = Lane::splat(simd, 0.0);
    let mut largest = zero;
    // A square that is not finite, times 0, is NaN and makes the sum NaN.
    let mut poison = [zero; 2];
    for (link, limit) in view.links.iter().zip(view.bend_limits) {
        let number = |field: usize| Lane::load(simd, link[field]);
        let (q_1, q_2) = (number(link::Q), number(link::Q + 1));
        let (v_1, v_2) = (number(link::V), number(link::V + 1));
        let bend = q_1.mul_add(q_1, q_2 * q_2);
        let over = bend - Lane::load(simd, *limit);
        largest = over.if_above(largest, over, largest);
        poison[0] = v_1.mul_add(v_1, v_2.mul_add(v_2, bend)).mul_add(zero, poison[0]);
    }
    for ((fruit, left), limits) in view.fruit.iter().zip(view.fruit_work.iter()).zip(view.stem_limits) {
        let (stretch, force) =
            (load3(simd, &left[fruit_work::STRETCH..]), load3(simd, &fruit[fruit::FORCE..]));
        for (v, field) in [(stretch, limit::STRETCH), (force, limit::PULL)] {
            let over = dot(v, v) - Lane::load(simd, limits[field]);
            largest = over.if_above(largest, over, largest);
        }
        for (state, poison) in [fruit::P, fruit::V].into_iter().zip(&mut poison) {
            let x = load3(simd, &fruit[state..]);
            *poison = dot(x, x).mul_add(zero, *poison);
        }
    }
    for stem in view.stems.iter() {
        let v = load3(simd, &stem[stem_fields::V..]);
        let q = load3(simd, &stem[stem_fields::Q..]);
        poison[0] = (dot(q, q) + dot(v, v)).mul_add(zero, poison[0]);
    }
    let one = Lane::splat(simd, 1.0);
    let is_poisoned = (poison[0] + poison[1]).if_above(-one, zero, one);
    Found { over_limit: largest.any_above(zero), non_finite: is_poisoned.any_above(zero) }
}

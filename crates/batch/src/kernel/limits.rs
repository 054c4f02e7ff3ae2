//! Whether anything is over what it bears, for the tests at the end of a frame.

use super::View;
use super::lane::{Lane, dot, load3};
use crate::layout::{fruit, fruit_work, limit, link};
use pulp::Simd;

/// Whether any joint or stem of the tile is over a limit.
#[inline(always)]
pub(super) fn any_over<S: Simd>(simd: S, view: &View<S>) -> bool {
    let mut largest = Lane::splat(simd, 0.0);
    for (link, limit) in view.links.iter().zip(view.bend_limits) {
        let (q_1, q_2) = (Lane::load(simd, link[link::Q]), Lane::load(simd, link[link::Q + 1]));
        let over = q_1.mul_add(q_1, q_2 * q_2) - Lane::load(simd, *limit);
        largest = over.if_above(largest, over, largest);
    }
    for ((fruit, left), limits) in view.fruit.iter().zip(view.fruit_work.iter()).zip(view.stem_limits) {
        let (stretch, force) =
            (load3(simd, &left[fruit_work::STRETCH..]), load3(simd, &fruit[fruit::FORCE..]));
        for (v, field) in [(stretch, limit::STRETCH), (force, limit::PULL)] {
            let over = dot(v, v) - Lane::load(simd, limits[field]);
            largest = over.if_above(largest, over, largest);
        }
    }
    largest.any_above(Lane::splat(simd, 0.0))
}

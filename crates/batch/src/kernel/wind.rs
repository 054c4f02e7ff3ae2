//! Force of the air on links and hanging fruit, set at the start of a frame, and the drag that takes the link's own part of it implicitly: the rule of
//! `orchard_treephys::wind`.

use super::instructions::Instructions;
use super::lane::{Lane, Lane3, add, axmy, axpy, dot, lanes_of, load3, scale, store3, sub};
use super::motion::Here;
use super::{Air, Step, gather, rows};
use crate::layout::{air, ball, fruit, link};
use crate::schedule::{NO_SLOT, Row, Source};
use pulp::bytemuck;

/// The air of a tile as vectors.
pub(super) struct View<'a, S: Instructions> {
    /// By row.
    pub links: &'a mut [[S::Vector; air::FIELDS]],
    balls: &'a [[S::Vector; ball::FIELDS]],
    sample_of_row: &'a [Option<usize>],
    samples: &'a [[S::Vector; 3]],
    masks: &'a [S::Vector],
    slots: &'a mut [[S::Vector; 3]],
    folding_speed: &'a [S::Vector],
}

impl<'a, S: Instructions> View<'a, S> {
    #[inline(always)]
    pub fn new(air: &'a mut Air) -> Self {
        Self {
            links: rows::<S, _>(air.links.as_mut_slice()),
            balls: rows::<S, _>(air.balls.as_mut_slice()),
            sample_of_row: &air.sample_of_row,
            samples: rows::<S, _>(air.samples.as_mut_slice()),
            masks: bytemuck::cast_slice(air.masks.as_slice()),
            slots: rows::<S, _>(air.slots.as_mut_slice()),
            folding_speed: bytemuck::cast_slice(air.folding_speed.as_slice()),
        }
    }

    /// Velocity of the air at the place of the links of a row: their own, or that of their parents.
    #[inline(always)]
    pub fn at(&mut self, simd: S, k: usize, row: &Row, sources: &[Source], masks: &[S::Vector]) -> Lane3<S> {
        // Two slots beyond those of the schedule.
        let Some((scratch, slots)) = self.slots.split_last_mut() else { return [Lane::splat(simd, 0.0); 3] };
        if sources.len() > 1 {
            gather(simd, sources, masks, slots, scratch);
        } else {
            *scratch = slots[sources[0].slot];
        }
        let mut here = load3(simd, scratch);
        if let Some(sample) = self.sample_of_row[k] {
            let starts = lanes_of(simd, self.masks[sample]);
            let own = load3(simd, &self.samples[sample]);
            here = [0, 1, 2].map(|axis| own[axis].where_true(starts, here[axis]));
        }
        let own = if row.slot == NO_SLOT { slots.len() - 1 } else { row.slot };
        store3::<S>(&mut slots[own], here);
        here
    }

    /// Sets force and drag of the links of a row.
    #[inline(always)]
    pub fn press(
        &mut self,
        simd: S,
        k: usize,
        air: Lane3<S>,
        link: &mut [S::Vector; link::FIELDS],
        here: &Here<S>,
        step: Step,
    ) {
        let constant = |number: f32| Lane::splat(simd, number);
        let number = |field: usize| Lane::load(simd, self.links[k][field]);
        let (h, half) = (constant(step.h), constant(0.5));
        let [_, _, z] = here.axes;
        let v = axpy(half, here.v_d, here.v);
        let w = sub(air, v);
        let across = axmy(dot(w, z), z, w);
        let of_wood = number(air::WOOD) * dot(across, across).sqrt();
        let (speed, folding) = (dot(w, w).sqrt(), Lane::load(simd, self.folding_speed[0]));
        let of_leaves = number(air::LEAVES) * speed.if_above(folding, folding, speed);
        let rate = of_wood + of_leaves;
        let force = axpy(of_wood, across, axpy(of_leaves, w, scale(rate, v)));

        // The drag as mass: half of it at either end of the link.
        let (h_mass, length) = (Lane::load(simd, link[link::H_MASS]), Lane::load(simd, link[link::LENGTH]));
        let (still, h_rate) = (number(air::STILL), h * rate);
        let quarter = constant(0.25) * h_rate;
        let mass = constant(1.0 / step.h) * h_mass;
        link[link::LINEAR_DRAG] = h_rate.mul_add(number(air::PER_H_MASS), still).value;
        link[link::HALF_MASS] = (half * (mass.mul_add(h * still, mass) + h_rate)).value;
        link[link::ACROSS] = quarter.take_from(length * length, number(air::ACROSS)).value;
        link[link::ALONG] = (number(air::ALONG) + quarter).value;
        store3::<S>(&mut self.links[k][air::H_FORCE..], scale(h, force));
    }

    /// Sets the applied force on a fruit: the wind's beside what pulls at it.
    #[inline(always)]
    pub fn press_fruit(&self, simd: S, k: usize, air: Lane3<S>, fruit: &mut [S::Vector; fruit::FIELDS]) {
        let w = sub(air, load3(simd, &fruit[fruit::V..]));
        let ball = &self.balls[k];
        let rate = Lane::load(simd, ball[ball::DRAG]) * dot(w, w).sqrt();
        store3::<S>(&mut fruit[fruit::FORCE..], add(scale(rate, w), load3(simd, &ball[ball::PULL..])));
    }
}

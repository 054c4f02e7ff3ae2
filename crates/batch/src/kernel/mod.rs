//! The step of one tile in vectors of f32: the passes of `docs/computation/dynamics.md` over all its worlds.
//!
//! [`inward`] is the elimination from leaf to root, [`advance`] the root-to-leaf sweep with the new velocities,
//! [`outward`] kinematics and right-hand side of the new state. The equations are those of
//! `orchard_multibody`, for universal joints, links that are symmetric about their own axis, and fruit on stems.

mod advance;
mod gusts;
mod inertia;
mod instructions;
mod inward;
mod lane;
mod limits;
mod motion;
mod outward;
mod stem;
mod wind;

use crate::layout::{
    Aligned, LINE, air, ball, change, fruit, fruit_work, limit, link, load, prop, stem as stem_fields,
    stem_work, tip, tip_motion, work,
};
use crate::schedule::{Row, Schedule, Source};
pub(crate) use gusts::{Gusts, WAVE_STEPS, WaveNumbers};
pub(crate) use instructions::{Baseline, Instructions};
use lane::{Lane, lanes_of};
use pulp::bytemuck;

/// Numbers of a substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    /// Length \[s\].
    pub h: f32,
    /// Magnitude of gravity along -z [m/s^2].
    pub gravity: f32,
    /// True if a fruit of the tile may be off its stem.
    pub has_loose: bool,
}

/// Part of a substep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Kinematics and right-hand side of the present state.
    Start,
    /// The tests at the end of a frame.
    Test,
    /// Velocity change and new state, with its kinematics and right-hand side, from those of the last one.
    Advance,
}

/// Findings of the tests at the end of a frame, in any world.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Found {
    /// A joint or stem over its limit; after an advance, a stem whose wear counts.
    pub over_limit: bool,
    /// A state that is not finite, or whose square is not.
    pub non_finite: bool,
}

/// The numbers of a tile.
#[derive(Debug, Clone)]
pub(crate) struct Numbers {
    pub schedule: Schedule,
    pub links: Aligned,
    pub work: Aligned,
    pub fruit: Aligned,
    pub fruit_work: Aligned,
    /// By row of fruit; empty where fruit hang on tethers.
    pub stems: Aligned,
    pub stem_work: Aligned,
    /// Square of the joint angle that ruptures, by row; infinite where the joint cannot break.
    pub bend_limits: Aligned,
    /// Limits of the stems, by row of fruit.
    pub stem_limits: Aligned,
    /// By slot; more slots are for rows without children, and scratch.
    pub tips: Aligned,
    /// By slot, like `tips`.
    pub changes: Aligned,
    /// By slot; more slots are always zero, scratch of the row, and its result.
    pub loads: Aligned,
    /// Lanes of each source of the schedule, as bits.
    pub masks: Aligned,
    /// By row; empty until a limb breaks.
    pub tip_motion: Aligned,
    /// By row; empty until a limb breaks.
    pub props: Aligned,
    /// `None` in still air.
    pub air: Option<Air>,
}

/// The numbers of a tile in wind.
#[derive(Debug, Clone)]
pub(crate) struct Air {
    /// By row.
    pub links: Aligned,
    /// By row of fruit.
    pub balls: Aligned,
    /// Sample of each row in which the link of a world is the first of its place.
    pub sample_of_row: Vec<Option<usize>>,
    /// Velocity of the air [m/s], by sample.
    pub samples: Aligned,
    /// Lanes of each sample, as bits.
    pub masks: Aligned,
    /// Velocity of the air at the links of a slot, and scratch, like `Numbers::tips`.
    pub slots: Aligned,
    /// Speed from which leaves fold [m/s], by lane.
    pub folding_speed: Aligned,
}

impl Air {
    /// Air for some rows of the samples of each lane: `starts[lane]` lists the rows of the first links of its places.
    pub fn new(schedule: &Schedule, lanes: usize, starts: &[Vec<usize>]) -> Self {
        let rows = schedule.rows.len();
        let mut sample_of_row = vec![None; rows];
        for row in starts.iter().flatten() {
            sample_of_row[*row] = Some(0);
        }
        let samples = sample_of_row.iter_mut().flatten().enumerate();
        let count = samples.map(|(number, sample)| *sample = number).count();
        let mut masks = Aligned::zeros(count * lanes);
        for (lane, rows) in starts.iter().enumerate() {
            for sample in rows.iter().filter_map(|row| sample_of_row[*row]) {
                masks.as_mut_slice()[sample * lanes + lane] = f32::from_bits(u32::MAX);
            }
        }
        Self {
            links: Aligned::zeros(rows * air::FIELDS * lanes),
            balls: Aligned::zeros(schedule.fruit_rows() * ball::FIELDS * lanes),
            sample_of_row,
            samples: Aligned::zeros(count * 3 * lanes),
            masks,
            slots: Aligned::zeros((schedule.slots + 2) * 3 * lanes),
            folding_speed: Aligned::zeros(lanes),
        }
    }

    fn parts(&self) -> [&Aligned; 6] {
        [&self.links, &self.balls, &self.samples, &self.masks, &self.slots, &self.folding_speed]
    }
}

impl Numbers {
    pub fn new(schedule: Schedule, lanes: usize, has_stems: bool) -> Self {
        let numbers = |rows: usize, fields: usize| Aligned::zeros(rows * fields * lanes);
        let infinite = |rows: usize, fields: usize| {
            let mut limits = numbers(rows, fields);
            limits.as_mut_slice().fill(f32::INFINITY);
            limits
        };
        let (rows, fruit_rows, slots) = (schedule.rows.len(), schedule.fruit_rows(), schedule.slots);
        let stem_rows = if has_stems { fruit_rows } else { 0 };
        let mut masks = numbers(schedule.sources.len(), 1);
        for (mask, is_in) in masks.as_mut_slice().iter_mut().zip(schedule.lanes_of_source.iter().flatten()) {
            *mask = f32::from_bits(if *is_in { u32::MAX } else { 0 });
        }
        Self {
            links: numbers(rows, link::FIELDS),
            work: numbers(rows, work::FIELDS),
            fruit: numbers(fruit_rows, fruit::FIELDS),
            fruit_work: numbers(fruit_rows, fruit_work::FIELDS),
            stems: numbers(stem_rows, stem_fields::FIELDS),
            stem_work: numbers(stem_rows, stem_work::FIELDS),
            bend_limits: infinite(rows, 1),
            stem_limits: infinite(fruit_rows, limit::FIELDS),
            tips: numbers(slots + 2, tip::FIELDS),
            changes: numbers(slots + 2, change::FIELDS),
            loads: numbers(slots + 3, load::FIELDS),
            masks,
            tip_motion: Aligned::zeros(0),
            props: Aligned::zeros(0),
            air: None,
            schedule,
        }
    }

    /// Allocates the motion of the tips and the ground's contact with them, from now on computed.
    pub fn expect_debris(&mut self, lanes: usize) {
        let rows = self.schedule.rows.len();
        if self.props.as_slice().is_empty() {
            self.tip_motion = Aligned::zeros(rows * tip_motion::FIELDS * lanes);
            self.props = Aligned::zeros(rows * prop::FIELDS * lanes);
        }
    }

    /// Memory of the numbers.
    pub fn bytes(&self) -> usize {
        let all = [
            &self.links,
            &self.work,
            &self.fruit,
            &self.fruit_work,
            &self.stems,
            &self.stem_work,
            &self.bend_limits,
            &self.stem_limits,
            &self.tips,
            &self.changes,
            &self.loads,
            &self.masks,
            &self.tip_motion,
            &self.props,
        ];
        let of_air = self.air.iter().flat_map(Air::parts);
        size_of::<f32>() * all.into_iter().chain(of_air).map(|part| part.as_slice().len()).sum::<usize>()
    }
}

/// A phase on one tile, to be compiled for each kind of processor.
pub(crate) struct Work<'a> {
    pub numbers: &'a mut Numbers,
    pub step: Step,
    pub phase: Phase,
    /// True if the new state is that at the start of a frame: the air then acts anew.
    pub blows: bool,
}

/// Work to be compiled for each set of instructions.
pub(crate) trait Task {
    type Output;

    /// Does it.
    fn with<S: Instructions>(self, simd: S) -> Self::Output;
}

/// A local variable that starts on a cache line: with one, all that a function keeps on its stack is aligned for the widest vectors. Without it
/// each register on the stack straddles two lines, and one of them two pages, which costs more than a fruit.
#[derive(Default)]
#[repr(align(64))]
struct OnLine([u32; LINE]);

impl Task for Work<'_> {
    type Output = Found;

    /// Runs the phase.
    #[inline(always)]
    fn with<S: Instructions>(self, simd: S) -> Found {
        std::hint::black_box(&mut OnLine::default().0);
        let has_stems = !self.numbers.stems.as_slice().is_empty();
        let mut view = View::new(self.numbers);
        match (self.phase, has_stems) {
            (Phase::Test, _) => limits::find(simd, &view),
            (phase, false) => passes::<S, false>(simd, &mut view, phase, self.step, self.blows),
            (phase, true) => passes::<S, true>(simd, &mut view, phase, self.step, self.blows),
        }
    }
}

/// The passes of a phase. A batch with fruit on tethers runs code without a trace of stems.
#[inline(always)]
fn passes<S: Instructions, const STEMS: bool>(
    simd: S,
    view: &mut View<S>,
    phase: Phase,
    step: Step,
    blows: bool,
) -> Found {
    if phase == Phase::Advance {
        inward::run::<S, STEMS>(simd, view);
        advance::run::<S, STEMS>(simd, view, step);
    }
    let is = outward::Moment { after_advance: phase == Phase::Advance, start_of_frame: blows };
    Found { over_limit: outward::run::<S, STEMS>(simd, view, step, is), non_finite: false }
}

/// The numbers of a tile as vectors.
struct View<'a, S: Instructions> {
    rows: &'a [Row],
    sources: &'a [Source],
    masks: &'a [S::Vector],
    links: &'a mut [[S::Vector; link::FIELDS]],
    work: &'a mut [[S::Vector; work::FIELDS]],
    bend_limits: &'a [S::Vector],
    stem_limits: &'a [[S::Vector; limit::FIELDS]],
    fruit: &'a mut [[S::Vector; fruit::FIELDS]],
    fruit_work: &'a mut [[S::Vector; fruit_work::FIELDS]],
    stems: &'a mut [[S::Vector; stem_fields::FIELDS]],
    stem_work: &'a mut [[S::Vector; stem_work::FIELDS]],
    tips: &'a mut [[S::Vector; tip::FIELDS]],
    changes: &'a mut [[S::Vector; change::FIELDS]],
    loads: &'a mut [[S::Vector; load::FIELDS]],
    tip_motion: &'a mut [[S::Vector; tip_motion::FIELDS]],
    props: &'a mut [[S::Vector; prop::FIELDS]],
    air: Option<wind::View<'a, S>>,
}

impl<'a, S: Instructions> View<'a, S> {
    #[inline(always)]
    fn new(numbers: &'a mut Numbers) -> Self {
        View {
            rows: &numbers.schedule.rows,
            sources: &numbers.schedule.sources,
            masks: bytemuck::cast_slice(numbers.masks.as_slice()),
            bend_limits: bytemuck::cast_slice(numbers.bend_limits.as_slice()),
            stem_limits: bytemuck::cast_slice::<_, S::Vector>(numbers.stem_limits.as_slice()).as_chunks().0,
            links: rows::<S, _>(numbers.links.as_mut_slice()),
            work: rows::<S, _>(numbers.work.as_mut_slice()),
            fruit: rows::<S, _>(numbers.fruit.as_mut_slice()),
            fruit_work: rows::<S, _>(numbers.fruit_work.as_mut_slice()),
            stems: rows::<S, _>(numbers.stems.as_mut_slice()),
            stem_work: rows::<S, _>(numbers.stem_work.as_mut_slice()),
            tips: rows::<S, _>(numbers.tips.as_mut_slice()),
            changes: rows::<S, _>(numbers.changes.as_mut_slice()),
            loads: rows::<S, _>(numbers.loads.as_mut_slice()),
            tip_motion: rows::<S, _>(numbers.tip_motion.as_mut_slice()),
            props: rows::<S, _>(numbers.props.as_mut_slice()),
            air: numbers.air.as_mut().map(wind::View::new),
        }
    }
}

#[inline(always)]
fn rows<S: Instructions, const N: usize>(numbers: &mut [f32]) -> &mut [[S::Vector; N]] {
    let vectors: &mut [S::Vector] = bytemuck::cast_slice_mut(numbers);
    vectors.as_chunks_mut().0
}

/// Gathers the slots of a row's parents, each for its lanes.
#[inline(always)]
fn gather<S: Instructions, const N: usize>(
    simd: S,
    sources: &[Source],
    masks: &[S::Vector],
    slots: &[[S::Vector; N]],
    parents: &mut [S::Vector; N],
) {
    match sources.len() {
        2 => merge::<S, N, 2>(simd, sources, masks, slots, parents),
        3 => merge::<S, N, 3>(simd, sources, masks, slots, parents),
        _ => merge::<S, N, 4>(simd, sources, masks, slots, parents),
    }
    for (source, mask) in sources.iter().zip(masks).skip(4) {
        let is_here = lanes_of(simd, *mask);
        for (to, from) in parents.iter_mut().zip(&slots[source.slot]) {
            *to = Lane::load(simd, *from).where_true(is_here, Lane::load(simd, *to)).value;
        }
    }
}

/// The first `K` sources together, field by field, so that no partial sum goes through memory.
#[inline(always)]
fn merge<S: Instructions, const N: usize, const K: usize>(
    simd: S,
    sources: &[Source],
    masks: &[S::Vector],
    slots: &[[S::Vector; N]],
    parents: &mut [S::Vector; N],
) {
    let mut from = [&slots[sources[0].slot]; K];
    let mut is_here = [lanes_of(simd, masks[0]); K];
    for k in 1..K {
        from[k] = &slots[sources[k].slot];
        is_here[k] = lanes_of(simd, masks[k]);
    }
    for (field, to) in parents.iter_mut().enumerate() {
        let mut merged = Lane::load(simd, from[0][field]);
        for k in 1..K {
            merged = Lane::load(simd, from[k][field]).where_true(is_here[k], merged);
        }
        *to = merged.value;
    }
}

/// A polynomial, the coefficient of the highest power first.
#[inline(always)]
fn polynomial<S: Instructions>(simd: S, coefficients: &[f32; 5], x: Lane<S>) -> Lane<S> {
    let mut sum = Lane::splat(simd, coefficients[0]);
    for c in &coefficients[1..] {
        sum = sum.mul_add(x, Lane::splat(simd, *c));
    }
    sum
}

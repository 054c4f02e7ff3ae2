//! The step of one tile in vectors of f32: the passes of `docs/computation/dynamics.md` over all its worlds.
//!
//! [`outward`] is kinematics and right-hand side, [`inward`] the elimination from the tips to the root,
//! [`change`] the way back with the new velocities. The equations are those of `orchard_multibody`, for
//! universal joints, links that are symmetric about their own axis, and fruit on stems.

mod change;
mod inward;
mod lane;
mod outward;

use crate::layout::{change as velocity_change, fruit, fruit_work, link, load, pose, work};
use crate::schedule::{Move, NO_SLOT, Schedule, WORLD_SLOT};
use crate::tile::Tile;
use pulp::{Simd, WithSimd, bytemuck};

/// Numbers of a substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    /// Length [s].
    pub h: f32,
    /// Magnitude of gravity along -z [m/s^2].
    pub gravity: f32,
}

/// Which part of a substep to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Kinematics and right-hand side of the present state.
    Outward,
    /// Velocity change and new state, from the last `Outward`.
    Solve,
}

/// A phase on one tile, to be compiled for each kind of processor.
pub(crate) struct Work<'a> {
    pub tile: &'a mut Tile,
    pub step: Step,
    pub phase: Phase,
}

impl WithSimd for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut view = View::new(self.tile);
        match self.phase {
            Phase::Outward => outward::run(simd, &mut view, self.step),
            Phase::Solve => {
                inward::run(simd, &mut view, self.step);
                change::run(simd, &mut view, self.step);
            }
        }
    }
}

/// The numbers of a tile as vectors.
struct View<'a, S: Simd> {
    schedule: &'a Schedule,
    /// Rows of fruit by row of links.
    fruit_start: &'a [usize],
    links: &'a mut [[S::f32s; link::FIELDS]],
    work: &'a mut [[S::f32s; work::FIELDS]],
    fruit: &'a mut [[S::f32s; fruit::FIELDS]],
    fruit_work: &'a mut [[S::f32s; fruit_work::FIELDS]],
    poses: &'a mut [[S::f32s; pose::FIELDS]],
    loads: &'a mut [[S::f32s; load::FIELDS]],
    changes: &'a mut [[S::f32s; velocity_change::FIELDS]],
}

impl<'a, S: Simd> View<'a, S> {
    #[inline(always)]
    fn new(tile: &'a mut Tile) -> Self {
        View {
            schedule: &tile.schedule,
            fruit_start: &tile.fruit_start,
            links: rows::<S, _>(tile.links.as_mut_slice()),
            work: rows::<S, _>(tile.work.as_mut_slice()),
            fruit: rows::<S, _>(tile.fruit.as_mut_slice()),
            fruit_work: rows::<S, _>(tile.fruit_work.as_mut_slice()),
            poses: rows::<S, _>(tile.poses.as_mut_slice()),
            loads: rows::<S, _>(tile.loads.as_mut_slice()),
            changes: rows::<S, _>(tile.changes.as_mut_slice()),
        }
    }
}

#[inline(always)]
fn rows<S: Simd, const N: usize>(numbers: &mut [f32]) -> &mut [[S::f32s; N]] {
    let vectors: &mut [S::f32s] = bytemuck::cast_slice_mut(numbers);
    vectors.as_chunks_mut().0
}

/// Floats of rows of vectors.
#[inline(always)]
fn floats<S: Simd, const N: usize>(rows: &[[S::f32s; N]]) -> &[f32] {
    bytemuck::cast_slice(rows.as_flattened())
}

#[inline(always)]
fn floats_mut<S: Simd, const N: usize>(rows: &mut [[S::f32s; N]]) -> &mut [f32] {
    bytemuck::cast_slice_mut(rows.as_flattened_mut())
}

/// Slots of the lanes of a row.
#[inline(always)]
fn lanes_of<S: Simd>(slots: &[u16], row: usize) -> &[u16] {
    &slots[row * S::F32_LANES..][..S::F32_LANES]
}

/// `current` comes back from the slots, in the lanes where the row's parent is not the row before.
#[inline(always)]
fn resume<S: Simd, const N: usize>(
    schedule: &Schedule,
    row: usize,
    slots: &[[S::f32s; N]],
    current: &mut [S::f32s; N],
) {
    match schedule.resume[row] {
        Move::None => {}
        Move::All(slot) => *current = slots[usize::from(slot)],
        Move::Each => {
            let (from, to) = (floats::<S, N>(slots), floats_mut::<S, N>(std::slice::from_mut(current)));
            for (lane, &slot) in lanes_of::<S>(&schedule.resume_slot, row).iter().enumerate() {
                if slot != NO_SLOT {
                    let from = &from[usize::from(slot) * N * S::F32_LANES..][..N * S::F32_LANES];
                    for field in 0..N {
                        to[field * S::F32_LANES + lane] = from[field * S::F32_LANES + lane];
                    }
                }
            }
        }
    }
}

/// `current` goes into the slots, in the lanes where the row is a fork.
#[inline(always)]
fn keep<S: Simd, const N: usize>(
    schedule: &Schedule,
    row: usize,
    slots: &mut [[S::f32s; N]],
    current: &[S::f32s; N],
) {
    match schedule.keep[row] {
        Move::None => {}
        Move::All(slot) => slots[usize::from(slot)] = *current,
        Move::Each => {
            let (to, from) = (floats_mut::<S, N>(slots), floats::<S, N>(std::slice::from_ref(current)));
            for (lane, &slot) in lanes_of::<S>(&schedule.keep_slot, row).iter().enumerate() {
                if slot != NO_SLOT {
                    let to = &mut to[usize::from(slot) * N * S::F32_LANES..][..N * S::F32_LANES];
                    for field in 0..N {
                        to[field * S::F32_LANES + lane] = from[field * S::F32_LANES + lane];
                    }
                }
            }
        }
    }
}

/// On the way in: what the other children of a fork have left in its slot joins what its first child brings.
/// The slot is empty afterwards.
#[inline(always)]
fn collect<S: Simd, const N: usize>(
    simd: S,
    schedule: &Schedule,
    row: usize,
    slots: &mut [[S::f32s; N]],
    current: &mut [S::f32s; N],
) {
    match schedule.keep[row] {
        Move::None => {}
        Move::All(slot) => {
            for (to, from) in current.iter_mut().zip(&mut slots[usize::from(slot)]) {
                *to = simd.add_f32s(*to, *from);
                *from = simd.splat_f32s(0.0);
            }
        }
        Move::Each => {
            let (from, to) = (floats_mut::<S, N>(slots), floats_mut::<S, N>(std::slice::from_mut(current)));
            for (lane, &slot) in lanes_of::<S>(&schedule.keep_slot, row).iter().enumerate() {
                if slot != NO_SLOT {
                    let from = &mut from[usize::from(slot) * N * S::F32_LANES..][..N * S::F32_LANES];
                    for field in 0..N {
                        to[field * S::F32_LANES + lane] +=
                            std::mem::take(&mut from[field * S::F32_LANES + lane]);
                    }
                }
            }
        }
    }
}

/// On the way in: a link whose parent is not the row before leaves its load in the parent's slot. What the
/// world frame bears is forgotten.
#[inline(always)]
fn deliver<S: Simd, const N: usize>(
    simd: S,
    schedule: &Schedule,
    row: usize,
    slots: &mut [[S::f32s; N]],
    current: &mut [S::f32s; N],
) {
    match schedule.resume[row] {
        Move::None => {}
        Move::All(slot) => {
            for (from, to) in current.iter_mut().zip(&mut slots[usize::from(slot)]) {
                if slot != WORLD_SLOT {
                    *to = simd.add_f32s(*to, *from);
                }
                *from = simd.splat_f32s(0.0);
            }
        }
        Move::Each => {
            let (to, from) = (floats_mut::<S, N>(slots), floats_mut::<S, N>(std::slice::from_mut(current)));
            for (lane, &slot) in lanes_of::<S>(&schedule.resume_slot, row).iter().enumerate() {
                if slot == NO_SLOT {
                    continue;
                }
                let to = &mut to[usize::from(slot) * N * S::F32_LANES..][..N * S::F32_LANES];
                for field in 0..N {
                    let brought = std::mem::take(&mut from[field * S::F32_LANES + lane]);
                    if slot != WORLD_SLOT {
                        to[field * S::F32_LANES + lane] += brought;
                    }
                }
            }
        }
    }
}

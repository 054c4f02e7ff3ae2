//! Elimination of the joints, leaf to root.

use super::inertia::{ENTRIES, add_point_mass};
use super::instructions::Instructions;
use super::lane::{Lane, Lane3, axmy, cross_add, dot, dot_add, load3, scale, store3, sub};
use super::{View, stem};
use crate::layout::{fruit_work, link, load, prop, work};
use crate::schedule::{NO_SLOT, Row, Source};

#[inline(always)]
pub(super) fn run<S: Instructions, const STEMS: bool>(simd: S, view: &mut View<S>) {
    let View { rows, sources, masks, links, work, fruit_work, stems, stem_work, loads, props, .. } = view;
    // Three slots beyond those of the schedule.
    let (nothing, scratch, delivered) = (loads.len() - 3, loads.len() - 2, loads.len() - 1);
    for (k, ((row, link), work)) in rows.iter().zip(links.iter()).zip(work.iter_mut()).enumerate().rev() {
        let mut borne = if row.slot == NO_SLOT { nothing } else { row.slot };
        let prop = props.get(k);
        if row.fruit.0 < row.fruit.1 || prop.is_some() {
            if row.slot == NO_SLOT {
                borne = scratch;
                loads[borne] = loads[nothing];
            }
            for k in row.fruit.0..row.fruit.1 {
                let left = &fruit_work[k];
                let r_tip = load3(simd, &left[fruit_work::R_TIP..]);
                if STEMS {
                    stem::inward(simd, &mut loads[borne], r_tip, &stems[k], &stem_work[k]);
                } else {
                    let mass = Lane::load(simd, left[fruit_work::ADDED_MASS]);
                    add_point_mass(simd, &mut loads[borne], mass, r_tip);
                }
            }
            if let Some(prop) = prop {
                prop_up(simd, &mut loads[borne], prop);
            }
        }
        let (first, count) = row.sources;
        let source = sources[first];
        let to = if count == 1 { source.slot } else { delivered };
        let Ok([from, to]) = loads.get_disjoint_mut([borne, to]) else { continue };
        let adds = count == 1 && !source.is_first;
        match (adds, borne == nothing) {
            (true, true) => eliminate::<S, true, true>(simd, from, link, work, to),
            (true, false) => eliminate::<S, true, false>(simd, from, link, work, to),
            (false, true) => eliminate::<S, false, true>(simd, from, link, work, to),
            (false, false) => eliminate::<S, false, false>(simd, from, link, work, to),
        }
        if count > 1 {
            scatter(simd, row, sources, masks, loads, delivered);
        }
    }
}

/// Adds the delivered inertia and wrench to the slots of the row's parents.
#[inline(always)]
fn scatter<S: Instructions>(
    simd: S,
    row: &Row,
    sources: &[Source],
    masks: &[S::Vector],
    loads: &mut [[S::Vector; load::FIELDS]],
    delivered: usize,
) {
    let (first, count) = row.sources;
    for (source, mask) in sources[first..first + count].iter().zip(&masks[first..first + count]) {
        let Ok([from, to]) = loads.get_disjoint_mut([delivered, source.slot]) else { continue };
        let brought = from.iter().zip(to);
        if source.is_first {
            for (from, to) in brought {
                *to = Lane::load(simd, *from).only(*mask).value;
            }
        } else {
            // The sign of a zero reaches no state: the sums of a state start from +0.
            for (from, to) in brought {
                *to = (Lane::load(simd, *to) + Lane::load(simd, *from).only(*mask)).value;
            }
        }
    }
}

/// Adds the ground's contact with the tip.
#[inline(always)]
fn prop_up<S: Instructions>(simd: S, load: &mut [S::Vector; load::FIELDS], prop: &[S::Vector; prop::FIELDS]) {
    for (to, from) in [
        (load::LINEAR, prop::ACROSS),
        (load::LINEAR + 3, prop::ACROSS),
        (load::LINEAR + 5, prop::NORMAL),
        (load::FORCE, prop::IMPULSE),
        (load::FORCE + 1, prop::IMPULSE + 1),
        (load::FORCE + 2, prop::IMPULSE + 2),
    ] {
        load[to] = (Lane::load(simd, load[to]) + Lane::load(simd, prop[from])).value;
    }
}

/// Rows of a matrix from its columns, times a vector: the transpose's product.
#[inline(always)]
fn by_columns<S: Instructions>(columns: &[Lane3<S>; 3], a: Lane3<S>) -> Lane3<S> {
    [dot(columns[0], a), dot(columns[1], a), dot(columns[2], a)]
}

/// A symmetric matrix times a vector.
#[inline(always)]
fn symmetric<S: Instructions>(m: &[Lane<S>; 6], a: Lane3<S>) -> Lane3<S> {
    [dot([m[0], m[1], m[2]], a), dot([m[1], m[3], m[4]], a), dot([m[2], m[4], m[5]], a)]
}

/// Component i of d x r, added to c.
#[inline(always)]
fn cross_at<S: Instructions>(i: usize, d: Lane3<S>, r: Lane3<S>, c: Lane<S>) -> Lane<S> {
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    d[j].mul_add(r[k], d[k].take_from(r[j], c))
}

/// Entry i, j of J' = J + [d] H^T - H' [d].
#[inline(always)]
fn moved<S: Instructions>(
    i: usize,
    j: usize,
    d: Lane3<S>,
    old: &[Lane3<S>; 3],
    new: &[Lane3<S>; 3],
    angular: Lane<S>,
) -> Lane<S> {
    let row = cross_at(j, d, [new[0][i], new[1][i], new[2][i]], angular);
    cross_at(i, d, [old[0][j], old[1][j], old[2][j]], row)
}

/// Place of an entry, j >= i, of a symmetric matrix.
const fn place(i: usize, j: usize) -> usize {
    i * (5 - i) / 2 + j
}

/// An entry of A - G G^T or of P - G L^-1 y.
#[inline(always)]
fn deliver<S: Instructions, const ADD: bool>(
    to: &mut S::Vector,
    value: Lane<S>,
    (g_1, h_1): (Lane<S>, Lane<S>),
    (g_2, h_2): (Lane<S>, Lane<S>),
) {
    let value = g_2.take_from(h_2, g_1.take_from(h_1, value));
    *to = if ADD { value.beside(*to) + value } else { value }.value;
}

/// Inertia at a link's tip with half its own mass there, moved to its origin, with the rest that the two halves leave:
/// M, H' = H + [d] M, J' = J + [d] H^T - H' [d].
struct Borne<S: Instructions> {
    m: [Lane<S>; 6],
    coupling: [Lane3<S>; 3],
    angular: [Lane<S>; 6],
}

impl<S: Instructions> Borne<S> {
    // (Spelt out: `array::map` is not inlined into code for other instructions.)
    #[inline(always)]
    fn new(
        simd: S,
        from: &[S::Vector; load::FIELDS],
        d: Lane3<S>,
        half_mass: Lane<S>,
        across: Lane<S>,
        along: Lane3<S>,
    ) -> Self {
        let borne = |field: usize| Lane::load(simd, from[field]);
        let m = [
            borne(load::LINEAR) + half_mass,
            borne(load::LINEAR + 1),
            borne(load::LINEAR + 2),
            borne(load::LINEAR + 3) + half_mass,
            borne(load::LINEAR + 4),
            borne(load::LINEAR + 5) + half_mass,
        ];
        let old = |column: usize| load3(simd, &from[load::COUPLING + 3 * column..]);
        let coupling = [
            cross_add(d, [m[0], m[1], m[2]], old(0)),
            cross_add(d, [m[1], m[3], m[4]], old(1)),
            cross_add(d, [m[2], m[4], m[5]], old(2)),
        ];
        let own = |i: usize, j: usize| along[i].mul_add(d[j], borne(load::ANGULAR + place(i, j)));
        let old = [old(0), old(1), old(2)];
        let angular = [
            moved(0, 0, d, &old, &coupling, own(0, 0) + across),
            moved(0, 1, d, &old, &coupling, own(0, 1)),
            moved(0, 2, d, &old, &coupling, own(0, 2)),
            moved(1, 1, d, &old, &coupling, own(1, 1) + across),
            moved(1, 2, d, &old, &coupling, own(1, 2)),
            moved(2, 2, d, &old, &coupling, own(2, 2) + across),
        ];
        Self { m, coupling, angular }
    }

    /// [`Self::new`] for a link without children and fruit: products with zeros are left out, which changes no bit.
    #[inline(always)]
    fn nothing(simd: S, d: Lane3<S>, half_mass: Lane<S>, across: Lane<S>, along: Lane3<S>) -> Self {
        let zero = Lane::splat(simd, 0.0);
        let dm = scale(half_mass, d);
        let own = |i: usize, j: usize| along[i] * d[j];
        Self {
            m: [half_mass, zero, zero, half_mass, zero, half_mass],
            coupling: [[zero, dm[2], -dm[1]], [-dm[2], zero, dm[0]], [dm[1], -dm[0], zero]],
            angular: [
                d[1].mul_add(dm[1], d[2].mul_add(dm[2], own(0, 0) + across)),
                d[0].take_from(dm[1], own(0, 1)),
                d[0].take_from(dm[2], own(0, 2)),
                d[2].mul_add(dm[2], d[0].mul_add(dm[0], own(1, 1) + across)),
                d[1].take_from(dm[2], own(1, 2)),
                d[0].mul_add(dm[0], d[1].mul_add(dm[1], own(2, 2) + across)),
            ],
        }
    }
}

/// [`by_columns`] of the coupling of a link without children and fruit, rounded likewise.
#[inline(always)]
fn alone_by_columns<S: Instructions>(dm: Lane3<S>, a: Lane3<S>) -> Lane3<S> {
    [
        dm[2].mul_add(a[1], -(dm[1] * a[2])),
        dm[2].take_from(a[0], dm[0] * a[2]),
        dm[1].mul_add(a[0], -(dm[0] * a[1])),
    ]
}

/// Eliminates a joint: writes the factor to `work`, and writes or adds the inertia and wrench on the parent to `to`.
///
/// `ALONE` if the link has neither children nor fruit; `from` is not read then. Entries of the matrix are used as soon as they are known, so
/// that few have to wait in memory.
#[inline(always)]
fn eliminate<S: Instructions, const ADD: bool, const ALONE: bool>(
    simd: S,
    from: &[S::Vector; load::FIELDS],
    link: &[S::Vector; link::FIELDS],
    work: &mut [S::Vector; work::FIELDS],
    to: &mut [S::Vector; load::FIELDS],
) {
    let number = |field: usize| Lane::load(simd, link[field]);
    let d = load3(simd, &work[work::D..]);
    let a_1 = load3(simd, &work[work::AXES..]);
    let a_2 = load3(simd, &work[work::AXES + 3..]);
    let half_mass = number(link::HALF_MASS);

    // With S the two axes, U = (J' S, H'^T S).
    let (across, along) = (number(link::ACROSS), scale(number(link::ALONG), d));
    let Borne { m, coupling, angular } = if ALONE {
        Borne::nothing(simd, d, half_mass, across, along)
    } else {
        Borne::new(simd, from, d, half_mass, across, along)
    };
    let (u_1f, u_2f) = if ALONE {
        let dm = scale(half_mass, d);
        (alone_by_columns(dm, a_1), alone_by_columns(dm, a_2))
    } else {
        (by_columns(&coupling, a_1), by_columns(&coupling, a_2))
    };
    let (u_1n, u_2n) = (symmetric(&angular, a_1), symmetric(&angular, a_2));
    // The other half mass is at the origin.
    let linear = [m[0] + half_mass, m[1], m[2], m[3] + half_mass, m[4], m[5] + half_mass];

    // Pivot S^T U = L L^T, L = [[1 / s_1, 0], [share / s_1, 1 / s_2]].
    let armature = number(link::ARMATURE);
    let d_11 = dot_add(a_1, u_1n, armature);
    let d_12 = dot(a_2, u_1n);
    let d_22 = dot_add(a_2, u_2n, armature);
    let one = Lane::splat(simd, 1.0);
    let i_11 = one / d_11;
    let share = d_12 * i_11;
    let s_1 = i_11.sqrt();
    let s_2 = (d_11 / d_12.take_from(d_12, d_11 * d_22)).sqrt();
    let (torque, force) =
        (load3(simd, &work[work::RESISTANCE..]), load3(simd, &work[work::RESISTANCE + 3..]));
    let (n, f) = if ALONE {
        ([-torque[0], -torque[1], -torque[2]], [-force[0], -force[1], -force[2]])
    } else {
        let borne = load3(simd, &from[load::FORCE..]);
        (cross_add(d, borne, sub(load3(simd, &from[load::TORQUE..]), torque)), sub(borne, force))
    };
    let h_stiffness = number(link::H_STIFFNESS);
    let h_damping = number(link::H_DAMPING);
    let spring_1 = h_stiffness.mul_add(number(link::Q), h_damping * number(link::V));
    let spring_2 = h_stiffness.mul_add(number(link::Q + 1), h_damping * number(link::V + 1));
    let (y_1, y_2) = (dot(a_1, n) - spring_1, dot(a_2, n) - spring_2);
    let (y_1, y_2) = (s_1 * y_1, s_2 * share.take_from(y_1, y_2));
    let (g_1n, g_1f) = (scale(s_1, u_1n), scale(s_1, u_1f));
    let g_2n = scale(s_2, axmy(share, u_1n, u_2n));
    let g_2f = scale(s_2, axmy(share, u_1f, u_2f));
    store3::<S>(&mut work[work::G..], g_1n);
    store3::<S>(&mut work[work::G + 3..], g_1f);
    store3::<S>(&mut work[work::G + 6..], g_2n);
    store3::<S>(&mut work[work::G + 9..], g_2f);
    work[work::Y] = y_1.value;
    work[work::Y + 1] = y_2.value;
    work[work::SCALE] = s_1.value;
    work[work::SCALE + 1] = s_2.value;
    work[work::SHARE] = share.value;

    // Inertia and wrench on the parent.
    for i in 0..3 {
        let (torque, force) = (load::TORQUE + i, load::FORCE + i);
        deliver::<S, ADD>(&mut to[torque], n[i], (g_1n[i], y_1), (g_2n[i], y_2));
        deliver::<S, ADD>(&mut to[force], f[i], (g_1f[i], y_1), (g_2f[i], y_2));
    }
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        deliver::<S, ADD>(&mut to[load::LINEAR + k], linear[k], (g_1f[i], g_1f[j]), (g_2f[i], g_2f[j]));
    }
    for j in 0..3 {
        for i in 0..3 {
            let to = &mut to[load::COUPLING + 3 * j + i];
            deliver::<S, ADD>(to, coupling[j][i], (g_1n[i], g_1f[j]), (g_2n[i], g_2f[j]));
        }
    }
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        deliver::<S, ADD>(&mut to[load::ANGULAR + k], angular[k], (g_1n[i], g_1n[j]), (g_2n[i], g_2n[j]));
    }
}

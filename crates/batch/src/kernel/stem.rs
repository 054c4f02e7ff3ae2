//! Fruit on stems that bend and twist (`docs/computation/batch.md`, Stems): a link without mass on a ball joint at the spur, with the fruit's
//! rotational inertia, and the fruit's mass at its end on a stiff tether. Both are eliminated as leaves of the link that bears them.
//!
//! Whatever a stem does is symmetric about its direction e: a part across it and one along it. So e is all that is needed of its axes. Its rotation and
//! rate are kept in the axes of the link that bears it, where a turn about the rate itself leaves the rate as it is.

use super::inertia::{ENTRIES, add_point_mass};
use super::instructions::Instructions;
use super::lane::{Lane, Lane3, add, atan2, axmy, axpy, cross, cross_add, dot, load3, scale, store3, sub};
use super::motion::Here;
use super::{Step, polynomial};
use crate::layout::{fruit, fruit_work, link, load, stem, stem_work, work};

/// Coefficients of cos and of sin(x)/x by the square of x: exact in f32 up to 1 rad, which is half of a turn by 2 rad in a substep.
const COSINE: [f32; 5] = [2.480_158_7e-5, -1.388_888_9e-3, 4.166_666_8e-2, -0.5, 1.0];
const SINE_OVER: [f32; 5] = [2.755_731_9e-6, -1.984_127e-4, 8.333_334e-3, -0.166_666_67, 1.0];
/// Coefficients of atan(x)/x by the square of x, up to that of the tangent of 22.5 degrees (Cephes).
const ATAN_OVER: [f32; 5] = [8.053_745e-2, -1.387_768_6e-1, 1.997_771_1e-1, -3.333_295e-1, 1.0];
const SQUARE_TAN_22: f32 = 0.171_572_88;
/// `1 + cos(bend)` below which the twist has no direction.
const DOUBLED_OVER: f32 = 1e-6;
/// Keeps a quotient of zeros from being no number.
const TINY: f32 = 1e-30;

/// A vector given in some axes.
#[inline(always)]
fn combine<S: Instructions>(axes: &[Lane3<S>; 3], v: Lane3<S>) -> Lane3<S> {
    axpy(v[0], axes[0], axpy(v[1], axes[1], scale(v[2], axes[2])))
}

/// `(across 1 + excess e e^T) v`.
#[inline(always)]
fn about<S: Instructions>(across: Lane<S>, excess: Lane<S>, e: Lane3<S>, v: Lane3<S>) -> Lane3<S> {
    axpy(excess * dot(e, v), e, scale(across, v))
}

/// Bend and twist of a rod, as `orchard_multibody::Deflection` has them.
struct Deflection<S: Instructions> {
    /// Direction of the rod, and torque of its spring over the substep [N m s], in the link's axes.
    direction: Lane3<S>,
    torque: Lane3<S>,
    twist: Lane<S>,
    /// Of the bend: cosine, and square of the sine.
    cosine: Lane<S>,
    square_sine: Lane<S>,
}

#[inline(always)]
fn deflection<S: Instructions>(simd: S, stem: &[S::Vector; stem::FIELDS]) -> Deflection<S> {
    let constant = |number: f32| Lane::splat(simd, number);
    let zero = constant(0.0);
    let rest = load3(simd, &stem[stem::REST..]);
    let (v, w) = (load3(simd, &stem[stem::Q..]), Lane::load(simd, stem[stem::Q + 3]));
    let turned = cross(v, rest);
    let turned = add(turned, turned);
    let direction = cross_add(v, turned, axpy(w, turned, rest));
    // Squares of cosine and sine of half the bend.
    let along = dot(v, rest);
    let cc = along.mul_add(along, w * w);
    let ss = constant(0.25) * dot(turned, turned);
    let per_cc = constant(1.0) / (cc + constant(TINY));
    // The bend over its sine: half the bend over the product of its sine and cosine.
    let tangent = ss * per_cc;
    let mut per_sine = per_cc * polynomial(simd, &ATAN_OVER, tangent);
    let is_above = tangent - constant(SQUARE_TAN_22);
    if is_above.any_above(zero) {
        let (s, c) = (ss.sqrt(), cc.sqrt());
        per_sine = is_above.if_above(zero, atan2(s, c) / s.mul_add(c, constant(TINY)), per_sine);
    }
    let twist = atan2(along, w);
    let twist = twist + twist;
    let half = Lane::load(simd, stem[stem::H_TWISTING]) * twist * per_cc * constant(0.5);
    let half = (cc + cc).if_above(constant(DOUBLED_OVER), half, zero);
    let bending = Lane::load(simd, stem[stem::H_BENDING]) * per_sine;
    let torque = axpy(bending, cross(rest, direction), scale(half, add(rest, direction)));
    let square_sine = constant(4.0) * ss * cc;
    Deflection { direction, torque, twist, cosine: cc - ss, square_sine }
}

/// Kinematics and right-hand side of one fruit on its stem; its impulse goes to the link. Returns by how much its load is over that from which wear counts.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the rows of one fruit in the tile's arrays")]
pub(super) fn outward<S: Instructions>(
    simd: S,
    fruit: &[S::Vector; fruit::FIELDS],
    stem: &[S::Vector; stem::FIELDS],
    left: &mut [S::Vector; fruit_work::FIELDS],
    kept: &mut [S::Vector; stem_work::FIELDS],
    work: &mut [S::Vector; work::FIELDS],
    here: &Here<S>,
    step: Step,
) -> Lane<S> {
    let number = |field: usize| Lane::load(simd, fruit[field]);
    let of_stem = |field: usize| Lane::load(simd, stem[field]);
    let (h, zero, one) = (Lane::splat(simd, step.h), Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));

    // Direction and motion of the stem, and both its ends.
    let rod = deflection(simd, stem);
    let e = combine(&here.axes, rod.direction);
    let rate = combine(&here.axes, load3(simd, &stem[stem::V..]));
    let spring = combine(&here.axes, rod.torque);
    let w = add(here.w, rate);
    let b_w = cross_add(here.w, rate, here.b_w);
    let r = combine(&here.axes, load3(simd, &fruit[fruit::ANCHOR..]));
    let arm = scale(of_stem(stem::LENGTH), e);
    let u = load3(simd, &fruit[fruit::V..]);
    let stretch = sub(load3(simd, &fruit[fruit::P..]), add(here.p, add(r, arm)));
    let u_relative = sub(u, cross_add(w, arm, cross_add(here.w, r, here.v)));

    // The point at its end, as on a tether.
    let kappa = number(fruit::KAPPA);
    let pull = axpy(number(fruit::H_STIFFNESS), stretch, scale(kappa, u_relative));
    let mut impulse = axpy(h, load3(simd, &fruit[fruit::FORCE..]), [-pull[0], -pull[1], -pull[2]]);
    impulse[2] = impulse[2] - number(fruit::H_WEIGHT);
    let mut inverse_mass = of_stem(stem::INVERSE_MASS);
    // Only fruit off their stems have air drag.
    if step.has_loose {
        let air_drag = number(fruit::AIR_DRAG);
        let drag = h * (air_drag * dot(u, u).sqrt());
        impulse = axmy(drag, u, impulse);
        let slowed = one / (drag + (number(fruit::MASS) + kappa));
        inverse_mass = air_drag.if_above(zero, slowed, inverse_mass);
        left[fruit_work::INVERSE_MASS] = inverse_mass.value;
    }
    let reaction = axpy(kappa * inverse_mass, impulse, pull);

    // Impulse on the stem about its joint, and the change of its rate.
    let Inertia { own, lever_length, swing } = Inertia::new(simd, stem);
    let n = axmy(h * own, b_w, cross(arm, reaction));
    let damped = about(of_stem(stem::ARMATURE), of_stem(stem::ARMATURE_EXCESS), e, rate);
    let y = sub(sub(n, spring), damped);
    let y = about(of_stem(stem::INVERSE), of_stem(stem::INVERSE_EXCESS), e, y);

    // What the link bears at the anchor: impulse here, inertia in the inward pass.
    let torque = sub(n, about(swing, -lever_length, e, y));
    let force = axmy(of_stem(stem::LEVER), cross(y, e), reaction);
    let (resists_n, resists_f) =
        (load3(simd, &work[work::RESISTANCE..]), load3(simd, &work[work::RESISTANCE + 3..]));
    store3::<S>(&mut work[work::RESISTANCE..], sub(cross_add(force, r, resists_n), torque));
    store3::<S>(&mut work[work::RESISTANCE + 3..], sub(resists_f, force));
    store3::<S>(&mut kept[stem_work::DIRECTION..], e);
    store3::<S>(&mut kept[stem_work::Y..], y);
    store3::<S>(&mut left[fruit_work::R_TIP..], sub(r, here.d));
    store3::<S>(&mut left[fruit_work::IMPULSE..], impulse);

    // A stem that is pushed has no tension.
    let taut = dot(stretch, e);
    let taut = taut.if_above(zero, taut, zero);
    let (stretched, twisted) = (of_stem(stem::ALERT_STRETCH) * taut, of_stem(stem::ALERT_TWIST) * rod.twist);
    let over = stretched.mul_add(stretched, twisted * twisted) - one;
    if over.any_above(zero) {
        bear(simd, stem, kept, &rod, taut)
    } else {
        over.store(&mut kept[stem_work::OVER])
    }
}

/// Load on the zone at the spur and on the spur; past a right angle all of the tension is across. Returns by how much it is over that from which wear counts.
#[inline(always)]
fn bear<S: Instructions>(
    simd: S,
    stem: &[S::Vector; stem::FIELDS],
    kept: &mut [S::Vector; stem_work::FIELDS],
    rod: &Deflection<S>,
    taut: Lane<S>,
) -> Lane<S> {
    let of_stem = |field: usize| Lane::load(simd, stem[field]);
    let (zero, one) = (Lane::splat(simd, 0.0), Lane::splat(simd, 1.0));
    let tension = of_stem(stem::STIFFNESS) * taut;
    let along = rod.cosine.if_above(zero, tension * rod.cosine, zero);
    let across = rod.cosine.if_above(zero, rod.square_sine, one);
    let torque = of_stem(stem::TWISTING) * rod.twist.abs();
    let (pulled, bent) = (along * of_stem(stem::PER_PULL), tension * of_stem(stem::PER_BEND));
    let (twisted, torn) = (torque * of_stem(stem::PER_TWIST), tension * of_stem(stem::PER_SPUR));
    let zone = pulled.mul_add(pulled, twisted.mul_add(twisted, across * (bent * bent)));
    let spur = torn * torn;
    let over = zone.if_above(spur, zone, spur) - of_stem(stem::LEAST_LOAD);
    let loads = [tension, along, tension * across.sqrt(), torque];
    for (k, load) in loads.into_iter().enumerate() {
        kept[stem_work::LOAD + k] = load.value;
    }
    kept[stem_work::OVER] = over.value;
    over
}

/// Rotational inertias about the joint of a stem that follow from others.
struct Inertia<S: Instructions> {
    /// J.
    own: Lane<S>,
    /// mu L^2, and P.
    lever_length: Lane<S>,
    swing: Lane<S>,
}

impl<S: Instructions> Inertia<S> {
    #[inline(always)]
    fn new(simd: S, stem: &[S::Vector; stem::FIELDS]) -> Self {
        let [own, lever, length] =
            [stem::INERTIA, stem::LEVER, stem::LENGTH].map(|field| Lane::load(simd, stem[field]));
        let lever_length = lever * length;
        Self { own, lever_length, swing: own + lever_length }
    }
}

/// Adds a stem's inertia, with the anchor at `r` from the tip of the link.
#[inline(always)]
pub(super) fn inward<S: Instructions>(
    simd: S,
    load: &mut [S::Vector; load::FIELDS],
    r: Lane3<S>,
    stem: &[S::Vector; stem::FIELDS],
    kept: &[S::Vector; stem_work::FIELDS],
) {
    let number = |field: usize| Lane::load(simd, stem[field]);
    let e = load3(simd, &kept[stem_work::DIRECTION..]);
    add_point_mass(simd, load, number(stem::MASS), axpy(number(stem::REACH), e, r));
    // A mass that only resists along e, and inertia without mass.
    let moment = cross(r, e);
    let (along, across) = (scale(number(stem::MASS_ALONG), e), number(stem::ACROSS));
    let (twist, turned) = (scale(number(stem::EXCESS), e), scale(number(stem::MASS_ALONG), moment));
    for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
        let angular = Lane::load(simd, load[load::ANGULAR + k]);
        let angular = turned[i].mul_add(moment[j], twist[i].mul_add(e[j], angular));
        load[load::ANGULAR + k] = if i == j { angular + across } else { angular }.value;
        let linear = &mut load[load::LINEAR + k];
        *linear = along[i].mul_add(e[j], Lane::load(simd, *linear)).value;
    }
    for j in 0..3 {
        for i in 0..3 {
            let to = &mut load[load::COUPLING + 3 * j + i];
            *to = moment[i].mul_add(along[j], Lane::load(simd, *to)).value;
        }
    }
}

/// Motion of a link in a substep, as its stems need it.
pub(super) struct Before<S: Instructions> {
    /// Axes before it.
    axes: [Lane3<S>; 3],
    /// Changes of its velocity, at the tip.
    turn: Lane3<S>,
    shift: Lane3<S>,
}

impl<S: Instructions> Before<S> {
    /// Of a link whose new kinematics are not yet in `work`.
    #[inline(always)]
    pub fn of(simd: S, link: &[S::Vector; link::FIELDS], work: &[S::Vector; work::FIELDS]) -> Self {
        let length = Lane::load(simd, link[link::LENGTH]) + Lane::splat(simd, TINY);
        let z = scale(Lane::splat(simd, 1.0) / length, load3(simd, &work[work::D..]));
        let y = load3(simd, &work[work::AXES + 3..]);
        let [turn, shift] = [0, 3].map(|at| load3(simd, &work[work::CHANGE + at..]));
        Self { axes: [cross(y, z), y, z], turn, shift }
    }
}

/// The new state of a stem and its fruit.
#[inline(always)]
pub(super) fn advance<S: Instructions>(
    simd: S,
    fruit: &mut [S::Vector; fruit::FIELDS],
    stem: &mut [S::Vector; stem::FIELDS],
    left: &[S::Vector; fruit_work::FIELDS],
    kept: &[S::Vector; stem_work::FIELDS],
    before: &Before<S>,
    step: Step,
) {
    let Before { axes, turn, shift } = *before;
    let number = |field: usize| Lane::load(simd, stem[field]);
    let shift = cross_add(turn, load3(simd, &left[fruit_work::R_TIP..]), shift);
    let e = load3(simd, &kept[stem_work::DIRECTION..]);
    // Shares of the link's turn and of the anchor's motion across the stem that are taken off the stem's rate.
    let Inertia { own, swing, .. } = Inertia::new(simd, stem);
    let inverse = number(stem::INVERSE);
    let share = swing * inverse;
    let excess = own.mul_add(inverse + number(stem::INVERSE_EXCESS), -share);
    let taken = about(share, excess, e, turn);
    let taken = axpy(number(stem::LEVER) * inverse, cross(e, shift), taken);
    let change = sub(load3(simd, &kept[stem_work::Y..]), taken);

    // The end of the stem takes the fruit along.
    let end = cross_add(add(turn, change), scale(number(stem::LENGTH), e), shift);
    let kappa = Lane::load(simd, fruit[fruit::KAPPA]);
    let impulse = axpy(kappa, end, load3(simd, &left[fruit_work::IMPULSE..]));
    let mut inverse_mass = number(stem::INVERSE_MASS);
    if step.has_loose {
        inverse_mass = Lane::load(simd, left[fruit_work::INVERSE_MASS]);
    }
    let u = axpy(inverse_mass, impulse, load3(simd, &fruit[fruit::V..]));
    let p = axpy(Lane::splat(simd, step.h), u, load3(simd, &fruit[fruit::P..]));
    store3::<S>(&mut fruit[fruit::V..], u);
    store3::<S>(&mut fruit[fruit::P..], p);

    // The rate in the link's axes, and the turn by it. One step of Newton's for the inverse root keeps the length 1.
    let changed = [dot(axes[0], change), dot(axes[1], change), dot(axes[2], change)];
    let mut v = add(load3(simd, &stem[stem::V..]), changed);
    let (half, one) = (Lane::splat(simd, 0.5 * step.h), Lane::splat(simd, 1.0));
    let mut half_turn = scale(half, v);
    let mut square = dot(half_turn, half_turn);
    // Only a stem without its fruit, on a limb that falls, turns by more than 2 rad in a substep; the series hold no further.
    if square.any_above(one) {
        let share = square.if_above(one, one / square.sqrt(), one);
        (v, half_turn) = (scale(share, v), scale(share, half_turn));
        square = dot(half_turn, half_turn);
    }
    let (sine, cosine) = (polynomial(simd, &SINE_OVER, square), polynomial(simd, &COSINE, square));
    let by = scale(sine, half_turn);
    let (q, w) = (load3(simd, &stem[stem::Q..]), number(stem::Q + 3));
    let vector = cross_add(by, q, axpy(cosine, q, scale(w, by)));
    let scalar = cosine * w - dot(by, q);
    let size = scalar.mul_add(scalar, dot(vector, vector));
    let factor = Lane::splat(simd, 0.5).take_from(size, Lane::splat(simd, 1.5));
    store3::<S>(&mut stem[stem::V..], v);
    store3::<S>(&mut stem[stem::Q..], scale(factor, vector));
    stem[stem::Q + 3] = (factor * scalar).value;
}

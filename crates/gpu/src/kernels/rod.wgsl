// Fruit on stems that bend (`docs/computation/batch.md`, Stems): rods without mass on ball joints, each with its fruit's rotational inertia J, and the fruit's mass at its end on a
// stiff tether. Both are eliminated as leaves of the link. Whatever a rod does is symmetric about its direction e: a part across it and one along it.

// Coefficients of cos and of sin(x)/x by the square of x: exact up to 1 rad, half of a turn by 2 rad in a substep.
const ROD_COSINE: array<f32, 5> = array(2.4801587e-5, -1.3888889e-3, 4.1666668e-2, -0.5, 1.0);
const ROD_SINE_OVER: array<f32, 5> = array(2.7557319e-6, -1.984127e-4, 8.333334e-3, -0.16666667, 1.0);
// Largest turn of a rod in a substep [rad], beyond which it is slowed down: a bare stem on a whipping twig would turn ever faster, since velocity products are explicit (decision 10).
const LARGEST_TURN: f32 = 2.0;
// 1 + cos(bend) below which the twist has no direction.
const DOUBLED_OVER: f32 = 1e-6;
// Exponent beyond which a share of a life is nothing, or all.
const LARGEST_EXPONENT: f32 = 80.0;

// A rod, besides the numbers that it has in the places of a tether's.
struct Rod {
    q: vec4f,
    rate: vec3f,
    rest: vec3f,
    // Shares of the lives of zone and spur that have passed.
    wear: vec2f,
    y: vec3f,
    per_twist: f32,
    per_spur: f32,
}

fn read_rod(at: u32) -> Rod {
    let y = fruit(at, ROD_Y);
    let rate = fruit(at, ROD_RATE);
    let rest = fruit(at, ROD_REST);
    return Rod(fruit(at, ROD_Q), rate.xyz, rest.xyz, vec2f(rate.w, rest.w), y.xyz, y.w, fruit(at, FRUIT_IMPULSE).w);
}

// The pivot of a fruit's rod. The dampings stand in the places of the tether's bias and cap.
fn rod_pivot(stem: Stem) -> RodPivot {
    let length = -stem.drop;
    var stiffness = vec2f(rules.stem_bending, rules.stem_twisting);
    if SETTLES {
        // Gravity is stiffer than the spring: with it a step from rest is Newton's.
        stiffness.x += stem.mass * rules.gravity * length;
    }
    return pivot_of_rod(length, vec2f(stem.mass, stem.radius), vec2f(stem.stiffness, stem.damping), stiffness, vec2f(stem.bias, stem.cap));
}

// A vector of a link's axes in the world, and the reverse.
fn in_world(axes: Axes, v: vec3f) -> vec3f {
    return axes.x * v.x + axes.y * v.y + axes.z * v.z;
}

fn in_axes(axes: Axes, v: vec3f) -> vec3f {
    return vec3f(dot(axes.x, v), dot(axes.y, v), dot(axes.z, v));
}

fn direction_of(q: vec4f, rest: vec3f) -> vec3f {
    let turned = cross(q.xyz, rest) * 2.0;
    return rest + turned * q.w + cross(q.xyz, turned);
}

// How far a rod is bent and twisted, as `orchard_multibody::Deflection`.
struct Deflection {
    // Torque against its spring, in the link's axes [N m].
    torque: vec3f,
    twist: f32,
    // Of the bend: cosine, and square of the sine.
    cosine: f32,
    square_sine: f32,
}

fn deflection(rod: Rod, direction: vec3f) -> Deflection {
    // Squares of cosine and sine of half the bend.
    let turn = dot(rod.q.xyz, rod.rest);
    let across = cross(rod.q.xyz, rod.rest);
    let cc = turn * turn + rod.q.w * rod.q.w;
    let ss = dot(across, across);
    let per_cc = 1.0 / (cc + TINY);
    // The bend over its sine: half the bend over the product of its sine and cosine.
    let tangent = ss * per_cc;
    var per_sine = per_cc * (1.0 + tangent * angle_rest(tangent));
    if tangent > TAN_22 * TAN_22 {
        let s = sqrt(ss);
        let c = sqrt(cc);
        per_sine = angle_of(s, c) / (s * c + TINY);
    }
    let half_twist = angle_of(abs(turn), rod.q.w);
    let twist = 2.0 * select(half_twist, -half_twist, turn < 0.0);
    let half = select(0.0, rules.stem_twisting * twist * per_cc * 0.5, cc + cc > DOUBLED_OVER);
    let torque = cross(rod.rest, direction) * (rules.stem_bending * per_sine) + (rod.rest + direction) * half;
    return Deflection(torque, twist, cc - ss, 4.0 * ss * cc);
}

// What a link bears of a fruit on a rod: a point mass at an arm from the link's joint, mass there that resists along the rod alone, rotational inertia without mass, and impulses about the joint.
struct Borne {
    arm: vec3f,
    mass: f32,
    direction: vec3f,
    mass_along: f32,
    across: f32,
    excess: f32,
    torque: vec3f,
    force: vec3f,
}

fn read_borne(at: u32) -> Borne {
    let arm = fruit(at, ROD_ARM);
    let force = fruit(at, ROD_FORCE_IMPULSE);
    let direction = fruit(at, ROD_DIRECTION);
    let torque = fruit(at, ROD_TORQUE_IMPULSE);
    return Borne(arm.xyz, arm.w, direction.xyz, force.w, torque.w, direction.w, torque.xyz, force.xyz);
}

// Adds it to the load of a link's tip, at `d` from the joint.
fn plus_borne(to: Load, borne: Borne, d: vec3f) -> Load {
    let arm = borne.arm - d;
    let e = borne.direction;
    let moment = cross(arm, e);
    let turned = moment * borne.mass_along;
    let held = e * borne.mass_along;
    let twist = e * borne.excess;
    var sum = plus_point_mass(to, borne.mass, arm);
    sum.angular[0] += moment * turned.x + e * twist.x + vec3f(borne.across, 0.0, 0.0);
    sum.angular[1] += vec3f(moment.y, moment.z, moment.z) * vec3f(turned.y, turned.y, turned.z)
        + vec3f(e.y, e.z, e.z) * vec3f(twist.y, twist.y, twist.z) + vec3f(borne.across, 0.0, borne.across);
    sum.coupling[0] += turned * e.x;
    sum.coupling[1] += turned * e.y;
    sum.coupling[2] += turned * e.z;
    sum.linear[0] += held * e.x;
    sum.linear[1] += vec3f(e.y, e.z, e.z) * vec3f(held.y, held.y, held.z);
    return sum;
}

// Computes what the next substep starts from, with the link's motion and position at its joint; wears the stem, and in a test of limits says whether it gave way.
fn rod_start(at: u32, stem: Stem, rod: Rod, own: Motion, p: vec3f, mode: u32) {
    let h = rules.h;
    let pivot = rod_pivot(stem);
    let direction = direction_of(rod.q, rod.rest);
    let bent = deflection(rod, direction);

    // Direction and motion of the rod, and both its ends.
    let e = in_world(own.axes, direction);
    let rate = in_world(own.axes, rod.rate);
    let w = own.w + rate;
    let b_w = own.b_w + cross(own.w, rate);
    let r = in_world(own.axes, stem.anchor);
    let arm = e * pivot.length;
    let stretch = stem.p - (p + r + arm);
    let u_relative = stem.v - (own.v + cross(own.w, r) + cross(w, arm));

    // The point at its end, as on a tether.
    let pull = stretch * (h * stem.stiffness) + u_relative * pivot.kappa;
    let hangs = stem.stiffness > 0.0;
    let drag = select(stem.air_drag * length(stem.v), 0.0, hangs);
    let inverse_mass = 1.0 / (stem.mass + h * drag + pivot.kappa);
    var impulse = (stem.force - stem.v * drag) * h - pull;
    impulse.z -= h * stem.mass * rules.gravity;
    let reaction = pull + impulse * (pivot.kappa * inverse_mass);

    // Impulse on the rod about its joint, and the change of its rate.
    let n = cross(arm, reaction) - b_w * (h * pivot.inertia);
    let driven = n - in_world(own.axes, bent.torque) * h - about(pivot.armature, e, rate);
    let y = about(pivot.inverse, e, driven);

    // What the link bears.
    let turning = n - about(vec2f(pivot.swing, pivot.inertia), e, y);
    let force = reaction - cross(y, e) * pivot.lever;
    let per = 1.0 / (pivot.inertia + pivot.armature.x);
    let across = pivot.inertia * pivot.armature.x * per;
    let excess = pivot.inertia * pivot.armature.y * pivot.inverse.y - across;
    let mass = pivot.added * (pivot.inertia + pivot.armature.x) * pivot.inverse.x;
    let mass_along = pivot.lever * pivot.lever * pivot.inverse.x;
    let reach = pivot.length * pivot.armature.x * per;

    let stretched = dot(stretch, e);
    let released = worn(at, stem, rod, bent, stretched, mode);
    var place = select(stem.arm, r + e * reach, hangs);
    if mode == TEST {
        if TOUCHES {
            found_tension = max(found_tension, stem.stiffness * stretched);
            note_fast_turn(mode, w);
        }
        if !(is_finite(dot(stem.p, stem.p)) && is_finite(dot(stem.v, stem.v)) && is_finite(dot(rod.q, rod.q)) && is_finite(dot(rod.rate, rod.rate))) {
            found_notice |= NOTICE_NON_FINITE;
        }
        if hangs && released != 0u {
            found_notice |= NOTICE_DETACHES;
            // It flies on with the spin of its stem.
            place = w;
        }
    }
    set_fruit(at, FRUIT_V, vec4f(stem.v, inverse_mass));
    set_fruit(at, ROD_ARM, vec4f(place, mass));
    set_fruit(at, ROD_FORCE_IMPULSE, vec4f(force, mass_along));
    set_fruit(at, FRUIT_IMPULSE, vec4f(impulse, rod.per_spur));
    set_fruit(at, ROD_DIRECTION, vec4f(e, excess));
    set_fruit(at, ROD_TORQUE_IMPULSE, vec4f(turning + cross(r, force), across));
    set_fruit(at, ROD_Y, vec4f(y, rod.per_twist));
}

// Wears zone and spur under the loads of a substep (`orchard_fruit::StemLife`), given the stretch along the stem; returns how the stem gave way.
fn worn(at: u32, stem: Stem, rod: Rod, bent: Deflection, stretch: f32, mode: u32) -> u32 {
    if SETTLES || mode == LOOK {
        return stem.frames_over;
    }
    // A stem that is pushed has no tension; past a right angle all of it is across.
    let tension = max(stem.stiffness * stretch, 0.0);
    let pulled = tension / stem.threshold;
    let sheared = pulled / rules.stem_bent;
    let twisted = rules.stem_twisting * bent.twist * rod.per_twist;
    let torn = tension * rod.per_spur;
    let is_along = bent.cosine > 0.0;
    let shares = vec3f(
        select(0.0, pulled * pulled * bent.cosine * bent.cosine, is_along),
        sheared * sheared * select(1.0, bent.square_sine, is_along),
        twisted * twisted,
    );
    let loads = vec2f(shares.x + shares.y + shares.z, torn * torn);
    if stem.stiffness == 0.0 || max(loads.x, loads.y) <= rules.stem_least_load {
        return stem.frames_over;
    }
    if TOUCHES {
        found_notice |= NOTICE_STRAINED;
    }
    let wear = rod.wear + vec2f(share_of_life(loads.x), share_of_life(loads.y));
    set_fruit(at, ROD_RATE, vec4f(rod.rate, wear.x));
    set_fruit(at, ROD_REST, vec4f(rod.rest, wear.y));
    if stem.frames_over != 0u || max(wear.x, wear.y) < 1.0 {
        return stem.frames_over;
    }
    // The mode with the largest share of the zone's load, or the spur.
    var released = select(1u, 2u, shares.y > shares.x);
    released = select(released, 3u, shares.z > max(shares.x, shares.y));
    released = select(released, 4u, wear.y > wear.x);
    set_fruit(at, FRUIT_FORCE, vec4f(stem.force, bitcast<f32>(released)));
    return released;
}

// Share of a life that passes in a substep under the square of a load over its strength.
fn share_of_life(square: f32) -> f32 {
    let exponent = 0.5 * rules.stem_exponent * ln(max(square, TINY));
    return rules.stem_wear * e_to(clamp(exponent, -LARGEST_EXPONENT, LARGEST_EXPONENT));
}

// A fruit with its rod.
struct OnRod {
    stem: Stem,
    rod: Rod,
}

// Both at the end of a substep; `axes` are those of the link at its start, `turn` and `shift` the changes of velocity at the link's joint.
fn rod_end(at: u32, from_stem: Stem, from_rod: Rod, axes: Axes, turn: vec3f, shift: vec3f) -> OnRod {
    var stem = from_stem;
    var rod = from_rod;
    let pivot = rod_pivot(stem);
    let e = in_world(axes, direction_of(rod.q, rod.rest));
    let at_anchor = shift + cross(turn, in_world(axes, stem.anchor));
    var impulse = stem.impulse;
    let taken = about(vec2f(pivot.swing, pivot.inertia) * pivot.inverse, e, turn)
        + cross(e, at_anchor) * (pivot.lever * pivot.inverse.x);
    let change = rod.y - taken;

    // The end of the rod takes the fruit along.
    if stem.stiffness > 0.0 {
        impulse += (at_anchor + cross(turn + change, e * pivot.length)) * pivot.kappa;
    } else {
        let met = ground_impulse(stem);
        impulse += met.impulse;
        // `rod_start` writes it.
        stem.arm = met.spin;
    }
    stem = moved(at, stem, impulse);

    // The rate, and the turn by it. One step of Newton's for the inverse root keeps the length 1.
    rod.rate += in_axes(axes, change);
    let fastest = select(LARGEST_TURN, LARGEST_MOVE, SETTLES);
    rod.rate *= min(1.0, fastest / (length(rod.rate) * rules.h + TINY));
    let half = rod.rate * (0.5 * rules.h);
    if SETTLES {
        rod.rate = vec3f(0.0);
    }
    let square = dot(half, half);
    let by = half * rod_polynomial(ROD_SINE_OVER, square);
    let cosine = rod_polynomial(ROD_COSINE, square);
    let vector = rod.q.xyz * cosine + by * rod.q.w + cross(by, rod.q.xyz);
    let q = vec4f(vector, cosine * rod.q.w - dot(by, rod.q.xyz));
    rod.q = q * (1.5 - 0.5 * dot(q, q));
    set_fruit(at, ROD_Q, rod.q);
    set_fruit(at, ROD_RATE, vec4f(rod.rate, rod.wear.x));
    return OnRod(stem, rod);
}

fn rod_polynomial(c: array<f32, 5>, x: f32) -> f32 {
    return (((c[0] * x + c[1]) * x + c[2]) * x + c[3]) * x + c[4];
}

// Outward pass, from the root to the tips: velocity changes, the new state, and the motion that the next inward pass starts from.

// Modes of an outward pass: compute the motion of the present state; advance a substep; advance the last substep of a frame and test the limits.
const LOOK: u32 = 0u;
const ADVANCE: u32 = 1u;
const TEST: u32 = 2u;
// Largest change of an angle in a settling step [rad], as in `orchard_multibody::equilibrium`.
const LARGEST_MOVE: f32 = 0.3;

// A link's tip.
struct Tip {
    // Axes at the start of the substep.
    old: Axes,
    // Changes of angular and linear velocity in the substep.
    turn: vec3f,
    shift: vec3f,
    motion: Motion,
    p: vec3f,
}

// Bits of a notice, and largest square of an angle over its limit's, that the tests of this thread's parts found in this frame.
var<private> found_notice: u32;
var<private> found_peak: f32;
// In worlds with a robot also the largest excess and the largest tension (`layout::world`).
var<private> found_excess: f32;
var<private> found_tension: f32;

// Share of a limit from which on it counts as strained, our own choice: the host, which counts frames over the limit in f64, must not find more than that.
const NEARLY: f32 = 0.999;

// Result of the elimination of a joint, as the inward pass has stored it (`layout::work`).
struct Eliminated {
    g_1n: vec3f,
    g_1f: vec3f,
    g_2n: vec3f,
    g_2f: vec3f,
    e: vec2f,
    held: vec2f,
}

fn read_eliminated(at: u32) -> Eliminated {
    return eliminated_of(quad(at, WORK_G_1N), quad(at, WORK_G_1F), quad(at, WORK_G_2N), quad(at, WORK_G_2F));
}

fn eliminated_of(a: vec4f, b: vec4f, c: vec4f, d: vec4f) -> Eliminated {
    return Eliminated(a.xyz, b.xyz, c.xyz, d.xyz, vec2f(a.w, b.w), vec2f(c.w, d.w));
}

// What the outward pass reads of a row ahead of its turn.
struct Ahead {
    hinge: Hinge,
    eliminated: Eliminated,
    operation: vec4u,
    bits: u32,
    // Square of the angle that breaks the joint, and its bending over that at the start (`link.START`).
    limit: vec2f,
    // Where the air acts anew: the sail of the link and the air there, and the sail of the row after it, which tells the place of its air.
    sail: vec4f,
    air: vec4f,
    later_sail: vec4f,
}

// That of the first row, waited for.
fn first_ahead(start: u32, end: u32, mode: u32, presses: bool, winds: u32) -> Ahead {
    let own = link_at(start);
    let left = work_at(start);
    var ahead: Ahead;
    ahead.hinge = hinge_of(awaited(link(own, LINK_DIRECTION)), awaited(link(own, LINK_Q)));
    if mode == TEST {
        ahead.limit = awaited(link(own, LINK_LIMIT)).xw;
    }
    ahead.eliminated = eliminated_of(
        awaited(quad(left, WORK_G_1N)),
        awaited(quad(left, WORK_G_1F)),
        awaited(quad(left, WORK_G_2N)),
        awaited(quad(left, WORK_G_2F)),
    );
    ahead.operation = awaited_words(operations[operation_at(start)]);
    ahead.bits = awaited_words(vec4u(states[operation_at(start)])).x;
    if presses {
        let airs = airs_at();
        ahead.sail = awaited_bits(link(air_at(airs, start), AIR_WOOD));
        ahead.air = awaited(air_of(winds, ahead.sail));
        ahead.later_sail = awaited_bits(link(air_at(airs, min(start + 1u, end - 1u)), AIR_WOOD));
    }
    return ahead;
}

// All reads for the row after this one, issued at once.
fn read_ahead(row: u32, end: u32, mode: u32, presses: bool, winds: u32, last: Ahead) -> Ahead {
    let next = min(row + 1u, end - 1u);
    var ahead = last;
    ahead.hinge = read_hinge(link_at(next));
    if mode == TEST {
        ahead.limit = link(link_at(next), LINK_LIMIT).xw;
    }
    ahead.eliminated = read_eliminated(work_at(next));
    ahead.operation = operations[operation_at(next)];
    ahead.bits = states[operation_at(next)];
    if presses {
        ahead.sail = last.later_sail;
        ahead.air = air_of(winds, last.later_sail);
        ahead.later_sail = link(air_at(airs_at(), min(row + 2u, end - 1u)), AIR_WOOD);
    }
    return ahead;
}

// One part of the outward pass: rows from the first to the last.
fn outward(part: u32, mode: u32) {
    let start = header(TILE_STARTS + part);
    let end = start + header(TILE_LENGTHS + part);
    if end == start {
        return;
    }
    var tip: Tip;
    // The air acts anew at the end of a frame, that of the frame before where its motion is stale: here, or on links in workgroups of its own.
    let blows = select(false, mode != ADVANCE, BLOWS);
    let presses = blows && !PRESS_ASIDE;
    let winds = winds_at(own_frame() - select(0u, 1u, mode == LOOK));
    // The next link is read ahead.
    var next = first_ahead(start, end, mode, presses, winds);
    for (var row = start; row < end; row++) {
        let sail = sail_of(next.sail, next.air);
        var own = next.hinge;
        let eliminated = next.eliminated;
        let operation = next.operation;
        let bits = next.bits;
        let limit = next.limit;
        if (operation.x & FIRST_ROOT) != 0u {
            tip = ground_tip();
        } else if (operation.x & (FIRST_FROM_SLOT | FIRST_FROM_CROSS)) != 0u {
            tip = fork(parent_fork_at(operation.x));
        }
        // Change of velocity at the joint.
        let shift = tip.shift;
        if mode != LOOK && (operation.x & FIRST_ACTIVE) != 0u {
            let advanced = advance(own, eliminated, tip);
            tip = advanced.tip;
            own.q = advanced.q;
            own.v = advanced.v;
            set_link(link_at(row), LINK_Q, vec4f(own.q, own.v));
        }
        let first_fruit = (operation.z >> THIRD_FIRST_FRUIT) & 0xfffu;
        let last_fruit = first_fruit + ((operation.z >> THIRD_FRUIT) & 0x3fu);
        // After the last wait of this row.
        next = read_ahead(row, end, mode, presses, winds, next);
        if (operation.x & FIRST_ACTIVE) == 0u {
            continue;
        }
        let p_joint = tip.p;
        let at_joint = kinematics(own, tip.motion);
        let d = at_joint.axes.z * own.length;
        let v_d = cross(at_joint.w, d);
        tip.motion = at_joint;
        tip.motion.v += v_d;
        tip.motion.b_v += cross(at_joint.b_w, d) + cross(at_joint.w, v_d);
        tip.p += d;
        let is_debris = (bits & STATE_DEBRIS) != 0u;
        if TOUCHES {
            keep_place(row, p_joint, is_debris);
            note_fast_turn(mode, at_joint.w);
        }
        for (var k = first_fruit; k < last_fruit; k++) {
            let at = fruit_at(k);
            var stem = read_stem(at);
            var pull = vec4f(0.0);
            var air = vec3f(0.0);
            if blows && PRESS_ASIDE {
                pull = fruit(at, pull_field());
                air = fruit(at, pull_field() + PULL_AIR).xyz;
                if mode == LOOK {
                    air = air_of(winds, pull).xyz;
                }
            }
            if STEMS {
                var rod = read_rod(at);
                if mode != LOOK {
                    let ended = rod_end(at, stem, rod, tip.old, tip.turn, shift);
                    stem = ended.stem;
                    rod = ended.rod;
                }
                if presses {
                    stem = pressed(at, stem, fruit(at, pull_field()).xyz, sail.air);
                } else if blows {
                    stem = pressed(at, stem, pull.xyz, air);
                }
                rod_start(at, stem, rod, at_joint, p_joint, mode);
                continue;
            }
            if mode != LOOK {
                stem = stem_end(at, stem, tip.turn, shift);
            }
            if presses {
                stem = pressed(at, stem, fruit(at, pull_field()).xyz, sail.air);
            } else if blows {
                stem = pressed(at, stem, pull.xyz, air);
            }
            let stretch = stem_start(at, stem, at_joint, p_joint, is_debris);
            if mode == TEST {
                test_stem(at, stem, stretch);
            }
        }
        if mode == TEST {
            test_joint(row, bits, own, limit);
        }
        if presses {
            press_link(air_at(airs_at(), row), sail, at_joint.axes.z, at_joint.v + v_d * 0.5);
        } else if blows {
            leave_to_wind(row, at_joint.axes.z, at_joint.v + v_d * 0.5);
        }
        if is_debris {
            let lift = select(tip.shift.z, 0.0, mode == LOOK);
            let held = select(eliminated.held, vec2f(0.0, UNBOUNDED), mode == LOOK);
            meet_ground(row, operation.w, tip.p.z, tip.motion.v, lift, held);
        }
        if (operation.y & SECOND_CARRIES) == 0u {
            set_motion(leaf_at((operation.z >> THIRD_LEAF) & 0x3ffu), 0u, tip.motion, vec2f(0.0));
        }
        let kept = select(0u, 1u, (operation.x & FIRST_TO_SLOT) != 0u);
        let forks = kept + select(0u, 1u, (operation.x & FIRST_TO_CROSS) != 0u);
        for (var k = 0u; k < forks; k++) {
            let own_slot = slot_at((operation.x >> FIRST_SLOT) & 0xffu);
            set_fork(select(cross_fork_at(operation.x >> FIRST_FORK), own_slot, k < kept), tip);
        }
    }
}

// The ground under the trunk, as a tip.
fn ground_tip() -> Tip {
    let zero = vec3f(0.0);
    return Tip(world_axes(), zero, zero, still(), awaited(vec4f(p_trunk(), 0.0)).xyz);
}

// Reads the tip of a link with several children.
fn fork(at: u32) -> Tip {
    let a = awaited(quad(at, FORK_CHANGE));
    let b = awaited(quad(at, FORK_CHANGE + 4u));
    let c = awaited(quad(at, FORK_CHANGE + 8u));
    let p = awaited(vec4f(quad(at, FORK_HEIGHT - QUAD).zw, quad(at, FORK_HEIGHT).x, 0.0)).xyz;
    return Tip(axes_of(a.xyz, vec3f(a.w, b.xy)), vec3f(b.zw, c.x), c.yzw, awaited_motion(at, FORK_MOTION), p);
}

// Stores it for the children that do not follow in the next row.
fn set_fork(at: u32, tip: Tip) {
    set_quad(at, FORK_CHANGE, vec4f(tip.old.y, tip.old.z.x));
    set_quad(at, FORK_CHANGE + 4u, vec4f(tip.old.z.yz, tip.turn.xy));
    set_quad(at, FORK_CHANGE + 8u, vec4f(tip.turn.z, tip.shift));
    set_motion(at, FORK_MOTION, tip.motion, tip.p.xy);
    set_quad(at, FORK_HEIGHT, vec4f(tip.p.z, 0.0, 0.0, 0.0));
}

// New angles and rates of a link, and its tip.
struct Advanced {
    tip: Tip,
    q: vec2f,
    v: vec2f,
}

// Advances a joint by a substep: the change of its rates is D^-1 (y - U^T a) with the change of velocity a of the parent's tip.
fn advance(own: Hinge, eliminated: Eliminated, from_tip: Tip) -> Advanced {
    var tip = from_tip;
    let joint = joint_outward(tip.old, own.direction, own.q);
    let dv_1 = eliminated.e.x - dot(eliminated.g_1n, tip.turn) - dot(eliminated.g_1f, tip.shift);
    let dv_2 = eliminated.e.y - dot(eliminated.g_2n, tip.turn) - dot(eliminated.g_2f, tip.shift);
    tip.turn += joint.first * dv_1 + joint.axes.y * dv_2;
    tip.shift += cross(tip.turn, joint.axes.z * own.length);
    tip.old = joint.axes;
    let v = own.v + vec2f(dv_1, dv_2);
    if SETTLES {
        return Advanced(tip, own.q + clamp(v * rules.h, vec2f(-LARGEST_MOVE), vec2f(LARGEST_MOVE)), vec2f(0.0));
    }
    return Advanced(tip, own.q + v * rules.h, v);
}

// Motion of a link at its joint, in its own axes, from the motion of its parent's tip.
fn kinematics(own: Hinge, parent: Motion) -> Motion {
    let v = own.v;
    let joint = joint_outward(parent.axes, own.direction, own.q);
    let s_w = joint.first * v.x + joint.axes.y * v.y;
    let b_w = parent.b_w + cross(parent.w, s_w) + joint.third * (v.x * v.y);
    return Motion(joint.axes, parent.w + s_w, b_w, parent.v, parent.b_v);
}

// Notes a link that turns so fast at the end of a frame that f64 computes its velocity products otherwise (decision 10).
fn note_fast_turn(mode: u32, w: vec3f) {
    if mode == TEST && dot(w, w) > rules.slow_rate * rules.slow_rate {
        found_notice |= NOTICE_STRAINED;
    }
}

// Counts frames over the limit of an unbroken joint, and tests that its numbers are finite.
fn test_joint(row: u32, bits: u32, own: Hinge, limits: vec2f) {
    let limit = limits.x;
    let bend = dot(own.q, own.q);
    if !(is_finite(bend) && is_finite(dot(own.v, own.v))) {
        found_notice |= NOTICE_NON_FINITE;
    }
    if (bits & STATE_DEBRIS) != 0u {
        return;
    }
    found_peak = max(found_peak, bend / limit);
    if TOUCHES {
        found_excess = max(found_excess, sqrt(bend / limit) - limits.y);
        if bend > NEARLY * limit {
            found_notice |= NOTICE_STRAINED;
        }
    }
    let frames = bits & STATE_FRAMES_OVER;
    let over = select(0u, min(frames + 1u, STATE_FRAMES_OVER), bend > limit);
    if over >= rules.rupture_frames {
        found_notice |= NOTICE_SNAPS;
    }
    if over != frames {
        states[operation_at(row)] = bits - frames + over;
    }
}

// Counts frames over both limits of a stem, and tests that the fruit's numbers are finite. `stretch` is the square of the stem's stretch.
fn test_stem(at: u32, stem: Stem, stretch: f32) {
    if !(is_finite(dot(stem.p, stem.p)) && is_finite(dot(stem.v, stem.v))) {
        found_notice |= NOTICE_NON_FINITE;
    }
    if stem.stiffness > 0.0 {
        let longest = rules.tension_factor * stem.threshold / stem.stiffness;
        let tension = select(0u, min((stem.frames_over & 0xffu) + 1u, 0xffu), stretch > longest * longest);
        let is_pulled = dot(stem.force, stem.force) > stem.threshold * stem.threshold;
        if TOUCHES {
            found_tension = max(found_tension, sqrt(stretch) * stem.stiffness);
            if stretch > NEARLY * longest * longest || is_pulled {
                found_notice |= NOTICE_STRAINED;
            }
        }
        let pull = select(0u, min(((stem.frames_over >> 8u) & 0xffu) + 1u, 0xffu), is_pulled);
        set_fruit(at, FRUIT_FORCE, vec4f(stem.force, bitcast<f32>(tension | (pull << 8u))));
        if tension >= rules.tension_frames || pull >= rules.pull_frames {
            found_notice |= NOTICE_DETACHES;
        }
    }
}

// Conjugate gradients for a substep's linear system instead of elimination, for comparison with other simulators. Nothing is factorised. A workgroup is a
// tile, a thread a part of a world.
//
// The inward pass stores for every joint its axes, the arm to its tip, the impulse y on it with no joint moving, and the preconditioner: the inverse of its own
// 2 x 2 block of the inertia H = S^T I^c S + armature, where I^c is the inertia of everything that the joint bears. Then H x = y is solved from x = 0. A product
// H p is a pass outwards (`spread`: the velocity changes p carried to every tip) and a pass inwards (`collect`: the momenta of links, fruit and contacts).

// Largest number of iterations; then the substep takes the solution so far.
const MOST_ITERATIONS: u32 = 64u;
// Norm of the preconditioned residual over that of the start at which a system counts as solved: what f32 can resolve.
const TOLERANCE: f32 = 1e-5;

var<private> krylov_at: u32;
var<workgroup> dots: array<f32, LANES * WARPS>;
var<workgroup> goes_on: array<u32, LANES>;
var<workgroup> any_goes_on: u32;

// One frame of all running worlds.
@compute @workgroup_size(LANES * TEAM)
fn conjugate(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let warp = thread / LANES;
    enter(group.x, warp, thread % LANES);
    krylov_at = behind_air_at();
    let runs = is_there() && bitcast<u32>(world(WORLD_STOPPED)) == 0u;
    let is_stale = (bitcast<u32>(world(WORLD_NOTICE)) & NOTICE_STALE) != 0u;
    found_notice = 0u;
    found_peak = 0.0;
    damping_time = rules.damped * world(WORLD_DAMPING_TIME);
    for (var step = 0u; step <= rules.substeps; step++) {
        substep = step - 1u;
        let mode = select(select(ADVANCE, TEST, step == rules.substeps), LOOK, step == 0u);
        if step > 0u {
            found_dot = 0.0;
            for (var k = 0u; k <= LEVELS; k++) {
                if runs && works_at_level(LEVELS - k, warp) {
                    inward(part_at(LEVELS - k, warp));
                }
                meet();
            }
            solve(thread, warp, runs);
        }
        for (var level = 0u; level <= LEVELS; level++) {
            if runs && works_at_level(level, warp) && (step > 0u || is_stale) {
                outward(part_at(level, warp), mode);
            }
            meet();
        }
        if BLOWS && step == 0u {
            if runs {
                sample_air(warp, TEAM, rules.frame + 1u);
            }
            meet();
        }
    }
    conclude(thread, runs);
}

// True if a warp has a part in a level.
fn works_at_level(level: u32, warp: u32) -> bool {
    return level > 0u || warp == 0u;
}

// Part of a warp in a level.
fn part_at(level: u32, warp: u32) -> u32 {
    return select((level - 1u) * WARPS + warp + 1u, 0u, level == 0u);
}

// Barrier for all memory.
fn meet() {
    storageBarrier();
    workgroupBarrier();
}

// Solves H x = y from x = 0. All worlds of a tile iterate until the last one is done.
fn solve(thread: u32, warp: u32, runs: bool) {
    let first = total(thread, found_dot);
    var rho = first;
    for (var k = 0u; k < MOST_ITERATIONS; k++) {
        let goes = runs && rho > TOLERANCE * TOLERANCE * first;
        if !any_of(thread, goes) {
            break;
        }
        for (var level = 0u; level <= LEVELS; level++) {
            if goes && works_at_level(level, warp) {
                spread(part_at(level, warp));
            }
            meet();
        }
        var curvature = 0.0;
        for (var n = 0u; n <= LEVELS; n++) {
            if goes && works_at_level(LEVELS - n, warp) {
                curvature += collect(part_at(LEVELS - n, warp));
            }
            meet();
        }
        curvature = total(thread, curvature);
        // Rounding may leave a direction without curvature: the iterations end with the solution so far.
        let is_convex = curvature > 0.0;
        let alpha = select(0.0, rho / curvature, is_convex);
        var next = 0.0;
        for (var level = 0u; level <= LEVELS; level++) {
            if goes && works_at_level(level, warp) {
                next += relax(part_at(level, warp), alpha);
            }
        }
        next = total(thread, next);
        for (var level = 0u; level <= LEVELS; level++) {
            if goes && works_at_level(level, warp) {
                redirect(part_at(level, warp), next / rho);
            }
        }
        rho = select(rho, select(0.0, next, is_convex), goes);
    }
    for (var level = 0u; level <= LEVELS; level++) {
        if runs && works_at_level(level, warp) {
            hand_over(part_at(level, warp));
        }
    }
    meet();
}

// Sum over a world's warps, in their order.
fn total(thread: u32, own: f32) -> f32 {
    dots[thread] = own;
    workgroupBarrier();
    var sum = 0.0;
    for (var k = 0u; k < TEAM; k++) {
        sum += dots[k * LANES + lane];
    }
    workgroupBarrier();
    return sum;
}

// True if any world of the tile goes on.
fn any_of(thread: u32, goes: bool) -> bool {
    if thread < LANES {
        goes_on[thread] = select(0u, 1u, goes);
    }
    workgroupBarrier();
    if thread == 0u {
        var any = 0u;
        for (var k = 0u; k < LANES; k++) {
            any |= goes_on[k];
        }
        any_goes_on = any;
    }
    return workgroupUniformLoad(&any_goes_on) != 0u;
}

// First quad of what is kept of a joint. It stands behind the links of the tile and is read as they are.
fn krylov_of(row: u32) -> u32 {
    return krylov_at + row * (KRYLOV_FIELDS / QUAD * LANES);
}

// Stores what the iterations need of a joint, instead of eliminating it.
fn prepare(row: u32, body: Body, pivot: vec3f, armature: f32, y: vec2f) {
    let at = krylov_of(row);
    let z = preconditioned(pivot, y);
    set_link(at, KRYLOV_FIRST, vec4f(body.joint.first, pivot.x));
    set_link(at, KRYLOV_SECOND, vec4f(body.joint.axes.y, pivot.y));
    set_link(at, KRYLOV_ARM, vec4f(body.d, pivot.z));
    set_link(at, KRYLOV_X, vec4f(0.0, 0.0, y));
    set_link(at, KRYLOV_P, vec4f(z, 0.0, 0.0));
    set_link(at, KRYLOV_ARMATURE, vec4f(armature, 0.0, 0.0, 0.0));
    found_dot += dot(y, z);
}

// The inverse of a joint's own block times a residual.
fn preconditioned(pivot: vec3f, r: vec2f) -> vec2f {
    return vec2f(pivot.x * r.x + pivot.y * r.y, pivot.y * r.x + pivot.z * r.y);
}

// Changes of angular and of linear velocity; or torque and force.
struct Pair {
    angular: vec3f,
    linear: vec3f,
}

fn pair(at: u32) -> Pair {
    let a = quad(at, 0u);
    let b = quad(at, 4u);
    return Pair(a.xyz, vec3f(a.w, b.xy));
}

fn set_pair(at: u32, value: Pair) {
    set_quad(at, 0u, vec4f(value.angular, value.linear.x));
    set_quad(at, 4u, vec4f(value.linear.yz, 0.0, 0.0));
}

// Velocity changes of the joints, carried outwards to every tip.
fn spread(part: u32) {
    let end = header(TILE_STARTS + part + 1u);
    var tip = Pair(vec3f(0.0), vec3f(0.0));
    for (var row = header(TILE_STARTS + part); row < end; row++) {
        let operation = operations[operation_at(row)];
        if (operation.x & FIRST_ACTIVE) == 0u {
            continue;
        }
        if (operation.x & FIRST_ROOT) != 0u {
            tip = Pair(vec3f(0.0), vec3f(0.0));
        } else if (operation.x & (FIRST_FROM_SLOT | FIRST_FROM_CROSS)) != 0u {
            tip = pair(parent_fork_at(operation.x));
        }
        let at = krylov_of(row);
        let p = link(at, KRYLOV_P);
        tip.angular += link(at, KRYLOV_FIRST).xyz * p.x + link(at, KRYLOV_SECOND).xyz * p.y;
        tip.linear += cross(tip.angular, link(at, KRYLOV_ARM).xyz);
        if (operation.y & SECOND_CARRIES) == 0u {
            set_pair(leaf_at((operation.z >> THIRD_LEAF) & 0x3ffu), tip);
        }
        if (operation.x & FIRST_TO_SLOT) != 0u {
            set_pair(slot_at((operation.x >> FIRST_SLOT) & 0xffu), tip);
        }
        if (operation.x & FIRST_TO_CROSS) != 0u {
            set_pair(cross_fork_at(operation.x >> FIRST_FORK), tip);
        }
    }
}

// Momenta of these changes, collected inwards from every tip. Stores the product H p at the joints, and returns the part's p . H p.
fn collect(part: u32) -> f32 {
    let start = header(TILE_STARTS + part);
    var tip = Pair(vec3f(0.0), vec3f(0.0));
    var borne = tip;
    var curvature = 0.0;
    for (var row = header(TILE_STARTS + part + 1u); row > start;) {
        row -= 1u;
        let operation = operations[operation_at(row)];
        if (operation.x & FIRST_ACTIVE) == 0u {
            continue;
        }
        if (operation.y & SECOND_CARRIES) == 0u {
            tip = pair(leaf_at((operation.z >> THIRD_LEAF) & 0x3ffu));
            borne = Pair(vec3f(0.0), vec3f(0.0));
        }
        if (operation.y & SECOND_TAKES) != 0u {
            borne = sum_of(borne, pair(slot_at((operation.x >> FIRST_SLOT) & 0xffu)));
        }
        let first_load = (operation.y >> SECOND_FIRST_LOAD) & 0x3ffu;
        let last_load = first_load + ((operation.y >> SECOND_LOADS) & 0x3fu);
        for (var k = first_load; k < last_load; k++) {
            borne = sum_of(borne, pair(cross_load_at(k)));
        }
        let at = krylov_of(row);
        let first = link(at, KRYLOV_FIRST).xyz;
        let second = link(at, KRYLOV_SECOND).xyz;
        let d = link(at, KRYLOV_ARM).xyz;
        let p = link(at, KRYLOV_P).xy;
        let armature = link(at, KRYLOV_ARMATURE).x;
        borne = momentum(row, operation.z, tip, d, borne);
        let product = vec2f(dot(first, borne.angular), dot(second, borne.angular)) + armature * p;
        set_link(at, KRYLOV_P, vec4f(p, product));
        curvature += dot(p, product);
        tip.linear -= cross(tip.angular, d);
        tip.angular -= first * p.x + second * p.y;
        if (operation.y & SECOND_GIVES_FIRST) != 0u {
            set_pair(slot_at((operation.x >> FIRST_PARENT) & 0xffu), borne);
        }
        if (operation.y & SECOND_GIVES) != 0u {
            let to = slot_at((operation.x >> FIRST_PARENT) & 0xffu);
            set_pair(to, sum_of(pair(to), borne));
        }
        if (operation.y & SECOND_GIVES_CROSS) != 0u {
            set_pair(cross_load_at(operation.y >> SECOND_OWN_LOAD), borne);
        }
    }
    return curvature;
}

fn sum_of(a: Pair, b: Pair) -> Pair {
    return Pair(a.angular + b.angular, a.linear + b.linear);
}

// Momentum about a link's joint: of the link, of its fruit, of the ground contact at its tip, and of what it bears there; drag included as in `eliminate`.
fn momentum(row: u32, third_word: u32, tip: Pair, d: vec3f, borne: Pair) -> Pair {
    let bits = states[operation_at(row)];
    let is_debris = (bits & STATE_DEBRIS) != 0u;
    var drag = select(vec2f(rules.linear_drag, rules.angular_drag), vec2f(rules.broken_linear_drag, rules.broken_angular_drag), is_debris);
    if BLOWS && !is_debris {
        drag.x = link(air_at(airs_at(), row), AIR_IMPULSE).w;
    }
    let own = read_link(link_at(row));
    let turning = 1.0 + rules.h * drag.y;
    let z = d * (1.0 / own.length);
    let at_joint = tip.linear - cross(tip.angular, d);
    var at_tip = borne.linear;
    if is_debris {
        let prop = quad(work_at(row), WORK_PROP);
        let held = quad(work_at(row), WORK_HELD);
        at_tip += tip.linear * vec3f(prop.w, prop.w, held.x);
    }
    let own_force = (at_joint + cross(tip.angular, d) * 0.5) * (own.mass * (1.0 + rules.h * drag.x));
    var sum = Pair(borne.angular + cross(d, at_tip) + cross(d, own_force) * 0.5, at_tip + own_force);
    sum.angular += (tip.angular * own.across + z * (own.excess * dot(z, tip.angular))) * turning;
    let first_fruit = (third_word >> THIRD_FIRST_FRUIT) & 0xfffu;
    let last_fruit = first_fruit + ((third_word >> THIRD_FRUIT) & 0x3fu);
    for (var k = first_fruit; k < last_fruit; k++) {
        if STEMS {
            let borne_there = read_borne(fruit_at(k));
            let v = at_joint + cross(tip.angular, borne_there.arm);
            let force = v * borne_there.mass + along(borne_there.direction, v) * borne_there.mass_along;
            let turning = tip.angular * borne_there.across + along(borne_there.direction, tip.angular) * borne_there.excess;
            sum.angular += cross(borne_there.arm, force) + turning;
            sum.linear += force;
        } else {
            let arm = fruit(fruit_at(k), FRUIT_ARM).xyz;
            let force = (at_joint + cross(tip.angular, arm)) * fruit(fruit_at(k), FRUIT_REACTION).w;
            sum.angular += cross(arm, force);
            sum.linear += force;
        }
    }
    return sum;
}

// x and r after a step along p; returns the part's new r . z.
fn relax(part: u32, alpha: f32) -> f32 {
    let end = header(TILE_STARTS + part + 1u);
    var rho = 0.0;
    for (var row = header(TILE_STARTS + part); row < end; row++) {
        if (operations[operation_at(row)].x & FIRST_ACTIVE) != 0u {
            let at = krylov_of(row);
            let p = link(at, KRYLOV_P);
            let last = link(at, KRYLOV_X);
            let r = last.zw - p.zw * alpha;
            set_link(at, KRYLOV_X, vec4f(last.xy + p.xy * alpha, r));
            rho += dot(r, preconditioned(pivot_of(at), r));
        }
    }
    return rho;
}

// Inverse of a joint's own block.
fn pivot_of(at: u32) -> vec3f {
    return vec3f(link(at, KRYLOV_FIRST).w, link(at, KRYLOV_SECOND).w, link(at, KRYLOV_ARM).w);
}

// The next search direction.
fn redirect(part: u32, beta: f32) {
    let end = header(TILE_STARTS + part + 1u);
    for (var row = header(TILE_STARTS + part); row < end; row++) {
        if (operations[operation_at(row)].x & FIRST_ACTIVE) != 0u {
            let at = krylov_of(row);
            let z = preconditioned(pivot_of(at), link(at, KRYLOV_X).zw);
            set_link(at, KRYLOV_P, vec4f(z + link(at, KRYLOV_P).xy * beta, 0.0, 0.0));
        }
    }
}

// Stores the solution in the place of an elimination's result, with nothing that depends on the parent.
fn hand_over(part: u32) {
    let end = header(TILE_STARTS + part + 1u);
    for (var row = header(TILE_STARTS + part); row < end; row++) {
        if (operations[operation_at(row)].x & FIRST_ACTIVE) != 0u {
            let x = link(krylov_of(row), KRYLOV_X).xy;
            let at = work_at(row);
            set_quad(at, WORK_G_1N, vec4f(0.0, 0.0, 0.0, x.x));
            set_quad(at, WORK_G_1F, vec4f(0.0, 0.0, 0.0, x.y));
            set_quad(at, WORK_G_2N, vec4f(0.0, 0.0, 0.0, quad(at, WORK_G_2N).w));
            set_quad(at, WORK_G_2F, vec4f(0.0, 0.0, 0.0, quad(at, WORK_G_2F).w));
        }
    }
}

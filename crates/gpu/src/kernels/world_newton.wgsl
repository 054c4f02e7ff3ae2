// Newton's method on the impulses of the contacts: `newton.rs`, `law.rs` and `delassus.rs` of `orchard_multibody::contact`, with the same names. A contact a thread.

// Regularisation as a share of the contact's own inverse inertia.
const NEAR_RIGID: f32 = 1e-4;
const TANGENTIAL: f32 = 1e-4;
// Newton step at which the solve ends, relative to the impulses; several times the rounding of f32. The residual of f64 cannot be used: the law multiplies the rounding of a velocity by up to
// 1e4, and the step divides by as much.
const TOLERANCE: f32 = 1e-5;
// Step up to which a solve that does not reach it counts as solved.
const SOLVED: f32 = 1e-3;
// A contact whose impulse changes its velocity by less counts as changed by this much [m/s]: its law follows the rounding of velocities.
const FAINT: f32 = 0.02;
const MAX_ITERATIONS: u32 = 100u;
// The line search ends when the slope has fallen to this share of the slope at its start.
const SLOPE_SHARE: f32 = 0.1;
const MAX_EVALUATIONS: u32 = 12u;

// Impulse of the law at a velocity, and L of -d impulse / d v = L L^T; columns from `rank` on are zero.
struct Response {
    impulse: vec3f,
    root: mat3x3f,
    rank: u32,
}

// Law of a contact: friction, tangential and normal regularisation [1/kg], and the normal velocity at which the normal impulse vanishes [m/s].
struct Law {
    friction: f32,
    r_t: f32,
    r_n: f32,
    v_hat: f32,
}

var<workgroup> parts: array<vec2f, MEETING_MOST_CONTACTS>;
var<workgroup> factors: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> roots: array<mat3x3f, MEETING_MOST_CONTACTS>;
// The contacts under load, and the ranks of their responses.
var<workgroup> loaded: array<vec2u, MEETING_MOST_CONTACTS>;
// Right-hand side of the contacts under load, three numbers each, then their solution.
var<workgroup> right: array<f32, 3u * MEETING_MOST_CONTACTS>;
// Impulses of the contacts [N s], by row.
var<workgroup> impulses: array<vec3f, MEETING_MOST_CONTACTS>;

var<private> law: Law;

// Sum over all contacts, the same in all threads; two barriers.
fn sum_of(own: vec2f) -> vec2f {
    if thread < contacts {
        parts[thread] = own;
    }
    workgroupBarrier();
    var sum = vec2f(0.0);
    for (var k = 0u; k < contacts; k++) {
        sum += parts[k];
    }
    workgroupBarrier();
    return sum;
}

// Velocity changes of a contact under impulses of all; two barriers.
fn multiply(own: vec3f) -> vec3f {
    if thread < contacts {
        factors[thread] = own;
    }
    workgroupBarrier();
    var sum = vec3f(0.0);
    for (var k = 0u; k < contacts && thread < contacts; k++) {
        sum += block(thread, k) * factors[k];
    }
    workgroupBarrier();
    return sum;
}

// Law of a contact whose block of the inverse inertia has the size `w`.
fn regularised(contact: u32, w: f32) -> Law {
    let surfaces = surfaces_of(first_of(contact_pair[contact]), second_of(contact_pair[contact]));
    let gap = own_gap;
    let time = robot.h + select(rules.dissipation_time, 0.0, gap > 0.0);
    return Law(
        surfaces.x,
        TANGENTIAL * w,
        max(NEAR_RIGID * w, 1.0 / (robot.h * surfaces.y * time)),
        -gap / time,
    );
}

// Friction and stiffness of two surfaces.
fn surfaces_of(first: u32, second: u32) -> vec2f {
    if is_solid(first) && is_solid(second) {
        let one = surface_on(first, MATERIAL_ROBOT);
        let other = surface_on(second, MATERIAL_ROBOT);
        return vec2f(sqrt(one.x * other.x), 1.0 / (1.0 / one.y + 1.0 / other.y));
    }
    if is_solid(first) {
        return surface_on(first, material_of(second));
    }
    if is_solid(second) {
        return surface_on(second, material_of(first));
    }
    let standing = material_of(second) - MATERIAL_STILL;
    if is_of_fruit(pair_of(first, second)) {
        return vec2f(bitcast<f32>(head(HEAD_FRICTION_OF_FRUIT)), bitcast<f32>(head(HEAD_FRUIT_STIFFNESS)));
    }
    return vec2f(
        bitcast<f32>(head(HEAD_FRICTION_OF_FRUIT + 1u + standing)),
        bitcast<f32>(head(HEAD_STIFFNESS_OF_FRUIT + standing)),
    );
}

// Friction and stiffness of a collider of the robot on a material; its own ones if that is the robot.
fn surface_on(collider: u32, material: u32) -> vec2f {
    let solid = collider - first_solid();
    let at = vec2u(COLLIDER_FRICTION, COLLIDER_STIFFNESS) + material;
    return bitcast<vec2f>(vec2u(collider_quad(solid, at.x)[at.x % QUAD], collider_quad(solid, at.y)[at.y % QUAD]));
}

fn material_of(collider: u32) -> u32 {
    if collider < first_solid() {
        return select(MATERIAL_FRUIT, MATERIAL_WOOD, collider < place.segments);
    }
    return select(MATERIAL_STILL, MATERIAL_GROUND, collider == ground_number());
}

// Open, sticking, sliding. `v` is the velocity beyond the one at which the impulse vanishes: near the solution it is small, and has little rounding.
fn respond(v: vec3f) -> Response {
    let zero = vec3f(0.0);
    if own_given != 0.0 {
        return Response(vec3f(0.0, 0.0, own_given), mat3x3f(zero, zero, zero), 0u);
    }
    let y_n = -v.z / law.r_n;
    let y = -v.xy / law.r_t;
    let y_t = length(y);
    if y_t <= law.friction * y_n {
        let stiff_t = inverseSqrt(law.r_t);
        let root = mat3x3f(vec3f(stiff_t, 0.0, 0.0), vec3f(0.0, stiff_t, 0.0), vec3f(0.0, 0.0, inverseSqrt(law.r_n)));
        return Response(vec3f(y, y_n), root, 3u);
    }
    let ratio = law.friction * law.r_t / law.r_n;
    if y_n <= -ratio * y_t || y_t == 0.0 {
        return Response(zero, mat3x3f(zero, zero, zero), 0u);
    }
    // The edge of the cone.
    let t = y / y_t;
    let share = 1.0 / (1.0 + law.friction * ratio);
    let gamma_n = (y_n + ratio * y_t) * share;
    let edge = vec3f(law.friction * t, 1.0);
    let along = edge * sqrt(share / law.r_n);
    let across = vec3f(-t.y, t.x, 0.0) * sqrt(law.friction * gamma_n / (y_t * law.r_t));
    return Response(edge * gamma_n, mat3x3f(along, across, zero), select(1u, 2u, law.friction > 0.0));
}

// Finds the impulses of all contacts. A barrier at the end.
fn solve_contacts() {
    let is_contact = thread < contacts;
    var w = 0.0;
    var p = vec3f(0.0);
    var v = vec3f(0.0);
    // The first step, at its full length, is to the impulses of the substep before.
    var dp = vec3f(0.0);
    if is_contact {
        let last = meetings[contact_at(thread)].xyz * frame_of(thread);
        dp = select(last, vec3f(0.0, 0.0, own_given), own_given != 0.0);
        let own = block(thread, thread);
        w = sqrt(dot(own[0], own[0]) + dot(own[1], own[1]) + dot(own[2], own[2])) / 3.0;
        law = regularised(thread, w);
        v = own_free + vec3f(robot_free[3u * thread], robot_free[3u * thread + 1u], robot_free[3u * thread + 2u]);
        v.z -= law.v_hat;
    }
    var response = Response(vec3f(0.0), mat3x3f(), 0u);
    var off = vec3f(0.0);
    var iterations = 0u;
    var step = 0.0;
    loop {
        let dv = multiply(dp);
        if iterations == 0u {
            p = dp;
            v += dv;
        } else {
            let length = search_line(off, p, dp, v, dv);
            p += dp * length;
            v += dv * length;
            let least = select(0.0, FAINT * FAINT / w, is_contact);
            let sizes = sum_of(vec2f(w * dot(dp, dp), max(w * dot(p, p), least)));
            step = sqrt(sizes.x / sizes.y);
        }
        if is_contact {
            response = respond(v);
        }
        if iterations == 0u && threads_with(any(p != vec3f(0.0)) || response.rank > 0u) == 0u {
            break;
        }
        if agree(iterations > 0u && (step <= TOLERANCE || iterations == MAX_ITERATIONS)) {
            break;
        }
        iterations++;
        off = response.impulse - p;
        dp = direction(response, off);
    }
    if is_contact {
        // The impulse of the law has more rounding than p.
        impulses[thread] = select(vec3f(0.0), on_cone(p), response.rank > 0u);
        if own_given != 0.0 {
            impulses[thread] = p;
        }
    }
    if thread == 0u {
        var numbers = meetings[record_at()];
        numbers.z = bitcast<f32>(bitcast<u32>(numbers.z) + select(0u, 1u, iterations == MAX_ITERATIONS && step > SOLVED));
        numbers.w = bitcast<f32>(iterations);
        meetings[record_at()] = numbers;
    }
    workgroupBarrier();
}

// An impulse on the cone, from one beside it by rounding.
fn on_cone(p: vec3f) -> vec3f {
    let normal = max(p.z, 0.0);
    let most = law.friction * normal;
    let across = length(p.xy);
    return vec3f(select(p.xy, p.xy * (most / across), across > most), normal);
}

// Newton's direction from the residual `off`, with the dense factor of the rows under load. With r = L a + s, s square to the columns of L, which are square
// to each other,
//     dp = r - L (I + L^T W L)^-1 L^T W r = s + L (I + L^T W L)^-1 (a - L^T W s);
// the first form is the difference of nearly equal numbers, too much so for f32.
fn direction(response: Response, off: vec3f) -> vec3f {
    let square = square_to(response, off);
    let w_square = multiply(square);
    var rest = vec3f(0.0);
    if response.rank > 0u {
        let root = response.root;
        rest = vec3f(part_along(root[0], off, w_square), part_along(root[1], off, w_square), part_along(root[2], off, w_square));
    }
    return square + response.root * solve_loaded(response, rest);
}

// Solves (I + L^T W L) x = `rest` of all contacts under load. A barrier at the end.
fn solve_loaded(response: Response, rest: vec3f) -> vec3f {
    let is_loaded = response.rank > 0u;
    let all_loaded = threads_with(is_loaded);
    let number = ones_before(all_loaded);
    // Rows of the contacts before this one, and of all.
    let rows = before_and_all(response.rank);
    if is_loaded {
        loaded[number] = vec2u(thread, response.rank);
        roots[thread] = response.root;
        set_right(number, rest);
        name_rows(number, rows.x, response.rank);
    }
    let size = countOneBits(all_loaded);
    workgroupBarrier();
    if rows.y <= MOST_ROWS {
        eliminate(size, rows.y);
    } else {
        factor_in_place(size);
    }
    var x = vec3f(0.0);
    if is_loaded {
        x = right_of(number);
    }
    workgroupBarrier();
    return x;
}

// Right-hand side of a contact under load.
fn right_of(number: u32) -> vec3f {
    return vec3f(right[3u * number], right[3u * number + 1u], right[3u * number + 2u]);
}

fn set_right(number: u32, own: vec3f) {
    right[3u * number] = own.x;
    right[3u * number + 1u] = own.y;
    right[3u * number + 2u] = own.z;
}

// A number of a - L^T W s, for a column of L; 0 for one that is zero.
fn part_along(column: vec3f, off: vec3f, w_square: vec3f) -> f32 {
    let size = dot(column, column);
    if size == 0.0 {
        return 0.0;
    }
    return dot(column, off) / size - dot(column, w_square);
}

// Part of a residual that is square to the columns of L.
fn square_to(response: Response, off: vec3f) -> vec3f {
    switch response.rank {
        case 0u: {
            return off;
        }
        case 1u: {
            return vec3f(off.xy, 0.0);
        }
        case 2u: {
            let n = normalize(cross(normalize(response.root[0]), normalize(response.root[1])));
            return n * dot(n, off);
        }
        default: {
            return vec3f(0.0);
        }
    }
}

// A barrier for both kinds of memory.
fn wait_for_all() {
    storageBarrier();
    workgroupBarrier();
}

// Solves for more rows: the blocks take the place of those of the inverse inertia below the diagonal, and on it those of the roots. Those above the diagonal stay, and fill their places at the end.
// A barrier there.
fn factor_in_place(size: u32) {
    for (var index = thread; index < size * (size + 1u) / 2u; index += LANES) {
        let own = block_of(index);
        if own.x != own.y {
            let row = loaded[own.x].x;
            let column = loaded[own.y].x;
            set_block(row, column, transpose(roots[row]) * block(row, column) * roots[column]);
        }
    }
    wait_for_all();
    if thread < size {
        let own = loaded[thread].x;
        // Rows behind the rank are those of the unit matrix.
        roots[own] = transpose(roots[own]) * block(own, own) * roots[own] + mat3x3f(unit(0u), unit(1u), unit(2u));
    }
    wait_for_all();
    solve_factored(size);
    for (var index = thread; index < size * (size + 1u) / 2u; index += LANES) {
        let own = block_of(index);
        if own.x != own.y {
            set_factor(own.x, own.y, transpose(factor_at(own.y, own.x)));
        }
    }
    wait_for_all();
}

// Block of the factor in the place of that of two contacts under load.
fn factor_at(row: u32, column: u32) -> mat3x3f {
    return block(loaded[row].x, loaded[column].x);
}

fn set_factor(row: u32, column: u32, own: mat3x3f) {
    set_block(loaded[row].x, loaded[column].x, own);
}

// Inverse of the Cholesky factor of a block.
fn inverse_root(a: mat3x3f) -> mat3x3f {
    let i_0 = inverseSqrt(a[0].x);
    let l_1 = a[0].y * i_0;
    let l_2 = a[0].z * i_0;
    let i_1 = inverseSqrt(a[1].y - l_1 * l_1);
    let l_3 = (a[1].z - l_1 * l_2) * i_1;
    let i_2 = inverseSqrt(a[2].z - l_2 * l_2 - l_3 * l_3);
    let n_1 = -l_1 * i_0 * i_1;
    return mat3x3f(
        vec3f(i_0, n_1, -(l_2 * i_0 + l_3 * n_1) * i_2),
        vec3f(0.0, i_1, -l_3 * i_1 * i_2),
        vec3f(0.0, 0.0, i_2),
    );
}

// Solves for the right-hand side, in its place, by Cholesky's method in blocks: each column takes its part off all that is behind it. A barrier at the end.
fn solve_factored(size: u32) {
    for (var j = 0u; j < size; j++) {
        // Every thread computes the block on the diagonal.
        let inverse = inverse_root(roots[loaded[j].x]);
        let y = inverse * right_of(j);
        wait_for_all();
        for (var i = j + 1u + thread; i < size; i += LANES) {
            let own = factor_at(i, j) * transpose(inverse);
            set_factor(i, j, own);
            set_right(i, right_of(i) - own * y);
        }
        if thread == 0u {
            roots[loaded[j].x] = inverse;
            set_right(j, y);
        }
        wait_for_all();
        let left = size - j - 1u;
        for (var index = thread; index < left * (left + 1u) / 2u; index += LANES) {
            let own = block_of(index) + vec2u(j + 1u);
            let change = factor_at(own.x, j) * transpose(factor_at(own.y, j));
            if own.x == own.y {
                roots[loaded[own.x].x] -= change;
            } else {
                set_factor(own.x, own.y, factor_at(own.x, own.y) - change);
            }
        }
        wait_for_all();
    }
    for (var left = size; left > 0u; left--) {
        let i = left - 1u;
        let x = transpose(roots[loaded[i].x]) * right_of(i);
        wait_for_all();
        for (var k = thread; k < i; k += LANES) {
            set_right(k, right_of(k) - transpose(factor_at(i, k)) * x);
        }
        if thread == 0u {
            set_right(i, x);
        }
        wait_for_all();
    }
}

// Length along the direction that minimises the cost, to a share of its first slope: the full step unless it overshoots, else the root of the slope by the
// Illinois variant of the false position.
fn search_line(off: vec3f, p: vec3f, dp: vec3f, v: vec3f, dv: vec3f) -> f32 {
    var low = 0.0;
    var high = 1.0;
    var slope_low = 0.0;
    var slope_high = 0.0;
    var length = 1.0;
    for (var k = 0u; k <= MAX_EVALUATIONS; k++) {
        // The slope at the length, and at the start.
        var slopes = vec2f(0.0);
        if thread < contacts {
            slopes = vec2f(dot(dv, p + dp * length - respond(v + dv * length).impulse), -dot(dv, off));
        }
        slopes = sum_of(slopes);
        let goal = SLOPE_SHARE * abs(slopes.y);
        let is_full = k == 0u && (slopes.x <= goal || slopes.y >= 0.0);
        if agree(is_full || abs(slopes.x) <= goal) {
            return length;
        }
        if k == 0u {
            slope_low = slopes.y;
            slope_high = slopes.x;
        } else if slopes.x < 0.0 {
            low = length;
            slope_low = slopes.x;
            slope_high *= 0.5;
        } else {
            high = length;
            slope_high = slopes.x;
            slope_low *= 0.5;
        }
        length = low - slope_low * (high - low) / (slope_high - slope_low);
    }
    return low;
}

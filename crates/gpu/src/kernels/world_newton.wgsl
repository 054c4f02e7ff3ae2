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
const MAX_ITERATIONS: u32 = 30u;
// The line search ends when the slope has fallen to this share of the slope at its start.
const SLOPE_SHARE: f32 = 0.1;
const MAX_EVALUATIONS: u32 = 12u;
const ACTIVE: u32 = 3u * MEETING_MOST_CONTACTS;

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

var<workgroup> parts: array<vec4f, LANES>;
var<workgroup> factors: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> roots: array<mat3x3f, MEETING_MOST_CONTACTS>;
var<workgroup> starts: array<u32, MEETING_MOST_CONTACTS + 1u>;
// Lower triangle of I + L^T W L, row after row, then its Cholesky factor but for the diagonal; the right-hand side is one more row.
var<workgroup> triangle: array<f32, (ACTIVE + 1u) * (ACTIVE + 2u) / 2u>;
var<workgroup> inverse_pivots: array<f32, ACTIVE>;
// Impulses of the contacts [N s], by row.
var<workgroup> impulses: array<vec3f, MEETING_MOST_CONTACTS>;

var<private> law: Law;

// Sum over all contacts, the same in all threads; two barriers.
fn sum_of(own: vec4f) -> vec4f {
    parts[thread] = own;
    workgroupBarrier();
    var sum = vec4f(0.0);
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

fn block(row: u32, column: u32) -> mat3x3f {
    let at = block_at(max(row, column), min(row, column));
    let own = mat3x3f(
        large[at], large[at + 1u], large[at + 2u],
        large[at + 3u], large[at + 4u], large[at + 5u],
        large[at + 6u], large[at + 7u], large[at + 8u],
    );
    // The numbers stand row after row.
    if row < column {
        return own;
    }
    return transpose(own);
}

// Law of a contact whose block of the inverse inertia has the size `w`.
fn regularised(contact: u32, w: f32) -> Law {
    let surfaces = surfaces_of(first_of(contact_pair[contact]), second_of(contact_pair[contact]));
    let gap = contact_gap[contact];
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
    if is_contact {
        let own = block(thread, thread);
        w = sqrt(dot(own[0], own[0]) + dot(own[1], own[1]) + dot(own[2], own[2])) / 3.0;
        law = regularised(thread, w);
        p = guess(thread);
        v = free_velocity[thread] + vec3f(robot_free[3u * thread], robot_free[3u * thread + 1u], robot_free[3u * thread + 2u]);
        v.z -= law.v_hat;
    }
    v += multiply(p);
    var response = Response(vec3f(0.0), mat3x3f(), 0u);
    var iterations = 0u;
    var step = 0.0;
    loop {
        if is_contact {
            response = respond(v);
        }
        let off = response.impulse - p;
        let size = sum_of(vec4f(dot(p, p) + dot(response.impulse, response.impulse), 0.0, 0.0, 0.0)).x;
        if agree(size == 0.0 || (iterations > 0u && step <= TOLERANCE) || iterations == MAX_ITERATIONS) {
            break;
        }
        iterations++;
        let dp = direction(response, off);
        let dv = multiply(dp);
        let length = search_line(off, p, dp, v, dv);
        p += dp * length;
        v += dv * length;
        let least = select(0.0, FAINT * FAINT / w, is_contact);
        let sizes = sum_of(vec4f(w * dot(dp, dp) * length * length, max(w * dot(p, p), least), 0.0, 0.0));
        step = sqrt(sizes.x / sizes.y);
    }
    if is_contact {
        // The impulse of the law has more rounding than p.
        impulses[thread] = select(vec3f(0.0), on_cone(p), response.rank > 0u);
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

// Impulse of the substep before, if the pair was in contact then; points of a pair are matched in their order. It changes how fast the solve converges, and
// its result only below its tolerance.
fn guess(contact: u32) -> vec3f {
    let pair = contact_pair[contact];
    var before = 0u;
    for (var k = 0u; k < contact; k++) {
        before += select(0u, 1u, contact_pair[k] == pair);
    }
    let last = min(bitcast<u32>(meetings[record_at() + 1u].w), MEETING_MOST_CONTACTS);
    for (var k = 0u; k < last; k++) {
        let old = meetings[contact_at(k)];
        if bitcast<u32>(old.w) == pair {
            if before == 0u {
                return old.xyz * frame_of(contact);
            }
            before--;
        }
    }
    return vec3f(0.0);
}

// Newton's direction from the residual `off`, with the dense factor of the rows under load. With r = L a + s, s square to the columns of L, which are square
// to each other,
//     dp = r - L (I + L^T W L)^-1 L^T W r = s + L (I + L^T W L)^-1 (a - L^T W s);
// the first form is the difference of nearly equal numbers, too much so for f32.
fn direction(response: Response, off: vec3f) -> vec3f {
    let is_contact = thread < contacts;
    let square = square_to(response, off);
    let w_square = multiply(square);
    counts[thread] = select(0u, response.rank, is_contact);
    workgroupBarrier();
    var start = 0u;
    var all_rows = 0u;
    for (var k = 0u; k < contacts; k++) {
        start += select(0u, counts[k], k < thread);
        all_rows += counts[k];
    }
    if is_contact {
        starts[thread] = start;
        roots[thread] = response.root;
    }
    let size = shared_number(all_rows);
    if is_contact {
        for (var j = 0u; j < response.rank; j++) {
            let column = response.root[j];
            triangle[row_at(size) + start + j] = dot(column, off) / dot(column, column) - dot(column, w_square);
        }
    }
    let blocks = contacts * (contacts + 1u) / 2u;
    for (var index = thread; index < blocks; index += LANES) {
        let own = block_of(index);
        let product = transpose(roots[own.x]) * block(own.x, own.y) * roots[own.y];
        for (var i = 0u; i < counts[own.x]; i++) {
            let row = starts[own.x] + i;
            for (var j = 0u; j < counts[own.y] && starts[own.y] + j <= row; j++) {
                let column = starts[own.y] + j;
                triangle[row_at(row) + column] = product[j][i] + select(0.0, 1.0, row == column);
            }
        }
    }
    workgroupBarrier();
    solve_active(size);
    var dp = square;
    if is_contact {
        for (var j = 0u; j < response.rank; j++) {
            dp += response.root[j] * triangle[row_at(size) + start + j];
        }
    }
    workgroupBarrier();
    return dp;
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

fn row_at(row: u32) -> u32 {
    return row * (row + 1u) / 2u;
}

// Solves for the right-hand side, in its place, by Cholesky's method. A barrier at the end.
fn solve_active(size: u32) {
    for (var j = 0u; j < size; j++) {
        // Every thread computes the pivot.
        let of_j = row_at(j);
        var pivot = triangle[of_j + j];
        for (var k = 0u; k < j; k++) {
            pivot -= triangle[of_j + k] * triangle[of_j + k];
        }
        let inverse = inverseSqrt(pivot);
        for (var i = j + 1u + thread; i <= size; i += LANES) {
            let of_i = row_at(i);
            var sum = triangle[of_i + j];
            for (var k = 0u; k < j; k++) {
                sum -= triangle[of_i + k] * triangle[of_j + k];
            }
            triangle[of_i + j] = sum * inverse;
        }
        if thread == 0u {
            inverse_pivots[j] = inverse;
        }
        workgroupBarrier();
    }
    let rhs = row_at(size);
    for (var left = size; left > 0u; left--) {
        let i = left - 1u;
        let x = triangle[rhs + i] * inverse_pivots[i];
        for (var k = thread; k < i; k += LANES) {
            triangle[rhs + k] -= triangle[row_at(i) + k] * x;
        }
        workgroupBarrier();
        if thread == 0u {
            triangle[rhs + i] = x;
        }
    }
    workgroupBarrier();
}

// Length along the direction that minimises the cost, to a share of its first slope: the full step unless it overshoots, else the root of the slope by the
// Illinois variant of the false position.
fn search_line(off: vec3f, p: vec3f, dp: vec3f, v: vec3f, dv: vec3f) -> f32 {
    var low = 0.0;
    var high = 1.0;
    var slope_low = -sum_of(vec4f(dot(dv, off), 0.0, 0.0, 0.0)).x;
    var slope_high = slope_at(p, dp, v, dv, 1.0);
    let goal = SLOPE_SHARE * abs(slope_low);
    if agree(slope_high <= goal || slope_low >= 0.0) {
        return 1.0;
    }
    for (var k = 0u; k < MAX_EVALUATIONS; k++) {
        let length = low - slope_low * (high - low) / (slope_high - slope_low);
        let slope = slope_at(p, dp, v, dv, length);
        if agree(abs(slope) <= goal) {
            return length;
        }
        if slope < 0.0 {
            low = length;
            slope_low = slope;
            slope_high *= 0.5;
        } else {
            high = length;
            slope_high = slope;
            slope_low *= 0.5;
        }
    }
    return low;
}

// Slope of the cost at a length along the direction.
fn slope_at(p: vec3f, dp: vec3f, v: vec3f, dv: vec3f, length: f32) -> f32 {
    var slope = 0.0;
    if thread < contacts {
        slope = dot(dv, p + dp * length - respond(v + dv * length).impulse);
    }
    return sum_of(vec4f(slope, 0.0, 0.0, 0.0)).x;
}

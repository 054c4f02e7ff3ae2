// Search for colliders of a world that are near each other, a bound about each. A workgroup is a world.

var<workgroup> pairs: array<u32, MEETING_MOST_PAIRS>;

// Fruit whose surfaces are farther apart than this [m], now and at the end of the substep if no velocity changes, have no contact. Our own choice: at rest most fruit of a cluster are a few
// millimetres apart, and there is room for few contacts; what impulses bring together in a substep is met in the next one.
const FRUIT_NEAR: f32 = 2e-3;
// Depth by which two fruit must press into each other to make a world without other contacts solve for contacts [m], our own choice: several times the rounding of their gap. Fruit that have grown into each
// other hang with a gap of 0.
const FRUIT_SUNK: f32 = 1e-6;

// True if a pair is of other things than two hanging fruit, or of two that press into each other.
var<private> matters: bool;

// Keeps the pairs of colliders that are near each other; none in a world where only hanging fruit are near each other, and none presses into another.
@compute @workgroup_size(LANES)
fn seek(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) own_thread: u32) {
    thread = own_thread;
    enter_world(group.x);
    if !agree(bitcast<u32>(worlds[world_at(WORLD_STOPPED)]) == 0u) {
        return;
    }
    place_balls();
    let found = find_pairs();
    let is_near = before_and_all(select(0u, 1u, matters)).y != 0u;
    let four = thread * QUAD;
    if is_near && four < found {
        meetings[pairs_at(thread)] = bitcast<vec4f>(vec4u(pairs[four], pairs[four + 1u], pairs[four + 2u], pairs[four + 3u]));
    }
    if thread == 0u {
        meetings[system_at(SYSTEM_CONTACTS)] = vec4f(0.0, bitcast<f32>(select(0u, found, is_near)), 0.0, 0.0);
        if !is_near {
            note_contacts(0u, 0u, 0u);
        }
    }
}

// A collider that is a capsule or a ball: start, axis, radius; the radius is negative if nothing meets it.
struct Round {
    p: vec3f,
    along: vec3f,
    radius: f32,
}

fn round_of(collider: u32) -> Round {
    if collider >= first_still() {
        let at = (HEAD_FIELDS + head(HEAD_COLLIDERS) * COLLIDER_FIELDS + (collider - first_still()) * STILL_FIELDS) / QUAD;
        let start = bitcast<vec4f>(tables[at]);
        return Round(start.xyz, bitcast<vec4f>(tables[at + 1u]).xyz, start.w);
    }
    if collider >= first_solid() {
        let solid = placed_solid(collider - first_solid());
        return Round(solid.p, solid.z * solid.length, solid.radius);
    }
    let row = row_word(collider) & 0xffffu;
    if collider < place.segments {
        let start = touch(row, TOUCH_P);
        let axis = touch(row, TOUCH_Z);
        return Round(start.xyz, axis.xyz * axis.w, start.w);
    }
    let p = fruit(row, FRUIT_P);
    return Round(p.xyz, vec3f(0.0), select(-1.0, fruit(row, FRUIT_MASS).y, bitcast<u32>(p.w) == 0u));
}

// Number of the colliders that are tried against those of the robot: wood, fruit, what stands still, the ground.
fn round_count() -> u32 {
    return first_solid() + head(HEAD_STILL) + place.ground;
}

// Number of one of them among the world's colliders.
fn round_number(index: u32) -> u32 {
    return select(index, index + head(HEAD_COLLIDERS), index >= first_solid());
}

// Colliders of the robot, a bit each, whose surfaces may be nearer to another collider than the margin.
fn near_solids(collider: u32) -> u32 {
    let margin = bitcast<f32>(head(HEAD_MARGIN));
    let solids = head(HEAD_COLLIDERS);
    var near = 0u;
    if collider == ground_number() {
        for (var solid = 0u; solid < solids; solid++) {
            if collider_quad(solid, COLLIDER_KIND).w != 0u && balls[solid].z < balls[solid].w + margin {
                let lowest = balls[solid].z - extent(placed_solid(solid), unit(2u));
                near |= select(0u, 1u << solid, lowest < margin);
            }
        }
        return near;
    }
    let own = round_of(collider);
    let square = dot(own.along, own.along);
    for (var solid = 0u; solid < solids && own.radius >= 0.0; solid++) {
        let ball = balls[solid];
        let apart = ball.xyz - own.p;
        let away = apart - own.along * clamped(dot(apart, own.along), square);
        let reach = ball.w + own.radius + margin;
        near |= select(0u, 1u << solid, dot(away, away) < reach * reach);
    }
    return near;
}

// Later colliders of the robot, a bit each, that one of them may touch.
fn near_itself(solid: u32) -> u32 {
    var near = 0u;
    if solid >= head(HEAD_COLLIDERS) {
        return near;
    }
    var left = collider_quad(solid, COLLIDER_KIND).z;
    while left != 0u {
        let other = firstTrailingBit(left);
        left &= left - 1u;
        let apart = balls[solid].xyz - balls[other].xyz;
        let reach = balls[solid].w + balls[other].w + bitcast<f32>(head(HEAD_MARGIN));
        if dot(apart, apart) < reach * reach {
            let parted = are_parted(solid, other) || are_parted(other, solid);
            near |= select(1u << other, 0u, parted);
        }
    }
    return near;
}

// True if two colliders of the robot are farther apart than the margin along the way from the second to the centre of the first. The ball about a chassis holds much of the arm.
fn are_parted(solid: u32, other: u32) -> bool {
    let one = placed_solid(solid);
    let two = placed_solid(other);
    let away = balls[solid].xyz - nearest_in(two, balls[other].xyz, balls[solid].xyz);
    let distance = length(away);
    if distance < COINCIDENT {
        return false;
    }
    let n = away / distance;
    let gap = dot(n, balls[solid].xyz - balls[other].xyz) - extent(one, n) - extent(two, n);
    return gap > bitcast<f32>(head(HEAD_MARGIN));
}

// Point of a box, or of the axis of a capsule or ball, that is nearest to another point; `centre` is its own.
fn nearest_in(solid: Solid, centre: vec3f, p: vec3f) -> vec3f {
    if solid.kind == SOLID_BOX {
        let axes = mat3x3f(solid.x, solid.y, solid.z);
        return centre + axes * clamp((p - centre) * axes, -solid.half, solid.half);
    }
    let along = 0.5 * solid.length;
    return centre + solid.z * clamp(dot(p - centre, solid.z), -along, along);
}

// How far a collider of the robot reaches from its centre in a direction.
fn extent(solid: Solid, n: vec3f) -> f32 {
    if solid.kind == SOLID_BOX {
        return dot(abs(n * mat3x3f(solid.x, solid.y, solid.z)), solid.half);
    }
    return 0.5 * solid.length * abs(dot(n, solid.z)) + solid.radius;
}

// Finds the pairs whose surfaces may be nearer than the margin, in the order of their colliders; returns their number, for all of which there may be no room.
fn find_pairs() -> u32 {
    var found = 0u;
    matters = cup_impulse() > 0.0;
    for (var first = 0u; first < round_count(); first += LANES) {
        let index = first + thread;
        let number = round_number(index);
        var near = 0u;
        if index < round_count() {
            near = near_solids(number);
        }
        found = keep_pairs(near, number, found);
    }
    found = keep_pairs(near_itself(thread), first_solid() + thread, found);
    for (var first = 0u; first < place.fruits; first += LANES) {
        let own = first + thread;
        let count = near_fruit(own, 0u, false);
        let places = before_and_all(count + near_standing(own, 0u, false));
        if places.y > 0u {
            near_fruit(own, found + places.x, true);
            near_standing(own, found + places.x + count, true);
        }
        found += places.y;
    }
    return shared_number(found);
}

// Keeps the pairs of a collider with those of the robot behind the ones that were found; returns the number of all.
fn keep_pairs(near: u32, number: u32, found: u32) -> u32 {
    var left = near;
    matters |= near != 0u;
    let places = before_and_all(countOneBits(left));
    var at = found + places.x;
    while left != 0u {
        let solid = first_solid() + firstTrailingBit(left);
        left &= left - 1u;
        if at < MEETING_MOST_PAIRS {
            pairs[at] = pair_of(min(number, solid), max(number, solid));
        }
        at++;
    }
    return found + places.y;
}

// Number of the colliders that stand still, and the ground, that a fruit in the hand may touch; keeps the pairs from a place on, if `keeps`.
fn near_standing(own: u32, first: u32, keeps: bool) -> u32 {
    var found = 0u;
    if own >= place.fruits || head(HEAD_STILL) + place.ground == 0u {
        return found;
    }
    let ball = round_of(place.segments + own);
    if ball.radius < 0.0 || !is_off_stem(row_word(place.segments + own) & 0xffffu) {
        return found;
    }
    let reach = ball.radius + bitcast<f32>(head(HEAD_MARGIN));
    for (var other = first_still(); other < ground_number() + place.ground; other++) {
        var distance = ball.p.z;
        if other != ground_number() {
            let one = round_of(other);
            let apart = ball.p - one.p;
            distance = length(apart - one.along * clamped(dot(apart, one.along), dot(one.along, one.along))) - one.radius;
        }
        if distance < reach {
            if keeps && first + found < MEETING_MOST_PAIRS {
                pairs[first + found] = pair_of(place.segments + own, other);
            }
            matters = true;
            found++;
        }
    }
    return found;
}

// Number of the later fruit that are near a hanging one, now or at the end of the substep if no velocity changes; keeps the pairs from a place on, if `keeps`.
fn near_fruit(own: u32, first: u32, keeps: bool) -> u32 {
    if bitcast<f32>(head(HEAD_FRUIT_STIFFNESS)) == 0.0 || own >= place.fruits {
        return 0u;
    }
    let row = row_word(place.segments + own) & 0xffffu;
    let ball = fruit(row, FRUIT_P);
    let radius = fruit(row, FRUIT_MASS).y;
    var found = 0u;
    if bitcast<u32>(ball.w) != 0u || is_off_stem(row) {
        return found;
    }
    for (var other = own + 1u; other < place.fruits; other++) {
        let other_row = row_word(place.segments + other) & 0xffffu;
        let other_ball = fruit(other_row, FRUIT_P);
        let apart = ball.xyz - other_ball.xyz;
        let reach = radius + fruit(other_row, FRUIT_MASS).y + bitcast<f32>(head(HEAD_MARGIN));
        if dot(apart, apart) > reach * reach || bitcast<u32>(other_ball.w) != 0u || is_off_stem(other_row) {
            continue;
        }
        let distance = length(apart);
        let pair = pair_of(place.segments + own, place.segments + other);
        let gap = distance - reach + bitcast<f32>(head(HEAD_MARGIN)) + overlap_of(pair);
        let closing = dot(fruit(row, FRUIT_V).xyz - fruit(other_row, FRUIT_V).xyz, apart) / max(distance, COINCIDENT);
        let least = min(gap, gap + robot.h * closing);
        matters |= least < -FRUIT_SUNK;
        if least < FRUIT_NEAR {
            if keeps && first + found < MEETING_MOST_PAIRS {
                pairs[first + found] = pair;
            }
            found++;
        }
    }
    return found;
}

// Depth by which two fruit have grown into each other [m].
fn overlap_of(pair: u32) -> f32 {
    for (var k = 0u; k < place.overlaps; k++) {
        if overlap_word(2u * k) == pair {
            return bitcast<f32>(overlap_word(2u * k + 1u));
        }
    }
    return 0.0;
}

// Contacts of a world's robot with wood, hanging fruit and fruit in its hand, and of hanging fruit with each other, in a substep, after both have set up their systems and before they move. A workgroup is a world.
// The law and its solution are those of `orchard_multibody::contact`.

// A collider of the robot, placed in the world.
struct Solid {
    kind: u32,
    link: i32,
    friction: vec2f,
    stiffness: vec2f,
    radius: f32,
    length: f32,
    half: vec3f,
    p: vec3f,
    x: vec3f,
    y: vec3f,
    z: vec3f,
}

// A frame of the robot with its motion.
struct Moving {
    p: vec3f,
    y: vec3f,
    z: vec3f,
    w: vec3f,
    v: vec3f,
}

// Motion of the robot's links, five quads each.
var<workgroup> moving_links: array<vec4f, ROBOT_DOFS * SYSTEM_LINK_FIELDS / QUAD>;
// Ball about each collider of the robot: centre and radius.
var<workgroup> balls: array<vec4f, COLLIDER_MOST>;
var<workgroup> pairs: array<u32, MEETING_MOST_PAIRS>;
var<workgroup> counts: array<u32, LANES>;
var<workgroup> agreed: u32;
// 1 for each contact point for which there is room.
var<workgroup> kept: array<u32, MEETING_MOST_TOUCHES>;
// The contacts: numbers of their colliders, place, normal, gap.
var<workgroup> contact_pair: array<u32, MEETING_MOST_CONTACTS>;
var<workgroup> contact_p: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> contact_n: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> contact_gap: array<f32, MEETING_MOST_CONTACTS>;
// First the touches of all pairs, nine numbers each; then the inverse inertia of the contacts: blocks of nine numbers, row after row, up to the diagonal.
var<workgroup> large: array<f32, MEETING_MOST_CONTACTS * (MEETING_MOST_CONTACTS + 1u) / 2u * 9u>;

const TOUCH_NUMBERS: u32 = 9u;
// No collider.
const NOBODY: u32 = 0xffffffffu;
// Fruit whose surfaces are farther apart than this [m], now and at the end of the substep if no velocity changes, have no contact. Our own choice: at rest most fruit of a cluster are a few
// millimetres apart, and there is room for few contacts; what impulses bring together in a substep is met in the next one.
const FRUIT_NEAR: f32 = 2e-3;
// Depth by which two fruit must press into each other to make a world without other contacts solve for contacts [m], our own choice: several times the rounding of their gap. Fruit that have grown into each
// other hang with a gap of 0.
const FRUIT_SUNK: f32 = 1e-6;
// Contacts of two fruit that stay open if no velocity changes come after those of the robot, which are nearer than this [m].
const OPEN_FRUIT: f32 = 1.0;

// Number of the thread, and of the contacts, the same in all threads.
var<private> thread: u32;
var<private> contacts: u32;
// Contact points that were left out.
var<private> left_out: u32;

// Notes whether surfaces are near each other, so that the next kernel, of which few workgroups fit into a multiprocessor, leaves the other worlds at once.
@compute @workgroup_size(LANES)
fn seek(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) own_thread: u32) {
    thread = own_thread;
    enter_world(group.x);
    if !agree(bitcast<u32>(worlds[world_at(WORLD_STOPPED)]) == 0u) {
        return;
    }
    place_robot();
    var near = 0u;
    for (var collider = thread; collider < place.segments + place.fruits; collider += LANES) {
        near |= near_solids(collider);
    }
    for (var own = thread; own < place.fruits && near == 0u; own += LANES) {
        near |= near_fruit(own, -FRUIT_SUNK, 0u, false);
    }
    let is_near = before_and_all(select(0u, 1u, near != 0u)).y != 0u;
    if thread == 0u {
        meetings[system_at(SYSTEM_CONTACTS)] = vec4f(0.0, bitcast<f32>(select(0u, 1u, is_near)), 0.0, 0.0);
        if !is_near {
            note_losses(0u, 0u);
        }
    }
}

@compute @workgroup_size(LANES)
fn meet(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) own_thread: u32) {
    thread = own_thread;
    enter_world(group.x);
    let runs = bitcast<u32>(worlds[world_at(WORLD_STOPPED)]) == 0u;
    if !agree(runs && bitcast<u32>(system(SYSTEM_NEAR)) != 0u) {
        return;
    }
    place_robot();
    let pair_count = find_pairs();
    let touch_count = find_touches(pair_count);
    contacts = shared_number(choose_contacts(touch_count));
    if thread == 0u {
        meetings[system_at(SYSTEM_CONTACTS)] = vec4f(bitcast<f32>(contacts), 0.0, 0.0, 0.0);
        note_losses(pair_count, touch_count);
    }
    if contacts > 0u {
        answer();
    }
}

// Collider of the tree of a pair.
fn tree_of(pair: u32) -> u32 {
    return select(pair / COLLIDER_MOST, place.segments + ((pair & ~PAIR_FRUIT) >> PAIR_FIRST), (pair & PAIR_FRUIT) != 0u);
}

// The other fruit of a pair of fruit.
fn other_of(pair: u32) -> u32 {
    return select(NOBODY, place.segments + (pair & PAIR_NUMBER), (pair & PAIR_FRUIT) != 0u);
}

// True if it is true in the first thread; a barrier.
fn agree(is_so: bool) -> bool {
    return shared_number(select(0u, 1u, is_so)) != 0u;
}

// The number of the first thread; a barrier.
fn shared_number(own: u32) -> u32 {
    if thread == 0u {
        agreed = own;
    }
    return workgroupUniformLoad(&agreed);
}

// Numbers of all threads before this one, and of all; two barriers.
fn before_and_all(own: u32) -> vec2u {
    counts[thread] = own;
    workgroupBarrier();
    var sums = vec2u(0u);
    for (var k = 0u; k < LANES; k++) {
        sums += vec2u(select(0u, counts[k], k < thread), counts[k]);
    }
    workgroupBarrier();
    return sums;
}

// Motion of a link of the robot, or of odom on the ground.
fn moving(link: i32) -> Moving {
    if link < 0 {
        return Moving(place.p, in_world(unit(1u)), unit(2u), vec3f(0.0), vec3f(0.0));
    }
    let at = u32(link) * (SYSTEM_LINK_FIELDS / QUAD);
    return Moving(
        moving_links[at].xyz,
        moving_links[at + 1u].xyz,
        moving_links[at + 2u].xyz,
        moving_links[at + 3u].xyz,
        moving_links[at + 4u].xyz,
    );
}

fn collider_at(solid: u32) -> u32 {
    return (HEAD_FIELDS + solid * COLLIDER_FIELDS) / QUAD;
}

fn collider_quad(solid: u32, field: u32) -> vec4u {
    return tables[collider_at(solid) + field / QUAD];
}

fn link_of_solid(solid: u32) -> i32 {
    return bitcast<i32>(collider_quad(solid, COLLIDER_KIND).y);
}

fn placed_solid(solid: u32) -> Solid {
    let a = collider_quad(solid, COLLIDER_KIND);
    let b = bitcast<vec4f>(collider_quad(solid, COLLIDER_STIFFNESS));
    let c = bitcast<vec4f>(collider_quad(solid, COLLIDER_HALF));
    let on = moving(bitcast<i32>(a.y));
    let axes = mat3x3f(cross(on.y, on.z), on.y, on.z);
    var columns: array<vec3f, 4>;
    for (var k = 0u; k < 4u; k++) {
        columns[k] = axes * bitcast<vec4f>(collider_quad(solid, COLLIDER_P + QUAD * k)).xyz;
    }
    return Solid(
        a.x, bitcast<i32>(a.y), bitcast<vec2f>(a.zw), b.xy, b.z, b.w, c.xyz,
        on.p + columns[0], columns[1], columns[2], columns[3],
    );
}

// Reads the motion of the robot, and places the balls about its colliders; a barrier at the end.
fn place_robot() {
    for (var k = thread; k < robot.dofs * (SYSTEM_LINK_FIELDS / QUAD); k += LANES) {
        moving_links[k] = meetings[system_at(SYSTEM_LINK + QUAD * k)];
    }
    workgroupBarrier();
    if thread < head(HEAD_COLLIDERS) {
        let on = moving(link_of_solid(thread));
        let centre = bitcast<vec3f>(collider_quad(thread, COLLIDER_CENTRE).xyz);
        let bound = bitcast<f32>(collider_quad(thread, COLLIDER_HALF).w);
        balls[thread] = vec4f(on.p + mat3x3f(cross(on.y, on.z), on.y, on.z) * centre, bound);
    }
    workgroupBarrier();
}

// A collider of the tree as a capsule: start, axis, radius; the radius is negative if the robot does not meet it.
struct Round {
    p: vec3f,
    along: vec3f,
    radius: f32,
}

fn round_of(collider: u32) -> Round {
    let row = row_word(collider) & 0xffffu;
    if collider < place.segments {
        let start = touch(row, TOUCH_P);
        let axis = touch(row, TOUCH_Z);
        return Round(start.xyz, axis.xyz * axis.w, start.w);
    }
    let p = fruit(row, FRUIT_P);
    return Round(p.xyz, vec3f(0.0), select(-1.0, fruit(row, FRUIT_MASS).y, bitcast<u32>(p.w) == 0u));
}

// Colliders of the robot, a bit each, whose surfaces may be nearer to one of the tree than the margin.
fn near_solids(collider: u32) -> u32 {
    let margin = bitcast<f32>(head(HEAD_MARGIN));
    let solids = head(HEAD_COLLIDERS);
    let own = round_of(collider);
    let square = dot(own.along, own.along);
    var near = 0u;
    for (var solid = 0u; solid < solids && own.radius >= 0.0; solid++) {
        let ball = balls[solid];
        let apart = ball.xyz - own.p;
        let away = apart - own.along * clamped(dot(apart, own.along), square);
        let reach = ball.w + own.radius + margin;
        near |= select(0u, 1u << solid, dot(away, away) < reach * reach);
    }
    return near;
}

// Finds the pairs whose surfaces may be nearer than the margin, in the order of their colliders; returns their number, for all of which there may be no room.
fn find_pairs() -> u32 {
    let colliders = place.segments + place.fruits;
    var found = 0u;
    for (var first = 0u; first < colliders; first += LANES) {
        var near = 0u;
        if first + thread < colliders {
            near = near_solids(first + thread);
        }
        let places = before_and_all(countOneBits(near));
        var at = found + places.x;
        while near != 0u {
            let solid = firstTrailingBit(near);
            near &= near - 1u;
            if at < MEETING_MOST_PAIRS {
                pairs[at] = (first + thread) * COLLIDER_MOST + solid;
            }
            at++;
        }
        found += places.y;
    }
    for (var first = 0u; first < place.fruits; first += LANES) {
        let count = near_fruit(first + thread, FRUIT_NEAR, 0u, false);
        let places = before_and_all(count);
        if count > 0u {
            near_fruit(first + thread, FRUIT_NEAR, found + places.x, true);
        }
        found += places.y;
    }
    return shared_number(found);
}

// Number of the later fruit of which the gap to a hanging one is smaller than `within`, now or at the end of the substep if no velocity changes; keeps the pairs from a place on, if `keeps`.
fn near_fruit(own: u32, within: f32, first: u32, keeps: bool) -> u32 {
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
        let pair = PAIR_FRUIT | (own << PAIR_FIRST) | other;
        let gap = distance - reach + bitcast<f32>(head(HEAD_MARGIN)) + overlap_of(pair);
        let closing = dot(fruit(row, FRUIT_V).xyz - fruit(other_row, FRUIT_V).xyz, apart) / max(distance, COINCIDENT);
        if min(gap, gap + robot.h * closing) < within {
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

// Contact points of a pair.
fn touch_pair(pair: u32) {
    touches_found = 0u;
    let margin = bitcast<f32>(head(HEAD_MARGIN));
    let own = round_of(tree_of(pair));
    if other_of(pair) != NOBODY {
        let other = round_of(other_of(pair));
        round_round(own.p, own.along, own.radius, other.p, other.along, other.radius);
        touches[0].gap += overlap_of(pair);
        return;
    }
    let solid = placed_solid(pair % COLLIDER_MOST);
    if solid.kind != SOLID_BOX {
        round_round(own.p, own.along, own.radius, solid.p, solid.z * solid.length, solid.radius);
        return;
    }
    let axes = mat3x3f(solid.x, solid.y, solid.z);
    let a = (own.p - solid.p) * axes;
    if tree_of(pair) < place.segments {
        capsule_box(a, a + own.along * axes, own.radius, solid.half, margin);
    } else {
        sphere_box(a, own.radius, solid.half);
    }
    for (var k = 0u; k < touches_found; k++) {
        touches[k].p = solid.p + axes * touches[k].p;
        touches[k].n = axes * touches[k].n;
    }
}

// Velocity of a point of the tree's collider against that of the robot's, or of the other fruit's centre.
fn relative_velocity(pair: u32, p: vec3f) -> vec3f {
    let collider = tree_of(pair);
    let row = row_word(collider) & 0xffffu;
    if other_of(pair) != NOBODY {
        return fruit(row, FRUIT_V).xyz - fruit(row_word(other_of(pair)) & 0xffffu, FRUIT_V).xyz;
    }
    let on = moving(link_of_solid(pair % COLLIDER_MOST));
    var v: vec3f;
    if collider < place.segments {
        v = touch(row, TOUCH_V).xyz + cross(touch(row, TOUCH_W).xyz, p - touch(row, TOUCH_P).xyz);
    } else {
        v = fruit(row, FRUIT_V).xyz;
    }
    return v - (on.v + cross(on.w, p - on.p));
}

// Finds the contact points of all pairs within the margin, with their gap at the end of the substep if no velocity changed; returns their number.
fn find_touches(pair_count: u32) -> u32 {
    let margin = bitcast<f32>(head(HEAD_MARGIN));
    let known = min(pair_count, MEETING_MOST_PAIRS);
    var found = 0u;
    for (var first = 0u; first < known; first += LANES) {
        touches_found = 0u;
        let is_pair = first + thread < known;
        let pair = pairs[min(first + thread, known - 1u)];
        if is_pair {
            touch_pair(pair);
        }
        var kept = 0u;
        for (var k = 0u; k < touches_found; k++) {
            if touches[k].gap < margin {
                touches[kept] = touches[k];
                kept++;
            }
        }
        let places = before_and_all(kept);
        for (var k = 0u; k < kept; k++) {
            let place_of_touch = found + places.x + k;
            if place_of_touch < MEETING_MOST_TOUCHES {
                let own = touches[k];
                let at = place_of_touch * TOUCH_NUMBERS;
                for (var axis = 0u; axis < 3u; axis++) {
                    large[at + axis] = own.p[axis];
                    large[at + 3u + axis] = own.n[axis];
                }
                large[at + 6u] = own.gap;
                let ahead = own.gap + robot.h * dot(own.n, relative_velocity(pair, own.p));
                large[at + 7u] = select(ahead, ahead + OPEN_FRUIT, ahead > 0.0 && other_of(pair) != NOBODY);
                large[at + 8u] = bitcast<f32>(pair);
            }
        }
        found += places.y;
    }
    return shared_number(found);
}

// Keeps the contact points that will be nearest at the end of the substep, in their order, and counts those that it leaves out but for open ones of two fruit; returns their number. A barrier at the end.
fn choose_contacts(touch_count: u32) -> u32 {
    let known = min(touch_count, MEETING_MOST_TOUCHES);
    for (var own = thread; own < known; own += LANES) {
        kept[own] = select(0u, 1u, is_kept(own, known));
    }
    workgroupBarrier();
    var count = 0u;
    for (var own = 0u; own < known; own++) {
        if kept[own] != 0u && own % LANES == thread {
            let at = own * TOUCH_NUMBERS;
            contact_pair[count] = bitcast<u32>(large[at + 8u]);
            contact_p[count] = vec3f(large[at], large[at + 1u], large[at + 2u]);
            contact_n[count] = vec3f(large[at + 3u], large[at + 4u], large[at + 5u]);
            contact_gap[count] = large[at + 6u];
        }
        count += kept[own];
        left_out += select(0u, 1u, kept[own] == 0u && large[own * TOUCH_NUMBERS + 7u] < OPEN_FRUIT);
    }
    workgroupBarrier();
    return count;
}

// True if there is room for a touch: for itself, and for its second way if it has one.
fn is_kept(own: u32, known: u32) -> bool {
    var nearer = 0u;
    var nearer_two = 0u;
    for (var k = 0u; k < known; k++) {
        if is_nearer(k, own) {
            nearer++;
            nearer_two += select(0u, 1u, goes_two_ways(bitcast<u32>(large[k * TOUCH_NUMBERS + 8u])));
        }
    }
    let has_way = nearer_two < MEETING_MOST_WAYS - MEETING_MOST_CONTACTS || !goes_two_ways(bitcast<u32>(large[own * TOUCH_NUMBERS + 8u]));
    return nearer < MEETING_MOST_CONTACTS && has_way;
}

// True if a touch will be nearer than another; of equal ones the first is.
fn is_nearer(touch: u32, other: u32) -> bool {
    let a = large[touch * TOUCH_NUMBERS + 7u];
    let b = large[other * TOUCH_NUMBERS + 7u];
    return a < b || (a == b && touch < other);
}

// Counts what there was no room for.
fn note_losses(pair_count: u32, touch_count: u32) {
    let lost = max(pair_count, MEETING_MOST_PAIRS) - MEETING_MOST_PAIRS
        + max(touch_count, MEETING_MOST_TOUCHES) - MEETING_MOST_TOUCHES + left_out;
    var a = meetings[record_at()];
    var b = meetings[record_at() + 1u];
    a.x = bitcast<f32>(contacts);
    a.y = bitcast<f32>(bitcast<u32>(a.y) + lost);
    a.w = select(a.w, 0.0, contacts == 0u);
    b.z = bitcast<f32>(max(bitcast<u32>(b.z), touch_count));
    b.w = select(b.w, 0.0, contacts == 0u);
    meetings[record_at()] = a;
    meetings[record_at() + 1u] = b;
}

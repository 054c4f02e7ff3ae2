// Contact points of a world's robot with wood, hanging fruit, fruit in its hand, itself, posts, wires and level ground; of fruit in the hand with these; and of hanging fruit with each other; in a substep, after robot and tree have set up their systems and before they move. A workgroup is a world.

// A collider of the robot, placed in the world.
struct Solid {
    kind: u32,
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

// Ball about each collider of the robot: centre and radius.
var<workgroup> balls: array<vec4f, COLLIDER_MOST>;
var<workgroup> counts: array<u32, LANES>;
var<workgroup> agreed: u32;
// Bits of the threads for which something is true.
var<workgroup> said: atomic<u32>;
// The contact points of all pairs, nine numbers each, and 1 for each for which there is room.
var<workgroup> candidates: array<f32, MEETING_MOST_TOUCHES * TOUCH_NUMBERS>;
var<workgroup> kept: array<u32, MEETING_MOST_TOUCHES>;
// Pairs of the contacts.
var<workgroup> met: array<u32, MEETING_MOST_CONTACTS>;

const TOUCH_NUMBERS: u32 = 9u;
// Contacts of two fruit that stay open if no velocity changes come after those of the robot, which are nearer than this [m].
const OPEN_FRUIT: f32 = 1.0;

// Number of the thread.
var<private> thread: u32;
// Contact points that were left out.
var<private> left_out: u32;
// 1 if a suction cup pulls: its force takes a place among the contacts.
var<private> pulls: u32;

// Finds the contacts of the near pairs.
@compute @workgroup_size(LANES)
fn meet(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) own_thread: u32) {
    thread = own_thread;
    enter_world(group.x);
    let runs = bitcast<u32>(worlds[world_at(WORLD_STOPPED)]) == 0u;
    let pair_count = shared_number(select(0u, bitcast<u32>(system(SYSTEM_NEAR)), runs));
    // The cup of a robot that runs.
    pulls = shared_number(select(0u, 1u, runs && cup_impulse() > 0.0));
    if pair_count + pulls == 0u {
        return;
    }
    place_balls();
    let touch_count = find_touches(pair_count);
    let count = shared_number(choose_contacts(touch_count));
    var last = vec3f(0.0);
    if thread < count {
        last = impulse_before(thread);
    }
    storageBarrier();
    if thread < count {
        meetings[contact_at(thread)] = vec4f(last, bitcast<f32>(met[thread]));
    }
    if thread == 0u {
        if pulls != 0u {
            add_cup(count);
        }
        meetings[system_at(SYSTEM_CONTACTS)].x = bitcast<f32>(count + pulls);
        note_contacts(count + pulls, pair_count, touch_count);
    }
}

// Impulse of the substep before, if the pair was in contact then; points of a pair are matched in their order. It changes how fast the solve converges, and
// its result only below its tolerance.
fn impulse_before(contact: u32) -> vec3f {
    let pair = met[contact];
    var before = 0u;
    for (var k = 0u; k < contact; k++) {
        before += select(0u, 1u, met[k] == pair);
    }
    let last = min(bitcast<u32>(meetings[record_at() + 1u].w), MEETING_MOST_CONTACTS);
    for (var k = 0u; k < last; k++) {
        let old = meetings[contact_at(k)];
        if bitcast<u32>(old.w) == pair {
            if before == 0u {
                return old.xyz;
            }
            before--;
        }
    }
    return vec3f(0.0);
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

// Bits of the threads for which it is true; barriers.
fn threads_with(is_so: bool) -> u32 {
    if thread == 0u {
        atomicStore(&said, 0u);
    }
    workgroupBarrier();
    if is_so {
        atomicOr(&said, 1u << thread);
    }
    workgroupBarrier();
    return shared_number(atomicLoad(&said));
}

// Number of bits of the threads before this one.
fn ones_before(bits: u32) -> u32 {
    return countOneBits(bits & ((1u << thread) - 1u));
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
    let at = system_at(SYSTEM_LINK + u32(link) * SYSTEM_LINK_FIELDS);
    return Moving(
        meetings[at].xyz,
        meetings[at + LANES].xyz,
        meetings[at + 2u * LANES].xyz,
        meetings[at + 3u * LANES].xyz,
        meetings[at + 4u * LANES].xyz,
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
    let size = bitcast<vec2f>(collider_quad(solid, COLLIDER_RADIUS).zw);
    let half = bitcast<vec4f>(collider_quad(solid, COLLIDER_HALF)).xyz;
    let on = moving(bitcast<i32>(a.y));
    let axes = mat3x3f(cross(on.y, on.z), on.y, on.z);
    var columns: array<vec3f, 4>;
    for (var k = 0u; k < 4u; k++) {
        columns[k] = axes * bitcast<vec4f>(collider_quad(solid, COLLIDER_P + QUAD * k)).xyz;
    }
    return Solid(
        a.x, size.x, size.y, half,
        on.p + columns[0], columns[1], columns[2], columns[3],
    );
}

// Places the balls about the robot's colliders; a barrier at the end.
fn place_balls() {
    if thread < head(HEAD_COLLIDERS) {
        let on = moving(link_of_solid(thread));
        let centre = bitcast<vec3f>(collider_quad(thread, COLLIDER_CENTRE).xyz);
        let bound = bitcast<f32>(collider_quad(thread, COLLIDER_HALF).w);
        balls[thread] = vec4f(on.p + mat3x3f(cross(on.y, on.z), on.y, on.z) * centre, bound);
    }
    workgroupBarrier();
}

// Contact points of a pair.
fn touch_pair(pair: u32) {
    touches_found = 0u;
    let first = first_of(pair);
    let second = second_of(pair);
    if second == ground_number() {
        over_ground(first);
    } else if is_box(first) && is_box(second) {
        let one = placed_solid(first - first_solid());
        let other = placed_solid(second - first_solid());
        let axes = mat3x3f(other.x, other.y, other.z);
        let turned = transpose(axes) * mat3x3f(one.x, one.y, one.z);
        box_box(Block((one.p - other.p) * axes, turned, one.half), other.half, bitcast<f32>(head(HEAD_MARGIN)));
        place_touches(other.p, axes);
    } else if is_box(second) {
        against_box(round_of(first), is_ball(first), second - first_solid());
    } else if is_box(first) {
        let ball = balls[first - first_solid()];
        let around = Round(ball.xyz, vec3f(0.0), ball.w);
        against_box(part_beside(second, around), is_ball(second), first - first_solid());
        for (var k = 0u; k < touches_found; k++) {
            touches[k].n = -touches[k].n;
        }
    } else {
        let one = round_of(first);
        let other = part_beside(second, one);
        round_round(one.p, one.along, one.radius, other.p, other.along, other.radius);
        touches[0].gap += overlap_of(pair);
    }
}

fn is_box(collider: u32) -> bool {
    return is_solid(collider) && collider_quad(collider - first_solid(), COLLIDER_KIND).x == SOLID_BOX;
}

// True if a collider that is a capsule or a ball has no length.
fn is_ball(collider: u32) -> bool {
    return is_fruit(collider) || (is_solid(collider) && collider_quad(collider - first_solid(), COLLIDER_KIND).x == SOLID_SPHERE);
}

// Contact points of a capsule or a ball with a box of the robot.
fn against_box(own: Round, is_ball: bool, box: u32) {
    let solid = placed_solid(box);
    let axes = mat3x3f(solid.x, solid.y, solid.z);
    let a = (own.p - solid.p) * axes;
    if is_ball {
        sphere_box(a, own.radius, solid.half);
    } else {
        capsule_box(a, a + own.along * axes, own.radius, solid.half, bitcast<f32>(head(HEAD_MARGIN)));
    }
    place_touches(solid.p, axes);
}

// Places the touches that were found in a box's frame in the world.
fn place_touches(p: vec3f, axes: mat3x3f) {
    for (var k = 0u; k < touches_found; k++) {
        touches[k].p = p + axes * touches[k].p;
        touches[k].n = axes * touches[k].n;
    }
}

// A collider that is a capsule or a ball; of one that stands still the part that may touch another one: closest points of a wire of many metres have the rounding of its length.
fn part_beside(collider: u32, other: Round) -> Round {
    let long = round_of(collider);
    let size = length(long.along);
    let reach = length(other.along) + other.radius + long.radius + bitcast<f32>(head(HEAD_MARGIN));
    if collider < first_still() || size <= 2.0 * reach {
        return long;
    }
    let direction = long.along / size;
    let middle = dot(other.p - long.p, direction);
    let low = clamp(middle - reach, 0.0, size);
    let high = clamp(middle + reach, 0.0, size);
    return Round(long.p + direction * low, direction * (high - low), long.radius);
}

// Contact points of a collider over level ground: ends or corners.
fn over_ground(collider: u32) {
    if is_box(collider) {
        let solid = placed_solid(collider - first_solid());
        for (var corner = 0u; corner < 8u; corner++) {
            let at = corner_signs(corner) * solid.half;
            point_over_ground(solid.p + solid.x * at.x + solid.y * at.y + solid.z * at.z, 0.0);
        }
        return;
    }
    let own = round_of(collider);
    point_over_ground(own.p, own.radius);
    if any(own.along != vec3f(0.0)) {
        point_over_ground(own.p + own.along, own.radius);
    }
}

fn point_over_ground(p: vec3f, radius: f32) {
    if p.z - radius < bitcast<f32>(head(HEAD_MARGIN)) {
        add_touch(vec3f(p.xy, 0.0), unit(2u), p.z - radius);
    }
}

// Velocity of a point of a collider; of a fruit its centre's.
fn velocity_at(collider: u32, p: vec3f) -> vec3f {
    if collider >= first_still() {
        return vec3f(0.0);
    }
    if collider >= first_solid() {
        let on = moving(link_of_solid(collider - first_solid()));
        return on.v + cross(on.w, p - on.p);
    }
    let row = row_word(collider) & 0xffffu;
    if collider < place.segments {
        return touch(row, TOUCH_V).xyz + cross(touch(row, TOUCH_W).xyz, p - touch(row, TOUCH_P).xyz);
    }
    return fruit(row, FRUIT_V).xyz;
}

// Velocity of a point of a pair's first collider against that of the second.
fn relative_velocity(pair: u32, p: vec3f) -> vec3f {
    return velocity_at(first_of(pair), p) - velocity_at(second_of(pair), p);
}

// Finds the contact points of all pairs within the margin, with their gap at the end of the substep if no velocity changed; returns their number.
fn find_touches(pair_count: u32) -> u32 {
    let margin = bitcast<f32>(head(HEAD_MARGIN));
    let known = min(pair_count, MEETING_MOST_PAIRS);
    var found = 0u;
    for (var first = 0u; first < known; first += LANES) {
        touches_found = 0u;
        let is_pair = first + thread < known;
        let number = min(first + thread, known - 1u);
        let pair = bitcast<u32>(meetings[pairs_at(number / QUAD)][number % QUAD]);
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
                    candidates[at + axis] = own.p[axis];
                    candidates[at + 3u + axis] = own.n[axis];
                }
                candidates[at + 6u] = own.gap;
                let ahead = own.gap + robot.h * dot(own.n, relative_velocity(pair, own.p));
                candidates[at + 7u] = select(ahead, ahead + OPEN_FRUIT, ahead > 0.0 && is_of_fruit(pair));
                candidates[at + 8u] = bitcast<f32>(pair);
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
            met[count] = bitcast<u32>(candidates[at + 8u]);
            let n = vec3f(candidates[at + 3u], candidates[at + 4u], candidates[at + 5u]);
            meetings[contact_at(count) + 1u] = vec4f(n, candidates[at + 6u]);
            meetings[contact_at(count) + 2u] = vec4f(candidates[at], candidates[at + 1u], candidates[at + 2u], 0.0);
        }
        count += kept[own];
        left_out += select(0u, 1u, kept[own] == 0u && candidates[own * TOUCH_NUMBERS + 7u] < OPEN_FRUIT);
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
            nearer_two += select(0u, 1u, goes_two_ways(bitcast<u32>(candidates[k * TOUCH_NUMBERS + 8u])));
        }
    }
    let has_way = nearer_two < MEETING_MOST_WAYS - MEETING_MOST_CONTACTS || !goes_two_ways(bitcast<u32>(candidates[own * TOUCH_NUMBERS + 8u]));
    return nearer + pulls < MEETING_MOST_CONTACTS && has_way;
}

// True if a touch will be nearer than another; of equal ones the first is.
fn is_nearer(touch: u32, other: u32) -> bool {
    let a = candidates[touch * TOUCH_NUMBERS + 7u];
    let b = candidates[other * TOUCH_NUMBERS + 7u];
    return a < b || (a == b && touch < other);
}

// Notes how many contacts there are, and counts what there was no room for.
fn note_contacts(count: u32, pair_count: u32, touch_count: u32) {
    let lost = max(pair_count, MEETING_MOST_PAIRS) - MEETING_MOST_PAIRS
        + max(touch_count, MEETING_MOST_TOUCHES) - MEETING_MOST_TOUCHES + left_out;
    var a = meetings[record_at()];
    var b = meetings[record_at() + 1u];
    a.x = bitcast<f32>(count);
    a.y = bitcast<f32>(bitcast<u32>(a.y) + lost);
    a.w = select(a.w, 0.0, count == 0u);
    b.z = bitcast<f32>(max(bitcast<u32>(b.z), touch_count));
    b.w = bitcast<f32>(count);
    meetings[record_at()] = a;
    meetings[record_at() + 1u] = b;
}

// The suction cup of a robot: on which fruit its lip lies, what lies under it, its vacuum and its force. The law is that of `orchard_robot::Cup` and `orchard_world`
// (`docs/computation/suction.md`). A thread is a world.

// A fruit that the lip may lie on: its number from 1, its centre in the lip's frame [m], the sum of the gaps [m].
struct Lying {
    fruit: u32,
    p_lip: vec3f,
    radius: f32,
    gaps: f32,
}

// Brings the vacuum to the end of the substep, and keeps the impulse of its force; after `keep_system`. A cup that has no vacuum and gets none lies on nothing.
fn begin_cup() {
    let cup = robot.cup;
    if cup.points == 0u {
        return;
    }
    let valve = clamp(command[COMMAND_VALVE], 0.0, 1.0);
    var vacuum = state[ROBOT_VACUUM];
    var found = Lying(0u, vec3f(0.0), 0.0, 0.0);
    var closed = 0u;
    var share = 0.0;
    var axes = mat3x3f();
    if valve > 0.0 || vacuum > 0.0 {
        let on = moving(cup.link);
        let link = mat3x3f(cross(on.y, on.z), on.y, on.z);
        axes = link * mat3x3f(cup.x_link, cross(cup.z_link, cup.x_link), cup.z_link);
        found = lying_on(on.p + link * cup.p_link, axes);
        var leak = cup.area;
        if found.fruit != 0u {
            let open = openings(found);
            closed = open.closed;
            leak = min(open.sum * cup.spacing, cup.area);
            share = f32(countOneBits(closed)) / f32(cup.points);
        }
        let kept = 1.0 / (1.0 + leak / cup.leak_half);
        let reached = valve * cup.vacuum_max * kept;
        vacuum = reached + (vacuum - reached) * exp(-robot.h / (cup.rise_time * kept));
    }
    state[ROBOT_VACUUM] = vacuum;
    set_bits(ROBOT_CUP_FRUIT, select(0u, found.fruit, closed != 0u));
    set_bits(ROBOT_CUP_CLOSED, closed);
    meetings[system_at(SYSTEM_CUP)] = vec4f(axes[2], robot.h * vacuum * cup.area * share);
    meetings[system_at(SYSTEM_CUP_FRUIT)] = vec4f(bitcast<f32>(found.fruit), 0.0, 0.0, 0.0);
}

// Fruit that the lip lies on: that of the smallest mean gap. It begins where the lip touches it, and ends where all of the lip is farther away than it follows.
fn lying_on(p: vec3f, axes: mat3x3f) -> Lying {
    let cup = robot.cup;
    let before = bits(ROBOT_CUP_FRUIT);
    var best = Lying(0u, vec3f(0.0), 0.0, 0.0);
    for (var own = 0u; own < place.fruits; own++) {
        let row = row_word(place.segments + own) & 0xffffu;
        let ball = fruit(row, FRUIT_P);
        let radius = fruit(row, FRUIT_MASS).y;
        let apart = ball.xyz - p;
        let far = radius + 2.0 * cup.radius + cup.half_thickness;
        // A fruit that lies elsewhere is none.
        if bitcast<u32>(ball.w) != 0u || dot(apart, apart) > far * far {
            continue;
        }
        let p_lip = apart * axes;
        var sum = 0.0;
        var least = UNBOUNDED;
        for (var i = 0u; i < cup.points; i++) {
            let gap = gap_at(i, p_lip, radius);
            sum += gap;
            least = min(least, gap);
        }
        let within = select(0.0, cup.follow, before == own + 1u);
        if p_lip.z > 0.0 && least <= within && (best.fruit == 0u || sum < best.gaps) {
            best = Lying(own + 1u, p_lip, radius, sum);
        }
    }
    return best;
}

// Gap between a point of the lip and a ball [m].
fn gap_at(point: u32, p_lip: vec3f, radius: f32) -> f32 {
    return length(p_lip - robot.cup.p_lip[point].xyz) - (radius + robot.cup.half_thickness);
}

// Sum of the openings at the points of a lip [m], and the closed ones, a bit each.
struct Open {
    sum: f32,
    closed: u32,
}

fn openings(on: Lying) -> Open {
    let cup = robot.cup;
    let was_closed = select(0u, bits(ROBOT_CUP_CLOSED), bits(ROBOT_CUP_FRUIT) == on.fruit);
    let pressed = pressed_points(place.segments + on.fruit - 1u);
    let leaves = u32(command[COMMAND_LEAVES]);
    let folds = max(0.5 * cup.radius * cup.radius * (1.0 / on.radius - 1.0 / cup.curve_radius_min), 0.0);
    var open = Open(0.0, 0u);
    for (var i = 0u; i < cup.points; i++) {
        let point = 1u << i;
        var under = select(0.0, 2.0 * cup.half_thickness, (pressed & point) != 0u);
        under = max(under, select(0.0, cup.leaf_gap, (leaves & point) != 0u));
        // Nothing comes between the fruit and a point that was closed.
        under = select(under, 0.0, (was_closed & point) != 0u);
        let opening = max(gap_at(i, on.p_lip, on.radius) - cup.follow, 0.0) + folds + under;
        open.sum += opening;
        open.closed |= select(0u, point, opening == 0.0);
    }
    return open;
}

// Points of the lip on which something else than a fruit pressed in the substep before, a bit each. In a frame's first one the host knows more: a world that comes has no contacts here yet.
fn pressed_points(fruit_number: u32) -> u32 {
    let last = min(bitcast<u32>(meetings[record_at() + 1u].w), MEETING_MOST_CONTACTS);
    var pressed = select(0u, u32(command[COMMAND_PRESSED]), rules.substep == 0u);
    for (var k = 0u; k < last; k++) {
        let impulse = meetings[contact_at(k)];
        let pair = bitcast<u32>(impulse.w);
        let presses = dot(impulse.xyz, meetings[contact_at(k) + 1u].xyz) > 0.0;
        let is_cup = meetings[contact_at(k) + 2u].w != 0.0;
        let one = select(0u, point_of(first_of(pair)), second_of(pair) != fruit_number);
        let other = select(0u, point_of(second_of(pair)), first_of(pair) != fruit_number);
        pressed |= select(0u, one | other, presses && !is_cup);
    }
    return pressed;
}

// Bit of a collider among the points of the lip; 0 if it is none.
fn point_of(collider: u32) -> u32 {
    let point = collider - first_solid() - robot.cup.first;
    return select(0u, 1u << point, is_solid(collider) && point < robot.cup.points);
}

// Impulse of the cup in this substep [N s]; 0 without one.
fn cup_impulse() -> f32 {
    if robot.cup.points == 0u {
        return 0.0;
    }
    return system(SYSTEM_CUP + 3u);
}

// Adds the force of the cup behind some contacts: a contact at the fruit's centre whose impulse is given. Only for the first thread.
fn add_cup(count: u32) {
    let pull = meetings[system_at(SYSTEM_CUP)];
    let number = place.segments + bitcast<u32>(system(SYSTEM_CUP_FRUIT)) - 1u;
    let pair = pair_of(number, first_solid() + robot.cup.first);
    let centre = fruit(row_word(number) & 0xffffu, FRUIT_P).xyz;
    meetings[contact_at(count)] = vec4f(-pull.xyz * pull.w, bitcast<f32>(pair));
    meetings[contact_at(count) + 1u] = vec4f(-pull.xyz, 0.0);
    meetings[contact_at(count) + 2u] = vec4f(centre, pull.w);
}

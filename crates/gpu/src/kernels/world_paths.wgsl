// The problem of a substep's contacts: responses of the tree's joints and of the robot's to unit impulses along the rows of each contact, two tangents and the
// normal. An impulse acts on the tree only through the joints between it and the root, in whose coordinates C^T y the inverse of the tree's matrix is 1; on the
// robot by the Cholesky factor L of its matrix.

var<workgroup> tangents: array<array<vec3f, 2>, MEETING_MOST_CONTACTS>;
// Velocity of each contact without contacts: of the tree against the robot's present one, and what the robot's change adds.
var<workgroup> free_velocity: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> robot_free: array<f32, 3u * MEETING_MOST_CONTACTS>;
// Ways of the contacts through the tree: the contact of each, and the number of joints that it moves. Each contact has the way of its own number, and one of two fruit on different links a second one.
var<workgroup> way_contact: array<u32, MEETING_MOST_WAYS>;
var<workgroup> lengths: array<u32, MEETING_MOST_WAYS>;
var<workgroup> second_way: array<u32, MEETING_MOST_CONTACTS>;
var<private> ways: u32;
// L of the robot below the diagonal and the inverses of its diagonal; L^-1 of the impulses on the joints.
var<workgroup> factor: array<f32, ROBOT_DOFS * ROBOT_DOFS>;
var<workgroup> pivots: array<f32, ROBOT_DOFS>;
var<workgroup> robot_rest: array<f32, ROBOT_DOFS>;
var<workgroup> robot_change: array<f32, ROBOT_DOFS>;

// Solves the contacts, and hands their impulses on. Servos' limits and stuck joints are as in `solve_with_limits`.
fn answer() {
    take_robot();
    ways = share_ways();
    if thread < contacts {
        walk_tree(thread);
    }
    for (var tries = 0u; tries <= 2u * ROBOT_ARM; tries++) {
        factor_robot();
        respond_robot();
        assemble_inertia();
        solve_contacts();
        if !agree(move_robot()) {
            break;
        }
    }
    hand_on();
}

// Servo, losses, impulse and state of the thread's joint.
fn take_robot() {
    if thread < robot.dofs {
        take_drive(thread);
        matrix[entry(thread, thread)] = system(SYSTEM_MATRIX + entry(thread, thread));
        for (var field = ROBOT_Q; field <= ROBOT_V; field += ROBOT_V - ROBOT_Q) {
            let at = field + thread;
            state[at] = robots[robot_at(world_index / LANES, world_index % LANES, at / QUAD)][at % QUAD];
        }
    }
}

// Columns: two tangents and the normal. The first tangent is square to the axis that the normal is least along.
fn contact_frame(n: vec3f) -> mat3x3f {
    let size = abs(n);
    var least = select(0u, 1u, size.y < size.x);
    least = select(least, 2u, size.z < size[least]);
    let first = normalize(cross(n, unit(least)));
    return mat3x3f(first, cross(n, first), n);
}

fn frame_of(contact: u32) -> mat3x3f {
    return mat3x3f(tangents[contact][0], tangents[contact][1], contact_n[contact]);
}

// Follows the unit impulses of a contact from its link to the root of the tree: y = S^T P, P - G y. Keeps C^T y, and sums up the free change of the
// contact's velocity, y e, with the joints' free change e = D^-1 y that the inward pass has left.
fn walk_tree(contact: u32) {
    let pair = contact_pair[contact];
    let p = contact_p[contact];
    let directions = contact_frame(contact_n[contact]);
    tangents[contact][0] = directions[0];
    tangents[contact][1] = directions[1];
    var v = relative_velocity(pair, p);
    var on = start_of(first_of(pair), p, directions);
    v += on.change;
    var of_rows = vec3f(0.0);
    if is_of_fruit(pair) {
        let other = start_of(second_of(pair), p, directions * -1.0);
        v -= other.change;
        if second_way[contact] == NO_WAY {
            on = both_on_one_link(on, other);
        } else {
            of_rows = walk_on(second_way[contact], other);
        }
    }
    of_rows += walk_on(contact, on);
    free_velocity[contact] = v * directions + of_rows;
}

// What two fruit of a pair pass on to the link that bears both. A capped one passes nothing on.
fn both_on_one_link(one: Walk, other: Walk) -> Walk {
    let of_one = select(1.0, 0.0, one.is_capped);
    let of_other = select(1.0, 0.0, other.is_capped);
    var both = one;
    both.torques = one.torques * of_one + other.torques * of_other;
    both.forces = one.forces * of_one + other.forces * of_other;
    both.of_rows = one.of_rows + other.of_rows;
    both.is_capped = one.is_capped && other.is_capped;
    return both;
}

// Gives contacts of fruit on different links a second way, and counts the ways. There is room for all: `choose_contacts` leaves out the others. Two barriers.
fn share_ways() -> u32 {
    var has_two = 0u;
    if thread < contacts {
        has_two = select(0u, 1u, goes_two_ways(contact_pair[thread]));
    }
    let places = before_and_all(has_two);
    if thread < contacts {
        way_contact[thread] = thread;
        second_way[thread] = select(NO_WAY, contacts + places.x, has_two != 0u);
        if has_two != 0u {
            way_contact[contacts + places.x] = thread;
        }
    }
    workgroupBarrier();
    return contacts + places.y;
}

// True if a pair is of two fruit on different links.
fn goes_two_ways(pair: u32) -> bool {
    return is_of_fruit(pair) && (row_word(first_of(pair)) >> 16u) != (row_word(second_of(pair)) >> 16u);
}

// Follows a way to the root; returns the velocity that the free changes of its joints add along the rows.
fn walk_on(way: u32, on: Walk) -> vec3f {
    var walk = on;
    var of_rows = on.of_rows;
    var steps = 0u;
    for (; walk.segment != NO_PARENT && steps < head(HEAD_DEPTH); steps++) {
        let row = row_word(walk.segment);
        let joint = joint_of(row & 0xffffu);
        let y_1 = joint.first * walk.torques;
        let y_2 = joint.second * walk.torques;
        of_rows += y_1 * joint.e.x + y_2 * joint.e.y;
        keep_path(way, steps, walk.segment, y_1 * joint.c.x + y_2 * joint.c.y, y_2 * joint.c.z);
        walk = passed_on(walk, row, joint, y_1, y_2);
    }
    lengths[way] = select(steps, 0u, on.is_capped);
    return of_rows;
}

// Three unit impulses on their way to the root.
struct Walk {
    // Columns: torque about the joint of the segment, and force.
    torques: mat3x3f,
    forces: mat3x3f,
    segment: u32,
    // Change of the velocity of a fruit whose anchor does not move, or of a ball's surface with its spin.
    change: vec3f,
    // Velocity that a rod's free change adds along the rows.
    of_rows: vec3f,
    // True if no anchor feels the fruit, or not more than it does already (`dynamics.md`, Reaction cap).
    is_capped: bool,
}

// The impulses on a segment of the tree, or what the stem of a fruit passes on to its segment; nothing of a fruit in the hand, or of the robot.
fn start_of(collider: u32, p: vec3f, directions: mat3x3f) -> Walk {
    let none = mat3x3f(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    if collider >= first_solid() {
        return Walk(none, none, NO_PARENT, vec3f(0.0), vec3f(0.0), true);
    }
    let word = row_word(collider);
    if collider < place.segments {
        let r = p - touch(word & 0xffffu, TOUCH_P).xyz;
        return Walk(crossed(r, directions), directions, collider, vec3f(0.0), vec3f(0.0), false);
    }
    let row = word & 0xffffu;
    let inverse_mass = fruit(row, FRUIT_V).w;
    let change = fruit(row, FRUIT_IMPULSE).xyz * inverse_mass;
    if is_off_stem(row) {
        let spin = fruit(row, FRUIT_ARM).xyz / spin_divisor();
        return Walk(none, none, NO_PARENT, change + cross(spin, p - fruit(row, FRUIT_P).xyz), vec3f(0.0), true);
    }
    if STEMS {
        return start_on_rod(row, word >> 16u, p, directions, change);
    }
    let forces = directions * (stem_mass(row) * inverse_mass);
    let is_capped = fruit(row, FRUIT_REACTION).w == 0.0;
    return Walk(crossed(fruit(row, FRUIT_ARM).xyz, forces), forces, word >> 16u, change, vec3f(0.0), is_capped);
}

// Mass by which the stem of a fruit resists a change of velocity between its ends: h (c + h k).
fn stem_mass(row: u32) -> f32 {
    let stem = fruit(row, FRUIT_STIFFNESS);
    return robot.h * (stem.y + robot.h * stem.x);
}

fn crossed(r: vec3f, columns: mat3x3f) -> mat3x3f {
    return mat3x3f(cross(r, columns[0]), cross(r, columns[1]), cross(r, columns[2]));
}

// Joint of the tree as the inward pass has left it: axes; C_11, C_21, C_22; free change of its rates; G = U D^-1 by axis.
struct TreeJoint {
    first: vec3f,
    second: vec3f,
    c: vec3f,
    e: vec2f,
    g_1n: vec3f,
    g_1f: vec3f,
    g_2n: vec3f,
    g_2f: vec3f,
}

fn joint_of(row: u32) -> TreeJoint {
    let first = touch(row, TOUCH_FIRST);
    let second = touch(row, TOUCH_SECOND);
    let g_1n = works[work_at(row, WORK_G_1N)];
    let g_1f = works[work_at(row, WORK_G_1F)];
    let c = vec3f(first.w, touch(row, TOUCH_W).w, second.w);
    return TreeJoint(
        first.xyz, second.xyz, c, vec2f(g_1n.w, g_1f.w),
        g_1n.xyz, g_1f.xyz, works[work_at(row, WORK_G_2N)].xyz, works[work_at(row, WORK_G_2F)].xyz,
    );
}

// The impulses that the joint passes on, about the joint of the parent.
fn passed_on(walk: Walk, word: u32, joint: TreeJoint, y_1: vec3f, y_2: vec3f) -> Walk {
    var on = walk;
    on.segment = word >> 16u;
    for (var k = 0u; k < 3u; k++) {
        on.torques[k] -= joint.g_1n * y_1[k] + joint.g_2n * y_2[k];
        on.forces[k] -= joint.g_1f * y_1[k] + joint.g_2f * y_2[k];
    }
    if on.segment != NO_PARENT {
        let r = touch(word & 0xffffu, TOUCH_P).xyz - touch(row_word(on.segment) & 0xffffu, TOUCH_P).xyz;
        on.torques += crossed(r, on.forces);
    }
    return on;
}

fn keep_path(way: u32, step: u32, segment: u32, a: vec3f, b: vec3f) {
    let at = path_at(way, step);
    meetings[at] = vec4f(a, b.x);
    meetings[at + 1u] = vec4f(b.yz, bitcast<f32>(segment), 0.0);
}

// Factors the robot's matrix, a row a thread, under the present servos; starts with what its joints change without contacts. A barrier at the end.
fn factor_robot() {
    let is_joint = thread < robot.dofs;
    var rest = 0.0;
    if is_joint {
        let own = driven(thread);
        rest = own.x;
        factor[entry(thread, thread)] = own.y;
        for (var k = 0u; k < thread; k++) {
            factor[entry(thread, k)] = system(SYSTEM_MATRIX + entry(k, thread));
        }
    }
    for (var j = 0u; j < robot.dofs; j++) {
        if thread == j {
            pivots[j] = inverseSqrt(factor[entry(j, j)]);
            robot_rest[j] = rest * pivots[j];
        }
        workgroupBarrier();
        let is_below = is_joint && thread > j;
        if is_below {
            factor[entry(thread, j)] *= pivots[j];
            rest -= factor[entry(thread, j)] * robot_rest[j];
        }
        workgroupBarrier();
        if is_below {
            for (var k = j + 1u; k <= thread; k++) {
                factor[entry(thread, k)] -= factor[entry(thread, j)] * factor[entry(k, j)];
            }
        }
    }
    workgroupBarrier();
}

// Responses of the robot's joints to unit impulses, a row of a contact a thread: L^-1 J^T. A barrier at the end.
fn respond_robot() {
    for (var row = thread; row < 3u * contacts; row += LANES) {
        let contact = row / 3u;
        let pair = contact_pair[contact];
        let direction = frame_of(contact)[row % 3u];
        var y: array<f32, ROBOT_DOFS>;
        for (var j = 0u; j < ROBOT_DOFS; j++) {
            y[j] = 0.0;
        }
        for (var side = 0u; side < 2u; side++) {
            let collider = select(first_of(pair), second_of(pair), side != 0u);
            let force = select(direction, -direction, side != 0u);
            var link = -1;
            if is_solid(collider) {
                link = link_of_solid(collider - first_solid());
            }
            while link >= 0 {
                let on = moving(link);
                let torque = cross(contact_p[contact] - on.p, force);
                y[link] += dot(on.z, select(torque, force, robot.links[link].slides != 0u));
                link = robot.links[link].parent;
            }
        }
        var free = 0.0;
        for (var i = 0u; i < robot.dofs; i++) {
            var sum = y[i];
            for (var k = 0u; k < i; k++) {
                sum -= factor[entry(i, k)] * y[k];
            }
            y[i] = sum * pivots[i];
            free += y[i] * robot_rest[i];
        }
        robot_free[row] = free;
        for (var j = 0u; j < ROBOT_DOFS; j += QUAD) {
            meetings[response_at(row) + j / QUAD] = vec4f(y[j], y[j + 1u], y[j + 2u], y[j + 3u]);
        }
    }
    storageBarrier();
    workgroupBarrier();
}

// Row and column of a block among those up to the diagonal.
fn block_of(index: u32) -> vec2u {
    var row = u32((sqrt(8.0 * f32(index) + 1.0) - 1.0) * 0.5);
    row = select(row, row + 1u, (row + 1u) * (row + 2u) / 2u <= index);
    row = select(row, row - 1u, row * (row + 1u) / 2u > index);
    return vec2u(row, index - row * (row + 1u) / 2u);
}

// First number of a block.
fn block_at(row: u32, column: u32) -> u32 {
    return (row * (row + 1u) / 2u + column) * 9u;
}

// Fills the inverse inertia of the contacts, a block a thread. A barrier at the end.
fn assemble_inertia() {
    let blocks = contacts * (contacts + 1u) / 2u;
    for (var index = thread; index < blocks; index += LANES) {
        let own = block_of(index);
        // Columns are those of the block.
        let sum = of_robot(own) + of_all_fruit(own) + of_all_ways(own);
        for (var column = 0u; column < 3u; column++) {
            for (var row = 0u; row < 3u; row++) {
                large[index * 9u + 3u * row + column] = sum[column][row];
            }
        }
    }
    workgroupBarrier();
}

fn of_robot(own: vec2u) -> mat3x3f {
    var sum = mat3x3f(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    for (var quad = 0u; quad < (robot.dofs + 3u) / QUAD; quad++) {
        var rows: array<vec4f, 3>;
        for (var k = 0u; k < 3u; k++) {
            rows[k] = meetings[response_at(3u * own.x + k) + quad];
        }
        for (var column = 0u; column < 3u; column++) {
            let y = meetings[response_at(3u * own.y + column) + quad];
            sum[column] += vec3f(dot(rows[0], y), dot(rows[1], y), dot(rows[2], y));
        }
    }
    return sum;
}

// Of the fruit that both contacts touch. The second fruit of a pair bears the opposite impulse.
fn of_all_fruit(own: vec2u) -> mat3x3f {
    var sum = mat3x3f(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    let pairs_of_both = vec2u(contact_pair[own.x], contact_pair[own.y]);
    for (var k = 0u; k < 4u; k++) {
        let one = select(first_of(pairs_of_both.x), second_of(pairs_of_both.x), (k & 1u) != 0u);
        let other = select(first_of(pairs_of_both.y), second_of(pairs_of_both.y), (k & 2u) != 0u);
        if one == other && is_fruit(one) {
            let part = of_fruit(one, own);
            if k == 0u || k == 3u {
                sum += part;
            } else {
                sum -= part;
            }
        }
    }
    return sum;
}

// Of contacts with one fruit: of its velocity, and of the spin of one in the hand or on a rod.
fn of_fruit(collider: u32, own: vec2u) -> mat3x3f {
    let row = row_word(collider) & 0xffffu;
    let moved = transpose(frame_of(own.x)) * frame_of(own.y) * fruit(row, FRUIT_V).w;
    if !is_off_stem(row) {
        if STEMS {
            return moved + of_rod(row, own);
        }
        return moved;
    }
    let centre = fruit(row, FRUIT_P).xyz;
    let one = crossed(contact_p[own.x] - centre, frame_of(own.x));
    let other = crossed(contact_p[own.y] - centre, frame_of(own.y));
    return moved + transpose(one) * other * inverse_spin_inertia(row);
}

// Of all ways of both contacts.
fn of_all_ways(own: vec2u) -> mat3x3f {
    let second = vec2u(second_way[own.x], second_way[own.y]);
    var sum = of_tree(own);
    if second.x != NO_WAY {
        sum += of_tree(vec2u(second.x, own.y));
    }
    if second.y != NO_WAY {
        sum += of_tree(vec2u(own.x, second.y));
    }
    if second.x != NO_WAY && second.y != NO_WAY {
        sum += of_tree(second);
    }
    return sum;
}

// Of the joints that two ways pass: from the root on, up to the first that is another.
fn of_tree(own: vec2u) -> mat3x3f {
    var sum = mat3x3f(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    let most = min(lengths[own.x], lengths[own.y]);
    for (var depth = 1u; depth <= most; depth++) {
        let i = path_at(own.x, lengths[own.x] - depth);
        let j = path_at(own.y, lengths[own.y] - depth);
        let i_0 = meetings[i];
        let i_1 = meetings[i + 1u];
        let j_0 = meetings[j];
        let j_1 = meetings[j + 1u];
        if bitcast<u32>(i_1.z) != bitcast<u32>(j_1.z) {
            break;
        }
        let a = i_0.xyz;
        let b = vec3f(i_0.w, i_1.xy);
        sum += mat3x3f(a * j_0.x + b * j_0.w, a * j_0.y + b * j_1.x, a * j_0.z + b * j_1.y);
    }
    return sum;
}

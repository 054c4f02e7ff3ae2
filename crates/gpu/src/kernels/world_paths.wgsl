// Ways of contacts through the tree: responses of its joints to unit impulses along the rows of each contact, two tangents and the normal. An impulse acts on the tree only through the joints
// between it and the root, in whose coordinates C^T y the inverse of the tree's matrix is 1.

// Ways of the contacts: the contact of each, and the number of joints that it moves. Each contact has the way of its own number, and one of two fruit on different links a second one.
var<workgroup> way_contact: array<u32, MEETING_MOST_WAYS>;
var<workgroup> lengths: array<u32, MEETING_MOST_WAYS>;
var<workgroup> second_way: array<u32, MEETING_MOST_CONTACTS>;
// Number of joints, from the root on, that two ways share: up to the diagonal, row after row, two numbers a word.
var<workgroup> shared_steps: array<u32, (MEETING_MOST_WAYS * (MEETING_MOST_WAYS + 1u) / 2u + 1u) / 2u>;
var<private> ways: u32;

// Follows the unit impulses of a contact from its link to the root of the tree: y = S^T P, P - G y. Keeps C^T y, and sums up the free change of the
// contact's velocity, y e, with the joints' free change e = D^-1 y that the inward pass has left.
fn walk_tree(contact: u32) {
    let pair = contact_pair[contact];
    let p = place_of(contact);
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
    own_free = v * directions + of_rows;
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

// Gives contacts of fruit on different links a second way, and counts the ways. There is room for all: `choose_contacts` leaves out the others. A barrier at the end.
fn share_ways() -> u32 {
    let has_two = thread < contacts && goes_two_ways(contact_pair[thread]);
    let all = threads_with(has_two);
    let second = contacts + ones_before(all);
    if thread < contacts {
        way_contact[thread] = thread;
        second_way[thread] = select(NO_WAY, second, has_two);
    }
    if has_two {
        way_contact[second] = thread;
    }
    workgroupBarrier();
    return contacts + countOneBits(all);
}

// True if a pair is of two fruit on different links.
fn goes_two_ways(pair: u32) -> bool {
    return is_of_fruit(pair) && (row_word(first_of(pair)) >> 16u) != (row_word(second_of(pair)) >> 16u);
}

// Follows a way to the root; returns the velocity that the free changes of its joints add along the rows. The next joint is read ahead.
fn walk_on(way: u32, on: Walk) -> vec3f {
    var walk = on;
    var of_rows = on.of_rows;
    var steps = 0u;
    var next = joint_on(walk.segment);
    for (; walk.segment != NO_PARENT && steps < head(HEAD_DEPTH); steps++) {
        let joint = next;
        next = joint_on(joint.parent);
        let y_1 = joint.first * walk.torques;
        let y_2 = joint.second * walk.torques;
        of_rows += y_1 * joint.e.x + y_2 * joint.e.y;
        keep_path(way, steps, walk.segment, y_1 * joint.c.x + y_2 * joint.c.y, y_2 * joint.c.z);
        walk = passed_on(walk, joint, next.p, y_1, y_2);
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

// Columns: a vector by each number of another.
fn products(a: vec3f, b: vec3f) -> mat3x3f {
    return mat3x3f(a * b.x, a * b.y, a * b.z);
}

fn crossed(r: vec3f, columns: mat3x3f) -> mat3x3f {
    return mat3x3f(cross(r, columns[0]), cross(r, columns[1]), cross(r, columns[2]));
}

// Joint of the tree as the inward pass has left it: row, and segment of the parent; place and axes; C_11, C_21, C_22; free change of its rates; G = U D^-1 by axis.
struct TreeJoint {
    row: u32,
    parent: u32,
    p: vec3f,
    first: vec3f,
    second: vec3f,
    c: vec3f,
    e: vec2f,
    g_1n: vec3f,
    g_1f: vec3f,
    g_2n: vec3f,
    g_2f: vec3f,
}

// Joint of a segment; of none that of the first.
fn joint_on(segment: u32) -> TreeJoint {
    let word = row_word(select(segment, 0u, segment == NO_PARENT));
    let row = word & 0xffffu;
    let first = touch(row, TOUCH_FIRST);
    let second = touch(row, TOUCH_SECOND);
    let g_1n = works[work_at(row, WORK_G_1N)];
    let g_1f = works[work_at(row, WORK_G_1F)];
    let c = vec3f(first.w, touch(row, TOUCH_W).w, second.w);
    return TreeJoint(
        row, word >> 16u, touch(row, TOUCH_P).xyz, first.xyz, second.xyz, c, vec2f(g_1n.w, g_1f.w),
        g_1n.xyz, g_1f.xyz, works[work_at(row, WORK_G_2N)].xyz, works[work_at(row, WORK_G_2F)].xyz,
    );
}

// The impulses that the joint passes on, about the joint of the parent.
fn passed_on(walk: Walk, joint: TreeJoint, p_parent: vec3f, y_1: vec3f, y_2: vec3f) -> Walk {
    var on = walk;
    on.segment = joint.parent;
    on.torques -= products(joint.g_1n, y_1) + products(joint.g_2n, y_2);
    on.forces -= products(joint.g_1f, y_1) + products(joint.g_2f, y_2);
    on.torques += crossed(joint.p - p_parent, on.forces);
    return on;
}

fn keep_path(way: u32, step: u32, segment: u32, a: vec3f, b: vec3f) {
    let at = path_at(way, step);
    meetings[at] = vec4f(a, b.x);
    meetings[at + 1u] = vec4f(b.yz, bitcast<f32>(segment), 0.0);
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

// Of the joints that two ways share.
fn of_tree(own: vec2u) -> mat3x3f {
    var sum = mat3x3f(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    let most = common_steps(own.x, own.y);
    let i_end = path_at(own.x, lengths[own.x]);
    let j_end = path_at(own.y, lengths[own.y]);
    for (var depth = 1u; depth <= most; depth++) {
        let i = i_end - depth * (PATH_FIELDS / QUAD);
        let j = j_end - depth * (PATH_FIELDS / QUAD);
        let i_0 = meetings[i];
        let i_1 = meetings[i + 1u];
        let j_0 = meetings[j];
        let j_1 = meetings[j + 1u];
        let a = i_0.xyz;
        let b = vec3f(i_0.w, i_1.xy);
        sum += products(a, j_0.xyz) + products(b, vec3f(j_0.w, j_1.xy));
    }
    return sum;
}

// Number of joints that two ways share, from the root on.
fn common_steps(one: u32, other: u32) -> u32 {
    let pair = pair_at(max(one, other), min(one, other));
    return (shared_steps[pair / 2u] >> (16u * (pair % 2u))) & 0xffffu;
}

// Number of a pair among those up to the diagonal.
fn pair_at(row: u32, column: u32) -> u32 {
    return row * (row + 1u) / 2u + column;
}

// Finds the joints that each two ways share, by halving: those from the root to the joint where they part. A barrier at the end.
fn compare_ways() {
    storageBarrier();
    workgroupBarrier();
    let pairs = ways * (ways + 1u) / 2u;
    for (var word = thread; 2u * word < pairs; word += LANES) {
        var both = steps_of(block_of(2u * word));
        if 2u * word + 1u < pairs {
            both |= steps_of(block_of(2u * word + 1u)) << 16u;
        }
        shared_steps[word] = both;
    }
    workgroupBarrier();
}

// Number of joints that two ways share, as the segments of both tell.
fn steps_of(both: vec2u) -> u32 {
    var low = select(0u, lengths[both.x], both.x == both.y);
    var high = min(lengths[both.x], lengths[both.y]);
    while low < high {
        let middle = (low + high + 1u) / 2u;
        let is_shared = segment_at(both.x, middle) == segment_at(both.y, middle);
        low = select(low, middle, is_shared);
        high = select(middle - 1u, high, is_shared);
    }
    return low;
}

// Segment of a way, `depth` joints from the root counted from 1.
fn segment_at(way: u32, depth: u32) -> u32 {
    return bitcast<u32>(meetings[path_at(way, lengths[way] - depth) + 1u].z);
}

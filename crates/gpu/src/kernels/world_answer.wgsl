// Impulses of a world's contacts in a substep, and their effects. A workgroup is a world. The law and its solution are those of `orchard_multibody::contact`.

// The contacts: numbers of their colliders, place, normal, tangents, gap.
var<workgroup> contact_pair: array<u32, MEETING_MOST_CONTACTS>;
var<workgroup> contact_p: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> contact_n: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> tangents: array<array<vec3f, 2>, MEETING_MOST_CONTACTS>;
var<workgroup> contact_gap: array<f32, MEETING_MOST_CONTACTS>;
// Velocity of each contact without contacts: of the tree against the robot's present one, and what the robot's change adds.
var<workgroup> free_velocity: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> robot_free: array<f32, 3u * MEETING_MOST_CONTACTS>;
// The inverse inertia of the contacts: blocks of nine numbers, row after row, up to the diagonal.
var<workgroup> inertia: array<f32, MEETING_MOST_CONTACTS * (MEETING_MOST_CONTACTS + 1u) / 2u * 9u>;

// No second way.
const NO_WAY: u32 = 0xffffffffu;

// Number of contacts, the same in all threads.
var<private> contacts: u32;

// Solves the contacts, and hands their impulses on. Servos' limits and stuck joints are as in `solve_with_limits`.
@compute @workgroup_size(LANES)
fn answer(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) own_thread: u32) {
    thread = own_thread;
    enter_world(group.x);
    let runs = bitcast<u32>(worlds[world_at(WORLD_STOPPED)]) == 0u;
    contacts = shared_number(select(0u, bitcast<u32>(system(SYSTEM_CONTACTS)), runs));
    if contacts == 0u {
        return;
    }
    place_links();
    take_contacts();
    take_robot();
    ways = share_ways();
    if thread < contacts {
        walk_tree(thread);
    }
    compare_ways();
    for (var tries = 0u; tries <= 2u * ROBOT_ARM; tries++) {
        factor_robot();
        respond_robot();
        solve_contacts();
        if !move_robot() {
            break;
        }
    }
    hand_on();
}

// Reads the contacts that `meet` has found; a barrier at the end.
fn take_contacts() {
    if thread < contacts {
        let normal = meetings[contact_at(thread) + 1u];
        contact_pair[thread] = bitcast<u32>(meetings[contact_at(thread)].w);
        contact_n[thread] = normal.xyz;
        contact_gap[thread] = normal.w;
        contact_p[thread] = meetings[contact_at(thread) + 2u].xyz;
    }
    workgroupBarrier();
}

// A column of a matrix: a choice between numbers in registers.
fn column_of(m: mat3x3f, column: u32) -> vec3f {
    return select(select(m[2], m[1], column == 1u), m[0], column == 0u);
}

// Columns: two tangents and the normal. The first tangent is square to the axis that the normal is least along.
fn contact_frame(n: vec3f) -> mat3x3f {
    let size = abs(n);
    var least = select(0u, 1u, size.y < size.x);
    least = select(least, 2u, size.z < min(size.x, size.y));
    let first = normalize(cross(n, unit(least)));
    return mat3x3f(first, cross(n, first), n);
}

fn frame_of(contact: u32) -> mat3x3f {
    return mat3x3f(tangents[contact][0], tangents[contact][1], contact_n[contact]);
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
    return pair_at(row, column) * 9u;
}

// Fills the inverse inertia of the contacts, a block a thread. A barrier at the end.
fn assemble_inertia() {
    let blocks = contacts * (contacts + 1u) / 2u;
    for (var index = thread; index < blocks; index += LANES) {
        let own = block_of(index);
        // Columns are those of the block.
        let sum = of_robot(own) + of_all_fruit(own) + of_all_ways(own);
        let rows = transpose(sum);
        for (var row = 0u; row < 3u; row++) {
            let numbers = column_of(rows, row);
            let at = index * 9u + 3u * row;
            inertia[at] = numbers.x;
            inertia[at + 1u] = numbers.y;
            inertia[at + 2u] = numbers.z;
        }
    }
    workgroupBarrier();
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


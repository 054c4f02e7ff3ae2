// Impulses of a world's contacts in a substep, and their effects. A workgroup takes up one world after another, and solves it at its desk. The law and its solution are those of `orchard_multibody::contact`.

// The contacts: numbers of their colliders, normal, tangents.
var<workgroup> contact_pair: array<u32, MEETING_MOST_CONTACTS>;
var<workgroup> contact_n: array<vec3f, MEETING_MOST_CONTACTS>;
var<workgroup> tangents: array<array<vec3f, 2>, MEETING_MOST_CONTACTS>;
// What the robot's change adds to the velocity of each contact without contacts.
var<workgroup> robot_free: array<f32, 3u * MEETING_MOST_CONTACTS>;

// No second way.
const NO_WAY: u32 = 0xffffffffu;

// Number of contacts, the same in all threads.
var<private> contacts: u32;
// Gap of the thread's contact, and its velocity without contacts: of the tree against the robot's present one.
var<private> own_gap: f32;
var<private> own_free: vec3f;
// Impulse of the thread's contact if it is given, that of a suction cup [N s]; else 0.
var<private> own_given: f32;

// Takes up worlds until none is left. Which workgroup solves a world changes no bit of it.
@compute @workgroup_size(LANES)
fn answer(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) own_thread: u32) {
    thread = own_thread;
    desk = group.x;
    loop {
        var next = 0u;
        if thread == 0u {
            next = atomicAdd(&taken, 1u);
        }
        next = shared_number(next);
        if next >= robot.worlds {
            break;
        }
        enter_world(next);
        answer_contacts();
        // What lies on the desk has been read when the next world comes.
        storageBarrier();
        workgroupBarrier();
    }
}

// Solves the contacts of a world, and hands their impulses on. Servos' limits and stuck joints are as in `solve_with_limits`.
fn answer_contacts() {
    let runs = bitcast<u32>(worlds[world_at(WORLD_STOPPED)]) == 0u;
    contacts = shared_number(select(0u, bitcast<u32>(system(SYSTEM_CONTACTS)), runs));
    if contacts == 0u {
        return;
    }
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
        assemble_inertia();
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
        own_gap = normal.w;
        own_given = meetings[contact_at(thread) + 2u].w;
    }
    workgroupBarrier();
}

// Place of a contact.
fn place_of(contact: u32) -> vec3f {
    return meetings[contact_at(contact) + 2u].xyz;
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

// First of the three quads of a block of the contacts' inverse inertia, its columns; they lie `contacts` quads apart, so that threads whose rows follow each other read one line.
fn block_at(row: u32, column: u32) -> u32 {
    return blocks_at() + column * contacts * (BLOCK_FIELDS / QUAD) + row;
}

// Block of the inverse inertia of the contacts.
fn block(row: u32, column: u32) -> mat3x3f {
    let at = block_at(row, column);
    return mat3x3f(meetings[at].xyz, meetings[at + contacts].xyz, meetings[at + 2u * contacts].xyz);
}

fn set_block(row: u32, column: u32, own: mat3x3f) {
    let at = block_at(row, column);
    meetings[at] = vec4f(own[0], 0.0);
    meetings[at + contacts] = vec4f(own[1], 0.0);
    meetings[at + 2u * contacts] = vec4f(own[2], 0.0);
}

// Fills the inverse inertia of the contacts, a block and the one across the diagonal a thread. A barrier at the end.
fn assemble_inertia() {
    let blocks = contacts * (contacts + 1u) / 2u;
    for (var index = thread; index < blocks; index += LANES) {
        let own = block_of(index);
        let sum = of_robot(own) + of_all_fruit(own) + of_all_ways(own);
        set_block(own.x, own.y, sum);
        if own.x != own.y {
            set_block(own.y, own.x, transpose(sum));
        }
    }
    storageBarrier();
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
    let one = crossed(place_of(own.x) - centre, frame_of(own.x));
    let other = crossed(place_of(own.y) - centre, frame_of(own.y));
    return moved + transpose(one) * other * inverse_spin_inertia(row);
}


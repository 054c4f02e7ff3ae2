// Effects of the contacts' impulses on wood and fruit, and what the world keeps of them.

// Adds the impulses to what the outward pass starts from, and keeps them.
fn hand_on() {
    if thread < robot.dofs {
        keep_drive(thread, packed(own_joint.servo, own_joint.loss));
    }
    if thread < robot.dofs && thread % QUAD == 0u {
        meetings[system_at(SYSTEM_CHANGE + thread)] = vec4f(
            robot_change[thread], robot_change[thread + 1u], robot_change[thread + 2u], robot_change[thread + 3u],
        );
    }
    var longest = 0u;
    for (var way = 0u; way < ways; way++) {
        longest = max(longest, lengths[way]);
    }
    for (var index = thread; index < ways * longest; index += LANES) {
        let way = index / longest;
        let step = index % longest;
        if step < lengths[way] {
            add_to_joint(way, step);
        }
    }
    storageBarrier();
    for (var own = thread; own < place.fruits; own += LANES) {
        add_to_fruit(own, longest > 0u);
    }
    var on_wood = 0.0;
    if thread < contacts {
        let impulse = frame_of(thread) * impulses[thread];
        meetings[contact_at(thread)] = vec4f(impulse, bitcast<f32>(contact_pair[thread]));
        on_wood = select(0.0, length(impulse), first_of(contact_pair[thread]) < place.segments);
    }
    let sum = sum_of(vec2f(on_wood, 0.0)).x;
    if thread == 0u {
        var load = meetings[record_at() + 1u];
        load.x += sum;
        load.y = max(load.y, sum / robot.h);
        meetings[record_at() + 1u] = load;
    }
}

// Adds D^-1 y to the free change of a joint's rates, with the C^T y of all contacts on whose ways it lies; once, for the first way that passes it.
fn add_to_joint(way: u32, step: u32) {
    let depth = lengths[way] - step;
    for (var other = 0u; other < way; other++) {
        if common_steps(way, other) >= depth {
            return;
        }
    }
    var sum = vec2f(0.0);
    for (var other = way; other < ways; other++) {
        if common_steps(other, way) >= depth {
            let at = path_at(other, lengths[other] - depth);
            let a = meetings[at];
            let impulse = impulses[way_contact[other]];
            sum += vec2f(dot(a.xyz, impulse), dot(vec3f(a.w, meetings[at + 1u].xy), impulse));
        }
    }
    let at = path_at(way, step);
    let joint = joint_on(bitcast<u32>(meetings[at + 1u].z));
    let changes = vec2f(joint.c.x * sum.x, joint.c.y * sum.x + joint.c.z * sum.y);
    works[work_at(joint.row, WORK_G_1N)].w += changes.x;
    works[work_at(joint.row, WORK_G_1F)].w += changes.y;
    meetings[at] = vec4f(changes, 0.0, 0.0);
    works[touch_place(joint.row, TOUCH_PASSED)].w = bitcast<f32>(1u + way * head(HEAD_DEPTH) + step);
}

// Adds the impulses on a fruit. Its stem pulls it after its anchor's motion; where the anchor does not feel the fruit, only after the motion that the anchor has
// without contacts. One in the hand is turned as well; the way out takes the loss of spin off what is added here, too.
fn add_to_fruit(own: u32, moves_wood: bool) {
    let collider = place.segments + own;
    let word = row_word(collider);
    let row = word & 0xffffu;
    var sum = vec3f(0.0);
    var turn = vec3f(0.0);
    let p = fruit(row, FRUIT_P);
    for (var contact = 0u; contact < contacts; contact++) {
        let is_own = first_of(contact_pair[contact]) == collider;
        if is_own || second_of(contact_pair[contact]) == collider {
            let on_first = frame_of(contact) * impulses[contact];
            let one = select(-on_first, on_first, is_own);
            sum += one;
            turn += cross(place_of(contact) - p.xyz, one);
        }
    }
    if STEMS && !is_off_stem(row) {
        turn_rod(row, sum, turn);
    } else if is_off_stem(row) {
        fruits[fruit_at(row, FRUIT_ARM)] += vec4f(turn * (inverse_spin_inertia(row) * spin_divisor()), 0.0);
    } else if moves_wood && fruit(row, FRUIT_REACTION).w == 0.0 && bitcast<u32>(p.w) == 0u {
        sum -= stem_mass(row) * anchor_change(row, word >> 16u);
    }
    if any(sum != vec3f(0.0)) {
        fruits[fruit_at(row, FRUIT_IMPULSE)] += vec4f(sum, 0.0);
    }
}

// Change of an anchor's velocity by the contacts.
fn anchor_change(row: u32, segment: u32) -> vec3f {
    let axes = mat3x3f(unit(0u), unit(1u), unit(2u));
    var walk = Walk(crossed(fruit(row, FRUIT_ARM).xyz, axes), axes, segment, vec3f(0.0), vec3f(0.0), true);
    var change_of_anchor = vec3f(0.0);
    var next = joint_on(segment);
    for (var steps = 0u; walk.segment != NO_PARENT && steps < head(HEAD_DEPTH); steps++) {
        let joint = next;
        next = joint_on(joint.parent);
        let y_1 = joint.first * walk.torques;
        let y_2 = joint.second * walk.torques;
        let passed = bitcast<u32>(touch(joint.row, TOUCH_PASSED).w);
        if passed != 0u {
            let changes = meetings[path_at(0u, passed - 1u)];
            change_of_anchor += y_1 * changes.x + y_2 * changes.y;
        }
        walk = passed_on(walk, joint, next.p, y_1, y_2);
    }
    return change_of_anchor;
}

// Effects of the contacts' impulses on the robot, wood and fruit, and what the world keeps of them.

// Changes of the robot's velocities; true in the first thread if a joint has exceeded what its servo or its friction holds, so that the substep is solved again.
fn move_robot() -> bool {
    let is_joint = thread < robot.dofs;
    var rest = 0.0;
    if is_joint {
        rest = robot_rest[thread];
        for (var row = 0u; row < 3u * contacts; row++) {
            rest += meetings[response_at(row) + thread / QUAD][thread % QUAD] * impulses[row / 3u][row % 3u];
        }
    }
    for (var left = robot.dofs; left > 0u; left--) {
        let i = left - 1u;
        if thread == i {
            robot_change[i] = rest * pivots[i];
        }
        workgroupBarrier();
        if thread < i {
            rest -= factor[entry(i, thread)] * robot_change[i];
        }
    }
    var is_capped = false;
    if is_joint {
        change[thread] = robot_change[thread];
        for (var joint = 0u; joint < robot.arm_joints; joint++) {
            if robot.arm[joint].dof == thread {
                is_capped = cap_joint(robot.arm[joint]);
            }
        }
    }
    return before_and_all(select(0u, 1u, is_capped)).y > 0u;
}

// Adds the impulses to what the outward pass starts from, and keeps them.
fn hand_on() {
    if thread < robot.dofs {
        keep_drive(thread);
    }
    if thread < robot.dofs && thread % QUAD == 0u {
        meetings[system_at(SYSTEM_CHANGE + thread)] = vec4f(
            robot_change[thread], robot_change[thread + 1u], robot_change[thread + 2u], robot_change[thread + 3u],
        );
    }
    for (var way = 0u; way < ways; way++) {
        for (var step = thread; step < lengths[way]; step += LANES) {
            add_to_joint(way, step);
        }
    }
    storageBarrier();
    for (var own = thread; own < place.fruits; own += LANES) {
        add_to_fruit(own);
    }
    var on_wood = 0.0;
    if thread < contacts {
        let impulse = frame_of(thread) * impulses[thread];
        let at = contact_at(thread);
        meetings[at] = vec4f(impulse, bitcast<f32>(contact_pair[thread]));
        meetings[at + 1u] = vec4f(contact_n[thread], contact_gap[thread]);
        meetings[at + 2u] = vec4f(contact_p[thread], 0.0);
        on_wood = select(0.0, length(impulse), first_of(contact_pair[thread]) < place.segments);
    }
    let sum = sum_of(vec4f(on_wood, 0.0, 0.0, 0.0)).x;
    if thread == 0u {
        var load = meetings[record_at() + 1u];
        load.x += sum;
        load.y = max(load.y, sum / robot.h);
        load.w = bitcast<f32>(contacts);
        meetings[record_at() + 1u] = load;
    }
}

// Place of the joint of a segment, `depth` joints from the root counted from 1, on a way; -1 if it does not pass it.
fn step_on(way: u32, depth: u32, segment: u32) -> i32 {
    if depth > lengths[way] {
        return -1;
    }
    let step = lengths[way] - depth;
    return select(-1, i32(step), bitcast<u32>(meetings[path_at(way, step) + 1u].z) == segment);
}

// C^T y of a joint under the impulses of all contacts on whose ways, from `first` on, it lies.
fn pressed(first: u32, depth: u32, segment: u32) -> vec2f {
    var sum = vec2f(0.0);
    for (var way = first; way < ways; way++) {
        let step = step_on(way, depth, segment);
        if step >= 0 {
            let at = path_at(way, u32(step));
            let contact = way_contact[way];
            let a = meetings[at];
            sum += vec2f(dot(a.xyz, impulses[contact]), dot(vec3f(a.w, meetings[at + 1u].xy), impulses[contact]));
        }
    }
    return sum;
}

// Adds D^-1 y to the free change of a joint's rates, once for the first way that passes it.
fn add_to_joint(way: u32, step: u32) {
    let depth = lengths[way] - step;
    let segment = bitcast<u32>(meetings[path_at(way, step) + 1u].z);
    for (var other = 0u; other < way; other++) {
        if step_on(other, depth, segment) >= 0 {
            return;
        }
    }
    let sum = pressed(way, depth, segment);
    let row = row_word(segment) & 0xffffu;
    let c = joint_of(row).c;
    works[work_at(row, WORK_G_1N)].w += c.x * sum.x;
    works[work_at(row, WORK_G_1F)].w += c.y * sum.x + c.z * sum.y;
}

// Adds the impulses on a fruit. Its stem pulls it after its anchor's motion; where the anchor does not feel the fruit, only after the motion that the anchor has
// without contacts. One in the hand is turned as well; the way out takes the loss of spin off what is added here, too.
fn add_to_fruit(own: u32) {
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
            turn += cross(contact_p[contact] - p.xyz, one);
        }
    }
    if STEMS && !is_off_stem(row) {
        turn_rod(row, sum, turn);
    } else if is_off_stem(row) {
        fruits[fruit_at(row, FRUIT_ARM)] += vec4f(turn * (inverse_spin_inertia(row) * spin_divisor()), 0.0);
    } else if fruit(row, FRUIT_REACTION).w == 0.0 && bitcast<u32>(p.w) == 0u {
        sum -= stem_mass(row) * anchor_change(row, word >> 16u);
    }
    if any(sum != vec3f(0.0)) {
        fruits[fruit_at(row, FRUIT_IMPULSE)] += vec4f(sum, 0.0);
    }
}

// Change of an anchor's velocity by the contacts.
fn anchor_change(row: u32, segment: u32) -> vec3f {
    let axes = mat3x3f(unit(0u), unit(1u), unit(2u));
    var depth = 0u;
    for (var above = segment; above != NO_PARENT && depth < head(HEAD_DEPTH); depth++) {
        above = row_word(above) >> 16u;
    }
    var walk = Walk(crossed(fruit(row, FRUIT_ARM).xyz, axes), axes, segment, vec3f(0.0), vec3f(0.0), true);
    var change_of_anchor = vec3f(0.0);
    for (; walk.segment != NO_PARENT && depth > 0u; depth--) {
        let own = row_word(walk.segment);
        let joint = joint_of(own & 0xffffu);
        let y_1 = joint.first * walk.torques;
        let y_2 = joint.second * walk.torques;
        let sum = pressed(0u, depth, walk.segment);
        change_of_anchor += (y_1 * joint.c.x + y_2 * joint.c.y) * sum.x + y_2 * joint.c.z * sum.y;
        walk = passed_on(walk, own, joint, y_1, y_2);
    }
    return change_of_anchor;
}

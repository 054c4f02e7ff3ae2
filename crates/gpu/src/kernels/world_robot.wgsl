// The two halves of a robot's substep, before and after its contacts. A thread is a world.

// Sets up the system of a substep; at the start of a frame, a world stops if its command is not finite or its tree has stopped, and its tree with it.
@compute @workgroup_size(LANES)
fn robot_begin(@builtin(workgroup_id) block: vec3u, @builtin(local_invocation_index) thread: u32) {
    let index = block.x * LANES + thread;
    if index == 0u {
        atomicStore(&taken, 0u);
    }
    if index >= robot.worlds {
        return;
    }
    load_world(block.x, thread);
    enter_world(index);
    if is_held() {
        return;
    }
    if rules.substep == 0u {
        begin_frame();
    }
    if bits(ROBOT_STOPPED) == 0u {
        begin_robot(f32(rules.substeps - 1u - rules.substep) * robot.h);
        keep_system();
        begin_cup();
        solve_with_limits();
        keep_solution();
    }
    store_world(block.x, thread);
}

// True if the world stands in its lane.
fn is_held() -> bool {
    return bitcast<u32>(worlds[world_at(WORLD_STOPPED)]) == WORLD_HELD;
}

fn begin_frame() {
    set_bits(ROBOT_FRAME, bits(ROBOT_FRAME) + 1u);
    if bits(ROBOT_STOPPED) == 0u {
        if bitcast<u32>(worlds[world_at(WORLD_STOPPED)]) != 0u {
            quarantine(ROBOT_OF_TREE);
        } else if !command_is_finite() {
            quarantine(ROBOT_DOFS);
        }
    }
    stop_tree();
}

// Stops the tree of a robot that has stopped.
fn stop_tree() {
    let at = world_at(WORLD_STOPPED);
    if bits(ROBOT_STOPPED) != 0u && bitcast<u32>(worlds[at]) == 0u {
        worlds[at] = state[ROBOT_STOPPED];
    }
}

fn keep_system() {
    for (var row = 0u; row < robot.dofs; row++) {
        for (var column = row / QUAD * QUAD; column < robot.dofs; column += QUAD) {
            let at = entry(row, column);
            meetings[system_at(SYSTEM_MATRIX + at)] = vec4f(matrix[at], matrix[at + 1u], matrix[at + 2u], matrix[at + 3u]);
        }
        keep_drive(row, packed(servos[row], losses[row]));
    }
    for (var dof = 0u; dof < robot.dofs; dof += QUAD) {
        meetings[system_at(SYSTEM_IMPULSE + dof)] = vec4f(impulse[dof], impulse[dof + 1u], impulse[dof + 2u], impulse[dof + 3u]);
    }
    keep_links();
}

// Servo and losses of a joint, as they are kept.
fn packed(own: Servo, loss: Loss) -> array<vec4f, 2> {
    return array(vec4f(own.stiffness, own.damping, own.rest, own.torque), vec4f(loss.torque, loss.damping, loss.stuck, 0.0));
}

fn keep_drive(dof: u32, drive: array<vec4f, 2>) {
    meetings[system_at(SYSTEM_SERVO + QUAD * dof)] = drive[0];
    meetings[system_at(SYSTEM_LOSS + QUAD * dof)] = drive[1];
}

// Keeps the solution without contacts, with the limits that servos and friction have met.
fn keep_solution() {
    for (var dof = 0u; dof < robot.dofs; dof += QUAD) {
        meetings[system_at(SYSTEM_CHANGE + dof)] = vec4f(change[dof], change[dof + 1u], change[dof + 2u], change[dof + 3u]);
    }
    for (var joint = 0u; joint < robot.arm_joints; joint++) {
        let dof = robot.arm[joint].dof;
        let drive = packed(servos[dof], losses[dof]);
        let at = SYSTEM_LIMITED + 2u * QUAD * joint;
        meetings[system_at(at)] = drive[0];
        meetings[system_at(at + QUAD)] = drive[1];
    }
}

// Puts the drives of the solution without contacts in the place of those that it started from.
fn take_limits() {
    for (var joint = 0u; joint < robot.arm_joints; joint++) {
        let dof = robot.arm[joint].dof;
        let at = SYSTEM_LIMITED + 2u * QUAD * joint;
        meetings[system_at(SYSTEM_SERVO + QUAD * dof)] = meetings[system_at(at)];
        meetings[system_at(SYSTEM_LOSS + QUAD * dof)] = meetings[system_at(at + QUAD)];
    }
}

// Keeps the motion of the links, in the world.
fn keep_links() {
    var origins: array<vec3f, ROBOT_DOFS>;
    var velocities: array<vec3f, ROBOT_DOFS>;
    for (var j = 0u; j < robot.dofs; j++) {
        var p = r_parent[j];
        var u = vec3f(0.0);
        if robot.links[j].parent >= 0 {
            let parent = u32(robot.links[j].parent);
            p += origins[parent];
            u = velocities[parent] + cross(omega[parent], r_parent[j]);
        }
        if robot.links[j].slides != 0u {
            u += link_z[j] * v(j);
        }
        origins[j] = p;
        velocities[j] = u;
        let at = SYSTEM_LINK + SYSTEM_LINK_FIELDS * j;
        meetings[system_at(at)] = vec4f(place.p + in_world(p), 0.0);
        meetings[system_at(at + 4u)] = vec4f(in_world(link_y[j]), 0.0);
        meetings[system_at(at + 8u)] = vec4f(in_world(link_z[j]), 0.0);
        meetings[system_at(at + 12u)] = vec4f(in_world(omega[j]), 0.0);
        meetings[system_at(at + 16u)] = vec4f(in_world(u), 0.0);
    }
}

// Moves the joints by the changes that are kept: those without contacts, or those that the contacts have left.
@compute @workgroup_size(LANES)
fn robot_end(@builtin(workgroup_id) block: vec3u, @builtin(local_invocation_index) thread: u32) {
    let index = block.x * LANES + thread;
    if index >= robot.worlds {
        return;
    }
    load_world(block.x, thread);
    enter_world(index);
    if bits(ROBOT_STOPPED) != 0u || is_held() {
        return;
    }
    for (var dof = 0u; dof < robot.dofs; dof += QUAD) {
        let four = meetings[system_at(SYSTEM_CHANGE + dof)];
        for (var k = 0u; k < QUAD; k++) {
            change[dof + k] = four[k];
        }
    }
    move_joints();
    if rules.substep + 1u == rules.substeps {
        if bitcast<u32>(system(SYSTEM_CONTACTS)) == 0u {
            take_limits();
        }
        test_robot();
        stop_tree();
    }
    store_world(block.x, thread);
}

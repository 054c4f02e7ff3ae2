// The robot under its contacts: its answer to impulses, by the Cholesky factor L of its matrix.

// L of the robot below the diagonal and the inverses of its diagonal; L^-1 of the impulses on the joints.
var<workgroup> factor: array<f32, ROBOT_DOFS * ROBOT_DOFS>;
var<workgroup> pivots: array<f32, ROBOT_DOFS>;
var<workgroup> robot_rest: array<f32, ROBOT_DOFS>;
var<workgroup> robot_change: array<f32, ROBOT_DOFS>;

// The thread's joint, and its number among those of the arm; -1 if it is none of them.
var<private> own_joint: Driven;
var<private> own_arm: i32;

// Reads the thread's joint.
fn take_robot() {
    own_arm = -1;
    if thread < robot.dofs {
        let servo = meetings[system_at(SYSTEM_SERVO + QUAD * thread)];
        let loss = meetings[system_at(SYSTEM_LOSS + QUAD * thread)];
        own_joint = Driven(
            state_of(ROBOT_Q + thread), state_of(ROBOT_V + thread),
            system(SYSTEM_IMPULSE + thread), system(SYSTEM_MATRIX + entry(thread, thread)),
            Servo(servo.x, servo.y, servo.z, servo.w), Loss(loss.x, loss.y, loss.z),
        );
        for (var joint = 0u; joint < robot.arm_joints; joint++) {
            if robot.arm[joint].dof == thread {
                own_arm = i32(joint);
            }
        }
    }
}

// A number of the world's robot.
fn state_of(field: u32) -> f32 {
    return robots[robot_at(world_index / LANES, world_index % LANES, field / QUAD)][field % QUAD];
}

// Factors the robot's matrix, a row a thread, under the present servos; starts with what its joints change without contacts. A barrier at the end.
fn factor_robot() {
    let is_joint = thread < robot.dofs;
    var rest = 0.0;
    if is_joint {
        let own = driven(own_joint);
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
        let direction = column_of(frame_of(contact), row % 3u);
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
                let torque = cross(place_of(contact) - on.p, force);
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

fn of_robot(own: vec2u) -> mat3x3f {
    var sum = mat3x3f(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    for (var quad = 0u; quad < (robot.dofs + 3u) / QUAD; quad++) {
        let rows = responses(own.x, quad);
        let columns = responses(own.y, quad);
        sum += mat3x3f(columns[0] * rows, columns[1] * rows, columns[2] * rows);
    }
    return sum;
}

// Four numbers of the responses to the three rows of a contact.
fn responses(contact: u32, quad: u32) -> mat3x4f {
    let at = 3u * contact;
    return mat3x4f(meetings[response_at(at) + quad], meetings[response_at(at + 1u) + quad], meetings[response_at(at + 2u) + quad]);
}

// Changes of the robot's velocities; true if a joint has exceeded what its servo or its friction holds, so that the substep is solved again.
fn move_robot() -> bool {
    let is_joint = thread < robot.dofs;
    var rest = 0.0;
    if is_joint {
        rest = robot_rest[thread];
        for (var contact = 0u; contact < contacts; contact++) {
            let four = responses(contact, thread / QUAD) * impulses[contact];
            rest += four[thread % QUAD];
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
    if own_arm >= 0 {
        let own = limited(robot.arm[own_arm], own_joint, robot_change[thread]);
        own_joint.servo = own.servo;
        own_joint.loss = own.loss;
        is_capped = own.is_capped;
    }
    return threads_with(is_capped) != 0u;
}

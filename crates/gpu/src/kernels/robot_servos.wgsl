// Servos of a robot: the law of `orchard_robot::Servos`, with the same names. Set points are in the state.

// Drive of a degree of freedom in a substep: `stiffness (rest - q') - damping v' + torque` with q' and v' at its end.
struct Servo {
    stiffness: f32,
    damping: f32,
    rest: f32,
    torque: f32,
}

// What a drivetrain takes: `torque - damping v'`, and `-stuck v' / creep` where its Coulomb friction `stuck` holds the joint.
struct Loss {
    torque: f32,
    damping: f32,
    stuck: f32,
}

var<private> servos: array<Servo, ROBOT_DOFS>;
var<private> losses: array<Loss, ROBOT_DOFS>;
// Of each joint of the arm: the torque that holds it against gravity, and the inertia that it moves with all others locked.
var<private> holding: array<f32, ROBOT_ARM>;
var<private> reflected: array<f32, ROBOT_ARM>;

// A magnitude with the sign of a number.
fn with_sign(magnitude: f32, of_number: f32) -> f32 {
    return select(magnitude, -magnitude, of_number < 0.0);
}

fn toward(start: f32, end: f32, step: f32) -> f32 {
    return start + clamp(end - start, -step, step);
}

fn capped(force: vec2f, most: f32) -> vec2f {
    let size = length(force);
    return select(force, force * (most / size), size > most);
}

fn constant_effort(torque: f32) -> Servo {
    return Servo(0.0, 0.0, 0.0, torque);
}

// Largest speed for a step of length `dt` from which a joint that brakes with `deceleration` stops within the distance `way`.
fn stopping_speed(way: f32, deceleration: f32, dt: f32) -> f32 {
    if way <= 0.0 {
        return way / dt;
    }
    let quantum = deceleration * dt * dt;
    let steps = floor((sqrt(1.0 + 8.0 * way / quantum) - 1.0) * 0.5);
    return (way + 0.5 * quantum * steps * (steps + 1.0)) / ((steps + 1.0) * dt);
}

// Range of velocities that a joint at (q, v) may have in a step: `limits` are the ends of its range and its largest speed.
fn velocity_range(at: f32, speed: f32, limits: vec3f, acceleration: f32, dt: f32) -> vec2f {
    let highest = min(stopping_speed(limits.y - at, acceleration, dt), limits.z);
    let lowest = -min(stopping_speed(at - limits.x, acceleration, dt), limits.z);
    let step = acceleration * dt;
    return min(max(vec2f(lowest, highest), vec2f(speed - step)), vec2f(speed + step));
}

// A servo with position gain and velocity gain on the joint `dof`, which moves `inertia`; beyond its limit, as foreseen, it exerts the limit.
fn servo(dof: u32, inertia: f32, gains: vec2f, wanted: f32, feed_forward: f32, limit: f32) -> Servo {
    let h = robot.h;
    let demand = gains.x * (wanted - q(dof) - h * v(dof)) - gains.y * v(dof);
    let predicted = feed_forward + demand / (1.0 + h * (gains.y + h * gains.x) / inertia);
    if abs(predicted) <= limit {
        return Servo(gains.x, gains.y, wanted, feed_forward);
    }
    return constant_effort(with_sign(limit, predicted));
}

// Sets servos and losses of a substep, after which `remaining` is left of the frame [s].
fn drive_servos(remaining: f32) {
    for (var dof = 0u; dof < robot.dofs; dof++) {
        servos[dof] = constant_effort(0.0);
        losses[dof] = Loss(0.0, 0.0, 0.0);
    }
    if robot.base == DRIVE_RAIL {
        drive_rail();
    } else if robot.base != DRIVE_FIXED {
        steer();
        drive_base();
    }
    if robot.height_dof >= 0 {
        let height = command[COMMAND_HEIGHT] - command[COMMAND_CLIMB] * remaining;
        servos[u32(robot.height_dof)] = Servo(robot.height_stiffness, robot.height_damping, height, robot.height_force);
    }
    for (var joint = 0u; joint < robot.arm_joints; joint++) {
        drive_arm(joint, remaining);
    }
    for (var finger = 0u; finger < robot.fingers; finger++) {
        drive_finger(finger);
    }
}

fn commanded_base() -> vec3f {
    return vec3f(command[COMMAND_BASE], command[COMMAND_BASE + 1u], command[COMMAND_BASE + 2u]);
}

fn base_target() -> vec3f {
    return vec3f(state[ROBOT_BASE_TARGET], state[ROBOT_BASE_TARGET + 1u], state[ROBOT_BASE_TARGET + 2u]);
}

// The velocity nearest to a wanted one that the steering allows.
fn allowed(wanted: vec3f) -> vec3f {
    if robot.base == DRIVE_HOLONOMIC {
        return wanted;
    }
    if robot.base == DRIVE_DIFFERENTIAL {
        return vec3f(wanted.x, 0.0, wanted.z);
    }
    let most = abs(wanted.x) / robot.turning_radius;
    return vec3f(wanted.x, 0.0, clamp(wanted.z, -most, most));
}

// Moves the velocity set point of a base on wheels.
fn steer() {
    let wanted = allowed(commanded_base());
    let speed = vec2f(robot.travel.speed);
    let now = base_target();
    let missing = clamp(wanted.xy, -speed, speed) - now.xy;
    let yaw_rate = clamp(wanted.z, -robot.turn.speed, robot.turn.speed);
    let next = allowed(vec3f(
        now.xy + capped(missing, robot.travel.acceleration * robot.h),
        toward(now.z, yaw_rate, robot.turn.acceleration * robot.h),
    ));
    for (var k = 0u; k < 3u; k++) {
        state[ROBOT_BASE_TARGET + k] = next[k];
    }
}

// Drives a base on wheels: degrees of freedom 0 and 1 are along the axes of odom, 2 is the yaw.
fn drive_base() {
    let next = base_target();
    let heading = sin_cos(q(2u));
    let along = vec2f(heading.y * next.x - heading.x * next.y, heading.x * next.x + heading.y * next.y);
    let travel = robot.travel.damping / (1.0 + robot.h * robot.travel.damping / robot.base_mass);
    let force = capped((along - vec2f(v(0u), v(1u))) * travel, robot.travel.effort);
    let turn = robot.turn.damping / (1.0 + robot.h * robot.turn.damping / robot.yaw_inertia);
    let torque = clamp((next.z - v(2u)) * turn, -robot.turn.effort, robot.turn.effort);
    servos[0] = constant_effort(force.x);
    servos[1] = constant_effort(force.y);
    servos[2] = constant_effort(torque);
}

// Drives a base along its rail, degree of freedom 0.
fn drive_rail() {
    let wanted = dot(commanded_base().xy, vec2f(robot.rail_x, robot.rail_y));
    let limits = vec3f(robot.rail_lower, robot.rail_upper, robot.rail_velocity);
    let range = velocity_range(q(0u), base_target().x, limits, robot.travel.acceleration, robot.h);
    let speed = min(max(wanted, range.x), range.y);
    state[ROBOT_BASE_TARGET] = speed;
    let factor = robot.travel.damping / (1.0 + robot.h * robot.travel.damping / robot.base_mass);
    let force = (speed - v(0u)) * factor;
    servos[0] = constant_effort(clamp(force, -robot.travel.effort, robot.travel.effort));
}

// Bodies of the arm as its servos take them: with the fingers at their start.
fn weigh_arm() {
    let gravity = vec3f(0.0, 0.0, -robot.gravity);
    var outer: Body;
    for (var k = robot.arm_joints; k > 0u; ) {
        k--;
        let link = robot.arm[k].dof;
        if k + 1u == robot.arm_joints {
            let axes = axes_of_link(link);
            outer = body_of(robot.wrist.mass, axes * robot.wrist.p_com, turned(robot.wrist, axes));
        } else {
            outer = joined(bodies[link], shifted(outer, r_parent[robot.arm[k + 1u].dof]));
        }
        let z = link_z[link];
        holding[k] = -dot(z, cross(outer.moment, gravity));
        reflected[k] = dot(z, symmetric_matrix(outer.diagonal, outer.products) * z);
    }
}

// Moves the set point of a joint of the arm, and drives the joint.
fn drive_arm(joint: u32, remaining: f32) {
    let arm = robot.arm[joint];
    let h = robot.h;
    let acceleration = robot.arm_acceleration;
    var next = state[ROBOT_ARM_TARGET + joint];
    let passing = clamp(command[COMMAND_ARM_V + joint], -arm.velocity, arm.velocity);
    let wanted = clamp(command[COMMAND_ARM_Q + joint] - passing * remaining, arm.lower, arm.upper);
    // Offset from the motion that passes the commanded position at this speed.
    let off = wanted - passing * h - next;
    let limits = vec3f(arm.lower, arm.upper, arm.velocity);
    let range = velocity_range(next, state[ROBOT_ARM_RATE + joint], limits, acceleration, h);
    let speed = passing + with_sign(stopping_speed(abs(off), acceleration, h), off);
    let rate = min(max(speed, range.x), range.y);
    next = clamp(next + rate * h, arm.lower, arm.upper);
    state[ROBOT_ARM_TARGET + joint] = next;
    state[ROBOT_ARM_RATE + joint] = rate;

    let dof = arm.dof;
    let inertia = reflected[joint] + arm.armature;
    let gains = vec2f(robot.arm_stiffness, robot.arm_damping);
    let drive = servo(dof, inertia, gains, next, holding[joint] * robot.gravity_share, arm.effort);
    servos[dof] = drive;
    losses[dof] = drivetrain_loss(arm, inertia, drive, -holding[joint]);
}

// Foresees what the drivetrain of a joint takes, under its servo and a known load.
fn drivetrain_loss(arm: ArmJoint, inertia: f32, drive: Servo, load: f32) -> Loss {
    let h = robot.h;
    let rotor = arm.armature / h;
    var loss = Loss(rotor * v(arm.dof), rotor + arm.viscous, 0.0);
    if arm.coulomb > 0.0 {
        let effort = drive.stiffness * (drive.rest - q(arm.dof)) + drive.torque + load;
        let momentum = inertia * v(arm.dof) + h * effort;
        if abs(momentum) <= h * arm.coulomb {
            loss.stuck = arm.coulomb;
        } else {
            loss.torque -= with_sign(arm.coulomb, momentum);
        }
    }
    return loss;
}

// Enforces the limits of the arm's servos and of friction that holds a joint; true if the substep must be solved again.
fn cap_overshoot() -> bool {
    var is_capped = false;
    for (var joint = 0u; joint < robot.arm_joints; joint++) {
        is_capped |= cap_joint(robot.arm[joint]);
    }
    return is_capped;
}

fn cap_joint(arm: ArmJoint) -> bool {
    let own = limited(arm, joint_driven(arm.dof), change[arm.dof]);
    servos[arm.dof] = own.servo;
    losses[arm.dof] = own.loss;
    return own.is_capped;
}

// Servo and losses of a joint whose velocity changes, with their limits; `is_capped` if they have changed.
struct Limited {
    servo: Servo,
    loss: Loss,
    is_capped: bool,
}

fn limited(arm: ArmJoint, own: Driven, change_of_v: f32) -> Limited {
    var of_joint = Limited(own.servo, own.loss, false);
    let v_end = own.v + change_of_v;
    let q_end = own.q + robot.h * v_end;
    let exerted = own.servo.stiffness * (own.servo.rest - q_end) - own.servo.damping * v_end + own.servo.torque;
    if abs(exerted) > arm.effort {
        of_joint.servo = constant_effort(with_sign(arm.effort, exerted));
        of_joint.is_capped = true;
    }
    if own.loss.stuck > 0.0 && abs(v_end) > robot.creep {
        of_joint.loss = Loss(own.loss.torque - with_sign(own.loss.stuck, v_end), own.loss.damping, 0.0);
        of_joint.is_capped = true;
    }
    return of_joint;
}

// Opening of a finger and its slope, at a position of its driving joint; beyond its range the curve goes on straight.
fn opening(index: u32, at: f32) -> vec2f {
    let finger = robot.finger[index];
    if finger.turns == 0u {
        return vec2f(at, 1.0);
    }
    let place = (at - finger.start) / finger.step;
    let interval = clamp(i32(floor(place)), 0, i32(CURVE_INTERVALS) - 1);
    let ends = robot.curves[index][interval];
    let u = place - f32(interval);
    if u < 0.0 {
        return vec2f(ends.x + ends.y * (u * finger.step), ends.y);
    }
    if u > 1.0 {
        return vec2f(ends.z + ends.w * ((u - 1.0) * finger.step), ends.w);
    }
    let rise = ends.yw * finger.step;
    let w = 1.0 - u;
    return vec2f(
        w * w * ((1.0 + 2.0 * u) * ends.x + u * rise.x) + u * u * ((1.0 + 2.0 * w) * ends.z - w * rise.y),
        6.0 * u * w * (ends.z - ends.x) / finger.step + w * (1.0 - 3.0 * u) * ends.y + u * (1.0 - 3.0 * w) * ends.w,
    );
}

// Moves the set point of a finger's opening, and drives its joint through the lever of its pad.
fn drive_finger(index: u32) {
    let finger = robot.finger[index];
    let limit = min(max(command[COMMAND_FINGER_FORCE], 0.0), robot.finger_force);
    let now = opening(index, q(finger.dof));
    let wanted = clamp(command[COMMAND_FINGER_Q], finger.lower, finger.upper);
    let next = toward(state[ROBOT_FINGER_TARGET + index], wanted, robot.finger_speed * robot.h);
    // Against an object the set point stops where it exerts the limit, so that opening is prompt.
    let reach = limit / robot.finger_stiffness;
    let held = clamp(min(max(next, now.x - reach), now.x + reach), finger.lower, finger.upper);
    state[ROBOT_FINGER_TARGET + index] = held;
    var rest = held;
    if finger.turns != 0u {
        rest = q(finger.dof) + (held - now.x) / now.y;
    }
    let gains = vec2f(robot.finger_stiffness, robot.finger_damping) * (now.y * now.y);
    servos[finger.dof] = servo(finger.dof, finger.inertia, gains, rest, 0.0, limit * abs(now.y));
}

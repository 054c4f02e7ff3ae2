// Robots, one thread a world: memory, and the step of a frame. The law of the servos is that of `orchard_robot::Servos`, that of the step
// that of `orchard_multibody::step`; `robots/table.rs` makes the table.

// A link and its joint. The joint turns about, or slides along, the link's z axis.
struct Link {
    // Place of the joint in the parent's frame [m].
    p_parent: vec3f,
    // Index of the parent; -1 is the ground.
    parent: i32,
    // Axes of the link in the parent's frame, with the joint at 0.
    y_parent: vec3f,
    slides: u32,
    z_parent: vec3f,
    inertia: Inertia,
}

// Mass [kg], centre of mass [m], and inertia about it [kg m^2] by its diagonal and by xy, xz, yz.
struct Inertia {
    p_com: vec3f,
    mass: f32,
    diagonal: vec3f,
    products: vec3f,
}

// A joint of the arm: limits and drivetrain.
struct ArmJoint {
    lower: f32,
    upper: f32,
    velocity: f32,
    effort: f32,
    armature: f32,
    coulomb: f32,
    viscous: f32,
    dof: u32,
}

// A spring-damper that holds q[a] = ratio q[b].
struct Coupling {
    a: u32,
    b: u32,
    ratio: f32,
    stiffness: f32,
    // Elements of a uniform array begin at multiples of 16 bytes.
    @size(16) damping: f32,
}

// A finger: its driving joint, the range of its openings [m], and the inertia that the joint moves.
struct Finger {
    dof: u32,
    lower: f32,
    upper: f32,
    inertia: f32,
    // 1 if the joint turns: its opening is then a curve of its position, from `start` on in intervals of `step`.
    turns: u32,
    start: f32,
    @size(8) step: f32,
}

// A servo that holds a velocity.
struct Drive {
    damping: f32,
    effort: f32,
    speed: f32,
    acceleration: f32,
}

// A suction cup on a link; without one, a cup without points. Its law is in `world_cup.wgsl`.
struct Cup {
    points: u32,
    link: i32,
    // Its first point among the robot's colliders.
    first: u32,
    // Radius of the lip, and half its thickness [m].
    radius: f32,
    half_thickness: f32,
    // Distance that the lip bends to stay on a fruit, radius below which a fruit folds it, and gap that a leaf leaves [m].
    follow: f32,
    curve_radius_min: f32,
    leaf_gap: f32,
    // Vacuum of the pump [Pa], open area at which half of it is left [m^2], time in which it builds up [s].
    vacuum_max: f32,
    leak_half: f32,
    rise_time: f32,
    // Area within the lip [m^2].
    area: f32,
    // Centre of the lip on the link [m], and length of the lip between two points [m].
    p_link: vec3f,
    spacing: f32,
    // First and third axis of the lip's frame on the link; the third is the cup's.
    x_link: vec3f,
    z_link: vec3f,
    // Points of the lip in its frame [m].
    p_lip: array<vec4f, ROBOT_LIP>,
}

struct Robot {
    h: f32,
    gravity: f32,
    substeps: u32,
    worlds: u32,
    dofs: u32,
    arm_joints: u32,
    fingers: u32,
    couplings: u32,
    arm_stiffness: f32,
    arm_damping: f32,
    arm_acceleration: f32,
    // Gravity torque that the arm's servos compensate, over the true one.
    gravity_share: f32,
    // Degree of freedom of the height joint; -1 without one. Its servo carries `height_force`.
    height_dof: i32,
    height_stiffness: f32,
    height_damping: f32,
    height_force: f32,
    base: u32,
    // Speed of a joint that sticks under its whole Coulomb friction [rad/s].
    creep: f32,
    turning_radius: f32,
    base_mass: f32,
    travel: Drive,
    turn: Drive,
    rail_lower: f32,
    rail_upper: f32,
    rail_velocity: f32,
    yaw_inertia: f32,
    rail_x: f32,
    rail_y: f32,
    finger_stiffness: f32,
    finger_damping: f32,
    finger_speed: f32,
    finger_force: f32,
    // The last arm link with the fingers at their start, as the servos take it.
    wrist: Inertia,
    cup: Cup,
    links: array<Link, ROBOT_DOFS>,
    arm: array<ArmJoint, ROBOT_ARM>,
    coupled: array<Coupling, ROBOT_COUPLINGS>,
    finger: array<Finger, ROBOT_FINGERS>,
    // Value and slope at the ends of each interval.
    curves: array<array<vec4f, CURVE_INTERVALS>, ROBOT_FINGERS>,
    // State of a world after its reset.
    start: array<vec4f, ROBOT_FIELDS / QUAD>,
}

@group(0) @binding(0) var<uniform> robot: Robot;
@group(0) @binding(1) var<storage, read> commands: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> robots: array<vec4f>;

// Numbers of the thread's world.
var<private> command: array<f32, COMMAND_FIELDS>;
var<private> state: array<f32, ROBOT_FIELDS>;

fn q(dof: u32) -> f32 {
    return state[ROBOT_Q + dof];
}

fn v(dof: u32) -> f32 {
    return state[ROBOT_V + dof];
}

fn bits(field: u32) -> u32 {
    return bitcast<u32>(state[field]);
}

fn set_bits(field: u32, value: u32) {
    state[field] = bitcast<f32>(value);
}

fn load_world(block: u32, lane: u32) {
    for (var quad = 0u; quad < COMMAND_FIELDS / QUAD; quad++) {
        let four = commands[(block * (COMMAND_FIELDS / QUAD) + quad) * LANES + lane];
        for (var k = 0u; k < QUAD; k++) {
            command[quad * QUAD + k] = four[k];
        }
    }
    for (var quad = 0u; quad < ROBOT_FIELDS / QUAD; quad++) {
        let four = robots[robot_at(block, lane, quad)];
        for (var k = 0u; k < QUAD; k++) {
            state[quad * QUAD + k] = four[k];
        }
    }
}

fn store_world(block: u32, lane: u32) {
    for (var quad = 0u; quad < ROBOT_FIELDS / QUAD; quad++) {
        let at = quad * QUAD;
        robots[robot_at(block, lane, quad)] = vec4f(state[at], state[at + 1u], state[at + 2u], state[at + 3u]);
    }
}

fn robot_at(block: u32, lane: u32, quad: u32) -> u32 {
    return (block * (ROBOT_FIELDS / QUAD) + quad) * LANES + lane;
}

// Stops the world in this frame.
fn quarantine(fault: u32) {
    set_bits(ROBOT_STOPPED, bits(ROBOT_FRAME));
    set_bits(ROBOT_FAULT, fault);
}

fn command_is_finite() -> bool {
    for (var field = 0u; field < COMMAND_FIELDS; field++) {
        if !is_finite(command[field]) {
            return false;
        }
    }
    return true;
}

// Advances a frame.
@compute @workgroup_size(LANES)
fn robot_frame(@builtin(workgroup_id) block: vec3u, @builtin(local_invocation_index) lane: u32) {
    if block.x * LANES + lane >= robot.worlds {
        return;
    }
    load_world(block.x, lane);
    set_bits(ROBOT_FRAME, bits(ROBOT_FRAME) + 1u);
    if bits(ROBOT_STOPPED) == 0u {
        if command_is_finite() {
            for (var left = robot.substeps; left > 0u; left--) {
                step_robot(f32(left - 1u) * robot.h);
            }
            test_robot();
        } else {
            quarantine(ROBOT_DOFS);
        }
    }
    store_world(block.x, lane);
}

// Resets the marked worlds.
@compute @workgroup_size(LANES)
fn robot_reset(@builtin(workgroup_id) block: vec3u, @builtin(local_invocation_index) lane: u32) {
    load_world(block.x, lane);
    if command[COMMAND_RESET] == 0.0 {
        return;
    }
    let frame = state[ROBOT_FRAME];
    for (var quad = 0u; quad < ROBOT_FIELDS / QUAD; quad++) {
        for (var k = 0u; k < QUAD; k++) {
            state[quad * QUAD + k] = robot.start[quad][k];
        }
    }
    state[ROBOT_FRAME] = frame;
    store_world(block.x, lane);
}

// The servos' limits and stuck joints are foreseen; where one does not hold, the substep is solved again with the limit as a constant effort, or with the
// joint slipping. Each time at least one joint more has its final law.
fn solve_with_limits() {
    for (var tries = 0u; tries <= 2u * ROBOT_ARM; tries++) {
        solve();
        if !cap_overshoot() {
            break;
        }
    }
}

// Advances a substep, after which `remaining` is left of the frame [s].
fn step_robot(remaining: f32) {
    begin_robot(remaining);
    solve_with_limits();
    move_joints();
}

// Sets up the system of a substep.
fn begin_robot(remaining: f32) {
    move_links();
    weigh_arm();
    drive_servos(remaining);
    assemble();
}

fn move_joints() {
    for (var dof = 0u; dof < robot.dofs; dof++) {
        state[ROBOT_Q + dof] = new_q(dof);
        state[ROBOT_V + dof] = new_v(dof);
    }
}

// Stops the world if its state is not finite.
fn test_robot() {
    for (var dof = robot.dofs; dof > 0u; dof--) {
        if !(is_finite(q(dof - 1u)) && is_finite(v(dof - 1u))) {
            quarantine(dof - 1u);
        }
    }
}

// Inward pass, from the tips to the root: elimination of the joints by the articulated-body algorithm (Featherstone 2008, section 7.3), with springs,
// dampers and drag taken at the end of the substep as additions to inertia. `docs/computation/dynamics.md` derives the equations. The motion is not read
// for every link but computed backwards from the tips.

// A link at its joint: the impulses on it, and the motion of its parent.
struct Body {
    joint: Joint,
    // From the joint to the tip.
    d: vec3f,
    // Torque about the joint, and force, as impulses over the substep.
    torque: vec3f,
    force: vec3f,
    // Motion of the parent's tip.
    parent: Motion,
}

// True if joints are left to conjugate gradients instead of being eliminated.
override CONJUGATE: bool = false;
// Sum of residual times preconditioned residual over the joints of this thread's parts (conjugate gradients only).
var<private> found_dot: f32;

// The substep of the frame, from 0.
var<private> substep: u32;

// One part of the inward pass: rows from the last to the first.
fn inward(part: u32) {
    let start = header(TILE_STARTS + part);
    var borne = nothing();
    let end = start + header(TILE_LENGTHS + part);
    if end == start {
        return;
    }
    // The next link is read ahead.
    let first = link_at(end - 1u);
    var next = link_of(
        awaited(link(first, LINK_DIRECTION)),
        awaited(link(first, LINK_MASS)),
        awaited(link(first, LINK_Q)),
    );
    var next_operation = awaited_words(operations[operation_at(end - 1u)]);
    var next_bits = awaited_words(vec4u(states[operation_at(end - 1u)])).x;
    let dampers = dampers_at();
    var next_time = damping_time;
    if MODAL {
        next_time = awaited(vec4f(damper_time(dampers, end - 1u))).x;
    }
    var airs = 0u;
    var next_air = vec4f(0.0);
    if BLOWS {
        airs = airs_at();
        next_air = awaited(link(air_at(airs, end - 1u), AIR_IMPULSE));
    }
    var tip = awaited_motion(leaf_at((next_operation.z >> THIRD_LEAF) & 0x3ffu), 0u);
    var next_tip: Packed;
    for (var row = end; row > start;) {
        row -= 1u;
        let own = next;
        let operation = next_operation;
        let bits = next_bits;
        let time = next_time;
        let air = next_air;
        // The load in the slot first, then the loads of other parts. One loop: each copy of its code would have to be fetched.
        let taken = select(0u, 1u, (operation.y & SECOND_TAKES) != 0u);
        let loads = taken + ((operation.y >> SECOND_LOADS) & 0x3fu);
        let first_load = (operation.y >> SECOND_FIRST_LOAD) & 0x3ffu;
        for (var k = 0u; k < loads; k++) {
            let own_slot = slot_at((operation.x >> FIRST_SLOT) & 0xffu);
            borne = plus(borne, load(select(cross_load_at(first_load + k - taken), own_slot, k < taken)));
        }
        // All reads for the next row are issued at once: a wait for one of them is a wait for all.
        let ahead = max(row, start + 1u) - 1u;
        next = read_link(link_at(ahead));
        next_operation = operations[operation_at(ahead)];
        next_bits = states[operation_at(ahead)];
        if MODAL {
            next_time = damper_time(dampers, ahead);
        }
        if BLOWS {
            next_air = link(air_at(airs, ahead), AIR_IMPULSE);
        }
        let is_active = (operation.x & FIRST_ACTIVE) != 0u;
        // Then the next row does not continue this one: its motion is read from the leaf before.
        let gives = !is_active
            || (operation.y & (SECOND_GIVES_FIRST | SECOND_GIVES | SECOND_GIVES_CROSS)) != 0u;
        if gives {
            next_tip = packed_motion(leaf_at(max((operation.z >> THIRD_LEAF) & 0x3ffu, 1u) - 1u), 0u);
        }
        if !is_active {
            tip = unpacked(next_tip);
            continue;
        }
        let is_debris = (bits & STATE_DEBRIS) != 0u;
        var drag = select(vec2f(rules.linear_drag, rules.angular_drag), vec2f(rules.broken_linear_drag, rules.broken_angular_drag), is_debris);
        // Broken limbs feel still air.
        let is_blown = select(false, !is_debris, BLOWS);
        if is_blown {
            drag.x = air.w;
        }
        let body = body_inward(own, tip, drag);
        var torque = body.torque;
        var force = body.force;
        if is_blown {
            torque += cross(body.d * 0.5, air.xyz);
            force += air.xyz;
        }
        let first_fruit = (operation.z >> THIRD_FIRST_FRUIT) & 0xfffu;
        let last_fruit = first_fruit + ((operation.z >> THIRD_FRUIT) & 0x3fu);
        for (var k = first_fruit; k < last_fruit; k++) {
            let stem = fruit_at(k);
            if STEMS {
                let rod = read_borne(stem);
                borne = plus_borne(borne, rod, body.d);
                torque += rod.torque;
                force += rod.force;
                continue;
            }
            let arm = fruit(stem, FRUIT_ARM).xyz;
            let last = fruit(stem, FRUIT_REACTION);
            let reaction = last.xyz;
            borne = plus_point_mass(borne, last.w, arm - body.d);
            torque += cross(arm, reaction);
            force += reaction;
        }
        // Debris takes no external force; it may lie on the ground.
        var held = vec2f(0.0);
        if is_debris {
            let on_ground = propped(row, borne);
            borne = on_ground.borne;
            held = on_ground.held;
        }
        if (operation.w & FOURTH_PUSHED) != 0u && !is_debris {
            let push = pushed(row, body.d);
            torque += push[0];
            force += push[1];
        }
        let law = joint_law(own, row, bits, select(time, rules.damped * time, MODAL));
        borne = eliminate(own, row, law, drag, body, borne, torque, force);
        if is_debris {
            hand_on(row, held);
        }
        tip = body.parent;
        if gives {
            let is_cross = (operation.y & SECOND_GIVES_CROSS) != 0u;
            let slot = slot_at((operation.x >> FIRST_PARENT) & 0xffu);
            let to = select(slot, cross_load_at(operation.y >> SECOND_OWN_LOAD), is_cross);
            if (operation.y & SECOND_GIVES) != 0u {
                borne = plus(load(to), borne);
            }
            set_load(to, borne);
            borne = nothing();
            tip = unpacked(next_tip);
        }
    }
}

// Stores the contact that held a tip in the fourth numbers of what the inward pass leaves.
fn hand_on(row: u32, held: vec2f) {
    let at = work_at(row);
    set_quad(at, WORK_G_2N, vec4f(quad(at, WORK_G_2N).xyz, held.x));
    set_quad(at, WORK_G_2F, vec4f(quad(at, WORK_G_2F).xyz, held.y));
}

// Gravity, drag and velocity products of a link, from the motion of its tip. The impulses are minus the rate of change of momentum that the
// bias motion needs, at the centre of mass and then about the joint, times the substep.
fn body_inward(own: Link, tip: Motion, drag: vec2f) -> Body {
    let v = own.v;
    let turned = joint_inward(tip.axes, own.direction, own.q);
    let joint = turned.joint;
    let z = tip.axes.z;
    let w = tip.w;
    let length = own.length;
    let d = z * length;
    let w_cross_z = cross(w, z);
    let v_d = w_cross_z * length;
    let b_d = cross(tip.b_w, d) + cross(w, v_d);
    let v_joint = tip.v - v_d;
    let b_joint = tip.b_v - b_d;

    var f = b_joint + b_d * 0.5 + (v_joint + v_d * 0.5) * drag.x;
    f.z += rules.gravity;
    let force = f * (-rules.h * own.mass);
    let t = tip.b_w + w * drag.y;
    let spin = z * dot(z, t) + w_cross_z * dot(w, z);
    let n = t * own.across + spin * own.excess;
    let torque = cross(d * 0.5, force) - n * rules.h;

    let s_w = joint.first * v.x + joint.axes.y * v.y;
    let w_parent = w - s_w;
    let b_joint_turn = cross(w_parent, s_w) + joint.third * (v.x * v.y);
    return Body(joint, d, torque, force, Motion(turned.parent, w_parent, tip.b_w - b_joint_turn, v_joint, b_joint));
}

// Torque about the joint and force of the external forces on a link, as impulses.
fn pushed(row: u32, d: vec3f) -> array<vec3f, 2> {
    var torque = vec3f(0.0);
    var force = vec3f(0.0);
    for (var k = 0u; k < rules.pushes_each; k++) {
        let at = ((tile_number * rules.pushes_each + k) * PUSH_FIELDS) * LANES + lane;
        let acts = bitcast<u32>(pushes[at + PUSH_AFTER * LANES]) < rules.frame
            && rules.frame <= bitcast<u32>(pushes[at + PUSH_UNTIL * LANES]);
        if acts && bitcast<u32>(pushes[at + PUSH_ROW * LANES]) == row {
            let f = push3(at, PUSH_FORCE);
            force += f * rules.h;
            torque += (push3(at, PUSH_TORQUE) + cross(d * 0.5, f)) * rules.h;
        }
    }
    return array(torque, force);
}

// Three fields of a force, one after the other.
fn push3(at: u32, field: u32) -> vec3f {
    return vec3f(pushes[at + field * LANES], pushes[at + (field + 1u) * LANES], pushes[at + (field + 2u) * LANES]);
}

// Stiffness of a joint, its armature h (D + h K), and what its rate counts in its impulse: the armature, or h D where the springs lead. `time` is its damping
// over its stiffness. A broken joint has no spring; its damper stands for friction, brake and residual damping (`treephys::Rupture`).
fn joint_law(own: Link, row: u32, bits: u32, time: f32) -> vec3f {
    if (bits & STATE_BROKEN) == 0u {
        let armature = rules.h * (time + rules.h) * own.stiffness;
        return vec3f(own.stiffness, armature, select(armature, rules.h * time * own.stiffness, MODAL));
    }
    let broken = link(link_at(row), LINK_LIMIT);
    let inertia = broken.y;
    let rate = length(own.v);
    // The number of the frame in which it broke has 21 bits.
    let frames = (own_frame() - (bits >> STATE_BROKE) - 1u) & (0xffffffffu >> STATE_BROKE);
    let age = f32(frames * rules.substeps + substep) * rules.h;
    var ramp = 1.0;
    if rules.friction_ramp_time > 0.0 {
        ramp = min(age / rules.friction_ramp_time, 1.0);
    }
    let moment = broken.z * (1.0 + (rules.friction_ramp - 1.0) * ramp);
    let expected = rate + max(rate - broken.w, 0.0);
    let speeding = expected / rules.rate_limit;
    let brake = rules.rate_brake * inertia * speeding * speeding * speeding * speeding;
    let residual = min(rules.residual_damping * inertia, rules.residual_damping_max);
    let held = residual + brake + moment / max(expected, rules.friction_regularisation);
    set_link(link_at(row), LINK_LIMIT, vec4f(broken.xyz, rate));
    return vec3f(0.0, vec2f(rules.h * held));
}

// Eliminates a joint: stores what the outward pass needs, and returns what the parent bears. Steps: the link's own inertia at its joint, drag
// included (a rod of mass m (1 + h c), and what the link has beyond a rod); the load from the tip to the joint, H' = H + [d] M and
// J' = J + [d] H^T - H' [d]; then U = I S, the pivot D = S^T U + armature and g = D^-1 U.
fn eliminate(own: Link, row: u32, law: vec3f, drag: vec2f, body: Body, borne: Load, torque: vec3f, force: vec3f) -> Load {
    let h = rules.h;
    let d = body.d;
    let stiffness = law.x;
    let armature = law.y;
    let damping = law.z;

    let mass = own.mass * (1.0 + h * drag.x);
    let turning = 1.0 + h * drag.y;
    let length = own.length;
    let quarter = 0.25 * mass;
    let across = own.across * turning + quarter * (length * length);
    let along = d * (own.excess * turning / (length * length) - quarter);
    let half = d * (0.5 * mass);

    let m_0 = borne.linear[0];
    let m_1 = borne.linear[1];
    let o_0 = borne.coupling[0];
    let o_1 = borne.coupling[1];
    let o_2 = borne.coupling[2];
    var h_0 = o_0 + cross(d, m_0);
    var h_1 = o_1 + cross(d, vec3f(m_0.y, m_1.x, m_1.y));
    var h_2 = o_2 + cross(d, vec3f(m_0.z, m_1.y, m_1.z));
    let column_x = cross(d, vec3f(o_0.x, o_1.x, o_2.x)) - (h_1 * d.z - h_2 * d.y) + along * d.x;
    let column_y = cross(d, vec3f(o_0.y, o_1.y, o_2.y)) - (h_2 * d.x - h_0 * d.z) + along * d.y;
    let column_z = cross(d, vec3f(o_0.z, o_1.z, o_2.z)) - (h_0 * d.y - h_1 * d.x) + along * d.z;
    let angular_0 = borne.angular[0] + column_x + vec3f(across, 0.0, 0.0);
    let angular_1 = borne.angular[1] + vec3f(column_y.y + across, column_y.z, column_z.z + across);
    h_0 += vec3f(0.0, half.z, -half.y);
    h_1 += vec3f(-half.z, 0.0, half.x);
    h_2 += vec3f(half.y, -half.x, 0.0);
    let linear_0 = m_0 + vec3f(mass, 0.0, 0.0);
    let linear_1 = m_1 + vec3f(mass, 0.0, mass);
    let n = torque + borne.torque + cross(d, borne.force);
    let f = force + borne.force;

    let a_1 = body.joint.first;
    let a_2 = body.joint.axes.y;
    let u_1n = symmetric(angular_0, angular_1, a_1);
    let u_2n = symmetric(angular_0, angular_1, a_2);
    let u_1f = vec3f(dot(h_0, a_1), dot(h_1, a_1), dot(h_2, a_1));
    let u_2f = vec3f(dot(h_0, a_2), dot(h_1, a_2), dot(h_2, a_2));
    let d_11 = dot(a_1, u_1n) + armature;
    let d_12 = dot(a_2, u_1n);
    let d_22 = dot(a_2, u_2n) + armature;
    let inverse = 1.0 / (d_11 * d_22 - d_12 * d_12);
    let i_11 = d_22 * inverse;
    let i_12 = -d_12 * inverse;
    let i_22 = d_11 * inverse;
    let g_1n = u_1n * i_11 + u_2n * i_12;
    let g_1f = u_1f * i_11 + u_2f * i_12;
    let g_2n = u_1n * i_12 + u_2n * i_22;
    let g_2f = u_1f * i_12 + u_2f * i_22;
    let y_1 = dot(a_1, n) - (h * stiffness * own.q.x + damping * own.v.x);
    let y_2 = dot(a_2, n) - (h * stiffness * own.q.y + damping * own.v.y);
    if CONJUGATE {
        prepare(row, body, vec3f(i_11, i_12, i_22), armature, vec2f(y_1, y_2));
        return Load(array(angular_0, angular_1), array(h_0, h_1, h_2), array(linear_0, linear_1), n, f);
    }
    if TOUCHES {
        keep_link(row, own, body, vec3f(i_11, i_12, i_22));
    }
    let e_1 = i_11 * y_1 + i_12 * y_2;
    let e_2 = i_12 * y_1 + i_22 * y_2;
    let left_at = work_at(row);
    set_quad(left_at, WORK_G_1N, vec4f(g_1n, e_1));
    set_quad(left_at, WORK_G_1F, vec4f(g_1f, e_2));
    set_quad(left_at, WORK_G_2N, vec4f(g_2n, 0.0));
    set_quad(left_at, WORK_G_2F, vec4f(g_2f, 0.0));

    return Load(
        array(
            angular_0 - g_1n * u_1n.x - g_2n * u_2n.x,
            angular_1 - vec3f(u_1n.y, u_1n.y, u_1n.z) * vec3f(g_1n.y, g_1n.z, g_1n.z)
                - vec3f(u_2n.y, u_2n.y, u_2n.z) * vec3f(g_2n.y, g_2n.z, g_2n.z),
        ),
        array(
            h_0 - u_1n * g_1f.x - u_2n * g_2f.x,
            h_1 - u_1n * g_1f.y - u_2n * g_2f.y,
            h_2 - u_1n * g_1f.z - u_2n * g_2f.z,
        ),
        array(
            linear_0 - g_1f * u_1f.x - g_2f * u_2f.x,
            linear_1 - vec3f(u_1f.y, u_1f.y, u_1f.z) * vec3f(g_1f.y, g_1f.z, g_1f.z)
                - vec3f(u_2f.y, u_2f.y, u_2f.z) * vec3f(g_2f.y, g_2f.z, g_2f.z),
        ),
        n - u_1n * e_1 - u_2n * e_2,
        f - u_1f * e_1 - u_2f * e_2,
    );
}

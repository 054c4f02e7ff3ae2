// A tree in another habit and other dimensions. Twin: `twin/habit.rs`, which explains the functions.

// Quantities that are the same for all wood of a tree.
struct Habit {
    scale: f32,
    thickness: f32,
    lean: vec4f,
    droop: f32,
    fork_spread: f32,
    twist: f32,
}

// A segment of the base tree.
struct Segment {
    row: u32,
    parent: u32,
    growth: u32,
    radius_units: u32,
    heading: vec3f,
    limit: f32,
    direction: vec3f,
    length: f32,
    weight: vec4f,
    radius: f32,
}

// A segment in its new form.
struct Formed {
    turn: vec4f,
    lift: vec4f,
    axes: Axes,
    z_tip: f32,
    radius: f32,
}

// A segment's form, and its direction in the parent's frame.
struct Placement {
    form: Formed,
    direction: vec3f,
}

fn segment_of(index: u32) -> Segment {
    let dials = BASE_FIELDS + AXIS_COUNT * DIAL_FIELDS;
    let at = (dials + index * SEGMENT_FIELDS) / QUAD;
    let a = table[at];
    let b = bitcast<vec4f>(table[at + SEGMENT_HEADING / QUAD]);
    let c = bitcast<vec4f>(table[at + SEGMENT_DIRECTION / QUAD]);
    let d = bitcast<vec4f>(table[at + SEGMENT_MASS / QUAD]);
    let e = bitcast<vec4f>(table[at + SEGMENT_RADIUS / QUAD]);
    return Segment(a.x, a.y, a.z, a.w, b.xyz, b.w, c.xyz, c.w, d, e.x);
}

fn habit_drawn() -> Habit {
    let scale = factor_of(AXIS_SCALE);
    let internode = bitcast<vec4f>(table[BASE_INTERNODE / QUAD]).z;
    return Habit(
        scale,
        scale * factor_of(AXIS_STOCKINESS),
        turn_by(lean_drawn()),
        (factor_of(AXIS_DROOP) - 1.0) * internode,
        factor_of(AXIS_FORK_SPREAD),
        angle_drawn(AXIS_TWIST),
    );
}

fn formed(row: u32) -> Formed {
    let at = work_at(row);
    let a = quad(at, FORM_AXES);
    let b = quad(at, FORM_AXES + 4u);
    return Formed(quad(at, FORM_TURN), quad(at, FORM_LIFT), axes_of(a.xyz, vec3f(a.w, b.xy)), b.z, b.w);
}

fn set_formed(row: u32, form: Formed) {
    let at = work_at(row);
    set_quad(at, FORM_TURN, form.turn);
    set_quad(at, FORM_LIFT, form.lift);
    set_quad(at, FORM_AXES, vec4f(form.axes.y, form.axes.z.x));
    set_quad(at, FORM_AXES + 4u, vec4f(form.axes.z.yz, form.z_tip, form.radius));
}

// The ground, as what the trunk grows from.
fn formed_ground(lean: vec4f) -> Formed {
    return Formed(lean, NO_TURN, world_axes(), 0.0, UNBOUNDED);
}

fn turn_of(own: Segment, start: vec4f, along: vec3f, habit: Habit, bend: vec2f) -> vec4f {
    var turn = start;
    if (own.growth & GROWTH_LATERAL) != 0u {
        let roll = habit.twist * f32(own.growth >> GROWTH_ORDINAL);
        turn = product(turn_by(along * roll), turn);
        turn = product(spread_turn(along, turned(turn, own.heading), habit.fork_spread), turn);
    }
    if (own.growth & GROWTH_BRANCH) != 0u {
        turn = product(droop_turn(turned(turn, own.heading), habit.droop), turn);
    }
    return product(bend_turn(turned(turn, own.heading), bend), turn);
}

fn elevated(heading: vec3f, sine: f32) -> vec3f {
    let across = sqrt(dot(heading.xy, heading.xy));
    var level = vec2f(1.0, 0.0);
    if across > 0.0 {
        level = heading.xy * (1.0 / across);
    }
    return vec3f(level * sqrt(max(1.0 - sine * sine, 0.0)), sine);
}

fn form_segment(own: Segment, parent: Formed, habit: Habit, bend: vec2f, length: f32, radius: f32) -> Placement {
    var turn = parent.turn;
    if own.parent != NO_SEGMENT {
        let along = unit_vector(turned(parent.turn, segment_of(own.parent).heading));
        turn = unit_turn(turn_of(own, parent.turn, along, habit, bend));
    }
    var heading = turned(parent.lift, unit_vector(turned(turn, own.heading)));
    var lift = parent.lift;
    if (own.growth & GROWTH_BRANCH) != 0u {
        let clearance = bitcast<vec4f>(table[BASE_CLEARANCE / QUAD]).x;
        let rise = min((clearance + radius - parent.z_tip) / length, 1.0);
        if heading.z < rise {
            let raised = elevated(heading, rise);
            lift = unit_turn(product(turn_between(unit_vector(heading), raised), lift));
            heading = raised;
        }
    }
    let in_parent = vec3f(dot(parent.axes.x, heading), dot(parent.axes.y, heading), dot(parent.axes.z, heading));
    let direction = unit_vector(in_parent);
    let joint = joint_outward(parent.axes, direction, vec2f(0.0));
    return Placement(Formed(turn, lift, joint.axes, parent.z_tip + heading.z * length, radius), direction);
}

// Draws the constants of a world from the base tree. The twin `twin/vary.rs` has the sources of the formulas. A thread is a world.

const SECTION: f32 = 0.25;
const BALL_HALF: f32 = 0.66666667;
const ROD: f32 = 0.083333333;
const HALF_BALL_ARM: f32 = 0.375;
const MICRORADIAN: f32 = 1e-6;

// Factors on the wood of a tree.
struct Wood {
    density: f32,
    modulus: f32,
    stress: f32,
}

// Dimensions of a segment, and whether they are the base's.
struct Stick {
    length: f32,
    radius: f32,
    is_base: bool,
}

@compute @workgroup_size(LANES)
fn vary(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    enter(group.x, 0u, thread);
    if world(WORLD_RESET) == 0.0 {
        return;
    }
    vary_wood();
    vary_fruit();
}

fn base_flags() -> u32 {
    return table[BASE_FLAGS / QUAD].x;
}

fn vary_wood() {
    let wood = Wood(factor_of(AXIS_WOOD_DENSITY), factor_of(AXIS_YOUNGS_MODULUS), factor_of(AXIS_RUPTURE_STRESS));
    let forms = (base_flags() & VARIED_FORM) != 0u;
    let habit = habit_drawn();
    var lengths = stream_of(AXIS_SEGMENT_LENGTH);
    var radii = stream_of(AXIS_SEGMENT_RADIUS);
    var bends = stream_of(AXIS_SEGMENT_BEND);
    let count = table[BASE_SEGMENTS / QUAD].z;
    for (var index = 0u; index < count; index++) {
        let own = segment_of(index);
        let at = link_at(own.row);
        var stick = Stick(own.length, own.radius, true);
        var before = Stick(0.0, 0.0, true);
        var direction = own.direction;
        if own.parent != NO_SEGMENT {
            let up = segment_of(own.parent);
            before = Stick(up.length, up.radius, true);
        }
        if forms {
            var parent = formed_ground(habit.lean);
            if own.parent != NO_SEGMENT {
                let up = segment_of(own.parent);
                parent = formed(up.row);
                let length = link(link_at(up.row), LINK_DIRECTION).w;
                before = Stick(length, parent.radius, length == up.length && parent.radius == up.radius);
            }
            stick.length = own.length * (habit.scale * next_factor(&lengths));
            stick.radius = min(own.radius * (habit.thickness * next_factor(&radii)), parent.radius);
            stick.is_base = stick.length == own.length && stick.radius == own.radius;
            let placed = form_segment(own, parent, habit, next_bend(&bends), stick.length, stick.radius);
            set_formed(own.row, placed.form);
            direction = placed.direction;
        }
        set_link(at, LINK_DIRECTION, vec4f(direction, stick.length));
        let stiffness = joint_stiffness(own, stick, before, wood.modulus);
        let weight = capsule(own, stick, wood.density);
        set_link(at, LINK_MASS, vec4f(weight, stiffness));
        let limit = joint_limit(own, stick, stiffness, wood.stress);
        set_link(at, LINK_LIMIT, vec4f(limit, link(at, LINK_LIMIT).yzw));
        set_radius(own, stick);
    }
}

// Mass, inertia across, and excess of the inertia about the axis.
fn capsule(own: Segment, stick: Stick, factor: f32) -> vec3f {
    if stick.is_base && factor == 1.0 {
        return own.weight.xyz;
    }
    let density = bitcast<vec4f>(table[BASE_DENSITY / QUAD]).y * factor;
    let r = stick.radius;
    let l = stick.length;
    let cylinder = density * PI * r * r * l;
    let half_ball = density * BALL_HALF * PI * r * r * r;
    let axial = cylinder * (0.5 * r * r) + half_ball * (2.0 * BALL * r * r);
    let across = cylinder * (l * l * ROD + r * r * 0.25)
        + half_ball * (2.0 * (BALL * r * r + 0.25 * l * l + HALF_BALL_ARM * l * r));
    return vec3f(cylinder + 2.0 * half_ball, across, axial - across);
}

fn bending(modulus: f32, stick: Stick) -> f32 {
    let area = stick.radius * stick.radius;
    return modulus * (SECTION * PI) * area * area / stick.length;
}

fn joint_stiffness(own: Segment, stick: Stick, before: Stick, factor: f32) -> f32 {
    let flags = base_flags();
    let is_corrected = (flags & VARIED_CORRECTED) != 0u;
    let is_base = stick.is_base && (before.is_base || !is_corrected) && factor == 1.0;
    if is_base || (flags & VARIED_PER_LEVEL) != 0u {
        return own.weight.w;
    }
    let modulus = bitcast<vec4f>(table[BASE_MODULUS / QUAD]).z * factor;
    var stiffness = bending(modulus, stick);
    if is_corrected {
        var compliance = 0.5 / stiffness;
        if own.parent != NO_SEGMENT && (own.growth & GROWTH_LATERAL) == 0u {
            compliance += 0.5 / bending(modulus, before);
        }
        stiffness = 1.0 / compliance;
    }
    let ends = bitcast<vec4f>(table[BASE_STIFFNESS_MIN / QUAD]).xy;
    return clamp(stiffness, ends.x, ends.y);
}

fn joint_limit(own: Segment, stick: Stick, stiffness: f32, factor: f32) -> f32 {
    let is_base = stick.is_base && stiffness == own.weight.w && factor == 1.0;
    if is_base || own.parent == NO_SEGMENT {
        return own.limit;
    }
    let stress = bitcast<vec4f>(table[BASE_STRESS / QUAD]).w * factor;
    let r = stick.radius;
    let angle = stress * (SECTION * PI) * r * r * r / stiffness;
    return angle * angle;
}

fn set_radius(own: Segment, stick: Stick) {
    var units = own.radius_units;
    if !stick.is_base {
        units = min(u32(stick.radius * RADIUS_UNITS + 0.5), FOURTH_RADIUS_BITS);
    }
    let at = operation_at(own.row);
    let kept = operations[at].w & ~(FOURTH_RADIUS_BITS << FOURTH_RADIUS);
    operations[at].w = kept | (units << FOURTH_RADIUS);
}

// A value times an axis's factor, clamped to the axis's limits; a value that is already outside them is not moved further out.
fn clipped(value: f32, factor: f32, axis: u32) -> f32 {
    let limits = limits_of(dial_at(axis));
    return clamp(value * factor, min(value, limits.x), max(value, limits.y));
}

fn vary_fruit() {
    let size = factor_of(AXIS_FRUIT_SIZE);
    let heaviness = factor_of(AXIS_FRUIT_MASS);
    let head = table[0];
    let constants = bitcast<vec4f>(table[BASE_AIR_DRAG / QUAD]);
    let stems = bitcast<vec4f>(table[BASE_STEM / QUAD]).zw;
    let first = (BASE_FIELDS + AXIS_COUNT * DIAL_FIELDS + head.z * SEGMENT_FIELDS) / QUAD;
    for (var index = 0u; index < head.w; index++) {
        let at = first + index * (FRUIT_ENTRY_FIELDS / QUAD);
        let a = table[at];
        let b = bitcast<vec4f>(table[at + FRUIT_ENTRY_ACROSS / QUAD]);
        var mass = bitcast<vec4f>(table[at + FRUIT_ENTRY_MASS / QUAD]);
        var stem = bitcast<vec4f>(table[at + FRUIT_ENTRY_STIFFNESS / QUAD]);
        var anchor = bitcast<vec4f>(table[at + FRUIT_ENTRY_ANCHOR / QUAD]);
        let radius = clipped(mass.y, size, AXIS_FRUIT_SIZE);
        if radius != mass.y {
            mass.y = radius;
            mass.w = constants.x * radius * radius;
            anchor.w = -(stems.x + radius);
        }
        let heavy = clipped(mass.x, heaviness, AXIS_FRUIT_MASS);
        if heavy != mass.x {
            mass.x = heavy;
            stem.y = stems.y * sqrt(heavy);
            stem.z = constants.y * heavy;
        }
        if (base_flags() & VARIED_FORM) != 0u {
            anchor = vec4f(carried(a.y, bitcast<f32>(a.z), b, anchor.z), anchor.w);
        }
        let place = fruit_at(a.x);
        set_fruit(place, FRUIT_MASS, mass);
        set_fruit(place, FRUIT_STIFFNESS, stem);
        set_fruit(place, FRUIT_ANCHOR, anchor);
    }
}

// Position of an anchor on the new form of its segment.
fn carried(index: u32, off_bark: f32, across: vec4f, along: f32) -> vec3f {
    let own = segment_of(index);
    let form = formed(own.row);
    let stretch = link(link_at(own.row), LINK_DIRECTION).w / own.length;
    let level = vec2f(-form.axes.x.z, -form.axes.y.z);
    let sine = sqrt(dot(level, level));
    var underside = vec2f(0.0);
    if sine > MICRORADIAN {
        underside = level * (1.0 / sine);
    }
    var side = across.xy;
    if dot(side, side) == 0.0 {
        side = underside * form.radius;
    } else {
        if dot(underside, underside) > 0.0 && dot(across.zw, across.zw) > 0.0 {
            let a = across.zw;
            side = vec2f(a.x * underside.x - a.y * underside.y, a.x * underside.y + a.y * underside.x);
        }
        side *= max(form.radius + off_bark * stretch, 0.0);
    }
    return vec3f(side, along * stretch);
}

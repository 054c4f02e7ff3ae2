// Poses solids before their camera, and finds the pixels that each may cover. Nothing that `hit` would find is left out.

// Depth at which edges that pass behind the camera are cut before projection [m].
const CUT: f32 = 1e-5;
// Widening of a rectangle [px]: above the rounding of slopes in images of up to 65536 pixels.
const SLACK: f32 = 0.02;
// Two numbers that no rectangle has: an empty one.
const EMPTY: vec2u = vec2u(1u, 1u);

// Least and largest slope x/z, y/z.
struct Slopes {
    low: vec2f,
    high: vec2f,
}

const NONE: Slopes = Slopes(vec2f(NOTHING), vec2f(-NOTHING));
const ALL: Slopes = Slopes(vec2f(-NOTHING), vec2f(NOTHING));

fn both(a: Slopes, b: Slopes) -> Slopes {
    return Slopes(min(a.low, b.low), max(a.high, b.high));
}

fn of_point(p: vec3f) -> Slopes {
    if p.z < CUT {
        return NONE;
    }
    return Slopes(p.xy / p.z, p.xy / p.z);
}

// Slopes of a segment, cut at the camera's plane.
fn of_edge(p: vec3f, q: vec3f) -> Slopes {
    let ends = both(of_point(p), of_point(q));
    if (p.z < CUT) == (q.z < CUT) {
        return ends;
    }
    let cut = p + (q - p) * ((CUT - p.z) / (q.z - p.z));
    return both(ends, of_point(vec3f(cut.xy, CUT)));
}

// Slopes of a ball: two tangents from the camera to a circle, along each axis.
fn of_ball(c: vec3f, radius: f32) -> Slopes {
    if c.z <= -radius {
        return NONE;
    }
    if c.z <= radius * (1.0 + 1e-3) {
        return ALL;
    }
    let q = c.z * c.z - radius * radius;
    let root = radius * sqrt(c.xy * c.xy + q);
    return Slopes((c.xy * c.z - root) / q, (c.xy * c.z + root) / q);
}

fn of_capsule(p: vec3f, end: vec3f, radius: f32) -> Slopes {
    let a = of_ball(p, radius);
    let b = of_ball(end, radius);
    // An axis through the camera's plane.
    if min(p.z, end.z) <= radius && max(p.z, end.z) > -radius {
        return ALL;
    }
    return both(a, b);
}

fn of_box(solid: Solid) -> Slopes {
    let q = rotation_of(solid);
    let half = end_of(solid).yzw;
    let p = p_of(solid);
    var slopes = NONE;
    for (var k = 0u; k < 12u; k++) {
        // Edge k is along axis k / 4.
        let along = k / 4u;
        var from_corner = half;
        var to_corner = half;
        let i = (along + 1u) % 3u;
        let j = (along + 2u) % 3u;
        if (k & 1u) != 0u {
            from_corner[i] = -half[i];
            to_corner[i] = -half[i];
        }
        if (k & 2u) != 0u {
            from_corner[j] = -half[j];
            to_corner[j] = -half[j];
        }
        to_corner[along] = -half[along];
        slopes = both(slopes, of_edge(p + turned(q, from_corner), p + turned(q, to_corner)));
    }
    return slopes;
}

fn of_triangle(p: vec3f, q: vec3f, r: vec3f) -> Slopes {
    return both(of_edge(p, q), both(of_edge(q, r), of_edge(r, p)));
}

fn of_blade(solid: Solid) -> Slopes {
    var slopes = NONE;
    var behind = 0u;
    for (var k = 0u; k < BLADE_CORNERS; k++) {
        let p = corner(solid, k);
        slopes = both(slopes, of_point(p));
        behind += u32(p.z < CUT);
    }
    if behind > 0u && behind < BLADE_CORNERS {
        return ALL;
    }
    return slopes;
}

// Least depth of a solid, or less.
fn nearest(solid: Solid) -> f32 {
    let z = p_of(solid).z;
    let end = end_of(solid);
    switch kind_of(solid) {
        case BALL: { return z - fourth_of(solid); }
        case CAPSULE: { return z + min(0.0, q_of(solid).z * end.x) - end.y; }
        case BOX: { return z - length(end.yzw); }
        case PLANE: { return 0.0; }
        case TRIANGLE: { return min(z, min(q_of(solid).z, end.z)); }
        default: { return z - end.y - end.z; }
    }
}

fn slopes_of(solid: Solid) -> Slopes {
    let p = p_of(solid);
    let end = end_of(solid);
    switch kind_of(solid) {
        case BALL: { return of_ball(p, fourth_of(solid)); }
        case CAPSULE: { return of_capsule(p, p + q_of(solid) * end.x, end.y); }
        case BOX: { return of_box(solid); }
        case PLANE: { return ALL; }
        case TRIANGLE: { return of_triangle(p, q_of(solid), end.xyz); }
        default: { return of_blade(solid); }
    }
}

// Pixels whose rays lie within slopes.
fn rectangle(slopes: Slopes, view: View) -> vec2u {
    let size = vec2f(vec2u(view.size & 0xffffu, view.size >> 16u));
    // Clamped first: numbers far outside an image have no place in an integer.
    let low = clamp(ceil(slopes.low * view.focal + view.axis - SLACK), vec2f(0.0), size);
    let high = clamp(floor(slopes.high * view.focal + view.axis + SLACK), vec2f(-1.0), size - 1.0);
    if any(low > high) {
        return EMPTY;
    }
    let from_pixel = vec2u(low);
    let to_pixel = vec2u(high);
    return from_pixel | (to_pixel << vec2u(16u));
}

// Product of two rotations.
fn composed(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

// A solid in another frame, in which its own frame has a rotation and a place.
fn moved(solid: Solid, rotation: vec4f, place: vec3f) -> Solid {
    let own = p_of(solid);
    var p = place + turned(rotation, own);
    var q = q_of(solid);
    var end = end_of(solid);
    switch kind_of(solid) {
        case BALL: {}
        case CAPSULE: { q = turned(rotation, q); }
        case PLANE: {
            // The normal turns, the offset changes.
            p = turned(rotation, own);
            q.x += dot(p, place);
        }
        case TRIANGLE: {
            q = place + turned(rotation, q);
            end = vec4f(place + turned(rotation, end.xyz), 0.0);
        }
        default: {
            let turn = composed(rotation, rotation_of(solid));
            q = turn.xyz;
            end.x = turn.w;
        }
    }
    let head = bitcast<vec3u>(p);
    return Solid(vec4u(solid.a.xy, head.xy), vec4u(head.z, bitcast<vec3u>(q)), bitcast<vec4u>(end));
}

@compute @workgroup_size(BOUND_THREADS)
fn bound(@builtin(global_invocation_id) id: vec3u) {
    let view = views[id.y];
    if id.x >= view.count {
        return;
    }
    let still = solids[select(view.first + id.x, view.loose_first + id.x - view.kept_count, id.x >= view.kept_count)];
    let body = 2u * (view.bodies + (still.a.x >> 16u));
    var solid = moved(still, bodies[body], bodies[body + 1u].xyz);
    if view.world_pose != BEFORE_CAMERA {
        solid = moved(solid, bodies[2u * view.world_pose], bodies[2u * view.world_pose + 1u].xyz);
    }
    var found = EMPTY;
    if nearest(solid) <= view.far {
        found = rectangle(slopes_of(solid), view);
    }
    posed[view.posed + id.x] = solid;
    rectangles[view.posed + id.x] = found;
}

// Depth images of scenes: what a view, a solid and a prepared solid are, and where a ray meets one. Lengths in metres, in the camera's
// optical frame; the ray of a pixel is t (x, y, 1), so that t is the depth.

struct View {
    // First of its solids among all, and their number. Those beyond `kept_count` lie at `loose_first`.
    first: u32,
    count: u32,
    // First of its solids among those that are posed before the camera, and first of its bodies.
    posed: u32,
    bodies: u32,
    // First of its pixels among all.
    pixels: u32,
    // Width, and height in the upper half.
    size: u32,
    // 1 if the pixels' items are wanted, 2 for marks of solids.
    wants: u32,
    kept_count: u32,
    focal: vec2f,
    axis: vec2f,
    near: f32,
    far: f32,
    loose_first: u32,
    // Pose of the world before the camera, among the bodies', if theirs are in the world.
    world_pose: u32,
}

// Words of `images/solids.rs`: kind, mesh and body; item; then ten numbers, which mean for
//   a ball: centre, radius;
//   a capsule: end of the axis, its direction, its length, radius;
//   a box: its frame's origin and rotation, half of its lengths;
//   a plane: normal, offset;
//   a triangle: three corners;
//   a blade: its frame's origin and rotation, length, width.
struct Solid {
    a: vec4u,
    b: vec4u,
    c: vec4u,
}

const BALL: u32 = 0u;
const CAPSULE: u32 = 1u;
const BOX: u32 = 2u;
const PLANE: u32 = 3u;
const TRIANGLE: u32 = 4u;
const BLADE: u32 = 5u;

// No pose of the world: bodies are posed before the camera.
const BEFORE_CAMERA: u32 = 0xffffffffu;

// Depth of a ray that meets nothing: the largest number.
const NOTHING: f32 = 0x1.fffffep+127f;
// Least size of a divisor.
const LEAST: f32 = 1e-20;

@group(0) @binding(0) var<storage, read> views: array<View>;
// Solids in the frames of their bodies.
@group(0) @binding(1) var<storage, read> solids: array<Solid>;
// Corners of the triangles of unit blades: along and across.
@group(0) @binding(2) var<storage, read> meshes: array<vec4f>;
// Rotation and place of each body before its camera, or in the world.
@group(0) @binding(3) var<storage, read> bodies: array<vec4f>;
// Solids before their camera.
@group(0) @binding(4) var<storage, read_write> posed: array<Solid>;
// Pixels that each of them may cover: first and last column, first and last row, 16 bits each.
@group(0) @binding(5) var<storage, read_write> rectangles: array<vec2u>;
@group(0) @binding(6) var<storage, read_write> depths: array<f32>;
@group(0) @binding(7) var<storage, read_write> items: array<u32>;

// A solid with what all rays share.
struct Prepared {
    kind: u32,
    a: vec4f,
    b: vec4f,
    c: vec4f,
    d: vec4f,
}

fn kind_of(solid: Solid) -> u32 {
    return solid.a.x & 0xfu;
}

// Numbers 0 to 2.
fn p_of(solid: Solid) -> vec3f {
    return bitcast<vec3f>(vec3u(solid.a.zw, solid.b.x));
}

// Numbers 3 to 5.
fn q_of(solid: Solid) -> vec3f {
    return bitcast<vec3f>(solid.b.yzw);
}

// Number 3.
fn fourth_of(solid: Solid) -> f32 {
    return bitcast<f32>(solid.b.y);
}

// Numbers 3 to 6.
fn rotation_of(solid: Solid) -> vec4f {
    return bitcast<vec4f>(vec4u(solid.b.yzw, solid.c.x));
}

// Numbers 6 to 9.
fn end_of(solid: Solid) -> vec4f {
    return bitcast<vec4f>(solid.c);
}

fn turned(q: vec4f, v: vec3f) -> vec3f {
    let u = cross(q.xyz, v) * 2.0;
    return v + q.w * u + cross(q.xyz, u);
}

fn prepare_triangle(p: vec3f, q: vec3f, r: vec3f) -> Prepared {
    // Planes through the camera and an edge: homogeneous edge functions (Olano and Greer 1997). From differences, which keep their digits far away.
    let normal = cross(q - p, r - p);
    return Prepared(
        TRIANGLE,
        vec4f(cross(q, r - q), dot(normal, p)),
        vec4f(cross(r, p - r), 0.0),
        vec4f(cross(p, q - p), 0.0),
        vec4f(normal, 0.0),
    );
}

// A blade is prepared a triangle at a time.
fn prepare(solid: Solid) -> Prepared {
    let kind = kind_of(solid);
    let p = p_of(solid);
    let end = end_of(solid);
    if kind == CAPSULE {
        let axis = q_of(solid);
        return Prepared(
            kind,
            vec4f(p, end.y),
            vec4f(axis, end.x),
            vec4f(cross(p, axis), dot(p, axis)),
            vec4f(0.0),
        );
    }
    if kind == BOX {
        let q = rotation_of(solid);
        let x = turned(q, vec3f(1.0, 0.0, 0.0));
        let y = turned(q, vec3f(0.0, 1.0, 0.0));
        let z = turned(q, vec3f(0.0, 0.0, 1.0));
        // The camera in the box's frame.
        return Prepared(
            kind,
            vec4f(x, -dot(x, p)),
            vec4f(y, -dot(y, p)),
            vec4f(z, -dot(z, p)),
            vec4f(end.yzw, 0.0),
        );
    }
    if kind == TRIANGLE {
        return prepare_triangle(p, q_of(solid), end.xyz);
    }
    return Prepared(kind, vec4f(p, fourth_of(solid)), vec4f(0.0), vec4f(0.0), vec4f(0.0));
}

fn first_positive(near: f32, far: f32) -> f32 {
    if near > 0.0 {
        return near;
    }
    return select(NOTHING, far, far > 0.0);
}

// Both roots of |t d - c|^2 = r^2, in order; the first is NOTHING if there is none. The discriminant is |d|^2 r^2 - |d x c|^2: no cancellation far away.
fn ball_crossings(d: vec3f, c: vec3f, radius: f32) -> vec2f {
    let dd = dot(d, d);
    let beside = cross(d, c);
    let discriminant = dd * radius * radius - dot(beside, beside);
    if discriminant < 0.0 {
        return vec2f(NOTHING);
    }
    let half = sqrt(discriminant) / dd;
    let mid = dot(d, c) / dd;
    return vec2f(mid - half, mid + half);
}

// A crossing of a capsule for a crossing t of its infinite cylinder: t if it lies within the length of the axis, else the crossing of the end ball on
// the same side.
fn on_capsule(solid: Prepared, d: vec3f, t: f32, axial_rate: f32, side: u32) -> f32 {
    let axial = t * axial_rate - solid.c.w;
    if axial >= 0.0 && axial <= solid.b.w {
        return t;
    }
    let end = solid.a.xyz + select(0.0, solid.b.w, axial > 0.0) * solid.b.xyz;
    return ball_crossings(d, end, solid.a.w)[side];
}

fn hit_capsule(solid: Prepared, d: vec3f) -> f32 {
    // Distance to the axis: |t d x a - p x a| = r, two vectors in the plane across the axis.
    let across = cross(d, solid.b.xyz);
    let a = dot(across, across);
    let moment = solid.c.xyz;
    let radius = solid.a.w;
    let off = dot(cross(across, moment), solid.b.xyz);
    let discriminant = a * radius * radius - off * off;
    if discriminant < 0.0 {
        return NOTHING;
    }
    let axial_rate = dot(d, solid.b.xyz);
    // Along the axis, inside the infinite cylinder: always between the end balls' outer crossings.
    var near = -NOTHING;
    var far = NOTHING;
    if a > LEAST {
        let half = sqrt(discriminant) / a;
        let mid = dot(across, moment) / a;
        near = mid - half;
        far = mid + half;
    } else if dot(moment, moment) > radius * radius {
        return NOTHING;
    }
    let enters = on_capsule(solid, d, near, axial_rate, 0u);
    if enters > 0.0 {
        return enters;
    }
    let leaves = on_capsule(solid, d, far, axial_rate, 1u);
    return select(NOTHING, leaves, leaves > 0.0);
}

fn hit_box(solid: Prepared, ray: vec3f) -> f32 {
    var d = vec3f(dot(solid.a.xyz, ray), dot(solid.b.xyz, ray), dot(solid.c.xyz, ray));
    let origin = vec3f(solid.a.w, solid.b.w, solid.c.w);
    // A ray along a slab's faces is as good as one with a very small slope.
    d = select(d, vec3f(LEAST), abs(d) < vec3f(LEAST));
    let mid = -origin / d;
    let half = abs(solid.d.xyz / d);
    let low = mid - half;
    let high = mid + half;
    let near = max(low.x, max(low.y, low.z));
    let far = min(high.x, min(high.y, high.z));
    if near > far {
        return NOTHING;
    }
    return first_positive(near, far);
}

fn hit_plane(solid: Prepared, d: vec3f) -> f32 {
    // Normal and offset.
    let rate = dot(solid.a.xyz, d);
    if abs(rate) < LEAST {
        return NOTHING;
    }
    let t = solid.a.w / rate;
    return select(NOTHING, t, t > 0.0);
}

fn hit_triangle(solid: Prepared, d: vec3f) -> f32 {
    // t d is a sum of the corners with weights of one sign.
    let offset = solid.a.w;
    let towards = sign(offset) * d;
    let least = min(dot(towards, solid.a.xyz), min(dot(towards, solid.b.xyz), dot(towards, solid.c.xyz)));
    let rate = dot(towards, solid.d.xyz);
    if offset == 0.0 || least < 0.0 || rate < LEAST {
        return NOTHING;
    }
    return abs(offset) / rate;
}

// Depth at which a ray meets a prepared solid first.
fn hit(solid: Prepared, d: vec3f) -> f32 {
    switch solid.kind {
        case BALL: {
            let crossings = ball_crossings(d, solid.a.xyz, solid.a.w);
            return first_positive(crossings.x, crossings.y);
        }
        case CAPSULE: { return hit_capsule(solid, d); }
        case BOX: { return hit_box(solid, d); }
        case PLANE: { return hit_plane(solid, d); }
        default: { return hit_triangle(solid, d); }
    }
}

// Corner of the triangles of a blade, three for each.
fn corner(solid: Solid, k: u32) -> vec3f {
    let at = 2u * (BLADE_CORNERS * (solid.a.x >> 4u & 0xfffu) + k);
    let end = end_of(solid);
    let local = meshes[at].xyz * end.y + meshes[at + 1u].xyz * end.z;
    return p_of(solid) + turned(rotation_of(solid), local);
}

// Contact points of a ball or capsule with a box, in the box's frame: `orchard_multibody`'s narrow phase for these shapes, with the same names.

// Sine between an axis and an edge below which their common normal is undefined: rounding of f32.
const PARALLEL: f32 = 1e-5;
// An edge must part the two by this much better than a face does, or the face is taken [m].
const FACE_FIRST: f32 = 1e-6;
// Distance of the axis from the box from which on closest points have a sound direction [m].
const APART: f32 = 1e-6;
// Cosine between the direction and a face's normal under which the face is not clipped.
const STEEP: f32 = 0.05;
// Contact points of a pair nearer than this are one [m].
const SAME_POINT: f32 = 1e-6;
// Distance below which the normal is taken from the shapes, not from their closest points [m].
const COINCIDENT: f32 = 1e-9;

// A place halfway between two surfaces, the unit normal from the robot's to the tree's, and their distance.
struct Touch {
    p: vec3f,
    n: vec3f,
    gap: f32,
}

// Direction in which two shapes are parted best, their distance along it, and the place on the robot's.
struct Parting {
    n: vec3f,
    gap: f32,
    p_b: vec3f,
}

// Touches of a pair: at most the corners of a clipped face of a box, and the deepest point.
var<private> touches: array<Touch, 9>;
var<private> touches_found: u32;

fn add_touch(p_b: vec3f, n: vec3f, gap: f32) {
    touches[touches_found] = Touch(p_b + n * (0.5 * gap), n, gap);
    touches_found++;
}

// Unit vector along an axis.
fn unit(axis: u32) -> vec3f {
    return vec3f(vec3u(axis) == vec3u(0u, 1u, 2u));
}

fn clamped(top: f32, bottom: f32) -> f32 {
    return select(0.0, clamp(top / bottom, 0.0, 1.0), bottom > 0.0);
}

// Shares of the closest points of two segments from their starts (Ericson, Real-Time Collision Detection, 2005, section 5.1.9): `between` from the second's
// start to the first's.
fn closest_shares(along_a: vec3f, along_b: vec3f, between: vec3f) -> vec2f {
    let aa = dot(along_a, along_a);
    let bb = dot(along_b, along_b);
    let ab = dot(along_a, along_b);
    let ar = dot(along_a, between);
    let br = dot(along_b, between);
    let across = cross(along_a, along_b);
    let s = clamped(ab * br - ar * bb, dot(across, across));
    let t = clamped(ab * s + br, bb);
    return vec2f(clamped(ab * t - ar, aa), t);
}

fn sphere_box(p: vec3f, radius: f32, half: vec3f) {
    let near = clamp(p, -half, half);
    let apart = p - near;
    let distance = length(apart);
    if distance > COINCIDENT {
        add_touch(near, apart / distance, distance - radius);
        return;
    }
    // The centre is inside: out through the nearest face.
    let depth = half - abs(p);
    var face = select(0u, 1u, depth.y < depth.x);
    face = select(face, 2u, depth.z < depth[face]);
    let side = select(1.0, -1.0, p[face] < 0.0);
    let n = unit(face) * side;
    add_touch(p + n * depth[face], n, -depth[face] - radius);
}

// A capsule with axis `a` to `b`.
fn capsule_box(a: vec3f, b: vec3f, radius: f32, half: vec3f, margin: f32) {
    var parting = part_by_axes(a, b, half);
    if parting.gap > margin + radius {
        return;
    }
    if parting.gap > APART {
        parting = part_by_distance(a, b, half, parting);
        if parting.gap >= margin + radius {
            return;
        }
    }
    clip(a, b, radius, half, parting);
    let deepest = parting.gap - radius;
    var is_new = true;
    for (var k = 0u; k < touches_found; k++) {
        is_new = is_new && touches[k].gap > deepest + SAME_POINT;
    }
    if is_new {
        add_touch(parting.p_b, parting.n, deepest);
    }
}

// The best of all face normals and common normals of edges.
fn part_by_axes(a: vec3f, b: vec3f, half: vec3f) -> Parting {
    let along = b - a;
    var best = Parting(vec3f(0.0, 0.0, 1.0), -UNBOUNDED, vec3f(0.0));
    for (var k = 0u; k < 6u; k++) {
        let axis = k >> 1u;
        let n = unit(axis) * select(1.0, -1.0, (k & 1u) != 0u);
        let p = select(b, a, dot(n, a) <= dot(n, b));
        let gap = dot(n, p) - half[axis];
        if gap > best.gap {
            best = Parting(n, gap, p - n * gap);
        }
    }
    for (var edge = 0u; edge < 12u; edge++) {
        let direction = unit(edge >> 2u);
        let start = corner_of(edge) * half;
        // Normals of the faces at the edge, both together: the arc between them is crossed where they are on two sides across the capsule's axis.
        let normals = corner_of(edge) - direction * dot(corner_of(edge), direction);
        let sides = normals * along;
        let is_crossed = sides.x * sides.y < 0.0 || sides.y * sides.z < 0.0 || sides.x * sides.z < 0.0;
        let square = cross(along, direction);
        let size = length(square);
        if !is_crossed || size <= PARALLEL * length(along) {
            continue;
        }
        let n = square * (sign(dot(square, normals)) / size);
        let gap = dot(n, a - start);
        if gap > best.gap + FACE_FIRST {
            let square = cross(along, n);
            let p_b = start + direction * (dot(square, a - start) / dot(square, direction));
            best = Parting(n, gap, p_b);
        }
    }
    return best;
}

// Signs of the corner where an edge begins; edges 0 to 3 are along x, and so on.
fn corner_of(edge: u32) -> vec3f {
    let one = select(1.0, -1.0, (edge & 1u) != 0u);
    let other = select(1.0, -1.0, (edge & 2u) != 0u);
    switch edge >> 2u {
        case 0u: {
            return vec3f(-1.0, one, other);
        }
        case 1u: {
            return vec3f(one, -1.0, other);
        }
        default: {
            return vec3f(one, other, -1.0);
        }
    }
}

// Closest points of an axis and a box that are apart, where they are farther than `parting`.
fn part_by_distance(a: vec3f, b: vec3f, half: vec3f, parting: Parting) -> Parting {
    var best = parting;
    var distance = UNBOUNDED;
    for (var k = 0u; k < 2u; k++) {
        let p = select(a, b, k != 0u);
        let near = clamp(p, -half, half);
        let apart = p - near;
        let outside = vec3u(apart != vec3f(0.0));
        // Over a face.
        if outside.x + outside.y + outside.z == 1u && length(apart) < distance {
            distance = length(apart);
            best = Parting(apart / distance, distance, near);
        }
    }
    let along = b - a;
    for (var edge = 0u; edge < 12u; edge++) {
        let axis = edge >> 2u;
        let start = corner_of(edge) * half;
        let side = unit(axis) * (2.0 * half[axis]);
        let shares = closest_shares(along, side, a - start);
        let p_b = start + side * shares.y;
        let apart = a + along * shares.x - p_b;
        if length(apart) >= distance {
            continue;
        }
        distance = length(apart);
        var n = apart / distance;
        if all(shares > vec2f(0.0)) && all(shares < vec2f(1.0)) {
            // Between the ends the common normal has less of the rounding of places.
            let square = cross(along, side);
            n = square * (sign(dot(square, apart)) / length(square));
        }
        best = Parting(n, distance, p_b);
    }
    return best;
}

// The axis, clipped against the sides of the box's face along the parting direction.
fn clip(a: vec3f, b: vec3f, radius: f32, half: vec3f, parting: Parting) {
    let n = parting.n;
    var face = select(0u, 1u, abs(n.y) > abs(n.x));
    face = select(face, 2u, abs(n.z) > abs(n[face]));
    let cosine = abs(n[face]);
    if cosine <= STEEP {
        return;
    }
    let normal = unit(face) * sign(n[face]);
    var low = 0.0;
    var high = 1.0;
    for (var k = 0u; k < 4u; k++) {
        let axis = (face + 1u + (k >> 1u)) % 3u;
        let way = select(1.0, -1.0, (k & 1u) != 0u);
        // Outward from the side of the face, square to the direction.
        let outward = unit(axis) * way - normal * (way * n[axis] / n[face] * sign(n[face]));
        let edge = unit(axis) * (way * half[axis]) + normal * half[face];
        let from_a = dot(outward, a - edge);
        let from_b = dot(outward, b - edge);
        if from_a > 0.0 && from_b > 0.0 {
            return;
        }
        let cut = from_a / (from_a - from_b);
        low = select(low, max(low, cut), from_a > 0.0);
        high = select(high, min(high, cut), from_b > 0.0);
    }
    if low > high {
        return;
    }
    for (var k = 0u; k < 2u; k++) {
        let p = a + (b - a) * select(low, high, k != 0u);
        let gap = (dot(normal, p) - half[face]) / cosine;
        if k == 0u || (high - low) * length(b - a) > SAME_POINT {
            add_touch(p - n * gap, n, gap - radius);
        }
    }
}

// Two balls or capsules, by axis and radius.
fn round_round(a: vec3f, along_a: vec3f, radius_a: f32, b: vec3f, along_b: vec3f, radius_b: f32) {
    let shares = closest_shares(along_a, along_b, a - b);
    let p_b = b + along_b * shares.y;
    let apart = (a - b) + along_a * shares.x - along_b * shares.y;
    let distance = length(apart);
    var n = vec3f(0.0, 0.0, 1.0);
    if distance > COINCIDENT {
        n = apart / distance;
    } else {
        // The axes cross: part them along their common normal, or upwards if they have none.
        let square = cross(along_a, along_b);
        if length(square) > COINCIDENT {
            n = normalize(square);
        }
    }
    add_touch(p_b + n * radius_b, n, distance - radius_a - radius_b);
}

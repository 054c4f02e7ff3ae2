// Contact points of two boxes, in the frame of the second: `polytope.rs` of `orchard_multibody::contact`, with the same names.

// Corners of a face that is clipped by another one.
var<private> polygon: array<vec3f, 8>;
var<private> corners: u32;

// A box whose centre and axes are in the frame of another one.
struct Block {
    p: vec3f,
    axes: mat3x3f,
    half: vec3f,
}

fn signs_of(v: vec3f) -> vec3f {
    return select(vec3f(1.0), vec3f(-1.0), v < vec3f(0.0));
}

// Signs of one of the eight corners.
fn corner_signs(corner: u32) -> vec3f {
    return select(vec3f(-1.0), vec3f(1.0), (vec3u(corner) & vec3u(4u, 2u, 1u)) != vec3u(0u));
}

fn box_box(a: Block, half: vec3f, margin: f32) {
    var parting = part_boxes_by_axes(a, half);
    if parting.gap > margin {
        return;
    }
    if parting.gap > APART {
        parting = part_boxes_by_distance(a, half, parting);
        if parting.gap >= margin {
            return;
        }
    }
    clip_faces(a, half, parting.n);
    var is_new = true;
    for (var k = 0u; k < touches_found; k++) {
        is_new = is_new && touches[k].gap > parting.gap + SAME_POINT;
    }
    if is_new {
        add_touch(parting.p_b, parting.n, parting.gap);
    }
}

// The best of all face normals and square_to_both normals of edges.
fn part_boxes_by_axes(a: Block, half: vec3f) -> Parting {
    var best = Parting(vec3f(0.0, 0.0, 1.0), -UNBOUNDED, vec3f(0.0));
    for (var k = 0u; k < 6u; k++) {
        let axis = k >> 1u;
        let n = unit(axis) * select(1.0, -1.0, (k & 1u) != 0u);
        let p = a.p - a.axes * (signs_of(n * a.axes) * a.half);
        let gap = dot(n, p) - half[axis];
        if gap > best.gap {
            best = Parting(n, gap, p - n * gap);
        }
    }
    for (var k = 0u; k < 6u; k++) {
        let axis = k >> 1u;
        let n = a.axes[axis] * select(1.0, -1.0, (k & 1u) != 0u);
        // Of the second box the corner farthest towards the first.
        let p = signs_of(n) * half;
        let gap = dot(n, a.p - p) - a.half[axis];
        if gap > best.gap {
            best = Parting(n, gap, p);
        }
    }
    for (var k = 0u; k < 9u; k++) {
        let along_a = a.axes[k / 3u];
        let along_b = unit(k % 3u);
        let square_to_both = cross(along_a, along_b);
        let size = length(square_to_both);
        if size <= PARALLEL {
            continue;
        }
        let n = square_to_both * (select(1.0, -1.0, dot(square_to_both, a.p) < 0.0) / size);
        // Middles of the edges that face each other.
        let p_a = a.p - a.axes * (signs_of(n * a.axes) * a.half * (vec3f(1.0) - unit(k / 3u)));
        let p_b = signs_of(n) * half * (vec3f(1.0) - along_b);
        let gap = dot(n, p_a - p_b);
        if gap > best.gap + FACE_FIRST {
            let square = cross(along_a, n);
            best = Parting(n, gap, p_b + along_b * (dot(square, p_a - p_b) / dot(square, along_b)));
        }
    }
    return best;
}

// Closest points of boxes that are apart, where they are farther than `parting`.
fn part_boxes_by_distance(a: Block, half: vec3f, parting: Parting) -> Parting {
    var best = parting;
    var distance = UNBOUNDED;
    for (var corner = 0u; corner < 8u; corner++) {
        // Corners of the first over faces of the second, and the other way round.
        let of_first = a.p + a.axes * (corner_signs(corner) * a.half);
        let near = clamp(of_first, -half, half);
        let over = of_first - near;
        if is_over_face(over) && length(over) < distance {
            distance = length(over);
            best = Parting(over / distance, distance, near);
        }
        let of_second = corner_signs(corner) * half;
        let p = (of_second - a.p) * a.axes;
        let under = a.axes * (clamp(p, -a.half, a.half) - p);
        if is_over_face(p - clamp(p, -a.half, a.half)) && length(under) < distance {
            distance = length(under);
            best = Parting(under / distance, distance, of_second);
        }
    }
    for (var edge_a = 0u; edge_a < 12u; edge_a++) {
        let start_a = a.p + a.axes * (corner_of(edge_a) * a.half);
        let along_a = a.axes[edge_a >> 2u] * (2.0 * a.half[edge_a >> 2u]);
        for (var edge = 0u; edge < 12u; edge++) {
            let start = corner_of(edge) * half;
            let along = unit(edge >> 2u) * (2.0 * half[edge >> 2u]);
            let shares = closest_shares(along_a, along, start_a - start);
            let p_b = start + along * shares.y;
            let apart = start_a + along_a * shares.x - p_b;
            if length(apart) >= distance {
                continue;
            }
            distance = length(apart);
            var n = apart / distance;
            if all(shares > vec2f(0.0)) && all(shares < vec2f(1.0)) {
                let square = cross(along_a, along);
                n = square * (sign(dot(square, apart)) / length(square));
            }
            best = Parting(n, distance, p_b);
        }
    }
    return best;
}

// True if a corner with this way to the closest point of a box, in its frame, is over one of its faces.
fn is_over_face(way: vec3f) -> bool {
    let outside = vec3u(way != vec3f(0.0));
    return outside.x + outside.y + outside.z == 1u;
}

// Clips the faces of both along the direction against each other; the better aligned one gives the plane and the sides.
fn clip_faces(a: Block, half: vec3f, n: vec3f) {
    let n_a = n * a.axes;
    let face_a = largest(abs(n_a));
    let face_b = largest(abs(n));
    if abs(n[face_b]) >= abs(n_a[face_a]) {
        cut_face(n, half, face_b, a.p, a.axes, -signs_of(n_a) * unit(face_a), a.half);
        for (var k = 0u; k < corners; k++) {
            let gap = (signs_of(n)[face_b] * polygon[k][face_b] - half[face_b]) / abs(n[face_b]);
            add_new_touch(polygon[k] - n * gap, n, gap);
        }
    } else {
        // In the frame of the first one.
        let axes = transpose(a.axes);
        cut_face(-n_a, a.half, face_a, -a.p * a.axes, axes, signs_of(n) * unit(face_b), half);
        for (var k = 0u; k < corners; k++) {
            let gap = (-signs_of(n_a)[face_a] * polygon[k][face_a] - a.half[face_a]) / abs(n_a[face_a]);
            add_new_touch(a.p + a.axes * polygon[k], n, gap);
        }
    }
}

fn largest(v: vec3f) -> u32 {
    let face = select(0u, 1u, v.y > v.x);
    return select(face, 2u, v.z > v[face]);
}

fn add_new_touch(p_b: vec3f, n: vec3f, gap: f32) {
    let p = p_b + n * (0.5 * gap);
    var is_new = touches_found < 8u;
    for (var k = 0u; k < touches_found; k++) {
        is_new = is_new && length(touches[k].p - p) > SAME_POINT;
    }
    if is_new {
        add_touch(p_b, n, gap);
    }
}

// Puts a face of another box, with its outward direction along one of its axes, into `polygon`, and cuts it by the sides of a box's face along `up` [Sutherland and Hodgman 1974].
fn cut_face(up: vec3f, half: vec3f, face: u32, p: vec3f, axes: mat3x3f, outward: vec3f, half_other: vec3f) {
    let other = largest(abs(outward));
    let one = (other + 1u) % 3u;
    let two = (other + 2u) % 3u;
    for (var k = 0u; k < 4u; k++) {
        var at = outward;
        at[one] = select(-1.0, 1.0, k == 1u || k == 2u);
        at[two] = select(-1.0, 1.0, k >= 2u);
        polygon[k] = p + axes * (at * half_other);
    }
    corners = 4u;
    let normal = signs_of(up) * unit(face);
    for (var k = 0u; k < 4u; k++) {
        let axis = (face + 1u + (k >> 1u)) % 3u;
        let way = select(1.0, -1.0, (k & 1u) != 0u);
        let side = unit(axis) * way - normal * (way * up[axis] / abs(up[face]));
        cut(side, dot(side, unit(axis) * (way * half[axis]) + normal * half[face]));
    }
}

// Keeps what lies under a plane.
fn cut(normal: vec3f, offset: f32) {
    var kept: array<vec3f, 8>;
    var count = 0u;
    for (var k = 0u; k < corners; k++) {
        let from_corner = polygon[select(k - 1u, corners - 1u, k == 0u)];
        let to_corner = polygon[k];
        let low = dot(normal, from_corner) - offset;
        let high = dot(normal, to_corner) - offset;
        if (low <= 0.0) != (high <= 0.0) && count < 8u {
            kept[count] = from_corner + (to_corner - from_corner) * (low / (low - high));
            count++;
        }
        if high <= 0.0 && count < 8u {
            kept[count] = to_corner;
            count++;
        }
    }
    polygon = kept;
    corners = count;
}

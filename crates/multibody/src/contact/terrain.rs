//! Contact points of a body on terrain.
//!
//! The surface is made of triangles, but a contact belongs to a corner, edge or face of it only where the distance
//! between body and surface has a minimum of its own. The seams between triangles of one plane, and hollows, are
//! therefore no obstacles. All positions are in the field's frame.

use orchard_geometry::height_field::{
    Cells, HeightField, NEIGHBOURS, Node, TrianglePart, closest_on_triangle,
};
use orchard_geometry::{Aabb, Pose, Vec3, transform};

use super::core::Core;
use super::touch::{SAME_POINT, Touch};

/// Cosine by which a direction may leave the normals of a corner or edge: round-off.
const ROUND_OFF: f64 = 1e-9;
/// Sine by which a corner of the surface may lie lower under a face than its neighbour and keep its contact: a body on
/// a ridge or plateau must not lose one end of it whenever it tilts.
const LEVEL: f64 = 0.05;
/// Sine between two edges under which they have no common normal; distance \[m\] under which points have none.
const PARALLEL: f64 = 1e-9;

/// Appends the contact points (normals from the field to the body, in the world) whose gap is under `margin`.
pub(super) fn touches(
    body: &Core,
    field: &HeightField,
    x_world_field: &Pose,
    margin: f64,
    out: &mut Vec<Touch>,
) {
    let first = out.len();
    let reach = margin + body.radius;
    for p in body.vertices {
        under_point(p, field, body.radius, margin, out);
    }
    let around = bounds(body.vertices).grown(reach);
    if let Some(cells) = field.cells_under(&around)
        && around.min.z <= field.bounds().max.z
        && body.vertices.len() > 1
    {
        for node in cells.nodes() {
            on_node(node, body, field, margin, out);
            edges_across(node, &around, body, field, margin, out);
        }
    }
    for touch in &mut out[first..] {
        touch.p_world = transform(x_world_field, &touch.p_world);
        touch.n_world = x_world_field.rotation * touch.n_world;
    }
}

fn bounds(points: &[Vec3]) -> Aabb {
    let first = Aabb { min: points[0], max: points[0] };
    points.iter().fold(first, |all, p| all.union(&Aabb { min: *p, max: *p }))
}

fn is_under(p: &Vec3, field: &HeightField) -> bool {
    field.height(p.x, p.y).is_some_and(|z| p.z < z)
}

/// A ball about a point: over the surface it meets every face, edge and corner that has a closest point to it;
/// under it, it leaves by the shortest way.
fn under_point(p: &Vec3, field: &HeightField, radius: f64, margin: f64, out: &mut Vec<Touch>) {
    let around = Aabb { min: *p, max: *p }.grown(radius + margin);
    if around.min.z > field.bounds().max.z {
        return;
    }
    let Some(cells) = field.cells_under(&around) else { return };
    if is_under(p, field) {
        from_below(p, field, cells, radius, out);
        return;
    }
    let first = out.len();
    for cell in cells.iter() {
        for triangle in HeightField::triangles_of(cell) {
            let Some(corners) = corners_of(field, triangle) else { continue };
            let (foot, part) = closest_on_triangle(p, &corners);
            let away = p - foot;
            let distance = away.norm();
            if distance >= radius + margin {
                continue;
            }
            let n = match part {
                TrianglePart::Face => normal_of(&corners),
                _ if distance <= PARALLEL => normal_of(&corners),
                _ => away / distance,
            };
            let is_nearest = match part {
                // From over the surface, a face that is met from below is the far side of a hill.
                TrianglePart::Face => n.dot(&away) >= -PARALLEL,
                TrianglePart::Side(k) => {
                    let [u, v, w] = [triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
                    let beyond = field.node(across(u, v, w));
                    let is_clear = |other| {
                        let inward = square_to(&(corners[(k + 1) % 3] - corners[k]), other - corners[k]);
                        n.dot(&inward) <= ROUND_OFF * inward.norm()
                    };
                    n.z >= 0.0 && beyond.is_none_or(is_clear)
                }
                TrianglePart::Corner(k) => is_normal_at(triangle[k], &n, ROUND_OFF, field),
            };
            let is_new = out[first..].iter().all(|touch| {
                let other = touch.p_world - touch.n_world * (0.5 * touch.gap);
                (other - foot).norm() > SAME_POINT
            });
            if is_nearest && is_new {
                out.push(Touch::from_b(foot, n, distance - radius));
            }
        }
    }
}

/// The node beyond a side of a triangle: it and the third corner make a parallelogram with the side.
fn across(u: Node, v: Node, w: Node) -> Node {
    [u[0] + v[0] - w[0], u[1] + v[1] - w[1]]
}

fn corners_of(field: &HeightField, [a, b, c]: [Node; 3]) -> Option<[Vec3; 3]> {
    Some([field.node(a)?, field.node(b)?, field.node(c)?])
}

fn normal_of([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a)).normalize()
}

/// Out of the ground by the shortest way that the cells offer, and out of the other faces of a hollow.
fn from_below(p: &Vec3, field: &HeightField, cells: Cells, radius: f64, out: &mut Vec<Touch>) {
    let mut best: Option<(f64, Vec3, Vec3)> = None;
    for triangle in field.triangles(cells) {
        let foot = closest_on_triangle(p, &triangle).0;
        let depth = (foot - p).norm();
        if best.is_none_or(|(least, ..)| depth < least) {
            let n = if depth > PARALLEL { (foot - p) / depth } else { normal_of(&triangle) };
            best = Some((depth, foot, n));
        }
    }
    let Some((depth, nearest, n)) = best else { return };
    out.push(Touch::from_b(nearest, n, -depth - radius));
    for triangle in field.triangles(cells) {
        let (foot, part) = closest_on_triangle(p, &triangle);
        // The faces of a hollow lie above each other's planes, those of a hill below.
        if part == TrianglePart::Face && n.dot(&(foot - nearest)) > SAME_POINT {
            out.push(Touch::from_b(foot, normal_of(&triangle), -(foot - p).norm() - radius));
        }
    }
}

/// The part of a vector square to a direction.
fn square_to(direction: &Vec3, v: Vec3) -> Vec3 {
    v - direction * (v.dot(direction) / direction.norm_squared())
}

/// True if a direction is among the normals of a corner of the surface: up, and no neighbour above the plane across.
fn is_normal_at(node: Node, n: &Vec3, tolerance: f64, field: &HeightField) -> bool {
    let Some(p) = field.node(node) else { return false };
    n.z >= 0.0
        && NEIGHBOURS.iter().filter_map(|step| field.node([node[0] + step[0], node[1] + step[1]])).all(
            |other| {
                let spoke = other - p;
                n.dot(&spoke) <= tolerance * spoke.norm()
            },
        )
}

/// A corner of the surface against the faces and edges of the body.
fn on_node(node: Node, body: &Core, field: &HeightField, margin: f64, out: &mut Vec<Touch>) {
    if field.is_flat(node) {
        return;
    }
    let Some(p) = field.node(node) else { return };
    let mut best: Option<(f64, Vec3)> = None;
    let (mut outside, mut highest) = (0, f64::NEG_INFINITY);
    for plane in body.planes {
        let height = plane.height(&p);
        if height >= margin {
            return;
        }
        outside += usize::from(height > 0.0);
        highest = highest.max(height);
        if best.is_none_or(|(top, _)| height > top) && is_normal_at(node, &-plane.normal, LEVEL, field) {
            best = Some((height, -plane.normal));
        }
    }
    if let Some((gap, n)) = best
        && (outside == 0 || (outside == 1 && gap == highest))
    {
        // It is in front of this face, or inside.
        out.push(Touch::from_b(p, n, gap));
    } else if outside > 0 || !body.is_solid() {
        beside_edges(&p, node, body, field, margin, out);
    }
}

/// A corner of the surface outside the core, against the edges that are closest to it between their ends.
fn beside_edges(p: &Vec3, node: Node, body: &Core, field: &HeightField, margin: f64, out: &mut Vec<Touch>) {
    for edge in body.edges() {
        let [start, end] = body.ends(edge);
        let along = end - start;
        let share = along.dot(&(p - start)) / along.norm_squared();
        let closest = start + along * share;
        let distance = (closest - p).norm();
        if !(share > 0.0 && share < 1.0 && distance > PARALLEL && distance < margin + body.radius) {
            continue;
        }
        let n = (closest - p) / distance;
        let faces_it = !body.is_solid() || beyond(&body.normals_at(edge), &n).is_none();
        if faces_it && is_normal_at(node, &n, ROUND_OFF, field) && !is_under(&closest, field) {
            out.push(Touch::from_b(*p, n, distance - body.radius));
        }
    }
}

/// The face beyond whose normal the direction against `n` lies, of the two with normals `arc` that meet at an edge of
/// the body; `None` if it lies between.
fn beyond([f, g]: &[Vec3; 2], n: &Vec3) -> Option<Vec3> {
    let (arc, down) = (f.cross(g), -n);
    if f.cross(&down).dot(&arc) < -ROUND_OFF {
        Some(*f)
    } else if down.cross(g).dot(&arc) < -ROUND_OFF {
        Some(*g)
    } else {
        None
    }
}

/// The ridges from a node to three of its neighbours against the edges of the body.
fn edges_across(
    node: Node,
    around: &Aabb,
    body: &Core,
    field: &HeightField,
    margin: f64,
    out: &mut Vec<Touch>,
) {
    let Some(start) = field.node(node) else { return };
    let at = |k: usize| [node[0] + NEIGHBOURS[k % 6][0], node[1] + NEIGHBOURS[k % 6][1]];
    for k in 0..3 {
        let Some(end) = field.node(at(k)) else { continue };
        let ridge = Aabb { min: start.inf(&end), max: start.sup(&end) };
        if !ridge.overlaps(around) {
            continue;
        }
        let along = end - start;
        let inward = |side: usize| field.node(at(side)).map(|p| square_to(&along, p - start));
        let ridge = Ridge { start, along, inward: [inward(k + 1), inward(k + 5)] };
        if !ridge.is_convex() {
            continue;
        }
        for edge in body.edges() {
            let [p, q] = body.ends(edge);
            let arc = body.is_solid().then(|| body.normals_at(edge));
            let Some(crossing) = ridge.cross(&p, &(q - p), arc) else { continue };
            if crossing.gap < margin + body.radius && crossing.is_real(body, field) {
                out.push(Touch::from_b(crossing.p_ridge, crossing.n, crossing.gap - body.radius));
            }
        }
    }
}

/// An edge of the surface.
struct Ridge {
    start: Vec3,
    along: Vec3,
    /// Square to the edge, into the triangles to its left and right; `None` beyond the border.
    inward: [Option<Vec3>; 2],
}

/// Crossing of a line of the body over or under a ridge.
struct Crossing {
    p_ridge: Vec3,
    p_body: Vec3,
    /// Unit direction up from the ridge.
    n: Vec3,
    gap: f64,
}

impl Ridge {
    /// True if the surface bends down from the ridge, or ends there.
    fn is_convex(&self) -> bool {
        let [Some(left), Some(right)] = self.inward else { return true };
        let normal = self.along.cross(&left);
        normal.dot(&right) < -ROUND_OFF * normal.norm() * right.norm()
    }

    /// The face to the left (0) or right (1) that a direction leans over: it is no normal of the ridge then.
    fn leans_over(&self, n: &Vec3) -> Option<usize> {
        self.inward.iter().position(|side| side.is_some_and(|side| n.dot(&side) > ROUND_OFF * side.norm()))
    }

    /// Upward normal of the face to the left (0) or right (1).
    fn normal(&self, side: usize) -> Option<Vec3> {
        let across = self.along.cross(&self.inward[side]?);
        Some(if side == 0 { across.normalize() } else { -across.normalize() })
    }

    /// Crossing of the ridge and an edge of the body with the normals of its faces, along their common normal. If that
    /// normal leans over one of the four faces, the normal of that face is used, so that an edge that comes to lie in
    /// a face keeps its contact.
    fn cross(&self, start: &Vec3, along: &Vec3, arc: Option<[Vec3; 2]>) -> Option<Crossing> {
        let common = self.along.cross(along);
        let size = common.norm();
        if size <= PARALLEL * self.along.norm() * along.norm() {
            return None;
        }
        let mut n = common * (if common.z < 0.0 { -1.0 } else { 1.0 } / size);
        match (self.leans_over(&n), arc.and_then(|arc| beyond(&arc, &n))) {
            (None, None) => {}
            (Some(side), None) => n = self.normal(side)?,
            (None, Some(face)) => n = -face,
            _ => return None,
        }
        if self.leans_over(&n).is_some() || arc.is_some_and(|arc| beyond(&arc, &n).is_some()) {
            return None;
        }
        let between = start - self.start;
        let (square_line, square_ridge) = (along.cross(&n), self.along.cross(&n));
        let on_ridge = square_line.dot(&between) / square_line.dot(&self.along);
        let on_line = -square_ridge.dot(&between) / square_ridge.dot(along);
        if !((0.0..=1.0).contains(&on_ridge) && (0.0..=1.0).contains(&on_line)) {
            return None;
        }
        let (p_ridge, p_body) = (self.start + self.along * on_ridge, start + along * on_line);
        Some(Crossing { p_ridge, p_body, n, gap: n.dot(&(p_body - p_ridge)) })
    }
}

impl Crossing {
    /// True if an overlap is real, not one of lines that pass far from each other.
    fn is_real(&self, body: &Core, field: &HeightField) -> bool {
        self.gap >= 0.0
            || (is_under(&self.p_body, field)
                && body.planes.iter().all(|plane| plane.height(&self.p_ridge) <= PARALLEL))
    }
}

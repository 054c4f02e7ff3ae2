//! Contact points of two convex solids with corners, or of one and a sphere or capsule.
//!
//! The direction of least overlap follows from all faces and pairs of edges (separating axes; Gregorius, "The
//! Separating Axis Test between Convex Polyhedra", GDC 2013); cores that are apart take that of their closest points.
//! Both faces along it, clipped against each other, give the points.

use orchard_geometry::Vec3;

use super::core::{Core, Plane};
use super::touch::{SAME_POINT, Touch, closest_points_of_segments};

/// Sine between two edges below which their common normal is undefined.
const PARALLEL: f64 = 1e-6;
/// An edge pair must part two solids by this much better than a face does, or the face is taken \[m\]: the normal
/// of a body at rest on a face must not follow its round-off.
const FACE_FIRST: f64 = 1e-7;
/// Distance of the cores from which on their closest points have a sound direction \[m\].
const APART: f64 = 1e-6;
/// Cosine between the direction and a face's normal under which the face is not clipped.
const STEEP: f64 = 0.05;

/// Direction and features that separate two cores best.
struct Parting {
    /// Unit direction from b to a.
    n_world: Vec3,
    /// Distance of the cores along it; negative while they overlap.
    gap: f64,
    /// The place on b's core.
    p_b: Vec3,
}

/// Memory of the clipping.
#[derive(Debug, Clone, Default)]
pub(super) struct Clipper {
    polygon: Vec<Vec3>,
    clipped: Vec<Vec3>,
}

/// Appends the contact points of two cores, at least one of them solid, if their gap is under `margin`.
pub(super) fn touches(a: &Core, b: &Core, margin: f64, clipper: &mut Clipper, out: &mut Vec<Touch>) {
    let radius = a.radius + b.radius;
    let Some(mut parting) = part_by_axes(a, b, margin + radius) else { return };
    if parting.gap > APART {
        if let Some(closest) = part_by_distance(a, b, &parting) {
            parting = closest;
        }
        if parting.gap >= margin + radius {
            return;
        }
    }
    let first = out.len();
    clip(a, b, &parting, clipper, out);
    // Where corners or edges meet, the faces may miss each other.
    let deepest =
        Touch::from_b(parting.p_b + parting.n_world * b.radius, parting.n_world, parting.gap - radius);
    if out[first..].iter().all(|touch| touch.gap > deepest.gap + SAME_POINT) {
        out.push(deepest);
    }
}

/// The best of all face normals and common normals of edges; `None` if one parts the cores by more than `limit`.
fn part_by_axes(a: &Core, b: &Core, limit: f64) -> Option<Parting> {
    let mut best = Parting { n_world: Vec3::z(), gap: f64::NEG_INFINITY, p_b: Vec3::zeros() };
    for (solid, other, sign) in [(b, a, 1.0), (a, b, -1.0)] {
        for plane in solid.planes {
            let p = other.support(&-plane.normal);
            let gap = plane.height(&p);
            if gap > limit {
                return None;
            }
            if gap > best.gap {
                let p_b = if sign > 0.0 { p - plane.normal * gap } else { p };
                best = Parting { n_world: plane.normal * sign, gap, p_b };
            }
        }
    }
    for edge_a in a.edges() {
        let [a_start, a_end] = a.ends(edge_a);
        let along_a = a_end - a_start;
        let arc_a = a.is_solid().then(|| a.normals_at(edge_a));
        for edge_b in b.edges() {
            // The arcs must cross: tested against the other edge's direction first, which costs least.
            let [b_start, b_end] = b.ends(edge_b);
            let along_b = b_end - b_start;
            let arc_b = b.is_solid().then(|| b.normals_at(edge_b));
            if !is_crossed(arc_a, &along_b) || !is_crossed(arc_b, &along_a) {
                continue;
            }
            let common = along_a.cross(&along_b);
            let size = common.norm();
            if size <= PARALLEL * (along_a.norm() * along_b.norm()) {
                continue;
            }
            // Out of b, and into a: arcs that cross on opposite sides are none of theirs.
            let side = match (arc_b, arc_a) {
                (Some([f, g]), _) => common.dot(&(f + g)),
                (None, Some([f, g])) => -common.dot(&(f + g)),
                (None, None) => continue,
            };
            let n_world = common * (side.signum() / size);
            if arc_a.is_some_and(|[f, g]| n_world.dot(&(f + g)) >= 0.0) {
                continue;
            }
            let gap = n_world.dot(&(a_start - b_start));
            if gap > limit {
                return None;
            }
            if gap > best.gap + FACE_FIRST {
                // Where the line of b passes under that of a.
                let square = along_a.cross(&n_world);
                let p_b = b_start + along_b * (square.dot(&(a_start - b_start)) / square.dot(&along_b));
                best = Parting { n_world, gap, p_b };
            }
        }
    }
    best.gap.is_finite().then_some(best)
}

/// True if the normals of an edge lie on both sides of the plane across a direction; always for an axis, whose
/// normals fill a circle.
fn is_crossed(arc: Option<[Vec3; 2]>, direction: &Vec3) -> bool {
    arc.is_none_or(|[f, g]| f.dot(direction) * g.dot(direction) < 0.0)
}

/// Closest points of cores that are apart, where they are farther than `parting`: the nearest of all pairs of
/// vertex and face, and of two edges. Those that its direction shows to be farther are passed over.
///
/// Exact; parry's GJK stops up to 1e-6 m too far out, and its direction is then off by far more.
fn part_by_distance(a: &Core, b: &Core, parting: &Parting) -> Option<Parting> {
    let n = parting.n_world;
    let mut best = (f64::INFINITY, Vec3::zeros(), Vec3::zeros());
    let consider = |best: &mut (f64, Vec3, Vec3), p_a: Vec3, p_b: Vec3| {
        let distance = (p_a - p_b).norm();
        if distance < best.0 {
            *best = (distance, p_a, p_b);
        }
    };
    for (points, solid, sign) in [(a, b, 1.0), (b, a, -1.0)] {
        let reach = solid.support(&(n * sign)).dot(&n) * sign;
        for p in points.vertices {
            for (face, plane) in solid.planes.iter().enumerate() {
                let height = plane.height(p);
                if height <= 0.0 || height >= best.0 || p.dot(&n) * sign - reach >= best.0 {
                    continue;
                }
                let foot = p - plane.normal * height;
                if solid.is_on_face(face, &foot) {
                    let (p_a, p_b) = if sign > 0.0 { (*p, foot) } else { (foot, *p) };
                    consider(&mut best, p_a, p_b);
                }
            }
        }
    }
    let reach = b.support(&n).dot(&n);
    for [a0, a1] in a.segments() {
        let low = a0.dot(&n).min(a1.dot(&n));
        if low - reach >= best.0 {
            continue;
        }
        for [b0, b1] in b.segments() {
            if low - b0.dot(&n).max(b1.dot(&n)) < best.0 {
                let (p_a, p_b) = closest_points_of_segments(&a0, &a1, &b0, &b1);
                consider(&mut best, p_a, p_b);
            }
        }
    }
    let (gap, p_a, p_b) = best;
    (gap.is_finite() && gap > parting.gap + SAME_DISTANCE).then(|| Parting {
        n_world: (p_a - p_b) / gap,
        gap,
        p_b,
    })
}

/// Distances that differ by less are one \[m\]: the axis is then that of a face or edge pair, free of round-off.
const SAME_DISTANCE: f64 = 1e-9;

/// Clips the faces of both cores along the parting direction against each other.
fn clip(a: &Core, b: &Core, parting: &Parting, clipper: &mut Clipper, out: &mut Vec<Touch>) {
    let n = parting.n_world;
    let (face_a, face_b) = (a.face_along(&-n), b.face_along(&n));
    let cosine = |face: Option<(usize, f64)>| face.map_or(0.0, |(_, cosine)| cosine);
    // The better aligned face gives the plane and the sides.
    let on_b = cosine(face_b) >= cosine(face_a);
    let (still, face, up, other, other_face) =
        if on_b { (b, face_b, n, a, face_a) } else { (a, face_a, -n, b, face_b) };
    let Some((face, cosine)) = face.filter(|&(_, cosine)| cosine > STEEP) else { return };
    clipper.polygon.clear();
    clipper.polygon.extend(other.boundary(other_face.map_or(0, |(index, _)| index)));
    let around = still.boundary(face);
    for (from, to) in around.clone().zip(around.cycle().skip(1)) {
        let outward = (to - from).cross(&up);
        clipper.cut(&Plane { normal: outward, offset: outward.dot(&from) });
    }
    let first = out.len();
    let radius = a.radius + b.radius;
    for p in &clipper.polygon {
        let gap = still.planes[face].height(p) / cosine;
        let p_b = if on_b { p - up * gap } else { p + n * b.radius };
        let touch = Touch::from_b(p_b, n, gap - radius);
        if out[first..].iter().all(|other| (other.p_world - touch.p_world).norm() > SAME_POINT) {
            out.push(touch);
        }
    }
}

impl Clipper {
    /// Keeps what lies under a plane (Sutherland and Hodgman 1974).
    fn cut(&mut self, plane: &Plane) {
        self.clipped.clear();
        for (index, to) in self.polygon.iter().enumerate() {
            let from = &self.polygon[index.checked_sub(1).unwrap_or(self.polygon.len() - 1)];
            let (low, high) = (plane.height(from), plane.height(to));
            if (low <= 0.0) != (high <= 0.0) {
                self.clipped.push(from + (to - from) * (low / (low - high)));
            }
            if high <= 0.0 {
                self.clipped.push(*to);
            }
        }
        std::mem::swap(&mut self.polygon, &mut self.clipped);
    }
}

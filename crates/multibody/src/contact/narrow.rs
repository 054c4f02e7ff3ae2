//! Narrow phase: contact points of two placed shapes.

use orchard_geometry::{Pose, Shape, Vec3, inverse_transform, transform};

use super::core::{Core, CoreBuffers};
use super::polytope::{self, Clipper};
use super::terrain;
use super::touch::{SAME_POINT, Touch, closest_points_of_segments};

/// Distance below which the normal is taken from the shapes, not from their closest points \[m\].
const COINCIDENT: f64 = 1e-9;

/// Most contact points of a pair: the corners of a box.
const MOST_POINTS: usize = 8;

/// A sphere or capsule: all points within `radius` of a segment.
struct Round {
    start: Vec3,
    end: Vec3,
    radius: f64,
}

impl Round {
    fn of(shape: &Shape, x_world_shape: &Pose) -> Option<Round> {
        let start = x_world_shape.translation.vector;
        match *shape {
            Shape::Sphere { radius } => Some(Round { start, end: start, radius }),
            Shape::Capsule { radius, length } => {
                Some(Round { start, end: transform(x_world_shape, &Vec3::new(0.0, 0.0, length)), radius })
            }
            _ => None,
        }
    }
}

/// Memory that the narrow phase uses again for every pair.
#[derive(Debug, Clone, Default)]
pub(super) struct NarrowScratch {
    a: CoreBuffers,
    b: CoreBuffers,
    clipper: Clipper,
}

/// Appends the contact points of two placed shapes whose gap is under `margin`.
///
/// A flat side gets a point for each corner or end near it. Round pairs and spheres on boxes have one. Terrain gets
/// a point for each place where the distance has a minimum of its own.
pub(super) fn touches(
    a: (&Shape, &Pose),
    b: (&Shape, &Pose),
    margin: f64,
    scratch: &mut NarrowScratch,
    out: &mut Vec<Touch>,
) {
    let first = out.len();
    match (a.0, b.0) {
        (Shape::HalfSpace | Shape::HeightField(_), Shape::HalfSpace | Shape::HeightField(_)) => {}
        (Shape::HalfSpace | Shape::HeightField(_), _) => {
            on_ground(b, a, margin, scratch, out);
            out[first..].iter_mut().for_each(|touch| *touch = touch.flipped());
        }
        (_, Shape::HalfSpace | Shape::HeightField(_)) => on_ground(a, b, margin, scratch, out),
        (Shape::Sphere { radius }, Shape::Box { half }) => {
            out.push(sphere_box(&a.1.translation.vector, *radius, half, b.1));
        }
        (Shape::Box { half }, Shape::Sphere { radius }) => {
            out.push(sphere_box(&b.1.translation.vector, *radius, half, a.1).flipped());
        }
        _ => match (Round::of(a.0, a.1), Round::of(b.0, b.1)) {
            (Some(round_a), Some(round_b)) => out.push(round_round(&round_a, &round_b)),
            _ => {
                let NarrowScratch { a: buffers_a, b: buffers_b, clipper } = scratch;
                if let (Some(a), Some(b)) = (buffers_a.place(a.0, a.1), buffers_b.place(b.0, b.1)) {
                    polytope::touches(&a, &b, margin, clipper, out);
                }
            }
        },
    }
    let mut kept = first;
    for index in first..out.len() {
        if out[index].gap < margin {
            out[kept] = out[index];
            kept += 1;
        }
    }
    out.truncate(kept);
    if kept - first > MOST_POINTS {
        spread(&mut out[first..], MOST_POINTS);
        out.truncate(first + MOST_POINTS);
    }
}

/// Puts the deepest point first, then the points that are each the farthest from all before; those that touch before
/// those that do not. Among equals to round-off the first is taken, so that a body at rest keeps its points.
fn spread(touches: &mut [Touch], count: usize) {
    let least = touches.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
    let deepest = touches.iter().position(|touch| touch.gap <= least + SAME_POINT).unwrap_or(0);
    touches.swap(0, deepest);
    for next in 1..count {
        let (chosen, rest) = touches.split_at(next);
        let room = |touch: &Touch| {
            let nearest = |room: f64, one: &Touch| room.min((one.p_world - touch.p_world).norm());
            (touch.gap <= SAME_POINT, chosen.iter().fold(f64::INFINITY, nearest))
        };
        let rooms = rest.iter().map(room).enumerate();
        let better = |best: (usize, (bool, f64)), one: (usize, (bool, f64))| {
            let (a, b) = (best.1, one.1);
            if (b.0 && !a.0) || (a.0 == b.0 && b.1 > a.1 + SAME_POINT) { one } else { best }
        };
        let farthest = rooms.reduce(better).map_or(0, |best| best.0);
        touches.swap(next, next + farthest);
    }
}

/// A body on a half-space or terrain.
fn on_ground(
    body: (&Shape, &Pose),
    ground: (&Shape, &Pose),
    margin: f64,
    scratch: &mut NarrowScratch,
    out: &mut Vec<Touch>,
) {
    if let Shape::HeightField(field) = ground.0 {
        let x_field_body = ground.1.inv_mul(body.1);
        if let Some(core) = scratch.a.place(body.0, &x_field_body) {
            terrain::touches(&core, field, ground.1, margin, out);
        }
    } else if let Some(core) = scratch.a.place(body.0, body.1) {
        on_half_space(&core, ground.1, out);
    }
}

fn round_round(a: &Round, b: &Round) -> Touch {
    let (p_a, p_b) = closest_points_of_segments(&a.start, &a.end, &b.start, &b.end);
    let apart = p_a - p_b;
    let distance = apart.norm();
    let n_world = if distance > COINCIDENT {
        apart / distance
    } else {
        // The axes cross: part them along their common normal, or upwards if they have none.
        let square = (a.end - a.start).cross(&(b.end - b.start));
        square.try_normalize(COINCIDENT).unwrap_or_else(Vec3::z)
    };
    Touch::from_b(p_b + n_world * b.radius, n_world, distance - a.radius - b.radius)
}

/// Ends or corners of a shape against the half-space under the local plane z = 0.
fn on_half_space(a: &Core, x_world_plane: &Pose, out: &mut Vec<Touch>) {
    let normal = x_world_plane.rotation * Vec3::z();
    out.extend(a.vertices.iter().map(|p| {
        let height = normal.dot(&(p - x_world_plane.translation.vector));
        Touch::from_b(p - normal * height, normal, height - a.radius)
    }));
}

fn sphere_box(centre: &Vec3, radius: f64, half: &Vec3, x_world_box: &Pose) -> Touch {
    let p = inverse_transform(x_world_box, centre);
    let clamped = p.zip_map(half, |x, limit| x.clamp(-limit, limit));
    let apart = p - clamped;
    let distance = apart.norm();
    let (p_surface, normal, gap) = if distance > COINCIDENT {
        (clamped, apart / distance, distance - radius)
    } else {
        // The centre is inside: out through the nearest face.
        let face = (half - p.abs()).imin();
        let side = if p[face] < 0.0 { -1.0 } else { 1.0 };
        let mut p_surface = p;
        p_surface[face] = side * half[face];
        (p_surface, Vec3::ith(face, side), side * p[face] - half[face] - radius)
    };
    Touch::from_b(transform(x_world_box, &p_surface), x_world_box.rotation * normal, gap)
}

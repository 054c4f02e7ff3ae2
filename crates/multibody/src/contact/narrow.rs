//! Narrow phase: contact points of two placed shapes.

use orchard_geometry::{Pose, Shape, Vec3, inverse_transform, transform};
use parry3d_f64::glamx::{DPose3, DQuat, DVec3};
use parry3d_f64::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};
use parry3d_f64::shape::{Capsule, Cuboid, Shape as ParryShape};

/// Distance under which two surfaces' directions are taken from the shapes, not from their closest points [m].
const COINCIDENT: f64 = 1e-9;

/// Contact points of a pair nearer than this are one [m].
const SAME_POINT: f64 = 1e-6;

/// Two surfaces near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    /// Halfway between the surfaces.
    pub p_world: Vec3,
    /// Unit normal from b to a.
    pub n_world: Vec3,
    /// Distance; negative while they overlap.
    pub gap: f64,
}

impl Touch {
    /// From the point of b's surface, the normal from b to a, and the gap.
    fn from_b(p_b: Vec3, n_world: Vec3, gap: f64) -> Touch {
        Touch { p_world: p_b + n_world * (0.5 * gap), n_world, gap }
    }

    fn flipped(self) -> Touch {
        Touch { n_world: -self.n_world, ..self }
    }
}

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
            Shape::Box { .. } | Shape::HalfSpace => None,
        }
    }
}

/// Memory that the narrow phase uses again for every pair.
#[derive(Debug, Clone, Default)]
pub(super) struct NarrowScratch {
    manifold: ContactManifold<(), ()>,
}

/// Appends the contact points of two placed shapes whose gap is under `margin`.
///
/// A flat side gets a point for each corner or end near it. Round pairs and boxes against spheres have one.
pub(super) fn touches(
    a: (&Shape, &Pose),
    b: (&Shape, &Pose),
    margin: f64,
    scratch: &mut NarrowScratch,
    out: &mut Vec<Touch>,
) {
    let first = out.len();
    match (Round::of(a.0, a.1), Round::of(b.0, b.1)) {
        (Some(round_a), Some(round_b)) => out.push(round_round(&round_a, &round_b)),
        _ => match (a.0, b.0) {
            (Shape::HalfSpace, Shape::HalfSpace) => {}
            (_, Shape::HalfSpace) => on_half_space(a, b.1, out),
            (Shape::HalfSpace, _) => {
                on_half_space(b, a.1, out);
                out[first..].iter_mut().for_each(|touch| *touch = touch.flipped());
            }
            (Shape::Sphere { radius }, Shape::Box { half }) => {
                out.push(sphere_box(&a.1.translation.vector, *radius, half, b.1));
            }
            (Shape::Box { half }, Shape::Sphere { radius }) => {
                out.push(sphere_box(&b.1.translation.vector, *radius, half, a.1).flipped());
            }
            _ => polytopes(a, b, margin, &mut scratch.manifold, out),
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

/// Closest points of two segments (Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
fn closest_points_of_segments(a0: &Vec3, a1: &Vec3, b0: &Vec3, b1: &Vec3) -> (Vec3, Vec3) {
    let (along_a, along_b, between) = (a1 - a0, b1 - b0, a0 - b0);
    let (aa, bb, ab) = (along_a.norm_squared(), along_b.norm_squared(), along_a.dot(&along_b));
    let (ar, br) = (along_a.dot(&between), along_b.dot(&between));
    let clamped = |top: f64, bottom: f64| if bottom > 0.0 { (top / bottom).clamp(0.0, 1.0) } else { 0.0 };
    // The closest point of line a to line b (parallel lines: the start), then of segment b to it, then of a.
    let mut s = clamped(ab * br - ar * bb, aa * bb - ab * ab);
    let t = clamped(ab * s + br, bb);
    s = clamped(ab * t - ar, aa);
    (a0 + along_a * s, b0 + along_b * t)
}

/// Ends or corners of a shape against the half-space under the local plane z = 0.
fn on_half_space(a: (&Shape, &Pose), x_world_plane: &Pose, out: &mut Vec<Touch>) {
    let normal = x_world_plane.rotation * Vec3::z();
    let mut push = |centre: Vec3, radius: f64| {
        let height = normal.dot(&(centre - x_world_plane.translation.vector));
        out.push(Touch::from_b(centre - normal * height, normal, height - radius));
    };
    match (Round::of(a.0, a.1), a.0) {
        (Some(round), shape) => {
            push(round.start, round.radius);
            if matches!(shape, Shape::Capsule { .. }) {
                push(round.end, round.radius);
            }
        }
        (None, Shape::Box { half }) => {
            for corner in 0..8 {
                let sign = |bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
                let p_box = half.component_mul(&Vec3::new(sign(0), sign(1), sign(2)));
                push(transform(a.1, &p_box), 0.0);
            }
        }
        (None, _) => {}
    }
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

/// A box against a box or a capsule: parry's contact manifold.
fn polytopes(
    a: (&Shape, &Pose),
    b: (&Shape, &Pose),
    margin: f64,
    manifold: &mut ContactManifold<(), ()>,
    out: &mut Vec<Touch>,
) {
    let x_a_b = to_parry(&a.1.inv_mul(b.1));
    // Nothing of the last pair is kept but memory: its normal would be the first guess of this one.
    let mut points = std::mem::take(&mut manifold.points);
    points.clear();
    *manifold = ContactManifold { points, ..ContactManifold::new() };
    with_parry(a.0, |shape_a| {
        with_parry(b.0, |shape_b| {
            // An unsupported pair leaves the manifold empty; boxes and capsules are all supported.
            let _ = DefaultQueryDispatcher
                .contact_manifold_convex_convex(&x_a_b, shape_a, shape_b, None, None, margin, manifold);
        });
    });
    // The manifold's normal points out of a, in a's frame; its points are on the surfaces.
    let n_world = -(a.1.rotation * from_parry(manifold.local_n1));
    let first = out.len();
    for point in &manifold.points {
        let p_b = transform(b.1, &from_parry(point.local_p2));
        let touch = Touch::from_b(p_b, n_world, point.dist);
        // The manifold may hold a point twice.
        if out[first..].iter().all(|other| (other.p_world - touch.p_world).norm() > SAME_POINT) {
            out.push(touch);
        }
    }
}

/// Lends a box or capsule as parry's shape.
fn with_parry(shape: &Shape, mut use_shape: impl FnMut(&dyn ParryShape)) {
    match *shape {
        Shape::Box { half } => use_shape(&Cuboid::new(DVec3::new(half.x, half.y, half.z))),
        Shape::Capsule { radius, length } => {
            use_shape(&Capsule::new(DVec3::ZERO, DVec3::new(0.0, 0.0, length), radius));
        }
        Shape::Sphere { .. } | Shape::HalfSpace => {}
    }
}

fn to_parry(pose: &Pose) -> DPose3 {
    let (p, q) = (pose.translation.vector, pose.rotation.coords);
    DPose3::from_parts(DVec3::new(p.x, p.y, p.z), DQuat::from_xyzw(q.x, q.y, q.z, q.w))
}

fn from_parry(v: DVec3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

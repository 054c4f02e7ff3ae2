//! The narrow phase against parry's distances and closed forms.

use std::sync::Arc;

use orchard_geometry::{Aabb, ConvexHull, HeightField, Pose, Rotation, Shape, Vec3, transform};
use orchard_spec::{Purpose, Stream};
use parry3d_f64::glamx::{DPose3, DQuat, DVec3};
use parry3d_f64::query;
use parry3d_f64::shape as parry;

use super::narrow::{NarrowScratch, touches};
use super::touch::Touch;

const MARGIN: f64 = 0.02;
/// Tolerance on parry's GJK distance \[m\]: its bound on the distance stalls before its own tolerance is met (2e-6 seen). The
/// distance that it gives is that of two points of the shapes, and so never too small.
const STALL: f64 = 1e-5;

fn stream(seed: u64) -> Stream {
    Stream::new(seed, 0, Purpose::Test)
}

fn random_vec(rng: &mut Stream, size: f64) -> Vec3 {
    Vec3::from_fn(|_, _| rng.uniform(-size, size))
}

fn random_pose(rng: &mut Stream, size: f64) -> Pose {
    let turn = Rotation::from_scaled_axis(random_vec(rng, 2.0));
    Pose::from_parts(random_vec(rng, size).into(), turn)
}

fn random_shape(rng: &mut Stream, kind: u32) -> Shape {
    match kind {
        0 => Shape::Sphere { radius: rng.uniform(0.02, 0.1) },
        1 => Shape::Capsule { radius: rng.uniform(0.002, 0.05), length: rng.uniform(0.02, 0.3) },
        2 => Shape::Box { half: Vec3::from_fn(|_, _| rng.uniform(0.02, 0.15)) },
        3 => {
            let cloud: Vec<Vec3> = (0..14).map(|_| random_vec(rng, 0.12)).collect();
            Shape::ConvexHull(Arc::new(ConvexHull::new(&cloud).unwrap()))
        }
        4 => Shape::HalfSpace,
        _ => {
            let heights = (0..20 * 18).map(|_| rng.uniform(0.0, 0.04)).collect();
            Shape::HeightField(Arc::new(HeightField::new(20, 18, [0.06, 0.07], heights).unwrap()))
        }
    }
}

fn contacts(a: (&Shape, &Pose), b: (&Shape, &Pose)) -> Vec<Touch> {
    let mut out = Vec::new();
    touches(a, b, MARGIN, &mut NarrowScratch::default(), &mut out);
    out
}

fn to_parry(pose: &Pose) -> DPose3 {
    let (p, q) = (pose.translation.vector, pose.rotation.coords);
    DPose3::from_parts(DVec3::new(p.x, p.y, p.z), DQuat::from_xyzw(q.x, q.y, q.z, q.w))
}

/// Parry's own shape and its pose; of terrain, one triangle after the other.
fn judge(shape: &Shape, pose: &Pose) -> (Vec<parry::SharedShape>, DPose3) {
    let vector = |v: Vec3| DVec3::new(v.x, v.y, v.z);
    let shapes = match shape {
        Shape::Sphere { radius } => vec![parry::SharedShape::ball(*radius)],
        Shape::Capsule { radius, length } => {
            vec![parry::SharedShape::capsule(DVec3::ZERO, DVec3::Z * *length, *radius)]
        }
        Shape::Box { half } => vec![parry::SharedShape::cuboid(half.x, half.y, half.z)],
        Shape::HalfSpace => vec![parry::SharedShape::halfspace(DVec3::Z)],
        Shape::ConvexHull(hull) => vec![parry::SharedShape::new(hull.parry().clone())],
        Shape::HeightField(field) => {
            let corners = field.triangles(field.cells()).map(|corners| corners.map(vector));
            corners.map(|[a, b, c]| parry::SharedShape::triangle(a, b, c)).collect()
        }
    };
    (shapes, to_parry(pose))
}

/// Parry's distance of two shapes.
fn distance(a: (&Shape, &Pose), b: (&Shape, &Pose)) -> f64 {
    let ((shapes_a, x_a), (shapes_b, x_b)) = (judge(a.0, a.1), judge(b.0, b.1));
    let of =
        |shape: &parry::SharedShape| query::distance(&x_a, &*shapes_a[0], &x_b, &**shape).unwrap().distance;
    shapes_b.iter().map(of).fold(f64::INFINITY, f64::min)
}

fn is_ground(kind: u32) -> bool {
    kind >= 4
}

/// Every pair of kinds at random: swapped shapes give the flipped contact; the least gap is parry's distance.
#[test]
fn pairs_are_symmetric_and_as_far_apart_as_parry_says() {
    let mut rng = stream(31);
    let (mut near, mut overlapping) = ([0; 6], [0; 6]);
    for round in 0..6000 {
        let (kind_a, kind_b) = (rng.integer(0, 3), rng.integer(0, 5));
        let (a, b) = (random_shape(&mut rng, kind_a), random_shape(&mut rng, kind_b));
        let pose_b = random_pose(&mut rng, 0.2);
        // Over the ground: random places about 0.1 m up; elsewhere all around.
        let mut pose_a = random_pose(&mut rng, 0.2);
        if is_ground(kind_b) {
            pose_a = pose_b * pose_a;
        }
        let found = contacts((&a, &pose_a), (&b, &pose_b));
        let mut swapped = contacts((&b, &pose_b), (&a, &pose_a));
        assert_eq!(found.len(), swapped.len(), "round {round}: {kind_a} {kind_b} {found:?} {swapped:?}");
        for touch in &found {
            assert!((touch.n_world.norm() - 1.0).abs() < 1e-12);
            let same = swapped.iter().position(|other| {
                (other.p_world - touch.p_world).norm() < 2e-6
                    && (other.n_world + touch.n_world).norm() < 1e-4
                    && (other.gap - touch.gap).abs() < 1e-9
            });
            let same =
                same.unwrap_or_else(|| panic!("round {round}: {kind_a} {kind_b} {touch:?} {swapped:?}"));
            swapped.remove(same);
        }
        let distance = distance((&a, &pose_a), (&b, &pose_b));
        let least = found.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
        // A body may be wholly under the surface.
        let is_under = |field: &HeightField| {
            let p = transform(&pose_b.inverse(), &pose_a.translation.vector);
            field.height(p.x, p.y).is_some_and(|z| p.z < z)
        };
        let is_below = matches!(&b, Shape::HeightField(field) if is_under(field));
        if distance > 1e-7 && !is_below {
            let expected = if distance < MARGIN { distance } else { f64::INFINITY };
            if expected.is_finite() {
                near[kind_b as usize] += 1;
            }
            assert!(
                least == expected || (expected - STALL..expected + 1e-12).contains(&least),
                "round {round}: {kind_a} on {kind_b}: {least} for {distance} {found:?}"
            );
        } else if distance == 0.0 {
            overlapping[kind_b as usize] += 1;
            assert!(least < 1e-9, "round {round}: {kind_a} on {kind_b} overlap: {least}");
        }
    }
    assert!(near.iter().all(|&count| count > 20), "{near:?}");
    assert!(overlapping.iter().all(|&count| count > 50), "{overlapping:?}");
}

/// Moving a body by its overlap along the normal of its deepest contact takes two convex solids apart.
#[test]
fn the_deepest_contact_leads_out() {
    let mut rng = stream(32);
    let mut count = 0;
    for _ in 0..3000 {
        let (kind_a, kind_b) = (rng.integer(1, 3), rng.integer(2, 3));
        let (a, b) = (random_shape(&mut rng, kind_a), random_shape(&mut rng, kind_b));
        let (mut pose_a, pose_b) = (random_pose(&mut rng, 0.1), random_pose(&mut rng, 0.1));
        let found = contacts((&a, &pose_a), (&b, &pose_b));
        let Some(deepest) = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)) else { continue };
        if deepest.gap >= 0.0 {
            continue;
        }
        count += 1;
        pose_a.translation.vector -= deepest.n_world * (deepest.gap - 1e-6);
        let distance = distance((&a, &pose_a), (&b, &pose_b));
        assert!(
            distance > 0.5e-6 && distance < 1e-6 + STALL,
            "{kind_a} {kind_b}: {distance} after {deepest:?}"
        );
    }
    assert!(count > 1000, "{count}");
}

/// A thin twig that has got into a chassis is pushed out through the face nearest to it.
#[test]
fn a_twig_inside_a_chassis_leaves_through_the_nearest_face() {
    let half = Vec3::new(0.48, 0.40, 0.14);
    let chassis = Shape::Box { half };
    let mut rng = stream(33);
    for _ in 0..4000 {
        let twig = Shape::Capsule { radius: rng.uniform(0.002, 0.01), length: 0.03 };
        let Shape::Capsule { radius, length } = twig else { unreachable!() };
        // Wholly inside, within 20 mm of one face and farther from all others.
        let (axis, side) = (rng.integer(0, 2) as usize, if rng.unit() < 0.5 { -1.0 } else { 1.0 });
        let turn = Rotation::from_scaled_axis(random_vec(&mut rng, 3.0));
        let mut centre = Vec3::from_fn(|k, _| rng.uniform(-0.5, 0.5) * half[k]);
        centre[axis] = side * (half[axis] - rng.uniform(0.0, 0.02));
        let along = turn * Vec3::z() * length;
        let pose_in_chassis = Pose::from_parts((centre - 0.5 * along).into(), turn);
        let x_world_chassis = random_pose(&mut rng, 1.0);
        let pose = x_world_chassis * pose_in_chassis;
        let found = contacts((&twig, &pose), (&chassis, &x_world_chassis));
        // The deeper end decides how far out is.
        let deeper = side * centre[axis] - 0.5 * along[axis].abs();
        let expected = deeper - half[axis] - radius;
        let n = x_world_chassis.rotation * Vec3::ith(axis, side);
        assert!(!found.is_empty());
        for touch in &found {
            assert!((touch.n_world - n).norm() < 1e-9, "{touch:?}");
            assert!(touch.gap < MARGIN);
        }
        let least = found.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
        assert!((least - expected).abs() < 1e-9, "{least} for {expected}");
        // And the chassis is pushed the other way.
        let other = contacts((&chassis, &x_world_chassis), (&twig, &pose));
        assert!(other.iter().all(|touch| (touch.n_world + n).norm() < 1e-9));
    }
}

/// A twig that comes in end first, tip inside and root outside, keeps the normal of the face that it came through.
#[test]
fn a_twig_that_pierces_a_face_is_pushed_back_through_it() {
    let half = Vec3::new(0.48, 0.40, 0.14);
    for tip in [0.001, 0.005, 0.01, 0.02, 0.029] {
        for lean in [0.0, 0.3, 0.6] {
            let turn = Rotation::from_scaled_axis(Vec3::y() * (lean - std::f64::consts::FRAC_PI_2));
            let length = 0.03;
            let p_tip = Vec3::new(half.x - tip, 0.1, 0.05);
            let pose = Pose::from_parts((p_tip - turn * Vec3::z() * length).into(), turn);
            let twig = Shape::Capsule { radius: 0.003, length };
            let found = contacts((&twig, &pose), (&Shape::Box { half }, &Pose::identity()));
            let least = found.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
            assert!((least + tip + 0.003).abs() < 1e-9, "{tip} {lean}: {found:?}");
            assert!(found.iter().all(|touch| (touch.n_world - Vec3::x()).norm() < 1e-9), "{found:?}");
        }
    }
}

/// The hull of a box's corners is the box.
#[test]
fn a_hull_of_a_box_touches_as_the_box_does() {
    let mut rng = stream(34);
    for _ in 0..2000 {
        let half = Vec3::from_fn(|_, _| rng.uniform(0.03, 0.2));
        let corner =
            |k: u32| Vec3::from_fn(|axis, _| if k >> axis & 1 == 0 { -half[axis] } else { half[axis] });
        let corners: Vec<Vec3> = (0..8).map(corner).collect();
        let hull = Shape::ConvexHull(Arc::new(ConvexHull::new(&corners).unwrap()));
        let (x, pose) = (random_pose(&mut rng, 0.2), random_pose(&mut rng, 0.2));
        let kind = rng.integer(0, 5);
        let other = random_shape(&mut rng, kind);
        let (one, two) =
            (contacts((&hull, &x), (&other, &pose)), contacts((&Shape::Box { half }, &x), (&other, &pose)));
        let least = |found: &[Touch]| found.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
        let (a, b) = (least(&one), least(&two));
        assert!(a == b || (a - b).abs() < 1e-12, "kind {kind}: {a} {b}");
    }
}

/// A ball on triangles of one plane has one contact with the plane's normal, over seams and corners too.
#[test]
fn seams_of_a_plane_do_not_show() {
    let slope = |x: f64, y: f64| 0.3 * x - 0.2 * y + 0.05;
    let (columns, rows, spacing) = (9, 11, 0.04);
    let mut heights = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let x = spacing * (f64::from(column) - 0.5 * f64::from(columns - 1));
            heights.push(slope(x, spacing * (f64::from(row) - 0.5 * f64::from(rows - 1))));
        }
    }
    let field = HeightField::new(columns as usize, rows as usize, [spacing; 2], heights).unwrap();
    let field = Shape::HeightField(Arc::new(field));
    let normal = Vec3::new(-0.3, 0.2, 1.0).normalize();
    let ball = Shape::Sphere { radius: 0.035 };
    let mut rng = stream(35);
    for round in 0..4000 {
        // Every second one on a seam.
        let (mut x, mut y) = (rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1));
        match round % 4 {
            0 => x = spacing * (x / spacing).round(),
            1 => (x, y) = (spacing * (x / spacing).round(), spacing * (y / spacing).round()),
            _ => {}
        }
        let gap = rng.uniform(-0.02, 0.015);
        let centre = Vec3::new(x, y, slope(x, y)) + normal * (0.035 + gap);
        let found = contacts(
            (&ball, &Pose::from_parts(centre.into(), Rotation::identity())),
            (&field, &Pose::identity()),
        );
        assert_eq!(found.len(), 1, "round {round}: {found:?}");
        assert!((found[0].n_world - normal).norm() < 1e-12, "{found:?}");
        assert!((found[0].gap - gap).abs() < 1e-12, "{found:?}");
    }
}

/// A body that has sunk into terrain is pushed up, at any depth.
#[test]
fn what_is_under_terrain_is_pushed_up() {
    let mut rng = stream(36);
    for _ in 0..2000 {
        let kind = rng.integer(0, 3);
        let (field, body) = (random_shape(&mut rng, 5), random_shape(&mut rng, kind));
        let mut pose = random_pose(&mut rng, 0.05);
        let size = body.aabb(&pose);
        // Its top is at -0.01 to -0.2 m, the ground's lowest point at 0.
        pose.translation.z -= size.max.z + rng.uniform(0.01, 0.2);
        let Aabb { min, max } = body.aabb(&pose);
        let found = contacts((&body, &pose), (&field, &Pose::identity()));
        assert!(!found.is_empty(), "kind {kind}, {min} to {max}");
        assert!(found.iter().all(|touch| touch.n_world.z > 0.0 && touch.gap < 0.0), "kind {kind}: {found:?}");
    }
}

/// Extent of a shape along a direction, by parry's support map \[m\].
fn reach(shape: &parry::SharedShape, pose: &DPose3, along: &Vec3) -> f64 {
    let along = DVec3::new(along.x, along.y, along.z);
    shape.as_support_map().unwrap().support_point(pose, along).dot(along)
}

/// Parry's contacts of spheres, capsules, boxes and hulls, apart and overlapping. The signed distance of convex shapes is the largest
/// separation along any direction, and a normal is a direction where it is found. So, with parry as the judge and to round-off:
///
/// - along our normal the shapes are our gap apart, measured by parry's support maps;
/// - along parry's normal they are no farther apart, else ours would not be the largest;
/// - parry's distance, that of two points of the shapes, is no smaller.
///
/// It may be larger because parry's GJK and EPA stall (errors of 1e-5 m with capsules, and in two of 9,000 pairs of
/// millimetres, with overlapping boxes, along the same normal). One pair in 300 may be off by more than a micrometre; where the distances agree to
/// 1e-9 m, so do the normals to `sqrt(2 1e-9 / 2e-3)` = 1e-3 rad, capsules being 2 mm thick at least.
#[test]
fn depths_and_normals_are_those_that_parry_finds() {
    const EXACT: f64 = 1e-12;
    let mut rng = stream(37);
    let (mut pairs, mut off) = ([[0; 2]; 16], 0);
    for round in 0..16000 {
        let kinds = [rng.integer(0, 3), rng.integer(0, 3)];
        let [a, b] = kinds.map(|kind| random_shape(&mut rng, kind));
        let (pose_a, pose_b) = (random_pose(&mut rng, 0.12), random_pose(&mut rng, 0.12));
        let found = contacts((&a, &pose_a), (&b, &pose_b));
        let Some(ours) = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)) else { continue };
        let ((shapes_a, x_a), (shapes_b, x_b)) = (judge(&a, &pose_a), judge(&b, &pose_b));
        let (parry_a, parry_b) = (&shapes_a[0], &shapes_b[0]);
        let theirs = query::contact(&x_a, &**parry_a, &x_b, &**parry_b, 2.0 * MARGIN).unwrap().unwrap();
        // Ours points from b to a, parry's from a to b.
        let n_theirs = -Vec3::new(theirs.normal1.x, theirs.normal1.y, theirs.normal1.z);
        let apart = |n: &Vec3| -reach(parry_a, &x_a, &-n) - reach(parry_b, &x_b, n);
        let case = format!("round {round}: {kinds:?} {ours:?} {theirs:?}");
        assert!((apart(&ours.n_world) - ours.gap).abs() < EXACT, "{case}");
        assert!(apart(&n_theirs) < ours.gap + EXACT, "{case}");
        assert!(theirs.dist > ours.gap - EXACT, "{case}");
        let excess = theirs.dist - ours.gap;
        assert!(excess > 1e-9 || (n_theirs - ours.n_world).norm() < 1e-3, "{case}");
        off += usize::from(excess > 1e-6);
        pairs[(4 * kinds[0] + kinds[1]) as usize][usize::from(ours.gap < 0.0)] += 1;
    }
    let total: usize = pairs.iter().flatten().sum();
    assert!(off * 300 < total, "{off} of {total}");
    assert!(pairs.iter().flatten().all(|&count| count > 25), "{pairs:?}");
}

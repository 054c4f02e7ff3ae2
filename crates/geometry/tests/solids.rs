//! Compares hulls and height fields with closed forms and brute force.

use std::sync::Arc;

use orchard_geometry::height_field::closest_on_triangle;
use orchard_geometry::{
    ConvexHull, Footprint, HeightField, HeightFieldError, HullError, Pose, Rotation, Shape, Vec3, math,
    transform,
};

/// Numbers that look random: digits far behind the point of a sine.
struct Spread(f64);

impl Spread {
    fn vec(&mut self, size: f64) -> Vec3 {
        Vec3::from_fn(|_, _| {
            self.0 += 1.0;
            let x = 43_758.545 * math::sin(12.9898 * self.0);
            size * (2.0 * (x - x.floor()) - 1.0)
        })
    }
}

fn cube(half: f64) -> Vec<Vec3> {
    (0..8).map(|k| Vec3::from_fn(|axis, _| if k >> axis & 1 == 0 { -half } else { half })).collect()
}

#[test]
fn clouds_that_enclose_nothing_are_refused() {
    let flat: Vec<Vec3> = (0..9).map(|k| Vec3::new(f64::from(k % 3), f64::from(k / 3), 1.0)).collect();
    let line: Vec<Vec3> = (0..9).map(|k| Vec3::new(1.0, 2.0, 3.0) * f64::from(k)).collect();
    assert_eq!(ConvexHull::new(&[]), Err(HullError::TooFew { count: 0 }));
    assert_eq!(ConvexHull::new(&flat[..3]), Err(HullError::TooFew { count: 3 }));
    assert_eq!(ConvexHull::new(&flat), Err(HullError::Flat));
    assert_eq!(ConvexHull::new(&line), Err(HullError::Flat));
    assert_eq!(ConvexHull::new(&[Vec3::zeros(); 9]), Err(HullError::Flat));
    for bad in [f64::NAN, f64::INFINITY] {
        let mut points = cube(1.0);
        points[5].y = bad;
        assert_eq!(ConvexHull::new(&points), Err(HullError::NotFinite { index: 5 }));
    }
}

#[test]
fn grids_that_are_no_terrain_are_refused() {
    let field = |columns, rows, spacing, count| HeightField::new(columns, rows, spacing, vec![0.0; count]);
    assert_eq!(field(1, 1, [1.0; 2], 1), Err(HeightFieldError::Size { columns: 1, rows: 1 }));
    assert_eq!(field(5, 1, [1.0; 2], 5), Err(HeightFieldError::Size { columns: 5, rows: 1 }));
    assert_eq!(field(2, 3, [1.0; 2], 5), Err(HeightFieldError::Count { columns: 2, rows: 3, count: 5 }));
    let huge = usize::MAX / 2;
    assert_eq!(
        field(huge, 3, [1.0; 2], 5),
        Err(HeightFieldError::Count { columns: huge, rows: 3, count: 5 })
    );
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(field(2, 2, [1.0, bad], 4), Err(HeightFieldError::Spacing));
    }
    for bad in [f64::NAN, f64::NEG_INFINITY] {
        let mut heights = vec![0.0; 12];
        heights[7] = bad;
        let made = HeightField::new(4, 3, [1.0; 2], heights);
        assert_eq!(made, Err(HeightFieldError::Height { column: 3, row: 1 }));
    }
}

/// Euler's formula, and every point under every face: random clouds, grids on a cube's sides, doubled points, thin plates.
#[test]
fn hulls_are_closed_and_hold_their_points() {
    let mut spread = Spread(0.0);
    let mut clouds: Vec<Vec<Vec3>> =
        (0..200).map(|k| (0..5 + k % 60).map(|_| spread.vec(0.3)).collect()).collect();
    let grid = |n: i32| -> Vec<Vec3> {
        let all = (0..n * n * n).map(move |k| [k % n, k / n % n, k / (n * n)]);
        all.map(|k| Vec3::from_fn(|axis, _| f64::from(k[axis]) * 0.1)).collect()
    };
    clouds.extend([grid(2), grid(3), grid(5)]);
    clouds.push(cube(1.0).into_iter().chain(cube(1.0)).collect());
    let turn = |k: i32, of: i32| math::sin_cos(std::f64::consts::TAU * f64::from(k) / f64::from(of));
    let ring = |of: i32, z: f64| (0..of).map(move |k| Vec3::new(turn(k, of).1, turn(k, of).0, z));
    clouds.extend([3, 6, 17, 64].map(|of| ring(of, -0.2).chain(ring(of, 0.2)).collect()));
    clouds.push((0..300).map(|_| spread.vec(1.0).normalize()).collect());
    let squashed = |p: Vec3, thin: f64| Vec3::new(p.x, p.y, thin * p.z);
    clouds.extend([1e-1, 1e-2, 1e-3].map(|thin| cube(1.0).iter().map(|p| squashed(*p, thin)).collect()));
    clouds.extend([1e-1, 1e-2].map(|thin| (0..40).map(|_| squashed(spread.vec(1.0), thin)).collect()));
    // Thinner than parry can resolve: refused, not wrong.
    let lens: Vec<Vec3> = (0..40).map(|_| squashed(spread.vec(1.0), 1e-3)).collect();
    let plate: Vec<Vec3> = cube(1.0).into_iter().map(|p| squashed(p, 1e-4)).collect();
    assert_eq!(ConvexHull::new(&lens), Err(HullError::Flat));
    assert_eq!(ConvexHull::new(&plate), Err(HullError::Flat));
    for (index, cloud) in clouds.iter().enumerate() {
        let hull = ConvexHull::new(cloud).unwrap_or_else(|error| panic!("cloud {index}: {error}"));
        let used: std::collections::BTreeSet<u32> =
            hull.edges().iter().flat_map(|edge| edge.vertices).collect();
        assert_eq!(used.len() + hull.faces().len(), hull.edges().len() + 2, "cloud {index}");
        let size = cloud.iter().map(|p| p.norm()).fold(0.0, f64::max);
        for p in cloud {
            assert!(hull.signed_distance(p) < 1e-6 * size, "cloud {index}: {}", hull.signed_distance(p));
        }
    }
}

#[test]
fn a_cube_has_a_cube_s_parts_and_distances() {
    let hull = ConvexHull::new(&cube(0.5)).unwrap();
    assert_eq!((hull.vertices().len(), hull.edges().len(), hull.faces().len()), (8, 12, 6));
    for face in hull.faces() {
        let around = hull.boundary(face);
        assert_eq!(around.len(), 4);
        let [a, b, c] = [0, 1, 2].map(|k| hull.vertices()[around[k] as usize]);
        assert!((b - a).cross(&(c - b)).dot(&face.normal) > 0.9);
    }
    let (hull, cube) = (Shape::ConvexHull(Arc::new(hull)), Shape::Box { half: Vec3::repeat(0.5) });
    let mut spread = Spread(0.5);
    for _ in 0..2000 {
        let p = spread.vec(1.5);
        assert!((hull.signed_distance(&p) - cube.signed_distance(&p)).abs() < 1e-15);
    }
    let pose = Pose::from_parts(spread.vec(1.0).into(), Rotation::from_scaled_axis(spread.vec(2.0)));
    let (one, two) = (hull.aabb(&pose), cube.aabb(&pose));
    assert!((one.min - two.min).norm() < 1e-15 && (one.max - two.max).norm() < 1e-15);
}

fn bumps() -> HeightField {
    let at = |k: usize, count: usize| 0.1 * (k as f64 - 0.5 * (count - 1) as f64);
    let z = |k: usize| 0.2 * math::sin(7.0 * at(k % 13, 13)) * math::sin(5.0 * at(k / 13, 9)) + 0.3;
    HeightField::new(13, 9, [0.1; 2], (0..13 * 9).map(z).collect()).unwrap()
}

#[test]
fn distances_from_terrain_are_those_of_all_its_triangles() {
    let field = bumps();
    let mut spread = Spread(0.0);
    for _ in 0..2000 {
        let p = spread.vec(0.9);
        let near = |triangle: [Vec3; 3]| (p - closest_on_triangle(&p, &triangle).0).norm();
        let least = field.triangles(field.cells()).map(near).fold(f64::INFINITY, f64::min);
        let under = field.height(p.x, p.y).is_some_and(|z| p.z < z);
        let got = field.signed_distance(&p);
        assert!((got - if under { -least } else { least }).abs() < 1e-15, "{p} {got} {least}");
    }
}

#[test]
fn heights_and_nodes_are_where_the_grid_puts_them() {
    let heights = vec![0.0, 1.0, 2.0, 3.0, 5.0, 8.0];
    let field = HeightField::new(3, 2, [2.0, 4.0], heights).unwrap();
    assert_eq!(field.node([0, 0]), Some(Vec3::new(-2.0, -2.0, 0.0)));
    assert_eq!(field.node([2, 1]), Some(Vec3::new(2.0, 2.0, 8.0)));
    assert_eq!((field.node([3, 0]), field.node([0, -1])), (None, None));
    // Nodes, the middle of the diagonal from (1, 0) to (0, 1), and one point in each triangle.
    for (x, y, z) in [
        (-2.0, -2.0, 0.0),
        (2.0, 2.0, 8.0),
        (0.0, -2.0, 1.0),
        (-1.0, 0.0, 2.0),
        (-1.5, -1.0, 1.0),
        (-0.5, 1.0, 0.25 * 3.0 + 0.25 * 1.0 + 0.5 * 5.0),
    ] {
        assert_eq!(field.height(x, y), Some(z), "({x}, {y})");
    }
    assert_eq!(
        (field.height(2.1, 0.0), field.height(0.0, -2.1), field.height(f64::NAN, 0.0)),
        (None, None, None)
    );
    // The bounding box contains the solid below the surface for any rotation.
    let shape = Shape::HeightField(Arc::new(bumps()));
    let pose = Pose::from_parts(Vec3::new(1.0, 2.0, 3.0).into(), Rotation::from_scaled_axis(Vec3::x() * 0.3));
    let aabb = shape.aabb(&pose);
    assert!(aabb.min.z == f64::NEG_INFINITY && aabb.max.y == f64::INFINITY && aabb.min.y.is_finite());
    let field = bumps();
    for p in field.cells().nodes().filter_map(|node| field.node(node)) {
        let p = transform(&pose, &p);
        assert!((0..3).all(|k| aabb.min[k] < p[k] + 1e-12 && p[k] < aabb.max[k] + 1e-12));
    }
}

/// A turned rectangle that stays on the bumps, its half-extents up to 0.2 m.
fn rectangle(draws: &mut impl FnMut() -> f64) -> Footprint {
    let (sin, cos) = math::sin_cos(draws() * std::f64::consts::TAU);
    Footprint {
        centre: [0.6 * (draws() - 0.5), 0.2 * (draws() - 0.5)],
        ahead: [cos, sin],
        half: [0.2 * draws(), 0.2 * draws()],
    }
}

/// Numbers in [0, 1): van der Corput's sequence in a base of its own for each rectangle's number.
fn draws(rectangle: usize) -> impl FnMut() -> f64 {
    const BASES: [usize; 5] = [2, 3, 5, 7, 11];
    let mut number = 0;
    move || {
        let (base, mut rest, mut share, mut value) = (BASES[number % 5], rectangle + 1, 1.0, 0.0);
        number += 1;
        while rest > 0 {
            share /= base as f64;
            value += share * (rest % base) as f64;
            rest /= base;
        }
        value
    }
}

/// Position at shares (-1 to 1) of a rectangle's half-extents.
fn place_in(f: &Footprint, along: f64, across: f64) -> [f64; 2] {
    let ([c, s], [x, y]) = (f.ahead, f.centre);
    let (along, across) = (along * f.half[0], across * f.half[1]);
    [x + c * along - s * across, y + s * along + c * across]
}

/// No point under a rectangle is higher than its highest ground, and the highest of many points comes near it.
#[test]
fn the_highest_ground_under_a_rectangle_is_that_of_all_its_places() {
    const SIDE: usize = 60;
    let field = bumps();
    // Height differences of neighbours over their distance, along x and y together.
    let steepest = 0.2 * (7.0 + 5.0);
    for number in 0..300 {
        let f = rectangle(&mut draws(number));
        let share = |k: usize| 2.0 * k as f64 / SIDE as f64 - 1.0;
        let places = (0..=SIDE).flat_map(|i| (0..=SIDE).map(move |k| (share(i), share(k))));
        let sampled = places.filter_map(|(a, b)| {
            let [x, y] = place_in(&f, a, b);
            field.height(x, y)
        });
        let sampled = sampled.reduce(f64::max).unwrap();
        let highest = field.highest_under(&f).unwrap();
        let step = f.half[0].max(f.half[1]) / SIDE as f64;
        // A point on the border may lie on either side of it by round-off.
        assert!(sampled <= highest + 1e-12, "{f:?}: {highest} < {sampled}");
        assert!(highest <= sampled + 2.0 * steepest * step, "{f:?}: {highest} > {sampled}");
        // A small displacement changes the height by little.
        let moved = Footprint { centre: [f.centre[0] + 1e-6, f.centre[1] - 1e-6], ..f };
        assert!((field.highest_under(&moved).unwrap() - highest).abs() < steepest * 1e-6 + 1e-12, "{f:?}");
    }
}

#[test]
fn on_a_slope_the_highest_ground_is_under_a_corner() {
    let (a, b) = (0.3, -0.2);
    let z = |k: usize| a * 0.1 * ((k % 31) as f64 - 15.0) + b * 0.1 * ((k / 31) as f64 - 15.0);
    let field = HeightField::new(31, 31, [0.1; 2], (0..31 * 31).map(z).collect()).unwrap();
    for number in 0..100 {
        let f = rectangle(&mut draws(number));
        let ([x, y], [c, s], [l, w]) = (f.centre, f.ahead, f.half);
        let expected = a * x + b * y + (a * c + b * s).abs() * l + (b * c - a * s).abs() * w;
        assert!((field.highest_under(&f).unwrap() - expected).abs() < 1e-14, "{f:?}");
    }
    let beside = Footprint { centre: [5.0, 0.0], ahead: [1.0, 0.0], half: [1.0, 1.0] };
    assert_eq!(field.highest_under(&beside), None);
    for nowhere in [f64::NAN, f64::INFINITY, 1e300] {
        assert_eq!(field.highest_under(&Footprint { centre: [nowhere, 0.0], ..beside }), None);
    }
    // Half beside the field: only the part on the field counts.
    let on_the_border = Footprint { centre: [1.5, 0.0], ahead: [1.0, 0.0], half: [0.25, 0.1] };
    assert!((field.highest_under(&on_the_border).unwrap() - (0.45 + 0.02)).abs() < 1e-14);
}

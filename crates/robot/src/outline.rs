//! Convex outlines of shapes on the ground.

use orchard_geometry::{Pose, Shape, Vec3, math, transform};

/// Number of corners of the polygon about a circle; it lies outside by at most 1 / cos(pi / 16) - 1 = 2 % of the radius.
const CIRCLE_CORNERS: usize = 16;

/// Returns the counterclockwise corners of the smallest convex polygon that contains placed shapes, seen from above \[m\]; empty without
/// shapes. Round edges are replaced by polygons about them.
pub fn outline<'a>(shapes: impl Iterator<Item = (&'a Shape, Pose)>) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for (shape, x) in shapes {
        cover(shape, &x, &mut points);
    }
    convex(points)
}

fn cover(shape: &Shape, x: &Pose, points: &mut Vec<[f64; 2]>) {
    let mut circle = |centre: Vec3, radius: f64| {
        let about = radius / math::cos(std::f64::consts::PI / CIRCLE_CORNERS as f64);
        for k in 0..CIRCLE_CORNERS {
            let (sin, cos) = math::sin_cos(std::f64::consts::TAU * k as f64 / CIRCLE_CORNERS as f64);
            points.push([centre.x + about * cos, centre.y + about * sin]);
        }
    };
    match shape {
        Shape::Sphere { radius } => circle(x.translation.vector, *radius),
        Shape::Capsule { radius, length } => {
            circle(x.translation.vector, *radius);
            circle(transform(x, &Vec3::new(0.0, 0.0, *length)), *radius);
        }
        Shape::Box { half } => {
            for corner in 0..8 {
                let sign = |bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
                let p = transform(x, &half.component_mul(&Vec3::new(sign(0), sign(1), sign(2))));
                points.push([p.x, p.y]);
            }
        }
        Shape::ConvexHull(hull) => points.extend(hull.vertices().iter().map(|p| {
            let p = transform(x, p);
            [p.x, p.y]
        })),
        other => {
            let around = other.aabb(x);
            for (px, py) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let pick = |low: f64, high: f64, which: i32| if which == 0 { low } else { high };
                points.push([pick(around.min.x, around.max.x, px), pick(around.min.y, around.max.y, py)]);
            }
        }
    }
}

/// Convex hull by monotone chains (Andrew 1979).
fn convex(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turn =
        |o: [f64; 2], a: [f64; 2], b: [f64; 2]| (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while hull.len() > 1 && turn(hull[hull.len() - 2], hull[hull.len() - 1], p) <= 0.0 {
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
        hull
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.append(&mut chain(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_of_a_turned_box_and_a_ball() {
        let turned = Pose::rotation(Vec3::new(0.0, 0.0, std::f64::consts::FRAC_PI_4));
        let square = Shape::Box { half: Vec3::new(1.0, 1.0, 0.1) };
        let corners = outline([(&square, turned)].into_iter());
        assert_eq!(corners.len(), 4);
        let root = 2.0_f64.sqrt();
        assert!(corners.iter().all(|p| (p[0].abs() + p[1].abs() - root).abs() < 1e-12), "{corners:?}");
        // Counterclockwise, by the shoelace formula.
        let area = |c: &[[f64; 2]]| -> f64 {
            (0..c.len())
                .map(|i| (c[i], c[(i + 1) % c.len()]))
                .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
                .sum::<f64>()
                / 2.0
        };
        assert!((area(&corners) - 4.0).abs() < 1e-12);
        let ball = Shape::Sphere { radius: 0.5 };
        let round = outline([(&ball, Pose::identity())].into_iter());
        let circle = std::f64::consts::PI * 0.25;
        assert!(area(&round) > circle && area(&round) < 1.02 * circle, "{}", area(&round));
        assert!(outline(std::iter::empty()).is_empty());
    }
}

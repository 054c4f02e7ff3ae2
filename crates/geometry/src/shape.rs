//! Collision and drawing shapes.

use std::sync::Arc;

use crate::{Aabb, ConvexHull, HeightField, Pose, Vec3, transform};

/// A solid in its own frame. Hulls and height fields are shared, so a clone is cheap.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A ball centred on the origin.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// A capsule whose axis runs from the origin to (0, 0, length).
    Capsule {
        /// Radius \[m\].
        radius: f64,
        /// Length of the axis \[m\].
        length: f64,
    },
    /// A box centred on the origin.
    Box {
        /// Half-extents \[m\].
        half: Vec3,
    },
    /// Everything with z <= 0: the ground.
    HalfSpace,
    /// A convex polyhedron.
    ConvexHull(Arc<ConvexHull>),
    /// Terrain: everything under the heights of a grid.
    HeightField(Arc<HeightField>),
}

/// Sine of the tilt up to which a height field counts as upright.
const UPRIGHT: f64 = 1e-9;

impl Shape {
    /// Bounding box of the shape placed at a pose.
    pub fn aabb(&self, pose: &Pose) -> Aabb {
        let p = pose.translation.vector;
        match *self {
            Shape::Sphere { radius } => Aabb { min: p, max: p }.grown(radius),
            Shape::Capsule { radius, length } => {
                let tip = p + pose.rotation * Vec3::new(0.0, 0.0, length);
                Aabb { min: p.inf(&tip), max: p.sup(&tip) }.grown(radius)
            }
            Shape::Box { half } => turned_box(pose, &p, &half),
            Shape::HalfSpace => {
                Aabb { min: Vec3::repeat(f64::NEG_INFINITY), max: Vec3::repeat(f64::INFINITY) }
            }
            Shape::ConvexHull(ref hull) => {
                let (min, max) = hull.extent(pose);
                Aabb { min, max }
            }
            Shape::HeightField(ref field) => {
                let Aabb { min, max } = field.bounds();
                let centre = transform(pose, &(0.5 * (min + max)));
                let mut aabb = turned_box(pose, &centre, &(0.5 * (max - min)));
                // The solid extends below the surface without end.
                let up = pose.rotation * Vec3::z();
                for k in 0..3 {
                    if up[k] > UPRIGHT {
                        aabb.min[k] = f64::NEG_INFINITY;
                    } else if up[k] < -UPRIGHT {
                        aabb.max[k] = f64::INFINITY;
                    }
                }
                aabb
            }
        }
    }

    /// Distance from a point in the shape's frame to its surface \[m\], negative inside.
    pub fn signed_distance(&self, p: &Vec3) -> f64 {
        match *self {
            Shape::Sphere { radius } => p.norm() - radius,
            Shape::Capsule { radius, length } => {
                let on_axis = Vec3::new(0.0, 0.0, p.z.max(0.0).min(length));
                (p - on_axis).norm() - radius
            }
            Shape::Box { half } => {
                let d = p.abs() - half;
                d.sup(&Vec3::zeros()).norm() + d.max().min(0.0)
            }
            Shape::HalfSpace => p.z,
            Shape::ConvexHull(ref hull) => hull.signed_distance(p),
            Shape::HeightField(ref field) => field.signed_distance(p),
        }
    }
}

/// Bounding box of a box turned by a pose.
fn turned_box(pose: &Pose, centre: &Vec3, half: &Vec3) -> Aabb {
    let d = pose.rotation.to_rotation_matrix().matrix().abs() * half;
    Aabb { min: centre - d, max: centre + d }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_distances() {
        let cases = [
            (Shape::Sphere { radius: 2.0 }, [0.0, 0.0, 0.5], -1.5),
            (Shape::Sphere { radius: 2.0 }, [0.0, 3.0, 4.0], 3.0),
            (Shape::Capsule { radius: 1.0, length: 2.0 }, [3.0, 0.0, 1.0], 2.0),
            (Shape::Capsule { radius: 1.0, length: 2.0 }, [0.0, 3.0, 6.0], 4.0),
            (Shape::Capsule { radius: 1.0, length: 2.0 }, [0.25, 0.0, 1.5], -0.75),
            (Shape::Box { half: Vec3::new(1.0, 2.0, 3.0) }, [0.5, 0.0, 0.0], -0.5),
            (Shape::Box { half: Vec3::new(1.0, 2.0, 3.0) }, [4.0, 6.0, 0.0], 5.0),
            (Shape::HalfSpace, [7.0, 7.0, -0.25], -0.25),
        ];
        for (shape, p, expected) in cases {
            assert!((shape.signed_distance(&Vec3::from(p)) - expected).abs() < 1e-15, "{shape:?}");
        }
    }
}

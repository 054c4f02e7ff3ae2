//! Solids of a scene in a camera's frame: what any renderer of depth images has to draw.

use std::sync::Arc;

use orchard_geometry::{Aabb, Intrinsics, Pose, Shape, Vec3, inverse_transform, transform};

use crate::blade::BladeMesh;
use crate::{Geometry, Item, Scene};

/// A part of an item, in the camera's optical frame, lengths in metres.
#[derive(Debug, Clone, Copy)]
pub enum Solid<'a> {
    /// A ball.
    Ball {
        /// Centre.
        p_camera: Vec3,
        /// Radius.
        radius: f64,
    },
    /// A cylinder with half balls at its ends.
    Capsule {
        /// First end of the axis.
        p_camera: Vec3,
        /// Unit vector from the first to the second end.
        axis: Vec3,
        /// Length of the axis.
        length: f64,
        /// Radius.
        radius: f64,
    },
    /// A box.
    Box {
        /// Pose of the frame in whose middle it lies.
        x_camera_box: Pose,
        /// Half of its lengths.
        half: Vec3,
    },
    /// A plane, seen from both sides.
    Plane {
        /// A point on it.
        p_camera: Vec3,
        /// Unit normal.
        normal: Vec3,
    },
    /// A triangle, seen from both sides.
    Triangle([Vec3; 3]),
    /// A leaf blade: the triangles of a mesh.
    Blade {
        /// Pose of the blade's frame.
        x_camera_blade: Pose,
        /// Mesh of the unit blade.
        mesh: &'a Arc<BladeMesh>,
        /// Length along the midrib.
        length: f64,
        /// Full width.
        width: f64,
    },
}

impl Scene {
    /// Calls `f` with the number of each item and its solids, in the order of items; of terrain, which may be large, only with the parts that the
    /// camera can see within depth `far` \[m\]. `x_world_camera` is the pose of the optical frame.
    pub fn for_each_solid(
        &self,
        intrinsics: &Intrinsics,
        x_world_camera: &Pose,
        far: f64,
        mut f: impl FnMut(u32, Solid<'_>),
    ) {
        let x_camera_world = x_world_camera.inverse();
        let within = view(intrinsics, far);
        for (number, item) in (0_u32..).zip(&self.items) {
            of_item(item, &x_camera_world, &within, |solid| f(number, solid));
        }
    }
}

/// The camera and the corners of its view at depth `far`, whose convex hull contains all points in view. No points if `far` is infinite.
pub(crate) fn view(intrinsics: &Intrinsics, far: f64) -> Vec<Vec3> {
    if !far.is_finite() {
        return Vec::new();
    }
    let (right, bottom) = (intrinsics.width as f64, intrinsics.height as f64);
    let corners = [(-1.0, -1.0), (right, -1.0), (-1.0, bottom), (right, bottom)];
    let rays = corners.map(|(u, v)| intrinsics.ray(u, v) * far);
    rays.into_iter().chain([Vec3::zeros()]).collect()
}

/// Calls `f` with every solid of an item; of terrain, which may be large, only with those that can meet the convex hull of the points `within`
/// (camera frame; no points: everywhere).
pub(crate) fn of_item<'a>(
    item: &'a Item,
    x_camera_world: &Pose,
    within: &[Vec3],
    mut f: impl FnMut(Solid<'a>),
) {
    let x = x_camera_world * item.x_world_item;
    let p_camera = x.translation.vector;
    let z = || x.rotation * Vec3::z();
    match &item.geometry {
        &Geometry::Shape(Shape::Sphere { radius }) => f(Solid::Ball { p_camera, radius }),
        &Geometry::Shape(Shape::Capsule { radius, length }) => {
            f(Solid::Capsule { p_camera, axis: z(), length, radius });
        }
        &Geometry::Shape(Shape::Box { half }) => f(Solid::Box { x_camera_box: x, half }),
        Geometry::Shape(Shape::HalfSpace) => f(Solid::Plane { p_camera, normal: z() }),
        Geometry::Shape(Shape::ConvexHull(hull)) => {
            let v: Vec<Vec3> = hull.vertices().iter().map(|v| transform(&x, v)).collect();
            for face in hull.faces() {
                // A fan of triangles about the first corner.
                if let [first, around @ ..] = hull.boundary(face) {
                    for ends in around.windows(2) {
                        f(Solid::Triangle([*first, ends[0], ends[1]].map(|index| v[index as usize])));
                    }
                }
            }
        }
        Geometry::Shape(Shape::HeightField(field)) => {
            let points = within.iter().map(|p| inverse_transform(&x, p)).map(|p| Aabb { min: p, max: p });
            let around = points.reduce(|a, b| a.union(&b));
            let cells = match &around {
                None => Some(field.cells()),
                Some(around) => field.cells_under(around).filter(|_| field.bounds().overlaps(around)),
            };
            for corners in cells.into_iter().flat_map(|cells| field.triangles(cells)) {
                f(Solid::Triangle(corners.map(|v| transform(&x, &v))));
            }
        }
        Geometry::Blade { mesh, length, width } => {
            f(Solid::Blade { x_camera_blade: x, mesh, length: *length, width: *width });
        }
    }
}

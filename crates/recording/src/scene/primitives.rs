//! Shapes as Foxglove draws them.

use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, Point3, Quaternion, SceneEntity, SpherePrimitive,
    TriangleListPrimitive, Vector3,
};
use orchard_geometry::{HeightField, Pose, Rotation, Shape, Vec3};

/// A pose.
pub fn message_pose(pose: &Pose) -> foxglove::messages::Pose {
    let q = pose.rotation.coords;
    foxglove::messages::Pose {
        position: Some(message_vector(&pose.translation.vector)),
        orientation: Some(Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }),
    }
}

/// A vector.
pub fn message_vector(v: &Vec3) -> Vector3 {
    Vector3 { x: v.x, y: v.y, z: v.z }
}

/// A colour.
pub fn color([r, g, b, a]: [f64; 4]) -> Color {
    Color { r, g, b, a }
}

/// Adds a shape at a pose in the entity's frame. Unbounded shapes are left out.
pub fn push(entity: &mut SceneEntity, shape: &Shape, x_frame_shape: &Pose, rgba: [f64; 4]) {
    match shape {
        Shape::Sphere { radius } => push_sphere(entity, x_frame_shape, *radius, rgba),
        Shape::Capsule { radius, length } => {
            let along = |z: f64| x_frame_shape * Pose::translation(0.0, 0.0, z);
            push_sphere(entity, &along(0.0), *radius, rgba);
            push_sphere(entity, &along(*length), *radius, rgba);
            entity.cylinders.push(CylinderPrimitive {
                pose: Some(message_pose(&along(0.5 * length))),
                size: Some(Vector3 { x: 2.0 * radius, y: 2.0 * radius, z: *length }),
                bottom_scale: 1.0,
                top_scale: 1.0,
                color: Some(color(rgba)),
            });
        }
        Shape::Box { half } => entity.cubes.push(CubePrimitive {
            pose: Some(message_pose(x_frame_shape)),
            size: Some(message_vector(&(2.0 * half))),
            color: Some(color(rgba)),
        }),
        Shape::ConvexHull(hull) => {
            let indices = hull.faces().iter().flat_map(|face| fan(hull.boundary(face))).collect();
            push_triangles(entity, x_frame_shape, hull.vertices(), indices, rgba);
        }
        Shape::HalfSpace | Shape::HeightField(_) => {}
    }
}

/// Triangles of a convex polygon.
fn fan(corners: &[u32]) -> impl Iterator<Item = u32> + '_ {
    corners.windows(2).skip(1).flat_map(|pair| [corners[0], pair[0], pair[1]])
}

fn push_sphere(entity: &mut SceneEntity, pose: &Pose, radius: f64, rgba: [f64; 4]) {
    entity.spheres.push(SpherePrimitive {
        pose: Some(message_pose(pose)),
        size: Some(message_vector(&Vec3::repeat(2.0 * radius))),
        color: Some(color(rgba)),
    });
}

/// Adds triangles: points in a frame at a pose in the entity's, and three indices a triangle.
pub fn push_triangles(
    entity: &mut SceneEntity,
    x_frame_points: &Pose,
    points: &[Vec3],
    indices: Vec<u32>,
    rgba: [f64; 4],
) {
    entity.triangles.push(TriangleListPrimitive {
        pose: Some(message_pose(x_frame_points)),
        points: points.iter().map(|p| Point3 { x: p.x, y: p.y, z: p.z }).collect(),
        color: Some(color(rgba)),
        colors: Vec::new(),
        indices,
    });
}

/// Adds a level square about the origin, `half` a side \[m\].
pub fn push_square(entity: &mut SceneEntity, half: f64, rgba: [f64; 4]) {
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let corners = corners.map(|[x, y]| Vec3::new(x, y, 0.0));
    push_triangles(entity, &Pose::identity(), &corners, vec![0, 1, 2, 0, 2, 3], rgba);
}

/// Adds the surface of terrain.
pub fn push_terrain(entity: &mut SceneEntity, field: &HeightField, rgba: [f64; 4]) {
    let points: Vec<Vec3> = field.triangles(field.cells()).flatten().collect();
    let indices = (0..points.len() as u32).collect();
    let pose = Pose::from_parts(Vec3::zeros().into(), Rotation::identity());
    push_triangles(entity, &pose, &points, indices, rgba);
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::ConvexHull;
    use std::sync::Arc;

    #[test]
    fn a_hull_is_drawn_with_its_volume() {
        let corners: Vec<Vec3> = (0..8)
            .map(|i| Vec3::new(f64::from(i & 1), f64::from(i >> 1 & 1) * 2.0, f64::from(i >> 2) * 3.0))
            .collect();
        let hull = Shape::ConvexHull(Arc::new(ConvexHull::new(&corners).unwrap()));
        let mut entity = SceneEntity::default();
        push(&mut entity, &hull, &Pose::identity(), [1.0; 4]);
        let list = &entity.triangles[0];
        let p = |i: u32| list.points[i as usize];
        let v = |i: u32| Vec3::new(p(i).x, p(i).y, p(i).z);
        // Signed tetrahedra from the origin: outward triangles add up to the volume.
        let volume: f64 =
            list.indices.chunks_exact(3).map(|t| v(t[0]).dot(&v(t[1]).cross(&v(t[2]))) / 6.0).sum();
        assert!((volume - 6.0).abs() < 1e-12, "{volume}");
    }

    #[test]
    fn a_capsule_spans_its_axis() {
        let mut entity = SceneEntity::default();
        let pose = Pose::translation(1.0, 0.0, 0.0);
        push(&mut entity, &Shape::Capsule { radius: 0.1, length: 2.0 }, &pose, [1.0; 4]);
        let at = |pose: &Option<foxglove::messages::Pose>| pose.unwrap().position.unwrap();
        assert_eq!((at(&entity.cylinders[0].pose).z, at(&entity.cylinders[0].pose).x), (1.0, 1.0));
        assert_eq!(entity.spheres.iter().map(|s| at(&s.pose).z).collect::<Vec<f64>>(), [0.0, 2.0]);
        assert_eq!(entity.cylinders[0].size.unwrap().x, 0.2);
    }
}

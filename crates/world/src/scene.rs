//! What the camera can see of a world's present state.

use orchard_camera::{Geometry, Label, NO_INSTANCE, Scene};
use orchard_geometry::{Pose, Shape, Vec3, rotation_from_z};
use orchard_multibody::Data;
use orchard_treegen::{LeafSite, Skeleton};
use orchard_treephys::TreeBody;

/// The things of a world that are drawn: wood and leaves that move with their segment, fruit, robot, ground.
pub(crate) struct Visible<'a> {
    pub tree: &'a TreeBody,
    pub shapes: &'a [Shape],
    pub leaves: &'a [LeafSite],
    pub fruit_radius: &'a [f64],
    pub robot: Vec<(Shape, Pose)>,
}

/// Builds the scene. Instances: segment index, leaf index, fruit index, robot shape index.
pub(crate) fn build(
    visible: &Visible<'_>,
    data: &Data,
    fruit_points: &[orchard_multibody::PointId],
) -> Scene {
    let mut scene = Scene::default();
    scene.push(Geometry::Shape(Shape::HalfSpace), Pose::identity(), Label::Ground, NO_INSTANCE);
    push_tree(&mut scene, visible.shapes, visible.leaves, |i| *data.x_world_body(visible.tree.bodies[i]));
    for (i, (point, &radius)) in fruit_points.iter().zip(visible.fruit_radius).enumerate() {
        push_fruit(&mut scene, i, &data.point_p_world[point.index()], radius);
    }
    for (i, (shape, pose)) in visible.robot.iter().enumerate() {
        scene.push(Geometry::Shape(shape.clone()), *pose, Label::Robot, i as u32);
    }
    scene
}

/// Adds wood and leaves, segments posed in the world.
pub(crate) fn push_tree(
    scene: &mut Scene,
    shapes: &[Shape],
    leaves: &[LeafSite],
    x_world_segment: impl Fn(usize) -> Pose,
) {
    for (i, shape) in shapes.iter().enumerate() {
        scene.push(Geometry::Shape(shape.clone()), x_world_segment(i), Label::Wood, i as u32);
    }
    for (i, leaf) in leaves.iter().enumerate() {
        let geometry = Geometry::Blade { length: leaf.length, width: leaf.width };
        scene.push(geometry, x_world_segment(leaf.segment) * leaf.x_segment_leaf, Label::Leaf, i as u32);
    }
}

/// Adds a fruit.
pub(crate) fn push_fruit(scene: &mut Scene, index: usize, p_world: &Vec3, radius: f64) {
    let pose = Pose::from_parts((*p_world).into(), orchard_geometry::Rotation::identity());
    scene.push(Geometry::Shape(Shape::Sphere { radius }), pose, Label::Fruit, index as u32);
}

/// Form of every segment.
pub(crate) fn wood_shapes(skeleton: &Skeleton) -> Vec<Shape> {
    skeleton.segments.iter().map(|s| Shape::Capsule { radius: s.radius, length: s.length }).collect()
}

/// Draws a stem from its spur to the skin of its fruit.
pub(crate) fn push_stem(scene: &mut Scene, p_anchor_world: &Vec3, p_fruit_world: &Vec3, fruit_radius: f64) {
    const STEM_RADIUS: f64 = 1.5e-3;
    let along = p_fruit_world - p_anchor_world;
    let length = along.norm() - fruit_radius;
    if length > 0.0 {
        let pose = Pose::from_parts((*p_anchor_world).into(), rotation_from_z(&along.normalize()));
        let shape = Shape::Capsule { radius: STEM_RADIUS, length };
        scene.push(Geometry::Shape(shape), pose, Label::Wood, NO_INSTANCE);
    }
}

//! Drawn parts of trees: wood, leaves, fruit, stems.

use orchard_camera::{Geometry, Label, NO_INSTANCE, Scene, blade::BladeMesh};
use orchard_geometry::{Pose, Shape, Vec3, rotation_from_z, transform};
use orchard_treegen::{LeafSite, Skeleton, Spur};
use std::sync::Arc;

/// Adds wood and leaves, segments posed in the world.
pub(crate) fn push_tree(
    scene: &mut Scene,
    shapes: &[Shape],
    leaves: &[LeafSite],
    blade: &Arc<BladeMesh>,
    x_world_segment: impl Fn(usize) -> Pose,
) {
    for (i, shape) in shapes.iter().enumerate() {
        scene.push(Geometry::Shape(shape.clone()), x_world_segment(i), Label::Wood, i as u32);
    }
    for (i, leaf) in leaves.iter().enumerate() {
        let geometry = Geometry::Blade { mesh: blade.clone(), length: leaf.length, width: leaf.width };
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

/// Draws the wood that is too fine to be a segment: spurs, and the stub that bears a fruit off the bark, where no spur does.
/// `radius` \[m\] is that of spurs; fruit are given by segment and anchor in its frame \[m\].
pub(crate) fn push_fine_wood<'a>(
    scene: &mut Scene,
    radius: f64,
    skeleton: &Skeleton,
    fruit: impl Iterator<Item = (usize, &'a Vec3)>,
    x_world_segment: impl Fn(usize) -> Pose,
) {
    let mut push = |segment: usize, p_segment: &Vec3, q_segment: &Vec3| {
        let x_world = x_world_segment(segment);
        let ends = [p_segment, q_segment].map(|p| transform(&x_world, p));
        push_rod(scene, radius, &ends[0], &ends[1], segment as u32);
    };
    let tip = |spur: &Spur| spur.p_segment + spur.heading_segment * spur.length;
    for spur in &skeleton.spurs {
        push(spur.segment, &spur.p_segment, &tip(spur));
    }
    for (segment, p_anchor) in fruit {
        let p_axis = Vec3::new(0.0, 0.0, p_anchor.z);
        let off_bark = (p_anchor - p_axis).norm() > skeleton.segments[segment].radius + radius;
        let on_spur = |spur: &Spur| spur.segment == segment && (tip(spur) - p_anchor).norm() < radius;
        if off_bark && !skeleton.spurs.iter().any(on_spur) {
            push(segment, &p_axis, p_anchor);
        }
    }
}

/// Draws a stem of a radius \[m\] from its spur to the skin of its fruit.
pub(crate) fn push_stem(
    scene: &mut Scene,
    radius: f64,
    p_anchor_world: &Vec3,
    p_fruit_world: &Vec3,
    fruit_radius: f64,
) {
    let along = p_fruit_world - p_anchor_world;
    let length = along.norm();
    if length > fruit_radius {
        let p_skin_world = p_anchor_world + along * (1.0 - fruit_radius / length);
        push_rod(scene, radius, p_anchor_world, &p_skin_world, NO_INSTANCE);
    }
}

/// Draws a thin piece of wood between two points.
fn push_rod(scene: &mut Scene, radius: f64, p_world: &Vec3, q_world: &Vec3, instance: u32) {
    let along = q_world - p_world;
    let length = along.norm();
    if length > 0.0 {
        let pose = Pose::from_parts((*p_world).into(), rotation_from_z(&(along / length)));
        scene.push(Geometry::Shape(Shape::Capsule { radius, length }), pose, Label::Wood, instance);
    }
}

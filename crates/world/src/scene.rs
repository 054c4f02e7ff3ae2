//! Visible scene of a world's present state.

use crate::World;
use crate::scenery::{self, Strut};

use orchard_camera::{Geometry, Label, NO_INSTANCE, Scene, blade::BladeMesh};
use orchard_geometry::{Pose, Shape, Vec3, rotation_from_z, transform};
use orchard_multibody::{Data, PointId};
use orchard_treegen::{LeafSite, Skeleton, Spur};
use orchard_treephys::TreeBody;
use std::sync::Arc;

/// The things of a world that are drawn: wood and leaves that move with their segment, fruit, robot, posts and wires,
/// ground.
struct Visible<'a> {
    tree: &'a TreeBody,
    shapes: &'a [Shape],
    leaves: &'a [LeafSite],
    blade: Arc<BladeMesh>,
    fruit_radius: &'a [f64],
    robot: Vec<(Shape, Pose)>,
    ground: Shape,
    struts: &'a [Strut],
}

impl World {
    /// The visible scene of the present state.
    pub fn scene(&self) -> Scene {
        self.scene_of(&self.state.data)
    }

    pub(crate) fn scene_of(&self, data: &Data) -> Scene {
        let shapes = wood_shapes(&self.parts.skeleton);
        let fruit_radius: Vec<f64> = self.parts.fruit.fruit.iter().map(|f| f.radius).collect();
        let visible = Visible {
            tree: &self.parts.tree,
            shapes: &shapes,
            leaves: &self.parts.skeleton.leaves,
            blade: Arc::new(BladeMesh::from_spec(&self.spec().foliage)),
            fruit_radius: &fruit_radius,
            robot: self.robot_shapes(data),
            ground: self.parts.ground.shape(),
            struts: &self.parts.struts,
        };
        build(&visible, data, &self.parts.fruit.points)
    }

    /// The scene for people: in the tree's own colours, with spurs and stems, which are thinner than a pixel of the depth
    /// camera, and with a plain round the modelled part of bumpy ground.
    pub fn picture_scene(&self) -> Scene {
        let mut scene = self.scene();
        let data = &self.state.data;
        let bodies = &self.parts.tree.bodies;
        let anchors = self.parts.fruit.fruit.iter().map(|fruit| (fruit.segment, &fruit.p_segment));
        push_fine_wood(&mut scene, self.spec().tree.spur_radius.si(), &self.parts.skeleton, anchors, |i| {
            *data.x_world_body(bodies[i])
        });
        self.appearance.paint(&mut scene);
        if let Some(field) = self.terrain() {
            push_plain(&mut scene, field.bounds().min.z);
        }
        for (i, &point) in self.parts.fruit.points.iter().enumerate() {
            let anchor = data.anchor_p_world(&self.parts.model, point);
            if let (Some(p_anchor), true) = (anchor, data.tethered[point.index()]) {
                let radius = self.parts.fruit.fruit[i].radius;
                push_stem(
                    &mut scene,
                    self.spec().fruit.stem_radius.si(),
                    &p_anchor,
                    &data.point_p_world[point.index()],
                    radius,
                );
            }
        }
        scene
    }

    /// The robot's shapes, posed in the world.
    fn robot_shapes(&self, data: &Data) -> Vec<(Shape, Pose)> {
        let links = &self.robot().articulation().links;
        let posed = links.iter().zip(&self.parts.handle.bodies).flat_map(|(link, &body)| {
            let x_world_link = *data.x_world_body(body);
            link.shapes.iter().map(move |s| (s.shape.clone(), x_world_link * s.x_link_shape))
        });
        posed.collect()
    }
}

/// Builds the scene. Instances: segment index, leaf index, fruit index, robot shape index, number of
/// the post or wire.
fn build(visible: &Visible<'_>, data: &Data, fruit_points: &[PointId]) -> Scene {
    let mut scene = Scene::default();
    scene.push(Geometry::Shape(visible.ground.clone()), Pose::identity(), Label::Ground, NO_INSTANCE);
    push_tree(&mut scene, visible.shapes, visible.leaves, &visible.blade, |i| {
        *data.x_world_body(visible.tree.bodies[i])
    });
    for (i, (point, &radius)) in fruit_points.iter().zip(visible.fruit_radius).enumerate() {
        push_fruit(&mut scene, i, &data.point_p_world[point.index()], radius);
    }
    for (i, (shape, pose)) in visible.robot.iter().enumerate() {
        scene.push(Geometry::Shape(shape.clone()), *pose, Label::Robot, i as u32);
    }
    scene.items.extend(scenery::items(visible.struts));
    scene
}

/// Draws level ground at a height \[m\].
fn push_plain(scene: &mut Scene, height: f64) {
    let pose = Pose::translation(0.0, 0.0, height);
    scene.push(Geometry::Shape(Shape::HalfSpace), pose, Label::Ground, NO_INSTANCE);
}

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

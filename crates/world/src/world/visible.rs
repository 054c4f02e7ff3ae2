//! Visible scene of a world's present state.

use std::sync::Arc;

use orchard_camera::{Geometry, Label, NO_INSTANCE, Scene, blade::BladeMesh};
use orchard_geometry::{Pose, Shape};
use orchard_multibody::{Data, PointId};
use orchard_treegen::LeafSite;
use orchard_treephys::TreeBody;

use super::World;
use crate::scene::{push_fine_wood, push_fruit, push_stem, push_tree, wood_shapes};
use crate::scenery::{self, Strut};

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

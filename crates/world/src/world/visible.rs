//! Visible scene of a world's present state.

use std::sync::Arc;

use orchard_camera::blade::BladeMesh;
use orchard_camera::{Geometry, Item, Label, MovingScene, NO_INSTANCE, Scene};
use orchard_geometry::{Pose, Rotation, Shape};
use orchard_multibody::Data;
use orchard_robot::RobotModel;
use orchard_spec::Spec;

use super::World;
use crate::build::Parts;
use crate::scene::{push_fine_wood, push_stem, push_tree, wood_shapes};
use crate::scenery;

/// Body of all that never moves. The segments of the tree follow, then its fruit, then the links of the robot.
const STILL: u32 = 0;

/// Everything that the camera can see: ground, wood and leaves that move with their segment, fruit, robot, posts and wires. Instances: segment index, leaf index, fruit index, robot shape index, number of
/// the post or wire.
pub(crate) fn moving_scene(spec: &Spec, parts: &Parts, robot: &RobotModel) -> MovingScene {
    let mut scene = MovingScene::default();
    let shape = |shape: &Shape, x: Pose, label, instance| Item {
        geometry: Geometry::Shape(shape.clone()),
        x_world_item: x,
        label,
        instance,
        color: None,
        tint: None,
    };
    scene.extend(STILL, [shape(&parts.ground.shape(), Pose::identity(), Label::Ground, NO_INSTANCE)]);
    let (skeleton, fruit) = (&parts.skeleton, &parts.fruit.fruit);
    let blade = Arc::new(BladeMesh::from_spec(&spec.foliage));
    let mut tree = Scene::default();
    push_tree(&mut tree, &wood_shapes(skeleton), &skeleton.leaves, &blade, |_| Pose::identity());
    let first_segment = STILL + 1;
    let of_wood = 0..skeleton.segments.len();
    let segments = of_wood.chain(skeleton.leaves.iter().map(|leaf| leaf.segment));
    for (item, segment) in tree.items.into_iter().zip(segments) {
        scene.extend(first_segment + segment as u32, [item]);
    }
    let first_fruit = first_segment + skeleton.segments.len() as u32;
    for (i, fruit) in fruit.iter().enumerate() {
        let ball = Shape::Sphere { radius: fruit.radius };
        scene.extend(first_fruit + i as u32, [shape(&ball, Pose::identity(), Label::Fruit, i as u32)]);
    }
    let first_link = first_fruit + fruit.len() as u32;
    let mut instances = 0..;
    for (link, body) in robot.articulation().links.iter().zip(first_link..) {
        let shapes = link.shapes.iter().zip(instances.by_ref());
        scene.extend(
            body,
            shapes.map(|(s, instance)| shape(&s.shape, s.x_link_shape, Label::Robot, instance)),
        );
    }
    scene.extend(STILL, scenery::items(&parts.struts));
    scene
}

impl World {
    /// The visible scene of the present state.
    pub fn scene(&self) -> Scene {
        self.scene_in(&self.state.data)
    }

    fn scene_in(&self, data: &Data) -> Scene {
        self.visible.posed(&self.x_world_visible(data))
    }

    /// Poses of the bodies of [`moving_scene`] in a state.
    pub(crate) fn x_world_visible(&self, data: &Data) -> Vec<Pose> {
        let parts = &self.parts;
        let segments = parts.tree.bodies.iter().map(|&body| *data.x_world_body(body));
        let fruit =
            parts.fruit.points.iter().map(|point| {
                Pose::from_parts(data.point_p_world[point.index()].into(), Rotation::identity())
            });
        let links = parts.handle.bodies.iter().map(|&body| *data.x_world_body(body));
        std::iter::once(Pose::identity()).chain(segments).chain(fruit).chain(links).collect()
    }

    /// The scene for people: in the tree's own colours, with spurs and stems, which are thinner than a pixel of the depth
    /// camera, and with a plain round the modelled part of bumpy ground.
    pub fn picture_scene(&self) -> Scene {
        self.picture_scene_in(&self.state.data)
    }

    /// [`Self::picture_scene`] of an earlier state of the episode. Fruit that hang now have a stem.
    pub(crate) fn picture_scene_in(&self, data: &Data) -> Scene {
        let mut scene = self.pictured().posed(&self.x_world_visible(data));
        scene.items.append(&mut self.stems_in(data).items);
        scene
    }

    /// What pictures show but for stems: the items of [`moving_scene`] and what is fixed to its bodies besides. It is made when it is first asked for.
    pub(crate) fn pictured(&self) -> &Arc<MovingScene> {
        self.pictured.get_or_init(|| {
            let mut scene = (*self.visible).clone();
            let anchors = self.parts.fruit.fruit.iter().map(|fruit| (fruit.segment, &fruit.p_segment));
            let radius = self.spec().tree.spur_radius.si();
            let mut fine = Scene::default();
            push_fine_wood(&mut fine, radius, &self.parts.skeleton, anchors, |_| Pose::identity());
            for item in fine.items {
                // Its instance is its segment.
                scene.extend(STILL + 1 + item.instance, [item]);
            }
            self.appearance.paint(scene.items_mut());
            if let Some(field) = self.terrain() {
                let mut plain = Scene::default();
                push_plain(&mut plain, field.bounds().min.z);
                scene.extend(STILL, plain.items);
            }
            Arc::new(scene)
        })
    }

    /// Stems of the fruit that hang now, in a state. Their lengths change as fruit swing.
    pub(crate) fn stems_in(&self, data: &Data) -> Scene {
        let (mut scene, radius) = (Scene::default(), self.spec().fruit.stem_radius.si());
        for (i, &point) in self.parts.fruit.points.iter().enumerate() {
            let anchor = data.anchor_p_world(&self.parts.model, point);
            if let (Some(p_anchor), true) = (anchor, self.state.data.tethered[point.index()]) {
                let p_fruit = &data.point_p_world[point.index()];
                push_stem(&mut scene, radius, &p_anchor, p_fruit, self.parts.fruit.fruit[i].radius);
            }
        }
        scene
    }
}

/// Draws level ground at a height \[m\].
fn push_plain(scene: &mut Scene, height: f64) {
    let pose = Pose::translation(0.0, 0.0, height);
    scene.push(Geometry::Shape(Shape::HalfSpace), pose, Label::Ground, NO_INSTANCE);
}

//! The visible things of a world, as instances of small meshes.

use std::collections::BTreeMap;
use std::sync::Arc;

use orchard_camera::blade::BladeMesh;
use orchard_camera::{Geometry, Item, Label, NO_INSTANCE};
use orchard_geometry::Shape;
use orchard_world::World;
use orchard_world::truth::FruitState;

use crate::grip::Grip;
use crate::mesh::{Fineness, Mesh};
use crate::paint::{Colour, Paint, WoodPaint, load_colour};
use crate::rules::GroundRules;

/// Numbers of an instance: place (3), rotation as a quaternion x y z w (4), sizes (3), colour (3), kind (1).
pub const INSTANCE_FLOATS: usize = 14;

/// Instances of a mesh that follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Group {
    /// Index of the mesh.
    pub mesh: usize,
    /// Number of instances.
    pub count: usize,
}

/// The visible things: meshes, and their instances in the world's frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Picture {
    /// The meshes.
    pub meshes: Vec<Mesh>,
    /// The instances of each mesh, in the order of [`Picture::instances`].
    pub groups: Vec<Group>,
    /// The instances, [`INSTANCE_FLOATS`] numbers each.
    pub instances: Vec<f32>,
}

/// Colours told apart by all kinds of colour vision: those of fruit are of Okabe and Ito's palette, and far lighter or darker than leaves and wood.
mod colour {
    use crate::paint::Colour;

    /// Orange.
    pub const ON_TREE: Colour = [0.90, 0.62, 0.0];
    /// Yellow.
    pub const HELD: Colour = [0.94, 0.89, 0.26];
    /// Sky blue.
    pub const DEPOSITED: Colour = [0.34, 0.71, 0.91];
    /// Reddish purple.
    pub const DROPPED: Colour = [0.80, 0.47, 0.65];
    pub const GRABBED: Colour = [1.0, 1.0, 1.0];
    pub const LEAF: Colour = [0.25, 0.40, 0.30];
    pub const WOOD: Colour = [0.45, 0.36, 0.29];
    /// Wood that broke off.
    pub const DEBRIS: Colour = [0.80, 0.47, 0.65];
    pub const ROBOT: Colour = [0.78, 0.80, 0.84];
    pub const BASE: Colour = [0.36, 0.40, 0.46];
    pub const GROUND: Colour = [0.56, 0.54, 0.50];
    pub const POST: Colour = [0.60, 0.56, 0.50];
}

/// Kinds of instances that are drawn in a way of their own: all others are 0.
const KIND_GROUND: f32 = 1.0;

/// Places of the meshes in [`Picture::meshes`]; hulls and terrain follow.
const CAPSULE: usize = 0;
const CUBOID: usize = 1;
const BLADE: usize = 2;
const SQUARE: usize = 3;
const BALL: usize = 4;
const OWN: usize = 5;

/// A mesh of fewer triangles for the instances of another one that are small on a screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Coarse {
    /// The mesh.
    pub mesh: Mesh,
    /// Pixels on the screen of an instance's first size, its length or its radius, below which nobody sees a difference.
    pub below: f32,
}

/// Collects the instances of every mesh. It keeps the meshes from picture to picture of the same world.
#[derive(Debug)]
pub struct Drawing {
    meshes: Vec<Mesh>,
    coarse: [Option<Coarse>; OWN],
    instances: Vec<Vec<f32>>,
    /// Mesh of each hull and terrain, by the address of its shared shape.
    shared: BTreeMap<usize, usize>,
    /// Half the side of level ground \[m\].
    extent: f64,
}

impl Picture {
    /// The picture of a world in plain colours; the thing in the hand is highlighted.
    pub(crate) fn of(world: &World, grip: Option<&Grip>, ground: &GroundRules) -> Self {
        let mut drawing = Drawing::new(world, ground);
        drawing.draw(world, grip, &Paint::default());
        let groups = drawing.groups();
        Self { groups, instances: drawing.instances.concat(), meshes: drawing.meshes }
    }
}

impl Drawing {
    /// A drawing of a world without instances.
    pub fn new(world: &World, ground: &GroundRules) -> Self {
        let blade = BladeMesh::from_spec(&world.spec().foliage);
        Self {
            instances: vec![Vec::new(); OWN],
            meshes: vec![
                Mesh::capsule(Fineness::TWIG),
                Mesh::cuboid(),
                Mesh::blade(&blade),
                Mesh::square(),
                Mesh::capsule(Fineness::APPLE),
            ],
            coarse: [
                Some(Coarse { mesh: Mesh::capsule(Fineness::COARSE_TWIG), below: 3.0 }),
                None,
                Some(Coarse { mesh: Mesh::coarse_blade(&blade), below: 16.0 }),
                None,
                Some(Coarse { mesh: Mesh::capsule(Fineness::COARSE_APPLE), below: 7.0 }),
            ],
            shared: BTreeMap::new(),
            extent: ground.extent.si(),
        }
    }

    /// Half the side of level ground \[m\].
    pub fn extent(&self) -> f64 {
        self.extent
    }

    /// Draws level ground so far from the middle \[m\].
    pub fn set_extent(&mut self, extent: f64) {
        self.extent = extent;
    }

    /// Lists the instances of the tree alone, with its fruit, posts and wires.
    pub fn draw_tree(&mut self, world: &World) {
        self.list(world, None, &Paint::default(), |label| {
            matches!(label, Label::Wood | Label::Leaf | Label::Fruit | Label::Scenery)
        });
    }

    /// Lists the instances of the present state.
    pub fn draw(&mut self, world: &World, grip: Option<&Grip>, paint: &Paint) {
        self.list(world, grip, paint, |label| paint.leaves || label != Label::Leaf);
    }

    fn list(&mut self, world: &World, grip: Option<&Grip>, paint: &Paint, wanted: impl Fn(Label) -> bool) {
        self.instances.iter_mut().for_each(Vec::clear);
        let scene = world.picture_scene();
        let fruit: Vec<FruitState> = world.fruit_truth().iter().map(|fruit| fruit.state).collect();
        for item in &scene.items {
            if wanted(item.label) {
                self.push(item, colour_of(world, item, &fruit, grip, paint.wood));
            }
        }
    }

    /// The meshes so far.
    pub fn meshes(&self) -> &[Mesh] {
        &self.meshes
    }

    /// Coarser forms of the first meshes.
    pub fn coarse(&self) -> &[Option<Coarse>] {
        &self.coarse
    }

    /// The instances of each mesh.
    pub fn instances(&self) -> &[Vec<f32>] {
        &self.instances
    }

    fn groups(&self) -> Vec<Group> {
        let count = |list: &Vec<f32>| list.len() / INSTANCE_FLOATS;
        self.instances.iter().enumerate().map(|(mesh, list)| Group { mesh, count: count(list) }).collect()
    }
}

impl Drawing {
    fn push(&mut self, item: &Item, colour: Colour) {
        let (mesh, sizes) = match &item.geometry {
            Geometry::Blade { length, width, .. } => (BLADE, [*length, *width, 0.0]),
            Geometry::Shape(Shape::Sphere { radius }) => (BALL, [*radius, 0.0, 0.0]),
            Geometry::Shape(Shape::Capsule { radius, length }) => (CAPSULE, [*radius, *length, 0.0]),
            Geometry::Shape(Shape::Box { half }) => (CUBOID, [half.x, half.y, half.z]),
            Geometry::Shape(Shape::HalfSpace) => (SQUARE, [self.extent, 0.0, 0.0]),
            Geometry::Shape(Shape::ConvexHull(hull)) => {
                (self.shared(Arc::as_ptr(hull) as usize, || Mesh::hull(hull)), [1.0, 0.0, 0.0])
            }
            Geometry::Shape(Shape::HeightField(field)) => {
                (self.shared(Arc::as_ptr(field) as usize, || Mesh::terrain(field)), [1.0, 0.0, 0.0])
            }
        };
        let (p, q) = (item.x_world_item.translation.vector, item.x_world_item.rotation.coords);
        let kind = if item.label == Label::Ground { KIND_GROUND } else { 0.0 };
        let numbers = p.iter().chain(q.iter()).chain(&sizes).map(|x| *x as f32);
        self.instances[mesh].extend(numbers.chain(colour).chain([kind]));
    }

    /// The mesh of a shape that its instances share.
    fn shared(&mut self, address: usize, make: impl FnOnce() -> Mesh) -> usize {
        *self.shared.entry(address).or_insert_with(|| {
            self.meshes.push(make());
            self.instances.push(Vec::new());
            self.meshes.len() - 1
        })
    }
}

fn colour_of(
    world: &World,
    item: &Item,
    fruit: &[FruitState],
    grip: Option<&Grip>,
    wood: WoodPaint,
) -> Colour {
    let instance = item.instance as usize;
    let is_held = match (grip, item.label) {
        (Some(Grip::Wood { segment, .. }), Label::Wood) => *segment == instance,
        (Some(Grip::Fruit { fruit }), Label::Fruit) => *fruit == instance,
        _ => false,
    };
    if is_held {
        return colour::GRABBED;
    }
    match item.label {
        Label::Fruit => match fruit.get(instance) {
            Some(FruitState::Held) => colour::HELD,
            Some(FruitState::Deposited) => colour::DEPOSITED,
            Some(FruitState::Dropped) => colour::DROPPED,
            _ => colour::ON_TREE,
        },
        Label::Leaf => {
            let dead =
                world.skeleton().leaves.get(instance).is_some_and(|l| world.rupture().is_debris(l.segment));
            if dead {
                shade(colour::DEBRIS, LEAF_OF_DEBRIS)
            } else {
                shade(colour::LEAF, leaf_shade(instance))
            }
        }
        Label::Wood if item.instance == NO_INSTANCE => colour::WOOD,
        Label::Wood if world.rupture().is_debris(instance) => colour::DEBRIS,
        Label::Wood if wood == WoodPaint::Load => {
            let tree = world.tree();
            let moment = tree.stiffness[instance] * tree.bending_angle(world.model(), world.data(), instance);
            load_colour(moment / tree.rupture_moment[instance])
        }
        Label::Wood => colour::WOOD,
        Label::Robot if matches!(item.geometry, Geometry::Shape(Shape::Box { .. })) => colour::BASE,
        Label::Robot => colour::ROBOT,
        Label::Scenery => colour::POST,
        Label::Ground | Label::None => colour::GROUND,
    }
}

/// Brightness of leaves on broken limbs.
const LEAF_OF_DEBRIS: f32 = 0.7;

/// Brightness of a leaf, a little different from that of its neighbours, so that leaves can be told apart.
fn leaf_shade(leaf: usize) -> f32 {
    const SHADES: usize = 7;
    const STEP: f32 = 0.05;
    // Neighbours in the list have far shades.
    0.85 + STEP * ((leaf * 3) % SHADES) as f32
}

fn shade(colour: Colour, by: f32) -> Colour {
    colour.map(|channel| (channel * by).min(1.0))
}

#[cfg(test)]
#[path = "picture_tests.rs"]
mod tests;

//! The table that the contacts of whole worlds read: the robot's colliders, and the places of each world.

use bytemuck::cast;
use orchard_batch::Plant;
use orchard_fruit::FruitSet;
use orchard_geometry::{Pose, Shape, Vec3, transform};
use orchard_multibody::contact::in_series;
use orchard_multibody::{Collider, ColliderId, Model, Owner};
use orchard_robot::{RobotHandle, RobotModel};
use orchard_treephys::TreeBody;

use crate::BatchError;
use crate::layout::{
    LANES, QUAD, block, collider, contact, desk, head, material, meeting, pair, path, place, robot, solid,
    still, system,
};
use crate::memory::{Memory, PlacedQuad, Room, depth};
use crate::robots::Alone;
use crate::robots::table::{ON_GROUND, Place, refused};

/// Segment above the root.
const NO_PARENT: u32 = 0xffff;

/// The table, and the size of the buffer of meetings.
#[derive(Debug)]
pub(crate) struct WorldTable {
    pub words: Vec<u32>,
    /// First number of the records of worlds in the buffer of meetings, and their numbers.
    pub records: usize,
    pub record: usize,
    /// Numbers of a desk.
    desk: usize,
}

/// Friction and stiffness of a surface.
#[derive(Debug, Clone, Copy)]
struct Surface {
    friction: f64,
    stiffness: f64,
}

impl Surface {
    fn of(one: &Collider) -> Self {
        Self { friction: one.friction, stiffness: one.stiffness }
    }

    /// Friction and stiffness of its contact with another one.
    fn on(self, other: Self) -> [u32; 2] {
        [bits((self.friction * other.friction).sqrt()), bits(in_series(self.stiffness, other.stiffness))]
    }
}

impl WorldTable {
    /// The table of worlds with a robot of one kind that starts in each at `x_world_odom`, with room for larger trees.
    ///
    /// # Errors
    /// The kernels lack a shape of the robot, or it has too many.
    pub fn new(
        memory: &Memory,
        plants: &[&Plant],
        robot_model: &RobotModel,
        alone: &Alone,
        links: &[Place],
        x_world_odom: &[Pose],
        room: &Room,
    ) -> Result<Self, BatchError> {
        let colliders = alone.model.colliders();
        if colliders.len() > collider::MOST {
            let (has, most) = (colliders.len(), collider::MOST);
            return Err(refused(robot_model, &format!("it has {has} colliders, the kernels know {most}")));
        }
        let spec = &plants[0].spec;
        let wood = Surface { friction: spec.wood.friction.si(), stiffness: spec.wood.contact_stiffness.si() };
        let fruit =
            Surface { friction: spec.fruit.friction.si(), stiffness: spec.fruit.contact_stiffness.si() };
        let mut words = vec![0; head::FIELDS];
        let model = &plants[0].model;
        let (still, ground) = standing(model);
        // Where there is none, its figures are not used.
        let surface = |id: Option<ColliderId>| id.map_or(fruit, |id| Surface::of(model.collider(id)));
        let met = [wood, fruit, surface(still.first().copied()), surface(ground)];
        for (index, one) in colliders.iter().enumerate() {
            let numbers = of_collider(one, links, met).map_err(|why| refused(robot_model, why))?;
            words.extend(numbers);
            let own = words.len() - collider::FIELDS;
            for (other, later) in colliders.iter().enumerate().skip(index + 1) {
                words[own + collider::MEETS] |= u32::from(one.groups.may_touch(later.groups)) << other;
            }
        }
        for &id in &still {
            words.extend(of_still(model.collider(id)));
        }
        let depth = plants.iter().map(|plant| depth(&plant.tree.parent)).max().unwrap_or(0).max(room.depth());
        let most = plants.iter().map(|plant| plant.tree.len() + plant.fruit.len()).max().unwrap_or(0);
        let most = most.max(room.colliders());
        let own = (place::FIELDS + most + 2 * place::MOST_OVERLAPS).next_multiple_of(QUAD);
        let record = meeting::FIELDS + meeting::MOST_CONTACTS * contact::FIELDS + meeting::MOST_PAIRS;
        let desk = meeting::MOST_CONTACTS * 3 * robot::DOFS
            + meeting::MOST_WAYS * depth * path::FIELDS
            + meeting::MOST_CONTACTS * meeting::MOST_CONTACTS * block::FIELDS;
        let records = plants.len().div_ceil(LANES) * system::FIELDS * LANES;
        let desks = records + plants.len() * record;
        for (field, value) in [
            (head::COLLIDERS, colliders.len()),
            (head::STILL, still.len()),
            (head::DEPTH, depth),
            (head::RECORDS, records / QUAD),
            (head::RECORD, record / QUAD),
            (head::DESKS, desks / QUAD),
            (head::DESK, desk / QUAD),
            (head::PLACES, words.len() / QUAD),
            (head::PLACE, own / QUAD),
        ] {
            words[field] = value as u32;
        }
        words[head::MARGIN] = bits(plants[0].settings.contact_margin);
        if spec.fruit.cluster.is_some() {
            words[head::FRUIT_STIFFNESS] = bits(in_series(fruit.stiffness, fruit.stiffness));
        }
        words[head::FRICTION_OF_FRUIT] = bits(fruit.friction);
        for (k, surface) in met[material::STILL..=material::GROUND].iter().enumerate() {
            let [friction, stiffness] = fruit.on(*surface);
            words[head::FRICTION_OF_FRUIT + 1 + k] = friction;
            words[head::STIFFNESS_OF_FRUIT + k] = stiffness;
        }
        for (index, (plant, x_world_odom)) in plants.iter().zip(x_world_odom).enumerate() {
            words.extend(of_world(memory, index, plant, x_world_odom, own));
        }
        Ok(Self { words, records, record, desk })
    }

    /// Numbers of the buffer of meetings of so many worlds.
    pub fn meetings(&self, worlds: usize) -> usize {
        let systems = worlds.div_ceil(LANES) * LANES * system::FIELDS;
        systems + worlds * self.record + self.on_desks(worlds)
    }

    /// Those of them on desks.
    pub fn on_desks(&self, worlds: usize) -> usize {
        desks(worlds) * self.desk
    }

    /// First word of the places of a world.
    fn places_at(&self, index: usize) -> usize {
        QUAD * (self.words[head::PLACES] + index as u32 * self.words[head::PLACE]) as usize
    }

    /// The places of a world in which another tree stands, for the buffer of tables.
    pub fn places_of(
        &self,
        memory: &Memory,
        index: usize,
        plant: &Plant,
        x_world_odom: &Pose,
    ) -> Vec<PlacedQuad> {
        let own = self.words[head::PLACE] as usize * QUAD;
        let words = of_world(memory, index, plant, x_world_odom, own);
        let (quads, _) = words.as_chunks();
        let first = (self.places_at(index) / QUAD) as u32;
        (first..).zip(quads).map(|(at, quad)| PlacedQuad::new(at, *quad)).collect()
    }
}

/// Number of workgroups that solve the contacts of so many worlds.
pub(super) fn desks(worlds: usize) -> usize {
    worlds.min(desk::MOST)
}

fn bits(value: f64) -> u32 {
    (value as f32).to_bits()
}

/// Returns the colliders of posts and wires, and that of the ground.
fn standing(model: &Model) -> (Vec<ColliderId>, Option<ColliderId>) {
    let fixed = || model.collider_ids().filter(|&id| model.collider(id).owner == Owner::World);
    let is_capsule = |id: &ColliderId| matches!(model.collider(*id).shape, Shape::Capsule { .. });
    (fixed().filter(is_capsule).collect(), fixed().find(|id| !is_capsule(id)))
}

/// True if two worlds have the same posts and wires.
pub(super) fn stand_alike(one: &Model, other: &Model) -> bool {
    let of = |model: &Model| -> Vec<_> {
        standing(model)
            .0
            .into_iter()
            .map(|id| (of_still(model.collider(id)), model.collider(id).friction))
            .collect()
    };
    of(one) == of(other)
}

/// True if the ground of a world is level at height 0.
fn is_level(model: &Model) -> bool {
    standing(model).1.is_some_and(|id| {
        let one = model.collider(id);
        matches!(one.shape, Shape::HalfSpace) && one.x_owner_shape == Pose::identity()
    })
}

/// Colliders of a world's model in the order of their numbers in [`ContactPoint`](super::ContactPoint).
pub fn world_colliders(
    model: &Model,
    tree: &TreeBody,
    fruit: &FruitSet,
    robot: &RobotHandle,
) -> Vec<ColliderId> {
    let own = &robot.colliders;
    let parts = [&own.base, &own.arm, &own.bucket, &own.cup];
    let mut of_robot: Vec<ColliderId> = parts.into_iter().chain(&own.fingers).flatten().copied().collect();
    of_robot.sort_unstable();
    let (still, ground) = standing(model);
    tree.colliders
        .iter()
        .chain(&fruit.colliders)
        .copied()
        .chain(of_robot)
        .chain(still)
        .chain(ground)
        .collect()
}

fn of_still(one: &Collider) -> [u32; still::FIELDS] {
    let mut words = [0; still::FIELDS];
    if let Shape::Capsule { radius, length } = one.shape {
        let along = one.x_owner_shape.rotation * Vec3::new(0.0, 0.0, length);
        words[still::RADIUS] = bits(radius);
        for k in 0..3 {
            words[still::P + k] = bits(one.x_owner_shape.translation.vector[k]);
            words[still::ALONG + k] = bits(along[k]);
        }
    }
    words
}

/// Numbers of a collider of the robot, with its laws on the other materials.
fn of_collider(
    one: &Collider,
    links: &[Place],
    on: [Surface; material::ROBOT],
) -> Result<[u32; collider::FIELDS], &'static str> {
    let mut words = [0; collider::FIELDS];
    let Owner::Body(body) = one.owner else { return Err("a collider is on no link") };
    let Place { link, x_link_frame } = links[body.index()];
    let x_link_shape = x_link_frame * one.x_owner_shape;
    words[collider::LINK] = cast(link);
    let (kind, radius, length, half) = match one.shape {
        Shape::Sphere { radius } => (solid::SPHERE, radius, 0.0, Vec3::zeros()),
        Shape::Capsule { radius, length } => (solid::CAPSULE, radius, length, Vec3::zeros()),
        Shape::Box { half } => (solid::BOX, 0.0, 0.0, half),
        _ => return Err("the kernels know balls, capsules and boxes, and no other shapes"),
    };
    words[collider::KIND] = kind as u32;
    words[collider::ON_GROUND] = u32::from(one.groups.filter & ON_GROUND != 0);
    for (k, surface) in on.into_iter().enumerate() {
        [words[collider::FRICTION + k], words[collider::STIFFNESS + k]] = Surface::of(one).on(surface);
    }
    words[collider::FRICTION + material::ROBOT] = bits(one.friction);
    words[collider::STIFFNESS + material::ROBOT] = bits(one.stiffness);
    words[collider::RADIUS] = bits(radius);
    words[collider::LENGTH] = bits(length);
    let centre = transform(&x_link_shape, &Vec3::new(0.0, 0.0, 0.5 * length));
    words[collider::BOUND] = bits(half.norm() + radius + 0.5 * length);
    let axes = x_link_shape.rotation.to_rotation_matrix().into_inner();
    for k in 0..3 {
        words[collider::HALF + k] = bits(half[k]);
        words[collider::P + k] = bits(x_link_shape.translation.vector[k]);
        words[collider::CENTRE + k] = bits(centre[k]);
        for axis in 0..3 {
            words[collider::AXES + QUAD * axis + k] = bits(axes[(k, axis)]);
        }
    }
    Ok(words)
}

/// Pairs of fruit that have grown into each other, with the depth \[m\].
pub(super) fn overlaps(plant: &Plant) -> impl Iterator<Item = ([usize; 2], f64)> {
    let colliders = &plant.fruit.colliders;
    let fruit = |id: ColliderId| colliders.iter().position(|&own| own == id);
    let pairs = plant.model.overlaps();
    pairs.filter_map(move |(a, b, depth)| Some(([fruit(a)?, fruit(b)?], depth)))
}

/// The words of a world's own, of which there are so many.
fn of_world(memory: &Memory, index: usize, plant: &Plant, x_world_odom: &Pose, own: usize) -> Vec<u32> {
    let mut words = vec![0; place::FIELDS];
    words[place::TOUCH..place::WORLD + 1].copy_from_slice(&memory.bases_of(index));
    let x = x_world_odom.rotation * Vec3::x();
    words[place::TURN] = bits(x.x);
    words[place::TURN + 1] = bits(x.y);
    for k in 0..3 {
        words[place::P + k] = bits(x_world_odom.translation.vector[k]);
    }
    words[place::SEGMENTS] = plant.tree.len() as u32;
    words[place::FRUITS] = plant.fruit.len() as u32;
    words[place::GROUND] = u32::from(is_level(&plant.model));
    let word = |row: usize, segment: u32| row as u32 | segment << 16;
    let segments = plant.tree.parent.iter().enumerate();
    words.extend(segments.map(|(segment, parent)| {
        word(memory.row_of(index, segment), parent.map_or(NO_PARENT, |parent| parent as u32))
    }));
    let fruit = plant.fruit.fruit.iter().enumerate();
    words.extend(fruit.map(|(i, fruit)| word(memory.fruit_row_of(index, i), fruit.segment as u32)));
    words.resize(own - 2 * place::MOST_OVERLAPS, 0);
    for ([first, second], depth) in overlaps(plant) {
        let [first, second] = [first, second].map(|fruit| plant.tree.len() + fruit);
        words.extend([(first << pair::FIRST | second) as u32, bits(depth)]);
        words[place::OVERLAPS] += 1;
    }
    words.resize(own, 0);
    words
}

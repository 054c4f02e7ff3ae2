//! Trees for the suite, and their errors.

use super::backends::Tolerance;
use orchard_batch::{Stepper, TreeWorld};
use orchard_fruit::place;
use orchard_geometry::{Vec3, transform};
use orchard_multibody::{Data, forward_kinematics};
use orchard_spec::{Purpose, Spec, Stream};
use orchard_treegen::grow;
use std::sync::Arc;

/// Grown trees, each of its own topology.
pub fn grown(count: u32) -> Vec<TreeWorld> {
    let spec = Arc::new(Spec::paper());
    (0..count).map(|world| TreeWorld::grow(spec.clone(), 7, world).unwrap()).collect()
}

/// Trees of one topology with their own lengths and radii.
pub fn siblings(count: u32) -> Vec<TreeWorld> {
    let spec = Arc::new(Spec::paper());
    let grown = grow(&spec, 7, 0).unwrap();
    let fruit = place(&spec.fruit, &grown, 7, 0);
    let sibling = |world| {
        let mut skeleton = grown.clone();
        let mut stream = Stream::new(11, world, Purpose::Test);
        for segment in &mut skeleton.segments {
            segment.length *= stream.uniform(0.9, 1.1);
            segment.radius *= stream.uniform(0.95, 1.05);
        }
        TreeWorld::new(spec.clone(), &skeleton, fruit.clone()).unwrap()
    };
    (0..count).map(sibling).collect()
}

/// Gives every joint of every world a random rate \[rad/s\].
pub fn kick(worlds: &mut [TreeWorld], rate: f64) {
    for (world, index) in worlds.iter_mut().zip(0..) {
        let mut stream = Stream::new(13, index, Purpose::Test);
        world.data_mut().v.iter_mut().for_each(|v| *v = stream.uniform(-rate, rate));
    }
}

/// Pushes a segment of a world and of its batch.
pub fn push(
    world: &mut TreeWorld,
    stepper: &mut dyn Stepper,
    index: usize,
    segment: usize,
    [force, torque]: [Vec3; 2],
) {
    stepper.push(index, segment, force, torque).unwrap();
    let body = world.plant().tree.bodies[segment].index();
    world.data_mut().body_force_world[body] = force;
    world.data_mut().body_torque_world[body] = torque;
}

/// Pulls a fruit of a world and of its batch.
pub fn pull(world: &mut TreeWorld, stepper: &mut dyn Stepper, index: usize, fruit: usize, force: Vec3) {
    stepper.pull(index, fruit, force);
    let point = world.plant().fruit.points[fruit].index();
    world.data_mut().point_force_world[point] = force;
}

/// State of a world in a batch, kinematics included.
pub fn state(stepper: &mut dyn Stepper, world: &TreeWorld, index: usize) -> Data {
    let mut data = world.data().clone();
    stepper.store(index, &mut data).unwrap();
    forward_kinematics(&world.plant().model, &mut data);
    data
}

/// Positions of the segments' tips \[m\].
pub fn tips(world: &TreeWorld, data: &Data) -> Vec<Vec3> {
    let plant = world.plant();
    let tip = |&id| transform(data.x_world_body(id), &(plant.model.body(id).inertia.p_com * 2.0));
    plant.tree.bodies.iter().map(tip).collect()
}

/// Largest errors of a world.
#[derive(Debug, Clone, Copy, Default)]
pub struct Errors {
    /// Of a joint angle, over the largest one.
    pub angle: f64,
    /// Of a joint rate \[rad/s\].
    pub rate: f64,
    /// Of a segment's tip \[m\].
    pub tip: f64,
    /// Of a fruit \[m\].
    pub fruit: f64,
}

impl Errors {
    pub fn of(world: &TreeWorld, data: &Data) -> Self {
        let largest =
            |errors: &mut dyn Iterator<Item = f64>| errors.fold(0.0_f64, |most, x| most.max(x.abs()));
        let mut truth = world.data().clone();
        forward_kinematics(&world.plant().model, &mut truth);
        let of = |a: &[f64], b: &[f64]| largest(&mut a.iter().zip(b).map(|(a, b)| a - b));
        let apart = |a: &[Vec3], b: &[Vec3]| largest(&mut a.iter().zip(b).map(|(a, b)| (a - b).norm()));
        Self {
            angle: of(&data.q, &truth.q) / largest(&mut truth.q.iter().copied()),
            rate: of(&data.v, &truth.v),
            tip: apart(&tips(world, data), &tips(world, &truth)),
            fruit: apart(&data.point_p_world, &truth.point_p_world),
        }
    }

    /// The larger of each error.
    pub fn max(self, other: Self) -> Self {
        Self {
            angle: self.angle.max(other.angle),
            rate: self.rate.max(other.rate),
            tip: self.tip.max(other.tip),
            fruit: self.fruit.max(other.fruit),
        }
    }

    /// True if a world without breaks is within the tolerances.
    pub fn are_within(&self, tolerance: Tolerance) -> bool {
        self.angle <= tolerance.angle && self.rate <= tolerance.rate && self.tip <= tolerance.tip
    }
}

//! Trees and forces for the tests of the kernels.

use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_geometry::Vec3;
use orchard_multibody::{Data, forward_kinematics};
use orchard_spec::{Purpose, Spec, Stream};

use crate::GpuBatch;

/// Grown trees, each of its own topology.
pub(crate) fn grown(count: u32) -> Vec<TreeWorld> {
    let spec = Arc::new(Spec::paper());
    (0..count).map(|world| TreeWorld::grow(spec.clone(), 7, world).unwrap()).collect()
}

/// Forces on segments and fruit of worlds.
#[derive(Clone, Default)]
pub(crate) struct Trial {
    pushes: Vec<(usize, usize, Vec3)>,
    pulls: Vec<(usize, usize, Vec3)>,
}

impl Trial {
    /// Slow joint rates and pulls on some tips: nothing breaks.
    pub fn gentle(mut worlds: Vec<TreeWorld>) -> (Vec<TreeWorld>, Self) {
        kick(&mut worlds, 0.5);
        let mut trial = Self::default();
        for (index, world) in worlds.iter().enumerate() {
            let parent = &world.plant().tree.parent;
            let tips = (0..parent.len()).filter(|i| !parent.contains(&Some(*i))).take(8);
            trial.pushes.extend(tips.map(|segment| (index, segment, Vec3::new(0.4, -0.2, -0.3))));
        }
        (worlds, trial)
    }

    /// Fast joint rates, an overloaded limb, and two fruit pulled off: one by its stem's tension, one by the direct pull.
    pub fn harsh(mut worlds: Vec<TreeWorld>) -> (Vec<TreeWorld>, Self) {
        kick(&mut worlds, 1.0);
        let mut trial = Self::default();
        for (index, world) in worlds.iter().enumerate() {
            let plant = world.plant();
            trial.pushes.push((index, plant.tree.len() / 3, Vec3::new(0.0, 0.0, -400.0)));
            for (fruit, factor) in [(0, 1.5), (1, 3.0)] {
                let force = Vec3::new(0.0, 0.0, -factor * plant.fruit.fruit[fruit].detach_force);
                trial.pulls.push((index, fruit, force));
            }
        }
        (worlds, trial)
    }

    /// Forces on one world, for a batch of this world alone.
    pub fn of_world(&self, index: usize) -> Self {
        let only = |all: &[(usize, usize, Vec3)]| {
            all.iter().filter(|(w, ..)| *w == index).map(|&(_, place, force)| (0, place, force)).collect()
        };
        Self { pushes: only(&self.pushes), pulls: only(&self.pulls) }
    }

    pub fn apply_to_batch(&self, batch: &mut GpuBatch) {
        for &(world, segment, force) in &self.pushes {
            assert!(batch.push(world, segment, force, Vec3::zeros()));
        }
        for &(world, fruit, force) in &self.pulls {
            batch.pull(world, fruit, force);
        }
    }

    pub fn apply_to_worlds(&self, worlds: &mut [TreeWorld]) {
        for &(index, segment, force) in &self.pushes {
            let body = worlds[index].plant().tree.bodies[segment];
            worlds[index].data_mut().body_force_world[body.index()] = force;
        }
        for &(index, fruit, force) in &self.pulls {
            let point = worlds[index].plant().fruit.points[fruit];
            worlds[index].data_mut().point_force_world[point.index()] = force;
        }
    }
}

/// Gives every joint of every world a random rate [rad/s].
fn kick(worlds: &mut [TreeWorld], rate: f64) {
    for (world, index) in worlds.iter_mut().zip(0..) {
        let mut stream = Stream::new(13, index, Purpose::Test);
        world.data_mut().v.iter_mut().for_each(|v| *v = stream.uniform(-rate, rate));
    }
}

/// State of a world in a batch.
pub(crate) fn state(batch: &mut GpuBatch, world: &TreeWorld, index: usize) -> Data {
    let mut data = world.data().clone();
    batch.store(index, &mut data).unwrap();
    data
}

/// Positions of the segments' tips [m].
pub(crate) fn tips(world: &TreeWorld, data: &Data) -> Vec<Vec3> {
    let plant = world.plant();
    let tip =
        |id| orchard_geometry::transform(data.x_world_body(id), &(plant.model.body(id).inertia.p_com * 2.0));
    plant.tree.bodies.iter().map(|&id| tip(id)).collect()
}

/// Largest errors of an angle over the largest angle, of a rate [rad/s] and of a tip [m].
pub(crate) fn errors(world: &TreeWorld, mut data: Data) -> (f64, f64, f64) {
    forward_kinematics(&world.plant().model, &mut data);
    let size = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let error = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    let truth = world.data();
    let tip =
        tips(world, &data).iter().zip(tips(world, truth)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    (error(&data.q, &truth.q) / size(&truth.q), error(&data.v, &truth.v), tip)
}

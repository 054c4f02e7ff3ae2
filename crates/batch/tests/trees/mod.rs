//! Trees for the tests of batches: those of this crate, the unit tests of `orchard-gpu` and the suite `steppers` include this file.
#![allow(dead_code)] // no test needs all of it

use orchard_batch::{Stepper, TreeWorld};
use orchard_fruit::place;
use orchard_geometry::{Vec3, transform};
use orchard_multibody::{Data, forward_kinematics};
use orchard_spec::fruit::{FruitSpec, StemSpec};
use orchard_spec::wood::WoodSpec;
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_treegen::grow;
use std::sync::Arc;

/// Grown trees, each of its own topology.
pub fn grown(count: u32) -> Vec<TreeWorld> {
    let spec = Arc::new(Spec::paper());
    (0..count).map(|world| TreeWorld::grow(spec.clone(), 7, world).unwrap()).collect()
}

/// Grown trees of wood as measured: modulus and strength follow the thickness and scatter, dampers hold damping ratios, unions may be weak.
pub fn measured(count: u32) -> Vec<TreeWorld> {
    measured_with(count, |_| ())
}

/// As [`measured`], with a change of the wood.
pub fn measured_with(count: u32, change: impl FnOnce(&mut WoodSpec)) -> Vec<TreeWorld> {
    let mut spec = Spec::preset(Preset::MeasuredWood);
    change(&mut spec.wood);
    let spec = Arc::new(spec);
    (0..count).map(|world| TreeWorld::grow(spec.clone(), 7, world).unwrap()).collect()
}

/// Grown trees of wood as measured with fruit on stems that bend, on their own topologies.
pub fn stemmed(count: u32) -> Vec<TreeWorld> {
    in_wind(count, 0.0)
}

/// As [`stemmed`], in a wind of a speed [m/s].
pub fn in_wind(count: u32, speed: f64) -> Vec<TreeWorld> {
    on_in_wind(count, Spec::preset(Preset::Calibrated).fruit.stem, speed)
}

/// Grown trees of wood as measured with fruit on tethers, in a wind of a speed [m/s].
pub fn on_tethers_in_wind(count: u32, speed: f64) -> Vec<TreeWorld> {
    on_in_wind(count, None, speed)
}

/// One tree on stems in a wind whose shortest wave is 0.08 mm long: were its gusts sampled where the wood is now, round-off of its place would choose their phase.
pub fn in_short_waves(speed: f64) -> Vec<TreeWorld> {
    const WORLD: u32 = 52;
    let world = TreeWorld::grow(spec_in_wind(Spec::preset(Preset::Calibrated).fruit.stem, speed), 7, WORLD);
    let world = world.unwrap();
    let waves = world.plant().weather.as_ref().unwrap().wind().waves();
    let shortest = waves.map(|wave| wave.wave.norm()).fold(0.0, f64::max);
    assert!(shortest > 5e4, "{shortest}");
    vec![world]
}

fn on_in_wind(count: u32, stem: Option<StemSpec>, speed: f64) -> Vec<TreeWorld> {
    let spec = spec_in_wind(stem, speed);
    (0..count).map(|world| TreeWorld::grow(spec.clone(), 7, world).unwrap()).collect()
}

fn spec_in_wind(stem: Option<StemSpec>, speed: f64) -> Arc<Spec> {
    let mut spec = Spec::preset(Preset::MeasuredWood);
    let wind = spec.wind.as_mut().unwrap();
    wind.speed = wind.speed.with_value(speed).unwrap();
    spec.fruit = FruitSpec { stem, ..spec.fruit };
    Arc::new(spec)
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

/// Lifts fruit 0 of a world off its stem, `height` above the ground \[m\]. Returns the index of its point body.
pub fn drop_fruit(world: &mut TreeWorld, height: f64) -> usize {
    let plant = world.plant().clone();
    let point = plant.fruit.points[0].index();
    let data = world.data_mut();
    data.tethered[point] = false;
    data.point_quadratic_drag[point] = plant.fruit.air_drag(0);
    data.groups[plant.fruit.colliders[0].index()] = plant.fruit.groups.loose;
    data.point_p_world[point].z = plant.fruit.fruit[0].radius + height;
    data.point_v_world[point] = Vec3::zeros();
    point
}

/// Gives a tree's trunk a rate [rad/s] just above the root, at the segment that is returned, so that it topples when broken there.
pub fn tip_over(world: &mut TreeWorld, rate: f64) -> usize {
    const SEGMENT: usize = 2;
    let plant = world.plant().clone();
    world.data_mut().v[plant.model.dofs(plant.tree.bodies[SEGMENT]).start] = rate;
    SEGMENT
}

/// State of a world in a batch, kinematics included.
pub fn state(stepper: &mut dyn Stepper, world: &TreeWorld, index: usize) -> Data {
    let mut data = world.data().clone();
    stepper.store(index, &mut data).unwrap();
    forward_kinematics(&world.plant().model, &mut data);
    data
}

/// Bits of a state.
pub fn bits(data: &Data) -> Vec<u64> {
    let points = data.point_p_world.iter().chain(&data.point_v_world).flat_map(|v| v.iter());
    let wood = data.q.iter().chain(&data.v).chain(&data.stiffness).chain(&data.damping);
    wood.chain(points).map(|x| x.to_bits()).collect()
}

/// Positions of the segments' tips \[m\], world.
pub fn tips(world: &TreeWorld, data: &Data) -> Vec<Vec3> {
    let plant = world.plant();
    let tip = |&id| transform(data.x_world_body(id), &(plant.model.body(id).inertia.p_com * 2.0));
    plant.tree.bodies.iter().map(tip).collect()
}

/// Largest errors of a world.
#[derive(Debug, Clone, Copy, Default)]
pub struct Errors {
    /// Of an angle of the wood's joints, over the largest one.
    pub angle: f64,
    /// Of a joint rate, stems included \[rad/s\].
    pub rate: f64,
    /// Of a segment's tip \[m\].
    pub tip: f64,
    /// Of a fruit \[m\].
    pub fruit: f64,
}

impl Errors {
    /// Errors of a state against the world's own.
    pub fn of(world: &TreeWorld, data: &Data) -> Self {
        Self::between(world, data, world.data())
    }

    /// Errors of one state of a world against another.
    pub fn between(world: &TreeWorld, data: &Data, truth: &Data) -> Self {
        let largest =
            |errors: &mut dyn Iterator<Item = f64>| errors.fold(0.0_f64, |most, x| most.max(x.abs()));
        let [data, truth] = [data, truth].map(|data| {
            let mut data = data.clone();
            forward_kinematics(&world.plant().model, &mut data);
            data
        });
        let of = |a: &[f64], b: &[f64]| largest(&mut a.iter().zip(b).map(|(a, b)| a - b));
        let plant = world.plant();
        let angles = |data: &Data| -> Vec<f64> {
            plant.tree.bodies.iter().flat_map(|&id| &data.q[plant.model.qs(id)]).copied().collect()
        };
        let apart = |a: &[Vec3], b: &[Vec3]| largest(&mut a.iter().zip(b).map(|(a, b)| (a - b).norm()));
        Self {
            angle: of(&angles(&data), &angles(&truth)) / largest(&mut angles(&truth).into_iter()),
            rate: of(&data.v, &truth.v),
            tip: apart(&tips(world, &data), &tips(world, &truth)),
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
}

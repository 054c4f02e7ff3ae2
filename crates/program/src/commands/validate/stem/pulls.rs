//! Pulls at single fruit of a grown tree, from its rest: what came off, and under which loads.

use orchard_batch::{TreeEvent, TreeWorld};
use orchard_fruit::{LooseEvent, Release};
use orchard_geometry::Vec3;
use orchard_multibody::{BodyId, equilibrium};

/// Largest move of a coordinate in the last iteration at which a tree counts as at rest \[rad or m\].
const TOLERANCE: f64 = 1e-9;

/// End of a pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// The fruit came off.
    Off(Release),
    /// The wood broke first.
    Snapped,
    /// The pull reached its limit.
    Held,
}

/// A pull and its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    pub end: End,
    /// Largest force of the pull \[N\].
    pub force: f64,
    /// Largest torque of the stem [N m].
    pub torque: f64,
}

/// Loads on a fruit at a time.
#[derive(Debug, Clone, Copy, Default)]
pub struct Grasp {
    /// Force on its centre \[N\], world.
    pub force_world: Vec3,
    /// Torque about its stem [N m].
    pub torque: f64,
}

/// A fruit of a tree at rest.
pub struct Hanging<'a> {
    tree: &'a TreeWorld,
    pub fruit: usize,
}

impl<'a> Hanging<'a> {
    pub fn new(tree: &'a TreeWorld, fruit: usize) -> Self {
        Self { tree, fruit }
    }

    fn point(&self) -> usize {
        self.tree.plant().fruit.points[self.fruit].index()
    }

    fn stem(&self) -> BodyId {
        self.tree.plant().fruit.stem(self.fruit).expect("the world was built on stems")
    }

    /// Place of the hanging centre \[m\], world.
    pub fn p_world(&self) -> Vec3 {
        self.tree.data().point_p_world[self.point()]
    }

    /// Axis of the zone at the end of its stem, and a direction across it that leads away from the trunk; world.
    pub fn axes_world(&self) -> [Vec3; 2] {
        let axis = self.tree.data().x_world_body(self.stem()).rotation * Vec3::z();
        let p = self.p_world();
        let outward = Vec3::new(p.x, p.y, 0.0);
        let across = outward - axis * axis.dot(&outward);
        [axis, across.try_normalize(f64::EPSILON).unwrap_or_else(|| axis.cross(&Vec3::y()).normalize())]
    }

    /// Loads the fruit as `grasp` says at each time \[s\], to the end of the pull or of `duration` \[s\].
    pub fn load(&self, duration: f64, grasp: impl Fn(f64) -> Grasp) -> Outcome {
        let (mut world, point, stem) = (self.tree.clone(), self.point(), self.stem());
        let plant = world.plant().clone();
        let (fruit, frame) = (&plant.fruit, plant.spec.sim.frame());
        let mut outcome = Outcome { end: End::Held, force: 0.0, torque: 0.0 };
        for k in 1..=(duration / frame) as u32 {
            let Grasp { force_world, torque } = grasp(f64::from(k) * frame);
            let data = world.data_mut();
            data.point_force_world[point] = force_world;
            data.body_torque_world[stem.index()] = data.x_world_body(stem).rotation * Vec3::z() * torque;
            outcome.force = outcome.force.max(force_world.norm());
            let events = world.step();
            let off = world.fruit_events().iter().find_map(|event| match event {
                LooseEvent::Detached { fruit, release, .. } if *fruit == self.fruit => *release,
                _ => None,
            });
            if let Some(release) = off {
                outcome.end = End::Off(release);
                return outcome;
            }
            if let Some(load) = fruit.stem_load(&plant.model, world.data(), self.fruit) {
                outcome.torque = outcome.torque.max(load.torque);
            }
            if events.iter().any(|event| matches!(event, TreeEvent::Snapped { .. })) {
                outcome.end = End::Snapped;
                return outcome;
            }
        }
        outcome
    }

    /// Stiffness against a small force \[N\] with the fruit's weight borne \[N/m\], at rest; NaN if the tree finds no rest.
    pub fn stiffness(&self, force_world: Vec3) -> f64 {
        let (plant, point) = (self.tree.plant(), self.point());
        let mut data = self.tree.data().clone();
        let lift = -plant.settings.gravity * plant.fruit.fruit[self.fruit].mass;
        // Two pulls along one line: the stem is straight in both.
        let mut at_rest = |times: f64| {
            data.point_force_world[point] = lift + force_world * times;
            let found = equilibrium(&plant.model, &mut data, &plant.settings.gravity, TOLERANCE);
            found.ok().map(|_| data.point_p_world[point])
        };
        let moved = at_rest(1.0).zip(at_rest(2.0)).map(|(once, twice)| twice - once);
        moved.map_or(f64::NAN, |moved| force_world.norm() / moved.dot(&force_world.normalize()))
    }
}

//! Forces and bounds for the tests of the kernels.

use orchard_batch::TreeWorld;
use orchard_geometry::Vec3;

use crate::GpuBatch;
use crate::trees::{Errors, kick};

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

/// True if errors against f64 are within the bounds of `validate gpu`, rates within the floor of f32.
pub(crate) fn is_small(errors: Errors) -> bool {
    errors.angle < 5e-5 && errors.rate < 1e-4 && errors.tip < 1e-5
}

//! Worlds one by one in f64 as a batch, with any linear solver: the reference of the other batches.

use crate::fault::{Fault, Quarantine, Status};
use crate::stepper::{Stepper, StepperError};
use crate::tile::BatchEvent;
use crate::tree_world::{TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_multibody::{Data, Solver};
use rayon::prelude::*;

/// Tree worlds that advance together in f64, in parallel, each by itself. A clone continues with the same bits.
#[derive(Debug, Clone)]
pub struct ReferenceBatch {
    worlds: Vec<(TreeWorld, Status)>,
    solver: Solver,
    frame: u32,
    events: Vec<BatchEvent>,
}

impl ReferenceBatch {
    /// Builds a batch of some worlds, advanced with a linear solver.
    pub fn new(worlds: impl IntoIterator<Item = TreeWorld>, solver: Solver) -> Self {
        let worlds = worlds.into_iter().map(|world| (world, Status::Running)).collect();
        Self { worlds, solver, frame: 0, events: Vec::new() }
    }

    fn step(&mut self) {
        self.frame += 1;
        let (frame, solver) = (self.frame, self.solver);
        let worlds = self.worlds.par_iter_mut().enumerate();
        self.events.par_extend(worlds.flat_map_iter(|(index, (world, status))| {
            step_world(world, status, solver, frame).into_iter().map(move |event| BatchEvent {
                frame,
                world: index,
                event,
            })
        }));
    }
}

fn step_world(world: &mut TreeWorld, status: &mut Status, solver: Solver, frame: u32) -> Vec<TreeEvent> {
    if *status != Status::Running {
        return Vec::new();
    }
    let mut events = world.step_by(solver);
    if let Some(fault) = fault(world) {
        *status = Status::Quarantined(Quarantine { frame, fault });
        events.push(TreeEvent::Quarantined { fault });
    }
    events
}

/// First part of a world that is no longer finite, if any.
fn fault(world: &TreeWorld) -> Option<Fault> {
    let (plant, data) = (world.plant(), world.data());
    if data.is_finite() {
        return None;
    }
    let is_ill = |body| plant.model.dofs(body).any(|dof| !(data.q[dof] + data.v[dof]).is_finite());
    let joint = plant.tree.bodies.iter().position(|body| is_ill(*body));
    let is_lost = |point: usize| {
        let motion = [&data.point_p_world, &data.point_v_world, &data.point_w_world];
        motion.into_iter().any(|of| of[point].iter().any(|x| !x.is_finite()))
    };
    let fruit = || plant.fruit.points.iter().position(|point| is_lost(point.index()));
    joint.map(|segment| Fault::Joint { segment }).or_else(|| fruit().map(|fruit| Fault::Fruit { fruit }))
}

impl Stepper for ReferenceBatch {
    fn len(&self) -> usize {
        self.worlds.len()
    }

    /// A world's models, states and what its solver keeps are not counted.
    fn bytes(&self) -> Option<usize> {
        None
    }

    fn advance(&mut self, frames: u32) {
        (0..frames).for_each(|_| self.step());
    }

    fn wait(&mut self) -> Result<(), StepperError> {
        Ok(())
    }

    fn events(&mut self) -> Result<Vec<BatchEvent>, StepperError> {
        let mut events = std::mem::take(&mut self.events);
        events.sort_unstable();
        Ok(events)
    }

    fn status(&mut self, world: usize) -> Result<Status, StepperError> {
        Ok(self.worlds[world].1)
    }

    fn store(&mut self, world: usize, data: &mut Data) -> Result<(), StepperError> {
        data.clone_from(self.worlds[world].0.data());
        Ok(())
    }

    fn reset(&mut self, worlds: &[usize]) {
        for &index in worlds {
            let (world, status) = &mut self.worlds[index];
            world.reset();
            *status = Status::Running;
        }
        self.events.retain(|event| !worlds.contains(&event.world));
    }

    fn push(
        &mut self,
        world: usize,
        segment: usize,
        force_world: Vec3,
        torque_world: Vec3,
    ) -> Result<(), StepperError> {
        let world = &mut self.worlds[world].0;
        let body = world.plant().tree.bodies[segment].index();
        world.data_mut().body_force_world[body] = force_world;
        world.data_mut().body_torque_world[body] = torque_world;
        Ok(())
    }

    fn pull(&mut self, world: usize, fruit: usize, force_world: Vec3) {
        let world = &mut self.worlds[world].0;
        let point = world.plant().fruit.points[fruit].index();
        world.data_mut().point_force_world[point] = force_world;
    }
}

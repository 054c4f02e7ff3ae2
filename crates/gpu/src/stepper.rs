//! Implements the common interface of batches.

use orchard_batch::{BatchEvent, Status, Stepper, StepperError};
use orchard_geometry::Vec3;
use orchard_multibody::Data;

use crate::GpuBatch;

impl Stepper for GpuBatch {
    fn len(&self) -> usize {
        GpuBatch::len(self)
    }

    fn bytes(&self) -> Option<usize> {
        Some(GpuBatch::bytes(self))
    }

    fn advance(&mut self, frames: u32) {
        GpuBatch::advance(self, frames);
    }

    fn wait(&mut self) -> Result<(), StepperError> {
        GpuBatch::wait(self).map_err(StepperError::of)
    }

    fn events(&mut self) -> Result<Vec<BatchEvent>, StepperError> {
        GpuBatch::events(self).map_err(StepperError::of)
    }

    fn status(&mut self, world: usize) -> Result<Status, StepperError> {
        GpuBatch::status(self, world).map_err(StepperError::of)
    }

    fn store(&mut self, world: usize, data: &mut Data) -> Result<(), StepperError> {
        GpuBatch::store(self, world, data).map_err(StepperError::of)
    }

    fn reset(&mut self, worlds: &[usize]) {
        GpuBatch::reset(self, worlds);
    }

    fn push(
        &mut self,
        world: usize,
        segment: usize,
        force_world: Vec3,
        torque_world: Vec3,
    ) -> Result<(), StepperError> {
        let has_room = GpuBatch::push(self, world, segment, force_world, torque_world);
        has_room.then_some(()).ok_or(StepperError::NoRoom { world })
    }

    fn pull(&mut self, world: usize, fruit: usize, force_world: Vec3) {
        GpuBatch::pull(self, world, fruit, force_world);
    }
}

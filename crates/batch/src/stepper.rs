//! [`Stepper`]: the interface of every batch, on any backend.

use crate::batch::Batch;
use crate::fault::Status;
use crate::tile::BatchEvent;
use orchard_geometry::Vec3;
use orchard_multibody::Data;

/// Error of a batch.
#[derive(Debug, thiserror::Error)]
pub enum StepperError {
    /// More links are pushed than the buffers hold.
    #[error("world {world} has no room for a force on another link")]
    NoRoom {
        /// Index of the world.
        world: usize,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(Box<dyn std::error::Error + Send + Sync>),
}

impl StepperError {
    /// Wraps a backend's own error.
    pub fn of(e: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self::Backend(Box::new(e))
    }
}

/// Worlds that advance together: in lanes ([`Batch`]), one by one in f64 ([`crate::ReferenceBatch`]) or on a graphics device
/// (`orchard_gpu::GpuBatch`). A world that is no longer finite is reported once and stands still from then on.
pub trait Stepper: Send {
    /// Number of worlds.
    fn len(&self) -> usize;

    /// True if there is no world.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory that a step works on \[bytes\]; `None` if the backend does not know it.
    fn bytes(&self) -> Option<usize>;

    /// Advances every world by whole frames. A frame begins when all worlds have ended the one before. It may return before
    /// they are done; methods that read wait.
    fn advance(&mut self, frames: u32);

    /// Waits until all frames are done.
    ///
    /// # Errors
    /// The backend failed.
    fn wait(&mut self) -> Result<(), StepperError>;

    /// Takes the events since the last call, by frame and world.
    ///
    /// # Errors
    /// The backend failed.
    fn events(&mut self) -> Result<Vec<BatchEvent>, StepperError>;

    /// State of a world.
    ///
    /// # Errors
    /// The backend failed.
    fn status(&mut self, world: usize) -> Result<Status, StepperError>;

    /// Writes a world's state into the f64 state of its model.
    ///
    /// # Errors
    /// The backend failed.
    fn store(&mut self, world: usize, data: &mut Data) -> Result<(), StepperError>;

    /// Puts some worlds back to the state that [`crate::TreeWorld::new`] gives them: unbroken, every fruit on its stem, in static
    /// equilibrium, without external forces, running. Rates, breaks and forces that they had when the batch was built do not come
    /// back; on a graphics device, fruit that were off their stems then stay off. Events of these worlds that have not been read are
    /// lost. The other worlds keep their bits. The count of frames, which events name, goes on.
    fn reset(&mut self, worlds: &[usize]);

    /// Sets the external force \[N\] at, and torque [N m] about, a segment's centre of mass until changed.
    ///
    /// # Errors
    /// The world has no room for it.
    fn push(
        &mut self,
        world: usize,
        segment: usize,
        force_world: Vec3,
        torque_world: Vec3,
    ) -> Result<(), StepperError>;

    /// Sets the external force \[N\] on a fruit until changed.
    fn pull(&mut self, world: usize, fruit: usize, force_world: Vec3);
}

impl Stepper for Batch {
    fn len(&self) -> usize {
        Batch::len(self)
    }

    fn bytes(&self) -> Option<usize> {
        Some(Batch::bytes(self))
    }

    fn advance(&mut self, frames: u32) {
        (0..frames).for_each(|_| self.run(1));
    }

    fn wait(&mut self) -> Result<(), StepperError> {
        Ok(())
    }

    fn events(&mut self) -> Result<Vec<BatchEvent>, StepperError> {
        Ok(self.drain_events())
    }

    fn status(&mut self, world: usize) -> Result<Status, StepperError> {
        Ok(Batch::status(self, world))
    }

    fn store(&mut self, world: usize, data: &mut Data) -> Result<(), StepperError> {
        Batch::store(self, world, data);
        Ok(())
    }

    fn reset(&mut self, worlds: &[usize]) {
        Batch::reset(self, worlds);
    }

    fn push(
        &mut self,
        world: usize,
        segment: usize,
        force_world: Vec3,
        torque_world: Vec3,
    ) -> Result<(), StepperError> {
        Batch::push(self, world, segment, force_world, torque_world);
        Ok(())
    }

    fn pull(&mut self, world: usize, fruit: usize, force_world: Vec3) {
        Batch::pull(self, world, fruit, force_world);
    }
}

//! Images of many worlds, drawn on a graphics device.

use orchard_geometry::DepthImage;
use orchard_gpu::{Gpu, GpuError, ImageBatch, View};
use orchard_robot::Observation;
use orchard_world::{Sight, World};
use rayon::prelude::*;

/// Draws what the wrist cameras of worlds see. A camera's errors follow on the processor, with the bits that they have there for the same exact image.
#[derive(Debug)]
pub struct Eyes {
    images: ImageBatch,
}

impl Eyes {
    /// Opens eyes on a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self { images: ImageBatch::new(gpu) }
    }

    /// Returns the observation of each world ([`World::observe`]), with the images that cameras deliver now.
    ///
    /// # Errors
    /// The device has no room, or was lost.
    pub fn observe(&mut self, worlds: &mut [&mut World]) -> Result<Vec<Observation>, GpuError> {
        let sights: Vec<Option<Sight>> = worlds.par_iter().map(|world| world.delivers()).collect();
        let seen = self.draw(&sights)?;
        let observe = |((world, sight), seen): ((&mut &mut World, Option<Sight>), Option<DepthImage>)| match (sight, seen) {
            (Some(sight), Some(seen)) => world.observe_drawn(sight, &seen),
            // No image is due.
            _ => world.observe(),
        };
        Ok(worlds.par_iter_mut().zip(sights).zip(seen).map(observe).collect())
    }

    /// Draws the latest images of worlds again: after a restore they were drawn on the processor.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn look_again(&mut self, worlds: &mut [&mut World]) -> Result<(), GpuError> {
        let latest = |world: &&mut World| world.camera_truth().map(|truth| truth.sight.clone());
        let sights: Vec<Option<Sight>> = worlds.par_iter().map(latest).collect();
        let seen = self.draw(&sights)?;
        worlds.par_iter_mut().zip(sights).zip(seen).for_each(|((world, sight), seen)| {
            if let (Some(sight), Some(seen)) = (sight, seen) {
                world.replace_image(sight, &seen);
            }
        });
        Ok(())
    }

    /// Draws the exposures of the sights that there are.
    fn draw(&mut self, sights: &[Option<Sight>]) -> Result<Vec<Option<DepthImage>>, GpuError> {
        let views: Vec<View<'_>> = sights
            .iter()
            .flatten()
            .map(|sight| View { scene: &sight.scene, exposure: sight.exposure() })
            .collect();
        let mut drawn = self.images.depths(&views)?.into_iter();
        Ok(sights.iter().map(|sight| sight.as_ref().and_then(|_| drawn.next())).collect())
    }
}

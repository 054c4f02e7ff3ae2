//! Images of many worlds, drawn on a graphics device.

use orchard_geometry::DepthImage;
use orchard_gpu::{Gpu, GpuError, ImageBatch, Subject, View};
use orchard_robot::Observation;
use orchard_world::{Sight, World};
use rayon::prelude::*;

/// A world with its place, its sight, and what was drawn of it.
type Drawn<'a, 'b> = ((&'a mut (usize, &'b mut World), Option<Sight>), Option<DepthImage>);

/// Draws the depth images of the wrist cameras of many worlds. The device draws exact depth; the errors of a camera are added on the processor, by the code and with the bits of [`World::observe`].
#[derive(Debug)]
pub struct Eyes {
    images: ImageBatch,
}

impl Eyes {
    /// Opens eyes on a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self { images: ImageBatch::new(gpu) }
    }

    /// Returns the observation of each world ([`World::observe`]), with the images that cameras deliver now. A world is given with the place at which the device keeps what can be seen of it.
    ///
    /// # Errors
    /// The device has no room, or was lost.
    pub fn observe(&mut self, worlds: &mut [(usize, &mut World)]) -> Result<Vec<Observation>, GpuError> {
        let sights: Vec<Option<Sight>> = worlds.par_iter().map(|(_, world)| world.delivers()).collect();
        let seen = self.draw(worlds, &sights)?;
        let observe = |(((_, world), sight), seen): Drawn<'_, '_>| match (sight, seen) {
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
    pub fn look_again(&mut self, worlds: &mut [(usize, &mut World)]) -> Result<(), GpuError> {
        let latest = |(_, world): &(usize, &mut World)| world.camera_truth().map(|truth| truth.sight.clone());
        let sights: Vec<Option<Sight>> = worlds.par_iter().map(latest).collect();
        let seen = self.draw(worlds, &sights)?;
        worlds.par_iter_mut().zip(sights).zip(seen).for_each(|(((_, world), sight), seen): Drawn<'_, '_>| {
            if let (Some(sight), Some(seen)) = (sight, seen) {
                world.replace_image(sight, &seen);
            }
        });
        Ok(())
    }

    /// Draws the exposures of the sights that there are.
    fn draw(
        &mut self,
        worlds: &[(usize, &mut World)],
        sights: &[Option<Sight>],
    ) -> Result<Vec<Option<DepthImage>>, GpuError> {
        let there =
            || worlds.iter().zip(sights).filter_map(|((place, _), sight)| Some((*place, sight.as_ref()?)));
        for (place, sight) in there() {
            self.images.keep(place, &sight.visible);
        }
        let views = there().map(|(place, sight)| View {
            subject: Subject::Kept { place, x_world_body: &sight.x_world_body },
            exposure: sight.exposure(),
        });
        let mut drawn = self.images.depths(&views.collect::<Vec<_>>())?.into_iter();
        Ok(sights.iter().map(|sight| sight.as_ref().and_then(|_| drawn.next())).collect())
    }
}

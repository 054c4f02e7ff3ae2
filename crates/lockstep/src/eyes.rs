//! Images of many worlds, drawn on a graphics device.

use std::sync::Arc;

use orchard_geometry::DepthImage;
use orchard_gpu::{DeviceArray, Gpu, GpuError, ImageBatch, Look, Subject, View};
use orchard_robot::Observation;
use orchard_world::{Sight, World};
use rayon::prelude::*;

/// An image that the device made.
#[derive(Debug)]
enum Made {
    /// Exact depths; the errors of its camera are to be added here.
    Exact(DepthImage),
    /// Depths with the errors of its camera.
    Measured(DepthImage),
}

/// A world with its place, its sight, and what was drawn of it.
type Drawn<'a, 'b> = ((&'a mut (usize, &'b mut World), Option<Sight>), Option<Made>);

/// Draws the depth images of the wrist cameras of many worlds. The device adds the errors of the cameras for which it has kernels ([`ImageBatch::can_measure`]), from its exact depths and with the processor's bits; those of
/// other cameras are added on the processor, by the code of [`World::observe`].
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
            (Some(sight), Some(Made::Exact(seen))) => world.observe_drawn(sight, &seen),
            (Some(sight), Some(Made::Measured(measured))) => world.observe_measured(sight, measured),
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
            match (sight, seen) {
                (Some(sight), Some(Made::Exact(seen))) => world.replace_image(sight, &seen),
                (Some(sight), Some(Made::Measured(measured))) => world.replace_measured(sight, measured),
                _ => {}
            }
        });
        Ok(())
    }

    /// As [`Self::observe`], into rows of an array on the device, which has one for each place. The pixels of a camera without errors are drawn there, and here only if someone asks for them; the image of another camera is read back, and sent.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_into(
        &mut self,
        worlds: &mut [(usize, &mut World)],
        array: &DeviceArray,
    ) -> Result<(), GpuError> {
        let sights: Vec<Option<Sight>> = worlds.par_iter().map(|(_, world)| world.delivers()).collect();
        if self.draw_into(worlds, &sights, array)? {
            let deliver = |((_, world), sight): (&mut (usize, &mut World), Option<Sight>)| {
                if let Some(sight) = sight {
                    world.deliver_undrawn(sight);
                }
            };
            worlds.par_iter_mut().zip(sights).for_each(deliver);
            return Ok(());
        }
        let is_due: Vec<bool> = sights.iter().map(Option::is_some).collect();
        self.observe(worlds)?;
        send(worlds.iter().zip(is_due).filter(|(_, is_due)| *is_due).map(|(world, _)| world), array);
        Ok(())
    }

    /// As [`Self::look_again`], into rows of an array on the device. A world without an image has zeros there.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn look_again_into(
        &mut self,
        worlds: &mut [(usize, &mut World)],
        array: &DeviceArray,
    ) -> Result<(), GpuError> {
        let latest = |(_, world): &(usize, &mut World)| world.camera_truth().map(|truth| truth.sight.clone());
        let sights: Vec<Option<Sight>> = worlds.par_iter().map(latest).collect();
        for ((place, _), _) in worlds.iter().zip(&sights).filter(|(_, sight)| sight.is_none()) {
            array.clear_row(*place);
        }
        if self.draw_into(worlds, &sights, array)? {
            let replace = |((_, world), sight): (&mut (usize, &mut World), Option<Sight>)| {
                if let Some(sight) = sight {
                    world.replace_undrawn(sight);
                }
            };
            worlds.par_iter_mut().zip(sights).for_each(replace);
            return Ok(());
        }
        self.look_again(worlds)?;
        send(worlds.iter(), array);
        Ok(())
    }

    /// Draws the exposures of sights into the rows of their places; returns false, and draws nothing, if cameras have errors.
    fn draw_into(
        &mut self,
        worlds: &[(usize, &mut World)],
        sights: &[Option<Sight>],
        array: &DeviceArray,
    ) -> Result<bool, GpuError> {
        if !sights.iter().flatten().all(Sight::is_exact) {
            return Ok(false);
        }
        let seen = there(worlds, sights);
        let rows: Vec<usize> = seen.iter().map(|(place, _)| *place).collect();
        let views = self.views(&seen);
        self.images.depths_into(&views, array, &rows)?;
        Ok(true)
    }

    /// Draws the exposures of the sights that there are, and measures those of cameras that the device can measure for.
    fn draw(
        &mut self,
        worlds: &[(usize, &mut World)],
        sights: &[Option<Sight>],
    ) -> Result<Vec<Option<Made>>, GpuError> {
        let there = worlds.iter().zip(sights).enumerate();
        let there = there.filter_map(|(i, ((place, _), sight))| Some((i, *place, sight.as_ref()?)));
        let mut left: Vec<(usize, usize, &Sight)> = there.collect();
        for (_, place, sight) in &left {
            self.images.keep(*place, &sight.visible);
        }
        let mut made: Vec<Option<Made>> = sights.iter().map(|_| None).collect();
        // All worlds of an environment have one camera, as a rule.
        while let Some((_, _, first)) = left.first() {
            let sensor = first.sensor.clone();
            let is_alike = |sight: &Sight| Arc::ptr_eq(&sight.sensor, &sensor) || sight.sensor == sensor;
            let (now, later): (Vec<_>, Vec<_>) = left.into_iter().partition(|(_, _, sight)| is_alike(sight));
            left = later;
            fn subject(place: usize, sight: &Sight) -> Subject<'_> {
                Subject::Kept { place, x_world_body: &sight.x_world_body }
            }
            let drawn: Vec<Made> = if ImageBatch::can_measure(&sensor) {
                let looks = now.iter().map(|(_, place, sight)| Look {
                    subject: subject(*place, sight),
                    x_world_camera: sight.x_world_camera,
                    key: sight.key,
                });
                let measured = self.images.measured(&sensor, &looks.collect::<Vec<_>>())?;
                measured.into_iter().map(Made::Measured).collect()
            } else {
                let views = now.iter().map(|(_, place, sight)| View {
                    subject: subject(*place, sight),
                    exposure: sight.exposure(),
                });
                self.images.depths(&views.collect::<Vec<_>>())?.into_iter().map(Made::Exact).collect()
            };
            for ((i, _, _), image) in now.into_iter().zip(drawn) {
                made[i] = Some(image);
            }
        }
        Ok(made)
    }

    /// The views of sights, whose scenes the device keeps at their places.
    fn views<'a>(&mut self, seen: &[(usize, &'a Sight)]) -> Vec<View<'a>> {
        for (place, sight) in seen {
            self.images.keep(*place, &sight.visible);
        }
        let view = |(place, sight): &(usize, &'a Sight)| View {
            subject: Subject::Kept { place: *place, x_world_body: &sight.x_world_body },
            exposure: sight.exposure(),
        };
        seen.iter().map(view).collect()
    }
}

/// The sights that there are, with the places of their worlds.
fn there<'a>(worlds: &[(usize, &mut World)], sights: &'a [Option<Sight>]) -> Vec<(usize, &'a Sight)> {
    let all = worlds.iter().zip(sights);
    all.filter_map(|((place, _), sight)| Some((*place, sight.as_ref()?))).collect()
}

/// Sends the latest images of worlds to the rows of their places.
fn send<'a, 'b: 'a>(worlds: impl Iterator<Item = &'a (usize, &'b mut World)>, array: &DeviceArray) {
    for (place, world) in worlds {
        if let Some(truth) = world.camera_truth() {
            array.write_row(*place, truth.measured().pixels());
        }
    }
}

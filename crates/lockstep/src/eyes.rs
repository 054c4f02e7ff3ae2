//! Images of many worlds, drawn on a graphics device.

use std::sync::Arc;

use orchard_geometry::{DepthImage, Image};
use orchard_gpu::{DeviceArray, Gpu, GpuError, ImageBatch, Look, PictureBatch, Subject, View};
use orchard_robot::Observation;
use orchard_world::{CameraTruth, PictureSight, Sight, Status, World};
use rayon::prelude::*;

/// Draws the depth images of the wrist cameras of many worlds, and colour pictures of them. The device adds the errors of the cameras for which it has kernels ([`ImageBatch::can_measure`]), from its exact depths and with the processor's bits; those of
/// other cameras are added on the processor, by the code of [`World::observe`].
#[derive(Debug)]
pub struct Eyes {
    images: ImageBatch,
    /// Those in colour.
    pub(crate) pictures: PictureBatch,
}

impl Eyes {
    /// Opens eyes on a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self { images: ImageBatch::new(gpu), pictures: PictureBatch::new(gpu) }
    }

    /// Returns the observation of each world ([`World::observe`]), with the images that cameras deliver now. A world is given with the place at which the device keeps what can be seen of it.
    ///
    /// # Errors
    /// The device has no room, or was lost.
    pub fn observe(&mut self, worlds: &mut [(usize, &mut World)]) -> Result<Vec<Observation>, GpuError> {
        let sights = worlds.par_iter().map(|(_, world)| world.delivers()).collect();
        let drawn = self.draw(worlds, sights)?;
        Ok(worlds.par_iter_mut().zip(drawn).map(|((_, world), drawn)| world.observe_image(drawn)).collect())
    }

    /// Draws the images that cameras of worlds that move deliver now, so that each of them has one when it is observed ([`World::prepare_image`]).
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn prepare(&mut self, worlds: &mut [(usize, &mut World)]) -> Result<(), GpuError> {
        let moves = |world: &World| *world.status() == Status::Running;
        let sight = |(_, world): &(usize, &mut World)| world.delivers().filter(|_| moves(world));
        let sights = worlds.par_iter().map(sight).collect();
        let drawn = self.draw(worlds, sights)?;
        for ((_, world), drawn) in worlds.iter_mut().zip(drawn) {
            if let Some(drawn) = drawn {
                world.prepare_image(drawn);
            }
        }
        Ok(())
    }

    /// Draws the latest images of worlds again: after a restore they were drawn on the processor.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn look_again(&mut self, worlds: &mut [(usize, &mut World)]) -> Result<(), GpuError> {
        let latest = |(_, world): &(usize, &mut World)| world.camera_truth().map(|truth| truth.sight.clone());
        let sights = worlds.par_iter().map(latest).collect();
        let drawn = self.draw(worlds, sights)?;
        for ((_, world), drawn) in worlds.iter_mut().zip(drawn) {
            if let Some(drawn) = drawn {
                world.replace_image(drawn);
            }
        }
        Ok(())
    }

    /// As [`Self::observe`], into rows of an array on the device, which has one for each place. The pixels are drawn and measured there ([`ImageBatch::can_measure`]), and here only if someone asks for them; the image of a camera for which there are no kernels is measured here, and sent.
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
                    world.replace_image(sight.undrawn());
                }
            };
            worlds.par_iter_mut().zip(sights).for_each(replace);
            return Ok(());
        }
        self.look_again(worlds)?;
        send(worlds.iter(), array);
        Ok(())
    }

    /// Draws and measures sights into the rows of their places; returns false, and draws nothing, if they are of several cameras, or of one that the device cannot measure for.
    fn draw_into(
        &mut self,
        worlds: &[(usize, &mut World)],
        sights: &[Option<Sight>],
        array: &DeviceArray,
    ) -> Result<bool, GpuError> {
        let seen = there(worlds, sights);
        let Some(&(_, first)) = seen.first() else { return Ok(true) };
        if !(ImageBatch::can_measure(&first.sensor) && seen.iter().all(|(_, sight)| are_alike(sight, first)))
        {
            return Ok(false);
        }
        self.keep(&seen);
        let rows: Vec<usize> = seen.iter().map(|(place, _)| *place).collect();
        let looks: Vec<Look<'_>> = seen.iter().map(look).collect();
        self.images.measured_into(&first.sensor, &looks, array, &rows)?;
        Ok(true)
    }

    /// Keeps the scenes of sights at their places on the device.
    fn keep(&mut self, seen: &[(usize, &Sight)]) {
        for (place, sight) in seen {
            self.images.keep(*place, &sight.visible);
        }
    }

    /// Draws the images of the sights that there are, with their colour where cameras take colour. Those of cameras that the device cannot measure for are measured here.
    fn draw(
        &mut self,
        worlds: &[(usize, &mut World)],
        sights: Vec<Option<Sight>>,
    ) -> Result<Vec<Option<CameraTruth>>, GpuError> {
        let colours = self.draw_colours(worlds, &sights)?;
        let measured = self.measure(worlds, &sights)?;
        let each = sights.into_par_iter().zip(measured).zip(colours);
        let taken = each.map(|((sight, measured), colour)| {
            let (sight, (is_measured, depth)) = sight.zip(measured)?;
            let mut truth = if is_measured { sight.measured(depth) } else { sight.taken_from(&depth) };
            truth.colour = colour.map(Arc::new);
            Some(truth)
        });
        Ok(taken.collect())
    }

    /// Colour images of the sights whose cameras take colour.
    fn draw_colours(
        &mut self,
        worlds: &[(usize, &mut World)],
        sights: &[Option<Sight>],
    ) -> Result<Vec<Option<Image<[u8; 3]>>>, GpuError> {
        let each = worlds.par_iter().zip(sights);
        let lit = each.map(|((_, world), sight)| world.colour_sight(sight.as_ref()?));
        let lit: Vec<Option<PictureSight>> = lit.collect();
        let each = worlds.iter().zip(&lit);
        let there: Vec<(usize, &PictureSight)> =
            each.filter_map(|((place, _), lit)| Some((*place, lit.as_ref()?))).collect();
        let mut drawn = self.draw_pictures(&there)?.into_iter().flatten();
        Ok(lit.iter().map(|lit| lit.as_ref().and_then(|_| drawn.next())).collect())
    }

    /// Depths of the sights that there are, and true if the device has measured them.
    fn measure(
        &mut self,
        worlds: &[(usize, &mut World)],
        sights: &[Option<Sight>],
    ) -> Result<Vec<Option<(bool, DepthImage)>>, GpuError> {
        let seen = there(worlds, sights);
        self.keep(&seen);
        let is_there = sights.iter().enumerate().filter(|(_, sight)| sight.is_some());
        let mut left: Vec<(usize, (usize, &Sight))> = is_there.map(|(i, _)| i).zip(seen).collect();
        let mut made: Vec<Option<(bool, DepthImage)>> = sights.iter().map(|_| None).collect();
        // All worlds of an environment have one camera, as a rule.
        while let Some(&(_, (_, first))) = left.first() {
            let (now, later): (Vec<_>, Vec<_>) =
                left.into_iter().partition(|(_, (_, sight))| are_alike(sight, first));
            left = later;
            let looks = now.iter().map(|(_, seen)| look(seen));
            let can_measure = ImageBatch::can_measure(&first.sensor);
            let drawn = if can_measure {
                self.images.measured(&first.sensor, &looks.collect::<Vec<_>>())?
            } else {
                let views = now.iter().zip(looks).map(|((_, (_, sight)), Look { subject, .. })| View {
                    subject,
                    exposure: sight.exposure(),
                });
                self.images.depths(&views.collect::<Vec<_>>())?
            };
            for ((i, _), image) in now.into_iter().zip(drawn) {
                made[i] = Some((can_measure, image));
            }
        }
        Ok(made)
    }
}

/// True if sights are of one camera.
fn are_alike(a: &Sight, b: &Sight) -> bool {
    Arc::ptr_eq(&a.sensor, &b.sensor) || a.sensor == b.sensor
}

/// The look of a sight of which the scene is kept at a place.
fn look<'a>((place, sight): &(usize, &'a Sight)) -> Look<'a> {
    Look {
        subject: Subject::Kept { place: *place, x_world_body: &sight.x_world_body },
        x_world_camera: sight.x_world_camera,
        key: sight.key,
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

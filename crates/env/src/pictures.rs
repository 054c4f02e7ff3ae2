//! Pictures of environments whose worlds move on a graphics device, which draws them.

use orchard_robot::Pictures;
#[cfg(feature = "gpu")]
use orchard_world::World;
use rayon::prelude::*;

use crate::error::EnvError;
use crate::mover::Mover;
#[cfg(feature = "gpu")]
use crate::mover::{Device, device};
use crate::slot::{Shared, Slot};

impl Mover {
    /// Takes pictures of some slots, which are given with their lane and have a world, if they are observed. Those that stay on the device have no pixels here. If it has no room for them, the processor draws them from then on.
    ///
    /// # Errors
    /// The device was lost.
    #[cfg_attr(not(feature = "gpu"), expect(clippy::unnecessary_wraps))]
    pub fn take_pictures(
        &mut self,
        mut slots: Vec<(usize, &mut Slot)>,
        shared: &Shared,
    ) -> Result<(), EnvError> {
        match self {
            Self::Cpu => slots.par_iter_mut().for_each(|(_, slot)| slot.take_pictures_here(shared)),
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { eyes, observed, draws_pictures, .. }) => {
                let Some(request) = shared.encoding.pictures().filter(|_| !slots.is_empty()) else {
                    return Ok(());
                };
                if !*draws_pictures {
                    slots.par_iter_mut().for_each(|(_, slot)| slot.take_pictures_here(shared));
                    self.send_pictures(&mut slots);
                    return Ok(());
                }
                let worlds = slots.iter().filter_map(|(lane, slot)| Some((*lane, slot.truth()?)));
                let worlds: Vec<(usize, &World)> = worlds.collect();
                let taken = match observed.as_ref().and_then(|observed| observed.pictures()) {
                    Some(arrays) => eyes.pictures_into(&worlds, request, arrays),
                    None => eyes.pictures(&worlds, request),
                };
                let taken = match taken {
                    Err(
                        orchard_gpu::GpuError::TooLarge { .. } | orchard_gpu::GpuError::OutOfMemory { .. },
                    ) => {
                        *draws_pictures = false;
                        return self.take_pictures(slots, shared);
                    }
                    taken => taken.map_err(|e| device(&e))?,
                };
                slots.iter_mut().zip(taken).for_each(|((_, slot), pictures)| slot.set_pictures(pictures));
            }
        }
        Ok(())
    }

    /// Sends the pictures of some slots that were drawn here to where pictures stay, if they do.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables))]
    fn send_pictures(&self, slots: &mut [(usize, &mut Slot)]) {
        match self {
            Self::Cpu => {}
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { observed, .. }) => {
                let Some(arrays) = observed.as_ref().and_then(|observed| observed.pictures()) else { return };
                for (lane, slot) in slots {
                    let here = slot.pictures().filter(|pictures| !pictures.wrist.is_empty());
                    let Some(Pictures { time, wrist, base }) = here else { continue };
                    arrays[0].write_row(*lane, wrist);
                    arrays[1].write_row(*lane, base);
                    slot.set_pictures(Pictures { time: *time, wrist: Vec::new(), base: Vec::new() });
                }
            }
        }
    }

    /// Draws the missing first pictures of slots that have begun an episode on a device, and moves those that were drawn here into the device's arrays, if pictures stay there.
    ///
    /// # Errors
    /// As [`Self::take_pictures`].
    pub fn settle_pictures(
        &mut self,
        mut slots: Vec<(usize, &mut Slot)>,
        shared: &Shared,
    ) -> Result<(), EnvError> {
        if self.is_cpu() || shared.encoding.pictures().is_none() {
            return Ok(());
        }
        let is_fresh = |slot: &Slot| slot.truth().is_some() && slot.pictures().is_none();
        let fresh = slots.iter_mut().filter(|(_, slot)| is_fresh(slot));
        self.take_pictures(fresh.map(|(lane, slot)| (*lane, &mut **slot)).collect(), shared)?;
        self.send_pictures(&mut slots);
        slots.par_iter_mut().for_each(|(_, slot)| slot.look(shared));
        Ok(())
    }

    /// The pictures of all slots, read from where they stay; none if they are here.
    ///
    /// # Errors
    /// The device was lost.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, clippy::unnecessary_wraps))]
    pub fn read_pictures(&self, slots: &[Slot]) -> Result<Vec<Option<Pictures>>, EnvError> {
        match self {
            Self::Cpu => Ok(Vec::new()),
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { observed, .. }) => {
                let Some([wrist, base]) = observed.as_ref().and_then(|observed| observed.pictures()) else {
                    return Ok(Vec::new());
                };
                let read = |array: &orchard_gpu::DeviceArray| array.read().map_err(|e| device(&e));
                let (wrist, base) = (read(wrist)?, read(base)?);
                let row = |all: &[u8], k: usize| {
                    let each = all.len() / slots.len();
                    all[k * each..(k + 1) * each].to_vec()
                };
                let of = |(k, slot): (usize, &Slot)| {
                    let time = slot.pictures()?.time;
                    Some(Pictures { time, wrist: row(&wrist, k), base: row(&base, k) })
                };
                Ok(slots.iter().enumerate().map(of).collect())
            }
        }
    }
}

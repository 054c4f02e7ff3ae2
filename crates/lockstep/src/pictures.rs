//! Colour pictures of many worlds, drawn on a graphics device.

use orchard_geometry::Image;
use orchard_gpu::{DeviceArray, GpuError, Lit};
use orchard_robot::{PictureRequest, Pictures};
use orchard_world::{PictureSight, World};
use rayon::prelude::*;

use crate::eyes::Eyes;

/// Worlds whose scenes are made at once, our own choice: they have 0.2 MB each.
const AT_ONCE: usize = 512;

impl Eyes {
    /// Takes pictures of the present state of each world ([`World::take_pictures`]).
    ///
    /// # Errors
    /// The device has no room, or was lost.
    pub fn pictures(
        &mut self,
        worlds: &[(usize, &World)],
        request: &PictureRequest,
    ) -> Result<Vec<Pictures>, GpuError> {
        let mut taken = Vec::with_capacity(worlds.len());
        for worlds in worlds.chunks(AT_ONCE) {
            let sights = sights(worlds, request);
            let drawn = self.pictures.pictures(&lit(sights.iter()))?;
            let bytes = |image: &Image<[u8; 3]>| image.pixels().as_flattened().to_vec();
            let each = worlds.iter().zip(drawn);
            taken.extend(
                each.map(|((_, world), drawn)| world.pictures_of(bytes(&drawn[0]), bytes(&drawn[1]))),
            );
        }
        Ok(taken)
    }

    /// As [`Self::pictures`], into rows of two arrays on the device, of the camera on the hand and of that on the base, which have one for each place. The pictures that are returned have no pixels.
    ///
    /// # Errors
    /// As [`Self::pictures`].
    pub fn pictures_into(
        &mut self,
        worlds: &[(usize, &World)],
        request: &PictureRequest,
        arrays: [&DeviceArray; 2],
    ) -> Result<Vec<Pictures>, GpuError> {
        for worlds in worlds.chunks(AT_ONCE) {
            let rows: Vec<usize> = worlds.iter().map(|(place, _)| *place).collect();
            self.pictures.pictures_into(&lit(sights(worlds, request).iter()), &arrays, &rows)?;
        }
        Ok(worlds.iter().map(|(_, world)| world.pictures_of(Vec::new(), Vec::new())).collect())
    }

    /// Draws pictures of some sights.
    pub(crate) fn draw_pictures(
        &mut self,
        sights: &[&PictureSight],
    ) -> Result<Vec<Vec<Image<[u8; 3]>>>, GpuError> {
        self.pictures.pictures(&lit(sights.iter().copied()))
    }
}

fn sights(worlds: &[(usize, &World)], request: &PictureRequest) -> Vec<PictureSight> {
    worlds.par_iter().map(|(_, world)| world.picture_sight(request)).collect()
}

fn lit<'a>(sights: impl Iterator<Item = &'a PictureSight>) -> Vec<Lit<'a>> {
    sights.map(|PictureSight { scene, style, cameras }| Lit { scene, style: *style, cameras }).collect()
}

//! Colour pictures of many worlds, drawn on a graphics device.

use orchard_geometry::Image;
use orchard_gpu::{DeviceArray, GpuError, Lit};
use orchard_robot::{PictureRequest, Pictures};
use orchard_world::{PictureSight, World};
use rayon::prelude::*;

use crate::eyes::Eyes;

/// Worlds whose pictures are sent at once, our own choice: enough to keep a card busy while the next ones are packed.
const AT_ONCE: usize = 512;

impl Eyes {
    /// Takes pictures of the present state of each world ([`World::take_pictures`]). A world is given with the place at which the device keeps what can be seen of it.
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
            let seen: Vec<(usize, &PictureSight)> = places(worlds).zip(&sights).collect();
            let drawn = self.draw_pictures(&seen)?;
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
            let rows: Vec<usize> = places(worlds).collect();
            let sights = sights(worlds, request);
            let seen: Vec<(usize, &PictureSight)> = places(worlds).zip(&sights).collect();
            self.keep_pictured(&seen);
            self.pictures.pictures_into(&lit(&seen), &arrays, &rows)?;
        }
        Ok(worlds.iter().map(|(_, world)| world.pictures_of(Vec::new(), Vec::new())).collect())
    }

    /// Draws pictures of some sights, whose scenes the device keeps at their places.
    pub(crate) fn draw_pictures(
        &mut self,
        seen: &[(usize, &PictureSight)],
    ) -> Result<Vec<Vec<Image<[u8; 3]>>>, GpuError> {
        self.keep_pictured(seen);
        self.pictures.pictures(&lit(seen))
    }

    fn keep_pictured(&mut self, seen: &[(usize, &PictureSight)]) {
        for (place, sight) in seen {
            self.pictures.keep(*place, &sight.visible);
        }
    }
}

fn places<'a>(worlds: &'a [(usize, &World)]) -> impl Iterator<Item = usize> + 'a {
    worlds.iter().map(|(place, _)| *place)
}

fn sights(worlds: &[(usize, &World)], request: &PictureRequest) -> Vec<PictureSight> {
    worlds.par_iter().map(|(_, world)| world.picture_sight(request)).collect()
}

fn lit<'a>(seen: &[(usize, &'a PictureSight)]) -> Vec<Lit<'a>> {
    let lit = |(place, sight): &(usize, &'a PictureSight)| {
        let PictureSight { x_world_body, loose, style, cameras, .. } = *sight;
        Lit { kept: Some((*place, x_world_body)), loose, style: *style, cameras }
    };
    seen.iter().map(lit).collect()
}

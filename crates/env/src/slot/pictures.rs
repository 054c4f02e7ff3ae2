//! The latest pictures of an environment.

use orchard_robot::Pictures;

use super::{Shared, Slot};

impl Slot {
    /// The latest pictures; none before the first ones.
    pub fn pictures(&self) -> Option<&Pictures> {
        self.running.as_ref()?.1.pictures.as_ref()
    }

    /// Takes pictures that show the present state, drawn elsewhere.
    #[cfg(feature = "gpu")]
    pub fn set_pictures(&mut self, pictures: Pictures) {
        if let Some((_, episode)) = &mut self.running {
            episode.pictures = Some(pictures);
        }
    }

    /// Draws them on the processor.
    pub fn take_pictures_here(&mut self, shared: &Shared) {
        if let (Some((world, episode)), Some(request)) = (&mut self.running, shared.encoding.pictures()) {
            episode.pictures = Some(world.take_pictures(request));
        }
    }
}

//! Memory of wood: what images showed as wood stays known after those images are gone.
//!
//! The camera sees a limb from some places only: leaves hide it from others, and near the fruit it is beside the image. A limb that is forgotten is met by the
//! hand on its next swing. Wood is kept in cubes fixed in odom. Leaves that look like wood from one place seldom do from several, so that a cube counts once
//! several images have shown wood in it.

use crate::cloud::SeenPoint;
use crate::config::CloudConfig;
use orchard_geometry::Vec3;
use std::collections::BTreeMap;

/// Wood of all images so far, in cubes.
#[derive(Debug, Clone, Default)]
pub(crate) struct WoodMemory {
    cubes: BTreeMap<[i64; 3], Cube>,
}

/// Wood in one cube.
#[derive(Debug, Clone)]
struct Cube {
    /// Point seen last, odom \[m\].
    p: Vec3,
    /// Number of the image that showed it, and the number of images that showed wood here.
    last: u32,
    images: u32,
}

impl WoodMemory {
    /// Takes note of the wood among an image's points, odom; `image` is the image's number.
    pub fn see(&mut self, points: &[SeenPoint], image: u32, c: &CloudConfig) {
        let grid = c.wood_grid.si();
        if grid <= 0.0 {
            return;
        }
        for SeenPoint { p, .. } in points.iter().filter(|point| point.is_wood) {
            let cube = [p.x, p.y, p.z].map(|x| (x / grid).floor() as i64);
            let entry = self.cubes.entry(cube).or_insert(Cube { p: *p, last: image, images: 0 });
            let is_new = entry.images == 0 || entry.last != image;
            *entry = Cube { p: *p, last: image, images: entry.images.saturating_add(u32::from(is_new)) };
        }
    }

    /// Returns the wood that enough images have shown, the last of them no later than `image`, in the order of the cubes.
    pub fn until(&self, image: u32, c: &CloudConfig) -> impl Iterator<Item = SeenPoint> {
        let least = c.wood_images.get();
        let counts = move |cube: &&Cube| cube.last <= image && cube.images >= least;
        self.cubes.values().filter(counts).map(|cube| SeenPoint { p: cube.p, is_wood: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PickerConfig;
    use crate::expert::ExpertConfig;

    fn seen(x: f64, is_wood: bool) -> SeenPoint {
        SeenPoint { p: Vec3::new(x, 0.0, 1.0), is_wood }
    }

    /// Wood that several images have shown stays known after them; what one image showed, or leaves, does not. Wood of later images is left to their clouds.
    #[test]
    fn wood_that_several_images_showed_stays_known() {
        let c = ExpertConfig::preset().shared.cloud;
        let least = c.wood_images.get();
        assert!(least > 1);
        let mut memory = WoodMemory::default();
        for image in 1..=least {
            memory.see(&[seen(0.101, true), seen(0.102, true), seen(0.5, false)], image, &c);
        }
        memory.see(&[seen(0.9, true), seen(0.901, true)], least, &c);
        let known = |image| memory.until(image, &c).map(|point| point.p.x).collect::<Vec<_>>();
        assert!(known(least - 1).is_empty(), "the image is still kept");
        assert_eq!(known(least), vec![0.102]);
        assert_eq!(known(least + 100), vec![0.102]);
    }

    #[test]
    fn the_baseline_remembers_none() {
        let c = PickerConfig::baseline().cloud;
        let mut memory = WoodMemory::default();
        for image in 1..10 {
            memory.see(&[seen(0.1, true)], image, &c);
        }
        assert_eq!(memory.until(10, &c).count(), 0);
    }
}

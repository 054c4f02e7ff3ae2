//! Sorting of instances before they are drawn: those outside the view are left out, and small ones take coarser meshes.

use orchard_geometry::Vec3;
use orchard_play::{Coarse, INSTANCE_FLOATS};

use crate::orbit::{NEAR, Orbit};

/// A view onto a picture, as numbers of the device.
pub struct Sight {
    eye: [f32; 3],
    forward: [f32; 3],
    /// Unit vectors to the right and up, each with the slope of the picture's edge against the view, and the length of the edge plane's normal.
    sides: [([f32; 3], f32, f32); 2],
    /// Pixels of a metre at a distance of a metre.
    pixels: f32,
    /// Way of a shadow for each metre of height \[m\], and its length over that of what casts it.
    slant: [f32; 2],
    stretch: f32,
}

/// Instances of the meshes that have coarser forms, by what is drawn of them.
#[derive(Debug, Default)]
pub struct Sorted {
    /// Those that are large on the screen.
    pub fine: Vec<Vec<f32>>,
    /// Those that are small.
    pub coarse: Vec<Vec<f32>>,
    /// Those whose shadow on level ground is in the picture.
    pub shadows: Vec<Vec<f32>>,
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Sight {
    /// A view onto a picture of a size \[px\], with the unit vector to the sun.
    pub fn new(orbit: &Orbit, size: [u32; 2], sun: &Vec3) -> Self {
        let of = |v: Vec3| [v.x as f32, v.y as f32, v.z as f32];
        let (axes, [width, height]) = (orbit.axes(), size.map(f64::from));
        let up = Orbit::spread(width / height);
        let side = |axis, slope: f64| (of(axis), slope as f32, (1.0 + slope * slope).sqrt() as f32);
        Self {
            eye: of(orbit.eye()),
            forward: of(axes.forward),
            sides: [side(axes.right, up * width / height), side(axes.up, up)],
            pixels: (0.5 * height / up) as f32,
            slant: [(sun.x / sun.z) as f32, (sun.y / sun.z) as f32],
            stretch: (1.0 / sun.z) as f32,
        }
    }

    /// Distance along the view of a sphere \[m\]; none if all of it lies outside the picture.
    fn depth(&self, p_world: [f32; 3], radius: f32) -> Option<f32> {
        let way = std::array::from_fn(|k| p_world[k] - self.eye[k]);
        let depth = dot(way, self.forward);
        let within = |(axis, slope, normal): &([f32; 3], f32, f32)| {
            dot(way, *axis).abs() <= depth * slope + radius * normal
        };
        (depth > -radius && self.sides.iter().all(within)).then_some(depth)
    }
}

impl Sorted {
    /// Sorts the instances of every mesh that has a coarser form. `casts`: there is ground for their shadows.
    pub fn sort(&mut self, sight: &Sight, instances: &[Vec<f32>], coarse: &[Option<Coarse>], casts: bool) {
        for lists in [&mut self.fine, &mut self.coarse, &mut self.shadows] {
            lists.resize(coarse.len(), Vec::new());
            lists.iter_mut().for_each(Vec::clear);
        }
        for (mesh, (list, coarse)) in instances.iter().zip(coarse).enumerate() {
            let Some(coarse) = coarse else { continue };
            for instance in list.chunks_exact(INSTANCE_FLOATS) {
                let [x, y, z] = [instance[0], instance[1], instance[2]];
                // No point of an instance is farther from its place than its sizes together.
                let radius = instance[7] + instance[8] + instance[9];
                if let Some(depth) = sight.depth([x, y, z], radius) {
                    let is_small =
                        instance[7] * sight.pixels < coarse.below * (depth - radius).max(NEAR as f32);
                    let lists = if is_small { &mut self.coarse } else { &mut self.fine };
                    lists[mesh].extend(instance);
                }
                let p_shadow = [x - sight.slant[0] * z, y - sight.slant[1] * z, 0.0];
                if casts && sight.depth(p_shadow, sight.stretch * radius).is_some() {
                    self.shadows[mesh].extend(instance);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_play::Mesh;

    fn instance(p_world: Vec3, size: f32) -> Vec<f32> {
        let place = p_world.iter().map(|x| *x as f32);
        place.chain([0.0, 0.0, 0.0, 1.0, size, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0]).collect()
    }

    /// An instance in the picture is drawn once, with the mesh of its size. One beside, above or behind the picture is not drawn, but its shadow is if that lies in the picture.
    #[test]
    fn instances_are_sorted_by_what_is_seen() {
        let (orbit, size, sun) = (Orbit::beside(&Vec3::new(-1.8, 0.4, 0.0), 2.4), [640, 480], Vec3::z());
        let (sight, aspect) = (Sight::new(&orbit, size, &sun), 640.0 / 480.0);
        let coarse = [Some(Coarse { mesh: Mesh::default(), below: 5.0 })];
        let sorted = |p_world: Vec3, radius: f32| {
            let mut sorted = Sorted::default();
            sorted.sort(&sight, &[instance(p_world, radius)], &coarse, true);
            [sorted.fine, sorted.coarse, sorted.shadows].map(|lists| lists[0].len() / INSTANCE_FLOATS)
        };
        let at = |x: f64, y: f64, depth: f64| orbit.at([x, y], aspect, depth);
        // At 4 m, a pixel is 4 m x 2 tan(0.425) / 480 = 7.5 mm.
        assert_eq!(
            (sorted(at(0.0, 0.0, 4.0), 0.06)[..2].to_vec(), sorted(at(0.9, -0.9, 4.0), 0.02)[..2].to_vec()),
            (vec![1, 0], vec![0, 1])
        );
        for outside in [at(1.2, 0.0, 4.0), at(0.0, 1.2, 4.0), at(0.0, 0.0, -2.0)] {
            assert_eq!(sorted(outside, 0.02)[..2], [0, 0]);
            // Large ones reach into it.
            assert_eq!(sorted(outside, 3.0)[..2], [1, 0]);
        }
        let above = orbit.centre + Vec3::z() * 9.0;
        assert_eq!(sorted(above, 0.02), [0, 0, 1]);
    }
}

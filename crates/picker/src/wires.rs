//! Wires: thin, straight and level lines in depth images.
//!
//! A trellis holds its trees to wires of a few millimetres. A wire shows in few pixels of an image: those whose rays hit it. They are nearer than the pixels
//! above and below them. Twigs and leaves seen from the side look the same, but the pixels of a wire lie on one long level line.

use crate::section::section;
use nalgebra::Vector2;
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Vec3, transform};
use orchard_quantity::{Count, Quantity};

section! {
    /// Wires that the camera sees.
    WiresConfig {
        /// Number of pixels that make a wire. 0: none is looked for.
        points: Count,
        /// Number of thin pixels of an image, spread evenly over it, that are compared at most.
        points_max: Count,
        /// Height in the image above which a thing is no wire, as a length at its depth.
        thickness: Quantity,
        /// Least distance from a wire to what is seen above and below it.
        step: Quantity,
        /// Depth beyond which no wire is looked for.
        range: Quantity,
        /// Largest distance of a wire's pixels from its line, upright and across.
        level: Quantity,
        /// Least length of a wire.
        length: Quantity,
        /// Least difference of the heights of two wires of a trellis.
        spacing: Quantity,
        /// Largest distance between them across, seen from above.
        apart: Quantity,
        /// Least distance of the camera between two views of a wire, without which it does not count.
        parallax: Quantity,
    }
}

/// Points of an image, odom \[m\], that are nearer than what is above and below; `ignored` pixels are no such points.
pub(crate) fn thin_points(
    depth: &DepthImage,
    camera: &Intrinsics,
    ignored: &Image<bool>,
    x_odom_camera: &Pose,
    c: &WiresConfig,
) -> Vec<Vec3> {
    let z_at = |u: usize, v: usize| Some(f64::from(depth[(u, v)])).filter(|z| z.is_finite() && *z > 0.0);
    let mut thin = Vec::new();
    for v in 0..depth.height() {
        for u in 0..depth.width() {
            let Some(z) = z_at(u, v).filter(|z| *z <= c.range.si() && !ignored[(u, v)]) else { continue };
            let off = (c.thickness.si() * camera.fy / z).ceil().max(1.0) as usize;
            let is_behind = |v: usize| z_at(u, v).is_none_or(|behind| behind > z + c.step.si());
            if v >= off && v + off < depth.height() && is_behind(v - off) && is_behind(v + off) {
                thin.push((u, v, z));
            }
        }
    }
    let stride = thin.len().div_ceil(c.points_max.get().max(1) as usize).max(1);
    let seen = |&(u, v, z): &(usize, usize, f64)| {
        transform(x_odom_camera, &camera.back_project(u as f64, v as f64, z))
    };
    thin.iter().step_by(stride).map(seen).collect()
}

/// A piece of a wire, by its ends \[m\]; the height is that of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wire {
    ends: [Vec3; 2],
}

impl Wire {
    /// Ends seen from above, each moved outwards by a distance \[m\].
    pub fn on_ground(&self, beyond: f64) -> [Vector2<f64>; 2] {
        let [a, b] = [self.ends[0].xy(), self.ends[1].xy()];
        let outwards = (b - a).normalize() * beyond;
        [a - outwards, b + outwards]
    }

    /// Distance of a point from the line, seen from above \[m\].
    fn across(&self, p: &Vec3) -> f64 {
        let along = (self.ends[1] - self.ends[0]).xy();
        (along.perp(&(p - self.ends[0]).xy()) / along.norm()).abs()
    }

    fn holds(&self, p: &Vec3, c: &WiresConfig) -> bool {
        (p.z - self.ends[0].z).abs() <= c.level.si() && self.across(p) <= c.level.si()
    }

    /// The wire between the outermost of its points.
    fn through<'a>(&self, points: impl Iterator<Item = &'a Vec3>) -> Self {
        let along = (self.ends[1] - self.ends[0]).xy();
        let at = |p: &Vec3| along.dot(&(p - self.ends[0]).xy());
        let mut ends = self.ends;
        for p in points {
            if at(p) < at(&ends[0]) {
                ends[0] = *p;
            } else if at(p) > at(&ends[1]) {
                ends[1] = *p;
            }
        }
        Self { ends }
    }

    /// True if both are wires of one trellis: at different heights, and near to each other seen from above, along all of the shorter one.
    fn is_beside(&self, other: &Self, c: &WiresConfig) -> bool {
        (self.ends[0].z - other.ends[0].z).abs() >= c.spacing.si()
            && other.ends.iter().all(|p| self.across(p) <= c.apart.si())
            && self.ends.iter().all(|p| other.across(p) <= c.apart.si())
    }
}

/// Finds the wires among thin points of one image, the one with most points first. A point belongs to one wire.
pub(crate) fn wires(mut points: Vec<Vec3>, c: &WiresConfig) -> Vec<Wire> {
    let mut found = Vec::new();
    while let Some((wire, _)) = best(&points, c) {
        let (on, off): (Vec<Vec3>, Vec<Vec3>) = points.iter().partition(|p| wire.holds(p, c));
        found.push(wire.through(on.iter()));
        points = off;
    }
    found
}

/// The line through two of the points that holds most points, if they are enough, and their number.
fn best(points: &[Vec3], c: &WiresConfig) -> Option<(Wire, usize)> {
    let mut best: Option<(Wire, usize)> = None;
    for (i, a) in points.iter().enumerate() {
        for b in &points[i + 1..] {
            let is_level = (b.z - a.z).abs() <= c.level.si();
            if !is_level || (b - a).xy().norm_squared() < c.length.si() * c.length.si() {
                continue;
            }
            let wire = Wire { ends: [*a, *b] };
            let held = points.iter().filter(|p| wire.holds(p, c)).count();
            if held >= c.points.get() as usize && best.is_none_or(|(_, most)| held > most) {
                best = Some((wire, held));
            }
        }
    }
    best
}

/// A wire and what is known of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    wire: Wire,
    /// Position of the camera that saw it first, odom.
    eye: Vec3,
    /// True once it was seen from another place. Things that seem to lie in a row from one place alone are no wire.
    confirmed: bool,
}

/// Wires seen so far, odom.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Wires {
    seen: Vec<Seen>,
}

impl Wires {
    /// Takes note of the wires of an image by a camera at a position; one that goes on where a known one is makes it longer.
    pub fn see(&mut self, points: Vec<Vec3>, eye: Vec3, c: &WiresConfig) {
        for wire in wires(points, c) {
            match self.seen.iter_mut().find(|known| wire.ends.iter().all(|p| known.wire.holds(p, c))) {
                Some(known) => {
                    known.wire = known.wire.through(wire.ends.iter());
                    known.confirmed |= (eye - known.eye).norm() >= c.parallax.si();
                }
                None => self.seen.push(Seen { wire, eye, confirmed: false }),
            }
        }
    }

    /// Wires of a trellis below a height \[m\]: those that have another one above or below, both seen from two places.
    pub fn of_trellis<'a>(&'a self, below: f64, c: &'a WiresConfig) -> impl Iterator<Item = &'a Wire> {
        let sure = || self.seen.iter().filter(|seen| seen.confirmed).map(|seen| &seen.wire);
        let is_paired = move |wire: &Wire| sure().any(|other| wire.is_beside(other, c));
        sure().filter(move |wire| wire.ends[0].z < below && is_paired(wire))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

    const EYE: f64 = 1.2;

    /// Image by a camera `EYE` above the ground that looks along the world's y axis: wires along x, 2 m away, at some heights, before a wall 10 m away. A ray in
    /// four hits them.
    fn image(heights: &[f64]) -> (DepthImage, Intrinsics, Pose) {
        let camera = Intrinsics::from_vertical_fov(192, 144, 1.3);
        let mut depth = DepthImage::filled(192, 144, 10.0);
        for height in heights {
            let v = (camera.cy + camera.fy * (EYE - height) / 2.0).round() as usize;
            for u in (0..192).step_by(4) {
                depth[(u, v)] = 2.0;
            }
        }
        let axes = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        (depth, camera, Pose::from_parts(Translation3::new(0.0, 0.0, EYE), rotation))
    }

    fn seen(depth: &DepthImage, camera: &Intrinsics, x: &Pose, c: &WiresConfig) -> Wires {
        let mut wires = Wires::default();
        let none = Image::filled(camera.width, camera.height, false);
        for aside in [0.0, 0.5] {
            // The wires go along x, so that the image is the same from there.
            let x = Translation3::new(aside, 0.0, 0.0) * x;
            wires.see(thin_points(depth, camera, &none, &x, c), x.translation.vector, c);
        }
        wires
    }

    /// Two wires one above the other are a trellis, from end to end, once they are seen from two places. One alone is none, nor does a thick bar count, nor a wire above
    /// the robot.
    #[test]
    fn wires_above_each_other_are_a_trellis() {
        let c = ExpertConfig::preset().shared.wires;
        let (depth, camera, x) = image(&[1.3, 0.8]);
        let wires = seen(&depth, &camera, &x, &c);
        let found: Vec<Wire> = wires.of_trellis(2.0, &c).copied().collect();
        assert_eq!(found.len(), 2);
        let length = 188.0 / camera.fx * 2.0 + 0.5;
        for (wire, height) in found.iter().zip([1.3, 0.8]) {
            // A pixel is 21 mm there.
            assert!((wire.ends[0].z - height).abs() < 0.011, "{wire:?}");
            let [a, b] = wire.on_ground(0.0);
            assert!((a.y - 2.0).abs() < 1e-9 && (b.y - 2.0).abs() < 1e-9);
            assert!(((a - b).norm() - length).abs() < 1e-6, "{wire:?}");
            assert!(((wire.on_ground(0.6)[0] - a).norm() - 0.6).abs() < 1e-9);
        }
        assert_eq!(wires.seen.len(), 2);
        assert_eq!(wires.of_trellis(1.0, &c).count(), 1);
        let none = Image::filled(camera.width, camera.height, false);
        let mut once = Wires::default();
        for _ in 0..2 {
            once.see(thin_points(&depth, &camera, &none, &x, &c), x.translation.vector, &c);
        }
        assert_eq!(once.of_trellis(2.0, &c).count(), 0, "seen from one place");

        let (depth, ..) = image(&[1.3]);
        assert_eq!(seen(&depth, &camera, &x, &c).of_trellis(2.0, &c).count(), 0);
        let (depth, ..) = image(&[1.3, 1.28, 1.26, 0.8, 0.78, 0.76]);
        assert_eq!(seen(&depth, &camera, &x, &c), Wires::default(), "bars of three pixels");
    }
}

//! Scene of labelled shapes with poses.

use std::sync::Arc;

use crate::blade::BladeMesh;
use orchard_geometry::{Mat3, Pose, Rotation, Shape, Vec3};

/// Kind of the object that a pixel shows. Truth for metrics and tests; no controller receives it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Label {
    /// No valid measurement.
    #[default]
    None,
    /// An apple.
    Fruit,
    /// A leaf.
    Leaf,
    /// A branch or the trunk.
    Wood,
    /// The robot's own body.
    Robot,
    /// The ground.
    Ground,
    /// A post or a wire.
    Scenery,
}

impl Label {
    /// Number of the label, from 0 in the order above: files and kernels have it.
    pub fn number(self) -> usize {
        self as usize
    }
}

/// Instance of a pixel without a valid depth.
pub const NO_INSTANCE: u32 = u32::MAX;

/// Linear-light colour, each channel 0 to 1.
pub type Rgb = [f32; 3];

/// A change of colour, linear in linear light; textures of the palette are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tint(Mat3);

impl Tint {
    /// Multiplies red, green and blue by factors.
    pub fn gains(gains: Vec3) -> Self {
        Self(Mat3::from_diagonal(&gains))
    }

    /// Turns the hue by an angle \[rad\] about the axis of greys, which keeps the sum of the channels: a third of a full turn
    /// turns red into green.
    pub fn hue(angle: f64) -> Self {
        Self(
            Rotation::from_axis_angle(&nalgebra::Unit::new_normalize(Vec3::repeat(1.0)), angle)
                .to_rotation_matrix()
                .into_inner(),
        )
    }

    /// Applies this tint and then another.
    pub fn then(self, next: Self) -> Self {
        Self(next.0 * self.0)
    }

    /// Columns of its matrix: what red, green and blue become.
    pub fn columns(&self) -> [Vec3; 3] {
        [0, 1, 2].map(|k| self.0.column(k).into_owned())
    }

    /// Returns the tinted colour. Channels that a turn of the hue makes negative are set to 0.
    pub fn apply(&self, color: Vec3) -> Vec3 {
        (self.0 * color).map(|channel| channel.max(0.0))
    }
}

/// Geometry of an item, in the item's frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// A solid. Of terrain only the surface is visible, from above and below, not the sides.
    Shape(Shape),
    /// A folded, curled leaf blade ([`crate::blade`]): petiole at the origin, +x along the midrib, +z the
    /// upper face.
    Blade {
        /// Mesh of the unit blade, shared by the leaves of a tree.
        mesh: Arc<BladeMesh>,
        /// Length along the midrib \[m\].
        length: f64,
        /// Full width \[m\].
        width: f64,
    },
}

/// One visible object.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Geometry in the item's frame.
    pub geometry: Geometry,
    /// Pose of the item in the world.
    pub x_world_item: Pose,
    /// Kind of the object.
    pub label: Label,
    /// Index among the items of its label: fruit index, segment index, ...
    pub instance: u32,
    /// Colour in pictures; `None` uses the label's palette.
    pub color: Option<Rgb>,
    /// Change of that colour; `None` keeps it.
    pub tint: Option<Tint>,
}

/// All objects that the camera can see.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// The items, in any order.
    pub items: Vec<Item>,
}

impl Scene {
    /// Adds an item in the palette's colour.
    pub fn push(&mut self, geometry: Geometry, x_world_item: Pose, label: Label, instance: u32) {
        self.items.push(Item { geometry, x_world_item, label, instance, color: None, tint: None });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn hues_turn_about_grey() {
        let (red, green, grey) = (Vec3::x(), Vec3::y(), Vec3::repeat(0.4));
        let third = Tint::hue(TAU / 3.0);
        // Rounding of a rotation.
        assert!((third.apply(red) - green).norm() < 1e-15);
        assert!((Tint::hue(0.7).apply(grey) - grey).norm() < 1e-15);
        let color = Vec3::new(0.3, 0.2, 0.25);
        assert!((Tint::hue(0.1).apply(color).sum() - color.sum()).abs() < 1e-15);
        assert!(Tint::hue(-0.5).apply(red).min() >= 0.0);
    }

    #[test]
    fn tints_follow_one_another() {
        let gains = Tint::gains(Vec3::new(2.0, 3.0, 4.0));
        let color = Vec3::new(0.1, 0.2, 0.3);
        assert_eq!(gains.apply(color), Vec3::new(0.1 * 2.0, 0.2 * 3.0, 0.3 * 4.0));
        let both = Tint::hue(TAU / 3.0).then(gains);
        assert!((both.apply(Vec3::x()) - Vec3::y() * 3.0).norm() < 1e-14);
    }
}

//! Circles, crosses and dots on a picture, at points of the world.

use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::{Circle, Line, PrimitiveStyle};
use orchard_geometry::{Image, Intrinsics, Pose, Vec3, inverse_transform};

use crate::commands::gallery::caption::Canvas;

/// The true fruit.
pub const TRUTH: Rgb888 = Rgb888::new(40, 255, 120);
/// Colour of the controller's beliefs.
pub const BELIEF: Rgb888 = Rgb888::new(255, 60, 230);
/// Colour of fruit knocked off and branches that snap.
pub const HARMED: Rgb888 = Rgb888::new(255, 130, 20);
/// Colour of the detections.
pub const SEEN: Rgb888 = Rgb888::new(255, 235, 60);

/// A picture with the camera that took it.
pub struct Marked<'a> {
    pub image: &'a mut Image<[u8; 3]>,
    pub intrinsics: &'a Intrinsics,
    pub x_world_camera: &'a Pose,
}

impl Marked<'_> {
    /// Pixel and distance of a point before the camera.
    fn place(&self, p_world: &Vec3) -> Option<(Point, f64)> {
        let p_camera = inverse_transform(self.x_world_camera, p_world);
        let (u, v) = self.intrinsics.project(&p_camera)?;
        // Far outside the picture there is nothing to draw, and pixels have bounds.
        let near = |x: f64, side: usize| x.abs() <= 4.0 * side as f64;
        let inside = near(u, self.image.width()) && near(v, self.image.height());
        inside.then(|| (Point::new(u.round() as i32, v.round() as i32), p_camera.z))
    }

    /// The outline of a ball.
    pub fn ball(&mut self, p_world: &Vec3, radius: f64, color: Rgb888) {
        let Some((centre, depth)) = self.place(p_world) else { return };
        let diameter =
            (2.0 * self.intrinsics.fx * radius / depth).clamp(4.0, 2.0 * self.image.width() as f64);
        let circle = Circle::with_center(centre, diameter.round() as u32 + 2);
        let Ok(()) = circle.into_styled(PrimitiveStyle::with_stroke(color, 2)).draw(&mut Canvas(self.image));
    }

    /// A cross at a point.
    pub fn cross(&mut self, p_world: &Vec3, color: Rgb888) {
        const ARM: i32 = 7;
        let Some((centre, _)) = self.place(p_world) else { return };
        for (du, dv) in [(ARM, ARM), (ARM, -ARM)] {
            let line = Line::new(centre - Point::new(du, dv), centre + Point::new(du, dv));
            let Ok(()) =
                line.into_styled(PrimitiveStyle::with_stroke(color, 2)).draw(&mut Canvas(self.image));
        }
    }

    /// A dot at a point.
    pub fn dot(&mut self, p_world: &Vec3, color: Rgb888) {
        let Some((centre, _)) = self.place(p_world) else { return };
        let circle = Circle::with_center(centre, 5);
        let Ok(()) = circle.into_styled(PrimitiveStyle::with_fill(color)).draw(&mut Canvas(self.image));
    }
}

//! Text on a picture.

use embedded_graphics::mono_font::{MonoTextStyle, MonoTextStyleBuilder, ascii::FONT_7X13_BOLD};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::text::{Baseline, Text};
use orchard_geometry::Image;
use std::convert::Infallible;

/// Height of a line with its margins \[px\].
pub const HEIGHT: usize = 21;
/// Space above the letters \[px\].
const MARGIN: usize = 5;
/// Colour of the letters.
const INK: Rgb888 = Rgb888::new(40, 44, 40);

/// Writes a line of ASCII text with its upper left corner at a pixel; text beyond the edge is cut off.
pub fn write(image: &mut Image<[u8; 3]>, text: &str, left: usize, top: usize) {
    let style = MonoTextStyle::new(&FONT_7X13_BOLD, INK);
    let corner = Point::new(left as i32, (top + MARGIN) as i32);
    let Ok(_) = Text::with_baseline(text, corner, style, Baseline::Top).draw(&mut Canvas(image));
}

/// Writes bright text on a dark label with its upper left corner at a pixel, which may be outside the picture.
pub fn write_label(image: &mut Image<[u8; 3]>, text: &str, left: i32, top: i32) {
    const PAPER: Rgb888 = Rgb888::new(12, 14, 16);
    const INK: Rgb888 = Rgb888::new(235, 240, 235);
    let style =
        MonoTextStyleBuilder::new().font(&FONT_7X13_BOLD).text_color(INK).background_color(PAPER).build();
    let Ok(_) =
        Text::with_baseline(text, Point::new(left, top), style, Baseline::Top).draw(&mut Canvas(image));
}

/// A picture to draw on.
pub struct Canvas<'a>(pub &'a mut Image<[u8; 3]>);

impl OriginDimensions for Canvas<'_> {
    fn size(&self) -> Size {
        Size::new(self.0.width() as u32, self.0.height() as u32)
    }
}

impl DrawTarget for Canvas<'_> {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        let bounds = self.bounding_box();
        for Pixel(point, color) in pixels {
            if bounds.contains(point) {
                self.0[(point.x as usize, point.y as usize)] = [color.r(), color.g(), color.b()];
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_drawn_and_cut_off_at_the_edge() {
        let mut image = Image::filled(20, HEIGHT, [255; 3]);
        write(&mut image, "HHHHHHHHHHHH", 1, 0);
        let ink = image.pixels().iter().filter(|&&p| p == [INK.r(), INK.g(), INK.b()]).count();
        assert!(ink > 20, "{ink}");
    }
}

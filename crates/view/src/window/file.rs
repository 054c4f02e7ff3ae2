//! Pictures as files.

use std::path::Path;

use eframe::egui::ColorImage;
use orchard_bench::store::write_bytes;
use orchard_geometry::Image;

use super::ViewError;

/// Writes a picture as PNG; the file takes its name when it is complete.
///
/// # Errors
/// The file cannot be written.
pub fn write_png(file: &Path, image: &Image<[u8; 3]>) -> Result<(), ViewError> {
    Ok(write_bytes(file, &png(image, png::Compression::Balanced))?)
}

/// As [`write_png`], faster and in a larger file: for many pictures.
///
/// # Errors
/// The file cannot be written.
pub fn write_png_fast(file: &Path, image: &Image<[u8; 3]>) -> Result<(), ViewError> {
    Ok(write_bytes(file, &png(image, png::Compression::Fast))?)
}

/// A picture of the window, without its opacity.
pub fn without_alpha(image: &ColorImage) -> Image<[u8; 3]> {
    let [width, height] = image.size;
    let mut out = Image::filled(width, height, [0; 3]);
    for v in 0..height {
        for u in 0..width {
            let colour = image.pixels[v * width + u];
            out[(u, v)] = [colour.r(), colour.g(), colour.b()];
        }
    }
    out
}

fn png(image: &Image<[u8; 3]>, compression: png::Compression) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width() as u32, image.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(compression);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(image.pixels().as_flattened())?;
        writer.finish()
    });
    match written {
        Ok(()) => bytes,
        Err(e) => unreachable!("a picture in memory: {e}"),
    }
}

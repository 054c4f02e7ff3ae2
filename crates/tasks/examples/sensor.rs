//! Writes depth images of a tree by a d435i: true depth, measured depth, and the error between them from -30 mm (blue, too
//! near) to 30 mm (red, too far): `sensor OUT.png`. Says what is missing and how long an image takes.

use std::sync::Arc;

use orchard_camera::picture::depth_picture;
use orchard_camera::{Capture, ImageKey, Sensor};
use orchard_geometry::Image;
use orchard_spec::Spec;
use orchard_spec::camera::CameraSpec;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::vantage::vantages;
use orchard_world::{Planting, tree_scene};

const SEED: u64 = 20_250_704;
/// Error in full colour \[m\].
const FULL: f64 = 0.03;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "sensor.png".into());
    let planting = Planting::draw(&Arc::new(Spec::paper()), SEED, 0, 0)?;
    let scene = tree_scene(&planting);
    let sensor = Sensor::new(&CameraSpec::named("d435i")?);
    let mut panels = Vec::new();
    for (frame, x) in (0..).zip(vantages(&Protocol::paper().detect.vantage, &scene, SEED, 0, 3)) {
        let start = std::time::Instant::now();
        let image = sensor.capture(&scene, &x, ImageKey { seed: SEED, world: 0, frame });
        let elapsed = start.elapsed();
        let count =
            |depth: &orchard_geometry::DepthImage| depth.pixels().iter().filter(|&&z| z > 0.0).count();
        println!("{elapsed:.1?}: {} of {} pixels", count(&image.measured), count(&image.truth.depth));
        panels.push([depths(&image), errors(&image)]);
    }
    save(&out, &panels)
}

/// Truth and measurement side by side, in the same colours.
fn depths(image: &Capture) -> Image<[u8; 3]> {
    let (width, height) = (image.measured.width(), image.measured.height());
    let mut both = Image::filled(2 * width, height, 0.0);
    for v in 0..height {
        for u in 0..width {
            both[(u, v)] = image.truth.depth[(u, v)];
            both[(u + width, v)] = image.measured[(u, v)];
        }
    }
    depth_picture(&both, &[])
}

/// The error in colour; grey where only one of the images has a depth.
fn errors(image: &Capture) -> Image<[u8; 3]> {
    let mut out = Image::filled(image.measured.width(), image.measured.height(), [28, 30, 32]);
    let pixels = image.measured.pixels().iter().zip(image.truth.depth.pixels());
    for (color, (&measured, &truth)) in out.pixels_mut().iter_mut().zip(pixels) {
        let t = (f64::from(measured - truth) / FULL).clamp(-1.0, 1.0);
        let fade = |share: f64| (255.0 * (1.0 - share.max(0.0))) as u8;
        *color = match (measured > 0.0, truth > 0.0) {
            (true, true) => [fade(-t), fade(t.abs()), fade(t)],
            (false, false) => *color,
            _ => [110, 110, 110],
        };
    }
    out
}

/// A sheet with a row a view.
fn save(file: &str, rows: &[[Image<[u8; 3]>; 2]]) -> Result<(), Box<dyn std::error::Error>> {
    let mut sheet = Vec::new();
    for parts in rows {
        for v in 0..parts[0].height() {
            for part in parts {
                let width = part.width();
                sheet.extend_from_slice(part.pixels()[v * width..(v + 1) * width].as_flattened());
            }
        }
    }
    let width = rows.first().map_or(0, |parts| parts.iter().map(Image::width).sum());
    let height = rows.iter().map(|parts| parts[0].height()).sum::<usize>();
    let out = std::io::BufWriter::new(std::fs::File::create(file)?);
    let mut encoder = png::Encoder::new(out, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&sheet)?;
    Ok(())
}

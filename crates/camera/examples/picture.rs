//! Writes a picture of a hand-made scene and a depth image of it: `picture STEM`.

#[path = "../tests/suite/common/mod.rs"]
mod common;
#[path = "../tests/suite/common/score.rs"]
mod score;

use orchard_camera::picture::{PictureStyle, depth_picture_enlarged, look_at, picture};
use orchard_geometry::{Image, Intrinsics, Vec3};
use orchard_perception::DetectorConfig;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let stem = std::env::args().nth(1).unwrap_or_else(|| "picture".into());
    let scene = common::orchard(1, 350, 40);
    let view = Intrinsics::from_vertical_fov(800, 800, 45_f64.to_radians());
    let x = look_at(&Vec3::new(-1.6, -2.6, 1.3), &Vec3::new(-0.35, 0.0, 0.85));
    let start = std::time::Instant::now();
    let outside = picture(&scene, &view, &x, &PictureStyle::default());
    println!("picture {:.2} s", start.elapsed().as_secs_f64());
    let wrist = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let x = look_at(&Vec3::new(-0.65, 0.0, 1.15), &Vec3::new(0.0, 0.0, 1.0));
    let mut score = score::Score::default();
    let (frame, found) = score::add_image(&mut score, &scene, &wrist, &x, &DetectorConfig::paper(), |_| {});
    let circles: Vec<_> =
        found.iter().map(|d| (d.center_px.0, d.center_px.1, d.radius * wrist.fx / d.p_camera.z)).collect();
    save(&format!("{stem}-scene.png"), &outside)?;
    save(&format!("{stem}-depth.png"), &depth_picture_enlarged(&frame.depth, &circles, 4))?;
    println!("precision {}, recall {}", score.precision(), score.recall());
    Ok(())
}

fn save(file: &str, image: &Image<[u8; 3]>) -> Result<(), Box<dyn std::error::Error>> {
    let out = std::io::BufWriter::new(std::fs::File::create(file)?);
    let mut encoder = png::Encoder::new(out, image.width() as u32, image.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(image.pixels().as_flattened())?;
    Ok(())
}

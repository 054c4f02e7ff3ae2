//! Pictures of the wrist camera, and what the detector finds in its latest image.

use orchard_camera::picture::{PictureStyle, ShadowMaps, depth_picture_enlarged, picture};
use orchard_geometry::{Image, Intrinsics, Vec3, inverse_transform, transform};
use orchard_perception::{DetectorConfig, RgbdImage, detect};
use orchard_world::World;
use serde::Serialize;

use crate::annotate::Seen;

/// Rows of the colour picture.
const ROWS: usize = 144;

/// Spheres that a detector finds in the camera's latest image; none before the first, or in an image that the detector refuses.
pub fn seen(world: &World, detector: &DetectorConfig) -> Vec<Seen> {
    let Some(truth) = world.camera_truth() else { return Vec::new() };
    let intrinsics = world.sense().intrinsics;
    let image = RgbdImage { depth: truth.measured(), colour: truth.colour.as_deref() };
    let found = detect(image, &intrinsics, None, detector).unwrap_or_default();
    let seen = found.into_iter().map(|found| Seen {
        p_world: transform(&truth.sight.x_world_camera, &found.p_camera),
        radius: found.radius,
        score: found.score,
    });
    seen.collect()
}

/// A circle in the camera's latest image: the outline of a sphere.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Circle {
    /// Column of the centre \[px\].
    pub u: f64,
    /// Row of the centre \[px\].
    pub v: f64,
    /// Radius \[px\].
    pub radius: f64,
}

/// Outline of a sphere about a place \[m\], world, in the camera's latest image; `None` behind the camera, or before the first image.
pub fn circle(world: &World, p_world: &Vec3, radius: f64) -> Option<Circle> {
    let p_camera = inverse_transform(&world.camera_truth()?.sight.x_world_camera, p_world);
    let intrinsics = world.sense().intrinsics;
    let (u, v) = intrinsics.project(&p_camera)?;
    Some(Circle { u, v, radius: intrinsics.fx * radius / p_camera.z })
}

/// The latest depth image in false colour, bright is near, with a circle around each detection, by `enlarged` dots a pixel side; `None` before the first
/// image.
pub fn depth(world: &World, seen: &[Seen], enlarged: usize) -> Option<Image<[u8; 3]>> {
    let truth = world.camera_truth()?;
    let circles = seen.iter().filter_map(|seen| circle(world, &seen.p_world, seen.radius));
    let circles: Vec<(f64, f64, f64)> = circles.map(|circle| (circle.u, circle.v, circle.radius)).collect();
    Some(depth_picture_enlarged(truth.measured(), &circles, enlarged))
}

/// A colour picture of the present state with the camera's place and field of view, with the sun's shadow and without the sky's.
pub fn colour(world: &World) -> Image<[u8; 3]> {
    let own = world.sense().intrinsics;
    let scale = ROWS as f64 / own.height.max(1) as f64;
    let intrinsics = Intrinsics {
        width: (own.width as f64 * scale) as usize,
        height: ROWS,
        fx: own.fx * scale,
        fy: own.fy * scale,
        cx: own.cx * scale,
        cy: own.cy * scale,
    };
    let style = PictureStyle {
        shadows: ShadowMaps { sun: 512, sky: 0 },
        supersampling: 1,
        ..PictureStyle::default()
    };
    picture(&world.picture_scene(), &intrinsics, &world.x_world_camera(), &style)
}

//! Pictures of the wrist camera, and what the detector finds in its latest image.

use orchard_camera::picture::{PictureStyle, ShadowMaps, depth_picture_enlarged, picture};
use orchard_geometry::{Image, Intrinsics, inverse_transform, transform};
use orchard_perception::{DetectorConfig, detect};
use orchard_world::World;

use crate::annotate::Seen;

/// Dots a pixel side of the depth picture.
const ENLARGED: usize = 2;
/// Rows of the colour picture.
const ROWS: usize = 144;

/// Spheres that a detector finds in the camera's latest image; none before the first, or in an image that the detector refuses.
pub fn seen(world: &World, detector: &DetectorConfig) -> Vec<Seen> {
    let Some(truth) = world.camera_truth() else { return Vec::new() };
    let intrinsics = world.sense().intrinsics;
    let found = detect(&truth.measured, &intrinsics, None, detector).unwrap_or_default();
    let seen = found.into_iter().map(|found| Seen {
        p_world: transform(&truth.sight.x_world_camera, &found.p_camera),
        radius: found.radius,
        score: found.score,
    });
    seen.collect()
}

/// The latest depth image in false colour, bright is near, with a circle around each detection; `None` before the first image.
pub fn depth(world: &World, seen: &[Seen]) -> Option<Image<[u8; 3]>> {
    let truth = world.camera_truth()?;
    let intrinsics = world.sense().intrinsics;
    let circles: Vec<(f64, f64, f64)> = seen
        .iter()
        .filter_map(|seen| {
            let p_camera = inverse_transform(&truth.sight.x_world_camera, &seen.p_world);
            let (u, v) = intrinsics.project(&p_camera)?;
            Some((u, v, intrinsics.fx * seen.radius / p_camera.z))
        })
        .collect();
    Some(depth_picture_enlarged(&truth.measured, &circles, ENLARGED))
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

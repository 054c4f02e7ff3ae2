//! Colour pictures of the device at hand against those of the processor.

use std::sync::Arc;

use orchard_camera::Scene;
use orchard_camera::picture::{PictureStyle, ShadowMaps, Studio, look_at, sun_direction};
use orchard_geometry::{Image, Intrinsics, Pose, Vec3};
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_world::World;

use crate::arrays::DeviceArray;
use crate::device::{Choice, Gpu, GpuError};
use crate::images::{Lit, PictureBatch};
use crate::shapes::shapes;
use crate::testing::device;

/// Steps of 255 by which a colour may differ because of rounding.
const STEPS: u8 = 2;

/// Scenes of several kinds of trees with a robot: level and uneven ground, posts and wires, varied colours.
fn scenes() -> Vec<(Scene, Pose)> {
    let robot = Arc::new(RobotModel::paper());
    let presets = [Preset::Paper, Preset::Randomised, Preset::VTrellis];
    let scene = |preset| {
        let world = World::new(Arc::new(Spec::preset(preset)), robot.clone(), 4, 0).unwrap();
        (world.picture_scene(), world.x_world_camera())
    };
    presets.into_iter().map(scene).collect()
}

/// A clear day as policies see it, a camera's picture, a low sun, and cloud without a hidden sky.
fn styles() -> [PictureStyle; 4] {
    let shadows = ShadowMaps { sun: 256, sky: 48 };
    let clear = PictureStyle { shadows, ..PictureStyle::default() };
    let camera = PictureStyle { shadows, ..PictureStyle::of_camera() };
    let low = PictureStyle { sun_world: sun_direction(0.4, 0.15), supersampling: 1, ..clear };
    let cloud = PictureStyle { overcast: 1.0, shadows: ShadowMaps { sky: 0, ..shadows }, ..camera };
    [clear, camera, low, cloud]
}

/// Share of the pixels that differ by more than [`STEPS`], and mean difference of channels \[1/255\].
fn difference(here: &Image<[u8; 3]>, there: &Image<[u8; 3]>) -> (f64, f64) {
    assert_eq!((here.width(), here.height()), (there.width(), there.height()));
    let each = here.pixels().iter().zip(there.pixels());
    let of = |(a, b): (&[u8; 3], &[u8; 3])| [0, 1, 2].map(|k| a[k].abs_diff(b[k]));
    let steps: Vec<[u8; 3]> = each.map(of).collect();
    let differ = steps.iter().filter(|steps| steps.iter().any(|step| *step > STEPS)).count();
    let sum: u64 = steps.as_flattened().iter().map(|step| u64::from(*step)).sum();
    (differ as f64 / steps.len() as f64, sum as f64 / (3 * steps.len()) as f64)
}

/// Pictures of worlds have the colours of the processor's, but for pixels at silhouettes and edges of shadows, whose samples may show what is beside them.
#[test]
fn pictures_of_worlds_are_those_of_the_processor() {
    let Some(gpu) = device() else { return };
    let (scenes, styles) = (scenes(), styles());
    let beside = look_at(&Vec3::new(-1.1, 0.3, 1.3), &Vec3::new(0.0, 0.0, 1.0));
    let cameras: Vec<[(Intrinsics, Pose); 2]> = scenes
        .iter()
        .map(|(_, wrist)| {
            let eye = |width, fov| Intrinsics::from_vertical_fov(width, 48, fov);
            [(eye(64, 1.0), *wrist), (eye(61, 1.3), beside)]
        })
        .collect();
    let mut lit = Vec::new();
    for ((scene, _), cameras) in scenes.iter().zip(&cameras) {
        lit.extend(styles.map(|style| Lit { kept: None, loose: scene, style, cameras }));
    }
    let drawn = PictureBatch::new(&gpu).pictures(&lit).unwrap();
    let (mut share, mut mean, mut count) = (0.0, 0.0, 0);
    for (lit, drawn) in lit.iter().zip(&drawn) {
        let studio = Studio::new(lit.loose, &lit.style);
        for ((k, x_world_camera), there) in lit.cameras.iter().zip(drawn) {
            let here = studio.picture(k, x_world_camera);
            let (differ, by) = difference(&here, there);
            (share, mean, count) = (share + differ, mean + by, count + 1);
        }
    }
    let (share, mean) = (share / f64::from(count), mean / f64::from(count));
    // Both limits were set after the first run, which found 0 and 0.003.
    assert!(share < 0.001 && mean < 0.02, "{share} of the pixels differ, the mean difference is {mean}");
}

/// A picture has the same bytes alone, among others, drawn in several parts, and in the row of an array. Scenes without cameras, cameras without pixels and empty scenes are allowed; what is too large is refused.
#[test]
fn company_parts_and_arrays_change_no_bit_of_a_picture() {
    let Some(gpu) = device() else { return };
    let mut rng = Stream::new(8, 0, Purpose::Test);
    let scenes: Vec<Scene> = (0..6).map(|_| shapes(&mut rng, 5)).chain([Scene::default()]).collect();
    let shadows = ShadowMaps { sun: 64, sky: 16 };
    let camera = |width| (Intrinsics::from_vertical_fov(width, 30, 1.0), Pose::translation(0.0, 0.0, -2.0));
    let cameras: Vec<Vec<(Intrinsics, Pose)>> =
        (0..scenes.len()).map(|i| (0..i % 3).map(|k| camera(7 * (i + k) + 1)).collect()).collect();
    let lit: Vec<Lit<'_>> = scenes
        .iter()
        .zip(&cameras)
        .enumerate()
        .map(|(i, (scene, cameras))| {
            // Of the last ones nothing hides the sky.
            let shadows = ShadowMaps { sky: if i < 4 { shadows.sky } else { 0 }, ..shadows };
            let style = PictureStyle { shadows, supersampling: 1 + i % 3, ..PictureStyle::of_camera() };
            Lit { kept: None, loose: scene, style, cameras }
        })
        .collect();
    let together = PictureBatch::new(&gpu).pictures(&lit).unwrap();
    assert!(together[0].is_empty() && together.iter().flatten().count() == 6);
    let mut batch = PictureBatch::new(&gpu);
    for (lit, drawn) in lit.iter().zip(&together) {
        assert_eq!(batch.pictures(std::slice::from_ref(lit)).unwrap(), std::slice::from_ref(drawn));
    }
    let small = Gpu::open_with(Choice::Any, 1 << 18).unwrap();
    assert_eq!(PictureBatch::new(&small).pictures(&lit).unwrap(), together);
    let none = [(Intrinsics { width: 0, ..camera(4).0 }, Pose::identity())];
    let nothing = Lit { cameras: &none, ..lit[1] };
    assert_eq!(batch.pictures(&[nothing]).unwrap()[0][0].pixels(), [[0; 3]; 0]);
    let of_rows = [camera(8), camera(12)];
    let lit: Vec<Lit<'_>> = lit.iter().map(|lit| Lit { cameras: &of_rows, ..*lit }).collect();
    let arrays = [8, 12].map(|w| DeviceArray::new(&gpu, "pictures", 9, 3 * 30 * w, false).unwrap());
    let rows = [8, 0, 3, 2, 1, 5, 6];
    batch.pictures_into(&lit, &arrays.each_ref(), &rows).unwrap();
    let drawn = batch.pictures(&lit).unwrap();
    for (k, array) in arrays.iter().enumerate() {
        let bytes = array.read().unwrap();
        let each = bytes.len() / 9;
        for (row, drawn) in rows.iter().zip(&drawn) {
            assert_eq!(&bytes[row * each..(row + 1) * each], drawn[k].pixels().as_flattened());
        }
    }
    let large = [camera(4000)];
    let refused = PictureBatch::new(&small).pictures(&[Lit { cameras: &large, ..lit[1] }]).unwrap_err();
    assert!(matches!(refused, GpuError::TooLarge { what: "bytes in one buffer", fits: 0, .. }), "{refused}");
}

//! Images of the device at hand against those of the processor.

use std::sync::Arc;

use orchard_camera::picture::look_at;
use orchard_camera::{Exposure, Frame, Item, Label, MovingScene, NO_INSTANCE, Scene};
use orchard_geometry::{Intrinsics, Pose, Vec3};
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_world::World;

use crate::arrays::DeviceArray;
use crate::device::{Choice, Gpu, GpuError};
use crate::direction::direction;
use crate::images::{DepthMask, ImageBatch, Subject, View};
use crate::shapes::{rotation, shapes};
use crate::testing::device;

/// Largest difference of the depths of one surface, over the depth.
const TOLERANCE: f32 = 1e-5;
/// Number of random shapes in a scene.
const SHAPES: u32 = 5;
/// Share of a pixel by which a ray may pass beside a silhouette on the device.
const BESIDE: f64 = 1e-3;

fn exposure(
    width: usize,
    height: usize,
    fov: f64,
    x_world_camera: Pose,
    (near, far): (f64, f64),
) -> Exposure {
    let intrinsics = Intrinsics::from_vertical_fov(width, height, fov);
    Exposure { intrinsics, x_world_camera, near, far }
}

/// Compares an image of the device with that of the processor; returns the number of pixels that show something, and of those at silhouettes where both differ. A pixel may differ only if the processor's ray
/// moved by [`BESIDE`] shows what the device has, or if both show surfaces at one depth.
fn compare(scene: &Scene, exposure: &Exposure, device: &Frame) -> (usize, usize) {
    let here = exposure.draw(scene);
    let k = exposure.intrinsics;
    let agrees = |frame: &Frame, i: usize| {
        let (a, b) = (device.depth.pixels()[i], frame.depth.pixels()[i]);
        let is_same = device.label.pixels()[i] == frame.label.pixels()[i]
            && device.instance.pixels()[i] == frame.instance.pixels()[i];
        (a - b).abs() <= TOLERANCE * b && is_same
    };
    let mut around: Vec<Frame> = Vec::new();
    let (mut valid, mut beside) = (0, 0);
    for i in 0..k.width * k.height {
        valid += usize::from(here.depth.pixels()[i] > 0.0);
        if agrees(&here, i) {
            continue;
        }
        if around.is_empty() {
            let moved = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)].map(|(u, v)| {
                let intrinsics = Intrinsics { cx: k.cx + BESIDE * u, cy: k.cy + BESIDE * v, ..k };
                Exposure { intrinsics, ..*exposure }.draw(scene)
            });
            around.extend(moved);
        }
        let (u, v) = (i % k.width, i / k.width);
        let of =
            |frame: &Frame| (frame.depth.pixels()[i], frame.label.pixels()[i], frame.instance.pixels()[i]);
        // Two surfaces at one depth, such as the balls at a joint of wood: either is right.
        let is_shown = |item: &&Item| (item.label, item.instance) == (of(device).1, of(device).2);
        let alone = Scene { items: scene.items.iter().filter(is_shown).cloned().collect() };
        let is_there =
            || agrees(&exposure.draw(&alone), i) && (of(device).0 - of(&here).0).abs() <= TOLERANCE;
        // A surface seen at a glancing angle: its depth is between those beside.
        let zs =
            || around.iter().filter(|f| of(f).1 == of(device).1 && of(f).2 == of(device).2).map(|f| of(f).0);
        let is_between = zs().any(|z| z <= of(device).0) && zs().any(|z| z >= of(device).0);
        let explained = is_between || around.iter().any(|frame| agrees(frame, i)) || is_there();
        assert!(explained, "({u}, {v}): {:?} on the device, {:?} here", of(device), of(&here));
        beside += 1;
    }
    (valid, beside)
}

/// Compares images of scenes: at most one pixel in a thousand may differ, of at least `least` that show something.
fn assert_alike<'a>(images: impl Iterator<Item = ((&'a Scene, Exposure), &'a Frame)>, least: usize) {
    let (mut valid, mut beside) = (0, 0);
    for ((scene, exposure), frame) in images {
        let (shown, differ) = compare(scene, &exposure, frame);
        (valid, beside) = (valid + shown, beside + differ);
    }
    assert!(valid > least && beside * 1000 <= valid, "{beside} of {valid}");
}

fn scene_of<'a>(view: &View<'a>) -> &'a Scene {
    match view.subject {
        Subject::Scene(scene) => scene,
        Subject::Kept { .. } => panic!("the view shows no scene of its own"),
    }
}

/// Worlds of several kinds with the robot near the tree, seen from its wrist and from beside, by narrow and wide lenses.
#[test]
fn images_of_worlds_are_those_of_the_processor() {
    let Some(gpu) = device() else { return };
    let robot = Arc::new(RobotModel::paper());
    let worlds: Vec<World> = [Preset::Paper, Preset::Calibrated, Preset::VTrellis]
        .into_iter()
        .map(|preset| World::new(Arc::new(Spec::preset(preset)), robot.clone(), 4, 0).unwrap())
        .collect();
    let scenes: Vec<Scene> = worlds.iter().map(World::scene).collect();
    let eyes =
        [[-0.7, 0.2, 1.1], [0.9, -0.4, 1.6]].map(|eye| look_at(&eye.into(), &Vec3::new(0.0, 0.0, 1.0)));
    let mut views = Vec::new();
    for (world, scene) in worlds.iter().zip(&scenes) {
        let [a, b] = eyes;
        for exposure in [
            exposure(192, 144, 1.0, world.x_world_camera(), (0.05, 3.0)),
            exposure(128, 128, 1.2, a, (0.3, 3.0)),
            exposure(65, 33, 2.2, b, (0.0, f64::INFINITY)),
        ] {
            views.push(View { subject: Subject::Scene(scene), exposure });
        }
    }
    let frames = ImageBatch::new(&gpu).frames(&views).unwrap();
    assert_alike(views.iter().map(|view| (scene_of(view), view.exposure)).zip(&frames), 40_000);
    let depths = ImageBatch::new(&gpu).depths(&views).unwrap();
    assert!(frames.iter().zip(&depths).all(|(frame, depth)| frame.depth == *depth));
}

/// A scene that the device keeps is shown as its bodies stand; a place takes another scene, and more places or a larger scene move all others.
#[test]
fn kept_scenes_are_drawn_as_their_bodies_stand() {
    let Some(gpu) = device() else { return };
    let mut rng = Stream::new(7, 0, Purpose::Test);
    let mut batch = ImageBatch::new(&gpu);
    let k = Intrinsics { width: 48, height: 40, fx: 30.0, fy: 41.0, cx: 20.3, cy: 22.8 };
    let mut all = Vec::new();
    for round in 0..12 {
        let places = [2, 0, round % 5];
        let scenes = places.map(|place| {
            let mut moving = MovingScene::default();
            for body in 0..1 + round as u32 {
                moving.extend(body, shapes(&mut rng, SHAPES).items);
            }
            let moving = Arc::new(moving);
            batch.keep(place, &moving);
            moving
        });
        // The last scene of a place counts.
        let last = |i: usize| places.iter().rposition(|place| *place == places[i]).unwrap();
        let poses: Vec<Vec<Pose>> = (0..3)
            .map(|_| {
                let pose = |_| Pose::from_parts((direction(&mut rng) * 0.5).into(), rotation(&mut rng));
                (0..=round).map(pose).collect()
            })
            .collect();
        let x_world_camera = Pose::from_parts((0.2 * direction(&mut rng)).into(), rotation(&mut rng));
        let exposure = Exposure { intrinsics: k, x_world_camera, near: 0.1, far: 2.5 };
        let scene = shapes(&mut rng, SHAPES);
        let kept = |i: usize| Subject::Kept { place: places[i], x_world_body: &poses[i] };
        let subjects = [kept(0), Subject::Scene(&scene), kept(1), kept(2)];
        let frames = batch.frames(&subjects.map(|subject| View { subject, exposure })).unwrap();
        let [a, b, c] = [0, 1, 2].map(|i| scenes[last(i)].posed(&poses[i]));
        all.extend([a, scene.clone(), b, c].into_iter().map(|scene| (scene, exposure)).zip(frames));
    }
    assert_alike(all.iter().map(|((scene, exposure), frame)| ((scene, *exposure), frame)), 20_000);
}

/// Random shapes all around the camera: through its plane, behind it, about it.
#[test]
fn images_of_shapes_around_the_camera_are_those_of_the_processor() {
    let Some(gpu) = device() else { return };
    let mut rng = Stream::new(5, 0, Purpose::Test);
    let scenes: Vec<Scene> = (0..150).map(|_| shapes(&mut rng, SHAPES)).collect();
    let k = Intrinsics { width: 48, height: 40, fx: 30.0, fy: 41.0, cx: 20.3, cy: 22.8 };
    let views: Vec<View<'_>> = scenes
        .iter()
        .map(|scene| {
            let p = 0.2 * direction(&mut rng);
            let x_world_camera = Pose::from_parts(p.into(), rotation(&mut rng));
            View {
                subject: Subject::Scene(scene),
                exposure: Exposure { intrinsics: k, x_world_camera, near: 0.1, far: 2.5 },
            }
        })
        .collect();
    let frames = ImageBatch::new(&gpu).frames(&views).unwrap();
    assert_alike(views.iter().map(|view| (scene_of(view), view.exposure)).zip(&frames), 50_000);
}

/// An image has the same bits alone, among others, and drawn in several parts; views without items or pixels are allowed.
#[test]
fn company_and_parts_change_no_bit_of_an_image() {
    let Some(gpu) = device() else { return };
    let mut rng = Stream::new(6, 0, Purpose::Test);
    let scenes: Vec<Scene> = (0..5).map(|_| shapes(&mut rng, SHAPES)).chain([Scene::default()]).collect();
    let view = |(i, scene)| View {
        subject: Subject::Scene(scene),
        exposure: exposure(40 * i, 90, 1.0, Pose::identity(), (0.1, 4.0)),
    };
    let views: Vec<View<'_>> = scenes.iter().enumerate().map(view).collect();
    let together = ImageBatch::new(&gpu).frames(&views).unwrap();
    let mut batch = ImageBatch::new(&gpu);
    for (view, frame) in views.iter().zip(&together) {
        assert_eq!(batch.frames(std::slice::from_ref(view)).unwrap(), std::slice::from_ref(frame));
    }
    assert!(together[5].label.pixels().iter().all(|label| *label == Label::None));
    assert!(together[5].instance.pixels().iter().all(|instance| *instance == NO_INSTANCE));
    let small = Gpu::open_with(Choice::Any, 1 << 18).unwrap();
    assert_eq!(ImageBatch::new(&small).frames(&views).unwrap(), together);
    let large = View {
        subject: Subject::Scene(&scenes[0]),
        exposure: exposure(400, 350, 1.0, Pose::identity(), (0.1, 4.0)),
    };
    let refused = ImageBatch::new(&small).frames(&[large]).unwrap_err();
    assert!(matches!(refused, GpuError::TooLarge { what: "bytes in one buffer", .. }), "{refused}");
}

/// Images that stay on the device, in rows of any order and in several parts, have the bits of those that are read; so do masks, whose rows are no whole words here. A row that is cleared or written changes alone.
#[test]
fn images_that_stay_have_the_same_bits() {
    let Some(gpu) = device() else { return };
    let (width, height, rows) = (5, 3, 600);
    let mut rng = Stream::new(7, 0, Purpose::Test);
    let scenes: Vec<Scene> = (0..rows).map(|_| shapes(&mut rng, SHAPES)).collect();
    let exposure = exposure(width, height, 1.0, Pose::identity(), (0.1, 4.0));
    let views: Vec<View<'_>> =
        scenes.iter().map(|scene| View { subject: Subject::Scene(scene), exposure }).collect();
    let array = |bytes: usize| DeviceArray::new(&gpu, "images", rows, bytes * width * height, false).unwrap();
    let (depths, masks) = (array(4), array(1));
    let read = |array: &DeviceArray| array.read().unwrap();
    masks.write(&vec![7; masks.bytes()]);
    assert_eq!(read(&masks), vec![7; masks.bytes()]);
    let drawn = ImageBatch::new(&gpu).depths(&views).unwrap();
    let backwards: Vec<usize> = (0..rows).rev().collect();
    ImageBatch::new(&gpu).depths_into(&views, &depths, &backwards).unwrap();
    let mask = DepthMask::new(&gpu, &depths, &masks);
    mask.mark();
    let mut expected: Vec<f32> = drawn.iter().rev().flat_map(|image| image.pixels().to_vec()).collect();
    let agree = |expected: &[f32]| {
        assert_eq!(bytemuck::pod_collect_to_vec::<u8, f32>(&read(&depths)), expected);
        let valid: Vec<u8> = expected.iter().map(|depth| u8::from(*depth > 0.0)).collect();
        assert_eq!(read(&masks), valid);
    };
    agree(&expected);
    assert!(expected.iter().filter(|depth| **depth > 0.0).count() > rows);
    let row = |row: usize| row * width * height..(row + 1) * width * height;
    depths.clear_row(1);
    depths.write_row(rows - 1, &vec![2.5_f32; width * height]);
    mask.mark();
    expected[row(1)].fill(0.0);
    expected[row(rows - 1)].fill(2.5);
    agree(&expected);
    let refused = DeviceArray::new(&gpu, "large", 4, 1 << 40, true).unwrap_err();
    assert!(matches!(refused, GpuError::TooLarge { fits: 0, .. }), "{refused}");
}

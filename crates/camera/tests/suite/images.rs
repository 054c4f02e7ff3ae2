//! Tests depth images, visibility counts and pictures.

use super::common;

use orchard_camera::picture::{PictureStyle, look_at, picture};
use orchard_camera::{Frame, Geometry, Label, NO_INSTANCE, Scene, fruit_views, render};
use orchard_geometry::{Intrinsics, Pose, Shape, Vec3};

fn camera() -> Intrinsics {
    Intrinsics::from_vertical_fov(96, 72, 75_f64.to_radians())
}

fn ball(scene: &mut Scene, p: [f64; 3], radius: f64, label: Label, instance: u32) {
    let pose = Pose::translation(p[0], p[1], p[2]);
    scene.push(Geometry::Shape(Shape::Sphere { radius }), pose, label, instance);
}

/// World and camera frame coincide in these tests.
fn rendered(scene: &Scene) -> Frame {
    let mut frame = Frame::new(0, 0);
    render(scene, &camera(), &Pose::identity(), 0.3, 3.0, &mut frame);
    frame
}

#[test]
fn nearer_than_near_hides_and_is_invalid() {
    let mut scene = Scene::default();
    ball(&mut scene, [0.0, 0.0, 1.0], 0.3, Label::Fruit, 7);
    ball(&mut scene, [0.0, 0.0, 0.2], 0.02, Label::Leaf, 1);
    ball(&mut scene, [0.0, 0.0, 9.0], 5.0, Label::Wood, 2);
    let frame = rendered(&scene);
    let at = |u, v| (frame.depth[(u, v)], frame.label[(u, v)], frame.instance[(u, v)]);
    assert_eq!(at(48, 36), (0.0, Label::None, NO_INSTANCE));
    let (z, label, instance) = at(58, 36);
    assert!(z > 0.7 && z < 1.0);
    assert_eq!((label, instance), (Label::Fruit, 7));
    assert_eq!(at(70, 36), (0.0, Label::None, NO_INSTANCE), "beyond far");
}

#[test]
fn visibility_counts_pixels() {
    let mut scene = Scene::default();
    ball(&mut scene, [0.0, 0.0, 1.0], 0.1, Label::Fruit, 4);
    ball(&mut scene, [-0.5, 0.0, 1.0], 0.1, Label::Fruit, 9);
    ball(&mut scene, [5.0, 0.0, 1.0], 0.1, Label::Fruit, 5);
    // A wall that hides the lower half of the first.
    let wall = Shape::Box { half: Vec3::new(0.2, 0.2, 0.01) };
    scene.push(Geometry::Shape(wall), Pose::translation(0.0, 0.2, 0.7), Label::Wood, 0);
    let frame = rendered(&scene);
    let seen = fruit_views(&frame, &scene, &camera(), &Pose::identity());
    assert_eq!(seen.iter().map(|s| s.instance).collect::<Vec<_>>(), [4, 9, 5]);
    // The image's centre row lies between pixels: exactly half.
    assert_eq!(2 * seen[0].visible_px, seen[0].unoccluded_px);
    assert_eq!(seen[1].visible_px, seen[1].unoccluded_px);
    assert_eq!((seen[2].visible_px, seen[2].unoccluded_px, seen[2].visible_box), (0, 0, None));
    assert_eq!([0.5, 1.0, 0.0], [0, 1, 2].map(|i| seen[i].visible_fraction()));
    assert_eq!((seen[1].p_camera, seen[1].radius), (orchard_geometry::Vec3::new(-0.5, 0.0, 1.0), 0.1));
    let (whole, half) = (seen[1].visible_box.unwrap(), seen[0].visible_box.unwrap());
    assert_eq!(whole.v.1 - whole.v.0 + 1, 2 * (half.v.1 - half.v.0 + 1));
    // Disc of the ball: tangent cone, pi f^2 r^2 / (z^2 - r^2), to the pixels on its rim.
    let f = camera().fx;
    let disc = std::f64::consts::PI * f * f * 0.01 / 0.99;
    let rim = std::f64::consts::TAU * f * 0.1;
    assert!((f64::from(seen[0].unoccluded_px) - disc).abs() < 0.5 * rim, "{} {disc}", seen[0].unoccluded_px);
}

#[test]
fn the_same_scene_gives_the_same_bytes() {
    let scene = common::orchard(2, 60, 10);
    let x = look_at(&Vec3::new(-1.0, -0.6, 1.1), &Vec3::new(0.0, 0.0, 0.9));
    let style = PictureStyle { supersampling: 1, ..PictureStyle::default() };
    let images = [0, 1].map(|_| {
        let mut frame = Frame::new(0, 0);
        render(&scene, &camera(), &x, 0.3, 3.0, &mut frame);
        (frame, picture(&scene, &camera(), &x, &style))
    });
    assert_eq!(images[0], images[1]);
}

#[test]
fn pictures_have_sky_light_and_shadow() {
    let mut scene = Scene::default();
    scene.push(Geometry::Shape(Shape::HalfSpace), Pose::identity(), Label::Ground, 0);
    let plate = Shape::Box { half: Vec3::new(0.3, 0.3, 0.01) };
    scene.push(Geometry::Shape(plate), Pose::translation(0.0, 0.0, 1.0), Label::Robot, 0);
    let style = PictureStyle { sun_world: Vec3::z(), supersampling: 2, ..PictureStyle::default() };
    let x = look_at(&Vec3::new(-3.0, 0.0, 1.6), &Vec3::new(0.0, 0.0, 0.7));
    let k = camera();
    let image = picture(&scene, &k, &x, &style);
    let brightness = |p: Vec3| {
        let (u, v) = k.project(&orchard_geometry::inverse_transform(&x, &p)).unwrap();
        image[(u.round() as usize, v.round() as usize)].iter().map(|&c| u32::from(c)).sum::<u32>()
    };
    let (lit, shaded) = (brightness(Vec3::new(0.0, 0.8, 0.0)), brightness(Vec3::zeros()));
    // Three quarters of an sRGB value is half of the light.
    assert!(4 * shaded < 3 * lit, "shadow under the plate: {shaded} against {lit}");
    let sky = image[(48, 0)];
    assert!(sky[2] > sky[0] && sky[2] > 150, "{sky:?}");
}

#[test]
fn empty_scenes_and_images_are_fine() {
    let empty = Scene::default();
    let none = Intrinsics { width: 0, height: 0, ..camera() };
    assert_eq!(picture(&empty, &none, &Pose::identity(), &PictureStyle::default()).pixels().len(), 0);
    assert_eq!(
        picture(&empty, &camera(), &Pose::identity(), &PictureStyle::default()).pixels().len(),
        96 * 72
    );
    assert!(rendered(&empty).depth.pixels().iter().all(|&z| z == 0.0));
    assert!(fruit_views(&rendered(&empty), &empty, &camera(), &Pose::identity()).is_empty());
}

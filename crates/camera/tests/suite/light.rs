//! Tests the light of pictures.

use orchard_camera::picture::{PictureStyle, ShadowMaps, look_at, picture, sun_direction};
use orchard_camera::{Geometry, Label, Scene};
use orchard_geometry::{Image, Intrinsics, Pose, Shape, Vec3, inverse_transform};

/// A plate over ground, seen from the side.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.push(Geometry::Shape(Shape::HalfSpace), Pose::identity(), Label::Ground, 0);
    let plate = Shape::Box { half: Vec3::new(0.3, 0.3, 0.01) };
    scene.push(Geometry::Shape(plate), Pose::translation(0.0, 0.0, 1.0), Label::Robot, 0);
    let apple = Shape::Sphere { radius: 0.2 };
    scene.push(Geometry::Shape(apple), Pose::translation(0.0, 1.2, 0.8), Label::Fruit, 0);
    scene
}

fn view() -> (Intrinsics, Pose) {
    let k = Intrinsics::from_vertical_fov(96, 72, 75_f64.to_radians());
    (k, look_at(&Vec3::new(-3.0, 0.0, 1.6), &Vec3::new(0.0, 0.0, 0.7)))
}

fn style(sun_world: Vec3, sun_strength: f64, overcast: f64) -> PictureStyle {
    let shadows = ShadowMaps { sun: 512, sky: 96 };
    PictureStyle { sun_world, sun_strength, overcast, shadows, supersampling: 2, ..PictureStyle::default() }
}

fn drawn(style: &PictureStyle) -> Image<[u8; 3]> {
    let (k, x) = view();
    picture(&scene(), &k, &x, style)
}

fn luminance(pixel: &[u8; 3]) -> u32 {
    2126 * u32::from(pixel[0]) + 7152 * u32::from(pixel[1]) + 722 * u32::from(pixel[2])
}

/// Mean luminance of 5 x 5 pixels about a point of the world.
fn at(image: &Image<[u8; 3]>, p_world: Vec3) -> f64 {
    let (k, x) = view();
    let (u, v) = k.project(&inverse_transform(&x, &p_world)).unwrap();
    let (u, v) = (u.round() as usize, v.round() as usize);
    let around = (v - 2..=v + 2).flat_map(|v| (u - 2..=u + 2).map(move |u| (u, v)));
    around.map(|p| f64::from(luminance(&image[p]))).sum::<f64>() / 25.0
}

#[test]
fn no_pixel_gets_darker_as_the_sun_gets_stronger() {
    let sun = sun_direction(3.5, 0.8);
    for overcast in [0.0, 0.5] {
        let images = [0.0, 0.3, 1.0, 2.0, 4.0].map(|strength| drawn(&style(sun, strength, overcast)));
        for pair in images.windows(2) {
            let pixels = || pair[0].pixels().iter().zip(pair[1].pixels());
            assert!(pixels().all(|(weak, strong)| luminance(weak) <= luminance(strong)));
            assert!(pixels().any(|(weak, strong)| luminance(weak) < luminance(strong)));
        }
    }
}

#[test]
fn under_a_closed_sky_nothing_casts_a_shadow_and_the_sun_does_not_matter() {
    let (lit, shaded) = (Vec3::new(0.0, -1.0, 0.0), Vec3::zeros());
    let contrast = |image: &Image<[u8; 3]>| at(image, lit) / at(image, shaded);
    let clear = drawn(&style(Vec3::z(), 1.0, 0.0));
    let closed = drawn(&style(Vec3::z(), 1.0, 1.0));
    let half = drawn(&style(Vec3::z(), 1.0, 0.5));
    assert!(contrast(&clear) > contrast(&half) && contrast(&half) > contrast(&closed));
    // The plate still hides a part of the sky: a tenth of it, weighted by the cosine, is behind a square of 0.6 m at
    // 1 m, and a display value changes by less than its light.
    assert!(contrast(&closed) < 1.1, "{}", contrast(&closed));
    assert_eq!(closed, drawn(&style(sun_direction(1.0, 0.2), 3.0, 1.0)));
    // As bright all over as a cloud, and no brighter at the zenith.
    let sky = [closed[(5, 0)], closed[(90, 0)], closed[(48, 3)]];
    assert!(sky.iter().all(|pixel| *pixel == sky[0]), "{sky:?}");
    // The picture is not dark.
    assert!(at(&closed, lit) > 0.3 * at(&clear, lit));
}

#[test]
fn a_low_sun_is_redder_and_weaker() {
    let wall = Vec3::new(0.0, 1.2, 0.8) + sun_direction(std::f64::consts::PI, 0.3) * 0.2;
    let red = |elevation: f64| {
        let image = drawn(&style(sun_direction(std::f64::consts::PI, elevation), 1.0, 0.0));
        let (k, x) = view();
        let (u, v) = k.project(&inverse_transform(&x, &wall)).unwrap();
        let [r, _, b] = image[(u.round() as usize, v.round() as usize)];
        (f64::from(r) / f64::from(b.max(1)), at(&image, wall))
    };
    let (high, low) = (red(0.6), red(0.08));
    assert!(low.0 > high.0 && low.1 < high.1, "{high:?} {low:?}");
}

#[test]
fn figures_beyond_the_dials_are_taken_as_their_ends() {
    let sun = sun_direction(0.3, 0.7);
    assert_eq!(drawn(&style(sun, -3.0, 0.0)), drawn(&style(sun, 0.0, 0.0)));
    assert_eq!(drawn(&style(sun, 1.0, 7.0)), drawn(&style(sun, 1.0, 1.0)));
    for odd in [f64::NAN, f64::INFINITY] {
        drawn(&style(Vec3::repeat(odd), odd, odd));
    }
}

#[test]
fn the_sun_stands_in_the_given_direction() {
    let near = |a: Vec3, b: Vec3| (a - b).norm() < 1e-15;
    assert!(near(sun_direction(0.0, 0.0), Vec3::x()));
    assert!(near(sun_direction(std::f64::consts::FRAC_PI_2, 0.0), Vec3::y()));
    assert!(near(sun_direction(1.0, std::f64::consts::FRAC_PI_2), Vec3::z()));
}

//! Renders a depth image of an apple, half hidden by a leaf, before a trunk, and writes it as `depth.png`.

use std::sync::Arc;

use orchard_camera::picture::{depth_picture, look_at};
use orchard_camera::{Frame, Geometry, Label, Scene, blade::BladeMesh, fruit_views, render};
use orchard_geometry::{Intrinsics, Pose, Shape, Vec3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scene = Scene::default();
    let trunk = Geometry::Shape(Shape::Capsule { radius: 0.04, length: 2.0 });
    scene.push(trunk, Pose::translation(0.0, 0.3, 0.0), Label::Wood, 0);
    let apple = Geometry::Shape(Shape::Sphere { radius: 0.038 });
    scene.push(apple, Pose::translation(0.05, 0.0, 1.2), Label::Fruit, 0);
    let mesh = Arc::new(BladeMesh::new(0.35, 0.7));
    let leaf = Geometry::Blade { mesh, length: 0.09, width: 0.05 };
    scene.push(leaf, Pose::translation(0.0, -0.06, 1.21), Label::Leaf, 0);

    let camera = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let x_world_camera = look_at(&Vec3::new(0.0, -0.6, 1.3), &Vec3::new(0.0, 0.0, 1.2));
    let mut frame = Frame::new(camera.width, camera.height);
    let (near, far) = (0.3, 3.0);
    render(&scene, &camera, &x_world_camera, near, far, &mut frame);

    let valid = frame.depth.pixels().iter().filter(|&&depth| depth > 0.0).count();
    println!("{valid} of {} pixels have a depth", frame.depth.pixels().len());
    for fruit in fruit_views(&frame, &scene, &camera, &x_world_camera) {
        println!("fruit {}: {:.0} % visible", fruit.instance, 100.0 * fruit.visible_fraction());
    }

    let colours = depth_picture(&frame.depth, &[]);
    let file = std::io::BufWriter::new(std::fs::File::create("depth.png")?);
    let mut encoder = png::Encoder::new(file, colours.width() as u32, colours.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(colours.pixels().as_flattened())?;
    Ok(())
}

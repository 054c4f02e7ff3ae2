//! Turns a pixel with a depth into a point of the world and finds its distance from a shape.

use orchard_geometry::{DepthImage, Intrinsics, Pose, Shape, Vec3, inverse_transform, transform};

fn main() {
    let camera = Intrinsics::from_vertical_fov(640, 480, 58_f64.to_radians());
    let mut depth = DepthImage::filled(camera.width, camera.height, 0.0);
    depth[(400, 200)] = 1.25;

    // The optical frame has x right, y down, z forward: here it looks along the world's y axis from 1.2 m height.
    let quarter = std::f64::consts::FRAC_PI_2;
    let x_world_camera = Pose::new(Vec3::new(0.0, 0.0, 1.2), Vec3::new(-quarter, 0.0, 0.0));
    let p_camera = camera.ray(400.0, 200.0) * f64::from(depth[(400, 200)]);
    let p_world = transform(&x_world_camera, &p_camera);
    println!("p_camera {:.3?} m, p_world {:.3?} m", p_camera.as_slice(), p_world.as_slice());

    let trunk = Shape::Capsule { radius: 0.04, length: 2.0 };
    let x_world_trunk = Pose::translation(0.1, 1.3, 0.0);
    let distance = trunk.signed_distance(&inverse_transform(&x_world_trunk, &p_world));
    println!("{distance:.3} m outside the trunk's bark");
}

//! Depth images, the camera's figures and point clouds.

use foxglove::bytes::Bytes;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{CameraCalibration, PackedElementField, PointCloud, Pose, RawImage};
use orchard_geometry::{DepthImage, Intrinsics, Pose as Isometry};

use crate::clock::timestamp;
use crate::scene::message_pose;
use crate::transforms::CAMERA;

/// Bytes of a coordinate.
const FLOAT: u32 = size_of::<f32>() as u32;
/// Bytes of a pixel.
const PIXEL: u32 = size_of::<u16>() as u32;
/// Depth units of a metre: millimetres, as drivers of depth cameras give them (ROS Enhancement Proposal 118).
const PER_METRE: f32 = 1000.0;

/// A depth image: what the controller sees along the optical axis to the nearest millimetre, 0 without a measurement. Viewers stretch
/// colours over whole numbers, and take floats for brightness from 0 to 1.
pub fn image(taken: u64, depth: &DepthImage) -> RawImage {
    // A cast saturates, at 65 m.
    let data: Vec<u8> =
        depth.pixels().iter().flat_map(|d| ((d * PER_METRE).round() as u16).to_le_bytes()).collect();
    RawImage {
        timestamp: Some(timestamp(taken)),
        frame_id: CAMERA.to_owned(),
        width: depth.width() as u32,
        height: depth.height() as u32,
        encoding: "16UC1".to_owned(),
        step: depth.width() as u32 * PIXEL,
        data: Bytes::from(data),
    }
}

/// The camera: a pinhole without distortion.
pub fn calibration(taken: u64, camera: &Intrinsics) -> CameraCalibration {
    let Intrinsics { width, height, fx, fy, cx, cy } = *camera;
    CameraCalibration {
        timestamp: Some(timestamp(taken)),
        frame_id: CAMERA.to_owned(),
        width: width as u32,
        height: height as u32,
        distortion_model: String::new(),
        d: Vec::new(),
        k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
}

/// Points of every `stride`-th column and row that holds a measurement, in the camera's frame \[m\].
pub fn points(taken: u64, depth: &DepthImage, camera: &Intrinsics, stride: usize) -> PointCloud {
    let mut data = Vec::new();
    for v in (0..depth.height()).step_by(stride) {
        for u in (0..depth.width()).step_by(stride) {
            let measured = depth[(u, v)];
            if measured > 0.0 {
                let p = camera.back_project(u as f64, v as f64, f64::from(measured));
                data.extend(p.iter().flat_map(|x| (*x as f32).to_le_bytes()));
            }
        }
    }
    let field = |(i, name): (usize, &str)| PackedElementField {
        name: name.to_owned(),
        offset: i as u32 * FLOAT,
        r#type: NumericType::Float32.into(),
    };
    let identity: Pose = message_pose(&Isometry::identity());
    PointCloud {
        timestamp: Some(timestamp(taken)),
        frame_id: CAMERA.to_owned(),
        pose: Some(identity),
        point_stride: 3 * FLOAT,
        fields: ["x", "y", "z"].into_iter().enumerate().map(field).collect(),
        data: Bytes::from(data),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cloud_holds_the_measured_points_of_its_grid() {
        let camera = Intrinsics { width: 4, height: 3, fx: 2.0, fy: 2.0, cx: 1.5, cy: 1.0 };
        let mut depth = DepthImage::filled(4, 3, 0.0);
        depth[(0, 0)] = 2.0;
        depth[(1, 0)] = 9.0;
        depth[(2, 2)] = 1.0;
        let cloud = points(5, &depth, &camera, 2);
        let floats: Vec<f32> =
            cloud.data.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(floats, [-1.5, -1.0, 2.0, 0.25, 0.5, 1.0]);
        depth[(3, 0)] = 0.4567;
        depth[(0, 1)] = 70.0;
        let image = image(5, &depth);
        assert_eq!((image.step, image.data.len()), (8, 24));
        let millimetres: Vec<u16> =
            image.data.chunks_exact(2).map(|b| u16::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(millimetres, [2000, 9000, 0, 457, 65535, 0, 0, 0, 0, 0, 1000, 0]);
    }
}

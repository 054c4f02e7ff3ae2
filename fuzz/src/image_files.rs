//! The readers of depth images, masks, colour images, intrinsics, regions and detector configs: an error or something that can be used.

use orchard_exchange::regions::{self, OfImage, Shape};
use orchard_exchange::{colour_image, depth_image, depth_png, intrinsics};
use orchard_geometry::Image;
use orchard_perception::DetectorConfig;

use crate::edit::case;

/// One case.
pub fn run(bytes: &[u8]) {
    if let Ok(depth) = depth_png::read(bytes, depth_png::MILLIMETRE) {
        assert!(depth.pixels().iter().all(|z| z.is_finite() && *z >= 0.0));
        let again = depth_png::write(&depth, depth_png::MILLIMETRE).unwrap();
        assert_eq!(depth_png::read(&again, depth_png::MILLIMETRE).unwrap(), depth);
    }
    let _ = depth_png::read_mask(bytes);
    let _ = colour_image::read(bytes);
    for valid in [&[][..], NPY] {
        let Ok(raw) = depth_image::read(&case(valid, bytes)) else { continue };
        let (size, unit) = (raw.size(), raw.usual_unit());
        let depth = raw.depth(unit).unwrap();
        assert_eq!((depth.width(), depth.height()), size);
        assert!(depth.pixels().iter().all(|z| z.is_finite() && *z >= 0.0));
    }
    if let Ok(regions) = regions::read_labels(bytes, SIZE) {
        check(&regions);
    }
    for valid in [BOXES, MASKS] {
        let text = String::from_utf8_lossy(&case(valid, bytes)).into_owned();
        for shape in [Shape::Boxes, Shape::Masks] {
            let of = OfImage { size: SIZE, id: None, names: vec!["a".into()] };
            if let Ok(regions) = regions::read_coco(&text, shape, &of) {
                check(&regions);
            }
        }
    }
    for valid in [YAML, SCENE] {
        let text = String::from_utf8_lossy(&case(valid, bytes)).into_owned();
        let of = intrinsics::OfImage { size: Some(SIZE), number: Some(1) };
        if let Ok(camera) = intrinsics::read_camera(&text, &of) {
            let k = camera.intrinsics;
            assert_eq!(intrinsics::read(&intrinsics::write(&k)), Ok(k));
            if let Some(lens) = camera.lens.filter(|_| k.width * k.height <= 4096) {
                let _ = lens.undone(&Image::filled(k.width, k.height, 1_u8), &k, 0);
            }
        }
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(k) = intrinsics::read(text) {
        assert_eq!(intrinsics::read(&intrinsics::write(&k)), Ok(k));
    }
    let _ = DetectorConfig::from_toml("fuzz.toml", text);
}

/// Columns and rows of the image whose regions are read.
const SIZE: (usize, usize) = (4, 3);
const NPY: &[u8] = b"\x93NUMPY\x01\x00\x39\x00{'descr': '<u2', 'fortran_order': True, 'shape': (2, 3)}\n\x01\0\x02\0\x03\0\x04\0\x05\0\x06\0";
const BOXES: &[u8] = br#"{"images": [{"id": 1, "file_name": "a.png"}], "annotations": [{"image_id": 1, "bbox": [1, 0, 2, 2], "score": 0.5}]}"#;
const MASKS: &[u8] = br#"[{"image_id": 1, "segmentation": [[1, 0, 3, 0, 3, 2]]}, {"image_id": 1, "segmentation": {"size": [3, 4], "counts": "32103"}}]"#;
const YAML: &[u8] = b"height: 3\nwidth: 4\ndistortion_model: plumb_bob\nd: [-0.2, 0.05, 0.001, 0, 0]\nk:\n- 5.5\n- 0\n- 2\n- 0\n- 5.5\n- 1\n- 0\n- 0\n- 1\n";
const SCENE: &[u8] = br#"{"1": {"cam_K": [5.5, 0, 2, 0, 5.5, 1, 0, 0, 1], "depth_scale": 0.1}, "2": {}}"#;

/// A region lies within the image and has a pixel.
fn check(all: &[regions::Region]) {
    for region in all {
        assert!(
            region.left + region.inside.width() <= SIZE.0 && region.top + region.inside.height() <= SIZE.1
        );
        assert!(region.inside.pixels().contains(&true));
    }
}

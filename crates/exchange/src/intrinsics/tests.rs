use super::*;

const K: Intrinsics = Intrinsics { width: 640, height: 480, fx: 610.5, fy: 611.25, cx: 319.5, cy: 240.125 };

fn camera(text: &str) -> CameraFile {
    read_camera(text, &OfImage::default()).unwrap()
}

fn told(text: &str) -> String {
    read_camera(text, &OfImage::default()).unwrap_err().to_string()
}

#[test]
fn written_intrinsics_read_back() {
    assert_eq!(read(&write(&K)), Ok(K));
    assert_eq!(camera(&write(&K)), CameraFile { intrinsics: K, lens: None, unit: None });
}

#[test]
fn realsense_and_ros_forms_are_read() {
    let realsense = r#"{"width": 640, "height": 480, "ppx": 319.5, "ppy": 240.125, "fx": 610.5, "fy": 611.25,
        "model": "distortion.inverse_brown_conrady", "coeffs": [0.0, 0.0, 0.0, 0.0, 0.0]}"#;
    assert_eq!(read(realsense), Ok(K));
    for [k, d] in [["K", "D"], ["k", "d"]] {
        let ros = format!(
            r#"{{"header": {{"frame_id": "camera"}}, "height": 480, "width": 640, "distortion_model": "plumb_bob",
            "{d}": [0, 0, 0, 0, 0], "{k}": [610.5, 0, 319.5, 0, 611.25, 240.125, 0, 0, 1]}}"#
        );
        assert_eq!(read(&ros), Ok(K));
    }
}

/// As `camera_calibration_parsers` writes it.
const CALIBRATION: &str = "image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [610.5, 0., 319.5, 0., 611.25, 240.125, 0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.2, 0.05, 0.001, -0.002, 0.]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]
";

/// As `ros2 topic echo` prints a message.
const ECHO: &str = "header:
  stamp:
    sec: 1700000000
    nanosec: 5
  frame_id: camera
height: 480
width: 640
distortion_model: rational_polynomial
d:
- 0.5
- -2.6
- 0.0005
- -0.0002
- 1.5
- 0.4
- -2.4
- 1.4
k:
- 610.5
- 0.0
- 319.5
- 0.0
- 611.25
- 240.125
- 0.0
- 0.0
- 1.0
---
";

#[test]
fn ros_yaml_is_read_with_its_lens() {
    let lens = Lens::of_coefficients(&[-0.2, 0.05, 0.001, -0.002]);
    assert_eq!(camera(CALIBRATION), CameraFile { intrinsics: K, lens: Some(lens), unit: None });
    let lens = Lens::of_coefficients(&[0.5, -2.6, 0.0005, -0.0002, 1.5, 0.4, -2.4, 1.4]);
    assert_eq!(camera(ECHO), CameraFile { intrinsics: K, lens: Some(lens), unit: None });
    assert_eq!(read(ECHO), Err(IntrinsicsError::Distorted { value: 0.5 }));
}

#[test]
fn open3d_and_bop_forms_are_read() {
    let open3d = r#"{"width": 640, "height": 480, "intrinsic_matrix": [610.5, 0, 0, 0, 611.25, 0, 319.5, 240.125, 1]}"#;
    let parameters =
        format!(r#"{{"class_name": "PinholeCameraParameters", "extrinsic": [1], "intrinsic": {open3d}}}"#);
    assert_eq!((read(open3d), read(&parameters)), (Ok(K), Ok(K)));
    let bop = r#"{"cx": 319.5, "cy": 240.125, "depth_scale": 0.1, "fx": 610.5, "fy": 611.25, "height": 480, "width": 640}"#;
    assert_eq!(camera(bop), CameraFile { intrinsics: K, lens: None, unit: Some(0.1 / 1e3) });
    let entry = r#"{"cam_K": [610.5, 0, 319.5, 0, 611.25, 240.125, 0, 0, 1], "depth_scale": 1.0}"#;
    let other = entry.replace("610.5", "99");
    let scene = format!(r#"{{"0": {other}, "000007": {entry}}}"#);
    let of = |number, size| OfImage { number, size };
    let seventh = read_camera(&scene, &of(Some(7), Some((640, 480)))).unwrap();
    assert_eq!(seventh, CameraFile { intrinsics: K, lens: None, unit: Some(1e-3) });
    let one = format!(r#"{{"3": {entry}}}"#);
    assert_eq!(read_camera(&one, &of(None, Some((640, 480)))).unwrap().intrinsics, K);
    let error = |text: &str, of: OfImage| read_camera(text, &of).unwrap_err().to_string();
    assert_eq!(error(&scene, of(Some(5), None)), "has no image 5; it has 0, 7");
    assert_eq!(error(&scene, of(None, None)), "has no image -; it has 0, 7");
    assert_eq!(error(&one, of(None, None)), "width: is missing");
    assert!(error(&one.replace("610.5", "\"x\""), of(None, None)).starts_with("3.cam_K[0]: invalid type"));
}

#[test]
fn errors_name_the_field() {
    let text = write(&K);
    for (from, to, message) in [
        ("610.5", "-1.0", "fx is -1; the allowed range is (0, 10000000] px"),
        ("611.25", "0", "fy is 0; the allowed range is (0, 10000000] px"),
        ("319.5", "1e300", "cx is 1000"),
        ("640", "0", "width is 0; the allowed range is [1, 16384] px"),
        ("640", "-3", "width: invalid value: integer `-3`"),
        ("610.5", "\"wide\"", "fx: invalid type: string \"wide\""),
        ("\"fy\"", "\"f_y\"", "fy: is missing"),
        (
            "\"cx\"",
            "\"d\": [0.1, 0, 0, 0], \"model\": \"equidistant\", \"cx\"",
            "distortion of equidistant is not read",
        ),
        (
            "\"cx\"",
            "\"d\": [0, 0, 0, 0, 0, 0, 0, 0, 0.1], \"cx\"",
            "distortion of 9 coefficients is not read",
        ),
        ("\"cx\"", "\"ppx\": 3, \"cx\"", "duplicate field"),
        (
            "\"cx\"",
            "\"depth_scale\": 0, \"cx\"",
            "depth_scale is 0; the allowed range is [0.000001, 1000] mm",
        ),
        (
            "\"cx\"",
            "\"K\": [1, 0, 0, 0, 1, 0, 9, 9, 1], \"cx\"",
            "K: its last row is [9.0, 9.0, 1.0], not 0, 0, 1",
        ),
        ("}", "", "EOF while parsing"),
        ("}", "} x", "trailing characters at line"),
    ] {
        let bad = text.replacen(from, to, 1);
        let error = told(&bad);
        assert!(error.contains(message), "{error}");
    }
    let distorted = text.replacen("\"cx\"", "\"d\": [0.1], \"cx\"", 1);
    assert!(read(&distorted).unwrap_err().to_string().contains("distortion 0.1 is not zero"));
    let large = text.replacen("640", "16384", 1).replacen("480", "16384", 1);
    assert!(told(&large).contains("width x height is 268435456; the allowed range is [1, 100000000] px"));
    for (from, to, message) in [
        ("data: [610.5", "data: [610.5, 1.0", "camera_matrix.data: invalid length 10"),
        ("image_width: 640", "image_width: wide", "image_width: invalid type: string \"wide\""),
        ("plumb_bob", "fisheye", "distortion of fisheye is not read"),
        ("-0.2", ".nan", "distortion_coefficients.data[0]: invalid type"),
    ] {
        let error = told(&CALIBRATION.replacen(from, to, 1));
        assert!(error.contains(message), "{error}");
    }
    // Text that is neither JSON nor a mapping of YAML.
    assert!(told("fx = 3").starts_with(".: expected"));
}

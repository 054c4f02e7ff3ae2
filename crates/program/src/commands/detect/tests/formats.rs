//! Inputs in the forms of other tools, and the options that replace figures of the detector.

use super::*;
use orchard_geometry::DepthImage;
use serde_json::Value;

/// Folder with a depth image and its intrinsics.
struct Files {
    folder: tempfile::TempDir,
    k: Intrinsics,
    depth: DepthImage,
}

impl Files {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (k, depth, ..) = view(folder.path());
        Self { folder, k, depth }
    }

    fn at(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.folder.path().join(name), bytes).unwrap();
    }

    fn run(&self, depth: &str, intrinsics: &str, more: &str) -> Value {
        let out = self.at("found.json");
        let files = format!("--depth {} --intrinsics {}", self.at(depth), self.at(intrinsics));
        command(&format!("{files} --out {out} {more}")).unwrap();
        serde_json::from_str(&std::fs::read_to_string(out).unwrap()).unwrap()
    }
}

/// A `.npy` file of 32-bit numbers.
fn npy(depth: &DepthImage) -> Vec<u8> {
    let shape = format!("({}, {})", depth.height(), depth.width());
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    header.push_str(&" ".repeat((64 - (11 + header.len()) % 64) % 64));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(depth.pixels().iter().flat_map(|z| z.to_le_bytes()));
    bytes
}

#[test]
fn forms_of_other_tools_give_the_same_detections() {
    let files = Files::new();
    let expected = files.run("depth.png", "camera.json", "");
    let detections = expected["detections"].as_array().unwrap();
    assert!(detections.len() > 3);
    files.write("depth.npy", npy(&files.depth));
    let Intrinsics { width, height, fx, fy, cx, cy } = files.k;
    files.write(
        "info.yaml",
        format!(
            "image_width: {width}\nimage_height: {height}\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
             data: [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1]\ndistortion_model: plumb_bob\n"
        ),
    );
    files.write(
        "scene_camera.json",
        format!(r#"{{"0": {{"cam_K": [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1], "depth_scale": 1.0}}}}"#),
    );
    for (depth, intrinsics) in
        [("depth.npy", "camera.json"), ("depth.png", "info.yaml"), ("depth.png", "scene_camera.json")]
    {
        let found = files.run(depth, intrinsics, "");
        assert_eq!(found["detections"], expected["detections"], "{depth} {intrinsics}");
    }
    let image = &expected["image"];
    assert_eq!((&image["unit"], &image["width"]), (&Value::from(0.001), &Value::from(width)));
    let share = |name: &str| image[name].as_f64().unwrap();
    assert!((0.1..1.0).contains(&share("measured")) && (0.1..=1.0).contains(&share("in_range")), "{image}");
    assert!(image["warnings"].as_array().unwrap().is_empty());
    assert!(!image["refusals"].as_object().unwrap().is_empty());
}

#[test]
fn distortion_is_undone() {
    let files = Files::new();
    let straight = files.run("depth.png", "camera.json", "");
    let lens = std::fs::read_to_string(files.folder.path().join("camera.json")).unwrap();
    // So weak that no pixel moves by half a pixel.
    files.write("weak.json", lens.replacen('{', "{\"d\": [1e-6, 0, 0, 0, 0],", 1));
    let weak = files.run("depth.png", "weak.json", "");
    for (a, b) in
        straight["detections"].as_array().unwrap().iter().zip(weak["detections"].as_array().unwrap())
    {
        assert_eq!(a["p_camera"], b["p_camera"]);
        let moved = a["center_px"][0].as_f64().unwrap() - b["center_px"][0].as_f64().unwrap();
        assert!(moved.abs() < 1e-3);
    }
    files.write("strong.json", lens.replacen('{', "{\"d\": [0.1, 0, 0, 0, 0],", 1));
    assert_ne!(files.run("depth.png", "strong.json", "")["detections"], straight["detections"]);
    files.write("fish.json", lens.replacen('{', "{\"d\": [0.1], \"distortion_model\": \"equidistant\",", 1));
    let line = refused(&format!("--depth {} --intrinsics {}", files.at("depth.png"), files.at("fish.json")));
    assert!(line.contains("fish.json: distortion of equidistant is not read"), "{line}");
}

#[test]
fn range_and_radius_replace_the_detectors() {
    let files = Files::new();
    let numbers = |found: &Value, of: &dyn Fn(&Value) -> f64| -> Vec<f64> {
        found["detections"].as_array().unwrap().iter().map(of).collect()
    };
    let z = |d: &Value| d["p_camera"][2].as_f64().unwrap();
    let radius = |d: &Value| d["radius"].as_f64().unwrap();
    let all = files.run("depth.png", "camera.json", "");
    let (far, large) = (numbers(&all, &z), numbers(&all, &radius));
    assert!(far.iter().any(|z| *z > 1.0) && large.iter().any(|r| *r > 0.031), "{far:?} {large:?}");
    let near = files.run("depth.png", "camera.json", "--range 0.3,1.0");
    assert!(numbers(&near, &z).iter().all(|z| *z < 1.04));
    assert_eq!(near["image"]["range"], serde_json::json!([0.3, 1.0]));
    let small = files.run("depth.png", "camera.json", "--radius 0.02,0.031");
    assert!(numbers(&small, &radius).iter().all(|r| (0.02..=0.031).contains(r)));
    let words = ["detect", "--depth", "a", "--intrinsics", "b"];
    for bad in [["--range", "2,1"], ["--range", "1"], ["--radius", "x,y"], ["--radius", "0,inf"]] {
        assert!(Cli::try_parse_from(words.iter().chain(&bad)).is_err(), "{bad:?}");
    }
}

#[test]
fn a_wrong_unit_is_noticed() {
    let files = Files::new();
    for (unit, warning) in
        [("1", "beyond 30 m: is the unit (--unit 1, in metres) right?"), ("1e-6", "nearer than 0.05 m")]
    {
        let found = files.run("depth.png", "camera.json", &format!("--unit {unit}"));
        let warnings = found["image"]["warnings"].to_string();
        assert!(warnings.contains(warning), "{warnings}");
        assert!(found["detections"].as_array().unwrap().is_empty());
    }
}

#[test]
fn the_picture_may_be_the_colour_image() {
    let files = Files::new();
    let (width, height) = (files.k.width, files.k.height);
    let grey = orchard_geometry::Image::filled(width, height, [90, 90, 90]);
    files.write("colour.png", crate::picture_file::png(&grey).unwrap());
    let colour = files.at("colour.png");
    files.run("depth.png", "camera.json", &format!("--colour {colour} --picture {}", files.at("seen.png")));
    let seen = std::fs::read(files.at("seen.png")).unwrap();
    let seen = orchard_exchange::image_png::read_rgb(&seen).unwrap();
    assert_eq!((seen.width(), seen.height()), (3 * width, 3 * height));
    let kinds = |of: &dyn Fn(&[u8; 3]) -> bool| seen.pixels().iter().filter(|p| of(p)).count();
    assert!(kinds(&|p| *p == [90, 90, 90]) > seen.pixels().len() / 2);
    // Circles have the colour of their depth.
    assert!(kinds(&|p| p[0] > p[1].saturating_add(50)) > 100);
    let inputs = format!("--depth {} --intrinsics {}", files.at("depth.png"), files.at("camera.json"));
    let picture = format!("--picture {}", files.at("seen.png"));
    files.write(
        "small.png",
        crate::picture_file::png(&orchard_geometry::Image::filled(2, 2, [0; 3])).unwrap(),
    );
    let line = refused(&format!("{inputs} {picture} --colour {}", files.at("small.png")));
    assert!(line.contains("small.png: is 2 x 2, but --intrinsics"), "{line}");
    let line = refused(&format!("{inputs} {picture} --colour {}", files.at("camera.json")));
    assert!(line.contains("camera.json: is no PNG or JPEG file"), "{line}");
}

/// Images of every odd content and size: an answer, no panic.
#[test]
fn odd_images_have_an_answer() {
    let files = Files::new();
    for (width, height, value) in
        [(1, 1, 0.5_f32), (1, 1, f32::NAN), (1, 9, f32::INFINITY), (40, 30, -1.0), (40, 30, 0.7)]
    {
        let depth = DepthImage::filled(width, height, value);
        files.write("odd.npy", npy(&depth));
        files.write("odd.json", intrinsics::write(&Intrinsics::from_vertical_fov(width, height, 0.9)));
        for camera in ["paper", "azure-kinect", "d435i"] {
            let found = files.run(
                "odd.npy",
                "odd.json",
                &format!("--camera {camera} --picture {}", files.at("odd.png")),
            );
            assert!(found["detections"].as_array().unwrap().is_empty(), "{width} x {height} of {value}");
        }
    }
}

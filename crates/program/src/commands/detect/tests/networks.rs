//! A learned detector in front: `--onnx`. `red.onnx` was made with the package `onnx`: it takes 160 x 160 pixels and gives eight boxes of 18 px: three at
//! columns 80, 50 and 110 of row 80, whose scores are the mean red of 8 x 8 pixels there, and five of score 0.

use super::*;
use orchard_geometry::{DepthImage, Image};
use serde_json::{Value, json};

const RED: &[u8] = include_bytes!("red.onnx");

/// A ball of 36 mm in the middle of a depth image before a wall, and a colour image that is red there, blue and half red to its sides.
fn files(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    let k = Intrinsics { width: 320, height: 240, fx: 300.0, fy: 300.0, cx: 159.5, cy: 119.5 };
    let center = Vec3::new(0.0, 0.0, 0.6);
    let mut depth = DepthImage::filled(k.width, k.height, 1.2);
    let mut colour = Image::filled(k.width, k.height, [30, 90, 40]);
    for v in 0..k.height {
        for u in 0..k.width {
            let ray = k.ray(u as f64, v as f64);
            let along = ray.dot(&center) / ray.norm_squared();
            let off = (center - ray * along).norm_squared();
            if off < 0.036 * 0.036 {
                depth[(u, v)] = (along - (0.036 * 0.036 - off).sqrt() / ray.norm()) as f32;
                colour[(u, v)] = [255, 0, 0];
            }
            let beside = |at: f64| (u as f64 - at).abs() < 15.0 && (v as f64 - 120.0).abs() < 15.0;
            if beside(100.0) {
                colour[(u, v)] = [0, 0, 255];
            } else if beside(220.0) {
                colour[(u, v)] = [127, 0, 0];
            }
        }
    }
    write("depth.png", &depth_png::write(&depth, depth_png::MILLIMETRE).unwrap());
    write("colour.png", &crate::picture_file::png(&colour).unwrap());
    write("camera.json", intrinsics::write(&k).as_bytes());
    write("red.onnx", RED);
}

#[test]
fn a_network_says_where_and_the_fit_how_far() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    files(folder.path());
    let inputs = format!(
        "--depth {} --intrinsics {} --colour {}",
        at("depth.png"),
        at("camera.json"),
        at("colour.png")
    );
    let run = |more: &str| -> Value {
        command(&format!("{inputs} --onnx {} --out {} {more}", at("red.onnx"), at("found.json"))).unwrap();
        serde_json::from_str(&std::fs::read_to_string(at("found.json")).unwrap()).unwrap()
    };
    let found = run("");
    // The blue box is below the least score; the half red one has no ball.
    assert_eq!(found["regions"], json!({"given": 2, "with_sphere": 1}));
    let d = &found["detections"][0];
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(
        (number(&d["p_camera"][2]) - 0.6).abs() < 2e-3 && (number(&d["radius"]) - 0.036).abs() < 1e-3,
        "{d}"
    );
    assert_eq!((&d["score"], &d["region"]), (&json!(1.0), &json!(0)));
    assert_eq!(run("--least-score 0.6")["regions"], json!({"given": 1, "with_sphere": 1}));
    assert_eq!(run("--least-score 0")["regions"], json!({"given": 4, "with_sphere": 1}));
}

#[test]
fn what_is_no_detector_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    files(folder.path());
    std::fs::write(at("cut.onnx"), &RED[..RED.len() / 2]).unwrap();
    std::fs::write(at("reach.onnx"), include_bytes!("../../../../../../tests/network/reach.onnx")).unwrap();
    let inputs = format!(
        "--depth {} --intrinsics {} --colour {}",
        at("depth.png"),
        at("camera.json"),
        at("colour.png")
    );
    for (file, more, told) in [
        ("none.onnx", "", "none.onnx: No such file"),
        ("cut.onnx", "", "--onnx "),
        ("reach.onnx", "", "is needed"),
        ("red.onnx", "--least-score 2", "--least-score 2: the allowed range is [0, 1]"),
    ] {
        let line = refused(&format!("{inputs} --onnx {} {more}", at(file)));
        assert!(line.contains(told), "{line}");
    }
    for words in [
        &["detect", "--depth", "a", "--intrinsics", "b", "--onnx", "m"][..],
        &["detect", "--depth", "a", "--intrinsics", "b", "--onnx", "m", "--colour", "c", "--boxes", "x"],
        &["detect", "--depth", "a", "--intrinsics", "b", "--least-score", "0.5"],
    ] {
        assert!(Cli::try_parse_from(words).is_err(), "{words:?}");
    }
    let line = refused(&inputs);
    assert!(line.contains("--colour") && line.contains("needs --picture, --onnx or a detector"), "{line}");
}

use super::*;
use clap::Parser;
use orchard_camera::{Frame, Label, render};
use orchard_exchange::{depth_png, intrinsics};
use orchard_geometry::{Intrinsics, Vec3};
use orchard_perception::{DetectorConfig, detect, mask};
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Spec};
use orchard_tasks::protocol::Protocol;
use orchard_tasks::vantage::vantages;
use orchard_world::World;
use std::path::Path;
use std::sync::Arc;

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    args: Args,
}

/// Runs the command; options are separated by blanks.
pub(super) fn command(options: &str) -> Result<(), Failure> {
    let words = std::iter::once("detect").chain(options.split_whitespace());
    run(&Cli::try_parse_from(words).unwrap().args)
}

pub(super) fn refused(options: &str) -> String {
    match command(options) {
        Err(Failure::BadInput(line)) => line,
        other => panic!("{options}: {other:?}"),
    }
}

/// Files of one view of a world, and their content.
pub(super) fn view(folder: &Path) -> (Intrinsics, orchard_geometry::DepthImage, Vec3, f64) {
    let spec = Arc::new(Spec::preset(Preset::Paper));
    let world = World::new(spec, Arc::new(RobotModel::paper()), 20250704, 0).unwrap();
    let mut scene = world.scene();
    scene.items.retain(|item| item.label != Label::Robot);
    let x = vantages(&Protocol::paper().detect.vantage, &scene, 20250704, 0, 1)[0];
    let k = Intrinsics::from_vertical_fov(320, 240, 1.0);
    let mut frame = Frame::new(k.width, k.height);
    render(&scene, &k, &x, 0.3, 3.0, &mut frame);
    let bytes = depth_png::write(&frame.depth, depth_png::MILLIMETRE).unwrap();
    std::fs::write(folder.join("depth.png"), &bytes).unwrap();
    std::fs::write(folder.join("camera.json"), intrinsics::write(&k)).unwrap();
    let quantised = depth_png::read(&bytes, depth_png::MILLIMETRE).unwrap();
    (k, quantised, x.rotation.inverse() * Vec3::z(), x.translation.z)
}

#[test]
fn a_file_gives_what_the_detector_gives() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (k, depth, up, height) = view(folder.path());
    let config = DetectorConfig::paper();
    let ground = mask::ground_mask(&depth, &k, &up, height, config.mask.ground_margin.si());
    let mut expected = detect(&depth, &k, Some(&ground), &config).unwrap();
    expected.sort_by(|a, b| b.score.total_cmp(&a.score));
    assert!(expected.len() > 3, "{expected:?}");
    command(&format!(
        "--depth {} --intrinsics {} --camera-height {height} --up {},{},{} --all --picture {} --out {}",
        at("depth.png"),
        at("camera.json"),
        up.x,
        up.y,
        up.z,
        at("seen.png"),
        at("found.json"),
    ))
    .unwrap();
    let text = std::fs::read_to_string(folder.path().join("found.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let found = json["detections"].as_array().unwrap();
    assert_eq!(found.len(), expected.len());
    for (json, d) in found.iter().zip(&expected) {
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        // The vertical is made a unit vector again, which may move a ground pixel's height by 1e-16 m and no fruit.
        assert_eq!([0, 1, 2].map(|i| number(&json["p_camera"][i])), <[f64; 3]>::from(d.p_camera));
        assert_eq!((number(&json["radius"]), number(&json["rms"])), (d.radius, d.rms));
        assert_eq!((number(&json["center_px"][0]), number(&json["center_px"][1])), d.center_px);
        assert_eq!(json["pixels"].as_u64(), Some(u64::from(d.pixels)));
        assert_eq!((number(&json["score"]), number(&json["visible"])), (d.score, d.visible));
    }
    let refused = json["refused"].as_array().unwrap();
    assert!(!refused.is_empty() && refused.iter().all(|sphere| sphere["gate"].is_string()));
    let picture = std::fs::read(folder.path().join("seen.png")).unwrap();
    let reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (960, 720));
}

#[test]
fn a_camera_brings_its_detector() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    view(folder.path());
    let files = format!("--depth {} --intrinsics {}", at("depth.png"), at("camera.json"));
    std::fs::write(at("boxes.json"), r#"[{"image_id": 1, "bbox": [10, 10, 20, 20], "score": 0.9}]"#).unwrap();
    let boxes = format!("d435i --boxes {}", at("boxes.json"));
    for (camera, detector) in
        [("azure-kinect", "learned"), ("d435i", "learned"), (&boxes, "d435i"), ("ideal", "paper")]
    {
        command(&format!("{files} --camera {camera} --out {}", at("found.json"))).unwrap();
        let text = std::fs::read_to_string(folder.path().join("found.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["config"], detector);
    }
    let line = refused(&format!("{files} --camera kinect"));
    assert!(
        line.starts_with("--camera kinect: no camera 'kinect'") && line.contains("azure-kinect"),
        "{line}"
    );
    let line = refused(&format!("{files} --camera ideal --detector paper"));
    assert!(line.starts_with("--camera ideal and --detector paper: give one of the two"), "{line}");
    command(&format!("{files} --camera d435i --detector learned --out {}", at("found.json"))).unwrap();
    let text = std::fs::read_to_string(folder.path().join("found.json")).unwrap();
    assert!(text.contains("\"config\": \"learned\""), "{text}");
}

/// A detector that looks at colour needs --colour, and takes the figures of --camera; so does a file that is based on it.
#[test]
fn a_detector_of_colour_needs_the_colour_image() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (k, ..) = view(folder.path());
    let grey = orchard_geometry::Image::filled(k.width, k.height, [90; 3]);
    std::fs::write(at("colour.png"), orchard_exchange::image_png::write_rgb(&grey).unwrap()).unwrap();
    let files = format!("--depth {} --intrinsics {} --camera d435i", at("depth.png"), at("camera.json"));
    let line = refused(&format!("{files} --detector learned-colour"));
    assert_eq!(line, "--detector learned-colour: it looks at colour; --colour IMAGE is needed");
    let line = refused(&format!("{files} --detector learned --colour {}", at("colour.png")));
    assert!(line.ends_with("needs --picture, --onnx or a detector that sees colour"), "{line}");
    std::fs::write(at("mine.toml"), "base = \"learned-colour\"\n[network]\nleast = { value = 0.1, range = [0.0, 1.0], unit = \"1\", source = \"detector\" }\n").unwrap();
    for detector in ["learned-colour".to_owned(), at("mine.toml")] {
        let colour = at("colour.png");
        command(&format!("{files} --detector {detector} --colour {colour} --out {}", at("found.json")))
            .unwrap();
    }
    // The default of a camera sees colour if there is some; not so where another detector says where fruit are.
    let boxes = r#"[{"image_id": 1, "category_id": 1, "bbox": [1, 1, 9, 9], "score": 0.5}]"#;
    std::fs::write(at("boxes.json"), boxes).unwrap();
    let with_boxes = format!("--boxes {} --picture {}", at("boxes.json"), at("seen.png"));
    for (more, detector) in [("", "learned-colour"), (with_boxes.as_str(), "d435i")] {
        let (colour, out) = (at("colour.png"), at("found.json"));
        command(&format!("{files} --colour {colour} {more} --out {out}")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(out).unwrap()).unwrap();
        assert_eq!(json["config"], detector);
    }
}

#[test]
fn what_cannot_be_used_is_told_with_file_field_and_range() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    let image = |width, height| {
        let depth = orchard_geometry::DepthImage::filled(width, height, 0.5);
        depth_png::write(&depth, depth_png::MILLIMETRE).unwrap()
    };
    let good = image(8, 6);
    let k = intrinsics::write(&Intrinsics::from_vertical_fov(8, 6, 1.0));
    write("depth.png", &good);
    write("short.png", &good[..good.len() / 2]);
    write("text.png", b"no picture");
    write("wide.png", &image(9, 6));
    write("camera.json", k.as_bytes());
    write("flat.json", k.replacen("\"fx\": ", "\"fx\": -", 1).as_bytes());
    write("text.json", b"fx = 3");
    write("latin.json", b"\xff");
    write("gate.toml", b"base = \"paper\"\n[gates]\nradius = 3\n");
    let mut eight = Vec::new();
    let encoder = png::Encoder::new(&mut eight, 8, 6);
    encoder.write_header().unwrap().write_image_data(&[1; 48]).unwrap();
    write("eight.png", &eight);
    let with = |depth: &str, camera: &str, more: &str| {
        refused(&format!("--depth {} --intrinsics {} {more}", at(depth), at(camera)))
    };
    assert!(command(&format!("--depth {} --intrinsics {}", at("depth.png"), at("camera.json"))).is_ok());
    for (depth, camera, more, told) in [
        ("none.png", "camera.json", "", "none.png: No such file"),
        ("short.png", "camera.json", "", "short.png: cannot be read as PNG"),
        ("text.png", "camera.json", "", "text.png: is no PNG, TIFF, .npy or .npz file by its first bytes"),
        (
            "eight.png",
            "camera.json",
            "",
            "eight.png: is a PNG of grayscale of 8 bits; grey of 16 bits is needed",
        ),
        ("wide.png", "camera.json", "", "wide.png: is 9 x 6, but --intrinsics"),
        ("depth.png", "none.json", "", "none.json: No such file"),
        ("depth.png", "flat.json", "", "flat.json: fx is -5.49"),
        ("depth.png", "text.json", "", "text.json: .: expected"),
        ("depth.png", "latin.json", "", "latin.json: is not text in UTF-8"),
        ("depth.png", "camera.json", "--unit 0", "--unit 0: the allowed range is [0.000000001, 1] m"),
        ("depth.png", "camera.json", "--unit NaN", "--unit NaN: the allowed range"),
        (
            "depth.png",
            "camera.json",
            "--range 0.5,1000",
            "--range 0.5,1000 [m]: 1000 is outside the allowed range",
        ),
        (
            "depth.png",
            "camera.json",
            "--radius -1,0.05",
            "--radius -1,0.05 [m]: -1000 is outside the allowed range",
        ),
        ("depth.png", "camera.json", "--image-id 3", "--image-id 3: needs --boxes or --masks"),
        ("depth.png", "camera.json", "--boxes none.json", "--boxes none.json: No such file"),
        ("depth.png", "camera.json", "--camera-height 1e9", "--camera-height 1000000000: the allowed range"),
        ("depth.png", "camera.json", "--config d415", "--detector: no detector 'd415'"),
        ("depth.png", "camera.json", "--config none.toml", "--detector none.toml: No such file"),
        ("depth.png", "camera.json", "--out /", "--out /"),
        (
            "depth.png",
            "camera.json",
            "--picture /nowhere/x.png",
            "--picture /nowhere/x.png: there is no folder",
        ),
    ] {
        let line = with(depth, camera, more);
        assert!(line.contains(told), "{line}");
    }
    let line = with("depth.png", "camera.json", &format!("--config {}", at("gate.toml")));
    assert!(line.contains("gate.toml: gates.radius"), "{line}");
    let line = with("depth.png", "camera.json", &format!("--mask {}", at("depth.png")));
    assert!(line.contains("grey of 1 or 8 bits is needed"), "{line}");
    let words = ["detect", "--depth", "a", "--intrinsics", "b", "--camera-height", "1", "--up"];
    for bad in ["0,0,0", "1,2", "x,y,z", "NaN,0,1"] {
        assert!(Cli::try_parse_from(words.iter().chain(&[bad])).is_err(), "{bad}");
    }
}

#[cfg(feature = "recording")]
mod bags;
mod formats;
mod in_regions;
mod networks;

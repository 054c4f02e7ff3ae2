//! Bags of ROS 2. `two_images.mcap` was written by the package `mcap-ros2-support`: a ball of radius 36 mm at (0.02, -0.01, 0.6), and in the
//! second image another one of 40 mm at (-0.12, 0.05, 0.7), before a wall. `colour_images.mcap` was written by `write_colour_images.py`, which
//! tells its content.

use super::*;
use orchard_recording::bag::{Bag, BagMessage, Topics};

const TWO_IMAGES: &[u8] = include_bytes!("two_images.mcap");
const TOPIC: &str = "/camera/depth/image_rect_raw";

#[test]
fn detections_of_a_bag_are_a_bag() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("two.mcap"), TWO_IMAGES).unwrap();
    command(&format!("--mcap {} --topic {TOPIC} --out {}", at("two.mcap"), at("found.mcap"))).unwrap();
    let found = std::fs::read(at("found.mcap")).unwrap();
    assert!(found.starts_with(b"\x89MCAP0\r\n"));
    // The same bytes again.
    command(&format!("--mcap {} --topic {TOPIC} --out {}", at("two.mcap"), at("again.mcap"))).unwrap();
    assert_eq!(std::fs::read(at("again.mcap")).unwrap(), found);
    // The images as files give the same detections, one and two.
    let mut bag = Bag::open(
        Path::new(&at("two.mcap")),
        &Topics { depth: TOPIC.into(), info: "/camera/depth/camera_info".into(), colour: None },
    )
    .unwrap();
    let mut counts = Vec::new();
    while let Some((_, message)) = bag.next_message().unwrap() {
        let BagMessage::Image(image) = message else { continue };
        let depth = image.depth(image.usual_unit());
        let k = Intrinsics { width: 160, height: 120, fx: 130.0, fy: 130.0, cx: 79.5, cy: 59.5 };
        let balls = detect(&depth, &k, None, &DetectorConfig::paper()).unwrap();
        assert!((balls[0].p_camera - Vec3::new(0.02, -0.01, 0.6)).norm() < 2e-3, "{balls:?}");
        counts.push(balls.len());
    }
    assert_eq!(counts, [1, 2]);
}

#[test]
fn bad_bags_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("two.mcap"), TWO_IMAGES).unwrap();
    std::fs::write(at("cut.mcap"), &TWO_IMAGES[..TWO_IMAGES.len() / 2]).unwrap();
    std::fs::write(at("text.mcap"), "no bag, but a text that is longer than the magic bytes").unwrap();
    let out = format!("--out {}", at("found.mcap"));
    for (file, more, told) in [
        ("none.mcap", format!("--topic {TOPIC} {out}"), "none.mcap: No such file"),
        ("text.mcap", format!("--topic {TOPIC} {out}"), "text.mcap: not an MCAP file"),
        ("cut.mcap", format!("--topic {TOPIC} {out}"), "cut.mcap: the file is cut off or damaged"),
        ("two.mcap", format!("--topic /camera/depth/image {out}"), "--topic /camera/depth/image: "),
        ("two.mcap", format!("--topic /a/b {out}"), "--info-topic /a/camera_info: "),
        (
            "two.mcap",
            format!("--topic /camera/depth/camera_info {out}"),
            "holds sensor_msgs/msg/CameraInfo in cdr; sensor_msgs/msg/Image or sensor_msgs/msg/CompressedImage in cdr is needed",
        ),
        (
            "two.mcap",
            format!("--topic {TOPIC} --out {}", at("found.json")),
            "a name that ends in .mcap is needed",
        ),
        ("two.mcap", format!("--topic {TOPIC} {out} --unit 0"), "--unit 0: the allowed range"),
    ] {
        let line = refused(&format!("--mcap {} {more}", at(file)));
        assert!(line.contains(told), "{line}");
    }
    assert!(!Path::new(&at("found.mcap")).exists());
    let line = refused("--topic /t --depth a --intrinsics b");
    assert_eq!(line, "--topic /t: needs --mcap");
    for words in [
        &["detect", "--mcap", "a.mcap"][..],
        &["detect", "--mcap", "a.mcap", "--topic", "t", "--depth", "a", "--intrinsics", "b"],
        &["detect", "--mcap", "a.mcap", "--topic", "t", "--boxes", "b"],
        &["detect", "--depth", "a"],
        &["detect", "--mcap", "a.mcap", "--topic", "t", "--onnx", "m"],
        &["detect", "--mcap", "a.mcap", "--topic", "t", "--colour-within", "0.1"],
    ] {
        assert!(Cli::try_parse_from(words).is_err(), "{words:?}");
    }
}

const COLOUR_IMAGES: &[u8] = include_bytes!("colour_images.mcap");
const DEPTH: &str = "/camera/depth/image";
const COLOUR: &str = "/camera/color/image";

/// Raw and packed images are the same ones; so are those of a colour that only looks the same to the network within its error.
#[test]
fn colour_of_a_bag_is_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("bag.mcap"), COLOUR_IMAGES).unwrap();
    std::fs::write(at("red.onnx"), include_bytes!("red.onnx")).unwrap();
    let found = |depth: &str, colour: &str, more: &str| {
        let topics = format!("--topic {DEPTH}{depth} --colour-topic {COLOUR}{colour}");
        command(&format!("--mcap {} {topics} {more} --out {}", at("bag.mcap"), at("found.mcap"))).unwrap();
        std::fs::read(at("found.mcap")).unwrap()
    };
    let onnx = format!("--onnx {}", at("red.onnx"));
    for more in ["--camera d435i --detector learned-colour", &onnx] {
        let raw = found("", "", more);
        assert_eq!(found("/compressedDepth", "/png/compressed", more), raw, "{more}");
        // The third depth image has a colour image within 0.1 s.
        assert!(found("", "", &format!("{more} --colour-within 0.1")).len() > raw.len());
        assert_ne!(found("_inverse/compressedDepth", "/jpeg/compressed", more), raw, "{more}");
    }
}

#[test]
fn bad_colour_of_bags_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("bag.mcap"), COLOUR_IMAGES).unwrap();
    let detector = "--camera d435i --detector learned-colour";
    for (topics, told) in [
        (
            format!("--topic {DEPTH} {detector}"),
            "--detector learned-colour with --mcap: it looks at colour; --colour-topic NAME is needed",
        ),
        (
            format!("--topic {DEPTH} --colour-topic {COLOUR}"),
            "image: needs --onnx or a detector that sees colour",
        ),
        (
            format!("--topic {DEPTH} --colour-topic {DEPTH} {detector}"),
            "it is the topic of the depth images or intrinsics",
        ),
        (format!("--topic {DEPTH} --colour-topic /none {detector}"), "--colour-topic /none: "),
        (
            format!("--topic {DEPTH} --colour-topic {COLOUR} --colour-within -1 {detector}"),
            "--colour-within -1: the allowed range is [0, 10] s",
        ),
        (
            format!("--topic {DEPTH} --colour-topic {COLOUR} --colour-within 0.003 {detector}"),
            "no image on /camera/depth/image has a colour image on /camera/color/image within 0.003 s (--colour-within)",
        ),
        (
            format!("--topic {DEPTH} --colour-topic /camera/color/small {detector}"),
            "bag.mcap: topic /camera/color/small, image of stamp 10.000000000 s: is 2 x 1, its depth image is 160 x 120; \
             colour must be registered to depth and of its size",
        ),
        (
            format!("--topic {COLOUR}/jpeg/compressed --info-topic /camera/depth/camera_info"),
            "image of stamp 10.004000000 s: is a compressed image of format \"bgr8; jpeg compressed bgr8\"; a PNG is needed",
        ),
        (
            format!("--topic {DEPTH} --colour-topic {DEPTH}/compressedDepth {detector}"),
            "a compressed image of format \"16UC1; compressedDepth png\" is no PNG or JPEG file by its first bytes",
        ),
        (
            format!("--topic {DEPTH} --onnx none.onnx --colour-topic {COLOUR}"),
            "--onnx none.onnx: No such file",
        ),
    ] {
        let line = refused(&format!("--mcap {} {topics} --out {}", at("bag.mcap"), at("found.mcap")));
        assert!(line.contains(told), "{line}");
    }
    assert!(!Path::new(&at("found.mcap")).exists());
    let words = ["detect", "--depth", "a", "--intrinsics", "b", "--colour-topic", "/c"];
    assert!(Cli::try_parse_from(words).is_err());
    let line = refused("--topic /t --colour-topic /c --depth a --intrinsics b");
    assert_eq!(line, "--topic /t: needs --mcap");
}

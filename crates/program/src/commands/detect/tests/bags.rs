//! Bags of ROS 2. `two_images.mcap` was written by the package `mcap-ros2-support`: a ball of radius 36 mm at (0.02, -0.01, 0.6), and in the
//! second image another one of 40 mm at (-0.12, 0.05, 0.7), before a wall.

use super::*;
use orchard_recording::bag::{Bag, BagMessage};

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
    let mut bag = Bag::open(Path::new(&at("two.mcap")), TOPIC, "/camera/depth/camera_info").unwrap();
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
            "holds sensor_msgs/msg/CameraInfo in cdr; sensor_msgs/msg/Image in cdr is needed",
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
    ] {
        assert!(Cli::try_parse_from(words).is_err(), "{words:?}");
    }
}

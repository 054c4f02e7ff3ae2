//! Spheres in what another detector found: `--boxes` and `--masks`.

use super::*;
use orchard_exchange::image_png;
use orchard_geometry::Image;
use serde_json::{Value, json};

fn read(path: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn spheres_are_fitted_in_boxes_and_masks_alone() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (k, ..) = view(folder.path());
    let files =
        format!("--depth {} --intrinsics {} --out {}", at("depth.png"), at("camera.json"), at("found.json"));
    command(&files).unwrap();
    let whole = read(&at("found.json"));
    let whole = whole["detections"].as_array().unwrap();
    assert!(whole.len() > 3);
    // The learned detector found two of the fruit, and one in the corner where there is none.
    let square = |d: &Value| {
        let number = |value: &Value| value.as_f64().unwrap();
        let half = k.fx * number(&d["radius"]) / number(&d["p_camera"][2]);
        [
            number(&d["center_px"][0]) + 0.5 - half,
            number(&d["center_px"][1]) + 0.5 - half,
            2.0 * half,
            2.0 * half,
        ]
    };
    let [first, second] = [square(&whole[0]), square(&whole[1])];
    let results = json!([
        {"image_id": 5, "category_id": 1, "bbox": first, "score": 0.25},
        {"image_id": 5, "category_id": 1, "bbox": [0, 0, 6, 6], "score": 0.99},
        {"image_id": 5, "category_id": 1, "bbox": second, "score": 0.75},
    ]);
    std::fs::write(at("boxes.json"), results.to_string()).unwrap();
    command(&format!("{files} --boxes {}", at("boxes.json"))).unwrap();
    let found = read(&at("found.json"));
    assert_eq!(found["regions"], json!({"given": 3, "with_sphere": 2}));
    let detections = found["detections"].as_array().unwrap();
    // Sorted by the learned detector's score, which is kept.
    for (d, (whole, region, score)) in detections.iter().zip([(&whole[1], 2, 0.75), (&whole[0], 0, 0.25)]) {
        assert_eq!((&d["region"], &d["score"]), (&json!(region), &json!(score)));
        let off = |i: usize| d["p_camera"][i].as_f64().unwrap() - whole["p_camera"][i].as_f64().unwrap();
        assert!((0..3).all(|i| off(i).abs() < 2e-3), "{d} {whole}");
        assert!(d["fit_score"].is_f64() && d["gate"].is_null(), "{d}");
    }
    // The same fruit as labels.
    let mut labels = Image::filled(k.width, k.height, 0_u8);
    for (label, [x, y, w, h]) in [(3, first), (8, second)] {
        for v in y.max(0.0) as usize..((y + h) as usize).min(k.height) {
            for u in x.max(0.0) as usize..((x + w) as usize).min(k.width) {
                labels[(u, v)] = label;
            }
        }
    }
    std::fs::write(at("labels.png"), image_png::write_grey8(&labels).unwrap()).unwrap();
    command(&format!("{files} --masks {}", at("labels.png"))).unwrap();
    let found = read(&at("found.json"));
    let found = found["detections"].as_array().unwrap();
    assert_eq!(found.len(), 2);
    // Without a score in the file it is that of the fit.
    assert!(found.iter().all(|d| d["score"] == d["fit_score"]));
}

#[test]
fn bad_regions_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    view(folder.path());
    let files = format!("--depth {} --intrinsics {}", at("depth.png"), at("camera.json"));
    let two = json!([{"image_id": 1, "bbox": [0, 0, 9, 9]}, {"image_id": 2, "bbox": [9, 9, 9, 9]}]);
    std::fs::write(at("two.json"), two.to_string()).unwrap();
    std::fs::write(at("bad.json"), r#"[{"bbox": [0, 0, 9]}]"#).unwrap();
    std::fs::write(at("small.png"), image_png::write_grey8(&Image::filled(3, 2, 1)).unwrap()).unwrap();
    std::fs::write(at("latin.json"), b"\xff").unwrap();
    for (option, file, more, told) in [
        (
            "--boxes",
            "two.json",
            "",
            "two.json: has regions of 2 images, and none of them is known to be this one",
        ),
        ("--boxes", "two.json", "--image-id 3", "has regions of 2 images"),
        ("--boxes", "bad.json", "", "bad.json: [0].bbox: [0,0,9] is not [left, top, width, height]"),
        ("--boxes", "small.png", "", "small.png: is not text in UTF-8"),
        ("--masks", "bad.json", "", "bad.json: [0].segmentation: is missing"),
        ("--masks", "small.png", "", "small.png: is (3, 2) px, the depth image (320, 240)"),
        ("--masks", "latin.json", "", "latin.json: is not text in UTF-8"),
        ("--masks", "none.json", "", "none.json: No such file"),
    ] {
        let line = refused(&format!("{files} {option} {} {more}", at(file)));
        assert!(line.starts_with(option) && line.contains(told), "{line}");
    }
    assert!(command(&format!("{files} --boxes {} --image-id 2", at("two.json"))).is_ok());
    let both = ["detect", "--depth", "x", "--intrinsics", "y", "--boxes", "a", "--masks", "b"];
    assert!(Cli::try_parse_from(both).is_err());
}

use super::*;
use crate::image_png::{write_grey8, write_grey16};

const SIZE: (usize, usize) = (4, 3);

fn of(id: Option<u64>, name: &str) -> OfImage {
    OfImage { size: SIZE, id, names: vec![name.to_owned()] }
}

fn boxes(text: &str) -> Vec<Region> {
    read_coco(text, Shape::Boxes, &of(None, "x")).unwrap()
}

fn masks(segmentation: &str) -> Vec<Region> {
    read_coco(&format!(r#"[{{"segmentation": {segmentation}}}]"#), Shape::Masks, &of(None, "x")).unwrap()
}

fn told(text: &str, shape: Shape) -> String {
    read_coco(text, shape, &of(None, "x")).unwrap_err().to_string()
}

/// Pixels of the whole image, row by row.
fn drawn(region: &Region) -> String {
    let inside = |u: usize, v: usize| {
        let at = u.checked_sub(region.left).zip(v.checked_sub(region.top));
        at.is_some_and(|(u, v)| {
            u < region.inside.width() && v < region.inside.height() && region.inside[(u, v)]
        })
    };
    let row = |v| (0..SIZE.0).map(|u| if inside(u, v) { '#' } else { '.' }).collect::<String>();
    (0..SIZE.1).map(row).collect::<Vec<_>>().join("/")
}

#[test]
fn boxes_hold_the_pixels_whose_centres_they_hold() {
    let results = r#"[{"image_id": 7, "bbox": [1, 0, 2, 2], "score": 0.75}, {"image_id": 7, "bbox": [-5.0, 1.6, 6.4, 99]}]"#;
    let found = boxes(results);
    assert_eq!((drawn(&found[0]), found[0].score), (".##./.##./....".to_owned(), Some(0.75)));
    assert_eq!((drawn(&found[1]), found[1].score), ("..../..../#...".to_owned(), None));
    assert_eq!(boxes("[]"), []);
}

#[test]
fn masks_are_polygons_runs_and_packed_runs() {
    assert_eq!(drawn(&masks("[[1, 0, 3, 0, 3, 2, 1, 2]]")[0]), ".##./.##./....");
    // Two polygons are one mask.
    assert_eq!(drawn(&masks("[[0, 0, 1, 0, 1, 1, 0, 1], [3, 2, 4, 2, 4, 3, 3, 3]]")[0]), "#.../..../...#");
    let runs = r#"{"size": [3, 4], "counts": [3, 2, 1, 2, 4]}"#;
    assert_eq!(drawn(&masks(runs)[0]), ".##./.##./....");
    // Packed by pycocotools: maskUtils.encode of the same mask.
    assert_eq!(drawn(&masks(r#"{"size": [3, 4], "counts": "32103"}"#)[0]), ".##./.##./....");
    // A disc of 1245 pixels, whose later runs are differences.
    let packed = r#"[{"segmentation": {"size": [60, 80], "counts": "TX1=]14L4M2M4M2N2O0O2N2O0O2O0O2O000000000000000000000001N101N101N2N101N2N3L3N3L4LjT1"}}]"#;
    let disc =
        &read_coco(packed, Shape::Masks, &OfImage { size: (80, 60), ..OfImage::default() }).unwrap()[0];
    let inside =
        |u: i64, v: i64| (u + disc.left as i64 - 40).pow(2) + (v + disc.top as i64 - 30).pow(2) < 400;
    let places = (0..disc.inside.width()).flat_map(|u| (0..disc.inside.height()).map(move |v| (u, v)));
    assert!(places.clone().all(|(u, v)| disc.inside[(u, v)] == inside(u as i64, v as i64)));
    assert_eq!(places.filter(|at| disc.inside[*at]).count(), 1245);
    assert_eq!(drawn(&masks(r#"{"size": [3, 4], "counts": [0, 12]}"#)[0]), "####/####/####");
}

#[test]
fn labels_are_regions() {
    let labels = Image::from_pixels(4, 3, vec![0, 2, 2, 0, 1, 2, 2, 0, 1, 0, 0, 9]).unwrap();
    let expected = ["..../#.../#...", ".##./.##./....", "..../..../...#"];
    let eight = read_labels(&write_grey8(&labels).unwrap(), SIZE).unwrap();
    assert_eq!(eight.iter().map(drawn).collect::<Vec<_>>(), expected);
    let wide: Vec<u16> = labels.pixels().iter().map(|&label| 1000 * u16::from(label)).collect();
    let wide = Image::from_pixels(4, 3, wide).unwrap();
    assert_eq!(read_labels(&write_grey16(&wide).unwrap(), SIZE).unwrap(), eight);
    let error = read_labels(&write_grey8(&labels).unwrap(), (5, 3)).unwrap_err().to_string();
    assert_eq!(error, "is (4, 3) px, the depth image (5, 3)");
    assert!(read_labels(b"text", SIZE).unwrap_err().to_string().contains("cannot be read as PNG"));
}

#[test]
fn the_image_is_found_by_id_or_name() {
    let file = r#"{"images": [{"id": 1, "file_name": "a/tree.png"}, {"id": 2, "file_name": "b/x-depth.png"}],
        "annotations": [{"image_id": 1, "bbox": [0, 0, 1, 1]}, {"image_id": 2, "bbox": [1, 1, 1, 1]}]}"#;
    let read = |of: OfImage| {
        read_coco(file, Shape::Boxes, &of).map(|found| found.iter().map(drawn).collect::<Vec<_>>())
    };
    assert_eq!(read(of(Some(1), "x")).unwrap(), ["#.../..../...."]);
    assert_eq!(read(of(None, "x-depth")).unwrap(), ["..../.#../...."]);
    assert_eq!(read(of(None, "000002")).unwrap(), ["..../.#../...."]);
    for none in [of(Some(3), "y"), of(None, "y")] {
        let error = read(none).unwrap_err().to_string();
        assert!(error.contains("has regions of 2 images"), "{error}");
    }
    // An image without a region.
    let empty = r#"{"images": [{"id": 1, "file_name": "x.png"}], "annotations": []}"#;
    assert_eq!(boxes(empty), []);
}

#[test]
fn errors_name_field_and_value() {
    for (text, shape, message) in [
        ("{", Shape::Boxes, ".: EOF"),
        ("3", Shape::Boxes, "neither a list of results nor"),
        ("{}", Shape::Boxes, "annotations: is missing"),
        (r#"[{}]"#, Shape::Boxes, "[0].bbox: is missing"),
        (r#"[{"bbox": [1, 2, 3]}]"#, Shape::Boxes, "[0].bbox: [1,2,3] is not [left, top, width, height]"),
        (r#"[{"bbox": [1, 2, 0, 1]}]"#, Shape::Boxes, "has no area"),
        (r#"[{"bbox": [40, 2, 1, 1]}]"#, Shape::Boxes, "holds no pixel of the image of 4 x 3"),
        (r#"[{"bbox": [0, 0, 1, 1], "score": 1.5}]"#, Shape::Boxes, "[0].score: 1.5 is outside [0, 1]"),
        (r#"[{"image_id": "a", "bbox": []}]"#, Shape::Boxes, "[0].image_id: must be a whole number"),
        (r#"[{"bbox": [0, 0, 1, 1]}]"#, Shape::Masks, "[0].segmentation: is missing"),
        (
            r#"[{"segmentation": [[1, 2, 3, 4]]}]"#,
            Shape::Masks,
            "[0].segmentation[0]: must be at least three pairs",
        ),
        (r#"[{"segmentation": []}]"#, Shape::Masks, "holds no pixel"),
        (r#"[{"segmentation": {"size": [4, 3], "counts": []}}]"#, Shape::Masks, "size: [4,3] is not [3, 4]"),
        (
            r#"[{"segmentation": {"size": [3, 4], "counts": [3]}}]"#,
            Shape::Masks,
            "counts: the runs do not fill",
        ),
        (r#"[{"segmentation": {"size": [3, 4], "counts": [12]}}]"#, Shape::Masks, "counts: holds no pixel"),
        (
            r#"[{"segmentation": {"size": [3, 4], "counts": "~"}}]"#,
            Shape::Masks,
            "counts: must be a list of whole numbers or text",
        ),
        (
            r#"[{"segmentation": {"size": [3, 4], "counts": "oooooooooooooooo"}}]"#,
            Shape::Masks,
            "counts: must be",
        ),
    ] {
        let line = told(text, shape);
        assert!(line.contains(message), "{line}");
    }
    let many = format!("[{}]", vec![r#"{"bbox": [0, 0, 1, 1]}"#; MOST_REGIONS + 1].join(","));
    assert!(told(&many, Shape::Boxes).contains("has 10001 regions; at most 10000 are read"));
}

use super::*;

/// A message of type Image as ROS 2 encodes it.
fn image(encoding: &str, size: (u32, u32), step: u32, data: &[u8]) -> Vec<u8> {
    let mut cdr = cdr::Writer::new();
    cdr.i32(12);
    cdr.u32(345);
    cdr.text("camera_depth_optical_frame");
    cdr.u32(size.1);
    cdr.u32(size.0);
    cdr.text(encoding);
    cdr.bytes(&[0]);
    cdr.u32(step);
    cdr.u32(data.len() as u32);
    cdr.bytes(data);
    cdr.finish()
}

fn info(d: &[f64]) -> Vec<u8> {
    let mut cdr = cdr::Writer::new();
    cdr.i32(12);
    cdr.u32(345);
    cdr.text("f");
    cdr.u32(2);
    cdr.u32(3);
    cdr.text("plumb_bob");
    cdr.u32(d.len() as u32);
    cdr.f64s(d);
    cdr.f64s(&[5.0, 0.0, 1.0, 0.0, 5.0, 0.5, 0.0, 0.0, 1.0]);
    cdr.finish()
}

/// A packed image as ROS 2 encodes it.
fn packed(format: &str, data: &[u8]) -> Vec<u8> {
    let mut cdr = cdr::Writer::new();
    cdr.i32(12);
    cdr.u32(345);
    cdr.text("f");
    cdr.text(format);
    cdr.u32(data.len() as u32);
    cdr.bytes(data);
    cdr.finish()
}

/// A bag of messages: topic, schema, encoding, data.
fn bag(
    messages: &[(&str, &str, &str, Vec<u8>)],
    compression: Option<mcap::Compression>,
) -> tempfile::NamedTempFile {
    let mut writer =
        mcap::WriteOptions::new().compression(compression).create(std::io::Cursor::new(Vec::new())).unwrap();
    for (i, (topic, schema, encoding, data)) in messages.iter().enumerate() {
        let schema = writer.add_schema(schema, "ros2msg", b"").unwrap();
        let channel_id = writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap();
        let time = 1000 + i as u64;
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: i as u32,
            log_time: time,
            publish_time: time,
        };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), writer.into_inner().into_inner()).unwrap();
    file
}

fn read(messages: &[(&str, &str, &str, Vec<u8>)]) -> Result<Vec<(u64, BagMessage)>, String> {
    read_packed(messages, None)
}

fn topics() -> Topics {
    Topics { depth: "/d/image".into(), info: "/d/camera_info".into(), colour: Some("/c/image".into()) }
}

fn read_packed(
    messages: &[(&str, &str, &str, Vec<u8>)],
    compression: Option<mcap::Compression>,
) -> Result<Vec<(u64, BagMessage)>, String> {
    let file = bag(messages, compression);
    let mut bag = Bag::open(file.path(), &topics()).map_err(|e| e.to_string())?;
    let mut all = Vec::new();
    while let Some(message) = bag.next_message().map_err(|e| e.to_string())? {
        all.push(message);
    }
    Ok(all)
}

fn one(data: Vec<u8>) -> Result<RosImage, String> {
    match read(&[("/d/image", messages::IMAGE, "cdr", data)])?.remove(0).1 {
        BagMessage::Image(image) => Ok(image),
        other => Err(format!("{other:?}")),
    }
}

#[test]
fn images_and_intrinsics_are_read_in_order() {
    let values: Vec<u8> = [500_u16, 0, 1250, 2000, 1, 3000].iter().flat_map(|v| v.to_le_bytes()).collect();
    let all = read(&[
        ("/other", "std_msgs/msg/String", "cdr", vec![9]),
        ("/d/camera_info", messages::CAMERA_INFO, "cdr", info(&[0.1, 0.2])),
        ("/d/image", messages::IMAGE, "cdr", image("16UC1", (3, 2), 6, &values)),
    ])
    .unwrap();
    let k = [5.0, 0.0, 1.0, 0.0, 5.0, 0.5, 0.0, 0.0, 1.0];
    let expected =
        CameraInfo { height: 2, width: 3, distortion_model: "plumb_bob".into(), d: vec![0.1, 0.2], k };
    assert_eq!(all[0], (1001, BagMessage::Info(expected)));
    let (1002, BagMessage::Image(image)) = &all[1] else { panic!("{all:?}") };
    assert_eq!(image.header().stamp, (12, 345));
    assert_eq!(image.header().frame_id, "camera_depth_optical_frame");
    assert_eq!(image.depth(image.usual_unit()).pixels(), [0.5, 0.0, 1.25, 2.0, 0.001, 3.0]);
}

#[test]
fn rows_may_be_padded_and_odd_values_are_no_measurement() {
    let singles = [1.5_f32, f32::NAN, -1.0, 0.25];
    let mut rows = Vec::new();
    for row in singles.chunks(2) {
        rows.extend(row.iter().flat_map(|v| v.to_le_bytes()));
        rows.extend([0xee; 4]);
    }
    let image = one(image("32FC1", (2, 2), 12, &rows)).unwrap();
    assert_eq!(image.depth(image.usual_unit()).pixels(), [1.5, 0.0, 0.0, 0.25]);
}

/// Two pixels, (1, 2, 3) and (9, 8, 7), with a padded row.
#[test]
fn colours_are_red_green_and_blue() {
    for (encoding, row, expected) in [
        ("rgb8", &[1, 2, 3, 9, 8, 7, 0][..], [[1, 2, 3], [9, 8, 7]]),
        ("bgr8", &[3, 2, 1, 7, 8, 9, 0], [[1, 2, 3], [9, 8, 7]]),
        ("rgba8", &[1, 2, 3, 50, 9, 8, 7, 60, 0], [[1, 2, 3], [9, 8, 7]]),
        ("bgra8", &[3, 2, 1, 50, 7, 8, 9, 60, 0], [[1, 2, 3], [9, 8, 7]]),
        ("mono8", &[4, 5, 0], [[4; 3], [5; 3]]),
    ] {
        let data = image(encoding, (2, 1), row.len() as u32, row);
        match read(&[("/c/image", messages::IMAGE, "cdr", data)]).unwrap().remove(0).1 {
            BagMessage::Colour(colour) => assert_eq!(colour.rgb().pixels(), expected, "{encoding}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn packed_images_and_packed_chunks_are_read() {
    let messages = [
        ("/d/image", messages::COMPRESSED_IMAGE, "cdr", packed("16UC1; compressedDepth png", b"depth")),
        ("/c/image", messages::COMPRESSED_IMAGE, "cdr", packed("jpeg", b"colour")),
    ];
    for compression in [None, Some(mcap::Compression::Lz4), Some(mcap::Compression::Zstd)] {
        let all = read_packed(&messages, compression).unwrap();
        let [(1000, BagMessage::PackedDepth(depth)), (1001, BagMessage::PackedColour(colour))] = &all[..]
        else {
            panic!("{all:?}")
        };
        assert_eq!(
            (depth.format.as_str(), depth.data.as_slice()),
            ("16UC1; compressedDepth png", &b"depth"[..])
        );
        assert_eq!((colour.header.stamp, colour.data.as_slice()), ((12, 345), &b"colour"[..]));
    }
}

#[test]
fn what_cannot_be_read_is_told() {
    for (data, message) in [
        (
            image("rgb8", (1, 1), 3, &[0; 3]),
            "message 0 on /d/image: encoding is rgb8; 16UC1, mono16 or 32FC1 is needed",
        ),
        (image("16UC1", (0, 1), 0, &[]), "is 0 x 1"),
        (image("16UC1", (100_000, 100_000), 200_000, &[0; 9]), "is 100000 x 100000"),
        (image("16UC1", (4, 4), 8, &[0; 9]), "step 8 and 9 bytes do not hold 4 x 4 pixels"),
        (image("16UC1", (4, 4), 2, &[0; 99]), "step 2 and 99 bytes do not hold"),
        (vec![0, 1, 0], "ends within its header"),
        (vec![7, 7, 0, 0], "its encoding is [7, 7], not plain CDR"),
        (image("16UC1", (1, 1), 2, &[0; 2])[..40].to_vec(), "it ends before"),
    ] {
        let line = one(data).unwrap_err();
        assert!(line.contains(message), "{line}");
    }
    let line = read(&[("/d/image", messages::CAMERA_INFO, "cdr", vec![])]).unwrap_err();
    assert!(line.contains("topic /d/image holds sensor_msgs/msg/CameraInfo in cdr; sensor_msgs/msg/Image or sensor_msgs/msg/CompressedImage in cdr is needed"), "{line}");
    let line =
        read(&[("/c/image", messages::IMAGE, "cdr", image("bayer_rggb8", (1, 1), 1, &[0]))]).unwrap_err();
    assert!(
        line.contains(
            "message 0 on /c/image: encoding is bayer_rggb8; rgb8, bgr8, rgba8, bgra8 or mono8 is needed"
        ),
        "{line}"
    );
    let line =
        read(&[("/c/image", messages::COMPRESSED_IMAGE, "cdr", packed("jpeg", &[0; 9])[..30].to_vec())]);
    assert!(line.unwrap_err().contains("it ends before"));
    let line = read(&[("/d/camera_info", messages::CAMERA_INFO, "json", vec![])]).unwrap_err();
    assert!(line.contains("holds sensor_msgs/msg/CameraInfo in json"), "{line}");
    let mut long = info(&[]);
    let at = long.len() - 9 * 8 - 8;
    long[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let line = read(&[("/d/camera_info", messages::CAMERA_INFO, "cdr", long)]).unwrap_err();
    assert!(line.contains("it ends before 8 bytes"), "{line}");
    let text = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(text.path(), "no bag").unwrap();
    let mut bag = Bag::open(text.path(), &topics()).unwrap();
    assert!(bag.next_message().is_err());
}

/// Bytes of a message with one detection, by the rules of CDR.
#[test]
fn detections_are_aligned_as_cdr_asks() {
    let header = ImageHeader { stamp: (1, 2), frame_id: "cam".into() };
    let found =
        Detected { p_camera: [0.1, 0.2, 0.9], radius: 0.04, score: 0.75, center_deviation: Some(0.003) };
    let mut bag = DetectionBag::begin("/orchard/detections").unwrap();
    bag.add(77, &header, std::slice::from_ref(&found)).unwrap();
    bag.add(78, &header, &[]).unwrap();
    let bytes = bag.finish().unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.iter().map(|m| m.log_time).collect::<Vec<_>>(), [77, 78]);
    let channel = &messages[0].channel;
    assert_eq!((channel.topic.as_str(), channel.message_encoding.as_str()), ("/orchard/detections", "cdr"));
    assert_eq!(channel.schema.as_ref().unwrap().name, "vision_msgs/msg/Detection3DArray");
    let mut cdr = cdr::Reader::new(&messages[0].data).unwrap();
    let stamp = |cdr: &mut cdr::Reader<'_>| (cdr.i32().unwrap(), cdr.u32().unwrap(), cdr.text().unwrap());
    assert_eq!(stamp(&mut cdr), (1, 2, "cam".into()));
    assert_eq!(cdr.u32(), Ok(1));
    assert_eq!(stamp(&mut cdr), (1, 2, "cam".into()));
    assert_eq!((cdr.u32(), cdr.text()), (Ok(1), Ok("apple".into())));
    let numbers: Vec<f64> = (0..1 + 3 + 4 + 36 + 3 + 4 + 3).map(|_| cdr.f64().unwrap()).collect();
    assert_eq!(numbers[..8], [0.75, 0.1, 0.2, 0.9, 0.0, 0.0, 0.0, 1.0]);
    assert!((numbers[8] - 3e-6).abs() < 1e-18 && numbers[8] == numbers[15]);
    assert_eq!(numbers[51..], [0.08; 3]);
    assert_eq!(cdr.text(), Ok("0".into()));
    assert!(cdr.u8().is_err(), "nothing follows");
}

#[test]
fn intrinsics_are_beside_their_image() {
    assert_eq!(info_topic_of("/camera/depth/image_rect_raw"), "/camera/depth/camera_info");
    assert_eq!(info_topic_of("image"), "/camera_info");
    assert_eq!(info_topic_of("/camera/depth/image_raw/compressedDepth"), "/camera/depth/camera_info");
}

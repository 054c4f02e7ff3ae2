//! Bags of ROS 2: depth images from an MCAP file, detections into another one.

use std::path::{Path, PathBuf};

use anyhow::Context;
use orchard_bench::store::write_bytes;
use orchard_exchange::intrinsics::{self, OfImage};
use orchard_perception::Detection;
use orchard_recording::RecordingError;
use orchard_recording::bag::{Bag, BagMessage, CameraInfo, Detected, DetectionBag, RosImage, info_topic_of};

use super::census::Census;
use super::input::{Input, InputArgs, bad};
use crate::failure::Failure;

#[derive(clap::Args)]
pub struct BagArgs {
    /// Bag of ROS 2 in MCAP form, instead of --depth and --intrinsics; --out is then an MCAP file of vision_msgs/Detection3DArray
    #[arg(long, value_name = "FILE.mcap", requires = "topic", conflicts_with_all =
          ["depth", "intrinsics", "mask", "colour", "picture", "all", "camera_height", "boxes", "masks", "onnx", "image_id"])]
    pub mcap: Option<PathBuf>,
    /// Topic of the depth images: sensor_msgs/Image of encoding 16UC1, mono16 or 32FC1
    #[arg(long, value_name = "NAME", requires = "mcap")]
    topic: Option<String>,
    /// Topic of the intrinsics, sensor_msgs/CameraInfo [default: camera_info beside the images]
    #[arg(long, value_name = "NAME", requires = "mcap")]
    info_topic: Option<String>,
}

impl BagArgs {
    /// Checks that topics are of a bag. (The parser lets them pass beside --depth, which conflicts with what they require.)
    pub fn check(&self) -> Result<(), Failure> {
        let topics = [("--topic", &self.topic), ("--info-topic", &self.info_topic)];
        match topics.into_iter().find_map(|(option, topic)| Some((option, topic.as_ref()?))) {
            Some((option, topic)) if self.mcap.is_none() => {
                Err(Failure::BadInput(format!("{option} {topic}: needs --mcap")))
            }
            _ => Ok(()),
        }
    }
}

/// Topic of the detections.
const TOPIC: &str = "/orchard/detections";

/// Detects the fruit in all images of a bag.
pub fn run(args: &BagArgs, file: &Path, options: &InputArgs, out: &Path) -> Result<(), Failure> {
    if out.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("mcap")) {
        let line = format!(
            "--out {}: with --mcap detections are written as MCAP; a name that ends in .mcap is needed",
            out.display()
        );
        return Err(Failure::BadInput(line));
    }
    let config = options.detector()?;
    if config.sees_colour() {
        let name = options.detector_name();
        let problem = "it looks at colour; of a bag only the depth images are read";
        return Err(Failure::BadInput(format!("--detector {name} with --mcap: {problem}")));
    }
    options.check_unit()?;
    let topic = args.topic.clone().unwrap_or_default();
    let info_topic = args.info_topic.clone().unwrap_or_else(|| info_topic_of(&topic));
    let open = || Bag::open(file, &topic, &info_topic).map_err(told);
    let mut camera =
        Camera { file, topic: &info_topic, info: first_info(open()?, file, &info_topic)?, input: None };
    let mut detections = DetectionBag::begin(TOPIC).context("cannot begin the bag of detections")?;
    let (mut images, mut total) = (0, 0);
    let mut bag = open()?;
    while let Some((time, message)) = bag.next_message().map_err(told)? {
        let image = match message {
            BagMessage::Info(info) => {
                camera.change(info);
                continue;
            }
            BagMessage::Image(image) => image,
        };
        let unit = options.unit.unwrap_or(image.usual_unit());
        let input = camera.input(&image, unit, &config)?;
        let found = super::find(&input, None)?;
        let of = |d: &Detection| Detected {
            p_camera: d.p_camera.into(),
            radius: d.radius,
            score: d.score,
            center_deviation: super::finite(d.center_deviation),
        };
        let spheres: Vec<Detected> = found.accepted.iter().map(|(d, _)| of(d)).collect();
        if images == 0 {
            let range = input.config.segmentation.range.si();
            Census::of(&input.depth, unit, range, &found.refused).tell(spheres.len());
        }
        images += 1;
        total += spheres.len();
        detections.add(time, &image.header, &spheres).context("cannot write the detections")?;
    }
    if images == 0 {
        return Err(absent(file, "--topic", &topic, &bag));
    }
    let bytes = detections.finish().context("cannot end the bag of detections")?;
    write_bytes(out, &bytes).map_err(|e| Failure::of_file(&e))?;
    say!("{}: {images} images, {total} detections on {TOPIC}", out.display());
    Ok(())
}

fn told(e: RecordingError) -> Failure {
    Failure::BadInput(format!("--mcap {e}"))
}

fn absent(file: &Path, option: &str, topic: &str, bag: &Bag) -> Failure {
    let topics: Vec<String> = bag.topics().map(|(topic, kind)| format!("{topic} ({kind})")).collect();
    let topics = if topics.is_empty() { "none".to_owned() } else { topics.join(", ") };
    Failure::BadInput(format!(
        "{option} {topic}: {} has no message on it; its topics: {topics}",
        file.display()
    ))
}

/// The first intrinsics, which may come after the first image.
fn first_info(mut bag: Bag, file: &Path, topic: &str) -> Result<CameraInfo, Failure> {
    while let Some((_, message)) = bag.next_message().map_err(told)? {
        if let BagMessage::Info(info) = message {
            return Ok(info);
        }
    }
    Err(absent(file, "--info-topic", topic, &bag))
}

/// Camera by its latest intrinsics.
struct Camera<'a> {
    file: &'a Path,
    topic: &'a str,
    info: CameraInfo,
    /// Camera as read from `info`; `None` until an image needs it.
    input: Option<intrinsics::CameraFile>,
}

impl Camera<'_> {
    fn change(&mut self, info: CameraInfo) {
        if info != self.info {
            (self.info, self.input) = (info, None);
        }
    }

    /// Input of the detector for an image.
    fn input(
        &mut self,
        image: &RosImage,
        unit: f64,
        config: &orchard_perception::DetectorConfig,
    ) -> Result<Input, Failure> {
        let told = |problem: String| bad("--mcap", self.file, format!("topic {}: {problem}", self.topic));
        let camera = match self.input {
            Some(camera) => camera,
            None => {
                let text = serde_json::to_string(&self.info).context("intrinsics have no form in JSON")?;
                intrinsics::read_camera(&text, &OfImage::default()).map_err(|e| told(e.to_string()))?
            }
        };
        self.input = Some(camera);
        let (k, lens) = (camera.intrinsics, camera.lens);
        if image.size != (k.width, k.height) {
            let (width, height) = image.size;
            return Err(told(format!("is for {} x {}, the image is {width} x {height}", k.width, k.height)));
        }
        let depth = image.depth(unit);
        let depth = lens.map_or(depth.clone(), |lens| lens.undone(&depth, &k, 0.0));
        Ok(Input { depth, intrinsics: k, lens, colour: None, unit, mask: None, config: config.clone() })
    }
}

//! Bags of ROS 2: depth images from an MCAP file, perhaps with colour, detections into another one.

mod image;
mod pairs;

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};

use anyhow::Context;
use orchard_bench::store::write_bytes;
use orchard_exchange::intrinsics::{self, CameraFile, OfImage};
use orchard_network::Network;
use orchard_perception::{Detection, DetectorConfig};
use orchard_recording::RecordingError;
use orchard_recording::bag::{
    Bag, BagMessage, CameraInfo, Detected, DetectionBag, ImageHeader, Topics, info_topic_of,
};

use self::image::{Colour, Depth};
use super::census::Census;
use super::input::{Input, InputArgs, Look, bad};
use super::regions::RegionArgs;
use crate::failure::Failure;

#[derive(clap::Args)]
pub struct BagArgs {
    /// Bag of ROS 2 in MCAP form, instead of --depth and --intrinsics; --out is then an MCAP file of vision_msgs/Detection3DArray
    #[arg(long, value_name = "FILE.mcap", requires = "topic", conflicts_with_all =
          ["depth", "intrinsics", "mask", "colour", "picture", "all", "camera_height", "boxes", "masks", "image_id"])]
    pub mcap: Option<PathBuf>,
    /// Topic of the depth images: sensor_msgs/Image of encoding 16UC1, mono16 or 32FC1, or sensor_msgs/CompressedImage (compressedDepth, PNG)
    #[arg(long, value_name = "NAME", requires = "mcap")]
    topic: Option<String>,
    /// Topic of the intrinsics, sensor_msgs/CameraInfo [default: camera_info beside the images]
    #[arg(long, value_name = "NAME", requires = "mcap")]
    info_topic: Option<String>,
    /// Topic of colour images, registered to depth and of its size, for --onnx or a detector that sees colour: sensor_msgs/Image of encoding
    /// rgb8, bgr8, rgba8, bgra8 or mono8, or sensor_msgs/CompressedImage (JPEG, PNG)
    #[arg(long, value_name = "NAME", requires = "mcap", group = "colours")]
    colour_topic: Option<String>,
    /// Longest time between the stamps of a depth image and of the colour image nearest in time [s]; depth images without one are left out
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.02,
        requires = "colour_topic",
        allow_negative_numbers = true
    )]
    colour_within: f64,
}

/// Allowed times between depth and colour \[s\].
const WITHIN: std::ops::RangeInclusive<f64> = 0.0..=10.0;
/// Most bytes of images that wait for the images that belong to them.
const MOST_WAITING: usize = 1 << 30;

impl BagArgs {
    /// Checks that topics are of a bag. (The parser lets them pass beside --depth, which conflicts with what they require.)
    pub fn check(&self) -> Result<(), Failure> {
        let topics = [
            ("--topic", &self.topic),
            ("--info-topic", &self.info_topic),
            ("--colour-topic", &self.colour_topic),
        ];
        match topics.into_iter().find_map(|(option, topic)| Some((option, topic.as_ref()?))) {
            Some((option, topic)) if self.mcap.is_none() => {
                Err(Failure::BadInput(format!("{option} {topic}: needs --mcap")))
            }
            _ => Ok(()),
        }
    }

    /// Checks topics and time against each other and against what looks at colour.
    fn topics(&self, sees_colour: bool, detector: &str) -> Result<Topics, Failure> {
        let problem = |line: String| Err(Failure::BadInput(line));
        if !WITHIN.contains(&self.colour_within) {
            let (within, low, high) = (self.colour_within, WITHIN.start(), WITHIN.end());
            return problem(format!("--colour-within {within}: the allowed range is [{low}, {high}] s"));
        }
        let depth = self.topic.clone().unwrap_or_default();
        let info = self.info_topic.clone().unwrap_or_else(|| info_topic_of(&depth));
        match &self.colour_topic {
            Some(colour) if [&depth, &info].contains(&colour) => {
                problem(format!("--colour-topic {colour}: it is the topic of the depth images or intrinsics"))
            }
            Some(colour) if !sees_colour => {
                problem(format!("--colour-topic {colour}: needs --onnx or a detector that sees colour"))
            }
            None if sees_colour => problem(format!(
                "--detector {detector} with --mcap: it looks at colour; --colour-topic NAME is needed"
            )),
            colour => Ok(Topics { depth, info, colour: colour.clone() }),
        }
    }
}

/// Topic of the detections.
const TOPIC: &str = "/orchard/detections";

/// Detects the fruit in all images of a bag.
pub fn run(
    args: &BagArgs,
    file: &Path,
    options: &InputArgs,
    regions: &RegionArgs,
    out: &Path,
) -> Result<(), Failure> {
    if out.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("mcap")) {
        let line = format!(
            "--out {}: with --mcap detections are written as MCAP; a name that ends in .mcap is needed",
            out.display()
        );
        return Err(Failure::BadInput(line));
    }
    options.check_unit()?;
    let network = regions.network()?;
    let look = Look::at(args.colour_topic.is_some(), network.is_some());
    let config = options.detector(look)?;
    let topics = args.topics(config.sees_colour() || network.is_some(), options.detector_name(look))?;
    let overview = Overview::read(file, &topics)?;
    let within = pairs::nanoseconds(args.colour_within);
    let mut finder = Finder {
        file,
        topics: &topics,
        unit: options.unit,
        config,
        regions: network.map(|network| (regions, network)),
        detections: DetectionBag::begin(TOPIC).context("cannot begin the bag of detections")?,
        images: 0,
        total: 0,
    };
    let mut camera = Camera { file, topic: &topics.info, info: overview.info.clone(), read: None };
    let mut pairing = Pairing::new(&overview, &topics, within);
    let mut bag = Bag::open(file, &topics).map_err(told)?;
    while let Some((time, message)) = bag.next_message().map_err(told)? {
        match message {
            BagMessage::Info(info) => camera.change(info),
            BagMessage::Image(image) => pairing.add_depth(time, Depth::Raw(image), &mut camera)?,
            BagMessage::PackedDepth(image) => pairing.add_depth(time, Depth::Packed(image), &mut camera)?,
            BagMessage::Colour(image) => pairing.add_colour(Colour::Raw(image)),
            BagMessage::PackedColour(image) => pairing.add_colour(Colour::Packed(image)),
        }
        while let Some((waiting, colour)) = pairing.next() {
            finder.find(&waiting, colour)?;
            pairing.done(&waiting);
        }
        if pairing.bytes() > MOST_WAITING {
            let line = format!(
                "of {} and {} more than {MOST_WAITING} bytes lie between images that belong together",
                topics.depth,
                topics.colour.as_deref().unwrap_or_default()
            );
            return Err(bad("--mcap", file, line));
        }
    }
    if finder.images == 0 {
        return Err(bad(
            "--mcap",
            file,
            format!(
                "no image on {} has a colour image on {} within {} s (--colour-within)",
                topics.depth,
                topics.colour.as_deref().unwrap_or_default(),
                args.colour_within
            ),
        ));
    }
    if pairing.left_out > 0 {
        let (left_out, within) = (pairing.left_out, args.colour_within);
        note!("warning: {left_out} depth images have no colour image within {within} s and are left out");
    }
    let (images, total) = (finder.images, finder.total);
    let bytes = finder.detections.finish().context("cannot end the bag of detections")?;
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

/// Content of a bag that is known before its images are looked at.
struct Overview {
    /// The first intrinsics, which may come after the first image.
    info: CameraInfo,
    /// Times of the depth images \[ns\].
    depths: Vec<i64>,
    /// Times of the colour images \[ns\].
    colours: Vec<i64>,
}

impl Overview {
    fn read(file: &Path, topics: &Topics) -> Result<Self, Failure> {
        let mut bag = Bag::open(file, topics).map_err(told)?;
        let (mut first, mut depths, mut colours) = (None, Vec::new(), Vec::new());
        let (mut frame_of_depth, mut frame_of_colour) = (None, None);
        let time = |frame: &mut Option<String>, header: &ImageHeader, log_time: u64| {
            frame.get_or_insert_with(|| header.frame_id.clone());
            pairs::time_of(header, log_time)
        };
        while let Some((at, message)) = bag.next_message().map_err(told)? {
            match message {
                BagMessage::Info(info) => first = first.or(Some(info)),
                BagMessage::Image(image) => depths.push(time(&mut frame_of_depth, image.header(), at)),
                BagMessage::PackedDepth(image) => depths.push(time(&mut frame_of_depth, &image.header, at)),
                BagMessage::Colour(image) => colours.push(time(&mut frame_of_colour, image.header(), at)),
                BagMessage::PackedColour(image) => {
                    colours.push(time(&mut frame_of_colour, &image.header, at));
                }
            }
        }
        let Some(info) = first else { return Err(absent(file, "--info-topic", &topics.info, &bag)) };
        if depths.is_empty() {
            return Err(absent(file, "--topic", &topics.depth, &bag));
        }
        if let Some(topic) = topics.colour.as_ref().filter(|_| colours.is_empty()) {
            return Err(absent(file, "--colour-topic", topic, &bag));
        }
        if let (Some(depth), Some(colour)) = (&frame_of_depth, &frame_of_colour)
            && depth != colour
        {
            note!(
                "warning: depth is in frame '{depth}', colour in '{colour}': is colour registered to depth?"
            );
        }
        Ok(Self { info, depths, colours })
    }
}

/// Depth image that waits for its colour image.
struct Waiting {
    log_time: u64,
    depth: Depth,
    /// Camera when the image was taken.
    camera: CameraFile,
    /// Number of its colour image, if colour is looked at.
    colour: Option<usize>,
}

/// Depth images in their order, each with its colour image.
struct Pairing {
    /// Number of the colour image of each depth image; `None` if colour is not looked at.
    partners: Option<Vec<Option<usize>>>,
    /// Number of depth images that need each colour image.
    uses: Vec<u32>,
    depths: usize,
    colours: usize,
    waiting: VecDeque<Waiting>,
    kept: BTreeMap<usize, Colour>,
    /// Number of depth images without a colour image.
    left_out: usize,
}

impl Pairing {
    fn new(overview: &Overview, topics: &Topics, within: u64) -> Self {
        let partners =
            topics.colour.as_ref().map(|_| pairs::partners(&overview.depths, &overview.colours, within));
        let mut uses = vec![0; overview.colours.len()];
        partners.iter().flatten().flatten().for_each(|&number| uses[number] += 1);
        Self {
            partners,
            uses,
            depths: 0,
            colours: 0,
            waiting: VecDeque::new(),
            kept: BTreeMap::new(),
            left_out: 0,
        }
    }

    fn add_depth(&mut self, log_time: u64, depth: Depth, camera: &mut Camera<'_>) -> Result<(), Failure> {
        let number = self.depths;
        self.depths += 1;
        let colour = self.partners.as_ref().map(|all| all.get(number).copied().flatten());
        if colour == Some(None) {
            self.left_out += 1;
            return Ok(());
        }
        let camera = camera.read()?;
        self.waiting.push_back(Waiting { log_time, depth, camera, colour: colour.flatten() });
        Ok(())
    }

    fn add_colour(&mut self, image: Colour) {
        if self.uses.get(self.colours).is_some_and(|uses| *uses > 0) {
            self.kept.insert(self.colours, image);
        }
        self.colours += 1;
    }

    /// The next depth image with its colour image, if that has come.
    fn next(&mut self) -> Option<(Waiting, Option<&Colour>)> {
        let number = self.waiting.front()?.colour;
        if number.is_some_and(|number| !self.kept.contains_key(&number)) {
            return None;
        }
        let waiting = self.waiting.pop_front()?;
        Some((waiting, number.and_then(|number| self.kept.get(&number))))
    }

    /// Forgets the colour image of a depth image, if no other one needs it.
    fn done(&mut self, waiting: &Waiting) {
        let Some(number) = waiting.colour else { return };
        self.uses[number] -= 1;
        if self.uses[number] == 0 {
            self.kept.remove(&number);
        }
    }

    /// Bytes of the images that are kept.
    fn bytes(&self) -> usize {
        let depths: usize = self.waiting.iter().map(|waiting| waiting.depth.length()).sum();
        depths + self.kept.values().map(Colour::length).sum::<usize>()
    }
}

/// Camera by its latest intrinsics.
struct Camera<'a> {
    file: &'a Path,
    topic: &'a str,
    info: CameraInfo,
    /// Camera as read from `info`; `None` until an image needs it.
    read: Option<CameraFile>,
}

impl Camera<'_> {
    fn change(&mut self, info: CameraInfo) {
        if info != self.info {
            (self.info, self.read) = (info, None);
        }
    }

    fn read(&mut self) -> Result<CameraFile, Failure> {
        if let Some(camera) = self.read {
            return Ok(camera);
        }
        let text = serde_json::to_string(&self.info).context("intrinsics have no form in JSON")?;
        let camera = intrinsics::read_camera(&text, &OfImage::default())
            .map_err(|e| bad("--mcap", self.file, format!("topic {}: {e}", self.topic)))?;
        self.read = Some(camera);
        Ok(camera)
    }
}

/// Finds fruit in images and writes the detections.
struct Finder<'a> {
    file: &'a Path,
    topics: &'a Topics,
    unit: Option<f64>,
    config: DetectorConfig,
    /// Network that says where to look.
    regions: Option<(&'a RegionArgs, Network)>,
    detections: DetectionBag,
    images: usize,
    total: usize,
}

impl Finder<'_> {
    fn find(&mut self, waiting: &Waiting, colour: Option<&Colour>) -> Result<(), Failure> {
        let input = self.input(waiting, colour)?;
        let regions = match (&self.regions, &input.colour) {
            (Some((regions, network)), Some(colour)) => Some(regions.found_by(network, colour)?),
            _ => None,
        };
        let found = super::find(&input, regions.as_deref())?;
        let of = |d: &Detection| Detected {
            p_camera: d.p_camera.into(),
            radius: d.radius,
            score: d.score,
            center_deviation: super::finite(d.center_deviation),
        };
        let spheres: Vec<Detected> = found.accepted.iter().map(|(d, _)| of(d)).collect();
        if self.images == 0 {
            let range = input.config.segmentation.range.si();
            Census::of(&input.depth, input.unit, range, &found.refused).tell(spheres.len());
        }
        self.images += 1;
        self.total += spheres.len();
        let added = self.detections.add(waiting.log_time, waiting.depth.header(), &spheres);
        Ok(added.context("cannot write the detections")?)
    }

    /// Input of the detector for an image.
    fn input(&self, waiting: &Waiting, colour: Option<&Colour>) -> Result<Input, Failure> {
        let told = |topic: &str, header: &ImageHeader, problem: String| {
            let (seconds, rest) = header.stamp;
            let line = format!("topic {topic}, image of stamp {seconds}.{rest:09} s: {problem}");
            bad("--mcap", self.file, line)
        };
        let of_depth = |problem| told(&self.topics.depth, waiting.depth.header(), problem);
        let (depth, unit) = waiting.depth.read(self.unit).map_err(of_depth)?;
        let CameraFile { intrinsics: k, lens, .. } = waiting.camera;
        let size = (depth.width(), depth.height());
        if size != (k.width, k.height) {
            let (width, height) = size;
            let topic = &self.topics.info;
            return Err(of_depth(format!(
                "is {width} x {height}, the intrinsics on {topic} are for {} x {}",
                k.width, k.height
            )));
        }
        let depth = lens.map_or(depth.clone(), |lens| lens.undone(&depth, &k, 0.0));
        let colour = match colour {
            None => None,
            Some(image) => {
                let topic = self.topics.colour.as_deref().unwrap_or_default();
                let of_colour = |problem| told(topic, image.header(), problem);
                let colour = image.read().map_err(of_colour)?;
                if (colour.width(), colour.height()) != size {
                    let (width, height) = (colour.width(), colour.height());
                    return Err(of_colour(format!(
                        "is {width} x {height}, its depth image is {} x {}; colour must be registered to depth and of its size",
                        size.0, size.1
                    )));
                }
                Some(lens.map_or(colour.clone(), |lens| lens.undone(&colour, &k, [0; 3])))
            }
        };
        Ok(Input { depth, intrinsics: k, lens, colour, unit, mask: None, config: self.config.clone() })
    }
}

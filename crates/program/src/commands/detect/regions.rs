//! Regions by a learned detector: `--boxes`, `--masks` and `--onnx`.

use std::path::{Path, PathBuf};

use orchard_exchange::intrinsics::Lens;
use orchard_exchange::regions::{self, OfImage, Shape};
use orchard_geometry::{Image, Intrinsics};
use orchard_network::Network;
use orchard_perception::Region;

use super::input::{Input, bad, bytes};
use super::onnx;
use crate::failure::Failure;

/// Largest network \[bytes\]: 30 million weights of 32 bits.
const LARGEST_NETWORK: u64 = 120_000_000;

#[derive(clap::Args)]
pub struct RegionArgs {
    /// Boxes in which another detector found fruit: COCO JSON, annotations or results. Spheres are fitted only there; scores of the file are kept
    #[arg(long, value_name = "FILE.json", conflicts_with = "masks")]
    boxes: Option<PathBuf>,
    /// Masks in which another detector found fruit: COCO JSON (polygons, run lengths), or a PNG of labels (0 is none)
    #[arg(long, value_name = "FILE.json|FILE.png")]
    masks: Option<PathBuf>,
    /// Learned detector in ONNX format (a YOLO export), run on the image of --colour or those of --colour-topic; spheres are fitted only in
    /// its boxes
    #[arg(long, value_name = "MODEL.onnx", requires = "colours", conflicts_with_all = ["boxes", "masks"])]
    onnx: Option<PathBuf>,
    /// Least score of a box of --onnx
    #[arg(long, value_name = "SCORE", default_value_t = 0.25, requires = "onnx")]
    least_score: f64,
    /// Number of the image in a COCO file of several (its image_id); by default that of the file name of --depth or --colour
    #[arg(long, value_name = "N")]
    image_id: Option<u64>,
}

/// Region, with the score by the detector that found it.
pub struct Found {
    pub region: Region,
    pub score: Option<f64>,
}

impl RegionArgs {
    /// True if another detector says where fruit are.
    pub fn given(&self) -> bool {
        self.boxes.is_some() || self.masks.is_some() || self.onnx.is_some()
    }

    /// True if a colour image is used.
    pub fn use_colour(&self) -> bool {
        self.onnx.is_some()
    }

    /// Checks what the options demand of each other.
    pub fn check(&self) -> Result<(), Failure> {
        if !(0.0..=1.0).contains(&self.least_score) {
            return Err(Failure::BadInput(format!(
                "--least-score {}: the allowed range is [0, 1]",
                self.least_score
            )));
        }
        match self.image_id {
            Some(id) if self.boxes.is_none() && self.masks.is_none() => {
                Err(Failure::BadInput(format!("--image-id {id}: needs --boxes or --masks")))
            }
            _ => Ok(()),
        }
    }

    /// Reads the network of `--onnx`.
    pub fn network(&self) -> Result<Option<Network>, Failure> {
        let Some(file) = &self.onnx else { return Ok(None) };
        let told = |e: String| bad("--onnx", file, e);
        let model = orchard_input::bytes(file, LARGEST_NETWORK).map_err(|e| told(e.to_string()))?;
        Network::from_bytes(&model).map(Some).map_err(|e| told(e.to_string()))
    }

    /// Regions that the network of `--onnx` finds in a colour image of the pinhole.
    pub fn found_by(&self, network: &Network, colour: &Image<[u8; 3]>) -> Result<Vec<Found>, Failure> {
        let file = self.onnx.as_deref().unwrap_or(Path::new("-"));
        let found = onnx::boxes(network, colour, self.least_score).map_err(|e| bad("--onnx", file, e))?;
        let of_image = |region| {
            let (region, score) = of_file(region);
            Found { region, score }
        };
        Ok(found.into_iter().map(of_image).collect())
    }

    /// Reads the regions of the image, whose files are `images`, or finds them by a network; `None` without the options. They are in the
    /// pinhole's image.
    pub fn read(&self, input: &Input, images: &[&Path]) -> Result<Option<Vec<Found>>, Failure> {
        let (k, lens) = (&input.intrinsics, input.lens.as_ref());
        if let (Some(network), Some(colour)) = (self.network()?, &input.colour) {
            return self.found_by(&network, colour).map(Some);
        }
        let (option, file, shape) = match (&self.boxes, &self.masks) {
            (Some(file), _) => ("--boxes", file, Shape::Boxes),
            (None, Some(file)) => ("--masks", file, Shape::Masks),
            (None, None) => return Ok(None),
        };
        let size = (k.width, k.height);
        let content = bytes(option, file)?;
        let found = if shape == Shape::Masks && content.starts_with(&[0x89, b'P', b'N', b'G']) {
            regions::read_labels(&content, size)
        } else {
            let names =
                images.iter().filter_map(|path| Some(path.file_stem()?.to_string_lossy().into_owned()));
            let of = OfImage { size, id: self.image_id, names: names.collect() };
            let text =
                std::str::from_utf8(&content).map_err(|_| bad(option, file, "is not text in UTF-8"))?;
            regions::read_coco(text, shape, &of)
        };
        let found = found.map_err(|e| bad(option, file, e))?;
        let of_pinhole = |region: regions::Region| {
            let (region, score) = of_file(region);
            Found { region: lens.map_or(region.clone(), |lens| undistorted(&region, k, lens)), score }
        };
        Ok(Some(found.into_iter().map(of_pinhole).collect()))
    }
}

fn of_file(region: regions::Region) -> (Region, Option<f64>) {
    let regions::Region { left, top, inside, score } = region;
    (Region { left, top, inside }, score)
}

/// The region as the pinhole sees it; without a pixel if that shows nothing of it.
fn undistorted(region: &Region, k: &Intrinsics, lens: &Lens) -> Region {
    let mut whole = Image::filled(k.width, k.height, false);
    for v in 0..region.inside.height() {
        for u in 0..region.inside.width() {
            whole[(region.left + u, region.top + v)] = region.inside[(u, v)];
        }
    }
    let seen = lens.undone(&whole, k, false);
    let places: Vec<(usize, usize)> =
        (0..k.height).flat_map(|v| (0..k.width).map(move |u| (u, v))).filter(|at| seen[*at]).collect();
    let ends = |of: fn(&(usize, usize)) -> usize| {
        let all = || places.iter().map(of);
        (all().min().unwrap_or(0), all().max().map_or(0, |last| last + 1))
    };
    let ((left, right), (top, bottom)) = (ends(|at| at.0), ends(|at| at.1));
    let mut inside = Image::filled(right - left, bottom - top, false);
    places.iter().for_each(|&(u, v)| inside[(u - left, v - top)] = true);
    Region { left, top, inside }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_moves_with_the_lens() {
        let k = Intrinsics { width: 64, height: 48, fx: 50.0, fy: 50.0, cx: 31.5, cy: 23.5 };
        let region = Region { left: 4, top: 20, inside: Image::filled(6, 8, true) };
        let none = undistorted(&region, &k, &Lens::of_coefficients(&[0.0]));
        assert_eq!(none, region);
        // A barrel: what the lens shows at the left lies farther left in a pinhole's image.
        let barrel = undistorted(&region, &k, &Lens::of_coefficients(&[-0.1]));
        assert!(barrel.left < 4, "{barrel:?}");
        // A pincushion: the region is beyond the pinhole's edge or nearer to the middle.
        let pincushion = undistorted(&region, &k, &Lens::of_coefficients(&[0.1]));
        assert!(pincushion.left > 4);
    }
}

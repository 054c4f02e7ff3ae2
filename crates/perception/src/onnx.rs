//! Networks that say where fruit are, as ONNX files: those that come with the crate, and others.

use std::sync::{Arc, OnceLock};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use orchard_network::{Network, Port, Tensor};
use serde::{Deserialize, Serialize};

/// Pixels of a cell of the map that a network gives.
pub(crate) const CELL: usize = 4;
/// Rows and columns of a network's input are multiples of this.
pub(crate) const MULTIPLE: usize = 16;
/// Numbers of a cell, and their count if the last one is the share of the cell that shows fruit.
pub(crate) const FIELDS: usize = 4;
pub(crate) const FIELDS_WITH_SHARE: usize = FIELDS + 1;
/// Channels of colour.
const CHANNELS: usize = 3;
/// Networks that come with the crate, which `examples/learn/train_detector.py` has trained: the first one sees depth only, the second one colour as well.
const EMBEDDED: [(&str, &[u8]); 2] = [
    ("learned/detector.onnx", include_bytes!("../configs/learned/detector.onnx")),
    ("learned-colour/detector.onnx", include_bytes!("../configs/learned-colour/detector.onnx")),
];
/// Start of a text that holds the bytes of a file, as results store them.
const BYTES: &str = "base64:";

/// A network as an ONNX file. In a config it is a name of the crate's own, or a file beside the config; results hold the bytes of such a file.
///
/// It takes depth `[1, 1, rows, columns]` \[m\], 0 where nothing is measured; the focal length `[1]` \[px\]; and, if it sees colour, the image
/// `[1, 3, rows, columns]`, sRGB from 0 to 1. It gives a map `[1, 4, rows / 4, columns / 4]`: probability that the centre of a fruit is in the cell, its place right of
/// and below the centre of the cell \[cells\], and its radius \[px\]. A fifth number may be the share of the cell's pixels that show fruit.
#[derive(Clone, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Onnx(Source);

#[derive(Clone)]
enum Source {
    /// Number of one that comes with the crate.
    Embedded(usize),
    /// Name of a file that is not read yet.
    Named(String),
    Read(Arc<(Vec<u8>, Network)>),
}

impl Default for Onnx {
    fn default() -> Self {
        Self(Source::Embedded(0))
    }
}

impl Onnx {
    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// Not a network in ONNX format that the runtime computes, or one that takes or gives arrays of other shapes.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, String> {
        let network = Network::from_bytes(&bytes).map_err(|e| e.to_string())?;
        check(&network)?;
        Ok(Self(Source::Read(Arc::new((bytes, network)))))
    }

    /// Name of the file that still has to be read; `None` if the network is there.
    pub fn file(&self) -> Option<&str> {
        match &self.0 {
            Source::Named(name) => Some(name),
            Source::Embedded(_) | Source::Read(_) => None,
        }
    }

    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The network; `None` if its file is not read yet. One of the crate's own is read at its first use.
    pub(crate) fn network(&self) -> Option<&Network> {
        static READ: [OnceLock<Network>; EMBEDDED.len()] = [const { OnceLock::new() }; EMBEDDED.len()];
        match &self.0 {
            Source::Embedded(k) => Some(READ[*k].get_or_init(|| {
                Network::from_bytes(EMBEDDED[*k].1).unwrap_or_else(|e| unreachable!("embedded network: {e}"))
            })),
            Source::Named(_) => None,
            Source::Read(read) => Some(&read.1),
        }
    }

    /// True if the network looks at colour.
    pub fn sees_colour(&self) -> bool {
        self.network().is_some_and(|network| network.inputs().len() > 2)
    }
}

/// Checks inputs and outputs of a network.
fn check(network: &Network) -> Result<(), String> {
    let shape = |port: Option<&Port>| port.map_or_else(|| "none".to_owned(), Port::shape_text);
    let fits = |port: &Port, wanted: &[Option<usize>]| {
        port.shape.len() == wanted.len()
            && port.shape.iter().zip(wanted).all(|(own, wanted)| match wanted {
                Some(_) => own.is_none() || own == wanted,
                None => own.is_none(),
            })
    };
    let image = |channels| [Some(1), Some(channels), None, None];
    let inputs = network.inputs();
    let wanted = [
        ("depth", "[1, 1, rows, columns]", image(1).to_vec()),
        ("focal length", "[1]", vec![Some(1)]),
        ("colour", "[1, 3, rows, columns]", image(CHANNELS).to_vec()),
    ];
    for (k, (what, text, wanted)) in wanted.iter().enumerate().take(inputs.len().max(2)) {
        if !inputs.get(k).is_some_and(|port| fits(port, wanted)) {
            let own = shape(inputs.get(k));
            return Err(format!(
                "input {} has shape {own}; it must be {what}, {text}, rows and columns open",
                k + 1
            ));
        }
    }
    if inputs.len() > wanted.len() {
        return Err(format!(
            "it has {} inputs; it must have depth, focal length and, if it sees colour, colour",
            inputs.len()
        ));
    }
    // Rows and columns differ, so that a network that exchanges them is noticed.
    let (rows, columns) = (2 * MULTIPLE, 3 * MULTIPLE);
    let given = run(network, (rows, columns), |channels| vec![0.5; channels * rows * columns], 400.0)?;
    let wanted = [1, FIELDS, rows / CELL, columns / CELL];
    let with_share = [1, FIELDS_WITH_SHARE, wanted[2], wanted[3]];
    if (given.shape() == wanted || given.shape() == with_share) && given.as_f32().is_some() {
        return Ok(());
    }
    Err(format!(
        "its map of {rows} x {columns} pixels has shape {:?}; it must be {wanted:?} or {with_share:?} in 32 bits",
        given.shape()
    ))
}

/// Computes the map of an image; `image` makes the values of depth (one channel) and of colour (three).
pub(crate) fn run(
    network: &Network,
    (rows, columns): (usize, usize),
    image: impl Fn(usize) -> Vec<f32>,
    focal: f32,
) -> Result<Tensor, String> {
    let array = |channels| Tensor::f32(&[1, channels, rows, columns], image(channels));
    let mut arrays = vec![array(1), Tensor::f32(&[1], vec![focal])];
    if network.inputs().len() > arrays.len() {
        arrays.push(array(CHANNELS));
    }
    let arrays: Option<Vec<Tensor>> = arrays.into_iter().collect();
    let arrays = arrays.ok_or_else(|| "the image is too large".to_owned())?;
    let outputs = network.run(arrays).map_err(|e| e.to_string())?;
    outputs.into_iter().next().ok_or_else(|| "it has no output".to_owned())
}

impl TryFrom<String> for Onnx {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        if let Some(k) = EMBEDDED.iter().position(|(name, _)| *name == text) {
            return Ok(Self(Source::Embedded(k)));
        }
        match text.strip_prefix(BYTES) {
            Some(bytes) => Self::from_bytes(STANDARD.decode(bytes).map_err(|e| format!("not base64: {e}"))?),
            None => Ok(Self(Source::Named(text))),
        }
    }
}

impl From<Onnx> for String {
    fn from(onnx: Onnx) -> Self {
        match onnx.0 {
            Source::Embedded(k) => EMBEDDED[k].0.to_owned(),
            Source::Named(name) => name,
            Source::Read(read) => format!("{BYTES}{}", STANDARD.encode(&read.0)),
        }
    }
}

impl PartialEq for Onnx {
    fn eq(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Source::Embedded(a), Source::Embedded(b)) => a == b,
            (Source::Named(a), Source::Named(b)) => a == b,
            (Source::Read(a), Source::Read(b)) => a.0 == b.0,
            _ => false,
        }
    }
}

impl std::fmt::Debug for Onnx {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.0 {
            Source::Embedded(k) => f.write_str(EMBEDDED[*k].0),
            Source::Named(name) => f.write_str(name),
            Source::Read(read) => write!(f, "{:?} of {} bytes", read.1, read.0.len()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The networks give what ONNX Runtime (1.30 with colour, 1.32 without) gave for this image of 64 x 48 pixels: a ball before a rough wall, in colours by a formula.
    #[test]
    fn the_networks_agree_with_onnx_runtime() {
        let (rows, columns) = (48, 64);
        let pixels = || (0..rows).flat_map(|v| (0..columns).map(move |u| (u, v)));
        let depth = |(u, v): (usize, usize)| {
            let (across, down) = (u as f64 - 30.0, v as f64 - 22.0);
            let square = across * across + down * down;
            let wall = 0.8 + 0.002 * ((7 * u + 13 * v) % 50) as f64;
            (if square < 100.0 { 0.7 - 0.04 * (1.0 - square / 100.0).sqrt() } else { wall }) as f32
        };
        let shown = |c: usize| pixels().map(move |(u, v)| ((31 * u + 17 * v + 57 * c) % 256) as f32 / 255.0);
        let image = |channels: usize| match channels {
            1 => pixels().map(depth).collect(),
            _ => (0..channels).flat_map(shown).collect(),
        };
        let of_colour = Onnx::try_from("learned-colour/detector.onnx".to_owned()).unwrap();
        assert!(of_colour.sees_colour() && !Onnx::default().sees_colour());
        for (onnx, expected) in [
            (Onnx::default(), include_str!("../tests/learned_map.txt")),
            (of_colour, include_str!("../tests/learned_colour_map.txt")),
        ] {
            let map = run(onnx.network().unwrap(), (rows, columns), image, 180.0).unwrap();
            assert_eq!(map.shape(), [1, FIELDS_WITH_SHARE, rows / CELL, columns / CELL]);
            let expected: Vec<f32> = expected.split_whitespace().map(|x| x.parse().unwrap()).collect();
            let map = map.as_f32().unwrap();
            assert_eq!(map.len(), expected.len());
            for (own, other) in map.iter().zip(&expected) {
                assert!((own - other).abs() <= 1e-4 * (1.0 + other.abs()), "{own} {other}");
            }
        }
    }

    #[test]
    fn a_file_comes_back_from_its_text_and_its_name_is_kept() {
        let read = Onnx::from_bytes(EMBEDDED[0].1.to_vec()).unwrap();
        let text = String::from(read.clone());
        assert!(text.starts_with(BYTES) && Onnx::try_from(text).unwrap() == read);
        assert!(read.file().is_none() && read != Onnx::default());
        let named = Onnx::try_from("mine.onnx".to_owned()).unwrap();
        assert_eq!((named.file(), String::from(named.clone())), (Some("mine.onnx"), "mine.onnx".to_owned()));
        assert!(named.network().is_none());
        for (text, problem) in [("base64:!", "not base64"), ("base64:AAAA", "not a model in ONNX format")] {
            let refused = Onnx::try_from(text.to_owned()).unwrap_err();
            assert!(refused.contains(problem), "{refused}");
        }
    }
}

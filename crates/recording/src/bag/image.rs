//! Images as sent: depth and colour, raw and packed.

use orchard_geometry::{DepthImage, Image};

use super::cdr::Reader;
use super::messages::{ImageHeader, header};

/// Most pixels of an image.
const MOST_PIXELS: u64 = 100_000_000;

/// Pixels of a raw image, as sent.
#[derive(Debug, Clone, PartialEq)]
struct Raw<E> {
    header: ImageHeader,
    /// Columns and rows.
    size: (usize, usize),
    encoding: E,
    big_endian: bool,
    /// Bytes of a row.
    step: usize,
    data: Vec<u8>,
}

/// Encoding of pixels: its name in messages and the bytes of a pixel.
trait Encoding: Copy + 'static {
    /// Names that are read, each with its encoding.
    const ALL: &'static [(&'static str, Self)];

    fn bytes(self) -> usize;
}

impl<E: Encoding> Raw<E> {
    fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut cdr = Reader::new(bytes)?;
        let header = header(&mut cdr)?;
        let (height, width) = (cdr.u32()?, cdr.u32()?);
        let name = cdr.text()?;
        let known = E::ALL.iter().find(|(known, _)| *known == name);
        let Some((_, encoding)) = known else {
            let names: Vec<&str> = E::ALL.iter().map(|(name, _)| *name).collect();
            let (last, others) = names.split_last().unwrap_or((&"", &[]));
            return Err(format!("encoding is {name}; {} or {last} is needed", others.join(", ")));
        };
        let big_endian = cdr.u8()? != 0;
        let step = cdr.u32()? as usize;
        let length = cdr.u32()? as usize;
        let data = cdr.bytes(length)?;
        if width == 0 || height == 0 || u64::from(width) * u64::from(height) > MOST_PIXELS {
            return Err(format!("is {width} x {height}; 1 to {MOST_PIXELS} pixels are read"));
        }
        let size = (width as usize, height as usize);
        if step < size.0 * encoding.bytes() || length < step.saturating_mul(size.1) {
            return Err(format!(
                "step {step} and {length} bytes do not hold {width} x {height} pixels of {name}"
            ));
        }
        Ok(Self { header, size, encoding: *encoding, big_endian, step, data: data.to_vec() })
    }

    /// Image of one value for the bytes of each pixel.
    fn image<T: Copy>(&self, none: T, value: impl Fn(&[u8]) -> T) -> Image<T> {
        let mut out = Image::filled(self.size.0, self.size.1, none);
        for (v, row) in self.data.chunks(self.step).take(self.size.1).enumerate() {
            for (u, bytes) in row.chunks_exact(self.encoding.bytes()).take(self.size.0).enumerate() {
                out[(u, v)] = value(bytes);
            }
        }
        out
    }
}

/// Image of depths, as sent.
#[derive(Debug, Clone, PartialEq)]
pub struct RosImage(Raw<DepthEncoding>);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DepthEncoding {
    /// 16 bits, usually millimetres (REP 118).
    Whole,
    /// 32-bit floating-point metres.
    Single,
}

impl Encoding for DepthEncoding {
    const ALL: &'static [(&'static str, Self)] =
        &[("16UC1", Self::Whole), ("mono16", Self::Whole), ("32FC1", Self::Single)];

    fn bytes(self) -> usize {
        match self {
            Self::Whole => 2,
            Self::Single => 4,
        }
    }
}

impl RosImage {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        Raw::read(bytes).map(Self)
    }

    /// Time and frame.
    pub fn header(&self) -> &ImageHeader {
        &self.0.header
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        self.0.size
    }

    /// Bytes of the pixels.
    pub fn length(&self) -> usize {
        self.0.data.len()
    }

    /// The usual unit \[m\]: a millimetre for whole numbers, a metre for floating-point numbers (REP 118).
    pub fn usual_unit(&self) -> f64 {
        match self.0.encoding {
            DepthEncoding::Whole => 1e-3,
            DepthEncoding::Single => 1.0,
        }
    }

    /// Image in metres; `unit` \[m\] is the depth of value 1. What is not positive and finite is no measurement, 0.
    pub fn depth(&self, unit: f64) -> DepthImage {
        self.0.image(0.0, |bytes| {
            let mut ordered = [0; 4];
            ordered[..bytes.len()].copy_from_slice(bytes);
            if self.0.big_endian {
                ordered[..bytes.len()].reverse();
            }
            let value = match self.0.encoding {
                DepthEncoding::Whole => f64::from(u16::from_le_bytes([ordered[0], ordered[1]])),
                DepthEncoding::Single => f64::from(f32::from_le_bytes(ordered)),
            };
            let z = (value * unit) as f32;
            if z.is_finite() && z > 0.0 { z } else { 0.0 }
        })
    }
}

/// Colour image, as sent.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourImage(Raw<ColourEncoding>);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ColourEncoding {
    Rgb,
    Bgr,
    Rgba,
    Bgra,
    Grey,
}

impl Encoding for ColourEncoding {
    const ALL: &'static [(&'static str, Self)] = &[
        ("rgb8", Self::Rgb),
        ("bgr8", Self::Bgr),
        ("rgba8", Self::Rgba),
        ("bgra8", Self::Bgra),
        ("mono8", Self::Grey),
    ];

    fn bytes(self) -> usize {
        match self {
            Self::Rgb | Self::Bgr => 3,
            Self::Rgba | Self::Bgra => 4,
            Self::Grey => 1,
        }
    }
}

impl ColourImage {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        Raw::read(bytes).map(Self)
    }

    /// Time and frame.
    pub fn header(&self) -> &ImageHeader {
        &self.0.header
    }

    /// Red, green and blue.
    pub fn rgb(&self) -> Image<[u8; 3]> {
        self.0.image([0; 3], |bytes| match (self.0.encoding, bytes) {
            (ColourEncoding::Rgb | ColourEncoding::Rgba, &[r, g, b, ..])
            | (ColourEncoding::Bgr | ColourEncoding::Bgra, &[b, g, r, ..]) => [r, g, b],
            (_, &[grey, ..]) => [grey; 3],
            (_, []) => [0; 3],
        })
    }

    /// Bytes of the pixels.
    pub fn length(&self) -> usize {
        self.0.data.len()
    }
}

/// Packed image (`sensor_msgs/msg/CompressedImage`), as sent.
#[derive(Debug, Clone, PartialEq)]
pub struct PackedImage {
    /// Time and frame.
    pub header: ImageHeader,
    /// Kind of packing, such as `jpeg` or `16UC1; compressedDepth png`.
    pub format: String,
    /// The packed image.
    pub data: Vec<u8>,
}

impl PackedImage {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut cdr = Reader::new(bytes)?;
        let (header, format) = (header(&mut cdr)?, cdr.text()?);
        let length = cdr.u32()? as usize;
        Ok(Self { header, format, data: cdr.bytes(length)?.to_vec() })
    }
}

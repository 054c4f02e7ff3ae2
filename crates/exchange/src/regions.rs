//! Regions of an image in which a learned detector found something: boxes and masks of COCO files, and label images.
//!
//! A COCO file is a list of results (`image_id`, `bbox` or `segmentation`, `score`), or an object with `annotations` and maybe `images`.
//! Boxes are `[left, top, width, height]` in pixels, the corner of the first pixel at (0, 0). Masks are polygons, run lengths, or run
//! lengths packed into text as `pycocotools` writes them. All categories count.

mod masks;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use orchard_geometry::Image;
use png::{BitDepth, ColorType};
use serde_json::Value;

use crate::depth_png::{PngError, decode};
use crate::intrinsics::MOST_PIXELS;

/// Most regions of one image; a learned detector gives at most some hundred.
pub const MOST_REGIONS: usize = 10_000;

/// Region of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// First column \[px\].
    pub left: usize,
    /// First row \[px\].
    pub top: usize,
    /// Pixels that belong to it; its size is that of the region.
    pub inside: Image<bool>,
    /// Score by the learned detector, if the file has one.
    pub score: Option<f64>,
}

/// Part of an annotation that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// `bbox`.
    Boxes,
    /// `segmentation`.
    Masks,
}

/// Image whose regions are wanted.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OfImage {
    /// Columns and rows.
    pub size: (usize, usize),
    /// `image_id` of the image in the COCO file, if the caller knows it.
    pub id: Option<u64>,
    /// Names that its file may have in the list of images, without folder and extension.
    pub names: Vec<String>,
}

/// Error of reading regions.
#[derive(Debug, thiserror::Error)]
pub enum RegionError {
    /// A field is missing, of the wrong type or outside its range.
    #[error("{field}: {problem}")]
    Field {
        /// Path of the field, such as `annotations[3].bbox`.
        field: String,
        /// Problem.
        problem: String,
    },
    /// The file is of several images, and none is known to be the wanted one.
    #[error(
        "has regions of {found} images, and none of them is known to be this one; name it by its image_id"
    )]
    Image {
        /// Number of images.
        found: usize,
    },
    /// The label image cannot be read.
    #[error(transparent)]
    Png(#[from] PngError),
    /// The label image has another size.
    #[error("is {found:?} px, the depth image {wanted:?}")]
    Size {
        /// Columns and rows of the label image.
        found: (usize, usize),
        /// Columns and rows of the depth image.
        wanted: (usize, usize),
    },
    /// There are too many regions.
    #[error("has {found} regions; at most {MOST_REGIONS} are read")]
    TooMany {
        /// Number of regions.
        found: usize,
    },
}

fn refuse<T>(field: &str, problem: impl Into<String>) -> Result<T, RegionError> {
    Err(RegionError::Field { field: field.to_owned(), problem: problem.into() })
}

/// Reads the regions of one image from a COCO file.
///
/// # Errors
/// The text is no COCO file, it has several images and none is the wanted one, or a region cannot be read or lies outside the image.
pub fn read_coco(text: &str, shape: Shape, of: &OfImage) -> Result<Vec<Region>, RegionError> {
    let file: Value = match serde_json::from_str(text) {
        Ok(file) => file,
        Err(e) => return refuse(".", e.to_string()),
    };
    let (path, all) = match &file {
        Value::Array(all) => ("", all),
        Value::Object(fields) => match fields.get("annotations") {
            Some(Value::Array(all)) => ("annotations", all),
            _ => return refuse("annotations", "is missing or no list"),
        },
        _ => return refuse(".", "is neither a list of results nor an object with annotations"),
    };
    let wanted = wanted(&file, path, all, of)?;
    let entries = all.iter().enumerate().filter(|(_, entry)| wanted.is_none() || image_id(entry) == wanted);
    let entries: Vec<(usize, &Value)> = entries.collect();
    if entries.len() > MOST_REGIONS {
        return Err(RegionError::TooMany { found: entries.len() });
    }
    let mut pixels = 0;
    let mut one = |(i, entry)| {
        let region = region(&format!("{path}[{i}]"), entry, shape, of.size)?;
        pixels += region.inside.pixels().len();
        if pixels > MOST_PIXELS {
            return refuse(
                &format!("{path}[{i}]"),
                format!("the boxes so far have more than {MOST_PIXELS} px"),
            );
        }
        Ok(region)
    };
    entries.into_iter().map(&mut one).collect()
}

fn image_id(entry: &Value) -> Option<u64> {
    entry.get("image_id").and_then(Value::as_u64)
}

/// The `image_id` of the wanted image; `None` if no entry has one.
fn wanted(file: &Value, path: &str, all: &[Value], of: &OfImage) -> Result<Option<u64>, RegionError> {
    for (i, entry) in all.iter().enumerate() {
        if entry.get("image_id").is_some() && image_id(entry).is_none() {
            return refuse(&format!("{path}[{i}].image_id"), "must be a whole number");
        }
    }
    let mut ids: BTreeSet<u64> = all.iter().filter_map(image_id).collect();
    let images = file.get("images").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    ids.extend(images.iter().filter_map(|image| image.get("id").and_then(Value::as_u64)));
    if of.id.is_some() && (ids.contains(&of.id.unwrap_or_default()) || ids.is_empty()) {
        return Ok(of.id.filter(|_| !ids.is_empty()));
    }
    let named = |image: &&Value| {
        let name = image.get("file_name").and_then(Value::as_str).map(stem);
        name.is_some_and(|name| of.names.iter().any(|wanted| wanted == name))
    };
    let by_name = images.iter().find(named).and_then(|image| image.get("id").and_then(Value::as_u64));
    let by_number = of.names.iter().filter_map(|name| name.parse().ok()).find(|id| ids.contains(id));
    let only = if ids.len() == 1 && of.id.is_none() { ids.first().copied() } else { None };
    match by_name.or(by_number).or(only) {
        None if !ids.is_empty() => Err(RegionError::Image { found: ids.len() }),
        found => Ok(found),
    }
}

/// Name of a file without folder and extension.
pub fn stem(file: &str) -> &str {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

fn region(path: &str, entry: &Value, shape: Shape, size: (usize, usize)) -> Result<Region, RegionError> {
    let score = match entry.get("score") {
        None | Some(Value::Null) => None,
        Some(value) => match value.as_f64() {
            Some(score) if (0.0..=1.0).contains(&score) => Some(score),
            _ => return refuse(&format!("{path}.score"), format!("{value} is outside [0, 1]")),
        },
    };
    let (left, top, inside) = match shape {
        Shape::Boxes => boxed(&format!("{path}.bbox"), entry.get("bbox"), size)?,
        Shape::Masks => {
            let field = format!("{path}.segmentation");
            match entry.get("segmentation") {
                None => return refuse(&field, "is missing; boxes are read by another option"),
                Some(value) => masks::read(&field, value, size)?,
            }
        }
    };
    Ok(Region { left, top, inside, score })
}

/// Pixels whose centres lie in a box.
fn boxed(
    field: &str,
    value: Option<&Value>,
    (width, height): (usize, usize),
) -> Result<(usize, usize, Image<bool>), RegionError> {
    let Some(value) = value else { return refuse(field, "is missing") };
    let numbers: Option<Vec<f64>> =
        value.as_array().map(|list| list.iter().filter_map(Value::as_f64).collect());
    let Some(&[x, y, w, h]) = numbers.as_deref() else {
        return refuse(field, format!("{value} is not [left, top, width, height]"));
    };
    if !(w > 0.0 && h > 0.0) {
        return refuse(field, format!("{value} has no area"));
    }
    match Region::of_box([x, y, w, h], (width, height), None) {
        Some(Region { left, top, inside, .. }) => Ok((left, top, inside)),
        None => refuse(field, format!("{value} holds no pixel of the image of {width} x {height}")),
    }
}

impl Region {
    /// Pixels of an image of `size` whose centres lie in a box (left, top, width, height), the corner of the first pixel at (0, 0); `None` if
    /// there are none.
    pub fn of_box([x, y, w, h]: [f64; 4], size: (usize, usize), score: Option<f64>) -> Option<Self> {
        // A pixel's centre is half a pixel from its corner; a cast saturates.
        let span = |low: f64, length: f64, size: usize| {
            let first = ((low - 0.5).ceil().max(0.0) as usize).min(size);
            let end = ((low + length - 0.5).floor() + 1.0).max(0.0) as usize;
            (first, end.clamp(first, size))
        };
        let ((left, right), (top, bottom)) = (span(x, w, size.0), span(y, h, size.1));
        let inside = || Image::filled(right - left, bottom - top, true);
        (left < right && top < bottom).then(|| Self { left, top, inside: inside(), score })
    }
}

/// Reads regions from a label image, a PNG of 8 or 16 bits, grey or by palette: pixels of one value other than 0 are one region.
///
/// # Errors
/// The bytes are no such PNG, or it has another size.
pub fn read_labels(bytes: &[u8], size: (usize, usize)) -> Result<Vec<Region>, RegionError> {
    let kinds = [
        (ColorType::Grayscale, BitDepth::Eight),
        (ColorType::Grayscale, BitDepth::Sixteen),
        (ColorType::Indexed, BitDepth::Eight),
    ];
    let raw = decode(bytes, &kinds, "grey of 8 or 16 bits or by a palette of 8 bits")?;
    if (raw.width, raw.height) != size {
        return Err(RegionError::Size { found: (raw.width, raw.height), wanted: size });
    }
    let labels: Vec<u16> = if raw.data.len() == raw.width * raw.height {
        raw.data.iter().map(|&label| u16::from(label)).collect()
    } else {
        raw.data.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect()
    };
    let labels = Image::from_pixels(size.0, size.1, labels)
        .ok_or_else(|| PngError::Damaged("it has fewer pixels than its header states".into()))?;
    masks::by_label(&labels)
}

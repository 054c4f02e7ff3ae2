//! The interface between a policy and a robot in words that a machine can read.

use serde::Serialize;

use crate::action::Channel;
use crate::spaces::Spaces;

/// One number of a field.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Element {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
}

impl Element {
    pub(crate) fn new(name: impl Into<String>, unit: &'static str) -> Self {
        Self { name: name.into(), unit }
    }
}

/// One array of an observation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Field {
    /// Key in the observation.
    pub key: &'static str,
    /// Type of its numbers, by numpy's name.
    pub dtype: &'static str,
    /// Shape; images have rows first.
    pub shape: Vec<usize>,
    /// Smallest value; `None` without an end.
    pub low: Option<f64>,
    /// Largest value; `None` without an end.
    pub high: Option<f64>,
    /// Meaning of the field, for people.
    pub meaning: &'static str,
    /// Descriptions of its numbers, one each; an image has those of one pixel.
    pub elements: Vec<Element>,
}

impl Field {
    pub(crate) fn numbers(key: &'static str, meaning: &'static str, elements: Vec<Element>) -> Self {
        Self { key, dtype: "float32", shape: vec![elements.len()], low: None, high: None, meaning, elements }
    }

    /// One number a pixel; `high` may be infinite.
    pub(crate) fn image(
        key: &'static str,
        dtype: &'static str,
        [height, width]: [usize; 2],
        high: f64,
        unit: &'static str,
        meaning: &'static str,
    ) -> Self {
        let (shape, high) = (vec![height, width], Some(high).filter(|high| high.is_finite()));
        Self { key, dtype, shape, low: Some(0.0), high, meaning, elements: vec![Element::new("pixel", unit)] }
    }

    /// Red, green and blue of each pixel (sRGB).
    pub(crate) fn picture(key: &'static str, [height, width]: [usize; 2], meaning: &'static str) -> Self {
        let (shape, high) = (vec![height, width, 3], Some(f64::from(u8::MAX)));
        let elements = ["red", "green", "blue"].map(|channel| Element::new(channel, "sRGB")).to_vec();
        Self { key, dtype: "uint8", shape, low: Some(0.0), high, meaning, elements }
    }
}

/// All conventions of observations and actions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Interface {
    /// Version of the scales of `configs/policy/`.
    pub encoding: String,
    /// What the policy asked for.
    pub spaces: Spaces,
    /// Frames of an action.
    pub frames: u32,
    /// Length of a frame \[s\].
    pub frame: f64,
    /// The numbers of an action.
    pub action: Vec<Channel>,
    /// The arrays of an observation.
    pub observation: Vec<Field>,
}

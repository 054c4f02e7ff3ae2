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
    /// A number of a name and unit.
    pub fn new(name: impl Into<String>, unit: &'static str) -> Self {
        Self { name: name.into(), unit }
    }
}

/// One array of an observation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Field {
    /// Key in the observation.
    pub key: &'static str,
    /// Type of its numbers, by numpy's name; `str` for text.
    pub dtype: &'static str,
    /// Shape; images have rows first, text has none.
    pub shape: Vec<usize>,
    /// Smallest value; `None` without an end.
    pub low: Option<f64>,
    /// Largest value; `None` without an end. Of text the largest number of characters.
    pub high: Option<f64>,
    /// Meaning of the field, for people.
    pub meaning: &'static str,
    /// Descriptions of its numbers, one each; an image has those of one pixel.
    pub elements: Vec<Element>,
}

impl Field {
    /// Numbers without ends.
    pub fn numbers(key: &'static str, meaning: &'static str, elements: Vec<Element>) -> Self {
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

    /// Text.
    pub(crate) fn text(key: &'static str, most: usize, meaning: &'static str) -> Self {
        let (shape, high) = (Vec::new(), Some(most as f64));
        Self { key, dtype: "str", shape, low: None, high, meaning, elements: Vec::new() }
    }

    /// Red, green and blue of each pixel (sRGB).
    pub(crate) fn picture(key: &'static str, [height, width]: [usize; 2], meaning: &'static str) -> Self {
        let (shape, high) = (vec![height, width, 3], Some(f64::from(u8::MAX)));
        let elements = ["red", "green", "blue"].map(|channel| Element::new(channel, "sRGB")).to_vec();
        Self { key, dtype: "uint8", shape, low: Some(0.0), high, meaning, elements }
    }
}

/// Conventions that every robot and every setting shares, in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Conventions {
    /// Meaning of a number of an action.
    pub actions: &'static str,
    /// Sign of the gripper's number.
    pub gripper: &'static str,
    /// Rotations of the tool.
    pub rotations: &'static str,
    /// Frames of reference: right-handed, lengths in metres.
    pub frames: Frames,
    /// Order of an image's pixels.
    pub images: &'static str,
    /// Clock of all times.
    pub times: &'static str,
}

/// Frames of reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Frames {
    /// The base frame at the start.
    pub odom: &'static str,
    /// The robot's base.
    pub base: &'static str,
    /// The tool point.
    pub tool: &'static str,
}

impl Conventions {
    /// The conventions of this version.
    pub(crate) const V1: Self = Self {
        actions: "float32 in [-1, 1], linear between the values at the ends; beyond the ends it counts as the end",
        gripper: "-1 closes the fingers or draws the whole vacuum, 1 opens them or vents",
        rotations: "rotation vectors (axis times angle, rad) in axes of the frame, applied after the present rotation R: R becomes exp(r) R",
        frames: Frames {
            odom: "the base frame at the start of the episode; fixed",
            base: "on the ground below the chassis: x forward, y left, z up",
            tool: "between the finger pads or at the middle of the cup's lip: z the approach axis, y along the fingers' motion",
        },
        images: "rows from the top, pixels of a row from the left, red green blue",
        times: "seconds since the start of the episode",
    };
}

/// All conventions of observations and actions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Interface {
    /// Version of the scales of `configs/policy/`.
    pub encoding: String,
    /// Settings that the policy asked for.
    pub spaces: Spaces,
    /// Frames of an action.
    pub frames: u32,
    /// Length of a frame \[s\].
    pub frame: f64,
    /// Conventions for all robots and settings.
    pub conventions: Conventions,
    /// The numbers of an action.
    pub action: Vec<Channel>,
    /// The arrays of an observation.
    pub observation: Vec<Field>,
}

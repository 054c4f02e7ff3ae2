//! Classes of the label images and of the annotations.

use orchard_camera::Label;
use serde::Serialize;

/// Value in the instance image of a pixel without a numbered object.
pub const NO_INSTANCE: u16 = u16::MAX;

/// A class of the label images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Class {
    /// Value in label images.
    pub value: u8,
    /// Name.
    pub name: &'static str,
    /// A colour to draw it in (sRGB).
    pub color: [u8; 3],
    /// Object that an instance number identifies; none for classes without instances.
    pub instance: Option<&'static str>,
}

/// All classes, by their value.
pub const CLASSES: [Class; 7] = [
    Class { value: 0, name: "none", color: [24, 26, 28], instance: None },
    Class { value: 1, name: "fruit", color: [224, 48, 44], instance: Some("fruit of the tree") },
    Class { value: 2, name: "leaf", color: [96, 176, 72], instance: Some("leaf of the tree") },
    Class { value: 3, name: "wood", color: [150, 104, 66], instance: Some("segment of the tree's skeleton") },
    Class { value: 4, name: "robot", color: [236, 148, 40], instance: Some("shape of the robot") },
    Class { value: 5, name: "ground", color: [92, 92, 76], instance: None },
    Class { value: 6, name: "scenery", color: [128, 148, 196], instance: Some("post or wire") },
];

/// The class of a label.
pub(crate) fn class(label: Label) -> &'static Class {
    &CLASSES[label.number()]
}

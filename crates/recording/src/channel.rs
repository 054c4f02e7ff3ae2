//! Channels of a recording: topic, schema and source.

use foxglove::messages::{
    CameraCalibration, FrameTransforms, JointStates, Log, PointCloud, RawImage, SceneUpdate,
};
use foxglove::{Encode, Schema};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;

use crate::command::CommandMessage;
use crate::cup::CupMessage;
use crate::event::{EventMessage, StateHashMessage};
use crate::picker::{DetectionsMessage, PickerMessage};

/// A channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Channel {
    /// Poses of all frames in the world.
    Transforms,
    /// Ground, posts and wires.
    Ground,
    /// Wood, in the frames of its segments.
    Wood,
    /// Leaves, in the frames of their segments.
    Leaves,
    /// Fruit, in their own frames.
    Fruit,
    /// The robot's shapes, in the frames of its links.
    Robot,
    /// Depth images.
    Depth,
    /// The depth camera.
    Calibration,
    /// Point clouds of the depth images.
    Points,
    /// The robot's joints.
    JointStates,
    /// Pressure in the suction cup, of robots that have one.
    Cup,
    /// Events of the world.
    Events,
    /// Hashes of the world's state.
    StateHash,
    /// Commands.
    Command,
    /// Controller events.
    Picker,
    /// Detections of the controller in an image.
    Detections,
    /// Detections of the controller, as spheres.
    DetectionSpheres,
    /// Target fruit of the controller, as a sphere.
    Target,
    /// Events of the world and of the controller, in words.
    Log,
}

/// Source of a channel's messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// The world: its messages are a function of its start and of the commands.
    World,
    /// The controller.
    Controller,
}

impl Channel {
    /// All channels, in the order in which the enum declares them.
    pub const ALL: [Self; 19] = [
        Self::Transforms,
        Self::Ground,
        Self::Wood,
        Self::Leaves,
        Self::Fruit,
        Self::Robot,
        Self::Depth,
        Self::Calibration,
        Self::Points,
        Self::JointStates,
        Self::Cup,
        Self::Events,
        Self::StateHash,
        Self::Command,
        Self::Picker,
        Self::Detections,
        Self::DetectionSpheres,
        Self::Target,
        Self::Log,
    ];

    /// Topic of the channel.
    pub fn topic(self) -> &'static str {
        match self {
            Self::Transforms => "/tf",
            Self::Ground => "/scene/ground",
            Self::Wood => "/scene/wood",
            Self::Leaves => "/scene/leaves",
            Self::Fruit => "/scene/fruit",
            Self::Robot => "/scene/robot",
            Self::Depth => "/camera/depth",
            Self::Calibration => "/camera/calibration",
            Self::Points => "/camera/points",
            Self::JointStates => "/joint_states",
            Self::Cup => "/cup",
            Self::Events => "/events",
            Self::StateHash => "/state_hash",
            Self::Command => "/command",
            Self::Picker => "/picker",
            Self::Detections => "/detections",
            Self::DetectionSpheres => "/scene/detections",
            Self::Target => "/scene/target",
            Self::Log => "/log",
        }
    }

    /// The channel of a topic.
    pub fn of(topic: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|channel| channel.topic() == topic)
    }

    /// Returns the source of the messages. The log has messages of both sources, and differs if either does.
    pub fn origin(self) -> Origin {
        match self {
            Self::Command
            | Self::Picker
            | Self::Detections
            | Self::DetectionSpheres
            | Self::Target
            | Self::Log => Origin::Controller,
            _ => Origin::World,
        }
    }

    /// Encoding of its messages.
    pub fn encoding(self) -> &'static str {
        match self {
            Self::Cup | Self::Events | Self::StateHash | Self::Command | Self::Picker | Self::Detections => {
                "json"
            }
            _ => "protobuf",
        }
    }

    /// Schema of its messages.
    pub fn schema(self) -> Schema {
        match self {
            Self::Transforms => foxglove::<FrameTransforms>(),
            Self::Ground
            | Self::Wood
            | Self::Leaves
            | Self::Fruit
            | Self::Robot
            | Self::DetectionSpheres
            | Self::Target => foxglove::<SceneUpdate>(),
            Self::Depth => foxglove::<RawImage>(),
            Self::Calibration => foxglove::<CameraCalibration>(),
            Self::Points => foxglove::<PointCloud>(),
            Self::JointStates => foxglove::<JointStates>(),
            Self::Log => foxglove::<Log>(),
            Self::Cup => own::<CupMessage>("Cup"),
            Self::Events => own::<EventMessage>("Event"),
            Self::StateHash => own::<StateHashMessage>("StateHash"),
            Self::Command => own::<CommandMessage>("Command"),
            Self::Picker => own::<PickerMessage>("Picker"),
            Self::Detections => own::<DetectionsMessage>("Detections"),
        }
    }
}

/// Foxglove's own schema.
fn foxglove<M: Encode>() -> Schema {
    M::get_schema().unwrap_or_else(|| unreachable!("Foxglove's messages have schemas"))
}

/// Schema of one of this crate's messages, with all definitions inline: Foxglove resolves no references.
fn own<M: JsonSchema>(name: &str) -> Schema {
    let settings = SchemaSettings::draft07().with(|s| s.inline_subschemas = true);
    let schema = settings.into_generator().into_root_schema_for::<M>();
    let text = serde_json::to_vec(&schema).unwrap_or_else(|e| unreachable!("a schema is JSON: {e}"));
    Schema::new(format!("orchardbench.{name}"), "jsonschema", text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn channels_are_listed_in_order_and_found_by_topic() {
        assert!(Channel::ALL.is_sorted_by(|a, b| a < b));
        for channel in Channel::ALL {
            assert_eq!(Channel::of(channel.topic()), Some(channel));
            assert_eq!(channel.schema().encoding == "jsonschema", channel.encoding() == "json");
        }
        assert_eq!(Channel::of("/nothing"), None);
    }

    /// Foxglove refuses a channel with anything but one plain type a field.
    fn plain(schema: &Value, path: &str) {
        let known = ["object", "array", "string", "number", "integer", "boolean"];
        let kind = schema["type"].as_str().unwrap_or_else(|| panic!("{path}: {schema}"));
        assert!(known.contains(&kind), "{path}: {kind}");
        for word in ["$ref", "anyOf", "oneOf", "allOf"] {
            assert!(schema.get(word).is_none(), "{path}: {word}");
        }
        if kind == "array" {
            assert_ne!(schema["items"]["type"], "array", "{path}");
            plain(&schema["items"], path);
        }
        for (name, field) in schema["properties"].as_object().into_iter().flatten() {
            assert!(field["description"].is_string(), "{path}.{name} is not described");
            plain(field, &format!("{path}.{name}"));
        }
    }

    #[test]
    fn own_schemas_are_plain_and_described() {
        for channel in Channel::ALL.into_iter().filter(|channel| channel.encoding() == "json") {
            let schema = channel.schema();
            let text: Value = serde_json::from_slice(&schema.data).unwrap();
            assert_eq!(text["type"], "object", "{}", schema.name);
            plain(&text, &schema.name);
        }
    }
}

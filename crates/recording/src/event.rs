//! World events and controller events, as messages and as lines of a log.

use foxglove::messages::{Log, log::Level};
use orchard_world::WorldEvent;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::clock::timestamp;

/// Hash of the state of the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StateHashMessage {
    /// Frames stepped so far.
    pub frame: u32,
    /// SHA-256 of the world's snapshot, hexadecimal.
    pub sha256: String,
}

/// An event of the world. Fields that do not apply are left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EventMessage {
    /// `finger_contact_began`, `finger_contact_ended`, `fruit_gripped`, `fruit_detached`, `fruit_deposited`, `fruit_dropped`, `seal_lost` or
    /// `branch_snapped`.
    pub event: String,
    /// The fruit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "u32")]
    pub fruit: Option<u32>,
    /// The segment whose base joint broke.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "u32")]
    pub segment: Option<u32>,
    /// Height that the fruit fell before it first touched the bucket or its fruit (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64")]
    pub drop_height: Option<f64>,
    /// Energy of the hardest impact of that fall (J).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64")]
    pub impact_energy: Option<f64>,
}

impl EventMessage {
    /// The message of an event; none of impacts, which recordings leave out.
    pub fn of(event: &WorldEvent) -> Option<Self> {
        let of = |name: &str, fruit: Option<usize>, segment: Option<usize>| Self {
            event: name.to_owned(),
            fruit: fruit.map(|fruit| fruit as u32),
            segment: segment.map(|segment| segment as u32),
            drop_height: None,
            impact_energy: None,
        };
        Some(match *event {
            WorldEvent::FingerContactBegan { fruit, .. } => of("finger_contact_began", Some(fruit), None),
            WorldEvent::FingerContactEnded { fruit, .. } => of("finger_contact_ended", Some(fruit), None),
            WorldEvent::FruitGripped { fruit, .. } => of("fruit_gripped", Some(fruit), None),
            WorldEvent::FruitDetached { fruit, .. } => of("fruit_detached", Some(fruit), None),
            WorldEvent::FruitDeposited { fruit, drop_height, impact_energy, .. } => Self {
                drop_height: Some(drop_height),
                impact_energy: Some(impact_energy),
                ..of("fruit_deposited", Some(fruit), None)
            },
            WorldEvent::FruitDropped { fruit, .. } => of("fruit_dropped", Some(fruit), None),
            WorldEvent::SealLost { fruit, .. } => of("seal_lost", Some(fruit), None),
            WorldEvent::FruitTakenAway { fruit, .. } => of("fruit_taken_away", Some(fruit), None),
            WorldEvent::BranchSnapped { segment, .. } => of("branch_snapped", None, Some(segment)),
            WorldEvent::FruitImpact { .. } => return None,
        })
    }
}

/// Line of the log about an event; none of impacts, nor of finger contacts, which may begin and end in every frame.
pub fn world_line(log_time: u64, event: &WorldEvent) -> Option<Log> {
    let (level, text) = match event {
        WorldEvent::FruitGripped { fruit, .. } => {
            (Level::Info, format!("both fingers press on fruit {fruit}"))
        }
        WorldEvent::FruitDetached { fruit, tension, .. } => {
            (Level::Info, format!("fruit {fruit} is off its stem at {tension:.1} N"))
        }
        WorldEvent::FruitDeposited { fruit, .. } => {
            (Level::Info, format!("fruit {fruit} rests in the bucket"))
        }
        WorldEvent::FruitTakenAway { fruit, .. } => {
            (Level::Info, format!("fruit {fruit} is taken away with the bucket"))
        }
        WorldEvent::FruitDropped { fruit, .. } => {
            (Level::Warning, format!("fruit {fruit} has touched the ground"))
        }
        WorldEvent::SealLost { fruit, .. } => {
            (Level::Warning, format!("the suction cup lost its seal on fruit {fruit}"))
        }
        WorldEvent::BranchSnapped { segment, .. } => {
            (Level::Error, format!("the branch at segment {segment} broke"))
        }
        WorldEvent::FruitImpact { .. }
        | WorldEvent::FingerContactBegan { .. }
        | WorldEvent::FingerContactEnded { .. } => return None,
    };
    Some(line(log_time, "world", level, text))
}

/// A line of the log.
pub fn line(log_time: u64, name: &str, level: Level, message: String) -> Log {
    Log {
        timestamp: Some(timestamp(log_time)),
        level: level.into(),
        message,
        name: name.to_owned(),
        file: String::new(),
        line: 0,
    }
}

//! Faults of sensors and hand, and limbs that fall.

use orchard_quantity::{Quantity, Span};
use serde::{Deserialize, Deserializer, Serialize};

use crate::sensing::delay;

/// Kind of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// Nothing fails.
    None,
    /// The camera delivers no image.
    CameraDead,
    /// The camera delivers its last image again and again, with the time at which it should have taken a new one.
    CameraFrozen,
    /// Images come later by `delay`.
    CameraLate,
    /// Every pixel of an image is not a number.
    CameraBlank,
    /// The odometry's frame jumps once, by `distance` and `turn`.
    OdometryJump,
    /// A joint's reading is not a number.
    ReadingNotFinite,
    /// Fingers that stand open do not close.
    FingersStuck,
    /// The fingers open for `slip` on the way to the bucket.
    FruitLost,
    /// A limb above the arm breaks, once.
    LimbFalls,
    /// A weight of `load` hangs on the wrist, as of a limb from elsewhere that lies on it.
    WeightOnArm,
}

impl FaultKind {
    /// True of faults of sensors and hand, which act between a robot and its controller; the others, if any, are the world's.
    pub fn is_between(self) -> bool {
        !matches!(self, Self::None | Self::LimbFalls | Self::WeightOnArm)
    }
}

/// Name in configs.
impl std::fmt::Display for FaultKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match toml::Value::try_from(self) {
            Ok(toml::Value::String(name)) => f.write_str(&name),
            _ => Err(std::fmt::Error),
        }
    }
}

/// A fault, the time for which it lasts, and the figures of its kinds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaultSpec {
    /// Kind.
    pub kind: FaultKind,
    /// Time of the episode at which it begins.
    pub from: Quantity,
    /// Time of the episode at which it ends.
    pub until: Quantity,
    /// Additional delay of late images.
    pub delay: Quantity,
    /// Way of the odometry's frame in a jump, along its x axis.
    pub distance: Quantity,
    /// Turn of the odometry's frame in a jump.
    pub turn: Quantity,
    /// Time for which the fingers open on the way to the bucket, and time from the break of the stem to then.
    pub slip: Quantity,
    /// Mass of a limb that falls, with its fruit.
    pub limb_mass: Span,
    /// Largest distance from a point of the limb to the arm below it, seen from above.
    pub limb_distance: Quantity,
    /// Largest height of that point above the arm.
    pub limb_height: Quantity,
    /// Weight on the wrist.
    pub load: Quantity,
}

impl FaultSpec {
    /// True at a time of the episode \[s\] at which the fault lasts; never with the kind [`FaultKind::None`].
    pub fn lasts(&self, time: f64) -> bool {
        self.kind != FaultKind::None && (self.from.si()..self.until.si()).contains(&time)
    }
}

impl<'de> Deserialize<'de> for FaultSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Given {
            kind,
            from,
            until,
            delay,
            distance,
            turn,
            slip,
            limb_mass,
            limb_distance,
            limb_height,
            load,
        } = Given::deserialize(deserializer)?;
        if until.si() < from.si() {
            let problem = format!("until {} s is before from {} s", until.si(), from.si());
            return Err(serde::de::Error::custom(problem));
        }
        Ok(Self {
            kind,
            from,
            until,
            delay,
            distance,
            turn,
            slip,
            limb_mass,
            limb_distance,
            limb_height,
            load,
        })
    }
}

/// A fault as a file gives it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    kind: FaultKind,
    from: Quantity,
    until: Quantity,
    #[serde(deserialize_with = "delay")]
    delay: Quantity,
    distance: Quantity,
    turn: Quantity,
    slip: Quantity,
    limb_mass: Span,
    limb_distance: Quantity,
    limb_height: Quantity,
    load: Quantity,
}

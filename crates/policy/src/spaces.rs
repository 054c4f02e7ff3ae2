//! Settings of a policy's interface: groups of observations, control, rate.

use orchard_geometry::Vec3;
use orchard_quantity::Quantity;
use orchard_robot::{PictureRequest, RobotModel};
use serde::{Deserialize, Serialize};

use crate::rules::PixelRules;
use crate::setting::SettingError;

/// Meaning of the numbers of an action that drive the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Control {
    /// Moves of the joints' set points.
    JointDelta,
    /// Places of the joints' set points.
    JointAbsolute,
    /// Moves and turns of the tool's set point, in axes of the base frame.
    EeDelta,
}

/// Kind of target that a policy is told, in group `state`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// Centre and radius of a named fruit.
    Fruit,
    /// A point for the tool, and the level direction in which it is pushed there.
    Point,
}

impl Target {
    /// The task in words; without a target it is the harvest.
    pub fn sentence(target: Option<Self>) -> &'static str {
        match target {
            None => "pick the apples and put them into the bucket",
            Some(Self::Fruit) => "grasp the named apple and hold it",
            Some(Self::Point) => "push the hand through the branches to the named point and break nothing",
        }
    }
}

/// Colour pictures of the wrist camera and of the fixed camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pixels {
    /// Rows.
    pub height: u32,
    /// Columns.
    pub width: u32,
    /// Pictures a second \[Hz\]; divides the frame rate.
    pub hz: u32,
}

/// The observations and actions of a policy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spaces {
    /// Observe joints, forces and base (`state`).
    pub state: bool,
    /// Observe the depth camera (`depth`).
    pub depth: bool,
    /// Observe colour pictures (`pixels`).
    pub pixels: Option<Pixels>,
    /// Observe the task in words (`task_description`).
    pub description: bool,
    /// Target that the task names; none if it names none.
    pub target: Option<Target>,
    /// Meaning of the arm's numbers.
    pub control: Control,
    /// Actions a second \[Hz\]; divides the frame rate.
    pub control_hz: u32,
}

/// Actions a second unless asked otherwise.
const CONTROL_HZ: u32 = 10;
/// Rows and columns of a picture unless asked otherwise, and the most that are drawn \[px\].
const SIDE: u32 = 128;
const SIDE_MAX: u32 = 1024;

/// A group of observations.
#[derive(Clone, Copy)]
enum Group {
    State,
    Depth,
    Pixels,
    Description,
}

/// The groups by name.
const GROUPS: [(&str, Group); 4] = [
    ("state", Group::State),
    ("depth", Group::Depth),
    ("pixels", Group::Pixels),
    ("task_description", Group::Description),
];

impl Control {
    /// All controls, by name.
    const ALL: [(&str, Self); 3] = [
        ("joint_delta", Self::JointDelta),
        ("joint_absolute", Self::JointAbsolute),
        ("ee_delta", Self::EeDelta),
    ];

    /// Finds a control by its name.
    ///
    /// # Errors
    /// No control has this name.
    pub fn named(name: &str) -> Result<Self, SettingError> {
        SettingError::choice("control", name, &Self::ALL)
    }
}

impl Default for Pixels {
    /// 128 x 128 pixels at 10 Hz.
    fn default() -> Self {
        Self { height: SIDE, width: SIDE, hz: CONTROL_HZ }
    }
}

impl Default for Spaces {
    /// `state` observed, no target, control `joint_delta` at 10 Hz.
    fn default() -> Self {
        Self {
            state: true,
            depth: false,
            pixels: None,
            description: false,
            target: None,
            control: Control::JointDelta,
            control_hz: CONTROL_HZ,
        }
    }
}

impl Spaces {
    /// Sets the groups of observations by their names: `state`, `depth`, `pixels` (of the default size and rate), `task_description`.
    ///
    /// # Errors
    /// A name that is no group, or none at all.
    pub fn observing(self, groups: &[&str]) -> Result<Self, SettingError> {
        let mut spaces = Self { state: false, depth: false, pixels: None, description: false, ..self };
        for group in groups {
            match SettingError::choice("obs", group, &GROUPS)? {
                Group::State => spaces.state = true,
                Group::Depth => spaces.depth = true,
                Group::Pixels => spaces.pixels = Some(Pixels::default()),
                Group::Description => spaces.description = true,
            }
        }
        if groups.is_empty() {
            let problem = format!("give at least one of {}", GROUPS.map(|(name, _)| name).join(", "));
            return Err(SettingError { option: "obs", value: "()".to_owned(), problem });
        }
        Ok(spaces)
    }

    /// Frames of an action at a frame rate \[Hz\].
    pub(crate) fn frames(&self, frame_rate: f64) -> Result<u32, SettingError> {
        frames_of("control_hz", self.control_hz, frame_rate)
    }
}

impl Pixels {
    /// The pictures of a robot's cameras at a frame rate \[Hz\], looked at every `look` frames.
    ///
    /// # Errors
    /// As [`Self::frames`].
    pub(crate) fn request(
        &self,
        robot: &RobotModel,
        rules: &PixelRules,
        frame_rate: f64,
        look: u32,
    ) -> Result<PictureRequest, SettingError> {
        let arm = robot.kinematics();
        let p_base = |from: &[Quantity; 3]| {
            arm.shoulder() + Vec3::new(from[0].si(), from[1].si(), from[2].si()) * arm.length()
        };
        Ok(PictureRequest {
            period: self.frames(frame_rate)?,
            look,
            size: [self.width as usize, self.height as usize],
            p_base_eye: p_base(&rules.eye),
            p_base_aim: p_base(&rules.aim),
            vertical_fov: rules.vertical_fov.si(),
            supersampling: rules.supersampling.get() as usize,
            sun_map: rules.sun_map.get() as usize,
            sky_map: rules.sky_map.get() as usize,
        })
    }

    /// Frames from picture to picture at a frame rate \[Hz\].
    ///
    /// # Errors
    /// A size out of range, or a rate that does not divide the frame rate.
    pub fn frames(&self, frame_rate: f64) -> Result<u32, SettingError> {
        if [self.height, self.width].iter().any(|side| !(1..=SIDE_MAX).contains(side)) {
            let value = format!("({}, {})", self.height, self.width);
            let problem = format!("rows and columns must be 1 to {SIDE_MAX}");
            return Err(SettingError { option: "pixels_size", value, problem });
        }
        frames_of("pixels_hz", self.hz, frame_rate)
    }
}

/// Frames of a period of a rate \[Hz\] at a frame rate \[Hz\].
fn frames_of(option: &'static str, hz: u32, frame_rate: f64) -> Result<u32, SettingError> {
    let rate = frame_rate.round() as u32;
    if hz == 0 || !rate.is_multiple_of(hz) {
        let problem = format!("it must divide the frame rate, {rate} Hz");
        return Err(SettingError { option, value: hz.to_string(), problem });
    }
    Ok(rate / hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_user_can_get_wrong() {
        let spaces = Spaces::default;
        let said = |result: Result<Spaces, SettingError>| result.unwrap_err().to_string();
        assert_eq!(
            said(spaces().observing(&["stat"])),
            "obs stat: unknown; it is one of state, depth, pixels, task_description"
        );
        assert_eq!(
            said(spaces().observing(&[])),
            "obs (): give at least one of state, depth, pixels, task_description"
        );
        for control_hz in [0, 7, 61] {
            let e = Spaces { control_hz, ..spaces() }.frames(60.0).unwrap_err().to_string();
            assert_eq!(e, format!("control_hz {control_hz}: it must divide the frame rate, 60 Hz"));
        }
        assert_eq!(spaces().frames(60.0).unwrap(), 6);
        let pixels = Pixels::default;
        assert_eq!(Pixels { hz: 30, ..pixels() }.frames(60.0), Ok(2));
        let e = Pixels { hz: 24, ..pixels() }.frames(60.0).unwrap_err().to_string();
        assert_eq!(e, "pixels_hz 24: it must divide the frame rate, 60 Hz");
        let e = Pixels { width: 1025, ..pixels() }.frames(60.0).unwrap_err().to_string();
        assert_eq!(e, "pixels_size (128, 1025): rows and columns must be 1 to 1024");
    }
}

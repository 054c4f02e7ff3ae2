//! Observations of a robot as arrays, and arrays as its commands.

use std::sync::Arc;

use orchard_robot::{Command, JointValues, PictureRequest, RobotModel};

use crate::action::{Channel, Drive, Motion};
use crate::interface::{Conventions, Interface};
use crate::rules::Scales;
use crate::sensors::{Reading, Sensors, Values};
use crate::setting::SettingError;
use crate::spaces::{Pixels, Spaces};

/// The encoding of a robot's observations and actions for a policy.
pub struct Encoding {
    interface: Interface,
    drive: Drive,
    sensors: Sensors,
    pictures: Option<Arc<PictureRequest>>,
}

impl Encoding {
    /// Makes the encoding of a robot whose depth images have `width` times `height` pixels, at a frame rate \[Hz\].
    ///
    /// # Errors
    /// A rate that does not divide the frame rate, or pictures of a size that is not drawn.
    pub fn new(
        robot: &RobotModel,
        spaces: &Spaces,
        depth_size: [usize; 2],
        frame_rate: f64,
    ) -> Result<Self, SettingError> {
        let (scales, frames) = (Scales::v1(), spaces.frames(frame_rate)?);
        let request =
            |pixels: Pixels| pixels.request(robot, &scales.pixels, frame_rate, frames).map(Arc::new);
        let pictures = spaces.pixels.map(request).transpose()?;
        let period = f64::from(frames) / frame_rate;
        let drive = Drive::new(robot, spaces.control, &scales, frames, period);
        let sensors = Sensors::new(robot, spaces, depth_size);
        let interface = Interface {
            encoding: scales.version,
            spaces: spaces.clone(),
            frames,
            frame: 1.0 / frame_rate,
            conventions: Conventions::V1,
            action: drive.channels.clone(),
            observation: sensors.fields.clone(),
        };
        Ok(Self { interface, drive, sensors, pictures })
    }

    /// The pictures that are observed; none if they are not.
    pub fn pictures(&self) -> Option<&Arc<PictureRequest>> {
        self.pictures.as_ref()
    }

    /// The conventions.
    pub fn interface(&self) -> &Interface {
        &self.interface
    }

    /// The arm's set points at the start of an episode \[rad\].
    pub fn start(&self) -> JointValues {
        self.drive.start()
    }

    /// The first number of an action that is not finite, with its description.
    pub fn refused(&self, action: &[f32]) -> Option<(&Channel, f32)> {
        let mut numbers = self.interface.action.iter().zip(action.iter().copied());
        numbers.find(|(_, value)| !value.is_finite())
    }

    /// The motion of an action, one number a channel, after the set points at the end of the last one.
    pub fn motion(&self, action: &[f32], last: &JointValues) -> Motion {
        self.drive.motion(action, last)
    }

    /// The action, one number a channel, whose motion comes nearest to the commands of the first frames of a step, or of all: its set points end
    /// at the last ones, carried on by their speeds to the step's end; the base has their mean velocity, and the hand follows the last one.
    pub fn action(&self, commands: &[Command], last: &JointValues) -> Vec<f32> {
        self.drive.action(commands, last)
    }

    /// Largest difference between a motion and a controller's commands of its frames in each channel, in the channel's unit (of arm joints:
    /// between set points, rad).
    pub fn error(&self, motion: &Motion, commands: &[Command]) -> Vec<f64> {
        self.drive.error(motion, commands)
    }

    /// The arrays of an observation, one for each field of [`Interface::observation`].
    pub fn read(&self, reading: &Reading<'_>) -> Vec<Values> {
        self.sensors.read(reading)
    }
}

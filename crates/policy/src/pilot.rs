//! A robot driven by the actions of a policy, frame by frame.

use std::sync::Arc;

use orchard_geometry::DepthImage;
use orchard_robot::{Command, JointValues, Observation, Pictures};

use crate::action::Motion;
use crate::encoding::Encoding;
use crate::sensors::{DepthReading, Reading, Values};

/// Drives a robot by the actions of a policy through one episode. In each frame it takes the observation ([`Self::see`]), then an action if one
/// is due ([`Self::act`]), and gives the frame's command ([`Self::command`]). The environments of `orchard-env` read and move in the same frames.
pub struct Pilot {
    encoding: Arc<Encoding>,
    /// Target as it is told, as in [`Reading::target`].
    target: Option<[f64; 4]>,
    /// Frames since the action began.
    frame: u32,
    set: JointValues,
    motion: Option<Motion>,
    /// The latest image and its time \[s\], and the latest pictures.
    image: Option<(DepthImage, f64)>,
    pictures: Option<Arc<Pictures>>,
}

impl Pilot {
    /// Drives by an encoding from the start of an episode. The policy is told of the target, if the spaces have one.
    pub fn new(encoding: Arc<Encoding>, target: Option<[f64; 4]>) -> Self {
        let set = encoding.start();
        Self { encoding, target, frame: 0, set, motion: None, image: None, pictures: None }
    }

    /// The encoding.
    pub fn encoding(&self) -> &Encoding {
        &self.encoding
    }

    /// Takes the observation of a frame; returns the policy's own, as [`Encoding::read`] does, in frames in which an action is due.
    pub fn see(&mut self, sensed: &Observation) -> Option<Vec<Values>> {
        if let Some(image) = &sensed.depth {
            self.image = Some((image.clone(), sensed.depth_time));
        }
        if sensed.pictures.is_some() {
            self.pictures.clone_from(&sensed.pictures);
        }
        if self.motion.is_some() && self.frame < self.encoding.interface().frames {
            return None;
        }
        let depth = self.image.as_ref().map(|(image, time)| DepthReading { image: Some(image), time: *time });
        Some(self.encoding.read(&Reading {
            sensed,
            depth,
            pictures: self.pictures.as_deref(),
            target: self.target,
            description: None,
        }))
    }

    /// Takes the action that is due, one number a channel.
    pub fn act(&mut self, action: &[f32]) {
        let motion = self.encoding.motion(action, &self.set);
        self.set = motion.end();
        self.motion = Some(motion);
        self.frame = 0;
    }

    /// The command of the frame; before the first action that of no motion.
    pub fn command(&mut self, sensed: &Observation) -> Command {
        let Some(motion) = &self.motion else { return Command::still(sensed) };
        let command = motion.command(self.frame);
        self.frame += 1;
        command
    }

    /// The command that holds the robot where the last action ended: the arm's set points and the hand stay, the base stands.
    pub fn hold(&self, sensed: &Observation) -> Command {
        let last = self.motion.as_ref().map_or_else(|| Command::still(sensed), |motion| motion.command(0));
        Command {
            arm_q: self.set,
            arm_v: JointValues::zeros(self.set.len()),
            base_velocity: [0.0; 3],
            ..last
        }
    }
}

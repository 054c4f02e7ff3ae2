//! Images of a world's wrist camera, with their ground truth.

use orchard_camera::{
    Capture, Exposure, Frame, FruitView, ImageKey, MovingScene, Scene, Sensor, fruit_views,
};
use orchard_geometry::{DepthImage, Image, Pose};
use orchard_multibody::{Data, Motion};
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};

/// An image of the wrist camera before it is drawn: the scene, the camera's pose, and the key of its noise.
#[derive(Debug, Clone)]
pub struct Sight {
    /// Frame of the world in which the image is taken.
    pub frame: u32,
    /// Everything that can be seen in the world.
    pub visible: Arc<MovingScene>,
    /// Pose of each body of it.
    pub x_world_body: Vec<Pose>,
    /// Pose of the optical frame.
    pub x_world_camera: Pose,
    /// Key of its errors.
    pub key: ImageKey,
    /// The camera.
    pub sensor: Arc<Sensor>,
}

impl Sight {
    /// The scene that it shows.
    pub fn scene(&self) -> Scene {
        self.visible.posed(&self.x_world_body)
    }

    /// The exact image that is to be drawn ([`Sensor::exposure`]).
    pub fn exposure(&self) -> Exposure {
        self.sensor.exposure(&self.x_world_camera)
    }

    /// Takes the image, drawn here.
    pub(crate) fn take(self) -> CameraTruth {
        let Capture { measured, truth } = self.sensor.capture(&self.scene(), &self.x_world_camera, self.key);
        CameraTruth { measured: measured.into(), truth: truth.into(), ..self.undrawn() }
    }

    /// The image, whose pixels are drawn elsewhere and stay there.
    pub fn undrawn(self) -> CameraTruth {
        let (measured, truth, fruit) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        CameraTruth { measured, colour: None, sight: self, truth, fruit }
    }

    /// Makes the image of the depths of [`Self::exposure`], drawn elsewhere.
    pub fn taken_from(self, seen: &DepthImage) -> CameraTruth {
        let measured = self.sensor.measure(seen, self.key);
        self.measured(measured)
    }

    /// The image whose depths were measured elsewhere, as its camera measures with its key.
    pub fn measured(self, measured: DepthImage) -> CameraTruth {
        CameraTruth { measured: measured.into(), ..self.undrawn() }
    }
}

/// One image of the wrist camera with the truth behind it, which is drawn when it is asked for.
#[derive(Debug, Clone)]
pub struct CameraTruth {
    measured: OnceLock<DepthImage>,
    /// Colour (sRGB), registered to depth and of its size, if the camera takes colour ([`World::deliver_colour`](crate::World::deliver_colour)).
    pub colour: Option<Arc<Image<[u8; 3]>>>,
    /// The scene and the camera.
    pub sight: Sight,
    truth: OnceLock<Frame>,
    fruit: OnceLock<Vec<FruitView>>,
}

impl CameraTruth {
    /// Measured depth along the optical axis \[m\], 0 without a measurement. An image that was drawn elsewhere and stayed there ([`World::deliver_undrawn`](crate::World::deliver_undrawn)) is drawn here now.
    pub fn measured(&self) -> &DepthImage {
        let Sight { sensor, key, .. } = &self.sight;
        self.measured
            .get_or_init(|| sensor.measure(&self.sight.exposure().draw(&self.sight.scene()).depth, *key))
    }

    /// True depth, labels and instances ([`Capture::truth`]).
    pub fn truth(&self) -> &Frame {
        let Sight { sensor, x_world_camera, .. } = &self.sight;
        self.truth.get_or_init(|| sensor.truth(&self.sight.scene(), x_world_camera))
    }

    /// Visible part of each fruit, by fruit index.
    pub fn fruit(&self) -> &[FruitView] {
        let Sight { sensor, x_world_camera, .. } = &self.sight;
        self.fruit.get_or_init(|| {
            fruit_views(self.truth(), &self.sight.scene(), sensor.intrinsics(), x_world_camera)
        })
    }
}

/// Period and latency of the camera, in frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shutter {
    period: u32,
    /// Frames from the moment that an image shows to its delivery.
    pub latency: u32,
}

impl Shutter {
    pub fn new(spec: &Spec) -> Self {
        let frames = |time: f64| (spec.sim.frame_rate.si() * time).round() as u32;
        let period = (spec.sim.frame_rate.si() / spec.camera.view().rate.si()).round().max(1.0) as u32;
        let delay = spec.sensing.as_ref().map_or(0.0, |sensing| sensing.camera_delay.si());
        Self { period, latency: frames(spec.camera.latency() + delay) }
    }

    /// Frame in which the image was taken that is delivered in a frame, if one is.
    pub fn taken(self, frame: u32) -> Option<u32> {
        frame.checked_sub(self.latency).filter(|taken| taken.is_multiple_of(self.period))
    }

    /// True if an image is taken in a frame that is delivered later.
    pub fn keeps(self, frame: u32) -> bool {
        self.latency > 0 && frame.is_multiple_of(self.period)
    }
}

/// Frame and motion of a depth image: enough to draw it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Shot {
    pub frame: u32,
    pub motion: Motion,
}

/// Images of a camera with latency that are taken and not past their delivery, oldest first. They are drawn when they
/// are delivered.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Flight(VecDeque<Shot>);

impl Flight {
    /// Ends a frame: drops the images delivered before it, and takes an image if one is due. A camera without latency
    /// has none in flight.
    pub fn end_frame(&mut self, shutter: Shutter, frame: u32, data: &Data) {
        let due = |shot: &Shot| shot.frame.saturating_add(shutter.latency);
        let mut old = None;
        while self.0.front().is_some_and(|shot| due(shot) < frame) {
            old = self.0.pop_front();
        }
        if shutter.keeps(frame) {
            // Reuses the memory of an old one.
            let mut shot = old.unwrap_or_default();
            shot.frame = frame;
            data.save_motion(&mut shot.motion);
            self.0.push_back(shot);
        }
    }

    /// The image that was taken in a frame.
    pub fn taken_in(&self, frame: u32) -> Option<&Shot> {
        self.0.iter().find(|shot| shot.frame == frame)
    }

    #[cfg(test)]
    pub fn of(shot: Shot) -> Self {
        Self(VecDeque::from([shot]))
    }

    /// All of them.
    pub fn shots(&self) -> impl Iterator<Item = &Shot> {
        self.0.iter()
    }
}

#[cfg(test)]
#[path = "camera_tests.rs"]
mod tests;

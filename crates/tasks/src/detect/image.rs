//! Depth images of a tree: the detector's input and the ground truth.

use orchard_camera::picture::Studio;
use orchard_camera::{Frame, FruitView, ImageKey, Scene, Sensor, fruit_views};
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Vec3};
use orchard_perception::mask::ground_mask;
use orchard_perception::{Detection, DetectorConfig, PerceptionError, RgbdImage, detect};

/// One image: input of the detector and ground truth.
pub(crate) struct View {
    pub(crate) sight: DetectorInput,
    pub(crate) x_world_camera: Pose,
    /// True depth, label and instance by pixel.
    pub(crate) truth: Frame,
    /// Visibility of each fruit in the image.
    pub(crate) fruit: Vec<FruitView>,
}

/// Input of the detector.
pub(crate) struct DetectorInput {
    pub(crate) depth: DepthImage,
    /// Colour, for a detector that looks at it.
    pub(crate) colour: Option<Image<[u8; 3]>>,
    pub(crate) intrinsics: Intrinsics,
    /// Pixels of the ground, by the camera's pose.
    pub(crate) ignored: Image<bool>,
}

impl View {
    /// Takes an image, with colour if there is a `studio`.
    pub(crate) fn take(
        sensor: &Sensor,
        (scene, studio): (&Scene, Option<&Studio<'_>>),
        x_world_camera: &Pose,
        key: ImageKey,
        ground_margin: f64,
    ) -> Self {
        let capture = sensor.capture(scene, x_world_camera, key);
        let intrinsics = *sensor.intrinsics();
        let fruit = fruit_views(&capture.truth, scene, &intrinsics, x_world_camera);
        let up_camera = x_world_camera.rotation.inverse() * Vec3::z();
        let height = x_world_camera.translation.z;
        let ignored = ground_mask(&capture.measured, &intrinsics, &up_camera, height, ground_margin);
        let colour = studio.map(|studio| studio.picture(&intrinsics, x_world_camera));
        let sight = DetectorInput { depth: capture.measured, colour, intrinsics, ignored };
        Self { sight, x_world_camera: *x_world_camera, truth: capture.truth, fruit }
    }
}

impl DetectorInput {
    /// Runs the detector on the image.
    pub(crate) fn detect(&self, config: &DetectorConfig) -> Result<Vec<Detection>, PerceptionError> {
        let image = RgbdImage { depth: &self.depth, colour: self.colour.as_ref() };
        detect(image, &self.intrinsics, Some(&self.ignored), config)
    }

    /// Runs the detector on the image; returns its detections, and the spheres of at least `least` that its score alone refused.
    pub(crate) fn ranked(
        &self,
        config: &DetectorConfig,
        least: f64,
    ) -> Result<(Vec<Detection>, Vec<Detection>), PerceptionError> {
        let threshold = &config.score.least;
        let mut lenient = config.clone();
        // A config whose range excludes so small a score has no such spheres.
        lenient.score.least = threshold.with_value(least.min(threshold.si())).unwrap_or(threshold.clone());
        let all = self.detect(&lenient)?;
        Ok(all.into_iter().partition(|d| !config.score.on || d.score >= threshold.si()))
    }
}

//! Perception of the picker: depth images to fruit tracks, a point memory and a belief of the tree's position.

use crate::cloud::{Pieces, SeenPoint};
use crate::config::{BeliefConfig, CloudConfig, PickerConfig};
use crate::record::ImageReport;
use crate::robot_state::RobotState;
use crate::wires::{WiresConfig, thin_points};
use crate::wood_memory::WoodMemory;
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Shape, Vec3, inverse_transform, transform};
use orchard_perception::{Detection, DetectorConfig, RgbdImage, Sighting, Tracker, detect, mask};
use orchard_robot::ArmKinematics;
use std::collections::VecDeque;

/// Detector, tracker, point memory and tree belief of a picker.
#[derive(Debug, Clone)]
pub(crate) struct Perception {
    detector: DetectorConfig,
    config: CloudConfig,
    /// Half-extents of the deck, base frame.
    deck: Vec3,
    pub tracker: Tracker,
    pub belief: Belief,
    clouds: VecDeque<Vec<SeenPoint>>,
    wood: WoodMemory,
    /// Points of the last image that may show wires, odom \[m\]; none if it was not looked through for them.
    pub thin: Vec<Vec3>,
    /// Fruit of the last image, odom.
    pub sightings: Vec<Sighting>,
    /// Number of images taken.
    pub images: u32,
    /// True if the last image had too few valid pixels to act on.
    pub blind: bool,
    /// Share of the last image's pixels that show the canopy: neither robot nor ground, and near the believed tree. `None` before the
    /// first image.
    pub canopy_share: Option<f64>,
    /// Time of the last image that was not blind \[s\].
    pub last_sight: f64,
}

/// Belief of the position of the tree's axis, odom.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Belief {
    config: BeliefConfig,
    /// The start belief: straight ahead at the protocol's start distance.
    p_start: Vec3,
    /// Sum of the observed centres of the canopy.
    sum: Vec3,
    images: u32,
}

impl Belief {
    fn new(config: &BeliefConfig) -> Self {
        let p_start = Vec3::new(config.start_distance.si(), 0.0, 0.0);
        Self { config: config.clone(), p_start, sum: Vec3::zeros(), images: 0 }
    }

    /// Mean of the start belief, which weighs as much as some images, and the observed centres of the canopy \[m\].
    pub fn p_odom(&self) -> Vec3 {
        let prior = f64::from(self.config.prior_images.get());
        (self.p_start * prior + self.sum) / (prior + f64::from(self.images))
    }

    fn is_canopy(&self, p_odom: &Vec3) -> bool {
        let d = p_odom - self.p_odom();
        d.xy().norm() <= self.config.canopy_radius.si()
    }

    fn see(&mut self, canopy: &[Vec3]) {
        if !canopy.is_empty() {
            let sum: Vec3 = canopy.iter().sum();
            let centre = sum / canopy.len() as f64;
            self.sum += Vec3::new(centre.x, centre.y, 0.0);
            self.images += 1;
        }
    }
}

impl Perception {
    /// Makes the perception before the first image. `deck`: half-extents of the robot's deck, base frame \[m\].
    pub fn new(detector: DetectorConfig, config: &PickerConfig, deck: Vec3) -> Self {
        Self {
            tracker: Tracker::new(&detector),
            detector,
            deck,
            config: config.cloud.clone(),
            belief: Belief::new(&config.belief),
            clouds: VecDeque::new(),
            wood: WoodMemory::default(),
            thin: Vec::new(),
            sightings: Vec::new(),
            images: 0,
            blind: true,
            canopy_share: None,
            last_sight: f64::NEG_INFINITY,
        }
    }

    /// Processes an image and returns a report of its detections. `robot` is the robot's state when the image was taken. With `wires` it is looked through for
    /// them.
    pub fn see(
        &mut self,
        image: RgbdImage<'_>,
        intrinsics: &Intrinsics,
        robot: &RobotState,
        arm: &ArmKinematics,
        wires: Option<&WiresConfig>,
    ) -> ImageReport {
        let depth = image.depth;
        self.images = self.images.wrapping_add(1);
        let x_base_camera = arm.camera(&robot.q);
        let x_odom_camera = robot.x_odom_base * x_base_camera;
        self.blind = !self.shows(depth);
        if !self.blind {
            self.last_sight = robot.time;
        }

        let shapes = visible_shapes(arm, robot, &x_base_camera, intrinsics);
        let up_camera = x_base_camera.rotation.inverse() * Vec3::z();
        let margins = &self.detector.mask;
        let mut ignored = mask::self_mask(depth, intrinsics, &shapes, margins.robot_margin.si());
        let height = x_base_camera.translation.z;
        let ground = mask::ground_mask(depth, intrinsics, &up_camera, height, margins.ground_margin.si());
        mask::add(&mut ignored, &ground);

        // An image that the detector refuses has no detections.
        let detections = detect(image, intrinsics, Some(&ignored), &self.detector).unwrap_or_default();
        // A detector whose gates decide tells no probability.
        let score = |d: &Detection| if self.detector.score.on { d.score } else { 1.0 };
        let p_odom = |d: &Detection| transform(&x_odom_camera, &d.p_camera);
        self.sightings = detections
            .iter()
            .map(|d| Sighting { p_odom: p_odom(d), radius: d.radius, score: score(d) })
            .collect();
        let not_on_deck: Vec<Sighting> =
            self.sightings.iter().filter(|s| !self.over_deck(&s.p_odom, robot)).copied().collect();
        self.tracker.update(robot.time, &not_on_deck);
        if self.config.forget_vanished {
            self.forget_vanished(depth, intrinsics, &x_odom_camera);
        }
        self.remember(depth, intrinsics, &ignored, &x_odom_camera);
        let thin = |c| thin_points(depth, intrinsics, &ignored, &x_odom_camera, c);
        self.thin = wires.map(thin).unwrap_or_default();
        ImageReport { time: robot.time, detections: self.sightings.clone() }
    }

    /// True if an image has enough valid pixels to act on.
    pub fn shows(&self, depth: &DepthImage) -> bool {
        let valid = depth.pixels().iter().filter(|z| z.is_finite() && **z > 0.0).count();
        valid as f64 >= self.config.blind_fraction.si() * depth.pixels().len() as f64
    }

    /// True if a point of the odom frame lies above the robot's deck, where only picked fruit can be.
    fn over_deck(&self, p_odom: &Vec3, robot: &RobotState) -> bool {
        let p = inverse_transform(&robot.x_odom_base, p_odom);
        p.x.abs() <= self.deck.x && p.y.abs() <= self.deck.y
    }

    /// Drops the tracks whose position the camera sees through: the fruit is gone or its branch has moved.
    fn forget_vanished(&mut self, depth: &DepthImage, intrinsics: &Intrinsics, x_odom_camera: &Pose) {
        let gone: Vec<u32> = self
            .tracker
            .tracks()
            .iter()
            .filter(|t| {
                let p_camera = inverse_transform(x_odom_camera, &t.p_odom);
                seen_through(depth, intrinsics, &p_camera, t.radius)
            })
            .map(|t| t.id)
            .collect();
        for id in gone {
            self.tracker.forget(id);
        }
    }

    fn remember(
        &mut self,
        depth: &DepthImage,
        intrinsics: &Intrinsics,
        ignored: &Image<bool>,
        x_odom_camera: &Pose,
    ) {
        let stride = self.config.stride.get().max(1) as usize;
        let pieces = Pieces::of(depth, intrinsics, ignored, &self.config);
        let (mut near, mut canopy) = (Vec::new(), Vec::new());
        let mut pixels = 0_u32;
        for v in (0..depth.height()).step_by(stride) {
            for u in (0..depth.width()).step_by(stride) {
                let z = f64::from(depth[(u, v)]);
                pixels += 1;
                if !z.is_finite() || z <= 0.0 || ignored[(u, v)] {
                    continue;
                }
                let p_odom = transform(x_odom_camera, &intrinsics.back_project(u as f64, v as f64, z));
                if self.belief.is_canopy(&p_odom) {
                    canopy.push(p_odom);
                }
                if z <= self.config.range.si() {
                    near.push(SeenPoint { p: p_odom, is_wood: pieces.is_wood(u, v) });
                }
            }
        }
        self.belief.see(&canopy);
        self.canopy_share = Some(canopy.len() as f64 / f64::from(pixels.max(1)));
        self.wood.see(&near, self.images, &self.config);
        self.clouds.push_back(near);
        while self.clouds.len() > self.config.images.get() as usize {
            self.clouds.pop_front();
        }
    }

    /// Points of the last images, and wood remembered from earlier ones, odom \[m\].
    pub fn points(&self) -> impl Iterator<Item = SeenPoint> {
        let kept = u32::try_from(self.clouds.len()).unwrap_or(u32::MAX);
        let earlier = self.wood.until(self.images.saturating_sub(kept), &self.config);
        self.clouds.iter().flatten().copied().chain(earlier)
    }
}

/// True if all pixels about the centre of a ball at `p_camera` measure a depth behind the ball.
fn seen_through(depth: &DepthImage, intrinsics: &Intrinsics, p_camera: &Vec3, radius: f64) -> bool {
    let Some((u, v)) = intrinsics.project(p_camera) else { return false };
    let (u, v) = (u.round(), v.round());
    let (last_u, last_v) = (depth.width() as f64 - 2.0, depth.height() as f64 - 2.0);
    if !(u >= 1.0 && v >= 1.0 && u <= last_u && v <= last_v) {
        return false;
    }
    let (u, v) = (u as usize, v as usize);
    let behind = p_camera.z + radius;
    (u - 1..=u + 1).all(|u| (v - 1..=v + 1).all(|v| f64::from(depth[(u, v)]) > behind))
}

/// Returns the robot's shapes that can be in the image, in the camera frame: those in front of the camera whose bounding ball reaches into
/// the cone about the image's corners.
fn visible_shapes(
    arm: &ArmKinematics,
    robot: &RobotState,
    x_base_camera: &Pose,
    intrinsics: &Intrinsics,
) -> Vec<(Shape, Pose)> {
    let x_camera_base = x_base_camera.inverse();
    let corner = intrinsics.ray(0.0, 0.0).normalize();
    let other = intrinsics.ray(intrinsics.width as f64, intrinsics.height as f64).normalize();
    let cos = corner.z.min(other.z);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let in_view = |(shape, x): &(Shape, Pose)| {
        let bounds = shape.aabb(x);
        let (centre, radius) = ((bounds.min + bounds.max) * 0.5, (bounds.max - bounds.min).norm() * 0.5);
        // Distance of the ball's centre outside the cone, for centres before the apex.
        let outside = centre.xy().norm() * cos - centre.z * sin;
        bounds.max.z > 0.0 && outside <= radius
    };
    arm.link_shapes(&robot.q, &robot.finger_q)
        .into_iter()
        .map(|(shape, x)| (shape, x_camera_base * x))
        .filter(in_view)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_belief_starts_at_the_protocols_distance_and_follows_what_is_seen() {
        let config = PickerConfig::baseline().belief;
        let mut belief = Belief::new(&config);
        let start = Vec3::new(config.start_distance.si(), 0.0, 0.0);
        assert_eq!(belief.p_odom(), start);
        belief.see(&[]);
        assert_eq!(belief.p_odom(), start);
        let off = Vec3::new(0.6, -0.5, 0.0);
        let canopy = [start + off + Vec3::new(0.1, 0.0, 1.0), start + off - Vec3::new(0.1, 0.0, -1.5)];
        let prior = f64::from(config.prior_images.get());
        for seen in 1..=100 {
            belief.see(&canopy);
            let expected = start + off * (f64::from(seen) / (prior + f64::from(seen)));
            // A hundred roundings of sums up to 300 m, divided by the count.
            assert!((belief.p_odom() - expected).norm() < 1e-12);
        }
    }
}

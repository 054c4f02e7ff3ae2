//! From depth images to fruit tracks, a point memory and a belief of where the tree stands.

use crate::config::{BeliefConfig, CloudConfig, PickerConfig};
use crate::record::ImageReport;
use crate::robot_state::RobotState;
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Shape, Vec3, inverse_transform, transform};
use orchard_perception::{DetectorConfig, Sighting, Tracker, detect, mask};
use orchard_robot::ArmKinematics;
use std::collections::VecDeque;

/// Everything that the picker has seen.
#[derive(Debug, Clone)]
pub(crate) struct Eyes {
    detector: DetectorConfig,
    config: CloudConfig,
    /// Half-extents of the deck, base frame.
    deck: Vec3,
    pub tracker: Tracker,
    pub belief: Belief,
    clouds: VecDeque<Vec<Vec3>>,
    /// Fruit of the last image, odom.
    pub sightings: Vec<Sighting>,
    /// Images taken.
    pub images: u32,
    /// Whether the last image had too few valid pixels to act on.
    pub blind: bool,
    /// Time of the last image that was not blind [s].
    pub last_sight: f64,
}

/// Where the tree's axis is believed to be, odom.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Belief {
    config: BeliefConfig,
    /// The start belief: straight ahead at the protocol's start distance.
    p_start: Vec3,
    /// Sum of the canopy's centres seen.
    sum: Vec3,
    images: u32,
}

impl Belief {
    fn new(config: &BeliefConfig) -> Self {
        let p_start = Vec3::new(config.start_distance.si(), 0.0, 0.0);
        Self { config: config.clone(), p_start, sum: Vec3::zeros(), images: 0 }
    }

    /// Mean of the start belief, which counts as some images, and the canopy's centres seen.
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

impl Eyes {
    /// Nothing seen yet. `deck`: half-extents of the robot's deck, base frame.
    pub fn new(detector: DetectorConfig, config: &PickerConfig, deck: Vec3) -> Self {
        Self {
            tracker: Tracker::new(&detector),
            detector,
            deck,
            config: config.cloud.clone(),
            belief: Belief::new(&config.belief),
            clouds: VecDeque::new(),
            sightings: Vec::new(),
            images: 0,
            blind: true,
            last_sight: f64::NEG_INFINITY,
        }
    }

    /// Takes an image; what it showed goes into the report. `robot` is the robot's state at the moment that the image shows.
    pub fn see(
        &mut self,
        depth: &DepthImage,
        intrinsics: &Intrinsics,
        robot: &RobotState,
        arm: &ArmKinematics,
    ) -> ImageReport {
        self.images = self.images.wrapping_add(1);
        let x_base_camera = arm.camera(&robot.q);
        let x_odom_camera = robot.x_odom_base * x_base_camera;
        let valid = depth.pixels().iter().filter(|z| z.is_finite() && **z > 0.0).count();
        self.blind = (valid as f64) < self.config.blind_fraction.si() * depth.pixels().len() as f64;
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

        // A detector that refuses the image sees nothing in it.
        let detections = detect(depth, intrinsics, Some(&ignored), &self.detector).unwrap_or_default();
        self.sightings = detections
            .iter()
            .map(|d| Sighting { p_odom: transform(&x_odom_camera, &d.p_camera), radius: d.radius })
            .collect();
        let on_the_tree: Vec<Sighting> =
            self.sightings.iter().filter(|s| !self.over_deck(&s.p_odom, robot)).copied().collect();
        self.tracker.update(robot.time, &on_the_tree);
        self.forget_vanished(depth, intrinsics, &x_odom_camera);
        self.remember(depth, intrinsics, &ignored, &x_odom_camera);
        ImageReport { time: robot.time, detections: self.sightings.clone() }
    }

    /// Whether a point of the odom frame lies over the robot's deck, where only picked fruit can be.
    fn over_deck(&self, p_odom: &Vec3, robot: &RobotState) -> bool {
        let p = inverse_transform(&robot.x_odom_base, p_odom);
        p.x.abs() <= self.deck.x && p.y.abs() <= self.deck.y
    }

    /// Forgets the tracks whose place the camera looks right through: the fruit has gone or its branch moved.
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
        let (mut near, mut canopy) = (Vec::new(), Vec::new());
        for v in (0..depth.height()).step_by(stride) {
            for u in (0..depth.width()).step_by(stride) {
                let z = f64::from(depth[(u, v)]);
                if !z.is_finite() || z <= 0.0 || ignored[(u, v)] {
                    continue;
                }
                let p_odom = transform(x_odom_camera, &intrinsics.back_project(u as f64, v as f64, z));
                if self.belief.is_canopy(&p_odom) {
                    canopy.push(p_odom);
                }
                if z <= self.config.range.si() {
                    near.push(p_odom);
                }
            }
        }
        self.belief.see(&canopy);
        self.clouds.push_back(near);
        while self.clouds.len() > self.config.images.get() as usize {
            self.clouds.pop_front();
        }
    }

    /// Points of the last images, odom.
    pub fn points(&self) -> impl Iterator<Item = &Vec3> {
        self.clouds.iter().flatten()
    }
}

/// Whether all pixels about the centre of a ball at `p_camera` measure something well behind it.
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

/// The robot's shapes that can be in the image, camera frame: those in front of it whose bounding ball reaches
/// into the cone about the image's corners.
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
        let config = PickerConfig::paper().belief;
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

//! Watch over the robot's own sensors and hand: notices what is not as it should be, from the observations alone.

use crate::record::Alarm;
use crate::robot_state::{RobotState, turned};
use crate::section::section;
use orchard_geometry::{DepthImage, Pose, math};
use orchard_quantity::{Count, Quantity};

section! {
    /// Limits beyond which the picker raises an alarm.
    WatchConfig {
        /// Time without a usable image.
        silence: Quantity,
        /// Time with images that show nothing, the hand not near leaves, fruit or bucket.
        blindness: Quantity,
        /// Number of images without any change.
        same_images: Count,
        /// Motion of the camera that must change its image.
        motion: Quantity,
        /// Distance and angle between the odometry's pose and the one that its velocity leads to.
        jump: Quantity,
        jump_angle: Quantity,
        /// Weight that the arm bears at the hand, outside grasp and pull.
        load: Quantity,
        /// Time for which it must last.
        load_time: Quantity,
        /// Time between two tests of a hand that did not close.
        self_test: Quantity,
        /// Longest time for which the base draws a loaded arm out.
        draw: Quantity,
    }
}

/// Sight, odometry, load and hand of a robot, as far as they have been noticed.
#[derive(Debug, Clone)]
pub(crate) struct Watch {
    config: WatchConfig,
    /// Time without a usable image \[s\], and what has come instead.
    unsighted: f64,
    sight: Alarm,
    /// Last image with its camera's pose, and the number of images since without a change although the camera has moved.
    image: Option<(DepthImage, Pose)>,
    same: u32,
    /// From the odometry's frame to the one in which the base has moved without jumps; `None` without a jump.
    bridge: Option<[f64; 3]>,
    /// Time for which a large force has lasted, or has been gone \[s\].
    loaded: f64,
    /// Alarms that last.
    raised: Vec<Alarm>,
}

impl Watch {
    /// Makes a watch at the start of an episode.
    pub fn new(config: &WatchConfig) -> Self {
        Self {
            config: config.clone(),
            unsighted: 0.0,
            sight: Alarm::CameraSilent,
            image: None,
            same: 0,
            bridge: None,
            loaded: 0.0,
            raised: Vec::new(),
        }
    }

    /// Time with images that show nothing after which the camera counts as blind \[s\].
    pub fn blindness(&self) -> f64 {
        self.config.blindness.si()
    }

    /// True while an alarm lasts.
    pub fn has(&self, alarm: Alarm) -> bool {
        self.raised.contains(&alarm)
    }

    /// True while the camera gives no image that could be used.
    pub fn is_unsighted(&self) -> bool {
        self.raised.iter().any(|alarm| alarm.is_of_camera())
    }

    /// Raises a lasting alarm; true if it is new.
    pub fn raise(&mut self, alarm: Alarm) -> bool {
        let is_new = !self.has(alarm);
        if is_new {
            self.raised.push(alarm);
        }
        is_new
    }

    /// Ends a lasting alarm; true if there was one.
    pub fn end(&mut self, alarm: Alarm) -> bool {
        let before = self.raised.len();
        self.raised.retain(|raised| *raised != alarm);
        self.raised.len() < before
    }

    /// Moves the pose of the base back to where its velocity leads, if it has jumped away from there since the last state; later poses follow.
    /// Returns true at a jump. `gap` is the longest time between two states over which that can be told \[s\].
    pub fn bridge(&mut self, robot: &mut RobotState, last: Option<&RobotState>, gap: f64) -> bool {
        let measured = robot.clone();
        if let Some(bridge) = &self.bridge {
            robot.move_odom(bridge);
        }
        let Some(last) = last.filter(|last| robot.time > last.time && robot.time - last.time < gap) else {
            return false;
        };
        let dt = robot.time - last.time;
        let led: [f64; 3] = std::array::from_fn(|k| last.base_pose[k] + dt * last.base_velocity[k]);
        let off = math::hypot(robot.base_pose[0] - led[0], robot.base_pose[1] - led[1]);
        let turn = math::wrap_angle(robot.base_pose[2] - led[2]);
        if off <= self.config.jump.si() && turn.abs() <= self.config.jump_angle.si() {
            return false;
        }
        let yaw = led[2] - measured.base_pose[2];
        let [x, y] = turned([measured.base_pose[0], measured.base_pose[1]], yaw);
        let bridge = [led[0] - x, led[1] - y, yaw];
        *robot = measured;
        robot.move_odom(&bridge);
        self.bridge = Some(bridge);
        true
    }

    /// Takes an image in. `x_odom_camera` is the camera's pose when it was taken; `None` if that is not known any more. `shows` is false for one
    /// that shows nothing, `excused` true while the hand is near leaves, fruit or bucket, where that is no fault. Returns false for one that must not be used: it
    /// came too late, or is the last one again.
    pub fn take_image(
        &mut self,
        depth: &DepthImage,
        x_odom_camera: Option<Pose>,
        shows: bool,
        excused: bool,
    ) -> bool {
        let Some(x) = x_odom_camera else {
            self.sight = Alarm::CameraLate;
            return false;
        };
        if !shows {
            self.sight = Alarm::CameraBlind;
            if excused {
                self.unsighted = 0.0;
            }
            return true;
        }
        if let Some((last, at)) = &self.image
            && is_same(last, depth)
        {
            let moved = (at.inverse() * x).translation.vector.norm() + at.rotation.angle_to(&x.rotation);
            if moved > self.config.motion.si() {
                self.same = self.same.saturating_add(1);
            }
            if self.same >= self.config.same_images.get() {
                self.sight = Alarm::CameraFrozen;
            }
            if self.same == 0 {
                // A camera that stands still sees the same.
                self.unsighted = 0.0;
            }
            return self.same < self.config.same_images.get();
        }
        self.image = Some((depth.clone(), x));
        (self.same, self.unsighted) = (0, 0.0);
        true
    }

    /// Ends a frame of `dt` \[s\] for the camera: returns the alarms that begin or, with false, that end.
    pub fn look(&mut self, dt: f64) -> Vec<(Alarm, bool)> {
        let lasting = self.raised.iter().copied().find(|alarm| alarm.is_of_camera());
        if self.unsighted == 0.0 {
            self.unsighted = dt;
            self.sight = Alarm::CameraSilent;
            return lasting
                .filter(|alarm| self.end(*alarm))
                .map(|alarm| (alarm, false))
                .into_iter()
                .collect();
        }
        self.unsighted += dt;
        let c = &self.config;
        let limit = if self.sight == Alarm::CameraBlind { c.blindness.si() } else { c.silence.si() };
        let sight = self.sight;
        if self.unsighted <= limit || lasting == Some(sight) {
            return Vec::new();
        }
        // What comes instead of a usable image may change: first none, then late ones.
        let ended = lasting.filter(|alarm| self.end(*alarm)).map(|alarm| (alarm, false));
        self.raise(sight);
        ended.into_iter().chain([(sight, true)]).collect()
    }

    /// Takes the smoothed weight at the hand in \[N\]: returns true if a large one has begun to last, false if one has ended.
    pub fn feel(&mut self, force: f64, dt: f64) -> Option<bool> {
        let is_loaded = self.has(Alarm::ArmLoaded);
        let differs = (force > self.config.load.si()) != is_loaded;
        self.loaded = if differs { self.loaded + dt } else { 0.0 };
        if self.loaded < self.config.load_time.si() {
            return None;
        }
        self.loaded = 0.0;
        if is_loaded {
            self.end(Alarm::ArmLoaded)
        } else {
            self.raise(Alarm::ArmLoaded)
        };
        Some(!is_loaded)
    }
}

/// True if two images agree in every bit.
fn is_same(a: &DepthImage, b: &DepthImage) -> bool {
    let pixels = || a.pixels().iter().zip(b.pixels());
    a.pixels().len() == b.pixels().len() && pixels().all(|(a, b)| a.to_bits() == b.to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;

    const DT: f64 = 1.0 / 60.0;

    fn watch() -> Watch {
        Watch::new(&ExpertConfig::preset().watch)
    }

    /// A base that drives on evenly, whose odometry jumps, is where its velocity leads; afterwards its pose and velocity stay in the first frame.
    #[test]
    fn a_jump_of_the_odometry_is_bridged() {
        let (mut watch, gap) = (watch(), 0.1);
        let jump = [0.4, -0.7, 0.6];
        let mut last: Option<RobotState> = None;
        let mut jumps = 0;
        for k in 0..240 {
            let time = f64::from(k) * DT;
            let mut robot = RobotState::still(time);
            robot.base_velocity = [0.5, 0.2, 0.1];
            robot.place_base([0.5 * time, 0.2 * time, 0.1 * time]);
            let exact = robot.clone();
            if k >= 60 {
                robot.move_odom(&jump);
            }
            jumps += u32::from(watch.bridge(&mut robot, last.as_ref(), gap));
            let off = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
            assert!(off(robot.base_pose, exact.base_pose) < 1e-9, "{k} {:?}", robot.base_pose);
            assert!(off(robot.base_velocity, exact.base_velocity) < 1e-9, "{k} {:?}", robot.base_velocity);
            assert!(
                (robot.x_odom_base.translation.vector - exact.x_odom_base.translation.vector).norm() < 1e-9
            );
            if k < 60 {
                assert_eq!(robot, exact, "nothing changes without a jump");
            }
            last = Some(robot);
        }
        assert_eq!(jumps, 1);
    }

    /// Each fault of a camera is told by its own name after its time, once, and its end as well.
    #[test]
    fn faults_of_the_camera_are_told() {
        let image = |z: f32| DepthImage::filled(4, 3, z);
        let at = |x: f64| Some(Pose::translation(x, 0.0, 0.0));
        let told = |frame: &dyn Fn(&mut Watch, u32)| {
            let mut watch = watch();
            let mut events = Vec::new();
            for k in 0..360 {
                // A working camera at first and at last.
                if !(60..300).contains(&k) {
                    assert!(watch.take_image(&image(1.0 + k as f32), at(0.01 * f64::from(k)), true, false));
                } else {
                    frame(&mut watch, k);
                }
                events.extend(watch.look(DT));
            }
            events
        };
        let both = |alarm| vec![(alarm, true), (alarm, false)];
        assert_eq!(told(&|_, _| ()), both(Alarm::CameraSilent));
        let frozen = |watch: &mut Watch, k: u32| {
            watch.take_image(&image(60.0), at(0.01 * f64::from(k)), true, false);
        };
        assert_eq!(told(&frozen), both(Alarm::CameraFrozen));
        let late =
            |watch: &mut Watch, k: u32| assert!(!watch.take_image(&image(k as f32), None, true, false));
        assert_eq!(told(&late), both(Alarm::CameraLate));
        let blind = |watch: &mut Watch, k: u32| {
            watch.take_image(&image(f32::NAN), at(0.01 * f64::from(k)), false, false);
        };
        assert_eq!(told(&blind), both(Alarm::CameraBlind));
        // A camera that stands still sees the same.
        let mut still = watch();
        for _ in 0..600 {
            assert!(still.take_image(&image(1.0), at(0.0), true, false));
            assert!(still.look(DT).is_empty());
        }
    }

    /// A force counts once it has lasted, and is gone once its absence has.
    #[test]
    fn a_load_is_told_when_it_lasts() {
        let mut watch = watch();
        let limit = watch.config.load.si();
        let frames = (watch.config.load_time.si() / DT).ceil() as u32 + 1;
        let mut feel = |force: f64, frames: u32| {
            let mut told: Vec<bool> = Vec::new();
            for _ in 0..frames {
                told.extend(watch.feel(force, DT));
            }
            told
        };
        assert!(feel(2.0 * limit, 3).is_empty());
        assert!(feel(0.0, 3).is_empty());
        assert_eq!(feel(2.0 * limit, frames), [true]);
        assert!(feel(2.0 * limit, frames).is_empty());
        assert_eq!(feel(0.5 * limit, frames), [false]);
    }
}

//! Smooth arm motions: joint-space motions and straight lines of the hand.

mod homing;
mod path;

use crate::config::ArmConfig;
use crate::motion::homing::Homing;
use crate::motion::path::Path;
use orchard_geometry::{Pose, Vec3};
use orchard_robot::{ArmKinematics, IkTarget, JointVector, Obstacle};

pub use crate::motion::homing::HomingConfig;
pub(crate) use crate::motion::path::Pace;

/// Joint motion that is a cubic in time from rest to rest: all joints start and stop together.
///
/// With q(u) = a + (b - a)(3 u^2 - 2 u^3), u = t/T, the largest speed is 1.5 |b - a|/T and the largest
/// acceleration 6 |b - a|/T^2; T is the shortest time that keeps both limits.
#[derive(Debug, Clone, PartialEq)]
struct JointMove {
    from: JointVector,
    to: JointVector,
    duration: f64,
    time: f64,
}

/// Straight line of the TCP with fixed orientation, base frame, from rest to rest.
#[derive(Debug, Clone, PartialEq)]
struct Line {
    from: Pose,
    direction: Vec3,
    length: f64,
    speed_max: f64,
    acceleration: f64,
    /// Slowest motion at the end, as a share of `speed_max`.
    creep: f64,
    /// Largest joint step of a frame \[rad\].
    branch_jump: f64,
    travelled: f64,
    speed: f64,
}

/// A posture to pass, with the distance at which it counts as passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WayPoint {
    pub q: JointVector,
    /// Joint distance at which the arm turns to the next way-point \[rad\].
    pub blend: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Course {
    Rest,
    Joints(JointMove),
    Line(Line),
    Path(Path),
    Homing(Box<Homing>),
    /// The motion has ended because no posture continued it.
    Lost,
}

/// Commanded posture of the arm and its motion.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ArmMotion {
    q: JointVector,
    course: Course,
}

impl ArmMotion {
    pub fn new(q: JointVector) -> Self {
        Self { q, course: Course::Rest }
    }

    /// Commanded posture \[rad\].
    pub fn q(&self) -> &JointVector {
        &self.q
    }

    /// True if the commanded posture no longer changes.
    pub fn is_over(&self) -> bool {
        matches!(self.course, Course::Rest | Course::Lost)
    }

    /// True if the last motion ended because no posture continued it.
    pub fn is_lost(&self) -> bool {
        self.course == Course::Lost
    }

    /// Goal of the present joint motion, else the commanded posture \[rad\].
    pub fn goal(&self) -> &JointVector {
        match &self.course {
            Course::Joints(joints) => &joints.to,
            Course::Path(path) => path.goal().unwrap_or(&self.q),
            _ => &self.q,
        }
    }

    /// Distance travelled along the present line \[m\]; `None` in other motions.
    pub fn travelled(&self) -> Option<f64> {
        match &self.course {
            Course::Line(line) => Some(line.travelled),
            _ => None,
        }
    }

    /// Stops the commanded posture where it is.
    pub fn stop(&mut self) {
        self.course = Course::Rest;
    }

    /// Sets the commanded posture; postures of successive frames must be near each other.
    pub fn place(&mut self, q: JointVector) {
        self.q = q;
        self.course = Course::Rest;
    }

    /// Starts a joint motion at a share `scale` of the speed.
    pub fn go(&mut self, to: JointVector, config: &ArmConfig, scale: f64) {
        let farthest = (to - self.q).amax();
        if farthest == 0.0 {
            self.course = Course::Rest;
            return;
        }
        let by_speed = 1.5 * farthest / (config.joint_speed.si() * scale);
        let by_acceleration = (6.0 * farthest / (config.joint_acceleration.si() * scale * scale)).sqrt();
        let duration = by_speed.max(by_acceleration);
        self.course = Course::Joints(JointMove { from: self.q, to, duration, time: 0.0 });
    }

    /// Starts a straight line of the TCP from the commanded posture; `direction` is a unit vector.
    pub fn go_straight(
        &mut self,
        arm: &ArmKinematics,
        direction: Vec3,
        length: f64,
        speed: f64,
        config: &ArmConfig,
    ) {
        self.course = Course::Line(Line {
            from: arm.tcp(&self.q),
            direction,
            length,
            speed_max: speed,
            acceleration: config.line_acceleration.si(),
            creep: config.line_creep.si(),
            branch_jump: config.branch_jump.si(),
            travelled: 0.0,
            speed: 0.0,
        });
    }

    /// Changes the acceleration of the present line.
    pub fn set_line_acceleration(&mut self, acceleration: f64) {
        if let Course::Line(line) = &mut self.course {
            line.acceleration = acceleration;
        }
    }

    /// Changes the speed of the present line.
    pub fn set_line_speed(&mut self, speed: f64) {
        if let Course::Line(line) = &mut self.course {
            line.speed_max = speed;
        }
    }

    /// Starts a motion through way-points, the last of which is the goal; it takes over the velocity of a present path.
    pub fn go_through(&mut self, way_points: impl IntoIterator<Item = WayPoint>, pace: Pace) {
        self.course = Course::Path(Path::new(way_points, self.path_velocity(), pace));
    }

    /// Starts the hand towards a pose of the TCP (base frame) along its approach axis, or corrects goal and obstacles of that motion.
    pub fn home_in(
        &mut self,
        arm: &ArmKinematics,
        x_goal: Pose,
        obstacles: Vec<Obstacle>,
        config: &HomingConfig,
    ) {
        if let Course::Homing(homing) = &mut self.course {
            homing.correct(x_goal, obstacles);
        } else {
            let from = (&self.q, self.path_velocity());
            self.course = Course::Homing(Box::new(Homing::new(x_goal, obstacles, from, arm, config)));
        }
    }

    /// Corrects the goal of a motion onto a fruit (base frame), with the obstacles as they are.
    pub fn aim(&mut self, x_goal: Pose) {
        if let Course::Homing(homing) = &mut self.course {
            homing.aim(x_goal);
        }
    }

    /// Joint velocities on the present path [rad/s]; zero in other motions.
    fn path_velocity(&self) -> JointVector {
        match &self.course {
            Course::Path(path) => path.velocity(),
            _ => JointVector::zeros(),
        }
    }

    /// Sets the share of its speeds at which the hand homes in.
    pub fn set_homing_pace(&mut self, pace: f64) {
        if let Course::Homing(homing) = &mut self.course {
            homing.set_pace(pace);
        }
    }

    /// Advances the commanded posture by `dt` \[s\].
    pub fn advance(&mut self, arm: &ArmKinematics, dt: f64) {
        match &mut self.course {
            Course::Rest | Course::Lost => {}
            Course::Joints(joints) => {
                joints.time += dt;
                let u = (joints.time / joints.duration).min(1.0);
                self.q = joints.from + (joints.to - joints.from) * (u * u * (3.0 - 2.0 * u));
                if u >= 1.0 {
                    self.course = Course::Rest;
                }
            }
            Course::Path(path) => {
                self.q = arm.clamped(&path.step(&self.q, dt));
                if path.is_over(&self.q) {
                    self.course = Course::Rest;
                }
            }
            Course::Homing(homing) => match homing.step(arm, &self.q, dt) {
                Some(q) => {
                    self.q = q;
                    if homing.is_over() {
                        self.course = Course::Rest;
                    }
                }
                None => self.course = Course::Lost,
            },
            Course::Line(line) => {
                let left = line.length - line.travelled;
                let braking = (2.0 * line.acceleration * left.max(0.0)).sqrt();
                line.speed = (line.speed + line.acceleration * dt).min(line.speed_max).min(braking);
                // By the braking law alone the hand would never reach the end.
                let step = (line.speed * dt).max(line.speed_max * dt * line.creep).min(left);
                line.travelled += step;
                let over = line.travelled >= line.length;
                let p = line.from.translation.vector + line.direction * line.travelled;
                let target = IkTarget::Pose(Pose::from_parts(p.into(), line.from.rotation));
                match arm.solve_near(&target, &self.q) {
                    Ok(q) if (q - self.q).amax() <= line.branch_jump => {
                        self.q = q;
                        if over {
                            self.course = Course::Rest;
                        }
                    }
                    _ => self.course = Course::Lost,
                }
            }
        }
    }
}

/// Returns the largest speed from which a body stops within `distance` if its speed falls by `a dt` each frame: the sum
/// `v dt + (v - a dt) dt + ..` is `distance`, to within an eighth of `a dt^2`.
fn stopping_speed(a: f64, distance: f64, dt: f64) -> f64 {
    let step = a * dt;
    if step <= 0.0 {
        return 0.0;
    }
    step * ((0.25 + 2.0 * distance.max(0.0) / (step * dt)).sqrt() - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Braking by `a dt` a frame from the stopping speed covers the distance.
    #[test]
    fn the_stopping_speed_stops_in_the_distance() {
        let (a, dt) = (9.0, 1.0 / 60.0);
        for distance in [0.0, 1e-4, 0.01, 0.3, 2.0] {
            let v = stopping_speed(a, distance, dt);
            let frames = (v / (a * dt)).floor();
            // The sum of v dt, (v - a dt) dt, .. down to the last positive term.
            let way = dt * (frames + 1.0) * (v - 0.5 * frames * a * dt);
            // Exact where v is a multiple of a dt; between them the sum is a chord of the parabola.
            assert!((way - distance).abs() <= a * dt * dt / 8.0 + 1e-12, "{distance} {way}");
        }
        assert_eq!(stopping_speed(a, 1.0, 0.0), 0.0);
    }
}

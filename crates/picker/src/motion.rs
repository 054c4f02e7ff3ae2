//! Smooth arm motions: joint-space motions and straight lines of the hand.

mod homing;
mod path;

use crate::config::ArmConfig;
use crate::motion::homing::Homing;
use crate::motion::path::Path;
use orchard_geometry::{Pose, Rotation, Vec3};
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

/// Straight line of the TCP, base frame, from rest to rest; the hand keeps its orientation or turns about its approach axis.
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
    /// Turn of the hand about its approach axis so far \[rad\], its goal, and its speed [rad/s].
    turned: f64,
    turn: f64,
    turn_speed: f64,
    /// Offset from the line \[m\], its velocity [m/s] and its largest length \[m\].
    aside: Vec3,
    drift: Vec3,
    aside_max: f64,
}

impl Line {
    /// Pose of the TCP at a distance travelled \[m\] and a turn \[rad\].
    fn x_base_tcp(&self, travelled: f64, turned: f64) -> Pose {
        let p = self.from.translation.vector + self.direction * travelled + self.aside;
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), turned);
        Pose::from_parts(p.into(), self.from.rotation * turn)
    }
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
            turned: 0.0,
            turn: 0.0,
            turn_speed: 0.0,
            aside: Vec3::zeros(),
            drift: Vec3::zeros(),
            aside_max: 0.0,
        });
    }

    /// Changes the acceleration of the present line.
    pub fn set_line_acceleration(&mut self, acceleration: f64) {
        if let Course::Line(line) = &mut self.course {
            line.acceleration = acceleration;
        }
    }

    /// Changes the speed of the present line; below 0 the hand goes back on it.
    pub fn set_line_speed(&mut self, speed: f64) {
        if let Course::Line(line) = &mut self.course {
            line.speed_max = speed;
        }
    }

    /// Lets the hand drift off the present line at a velocity [m/s], base frame, up to a distance \[m\].
    pub fn drift_off_line(&mut self, velocity: Vec3, aside_max: f64) {
        if let Course::Line(line) = &mut self.course {
            (line.drift, line.aside_max) = (velocity, aside_max);
        }
    }

    /// Returns the largest turn of the hand about its approach axis on the present line that the arm can follow \[rad\], at most `most`, to the side
    /// that leaves it more room; `is_free` tells turns at which the fingers meet nothing.
    pub fn room_to_turn(&self, arm: &ArmKinematics, most: f64, is_free: impl Fn(f64) -> bool) -> f64 {
        let Course::Line(line) = &self.course else { return 0.0 };
        let room = |side: f64| {
            let (mut q, mut turned) = (self.q, 0.0);
            while turned < most {
                let next = (turned + line.branch_jump).min(most);
                let x = line.x_base_tcp(line.travelled, line.turned + side * next);
                match arm.solve_near(&IkTarget::Pose(x), &q) {
                    Ok(q_next) if is_free(side * next) => (q, turned) = (q_next, next),
                    _ => break,
                }
            }
            turned
        };
        let [left, right] = [room(1.0), room(-1.0)];
        if left >= right { left } else { -right }
    }

    /// Turns the hand about its approach axis on the present line by an angle \[rad\].
    pub fn turn_on_line(&mut self, turn: f64, speed: f64) {
        if let Course::Line(line) = &mut self.course {
            line.turn = line.turned + turn;
            line.turn_speed = speed;
        }
    }

    /// Ends the turn of the hand on the present line.
    pub fn stop_turn(&mut self) {
        if let Course::Line(line) = &mut self.course {
            line.turn = line.turned;
        }
    }

    /// True if the hand still turns on the present line.
    pub fn is_turning(&self) -> bool {
        matches!(&self.course, Course::Line(line) if line.turned != line.turn)
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
                let step = if line.speed_max < 0.0 {
                    (line.speed_max * dt).max(-line.travelled)
                } else {
                    (line.speed * dt).max(line.speed_max * dt * line.creep).min(left)
                };
                line.travelled += step;
                let aside = line.aside + line.drift * dt;
                line.aside =
                    aside * (line.aside_max / aside.norm().max(line.aside_max).max(f64::MIN_POSITIVE));
                let turn_step = line.turn_speed * dt;
                line.turned += (line.turn - line.turned).clamp(-turn_step, turn_step);
                let over = line.travelled >= line.length;
                let target = IkTarget::Pose(line.x_base_tcp(line.travelled, line.turned));
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
    use crate::config::PickerConfig;
    use orchard_robot::RobotModel;

    const DT: f64 = 1.0 / 60.0;

    /// A line of 0.3 m upwards from the home posture.
    fn line(arm: &ArmKinematics) -> ArmMotion {
        let mut motion = ArmMotion::new(arm.home());
        motion.go_straight(arm, Vec3::z(), 0.3, 0.1, &PickerConfig::baseline().arm);
        motion
    }

    /// The hand turns about its approach axis while it goes on straight, as far as it is told, to the side where the last joint has more room.
    #[test]
    fn the_hand_turns_on_a_line() {
        let robot = RobotModel::paper();
        let arm = robot.kinematics();
        let start = arm.tcp(&arm.home());
        for (offset, side) in [(-2.0, 1.0), (2.0, -1.0)] {
            let mut home = arm.home();
            home[6] = 0.5 * (arm.limits()[6].lower + arm.limits()[6].upper) + offset;
            let mut motion = ArmMotion::new(home);
            let from = arm.tcp(&home);
            motion.go_straight(arm, Vec3::z(), 0.3, 0.1, &PickerConfig::baseline().arm);
            motion.turn_on_line(motion.room_to_turn(arm, 2.6, |_| true), 2.0);
            assert!(motion.is_turning());
            for _ in 0..90 {
                motion.advance(arm, DT);
            }
            assert!(!motion.is_turning());
            let x = arm.tcp(motion.q());
            let turn = (from.rotation.inverse() * x.rotation).scaled_axis();
            assert!((turn - Vec3::z() * (side * 2.6)).norm() < 0.02, "{turn}");
            let way = x.translation.vector - from.translation.vector;
            assert!((way - Vec3::z() * way.z).norm() < 3e-3 && way.z > 0.1, "{way}");
        }
        // A turn that is ended stays as it is.
        let mut motion = line(arm);
        // Where the fingers would meet something it turns less, or to the other side.
        let room = |is_free: &dyn Fn(f64) -> bool| motion.room_to_turn(arm, 1.0, is_free);
        let free = room(&|_| true);
        assert!((free.abs() - 1.0).abs() < 1e-12 && room(&|_| false) == 0.0);
        assert_eq!(room(&|turn| turn * free < 0.0), -free);
        motion.turn_on_line(1.0, 2.0);
        motion.advance(arm, DT);
        motion.stop_turn();
        for _ in 0..30 {
            motion.advance(arm, DT);
        }
        let turned = start.rotation.angle_to(&arm.tcp(motion.q()).rotation);
        assert!(!motion.is_turning() && (turned - 2.0 * DT).abs() < 0.01, "{turned}");
    }

    /// A hand that gives way leaves the line by at most the distance that it may; at a speed below 0 it goes back, no farther than to the start.
    #[test]
    fn the_hand_gives_way_on_a_line() {
        let robot = RobotModel::paper();
        let arm = robot.kinematics();
        let start = arm.tcp(&arm.home()).translation.vector;
        let mut motion = line(arm);
        motion.drift_off_line(Vec3::y() * 0.05, 0.04);
        for _ in 0..30 {
            motion.advance(arm, DT);
        }
        let off = arm.tcp(motion.q()).translation.vector - start;
        assert!((off.y - 0.025).abs() < 2e-3 && off.z > 0.03, "{off}");
        for _ in 0..60 {
            motion.advance(arm, DT);
        }
        assert!((arm.tcp(motion.q()).translation.vector.y - start.y - 0.04).abs() < 2e-3);
        motion.drift_off_line(Vec3::zeros(), 0.04);
        motion.set_line_speed(-0.1);
        for _ in 0..120 {
            motion.advance(arm, DT);
        }
        assert_eq!(motion.travelled(), Some(0.0));
        let off = arm.tcp(motion.q()).translation.vector - start;
        assert!((off - Vec3::y() * 0.04).norm() < 2e-3, "{off}");
    }

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

//! A simple test orchard for the picker: a kinematic robot that follows commands within its speed limits, balls on springs about a trunk, an
//! exact depth camera. It has no dynamics, and contact only between fingers and fruit.

use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Rotation, Vec3, inverse_transform, transform};
use orchard_perception::DetectorConfig;
use orchard_picker::{Controller, Kind};
use orchard_robot::{BaseMotion, Bucket, Command, JointValues, JointVector, Observation, RobotModel};
use std::collections::VecDeque;

const FRAME: f64 = 1.0 / 60.0;
const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);
const STEM_STIFFNESS: f64 = 550.0;
/// Frames between images.
const IMAGE_PERIOD: u32 = 12;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fate {
    Hanging,
    Held,
    Deposited,
    Dropped,
}

#[derive(Debug, Clone)]
pub struct Fruit {
    pub p_hang: Vec3,
    pub p: Vec3,
    pub radius: f64,
    pub fate: Fate,
}

/// Images of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sight {
    Clear,
    /// Images without a valid pixel.
    Blind,
    /// Fruit is seen until this time \[s\], then never again.
    FruitVanishesAfter(f64),
}

/// A ball that no image shows and that pushes the point between the fingers back like a spring.
#[derive(Debug, Clone)]
pub struct Wood {
    pub p: Vec3,
    pub radius: f64,
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// Largest depth of the hand in the ball \[m\].
    pub deepest: f64,
}

impl Wood {
    /// Force that the hand exerts on the ball \[N\].
    fn force(&mut self, p_tcp: &Vec3) -> Vec3 {
        let inwards = self.p - p_tcp;
        let depth = (self.radius - inwards.norm()).max(0.0);
        self.deepest = self.deepest.max(depth);
        inwards.normalize() * (depth * self.stiffness)
    }
}

#[derive(Debug, Clone)]
pub struct FakeWorld {
    pub robot: RobotModel,
    pub fruit: Vec<Fruit>,
    pub sight: Sight,
    /// Frames between the taking and the delivery of an image.
    pub latency: u32,
    in_flight: VecDeque<(f64, DepthImage)>,
    /// Stem force at which a fruit comes off \[N\].
    pub stem_strength: f64,
    pub wood: Option<Wood>,
    pub base: [f64; 3],
    pub q: JointVector,
    pub time_frames: u32,
    v: JointVector,
    a: JointVector,
    fingers: f64,
    /// Force of each finger drive, positive opening \[N\].
    squeeze: f64,
    base_velocity: [f64; 3],
    base_acceleration: [f64; 3],
    gripped: Option<usize>,
    bucket: Bucket,
}

impl FakeWorld {
    /// Trunk at the protocol's start distance ahead; fruit on it as (bearing, radius from the trunk, height).
    pub fn new(fruit: &[(f64, f64, f64)]) -> Self {
        let robot = RobotModel::paper();
        let place = |&(bearing, r, z): &(f64, f64, f64)| {
            let (sin, cos) = orchard_geometry::math::sin_cos(bearing);
            let p = Vec3::new(2.4 + r * cos, r * sin, z);
            Fruit { p_hang: p, p, radius: 0.03, fate: Fate::Hanging }
        };
        Self {
            fruit: fruit.iter().map(place).collect(),
            sight: Sight::Clear,
            latency: 0,
            in_flight: VecDeque::new(),
            stem_strength: 22.0,
            wood: None,
            base: [0.0; 3],
            q: robot.kinematics().home(),
            time_frames: 0,
            v: JointVector::zeros(),
            a: JointVector::zeros(),
            fingers: 0.04,
            squeeze: 0.0,
            base_velocity: [0.0; 3],
            base_acceleration: [0.0; 3],
            gripped: None,
            bucket: robot.bucket(),
            robot,
        }
    }

    pub fn picker(&self, kind: Kind) -> Box<dyn Controller> {
        kind.controller(&self.robot, DetectorConfig::paper())
    }

    pub fn count(&self, fate: Fate) -> usize {
        self.fruit.iter().filter(|f| f.fate == fate).count()
    }

    fn x_base(&self) -> Pose {
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), self.base[2]);
        Pose::from_parts(Vec3::new(self.base[0], self.base[1], 0.0).into(), turn)
    }

    fn time(&self) -> f64 {
        f64::from(self.time_frames) * FRAME
    }

    fn fruit_is_shown(&self) -> bool {
        !matches!(self.sight, Sight::FruitVanishesAfter(t) if self.time() > t)
    }

    pub fn observe(&mut self) -> Observation {
        let arm = self.robot.kinematics();
        let [x, y, turn] = self.base_acceleration;
        let base = BaseMotion {
            acceleration: self.x_base().rotation.inverse() * Vec3::new(x, y, 0.0),
            angular_velocity: Vec3::z() * self.base_velocity[2],
            angular_acceleration: Vec3::z() * turn,
        };
        let mut torque = arm.motion_torque(&self.q, &self.v, &self.a, &base, &GRAVITY);
        if let Some(i) = self.gripped
            && self.fruit[i].fate == Fate::Hanging
        {
            let f = &self.fruit[i];
            let force = self.x_base().rotation.inverse() * ((f.p - f.p_hang) * STEM_STIFFNESS);
            torque += arm.jacobian(&self.q).fixed_rows::<3>(3).transpose() * force;
        }
        let (x_base, p_tcp_base) = (self.x_base(), arm.tcp(&self.q).translation.vector);
        if let Some(wood) = &mut self.wood {
            let force = x_base.rotation.inverse() * wood.force(&transform(&x_base, &p_tcp_base));
            torque += arm.jacobian(&self.q).fixed_rows::<3>(3).transpose() * force;
        }
        let intrinsics = Intrinsics::from_vertical_fov(192, 144, 75f64.to_radians());
        if self.time_frames.is_multiple_of(IMAGE_PERIOD) {
            self.in_flight.push_back((self.time(), self.shoot(&intrinsics)));
        }
        let taken = self.time_frames.checked_sub(self.latency);
        let delivered =
            taken.filter(|frame| frame.is_multiple_of(IMAGE_PERIOD)).and_then(|_| self.in_flight.pop_front());
        let (depth_time, depth) = delivered.map_or((0.0, None), |(time, image)| (time, Some(image)));
        Observation {
            time: self.time(),
            arm_q: JointValues::of(&self.q, 7),
            arm_v: JointValues::of(&self.v, 7),
            arm_torque: JointValues::of(&torque, 7),
            finger_q: [self.fingers; 2],
            finger_force: [self.squeeze; 2],
            cup_pressure: 0.0,
            base_pose: self.base,
            base_height: 0.0,
            base_velocity: self.base_velocity,
            depth,
            colour: None,
            depth_time,
            intrinsics,
            pictures: None,
        }
    }

    fn shoot(&self, intrinsics: &Intrinsics) -> DepthImage {
        let mut image = Image::filled(intrinsics.width, intrinsics.height, 0.0f32);
        if self.sight == Sight::Blind {
            return image;
        }
        let x = self.x_base() * self.robot.kinematics().camera(&self.q);
        let eye = x.translation.vector;
        for v in 0..intrinsics.height {
            for u in 0..intrinsics.width {
                // Rays have z = 1 in the camera, so that the ray parameter is the depth.
                let ray = x.rotation * intrinsics.ray(u as f64, v as f64);
                let mut depth = f64::INFINITY;
                if ray.z < 0.0 {
                    depth = -eye.z / ray.z;
                }
                depth = depth.min(trunk_hit(&eye, &ray));
                if self.fruit_is_shown() {
                    for f in &self.fruit {
                        depth = depth.min(ball_hit(&(f.p - eye), &ray, f.radius));
                    }
                }
                if (0.3..=3.0).contains(&depth) {
                    image[(u, v)] = depth as f32;
                }
            }
        }
        image
    }

    pub fn step(&mut self, command: &Command) {
        let arm = self.robot.kinematics().clone();
        let q_before = self.q;
        for i in 0..command.arm_q.len() {
            let step = arm.limits()[i].velocity * FRAME;
            self.q[i] += (command.arm_q[i] - self.q[i]).clamp(-step, step);
        }
        let v = (self.q - q_before) / FRAME;
        self.a = (v - self.v) / FRAME;
        self.v = v;
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), self.base[2]);
        let [forward, left, yaw_rate] = command.base_velocity;
        let v = turn * Vec3::new(forward, left, 0.0);
        let last = std::mem::replace(&mut self.base_velocity, [v.x, v.y, yaw_rate]);
        self.base_acceleration = std::array::from_fn(|k| (self.base_velocity[k] - last[k]) / FRAME);
        for k in 0..3 {
            self.base[k] += self.base_velocity[k] * FRAME;
        }
        let x_tcp = self.x_base() * arm.tcp(&self.q);
        self.move_fingers(command, &x_tcp);
        if let Some(i) = self.gripped {
            let strength = self.stem_strength;
            let fruit = &mut self.fruit[i];
            fruit.p = x_tcp.translation.vector;
            if (fruit.p - fruit.p_hang).norm() * STEM_STIFFNESS > strength {
                fruit.fate = Fate::Held;
            }
        }
        self.time_frames += 1;
    }

    fn move_fingers(&mut self, command: &Command, x_tcp: &Pose) {
        let step = 0.1 * FRAME;
        let wanted = self.fingers + (command.finger_q - self.fingers).clamp(-step, step);
        let between = |f: &Fruit| {
            let p = inverse_transform(x_tcp, &f.p);
            p.x.abs() < 0.009 && p.z.abs() < 0.018 && p.y.abs() < 0.01
        };
        let taken = self.gripped.or_else(|| {
            self.fruit.iter().position(|f| matches!(f.fate, Fate::Hanging | Fate::Held) && between(f))
        });
        self.squeeze = 0.0;
        match taken {
            Some(i) if wanted <= self.fruit[i].radius => {
                self.fingers = self.fruit[i].radius;
                self.gripped = Some(i);
                self.squeeze = -command.finger_force;
            }
            _ => {
                self.fingers = wanted;
                if let Some(i) = self.gripped.take() {
                    self.let_go(i);
                }
            }
        }
    }

    fn let_go(&mut self, i: usize) {
        let p_base = inverse_transform(&self.x_base(), &self.fruit[i].p);
        let fruit = &mut self.fruit[i];
        if fruit.fate != Fate::Held {
            fruit.p = fruit.p_hang;
            return;
        }
        let fallen = Vec3::new(p_base.x, p_base.y, self.bucket.p_base.z);
        let inside = self.bucket.contains(&fallen);
        fruit.fate = if inside { Fate::Deposited } else { Fate::Dropped };
        // The fruit is put where the camera cannot see it.
        fruit.p = transform(&Pose::identity(), &Vec3::new(0.0, 0.0, -10.0));
    }

    /// Runs the picker; `watch` sees every command before it is carried out.
    pub fn run(
        &mut self,
        picker: &mut impl Controller,
        seconds: f64,
        mut watch: impl FnMut(&Self, &Command),
    ) {
        for _ in 0..(seconds / FRAME).round() as u32 {
            let command = picker.act(&self.observe());
            watch(self, &command);
            self.step(&command);
        }
    }
}

fn ball_hit(centre: &Vec3, ray: &Vec3, radius: f64) -> f64 {
    let (a, b, c) = (ray.norm_squared(), ray.dot(centre), centre.norm_squared() - radius * radius);
    let root = b * b - a * c;
    if root < 0.0 || b <= 0.0 { f64::INFINITY } else { (b - root.sqrt()) / a }
}

/// A vertical trunk of 4 cm radius at the protocol's start distance, 2 m high.
fn trunk_hit(eye: &Vec3, ray: &Vec3) -> f64 {
    let (centre, flat) = (Vec3::new(2.4 - eye.x, -eye.y, 0.0), Vec3::new(ray.x, ray.y, 0.0));
    let depth = ball_hit(&centre, &flat, 0.04);
    let z = eye.z + depth * ray.z;
    if (0.0..=2.0).contains(&z) { depth } else { f64::INFINITY }
}

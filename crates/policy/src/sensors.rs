//! Observations: the robot's sensors as arrays.

use orchard_geometry::DepthImage;
use orchard_robot::{BaseJoint, Observation, Pictures, RobotModel};

use crate::interface::{Element, Field};
use crate::spaces::{Spaces, Target};

/// The numbers of a field of an observation, row by row.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// 32-bit numbers.
    F32(Vec<f32>),
    /// Bytes.
    U8(Vec<u8>),
    /// Text.
    Text(String),
}

/// A depth image with the time at which it was taken.
pub struct DepthReading<'a> {
    /// The image; none if it stays on a graphics device, and its fields are empty.
    pub image: Option<&'a DepthImage>,
    /// The time, on the clock of the observation \[s\].
    pub time: f64,
}

impl DepthReading<'_> {
    fn pixels(&self) -> &[f32] {
        self.image.map_or(&[], DepthImage::pixels)
    }
}

/// Readings from which an observation is made.
pub struct Reading<'a> {
    /// The robot's sensors.
    pub sensed: &'a Observation,
    /// The latest image that the camera delivered; none before the first.
    pub depth: Option<DepthReading<'a>>,
    /// The latest pictures; none before the first.
    pub pictures: Option<&'a Pictures>,
    /// Target as it is told: centre (odom) and radius of a fruit \[m\]; a point (odom) \[m\] and a heading \[rad\].
    pub target: Option<[f64; 4]>,
    /// The task in words; without them it is [`Target::sentence`].
    pub description: Option<&'a str>,
}

/// Most characters of a description.
const DESCRIPTION: usize = 160;

/// Time of the image before the first one \[s\].
const NO_IMAGE: f32 = -1.0;

type Read = Box<dyn Fn(&Reading<'_>) -> Values + Send + Sync>;

/// The fields that a robot's observations have, and how each is read.
pub(crate) struct Sensors {
    pub fields: Vec<Field>,
    reads: Vec<Read>,
}

/// A number of a state field: its name and unit, and how it is read.
type Number = (Element, Box<dyn Fn(&Observation) -> f64 + Send + Sync>);
type Numbers = Vec<Number>;

impl Sensors {
    /// The sensors of a robot that the spaces ask for; the camera's images have `width` times `height` pixels.
    pub fn new(robot: &RobotModel, spaces: &Spaces, [width, height]: [usize; 2]) -> Self {
        let mut sensors = Self { fields: Vec::new(), reads: Vec::new() };
        if spaces.state {
            sensors.add_numbers("agent_pos", "where joints, fingers and base are", positions(robot));
            sensors.add_numbers("agent_vel", "how fast joints and base move", velocities(robot));
            sensors.add_numbers("forces", "torques, forces and pressure that the robot feels", forces(robot));
            sensors.add_tool_pose(robot);
            if let Some(target) = spaces.target {
                let (last, meaning) = match target {
                    Target::Fruit => (
                        Element::new("radius", "m"),
                        "centre (odom) and radius of the named fruit, with the errors of the benchmark",
                    ),
                    Target::Point => (
                        Element::new("heading", "rad"),
                        "point for the tool (odom), and the level direction from the base to it, from the x axis of odom to its y axis",
                    ),
                };
                let mut elements = ["x", "y", "z"].map(|name| Element::new(name, "m")).to_vec();
                elements.push(last);
                sensors.add(Field::numbers("target", meaning, elements), |reading| {
                    Values::F32(reading.target.unwrap_or_default().map(narrow).to_vec())
                });
            }
        }
        if spaces.depth {
            let shape = [height, width];
            let depth = Field::image(
                "depth",
                "float32",
                shape,
                f64::INFINITY,
                "m",
                "depth along the optical axis, 0 where nothing was measured",
            );
            sensors.add(depth, move |reading| {
                let none = || vec![0.0; width * height];
                let pixels = |depth: &DepthReading<'_>| depth.pixels().to_vec();
                Values::F32(reading.depth.as_ref().map_or_else(none, pixels))
            });
            let valid = Field::image("depth_valid", "uint8", shape, 1.0, "1", "1 where a depth was measured");
            sensors.add(valid, move |reading| {
                let none = || vec![0; width * height];
                let mask =
                    |depth: &DepthReading<'_>| depth.pixels().iter().map(|&d| u8::from(d > 0.0)).collect();
                Values::U8(reading.depth.as_ref().map_or_else(none, mask))
            });
            sensors.add_times("depth_time", |reading| reading.depth.as_ref().map(|depth| depth.time));
        }
        if let Some(pixels) = spaces.pixels {
            let shape = [pixels.height as usize, pixels.width as usize];
            let black = vec![0; 3 * shape[0] * shape[1]];
            let wrist = Field::picture("pixels_wrist", shape, "picture of the camera on the hand");
            let none = black.clone();
            sensors.add(wrist, move |reading| {
                Values::U8(reading.pictures.map_or_else(|| none.clone(), |seen| seen.wrist.clone()))
            });
            let base = Field::picture("pixels_base", shape, "picture of the fixed camera on the base");
            sensors.add(base, move |reading| {
                Values::U8(reading.pictures.map_or_else(|| black.clone(), |seen| seen.base.clone()))
            });
            sensors.add_times("pixels_time", |reading| reading.pictures.map(|seen| seen.time));
        }
        if spaces.description {
            let sentence = Target::sentence(spaces.target);
            let field = Field::text("task_description", DESCRIPTION, "the task in words");
            sensors.add(field, move |reading| {
                Values::Text(reading.description.unwrap_or(sentence).chars().take(DESCRIPTION).collect())
            });
        }
        sensors
    }

    fn add(&mut self, field: Field, read: impl Fn(&Reading<'_>) -> Values + Send + Sync + 'static) {
        self.fields.push(field);
        self.reads.push(Box::new(read));
    }

    /// When an image was taken, and the time now.
    fn add_times(
        &mut self,
        key: &'static str,
        taken: impl Fn(&Reading<'_>) -> Option<f64> + Send + Sync + 'static,
    ) {
        let elements = vec![Element::new("taken", "s"), Element::new("now", "s")];
        let meaning = "when the image was taken (-1 before the first one) and the time now, since the start of the episode";
        self.add(Field::numbers(key, meaning, elements), move |reading| {
            let taken = taken(reading).map_or(NO_IMAGE, narrow);
            Values::F32(vec![taken, narrow(reading.sensed.time)])
        });
    }

    fn add_numbers(&mut self, key: &'static str, meaning: &'static str, numbers: Numbers) {
        let (elements, reads): (Vec<Element>, Vec<_>) = numbers.into_iter().unzip();
        self.add(Field::numbers(key, meaning, elements), move |reading| {
            Values::F32(reads.iter().map(|read| narrow(read(reading.sensed))).collect())
        });
    }

    /// Adds the pose of the tool point in odom, computed from the measured joints and the odometry.
    fn add_tool_pose(&mut self, robot: &RobotModel) {
        let arm = robot.kinematics().clone();
        let place = ["x", "y", "z"].map(|name| Element::new(name, "m"));
        let turn = ["qx", "qy", "qz", "qw"].map(|name| Element::new(name, "1"));
        let meaning =
            "place and rotation of the tool point in odom; the rotation is a unit quaternion with qw >= 0";
        let field = Field::numbers("tool_pose", meaning, place.into_iter().chain(turn).collect());
        self.add(field, move |reading| {
            let o = reading.sensed;
            let x_odom_tool = o.x_odom_base() * arm.tcp(&o.arm_q.vector());
            let (p, q) = (x_odom_tool.translation.vector, x_odom_tool.rotation.coords);
            let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
            Values::F32([p.x, p.y, p.z, sign * q.x, sign * q.y, sign * q.z, sign * q.w].map(narrow).to_vec())
        });
    }

    /// The values of all fields, in their order.
    pub fn read(&self, reading: &Reading<'_>) -> Vec<Values> {
        self.reads.iter().map(|read| read(reading)).collect()
    }
}

/// The nearest 32-bit number; 0 for what is not finite, as in a world in quarantine.
fn narrow(x: f64) -> f32 {
    if x.is_finite() { x as f32 } else { 0.0 }
}

fn number(
    name: impl Into<String>,
    unit: &'static str,
    read: impl Fn(&Observation) -> f64 + Send + Sync + 'static,
) -> Number {
    (Element::new(name, unit), Box::new(read))
}

fn moves(robot: &RobotModel) -> bool {
    !matches!(robot.base_joint(), BaseJoint::Fixed)
}

fn positions(robot: &RobotModel) -> Numbers {
    let (config, mut all) = (robot.config(), Numbers::new());
    for (i, name) in config.parts.arm_joints.iter().enumerate() {
        all.push(number(name, "rad", move |o| o.arm_q[i]));
    }
    if config.finger.is_some() {
        for (i, name) in ["finger_left", "finger_right"].into_iter().enumerate() {
            all.push(number(name, "m", move |o| o.finger_q[i]));
        }
    }
    if moves(robot) {
        for (k, (name, unit)) in
            [("base_x", "m"), ("base_y", "m"), ("base_yaw", "rad")].into_iter().enumerate()
        {
            all.push(number(name, unit, move |o| o.base_pose[k]));
        }
    }
    if config.height.is_some() {
        all.push(number("base_height", "m", |o| o.base_height));
    }
    all
}

fn velocities(robot: &RobotModel) -> Numbers {
    let (config, mut all) = (robot.config(), Numbers::new());
    for (i, name) in config.parts.arm_joints.iter().enumerate() {
        all.push(number(name, "rad/s", move |o| o.arm_v[i]));
    }
    if moves(robot) {
        let names = [("base_x", "m/s"), ("base_y", "m/s"), ("base_yaw", "rad/s")];
        for (k, (name, unit)) in names.into_iter().enumerate() {
            all.push(number(name, unit, move |o| o.base_velocity[k]));
        }
    }
    all
}

fn forces(robot: &RobotModel) -> Numbers {
    let (config, mut all) = (robot.config(), Numbers::new());
    for (i, name) in config.parts.arm_joints.iter().enumerate() {
        all.push(number(name, "N m", move |o| o.arm_torque[i]));
    }
    if config.finger.is_some() {
        for (i, name) in ["finger_left", "finger_right"].into_iter().enumerate() {
            all.push(number(name, "N", move |o| o.finger_force[i]));
        }
    }
    if robot.cup().is_some() {
        all.push(number("cup_pressure", "Pa", |o| o.cup_pressure));
    }
    all
}

//! Survey of a URDF file of any robot: joints, limits, masses, inertias, and the parts that a harvester still needs.

mod draft;
mod roles;

pub use draft::{Draft, Guess};
pub use roles::RoleFacts;

use crate::RobotError;
use crate::articulation::{Articulation, Limit, Limits, Loaded, MeshUse, ROUNDING, matrix_of, moments};
use crate::config::RobotConfig;
use crate::model::RobotModel;
use crate::outline::outline;
use crate::resources::Resources;
use crate::warning::Warning;
use orchard_geometry::Mat3;
use orchard_multibody::JointKind;
use serde::Serialize;
use urdf_rs::JointType;

/// Survey of a URDF file. An infinite number is serialised as `null`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    /// The robot's name.
    pub name: String,
    /// Joints in the order of the file.
    pub joints: Vec<JointFacts>,
    /// Links in the order of the file.
    pub links: Vec<LinkFacts>,
    /// Number of joints that move.
    pub moving_joints: usize,
    /// Mass of all moving links \[kg\].
    pub mass: f64,
    /// Mesh files of the robot's shapes.
    pub meshes: Vec<MeshUse>,
    /// Gaps and faults of the description, with the assumption made for each.
    pub warnings: Vec<Warning>,
    /// Convex outline on the ground at q = 0, counterclockwise \[m\]: of the config's base and bucket in the base frame, else of
    /// the first link with shapes in the root frame.
    pub footprint: Vec<[f64; 2]>,
    /// The parts that a harvester needs.
    pub roles: Vec<RoleFacts>,
    /// Reason for which this project cannot use the robot as it is; `None` if it can.
    pub obstacle: Option<String>,
}

/// A joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointFacts {
    /// Name.
    pub name: String,
    /// Type in URDF.
    pub kind: String,
    /// Parent link.
    pub parent: String,
    /// Child link.
    pub child: String,
    /// Axis, for joints that have one.
    pub axis: Option<[f64; 3]>,
    /// Lowest position [rad or m], counted from the offset of a joint that mimics another; `None` if there is none or the joint is fixed.
    pub lower: Option<f64>,
    /// Highest position [rad or m].
    pub upper: Option<f64>,
    /// Largest speed [rad/s or m/s].
    pub velocity: Option<f64>,
    /// Largest torque or force [N m or N].
    pub effort: Option<f64>,
    /// Name of the joint that this one mimics.
    pub mimic: Option<String>,
}

/// A link.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinkFacts {
    /// Name.
    pub name: String,
    /// Mass \[kg\].
    pub mass: f64,
    /// Verdict on the inertia.
    pub inertia: InertiaFacts,
    /// Number of collision shapes, meshes included.
    pub collision_shapes: usize,
}

/// Verdict on a body's inertia.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum InertiaFacts {
    /// No mass and no inertia.
    None,
    /// Positive definite, and no principal moment is larger than the sum of the others.
    Possible,
    /// A principal moment is not positive.
    NotPositive {
        /// Smallest principal moment [kg m^2].
        smallest: f64,
    },
    /// A principal moment is larger than the sum of the others.
    Unbalanced {
        /// Ratio of that moment to the sum of the others.
        ratio: f64,
    },
}

impl Survey {
    /// Loads any URDF text with its meshes and surveys it; `config` names the parts of a harvester.
    ///
    /// # Errors
    /// As [`Articulation::load`].
    pub fn read(
        text: &str,
        resources: &mut dyn Resources,
        limits: &Limits,
        config: &RobotConfig,
    ) -> Result<Self, RobotError> {
        Ok(Self::of(text, &Articulation::load(text, resources, limits)?, config))
    }

    /// Surveys a robot that was loaded from `text`; `config` names the parts of a harvester.
    pub fn of(text: &str, loaded: &Loaded, config: &RobotConfig) -> Self {
        let (robot, articulation) = (&loaded.urdf, &loaded.articulation);
        let moving = || articulation.links.iter().filter(|link| link.joint != JointKind::Weld);
        Self {
            name: robot.name.clone(),
            joints: robot.joints.iter().map(|joint| joint_facts(joint, articulation)).collect(),
            links: robot.links.iter().map(link_facts).collect(),
            moving_joints: moving().count(),
            mass: moving().map(|link| link.inertia.mass).sum(),
            footprint: footprint(articulation, config),
            roles: roles::roles(articulation, &articulation.clone().into_harvester(config), &config.parts),
            obstacle: RobotModel::of(text, articulation.clone(), config).err().map(|e| e.to_string()),
            meshes: loaded.meshes.clone(),
            warnings: loaded.warnings.clone(),
        }
    }
}

fn joint_facts(joint: &urdf_rs::Joint, robot: &Articulation) -> JointFacts {
    let (kind, has_axis) = match joint.joint_type {
        JointType::Revolute => ("revolute", true),
        JointType::Continuous => ("continuous", true),
        JointType::Prismatic => ("prismatic", true),
        JointType::Fixed => ("fixed", false),
        JointType::Floating => ("floating", false),
        JointType::Planar => ("planar", true),
        JointType::Spherical => ("spherical", false),
    };
    let link = robot.link_of_joint(&joint.name).map(|l| &robot.links[l]);
    let limit = link.and_then(|link| link.limit).unwrap_or(Limit::NONE);
    let given = |x: f64| x.is_finite().then_some(x);
    JointFacts {
        name: joint.name.clone(),
        kind: kind.to_owned(),
        parent: joint.parent.link.clone(),
        child: joint.child.link.clone(),
        axis: has_axis.then_some(joint.axis.xyz.0),
        lower: given(limit.lower),
        upper: given(limit.upper),
        velocity: given(limit.velocity),
        effort: given(limit.effort),
        mimic: joint.mimic.as_ref().map(|m| m.joint.clone()),
    }
}

fn link_facts(link: &urdf_rs::Link) -> LinkFacts {
    let (mass, matrix) = (link.inertial.mass.value, matrix_of(link));
    let inertia = if mass == 0.0 && matrix == Mat3::zeros() { InertiaFacts::None } else { judge(&matrix) };
    LinkFacts { name: link.name.clone(), mass, inertia, collision_shapes: link.collision.len() }
}

fn judge(inertia: &Mat3) -> InertiaFacts {
    let [smallest, middle, largest] = moments(inertia);
    if smallest <= 0.0 {
        return InertiaFacts::NotPositive { smallest };
    }
    let ratio = largest / (smallest + middle);
    if ratio > 1.0 + ROUNDING { InertiaFacts::Unbalanced { ratio } } else { InertiaFacts::Possible }
}

fn footprint(robot: &Articulation, config: &RobotConfig) -> Vec<[f64; 2]> {
    let parts = &config.parts;
    if let Some(base) = robot.frame(&parts.base_link)
        && let Some(link) = base.link
    {
        let x_base_link = base.x_link_frame.inverse();
        let shapes = robot.links[link].shapes.iter();
        let standing = shapes.filter(|s| s.part == parts.base_link || s.part == parts.bucket_link);
        return outline(standing.map(|s| (&s.shape, x_base_link * s.x_link_shape)));
    }
    let first = robot.links.iter().zip(robot.poses_at_zero()).find(|(link, _)| !link.shapes.is_empty());
    first.map_or(Vec::new(), |(link, x)| outline(link.shapes.iter().map(|s| (&s.shape, x * s.x_link_shape))))
}

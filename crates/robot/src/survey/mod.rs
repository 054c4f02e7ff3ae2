//! Survey of a URDF file of any robot: joints, limits, masses, inertias, and the parts that a harvester still needs.

mod prescan;
mod roles;

pub use roles::RoleFacts;

use crate::RobotError;
use crate::articulation::{Articulation, parsed};
use crate::config::RobotConfig;
use crate::model::RobotModel;
use crate::outline::outline;
use crate::size;
use orchard_geometry::{Mat3, Pose};
use orchard_multibody::JointKind;
use serde::Serialize;
use urdf_rs::{Geometry, JointType};

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
    /// Convex outline on the ground at q = 0, counterclockwise \[m\]: of the config's base and bucket in the base frame, else of
    /// the first link with shapes in the root frame. Meshes are left out.
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
    /// Lowest position [rad or m].
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
    /// Mass or inertia is not a finite number.
    NotFinite,
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

/// A mesh file that a link names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MeshUse {
    /// The link.
    pub link: String,
    /// File name as it stands in the URDF.
    pub file: String,
    /// True for a collision mesh, false for a visual one.
    pub is_collision: bool,
}

/// Share by which principal moments may break the triangle inequality: the rounding of six printed digits.
const ROUNDING: f64 = 1e-5;

impl Survey {
    /// Reads any URDF text. Collision meshes are listed and otherwise left out; `config` names the parts of a harvester.
    ///
    /// # Errors
    /// [`Articulation::from_urdf`] refuses the text for a reason other than meshes, limits lack a velocity, or a moving link has no mass.
    pub fn read(text: &str, config: &RobotConfig) -> Result<Self, RobotError> {
        size::check(text)?;
        prescan::prescan(text)?;
        let mut robot = parsed(text)?;
        let collision_shapes: Vec<usize> = robot.links.iter().map(|l| l.collision.len()).collect();
        let meshes = take_meshes(&mut robot);
        let articulation = Articulation::of(&robot)?;
        for link in &articulation.links {
            if link.joint != JointKind::Weld && link.inertia.mass <= 0.0 {
                let problem = "it moves and has no mass";
                return Err(RobotError::Inertia { link: link.name.clone(), problem });
            }
        }
        let links = robot.links.iter().zip(collision_shapes);
        Ok(Self {
            name: robot.name.clone(),
            joints: robot.joints.iter().map(joint_facts).collect(),
            links: links.map(|(link, shapes)| link_facts(link, shapes)).collect(),
            moving_joints: articulation.links.iter().filter(|l| l.joint != JointKind::Weld).count(),
            mass: articulation.links.iter().map(|l| l.inertia.mass).sum(),
            footprint: footprint(&articulation, config),
            roles: roles::roles(&articulation, &config.parts),
            obstacle: RobotModel::from_urdf(text, config).err().map(|e| e.to_string()),
            meshes,
        })
    }
}

/// Takes the mesh shapes out of a robot.
fn take_meshes(robot: &mut urdf_rs::Robot) -> Vec<MeshUse> {
    let mut meshes = Vec::new();
    for link in &mut robot.links {
        let file = |geometry: &Geometry| match geometry {
            Geometry::Mesh { filename, .. } => Some(filename.clone()),
            _ => None,
        };
        let collisions = link.collision.iter().filter_map(|c| Some((file(&c.geometry)?, true)));
        let visuals = link.visual.iter().filter_map(|v| Some((file(&v.geometry)?, false)));
        let named = collisions.chain(visuals);
        meshes.extend(named.map(|(file, is_collision)| MeshUse {
            link: link.name.clone(),
            file,
            is_collision,
        }));
        link.collision.retain(|c| file(&c.geometry).is_none());
    }
    meshes
}

fn joint_facts(joint: &urdf_rs::Joint) -> JointFacts {
    let (kind, has_axis, has_range) = match joint.joint_type {
        JointType::Revolute => ("revolute", true, true),
        JointType::Continuous => ("continuous", true, false),
        JointType::Prismatic => ("prismatic", true, true),
        JointType::Fixed => ("fixed", false, false),
        JointType::Floating => ("floating", false, false),
        JointType::Planar => ("planar", true, false),
        JointType::Spherical => ("spherical", false, false),
    };
    let limit = &joint.limit;
    let given = |x: f64| (x.is_finite() && x > 0.0).then_some(x);
    JointFacts {
        name: joint.name.clone(),
        kind: kind.to_owned(),
        parent: joint.parent.link.clone(),
        child: joint.child.link.clone(),
        axis: has_axis.then_some(joint.axis.xyz.0),
        lower: has_range.then_some(limit.lower),
        upper: has_range.then_some(limit.upper),
        velocity: given(limit.velocity),
        effort: given(limit.effort),
        mimic: joint.mimic.as_ref().map(|m| m.joint.clone()),
    }
}

fn link_facts(link: &urdf_rs::Link, collision_shapes: usize) -> LinkFacts {
    let i = &link.inertial.inertia;
    let matrix = Mat3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    let mass = link.inertial.mass.value;
    if matrix.iter().chain([&mass]).any(|x| !x.is_finite()) {
        return LinkFacts {
            name: link.name.clone(),
            mass,
            inertia: InertiaFacts::NotFinite,
            collision_shapes,
        };
    }
    let inertia = if mass == 0.0 && matrix == Mat3::zeros() { InertiaFacts::None } else { judge(&matrix) };
    LinkFacts { name: link.name.clone(), mass, inertia, collision_shapes }
}

fn judge(inertia: &Mat3) -> InertiaFacts {
    let moments = inertia.symmetric_eigenvalues();
    let (smallest, largest) = (moments.min(), moments.max());
    if smallest <= 0.0 {
        return InertiaFacts::NotPositive { smallest };
    }
    let ratio = largest / (moments.sum() - largest);
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
    let mut x_root_links: Vec<Pose> = Vec::with_capacity(robot.links.len());
    for link in &robot.links {
        let x_parent = link.parent.map_or(Pose::identity(), |p| x_root_links[p]);
        x_root_links.push(x_parent * link.x_parent_joint);
    }
    let first = robot.links.iter().zip(&x_root_links).find(|(link, _)| !link.shapes.is_empty());
    first.map_or(Vec::new(), |(link, x)| outline(link.shapes.iter().map(|s| (&s.shape, x * s.x_link_shape))))
}

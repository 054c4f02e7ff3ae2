//! Reader of URDF text into a tree of moving links.
//!
//! Links joined by fixed joints become one moving link: their inertias are added, their shapes and frames kept. Cylinders
//! become capsules of the same overall length (spheres where they are shorter than wide).

use crate::RobotError;
use crate::plausible::{EFFORT_MAX, LENGTH_MAX, POSITION_MAX, SPEED_MAX, check_inertial, within};
use crate::size;
use nalgebra::Unit;
use orchard_geometry::{Mat3, Pose, Rotation, Shape, Vec3, transform};
use orchard_multibody::{JointKind, SpatialInertia};
use std::collections::{BTreeMap, BTreeSet};
use urdf_rs::{Geometry, JointType};

/// Limits of a joint with one degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Lowest position [rad or m].
    pub lower: f64,
    /// Highest position [rad or m].
    pub upper: f64,
    /// Largest speed [rad/s or m/s]; infinite if the file gives none.
    pub velocity: f64,
    /// Largest torque or force [N m or N]; infinite if the file gives none.
    pub effort: f64,
}

/// Coupling of a joint to another: q = multiplier * q of the leader.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mimic {
    /// Link of the leading joint.
    pub leader: usize,
    /// Ratio.
    pub multiplier: f64,
}

/// A collision shape of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkShape {
    /// Name of the URDF link that the shape belongs to.
    pub part: String,
    /// Shape.
    pub shape: Shape,
    /// Pose of the shape in the frame of the moving link.
    pub x_link_shape: Pose,
}

/// A moving link with the joint that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Name of the URDF link at the joint.
    pub name: String,
    /// Name of the joint.
    pub joint_name: String,
    /// Moving link that carries this one; `None` is the ground.
    pub parent: Option<usize>,
    /// The joint.
    pub joint: JointKind,
    /// Pose of the joint frame in the parent's frame.
    pub x_parent_joint: Pose,
    /// Inertia of all URDF links that this moving link joins.
    pub inertia: SpatialInertia,
    /// Collision shapes.
    pub shapes: Vec<LinkShape>,
    /// Limits, for hinges and slides.
    pub limit: Option<Limit>,
    /// Coupling to another joint.
    pub mimic: Option<Mimic>,
}

/// The frame of a URDF link.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Name of the URDF link.
    pub name: String,
    /// Moving link that carries this one; `None` is the ground.
    pub link: Option<usize>,
    /// Pose in the frame of that link.
    pub x_link_frame: Pose,
}

/// A robot as moving links, parents before children.
#[derive(Debug, Clone, PartialEq)]
pub struct Articulation {
    /// The robot's name.
    pub name: String,
    /// Moving links, parents before children.
    pub links: Vec<Link>,
    /// Frames of all URDF links.
    pub frames: Vec<Frame>,
}

impl Articulation {
    /// Reads URDF text. Joints may be fixed, revolute, continuous, prismatic, planar (normal z) or floating.
    ///
    /// # Errors
    /// The text is not URDF; links or joints are missing, double, cyclic or unconnected; a joint type or shape is not supported;
    /// a joint lacks limits or mass that it needs; a number is not finite or implausibly large.
    pub fn from_urdf(text: &str) -> Result<Self, RobotError> {
        Self::of(&parsed(text)?)
    }

    pub(crate) fn of(robot: &urdf_rs::Robot) -> Result<Self, RobotError> {
        Builder::new(robot)?.build()
    }

    /// The frame of a URDF link.
    pub fn frame(&self, name: &str) -> Option<&Frame> {
        self.frames.iter().find(|f| f.name == name)
    }

    /// Index of the moving link that a joint carries.
    pub fn link_of_joint(&self, joint: &str) -> Option<usize> {
        self.links.iter().position(|l| l.joint_name == joint)
    }
}

pub(crate) fn parsed(text: &str) -> Result<urdf_rs::Robot, RobotError> {
    size::check(text)?;
    urdf_rs::read_from_string(text).map_err(|e| RobotError::Parse(one_line(&e)))
}

fn one_line(error: &urdf_rs::UrdfError) -> String {
    let mut text = error.to_string();
    let mut source = std::error::Error::source(error);
    while let Some(inner) = source {
        let inner_text = inner.to_string();
        if !text.contains(&inner_text) {
            text = format!("{text}: {inner_text}");
        }
        source = inner.source();
    }
    text.replace('\n', " ")
}

/// Builder of an [`Articulation`] from one file.
struct Builder<'a> {
    robot: &'a urdf_rs::Robot,
    /// Joints by parent link, in file order.
    children: Vec<Vec<usize>>,
    /// Child link of each joint.
    child: Vec<usize>,
    root: usize,
    links: Vec<Link>,
    frames: Vec<Frame>,
}

/// Place of a URDF link in the tree of moving links.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Moving link that carries this one; `None` is the ground.
    on: Option<usize>,
    /// Pose in the frame of that link.
    x: Pose,
    /// Sum of the joint offsets from the root \[m\].
    reach: f64,
}

impl<'a> Builder<'a> {
    fn new(robot: &'a urdf_rs::Robot) -> Result<Self, RobotError> {
        let link_names: Vec<&str> = robot.links.iter().map(|l| l.name.as_str()).collect();
        refuse_duplicates("link", &link_names)?;
        refuse_duplicates("joint", &robot.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>())?;
        let numbers: BTreeMap<&str, usize> = link_names.iter().enumerate().map(|(i, n)| (*n, i)).collect();
        let find = |joint: &urdf_rs::Joint, link: &str| {
            numbers.get(link).copied().ok_or_else(|| RobotError::MissingLink {
                by: format!("joint `{}`", joint.name),
                link: link.to_owned(),
            })
        };
        let mut children = vec![Vec::new(); robot.links.len()];
        let mut has_parent = vec![false; robot.links.len()];
        let mut child_of_joint = Vec::with_capacity(robot.joints.len());
        for (j, joint) in robot.joints.iter().enumerate() {
            let parent = find(joint, &joint.parent.link)?;
            let child = find(joint, &joint.child.link)?;
            if has_parent[child] {
                return Err(RobotError::TwoParents(link_names[child].to_owned()));
            }
            has_parent[child] = true;
            children[parent].push(j);
            child_of_joint.push(child);
        }
        let mut roots = (0..robot.links.len()).filter(|&l| !has_parent[l]);
        let Some(root) = roots.next() else {
            let first = link_names.first().ok_or(RobotError::Empty)?;
            return Err(RobotError::Cyclic((*first).to_owned()));
        };
        if let Some(other) = roots.next() {
            return Err(RobotError::Disconnected(link_names[root].to_owned(), link_names[other].to_owned()));
        }
        Ok(Self { robot, children, child: child_of_joint, root, links: Vec::new(), frames: Vec::new() })
    }

    fn build(mut self) -> Result<Articulation, RobotError> {
        let mut ground = None;
        if self.ground_has_shapes() {
            let name = self.robot.links[self.root].name.clone();
            self.links.push(Link {
                joint_name: String::new(),
                name,
                parent: None,
                joint: JointKind::Weld,
                x_parent_joint: Pose::identity(),
                inertia: massless(),
                shapes: Vec::new(),
                limit: None,
                mimic: None,
            });
            ground = Some(0);
        }
        self.walk(ground)?;
        if self.frames.len() < self.robot.links.len() {
            let placed: BTreeSet<&str> = self.frames.iter().map(|frame| frame.name.as_str()).collect();
            let lost = self.robot.links.iter().find(|link| !placed.contains(link.name.as_str()));
            return Err(RobotError::Cyclic(lost.map(|l| l.name.clone()).unwrap_or_default()));
        }
        self.resolve_mimics()?;
        let carrying: BTreeSet<usize> = self.links.iter().filter_map(|link| link.parent).collect();
        for (i, link) in self.links.iter().enumerate() {
            check_inertia(link, !carrying.contains(&i))?;
        }
        Ok(Articulation { name: self.robot.name.clone(), links: self.links, frames: self.frames })
    }

    /// True if the root, or a link fixed to it, has shapes.
    fn ground_has_shapes(&self) -> bool {
        let mut open = vec![self.root];
        while let Some(link) = open.pop() {
            if !self.robot.links[link].collision.is_empty() {
                return true;
            }
            let fixed = |&&j: &&usize| self.robot.joints[j].joint_type == JointType::Fixed;
            open.extend(self.children[link].iter().filter(fixed).map(|&j| self.child[j]));
        }
        false
    }

    /// Adds all URDF links, depth first and in file order, starting with the root on moving link `ground`.
    ///
    /// It keeps its own stack: a file may hold chains longer than the call stack is deep.
    fn walk(&mut self, ground: Option<usize>) -> Result<(), RobotError> {
        let root = Place { on: ground, x: Pose::identity(), reach: 0.0 };
        self.add_link(self.root, &root)?;
        let mut open = self.joints_at(self.root, root);
        while let Some((j, parent)) = open.pop() {
            let place = self.cross(j, &parent)?;
            self.add_link(self.child[j], &place)?;
            open.append(&mut self.joints_at(self.child[j], place));
        }
        Ok(())
    }

    /// The joints at a link, last in the file first.
    fn joints_at(&self, link: usize, place: Place) -> Vec<(usize, Place)> {
        self.children[link].iter().rev().map(|&j| (j, place)).collect()
    }

    /// Place of the child of a joint; a joint that moves begins a moving link.
    fn cross(&mut self, j: usize, parent: &Place) -> Result<Place, RobotError> {
        let joint = &self.robot.joints[j];
        let name = format!("joint `{}`", joint.name);
        let x_parent_joint = pose_of(&name, &joint.origin)?;
        let x = parent.x * x_parent_joint;
        let reach = parent.reach + x_parent_joint.translation.vector.norm();
        within(&format!("{name}, distance from the root"), &[reach], LENGTH_MAX)?;
        if joint.joint_type == JointType::Fixed {
            return Ok(Place { on: parent.on, x, reach });
        }
        self.links.push(Link {
            name: self.robot.links[self.child[j]].name.clone(),
            joint_name: joint.name.clone(),
            parent: parent.on,
            joint: kind_of(joint)?,
            x_parent_joint: x,
            inertia: massless(),
            shapes: Vec::new(),
            limit: limit_of(joint)?,
            mimic: None,
        });
        Ok(Place { on: Some(self.links.len() - 1), x: Pose::identity(), reach })
    }

    /// Adds frame, inertia and shapes of a URDF link.
    fn add_link(&mut self, link: usize, place: &Place) -> Result<(), RobotError> {
        let urdf = &self.robot.links[link];
        let x = place.x;
        self.frames.push(Frame { name: urdf.name.clone(), link: place.on, x_link_frame: x });
        check_inertial(urdf)?;
        let Some(on) = place.on else { return Ok(()) };
        let added = inertia_of(urdf, &x)?;
        self.links[on].inertia = combined(&self.links[on].inertia, &added);
        for collision in &urdf.collision {
            let (shape, x_shape) = shape_of(&urdf.name, collision)?;
            let x_link_shape = x * x_shape;
            self.links[on].shapes.push(LinkShape { part: urdf.name.clone(), shape, x_link_shape });
        }
        Ok(())
    }

    fn resolve_mimics(&mut self) -> Result<(), RobotError> {
        let names = self.links.iter().enumerate().map(|(i, link)| (link.joint_name.clone(), i));
        let links: BTreeMap<String, usize> = names.collect();
        for joint in &self.robot.joints {
            let (Some(mimic), Some(follower)) = (&joint.mimic, links.get(&joint.name).copied()) else {
                continue;
            };
            let leader =
                links.get(&mimic.joint).copied().filter(|&leader| self.links[leader].limit.is_some());
            let leader = leader.ok_or_else(|| RobotError::MissingJoint {
                by: format!("mimic of joint `{}`", joint.name),
                kind: "one-axis",
                joint: mimic.joint.clone(),
            })?;
            if mimic.offset.is_some_and(|offset| offset != 0.0) {
                return Err(RobotError::Limit {
                    joint: joint.name.clone(),
                    problem: "a mimic offset is not supported",
                });
            }
            let multiplier = mimic.multiplier.unwrap_or(1.0);
            within(&format!("mimic of joint `{}`", joint.name), &[multiplier], POSITION_MAX)?;
            self.links[follower].mimic = Some(Mimic { leader, multiplier });
        }
        Ok(())
    }
}

fn refuse_duplicates(kind: &'static str, names: &[&str]) -> Result<(), RobotError> {
    let mut sorted = names.to_vec();
    sorted.sort_unstable();
    match sorted.windows(2).find(|w| w[0] == w[1]) {
        Some(w) => Err(RobotError::Duplicate { kind, name: w[0].to_owned() }),
        None => Ok(()),
    }
}

fn pose_of(place: &str, origin: &urdf_rs::Pose) -> Result<Pose, RobotError> {
    let (xyz, rpy) = (origin.xyz.0, origin.rpy.0);
    within(place, &xyz, LENGTH_MAX)?;
    within(place, &rpy, POSITION_MAX)?;
    Ok(Pose::from_parts(Vec3::from(xyz).into(), Rotation::from_euler_angles(rpy[0], rpy[1], rpy[2])))
}

fn kind_of(joint: &urdf_rs::Joint) -> Result<JointKind, RobotError> {
    let axis_error = |problem| RobotError::Axis {
        joint: joint.name.clone(),
        axis: format!("{:?}", joint.axis.xyz.0),
        problem,
    };
    within(&format!("axis of joint `{}`", joint.name), &joint.axis.xyz.0, POSITION_MAX)?;
    let axis = || {
        let v = Vec3::from(joint.axis.xyz.0);
        Unit::try_new(v, 1e-9).ok_or_else(|| axis_error("is no direction"))
    };
    match joint.joint_type {
        JointType::Revolute | JointType::Continuous => Ok(JointKind::Hinge(axis()?)),
        JointType::Prismatic => Ok(JointKind::Slide(axis()?)),
        JointType::Planar if (axis()?.z - 1.0).abs() > 1e-12 => {
            Err(axis_error("of a planar joint must be z"))
        }
        JointType::Planar => Ok(JointKind::Planar),
        JointType::Floating => Ok(JointKind::Free),
        JointType::Fixed => Ok(JointKind::Weld),
        JointType::Spherical => {
            Err(RobotError::JointType { joint: joint.name.clone(), kind: "spherical".to_owned() })
        }
    }
}

/// Limits of a joint; `urdf_rs` reads an absent `limit` element as zeros.
fn limit_of(joint: &urdf_rs::Joint) -> Result<Option<Limit>, RobotError> {
    let l = &joint.limit;
    let error = |problem| Err(RobotError::Limit { joint: joint.name.clone(), problem });
    let place = format!("limits of joint `{}`", joint.name);
    within(&place, &[l.lower, l.upper], POSITION_MAX)?;
    within(&place, &[l.velocity], SPEED_MAX)?;
    within(&place, &[l.effort], EFFORT_MAX)?;
    let or_infinite = |x: f64| if x == 0.0 { f64::INFINITY } else { x };
    match joint.joint_type {
        JointType::Revolute | JointType::Prismatic => {
            if l.lower >= l.upper {
                return error("needs position limits with lower below upper");
            }
            if l.effort <= 0.0 {
                return error("needs a positive effort limit");
            }
            if l.velocity <= 0.0 {
                return error("needs a positive velocity limit");
            }
            Ok(Some(Limit { lower: l.lower, upper: l.upper, velocity: l.velocity, effort: l.effort }))
        }
        JointType::Continuous => Ok(Some(Limit {
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            velocity: or_infinite(l.velocity),
            effort: or_infinite(l.effort),
        })),
        _ => Ok(None),
    }
}

fn shape_of(link: &str, collision: &urdf_rs::Collision) -> Result<(Shape, Pose), RobotError> {
    let place = format!("collision of link `{link}`");
    let x = pose_of(&place, &collision.origin)?;
    let capsule = |radius: f64, length: f64| {
        let centred = Pose::translation(0.0, 0.0, -0.5 * length);
        (Shape::Capsule { radius, length }, x * centred)
    };
    let (sizes, made) = match &collision.geometry {
        Geometry::Box { size } => (size.0.to_vec(), (Shape::Box { half: Vec3::from(size.0) * 0.5 }, x)),
        Geometry::Cylinder { radius, length } => {
            (vec![*radius, *length], capsule(*radius, (length - 2.0 * radius).max(0.0)))
        }
        Geometry::Capsule { radius, length } => (vec![*radius, *length], capsule(*radius, *length)),
        Geometry::Sphere { radius } => (vec![*radius], (Shape::Sphere { radius: *radius }, x)),
        Geometry::Mesh { .. } => {
            return Err(RobotError::Geometry { link: link.to_owned(), kind: "mesh" });
        }
    };
    within(&place, &sizes, LENGTH_MAX)?;
    if sizes.iter().any(|s| *s <= 0.0) {
        return Err(RobotError::Geometry { link: link.to_owned(), kind: "of no size" });
    }
    Ok(made)
}

fn massless() -> SpatialInertia {
    SpatialInertia { mass: 0.0, p_com: Vec3::zeros(), i_com: Mat3::zeros() }
}

/// Inertia of a URDF link in the frame of the moving link that carries it at `x`.
fn inertia_of(link: &urdf_rs::Link, x: &Pose) -> Result<SpatialInertia, RobotError> {
    let place = format!("inertia of link `{}`", link.name);
    let inertial = &link.inertial;
    let i = &inertial.inertia;
    let mass = inertial.mass.value;
    let i_link = Mat3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    let error = |problem| Err(RobotError::Inertia { link: link.name.clone(), problem });
    if mass < 0.0 {
        return error("the mass is negative");
    }
    if i_link.symmetric_eigenvalues().min() < 0.0 {
        return error("the inertia is not that of a body (a principal moment is negative)");
    }
    let at_com = SpatialInertia { mass, p_com: Vec3::zeros(), i_com: i_link };
    Ok(moved(&at_com, &(x * pose_of(&place, &inertial.origin)?)))
}

/// Transforms an inertia from frame b to frame a.
pub(crate) fn moved(inertia: &SpatialInertia, x_a_b: &Pose) -> SpatialInertia {
    let r = x_a_b.rotation.to_rotation_matrix().into_inner();
    SpatialInertia {
        mass: inertia.mass,
        p_com: transform(x_a_b, &inertia.p_com),
        i_com: r * inertia.i_com * r.transpose(),
    }
}

/// Inertia of a point mass at `p` about the origin [kg m^2] (parallel-axis theorem).
pub(crate) fn point_inertia(mass: f64, p: &Vec3) -> Mat3 {
    (Mat3::identity() * p.norm_squared() - p * p.transpose()) * mass
}

/// Inertia of two bodies welded together; all inertias in one frame.
pub(crate) fn combined(a: &SpatialInertia, b: &SpatialInertia) -> SpatialInertia {
    let mass = a.mass + b.mass;
    if mass == 0.0 {
        return massless();
    }
    let p_com = (a.p_com * a.mass + b.p_com * b.mass) / mass;
    let i_com = a.i_com
        + b.i_com
        + point_inertia(a.mass, &(a.p_com - p_com))
        + point_inertia(b.mass, &(b.p_com - p_com));
    SpatialInertia { mass, p_com, i_com }
}

/// Checks that an outermost link has mass and inertia for its joint to accelerate.
fn check_inertia(link: &Link, is_leaf: bool) -> Result<(), RobotError> {
    let error = |problem| Err(RobotError::Inertia { link: link.name.clone(), problem });
    if !is_leaf || link.joint == JointKind::Weld {
        return Ok(());
    }
    if link.inertia.mass <= 0.0 {
        return error("the last link of a chain needs mass");
    }
    let i_origin = link.inertia.i_com + point_inertia(link.inertia.mass, &link.inertia.p_com);
    let turns_about = match link.joint {
        JointKind::Hinge(axis) => axis.dot(&(i_origin * axis.into_inner())),
        JointKind::Planar => i_origin.m33,
        JointKind::Free => link.inertia.i_com.symmetric_eigenvalues().min(),
        _ => return Ok(()),
    };
    if turns_about <= 0.0 {
        return error("the last link of a chain needs inertia about its joint");
    }
    Ok(())
}

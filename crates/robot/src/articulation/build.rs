//! Builder of an articulation: moving links, with what is fixed to them.

use super::inertia::{NO_MASS, combined, inertia_of, least, massless};
use super::motion::{Freedom, Motion};
use super::parts::{Articulation, Frame, Friction, Limit, Link, LinkShape, Mimic};
use super::place::{kind_of, moved_by, pose_of};
use super::shape::Shapes;
use super::tree::Tree;
use crate::RobotError;
use crate::plausible::{EFFORT_MAX, LENGTH_MAX, check_inertial, within};
use crate::warning::Warning;
use orchard_geometry::Pose;
use orchard_multibody::JointKind;
use urdf_rs::JointType;

/// Builder of an [`Articulation`] from one file.
pub(super) struct Builder<'a, 'r> {
    pub robot: &'a urdf_rs::Robot,
    pub tree: &'a Tree,
    /// Motion of each joint.
    pub motions: &'a [Motion],
    pub shapes: Shapes<'r>,
    pub warnings: Vec<Warning>,
    links: Vec<Link>,
    frames: Vec<Frame>,
    /// Moving link that each joint carries.
    link_of_joint: Vec<Option<usize>>,
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

impl<'a, 'r> Builder<'a, 'r> {
    pub fn new(
        robot: &'a urdf_rs::Robot,
        tree: &'a Tree,
        motions: &'a [Motion],
        shapes: Shapes<'r>,
        warnings: Vec<Warning>,
    ) -> Self {
        let link_of_joint = vec![None; robot.joints.len()];
        Self { robot, tree, motions, shapes, warnings, links: Vec::new(), frames: Vec::new(), link_of_joint }
    }

    /// Builds the articulation; returns it with the mesh shapes and the warnings.
    pub fn build(mut self) -> Result<(Articulation, Shapes<'r>, Vec<Warning>), RobotError> {
        let mut ground = None;
        if self.ground_has_shapes() {
            let name = self.robot.links[self.tree.root].name.clone();
            self.links.push(Link {
                joint_name: String::new(),
                name,
                parent: None,
                joint: JointKind::Weld,
                x_parent_joint: Pose::identity(),
                inertia: massless(),
                shapes: Vec::new(),
                limit: None,
                friction: Friction::default(),
                mimic: None,
            });
            ground = Some(0);
        }
        self.walk(ground)?;
        self.couple();
        for link in &mut self.links {
            if link.joint != JointKind::Weld && link.inertia.mass < NO_MASS {
                link.inertia = least();
                let assumed = link.inertia.mass;
                self.warnings.push(Warning::NoMass { link: link.name.clone(), assumed });
            }
        }
        let name = self.robot.name.clone();
        Ok((Articulation { name, links: self.links, frames: self.frames }, self.shapes, self.warnings))
    }

    /// True if the root, or a link fixed to it, has shapes.
    fn ground_has_shapes(&self) -> bool {
        let mut open = vec![self.tree.root];
        while let Some(link) = open.pop() {
            if !self.robot.links[link].collision.is_empty() {
                return true;
            }
            let fixed = |&&j: &&usize| matches!(self.motions[j], Motion::At(_));
            open.extend(self.tree.children[link].iter().filter(fixed).map(|&j| self.tree.child[j]));
        }
        false
    }

    /// Adds all URDF links, from the root out, starting with the root on moving link `ground`.
    fn walk(&mut self, ground: Option<usize>) -> Result<(), RobotError> {
        let root = Place { on: ground, x: Pose::identity(), reach: 0.0 };
        let mut places: Vec<Place> = vec![root; self.robot.links.len()];
        self.add_link(self.tree.root, &root)?;
        let tree = self.tree;
        for &j in &tree.order {
            let place = self.cross(j, &places[self.tree.parent[j]])?;
            places[self.tree.child[j]] = place;
            self.add_link(self.tree.child[j], &place)?;
        }
        Ok(())
    }

    /// Place of the child of a joint; a joint that moves begins a moving link.
    fn cross(&mut self, j: usize, parent: &Place) -> Result<Place, RobotError> {
        let joint = &self.robot.joints[j];
        let name = format!("joint `{}`", joint.name);
        let x_parent_child = pose_of(&name, &joint.origin)?;
        let x = parent.x * x_parent_child;
        let reach = parent.reach + x_parent_child.translation.vector.norm();
        within(&format!("{name}, distance from the root"), &[reach], LENGTH_MAX)?;
        // The axis of a fixed joint has no meaning.
        if joint.joint_type == JointType::Fixed {
            return Ok(Place { on: parent.on, x, reach });
        }
        let (kind, turn) = kind_of(joint)?;
        let freedom = match self.motions[j] {
            Motion::At(position) => {
                return Ok(Place { on: parent.on, x: x * moved_by(&kind, position), reach });
            }
            Motion::Free(freedom) => freedom,
        };
        // Products with nothing are left out, so that descriptions without turns and offsets keep their bits.
        let mut x_parent_joint = x;
        let mut x_joint_link = Pose::identity();
        if let Some(turn) = turn {
            let turned = Pose::from_parts(Default::default(), turn);
            x_parent_joint *= turned;
            x_joint_link = turned.inverse();
        }
        if freedom.zero != 0.0 {
            x_parent_joint *= moved_by(&kind, freedom.zero);
        }
        self.link_of_joint[j] = Some(self.links.len());
        self.links.push(Link {
            name: self.robot.links[self.tree.child[j]].name.clone(),
            joint_name: joint.name.clone(),
            parent: parent.on,
            joint: kind,
            x_parent_joint,
            inertia: massless(),
            shapes: Vec::new(),
            limit: limit_from_zero(&freedom),
            friction: friction_of(joint)?,
            mimic: None,
        });
        Ok(Place { on: Some(self.links.len() - 1), x: x_joint_link, reach })
    }

    /// Adds frame, inertia and shapes of a URDF link.
    fn add_link(&mut self, link: usize, place: &Place) -> Result<(), RobotError> {
        let urdf = &self.robot.links[link];
        let x = place.x;
        self.frames.push(Frame { name: urdf.name.clone(), link: place.on, x_link_frame: x });
        check_inertial(urdf)?;
        let Some(on) = place.on else { return Ok(()) };
        let added = inertia_of(urdf, &x, &mut self.warnings)?;
        self.links[on].inertia = combined(&self.links[on].inertia, &added);
        for collision in &urdf.collision {
            for (shape, x_shape) in self.shapes.of(&urdf.name, collision, &mut self.warnings)? {
                let x_link_shape = x * x_shape;
                self.links[on].shapes.push(LinkShape { part: urdf.name.clone(), shape, x_link_shape });
            }
        }
        Ok(())
    }

    /// Couples followers to their leaders.
    fn couple(&mut self) {
        for (j, motion) in self.motions.iter().enumerate() {
            let Motion::Free(Freedom { mimic: Some((leader, multiplier)), .. }) = motion else { continue };
            if let (Some(follower), Some(leader)) = (self.link_of_joint[j], self.link_of_joint[*leader]) {
                self.links[follower].mimic = Some(Mimic { leader, multiplier: *multiplier });
            }
        }
    }
}

/// Friction that a description states for a joint; none by default.
fn friction_of(joint: &urdf_rs::Joint) -> Result<Friction, RobotError> {
    let Some(dynamics) = &joint.dynamics else { return Ok(Friction::default()) };
    let Friction { coulomb, viscous } = Friction { coulomb: dynamics.friction, viscous: dynamics.damping };
    within(&format!("dynamics of joint `{}`", joint.name), &[coulomb, viscous], EFFORT_MAX)?;
    if coulomb < 0.0 || viscous < 0.0 {
        let problem = "its friction or damping is negative";
        return Err(RobotError::Limit { joint: joint.name.clone(), problem });
    }
    Ok(Friction { coulomb, viscous })
}

/// Limits of a joint by its own q, which counts from the offset of a follower.
fn limit_from_zero(freedom: &Freedom) -> Option<Limit> {
    let zero = freedom.zero;
    freedom.limit.map(|limit| Limit { lower: limit.lower - zero, upper: limit.upper - zero, ..limit })
}

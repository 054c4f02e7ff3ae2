//! Robot model: an articulation with the roles of its parts, to be placed in a world's model.

use crate::RobotError;
use crate::arm::ArmKinematics;
use crate::articulation::{Articulation, combined, moved};
use crate::config::RobotConfig;
use crate::handle::{Bucket, PartGroups, RobotColliders, RobotHandle};
use crate::io::{ARM_DOF, Command};
use crate::outline::outline;
use crate::roles::Roles;
use orchard_geometry::{Aabb, Pose, Rotation, Vec3};
use orchard_multibody::{
    Body, BodyId, Collider, Coupling, Data, JointKind, Model, ModelBuilder, Owner, SpatialInertia,
    forward_kinematics,
};

/// A mobile manipulator: planar base, height, arm of seven hinges, two fingers, bucket, wrist camera.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotModel {
    urdf: String,
    articulation: Articulation,
    config: RobotConfig,
    pub(crate) roles: Roles,
    kinematics: ArmKinematics,
    whole: SpatialInertia,
}

impl RobotModel {
    /// Reads a robot from URDF text and a config that names its parts.
    ///
    /// # Errors
    /// [`Articulation::from_urdf`] refuses the text, or the file lacks a part that the config names.
    pub fn from_urdf(text: &str, config: &RobotConfig) -> Result<Self, RobotError> {
        let articulation = Articulation::from_urdf(text)?;
        let roles = Roles::find(&articulation, &config.parts)?;
        let kinematics = ArmKinematics::new(&articulation, &roles, config)?;
        let whole = whole_inertia(&articulation, &roles, config);
        Ok(Self { urdf: text.to_owned(), articulation, config: config.clone(), roles, kinematics, whole })
    }

    /// The robot of preset `paper`.
    ///
    /// # Panics
    /// Never: the embedded files are read in this crate's tests.
    pub fn paper() -> Self {
        match Self::from_urdf(crate::PAPER_URDF, &RobotConfig::paper()) {
            Ok(robot) => robot,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }

    /// URDF text that the robot was read from.
    pub fn urdf(&self) -> &str {
        &self.urdf
    }

    /// The moving links.
    pub fn articulation(&self) -> &Articulation {
        &self.articulation
    }

    /// The config.
    pub fn config(&self) -> &RobotConfig {
        &self.config
    }

    /// Kinematics of the arm.
    pub fn kinematics(&self) -> &ArmKinematics {
        &self.kinematics
    }

    /// Interior of the bucket.
    pub fn bucket(&self) -> Bucket {
        self.roles.bucket
    }

    /// Bounding box of the chassis in the base frame; a point at the origin if the robot has no chassis shapes.
    pub fn chassis(&self) -> Aabb {
        let roles = &self.roles;
        let x_base_link = roles.x_link_base.inverse();
        let shapes = self.articulation.links[roles.base].shapes.iter();
        let chassis = shapes.filter(|s| s.part == self.config.parts.base_link);
        let boxes = chassis.map(|s| s.shape.aabb(&(x_base_link * s.x_link_shape)));
        boxes.reduce(|a, b| a.union(&b)).unwrap_or(Aabb { min: Vec3::zeros(), max: Vec3::zeros() })
    }

    /// Convex outline of chassis and bucket on the ground: counterclockwise corners in the base frame \[m\].
    pub fn footprint(&self) -> Vec<[f64; 2]> {
        let x_base_link = self.roles.x_link_base.inverse();
        let parts = &self.config.parts;
        let shapes = self.articulation.links[self.roles.base].shapes.iter();
        let standing = shapes.filter(|s| s.part == parts.base_link || s.part == parts.bucket_link);
        outline(standing.map(|s| (&s.shape, x_base_link * s.x_link_shape)))
    }

    /// Lag of the height servo behind a set point that moves evenly \[s\].
    pub fn height_lag(&self) -> f64 {
        self.config.height.damping.si() / self.config.height.stiffness.si()
    }

    /// Mass of the whole robot \[kg\].
    pub fn mass(&self) -> f64 {
        self.whole.mass
    }

    /// Mass that the height servo carries: all links beyond its joint \[kg\].
    pub(crate) fn carried_mass(&self) -> f64 {
        let links = &self.articulation.links;
        let mut carried = vec![false; links.len()];
        let mut mass = 0.0;
        for (i, link) in links.iter().enumerate() {
            carried[i] = i == self.roles.height || link.parent.is_some_and(|p| carried[p]);
            if carried[i] {
                mass += link.inertia.mass;
            }
        }
        mass
    }

    /// Yaw inertia of the whole robot in its start posture about the base's origin [kg m^2].
    pub(crate) fn yaw_inertia(&self) -> f64 {
        let c = self.whole.p_com;
        self.whole.i_com.m33 + self.whole.mass * (c.x * c.x + c.y * c.y)
    }

    /// Command that holds the start posture.
    pub fn start_command(&self) -> Command {
        Command {
            arm_q: self.kinematics.home().into(),
            arm_v: [0.0; ARM_DOF],
            base_velocity: [0.0; 3],
            finger_q: self.config.start.finger_opening.si(),
            finger_force: self.kinematics.finger_force(),
        }
    }

    /// Adds the robot to a world. `x_world_odom` places the base at q = 0.
    pub fn add_to(
        &self,
        builder: &mut ModelBuilder,
        x_world_odom: &Pose,
        groups: &PartGroups,
    ) -> RobotHandle {
        let links = &self.articulation.links;
        let mut bodies: Vec<BodyId> = Vec::with_capacity(links.len());
        let mut dofs = Vec::with_capacity(links.len());
        for link in links {
            let x_parent_joint = match link.parent {
                Some(_) => link.x_parent_joint,
                None => x_world_odom * link.x_parent_joint,
            };
            dofs.push(builder.nv());
            bodies.push(builder.add_body(Body {
                parent: link.parent.map(|p| bodies[p]),
                joint: link.joint,
                x_parent_joint,
                inertia: link.inertia,
            }));
        }
        for (i, link) in links.iter().enumerate() {
            if let Some(mimic) = link.mimic {
                builder.add_coupling(Coupling {
                    dof_a: dofs[i],
                    dof_b: dofs[mimic.leader],
                    ratio: mimic.multiplier,
                    stiffness: self.config.finger.coupling_stiffness.si(),
                    damping: self.config.finger.coupling_damping.si(),
                });
            }
        }
        let wrist = self.kinematics.mounts;
        RobotHandle {
            colliders: self.add_colliders(builder, &bodies, groups),
            planar: bodies[self.roles.planar],
            height: bodies[self.roles.height],
            base: bodies[self.roles.base],
            x_body_base: self.roles.x_link_base,
            arm: self.roles.arm.map(|l| bodies[l]),
            fingers: self.roles.fingers.map(|l| bodies[l]),
            x_wrist_camera: wrist.x_wrist_camera,
            x_wrist_hand: wrist.x_wrist_hand,
            x_wrist_tcp: wrist.x_wrist_tcp,
            bucket: self.roles.bucket,
            bodies,
        }
    }

    fn add_colliders(
        &self,
        builder: &mut ModelBuilder,
        bodies: &[BodyId],
        part_groups: &PartGroups,
    ) -> RobotColliders {
        let mut colliders = RobotColliders::default();
        let surface = &self.config.surface;
        for (i, link) in self.articulation.links.iter().enumerate() {
            let on_arm = self.roles.arm.iter().position(|&l| l == i).map(|joint| joint + 1);
            let on_hand = self.roles.fingers.contains(&i).then_some(ARM_DOF);
            let rank = on_arm.or(on_hand).unwrap_or(0);
            for s in &link.shapes {
                let finger = self.roles.fingers.iter().position(|&l| l == i);
                let (list, groups, friction) = if let Some(f) = finger {
                    (&mut colliders.fingers[f], part_groups.finger, surface.finger_friction.si())
                } else if s.part == self.config.parts.bucket_link {
                    (&mut colliders.bucket, part_groups.bucket, surface.body_friction.si())
                } else if s.part == self.config.parts.base_link {
                    (&mut colliders.base, part_groups.base, surface.body_friction.si())
                } else {
                    (&mut colliders.arm, part_groups.arm, surface.body_friction.si())
                };
                list.push(builder.add_collider(Collider {
                    owner: Owner::Body(bodies[i]),
                    shape: s.shape.clone(),
                    x_owner_shape: s.x_link_shape,
                    groups: part_groups.on_link(groups, rank, |other| self.kinematics.watches(rank, other)),
                    friction,
                    stiffness: surface.stiffness.si(),
                }));
            }
        }
        colliders
    }

    /// Puts the robot into its start posture, at rest, at the origin of its odom frame.
    pub fn set_start(&self, model: &Model, data: &mut Data, handle: &RobotHandle) {
        for &body in &handle.bodies {
            data.v[model.dofs(body)].fill(0.0);
        }
        let start = self.start_command();
        data.q[model.qs(handle.planar)].fill(0.0);
        data.q[model.qs(handle.height)].fill(0.0);
        for i in 0..ARM_DOF {
            data.q[model.qs(handle.arm[i]).start] = start.arm_q[i];
        }
        for finger in handle.fingers {
            data.q[model.qs(finger).start] = start.finger_q;
        }
        forward_kinematics(model, data);
    }
}

/// Inertia of all links that move with the base, in the start posture and the odom frame.
fn whole_inertia(articulation: &Articulation, roles: &Roles, config: &RobotConfig) -> SpatialInertia {
    let mut whole =
        SpatialInertia { mass: 0.0, p_com: Vec3::zeros(), i_com: orchard_geometry::Mat3::zeros() };
    let mut x_odom_links: Vec<Pose> = Vec::with_capacity(articulation.links.len());
    for (i, link) in articulation.links.iter().enumerate() {
        let q = match (roles.arm.iter().position(|&l| l == i), roles.fingers.contains(&i)) {
            (Some(joint), _) => config.start.arm_home[joint].si(),
            (None, true) => config.start.finger_opening.si(),
            (None, false) => 0.0,
        };
        let moved_by = match link.joint {
            JointKind::Hinge(axis) => {
                Pose::from_parts(Default::default(), Rotation::from_axis_angle(&axis, q))
            }
            JointKind::Slide(axis) => Pose::from_parts((axis.into_inner() * q).into(), Rotation::identity()),
            _ => Pose::identity(),
        };
        let x_parent = link.parent.map_or(Pose::identity(), |p| x_odom_links[p]);
        let x = x_parent * link.x_parent_joint * moved_by;
        whole = combined(&whole, &moved(&link.inertia, &x));
        x_odom_links.push(x);
    }
    whole
}

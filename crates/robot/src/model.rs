//! Robot model: an articulation with the roles of its parts, to be placed in a world's model.

use crate::RobotError;
use crate::arm::ArmKinematics;
use crate::articulation::{Articulation, combined, moved, moved_by};
use crate::base::BaseJoint;
use crate::config::RobotConfig;
use crate::cup::Cup;
use crate::handle::{Bucket, PartGroups, RobotColliders, RobotHandle};
use crate::io::Command;
use crate::joint_values::JointValues;
use crate::outline::outline;
use crate::resources::{NoMeshes, Resources};
use crate::roles::Roles;
use crate::warning::Warning;
use orchard_geometry::{Aabb, Pose, Shape, Vec3, transform};
use orchard_multibody::{
    Body, BodyId, Collider, ColliderId, Coupling, Data, JointKind, Model, ModelBuilder, Owner,
    SpatialInertia, forward_kinematics,
};

/// A manipulator: a base that stands, slides or drives, a height joint or none, an arm of four to eight hinges, two fingers or a suction cup,
/// a bucket and a wrist camera.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotModel {
    urdf: String,
    articulation: Articulation,
    config: RobotConfig,
    pub(crate) roles: Roles,
    kinematics: ArmKinematics,
    whole: SpatialInertia,
    warnings: Vec<Warning>,
}

impl RobotModel {
    /// Reads a robot from URDF text and a config that names its parts.
    ///
    /// # Errors
    /// [`Articulation::from_urdf`] refuses the text, or the file lacks a part that the config names.
    pub fn from_urdf(text: &str, config: &RobotConfig) -> Result<Self, RobotError> {
        Self::load(text, &mut NoMeshes, config)
    }

    /// Reads a robot from URDF text, with the mesh files that `resources` finds, and a config that names its parts.
    ///
    /// # Errors
    /// [`Articulation::load`] refuses the text, or the file lacks a part that the config names.
    pub fn load(text: &str, resources: &mut dyn Resources, config: &RobotConfig) -> Result<Self, RobotError> {
        let loaded = Articulation::load(text, resources, &config.limits)?;
        Ok(Self { warnings: loaded.warnings, ..Self::of(text, loaded.articulation, config)? })
    }

    /// Robot of an articulation that was loaded from URDF text, on the config's mount and with its bucket. Joints that play no part are locked
    /// at 0.
    ///
    /// # Errors
    /// The articulation lacks a part that the config names.
    pub fn of(text: &str, articulation: Articulation, config: &RobotConfig) -> Result<Self, RobotError> {
        let articulation = articulation.into_harvester(config);
        let roles = Roles::find(&articulation, &config.parts)?;
        let kinematics = ArmKinematics::new(&articulation, &roles, config)?;
        let whole = whole_inertia(&articulation, &roles, config);
        let (urdf, config) = (text.to_owned(), config.clone());
        Ok(Self { urdf, articulation, config, roles, kinematics, whole, warnings: Vec::new() })
    }

    /// URDF text that the robot was read from.
    pub fn urdf(&self) -> &str {
        &self.urdf
    }

    /// Warnings: gaps and errors of the description, each with the value assumed instead.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
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

    /// Joint of the base, with its link.
    pub fn base_joint(&self) -> BaseJoint<usize> {
        self.roles.base_joint
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
        let chassis = shapes.filter(|s| self.is_chassis(&s.part));
        let boxes = chassis.map(|s| s.shape.aabb(&(x_base_link * s.x_link_shape)));
        boxes.reduce(|a, b| a.union(&b)).unwrap_or(Aabb { min: Vec3::zeros(), max: Vec3::zeros() })
    }

    /// True if a shape of the base's link belongs to the chassis: that of the link that the config names, or of all that stands on a mount.
    fn is_chassis(&self, part: &str) -> bool {
        let parts = &self.config.parts;
        part == parts.base_link || (self.config.mount.is_some() && part != parts.bucket_link)
    }

    /// Convex outline of chassis and bucket on the ground: counterclockwise corners in the base frame \[m\].
    pub fn footprint(&self) -> Vec<[f64; 2]> {
        let x_base_link = self.roles.x_link_base.inverse();
        let bucket = &self.config.parts.bucket_link;
        let shapes = self.articulation.links[self.roles.base].shapes.iter();
        let standing = shapes.filter(|s| self.is_chassis(&s.part) || s.part == *bucket);
        outline(standing.map(|s| (&s.shape, x_base_link * s.x_link_shape)))
    }

    /// Lag of the height servo behind a set point that moves evenly \[s\]; 0 without that servo.
    pub fn height_lag(&self) -> f64 {
        self.config.height.as_ref().map_or(0.0, |gains| gains.damping.si() / gains.stiffness.si())
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
            carried[i] = self.roles.height == Some(i) || link.parent.is_some_and(|p| carried[p]);
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
            arm_q: self.kinematics.values(&self.kinematics.home()),
            arm_v: JointValues::zeros(self.kinematics.dof()),
            base_velocity: [0.0; 3],
            finger_q: self.config.start.finger_opening(),
            finger_force: self.kinematics.finger_force(),
            vacuum: 0.0,
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
            if let (Some(mimic), Some(drive)) = (link.mimic, &self.config.finger) {
                // Given at the pads; on a lever for a hinge.
                let finger = self.roles.finger_of(i).map(|f| &self.roles.fingers[f]);
                let lever = match link.joint {
                    JointKind::Hinge(_) => finger.map_or(1.0, |found| found.lever),
                    _ => 1.0,
                };
                builder.add_coupling(Coupling {
                    dof_a: dofs[i],
                    dof_b: dofs[mimic.leader],
                    ratio: mimic.multiplier,
                    stiffness: drive.coupling_stiffness.si() * (lever * lever),
                    damping: drive.coupling_damping.si() * (lever * lever),
                });
            }
        }
        let wrist = self.kinematics.mounts;
        RobotHandle {
            colliders: self.add_colliders(builder, &bodies, groups),
            base_joint: self.roles.base_joint.map(|l| bodies[l]),
            height: self.roles.height.map(|l| bodies[l]),
            base: bodies[self.roles.base],
            x_body_base: self.roles.x_link_base,
            arm: self.roles.arm.iter().map(|&l| bodies[l]).collect(),
            fingers: self.roles.fingers.iter().map(|found| found.finger.map(|l| bodies[l])).collect(),
            cup: self.cup(),
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
            let finger = self.roles.finger_of(i);
            let on_hand = finger.map(|_| self.kinematics.dof());
            let rank = on_arm.or(on_hand).unwrap_or(0);
            for s in &link.shapes {
                let (list, groups, friction) = if let Some(f) = finger {
                    (&mut colliders.fingers[f], part_groups.finger, surface.finger_friction.si())
                } else if s.part == self.config.parts.bucket_link {
                    (&mut colliders.bucket, part_groups.bucket, surface.body_friction.si())
                } else if i == self.roles.base && self.is_chassis(&s.part) {
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
        colliders.cup = self.add_lip(builder, bodies, part_groups);
        colliders
    }

    /// Puts the robot into its start posture, at rest, at the origin of its odom frame.
    pub fn set_start(&self, model: &Model, data: &mut Data, handle: &RobotHandle) {
        for &body in &handle.bodies {
            data.v[model.dofs(body)].fill(0.0);
        }
        let start = self.start_command();
        for &body in handle.base_joint.moving().into_iter().chain(&handle.height) {
            data.q[model.qs(body)].fill(0.0);
        }
        for (&body, q) in handle.arm.iter().zip(&start.arm_q) {
            data.q[model.qs(body).start] = *q;
        }
        for finger in &handle.fingers {
            let q = finger.opening.joint(start.finger_q);
            for link in &finger.links {
                data.q[model.qs(link.on).start] = link.ratio * q;
            }
        }
        forward_kinematics(model, data);
    }
}

impl RobotModel {
    /// The suction cup, if the hand has one.
    pub fn cup(&self) -> Option<Cup> {
        self.kinematics().cup().cloned()
    }

    /// Adds the points of the lip to a world, as balls on the last arm link.
    pub(crate) fn add_lip(
        &self,
        builder: &mut ModelBuilder,
        bodies: &[BodyId],
        groups: &PartGroups,
    ) -> Vec<ColliderId> {
        let (Some(cup), Some(config)) = (self.cup(), &self.config().cup) else { return Vec::new() };
        let rank = self.kinematics().dof();
        let groups = groups.on_link(groups.finger, rank, |other| self.kinematics().watches(rank, other));
        let stiffness = config.stiffness.si() / cup.lip_p_lip.len() as f64;
        let point = |p_lip: &Vec3| {
            builder.add_collider(Collider {
                owner: Owner::Body(bodies[self.roles.wrist()]),
                shape: Shape::Sphere { radius: cup.half_thickness },
                x_owner_shape: Pose::from_parts(
                    transform(&cup.x_wrist_lip, p_lip).into(),
                    Default::default(),
                ),
                groups,
                friction: config.friction.si(),
                stiffness,
            })
        };
        cup.lip_p_lip.iter().map(point).collect()
    }
}

/// Inertia of all links that move with the base, in the start posture and the odom frame.
fn whole_inertia(articulation: &Articulation, roles: &Roles, config: &RobotConfig) -> SpatialInertia {
    let mut whole =
        SpatialInertia { mass: 0.0, p_com: Vec3::zeros(), i_com: orchard_geometry::Mat3::zeros() };
    let mut x_odom_links: Vec<Pose> = Vec::with_capacity(articulation.links.len());
    for (i, link) in articulation.links.iter().enumerate() {
        let in_finger = || {
            let finger = &roles.fingers.get(roles.finger_of(i)?)?.finger;
            let own = finger.links.iter().find(|own| own.on == i)?;
            Some(own.ratio * finger.opening.joint(config.start.finger_opening()))
        };
        let q = match roles.arm.iter().position(|&l| l == i) {
            Some(joint) => config.start.arm_home[joint].si(),
            None => in_finger().unwrap_or(0.0),
        };
        let x_parent = link.parent.map_or(Pose::identity(), |p| x_odom_links[p]);
        let x = x_parent * link.x_parent_joint * moved_by(&link.joint, q);
        whole = combined(&whole, &moved(&link.inertia, &x));
        x_odom_links.push(x);
    }
    whole
}

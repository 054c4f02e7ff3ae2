//! Constants of a robot for the kernels.

use bytemuck::{Pod, Zeroable};
use orchard_geometry::{Mat3, Pose, Vec3, rotation_from_z};
use orchard_multibody::{BodyId, Data, Groups, JointKind, Model, ModelBuilder, SpatialInertia};
use orchard_robot::{
    BaseJoint, BaseServo, Curve, Drivetrain, Finger, Limit, Opening, PartGroups, RobotHandle, RobotModel,
    ServoParameters, Steering, VelocityDrive,
};
use orchard_spec::sim::SimSpec;

use super::cup::CupTable;
use crate::BatchError;
use crate::layout::{CURVE_INTERVALS, QUAD, UNBOUNDED, drive, robot};

/// Constants of a robot and of its step. `kernels/robot.wgsl` has the same fields in the same order, and explains them.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Table {
    h: f32,
    gravity: f32,
    substeps: u32,
    pub worlds: u32,
    dofs: u32,
    arm_joints: u32,
    fingers: u32,
    couplings: u32,
    arm_stiffness: f32,
    arm_damping: f32,
    arm_acceleration: f32,
    gravity_share: f32,
    height_dof: i32,
    height_stiffness: f32,
    height_damping: f32,
    height_force: f32,
    base: u32,
    creep: f32,
    turning_radius: f32,
    base_mass: f32,
    travel: [f32; QUAD],
    turn: [f32; QUAD],
    rail_lower: f32,
    rail_upper: f32,
    rail_velocity: f32,
    yaw_inertia: f32,
    rail: [f32; 2],
    finger_stiffness: f32,
    finger_damping: f32,
    finger_speed: f32,
    finger_force: f32,
    unused: [f32; 2],
    wrist: Inertia,
    cup: CupTable,
    links: [Link; robot::DOFS],
    arm: [ArmJoint; robot::ARM],
    coupled: [Coupling; robot::COUPLINGS],
    finger: [FingerDrive; robot::FINGERS],
    curves: [[[f32; QUAD]; CURVE_INTERVALS]; robot::FINGERS],
    /// State after a reset.
    pub start: [f32; robot::FIELDS],
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Inertia {
    p_com: [f32; 3],
    mass: f32,
    diagonal: [f32; 3],
    unused: f32,
    products: [f32; 3],
    unused_too: f32,
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Link {
    p_parent: [f32; 3],
    parent: i32,
    y_parent: [f32; 3],
    slides: u32,
    z_parent: [f32; 3],
    unused: f32,
    inertia: Inertia,
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct ArmJoint {
    lower: f32,
    upper: f32,
    velocity: f32,
    effort: f32,
    armature: f32,
    coulomb: f32,
    viscous: f32,
    dof: u32,
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Coupling {
    a: u32,
    b: u32,
    ratio: f32,
    stiffness: f32,
    damping: f32,
    unused: [f32; 3],
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FingerDrive {
    dof: u32,
    lower: f32,
    upper: f32,
    inertia: f32,
    turns: u32,
    start: f32,
    step: f32,
    unused: f32,
}

impl Inertia {
    /// Inertia of a body in the frame of its link.
    fn new(inertia: &SpatialInertia, x_body_link: &Pose) -> Self {
        let turn = x_body_link.rotation.to_rotation_matrix().into_inner();
        let about_com: Mat3 = turn.tr_mul(&inertia.i_com) * turn;
        Self {
            p_com: numbers(&turn.tr_mul(&inertia.p_com)),
            mass: inertia.mass as f32,
            diagonal: numbers(&about_com.diagonal()),
            products: [(0, 1), (0, 2), (1, 2)].map(|place| about_com[place] as f32),
            ..Zeroable::zeroed()
        }
    }
}

/// A frame on a link, or on the ground.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub link: i32,
    pub x_link_frame: Pose,
}

impl Place {
    const GROUND: i32 = -1;
}

/// Group of colliders of [`Alone::model`] that meet the ground: arm and fingers, as in `orchard_world`; a height servo holds chassis and bucket over it.
pub(crate) const ON_GROUND: u32 = 1;
/// The lowest of the nine bits by which its links meet each other.
const LINKS: u32 = 1;

/// The model of a robot alone at the origin of odom, and its start. Its colliders are in groups that tell which of them meet each other and the ground.
#[derive(Debug)]
pub(crate) struct Alone {
    pub model: Model,
    pub handle: RobotHandle,
    pub start: Data,
}

impl Alone {
    /// Places a robot.
    ///
    /// # Errors
    /// The robot's parts form no valid model.
    pub fn new(robot: &RobotModel) -> Result<Self, BatchError> {
        let none = Groups::NONE;
        let hand = Groups { filter: ON_GROUND, ..none };
        let groups =
            PartGroups { base: none, arm: hand, finger: hand, bucket: none, self_contact: Some(LINKS) };
        let mut builder = ModelBuilder::new();
        let handle = robot.add_to(&mut builder, &Pose::identity(), &groups);
        let model = builder.build().map_err(|e| refused(robot, &e.to_string()))?;
        let mut start = Data::new(&model);
        robot.set_start(&model, &mut start, &handle);
        Ok(Self { model, handle, start })
    }
}

/// Error: the kernels cannot step a robot.
pub(crate) fn refused(robot: &RobotModel, why: &str) -> BatchError {
    BatchError::Robot { robot: robot.articulation().name.clone(), why: why.to_owned() }
}

impl Table {
    /// Constants of `worlds` robots of a kind, of which `alone` is one.
    ///
    /// # Errors
    /// The robot has a joint, or more of something, than the kernels know.
    pub fn new(
        robot_model: &RobotModel,
        alone: &Alone,
        sim: &SimSpec,
        worlds: u32,
    ) -> Result<Self, BatchError> {
        let Alone { model, handle, .. } = alone;
        for (what, has, most) in [
            ("degrees of freedom", model.nv(), robot::DOFS),
            ("fingers", handle.fingers.len(), robot::FINGERS),
            ("couplings", model.couplings().len(), robot::COUPLINGS),
        ] {
            if has > most {
                return Err(refused(robot_model, &format!("it has {has} {what}, the kernels know {most}")));
            }
        }
        let servos = ServoParameters::new(robot_model);
        let mut table = Self {
            h: sim.substep() as f32,
            gravity: sim.gravity.si() as f32,
            substeps: sim.substeps.get(),
            worlds,
            dofs: model.nv() as u32,
            arm_joints: handle.arm.len() as u32,
            couplings: model.couplings().len() as u32,
            arm_stiffness: servos.arm.stiffness as f32,
            arm_damping: servos.arm.damping as f32,
            arm_acceleration: servos.arm_acceleration as f32,
            gravity_share: servos.gravity_share as f32,
            height_dof: Place::GROUND,
            creep: Drivetrain::CREEP as f32,
            finger_speed: servos.finger_speed as f32,
            finger_force: servos.finger_force as f32,
            ..Self::zeroed()
        };
        let places = table.set_links(model).map_err(|why| refused(robot_model, &why))?;
        let wrist = places[handle.wrist().index()];
        let cup = CupTable::new(handle, wrist.link, &wrist.x_link_frame);
        table.cup = cup.map_err(|why| refused(robot_model, &why))?;
        if let (Some(body), Some(gains)) = (handle.height, servos.height) {
            table.height_dof = model.dofs(body).start as i32;
            (table.height_stiffness, table.height_damping) = (gains.stiffness as f32, gains.damping as f32);
            table.height_force = (servos.carried_mass * sim.gravity.si()) as f32;
        }
        if let Some(drive) = &servos.base {
            table.set_base(&robot_model.base_joint(), drive);
        }
        table.set_arm(robot_model, alone, &servos);
        if let Some(gains) = servos.finger {
            table.fingers = handle.fingers.len() as u32;
            (table.finger_stiffness, table.finger_damping) = (gains.stiffness as f32, gains.damping as f32);
        }
        for (k, (finger, servo)) in handle.fingers.iter().zip(&servos.fingers).enumerate() {
            let (lower, upper, inertia) = (servo.lower as f32, servo.upper as f32, servo.inertia as f32);
            let dof = model.dofs(finger.drive).start as u32;
            table.finger[k] = FingerDrive { dof, lower, upper, inertia, ..Zeroable::zeroed() };
            table.set_curve(k, finger);
        }
        for (coupled, coupling) in table.coupled.iter_mut().zip(model.couplings()) {
            *coupled = Coupling {
                a: coupling.dof_a as u32,
                b: coupling.dof_b as u32,
                ratio: coupling.ratio as f32,
                stiffness: coupling.stiffness as f32,
                damping: coupling.damping as f32,
                unused: [0.0; 3],
            };
        }
        table.set_start(robot_model, &alone.start);
        Ok(table)
    }

    /// Splits the bodies into links with one degree of freedom each, about or along their z. A link has the number of its degree of freedom. Returns the place of each body's frame.
    ///
    /// # Errors
    /// A joint is of a kind that the kernels lack.
    pub fn set_links(&mut self, model: &Model) -> Result<Vec<Place>, String> {
        let ground = Place { link: Place::GROUND, x_link_frame: Pose::identity() };
        let mut places: Vec<Place> = Vec::with_capacity(model.bodies().len());
        for (body, id) in model.bodies().iter().zip(model.body_ids()) {
            let Place { mut link, mut x_link_frame } = body.parent.map_or(ground, |up| places[up.index()]);
            x_link_frame *= body.x_parent_joint;
            let (turns, slides) = (0, 1);
            let axes: &[(Vec3, u32)] = match body.joint {
                JointKind::Weld if link == Place::GROUND => &[],
                JointKind::Hinge(axis) => &[(axis.into_inner(), turns)],
                JointKind::Slide(axis) => &[(axis.into_inner(), slides)],
                JointKind::Planar => &[(Vec3::x(), slides), (Vec3::y(), slides), (Vec3::z(), turns)],
                other => return Err(format!("the kernels lack joints of the kind {other:?}")),
            };
            for (dof, &(axis, slides)) in model.dofs(id).zip(axes) {
                let x_frame_link = Pose::from_parts(Vec3::zeros().into(), rotation_from_z(&axis));
                let x_parent_link = x_link_frame * x_frame_link;
                let axes = x_parent_link.rotation.to_rotation_matrix().into_inner();
                self.links[dof] = Link {
                    p_parent: numbers(&x_parent_link.translation.vector),
                    parent: link,
                    y_parent: numbers(&axes.column(1).into_owned()),
                    slides,
                    z_parent: numbers(&axes.column(2).into_owned()),
                    ..Zeroable::zeroed()
                };
                if dof + 1 == model.dofs(id).end {
                    self.links[dof].inertia = Inertia::new(&body.inertia, &x_frame_link);
                }
                (link, x_link_frame) = (dof as i32, x_frame_link.inverse());
            }
            places.push(Place { link, x_link_frame });
        }
        Ok(places)
    }

    fn set_base(&mut self, joint: &BaseJoint<usize>, servo: &BaseServo) {
        let numbers_of = |of: &VelocityDrive| {
            [of.damping, of.effort_max, of.speed_max, of.acceleration_max].map(|x| x as f32)
        };
        (self.travel, self.turn) = (numbers_of(&servo.travel), numbers_of(&servo.turn));
        (self.base_mass, self.yaw_inertia) = (servo.mass as f32, servo.yaw_inertia as f32);
        self.base = match joint {
            BaseJoint::Fixed => drive::FIXED,
            BaseJoint::Rail { axis_base, .. } => {
                let Limit { lower, upper, velocity, .. } = servo.rail.unwrap_or(Limit::NONE);
                let bounded = |x: f64| (x as f32).clamp(-UNBOUNDED, UNBOUNDED);
                (self.rail_lower, self.rail_upper) = (bounded(lower), bounded(upper));
                self.rail_velocity = velocity.min(servo.travel.speed_max) as f32;
                self.rail = [axis_base.x as f32, axis_base.y as f32];
                drive::RAIL
            }
            BaseJoint::Planar(_) => match &servo.steering {
                Steering::Holonomic => drive::HOLONOMIC,
                Steering::Differential => drive::DIFFERENTIAL,
                Steering::Ackermann { turning_radius } => {
                    self.turning_radius = turning_radius.si() as f32;
                    drive::ACKERMANN
                }
            },
        } as u32;
    }

    fn set_arm(&mut self, robot_model: &RobotModel, alone: &Alone, servos: &ServoParameters) {
        let kinematics = robot_model.kinematics();
        let joints = alone.handle.arm.iter().zip(kinematics.limits()).zip(&servos.drivetrains);
        for (arm, ((&body, limit), drivetrain)) in self.arm.iter_mut().zip(joints) {
            *arm = ArmJoint {
                lower: limit.lower as f32,
                upper: limit.upper as f32,
                velocity: limit.velocity as f32,
                effort: limit.effort as f32,
                armature: drivetrain.armature as f32,
                coulomb: drivetrain.coulomb as f32,
                viscous: drivetrain.viscous as f32,
                dof: alone.model.dofs(body).start as u32,
            };
        }
        if let JointKind::Hinge(axis) = alone.model.body(alone.handle.wrist()).joint {
            let x_body_link = Pose::from_parts(Vec3::zeros().into(), rotation_from_z(&axis));
            self.wrist = Inertia::new(&kinematics.wrist_inertia(), &x_body_link);
        }
    }

    fn set_curve(&mut self, index: usize, finger: &Finger<BodyId>) {
        let Opening::Turn(turn) = &finger.opening else { return };
        let Curve { start, step, points } = &turn.opening;
        let own = &mut self.finger[index];
        (own.turns, own.start, own.step) = (1, *start as f32, *step as f32);
        for (interval, ends) in self.curves[index].iter_mut().zip(points.windows(2)) {
            *interval = [ends[0][0], ends[0][1], ends[1][0], ends[1][1]].map(|x| x as f32);
        }
    }

    /// The start posture at rest, with the set points of new servos.
    fn set_start(&mut self, robot_model: &RobotModel, start: &Data) {
        let command = robot_model.start_command();
        for (field, values) in [
            (robot::Q, &start.q[..]),
            (robot::ARM_TARGET, &command.arm_q),
            (robot::FINGER_TARGET, &[command.finger_q; robot::FINGERS]),
        ] {
            for (number, value) in self.start[field..].iter_mut().zip(values) {
                *number = *value as f32;
            }
        }
    }
}

fn numbers(vector: &Vec3) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

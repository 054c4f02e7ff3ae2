//! Assembly of the arm's kinematics from the links of a robot.

use crate::RobotError;
use crate::arm::{ArmKinematics, Mount, MountedShape, WristMounts};
use crate::articulation::{Articulation, Limit};
use crate::chain::{Chain, Hinge};
use crate::clearance::watched_pairs;
use crate::config::{CameraMount, RobotConfig};
use crate::cup::Cup;
use crate::finger::chain_pose;
use crate::parameters::{IkParameters, QpParameters};
use crate::roles::{Roles, frame_on};
use orchard_geometry::{Mat3, Pose, Rotation, Vec3};

impl ArmKinematics {
    /// Makes the kinematics of the arm that has the given roles.
    ///
    /// # Errors
    /// The hand's or the TCP's link is missing, or is not fixed to the wrist.
    pub(crate) fn new(
        articulation: &Articulation,
        roles: &Roles,
        config: &RobotConfig,
    ) -> Result<Self, RobotError> {
        let links = &articulation.links;
        let x_link_base = roles.x_link_base;
        let opening = config.start.finger_opening();
        let wrist = roles.wrist();
        let mut shapes = Vec::new();
        let mut mount = |link: usize, mount: &Mount, x: &Pose, rank: usize| {
            for s in &links[link].shapes {
                let x_mount_shape = x * s.x_link_shape;
                shapes.push(MountedShape {
                    shape: s.shape.clone(),
                    mount: mount.clone(),
                    x_mount_shape,
                    rank,
                });
            }
        };
        mount(roles.base, &Mount::Base, &x_link_base.inverse(), 0);
        for (i, &link) in roles.arm.iter().enumerate() {
            mount(link, &Mount::Arm(i), &Pose::identity(), i + 1);
        }
        let mut hinges = Vec::with_capacity(roles.arm.len());
        for (i, &link) in roles.arm.iter().enumerate() {
            let mut x_parent_joint = links[link].x_parent_joint;
            if i == 0 {
                x_parent_joint = x_link_base.inverse() * x_parent_joint;
            }
            hinges.push(Hinge { x_parent_joint, axis: roles.arm_axes[i], inertia: links[link].inertia });
        }
        for (i, found) in roles.fingers.iter().enumerate() {
            let q = found.finger.opening.joint(opening);
            for (link, chain) in found.finger.links.iter().zip(&found.chains) {
                mount(link.on, &Mount::Finger(i, chain.clone()), &Pose::identity(), roles.arm.len());
                if let Some(last) = hinges.last_mut() {
                    last.carry(&links[link.on].inertia, &chain_pose(chain, q));
                }
            }
        }
        let frame = |name: &str| frame_on(articulation, name, wrist);
        let x_wrist_hand = frame(&config.parts.hand_link)?;
        let x_wrist_tcp = frame(&config.parts.tcp_link)?;
        let finger = roles.fingers.first().map(|found| found.limit).zip(config.finger.as_ref());
        let chain = Chain { hinges };
        let mut arm = Self {
            stretch: chain.stretch(),
            chain,
            limits: std::array::from_fn(|i| roles.arm_limits.get(i).copied().unwrap_or(Limit::LOCKED)),
            home: config.start.arm_home().vector(),
            ik: IkParameters::new(&config.ik),
            mounts: WristMounts {
                x_wrist_hand,
                x_wrist_tcp,
                x_wrist_camera: x_wrist_hand * camera_mount(&config.camera),
            },
            cup: config.cup.as_ref().map(|cup| Cup::new(cup, x_wrist_tcp)),
            openings: roles.fingers.iter().map(|found| found.finger.opening.clone()).collect(),
            finger_stroke: finger.map_or(0.0, |(limit, _)| limit.upper),
            finger_speed: finger.map_or(0.0, |(limit, drive)| drive.speed_max.si().min(limit.velocity)),
            finger_force: finger.map_or(0.0, |(limit, drive)| drive.force_max.si().min(limit.effort)),
            shapes,
            pairs: Default::default(),
            qp: QpParameters::new(config),
        };
        arm.pairs = watched_pairs(&arm);
        Ok(arm)
    }
}

/// Pose of the optical frame in the hand frame: the image's upper side points along the offset from the approach axis, and the optical axis
/// is turned back towards that axis by the toe-in.
fn camera_mount(mount: &CameraMount) -> Pose {
    let p = Vec3::new(mount.x.si(), mount.y.si(), mount.z.si());
    let up = Vec3::new(p.x, p.y, 0.0).try_normalize(1e-9).unwrap_or(Vec3::x());
    let (sin, cos) = orchard_geometry::math::sin_cos(mount.toe_in.si());
    let z = Vec3::z() * cos - up * sin;
    let y = -(up * cos + Vec3::z() * sin);
    let r = nalgebra::Rotation3::from_matrix_unchecked(Mat3::from_columns(&[y.cross(&z), y, z]));
    Pose::from_parts(p.into(), Rotation::from_rotation_matrix(&r))
}

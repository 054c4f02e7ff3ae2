//! The articulation of a harvester from that of any robot: its mount on the ground, and no joints but those that play a part.

use crate::articulation::{Articulation, Frame, Friction, Link, LinkShape, Mimic, combined, massless, moved};
use crate::config::{MountConfig, MountKind, RobotConfig};
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_multibody::{JointKind, SpatialInertia};

/// Name of the frame on the ground that a mount adds.
const MOUNT: &str = "mount";

/// Place of a link of the old articulation: the moving link that carries it, and its pose there.
type Place = (Option<usize>, Pose);

impl Articulation {
    /// Returns the robot as a harvester: on the mount of the config, with its bucket, and with all joints locked at 0 that no part needs.
    /// A robot without such joints and additions stays as it is.
    pub(crate) fn into_harvester(mut self, config: &RobotConfig) -> Self {
        let parts = &config.parts;
        let named = parts.base_joint.iter().chain(&parts.height_joint);
        let named: Vec<&String> =
            named.chain(&parts.arm_joints).chain(parts.finger_joints.iter().flatten()).collect();
        let is_ground = |link: &Link| link.joint == JointKind::Weld && link.parent.is_none();
        if let Some(mount) = &config.mount {
            self = self.mounted(mount, parts.base_joint.as_deref().unwrap_or_default());
        }
        // What moves with a finger joint is part of the finger.
        let fingers = parts.finger_joints.iter().flatten().filter_map(|name| self.link_of_joint(name));
        let leaders: Vec<usize> = fingers.map(|link| self.lead(link).0).collect();
        let is_kept = |(i, link): (usize, &Link)| {
            is_ground(link) || named.contains(&&link.joint_name) || leaders.contains(&self.lead(i).0)
        };
        let kept: Vec<bool> = self.links.iter().enumerate().map(is_kept).collect();
        if kept.contains(&false) {
            self = self.locked(&kept);
        }
        self.add_bucket(config);
        self.add_payload(config);
        self
    }

    /// Puts the robot on a joint that connects its root to the ground, and adds a frame on the ground under the root.
    fn mounted(mut self, mount: &MountConfig, joint_name: &str) -> Self {
        let x_joint_root = Pose::translation(0.0, 0.0, mount.height.si());
        let joint = match &mount.joint {
            MountKind::Stands => JointKind::Weld,
            MountKind::Drives => JointKind::Planar,
            MountKind::Slides { .. } => JointKind::Slide(Vec3::y_axis()),
        };
        // Shapes of the root are on a link that is fixed to the ground, if there are any.
        let has_ground = self.links.first().is_some_and(|l| l.joint == JointKind::Weld && l.parent.is_none());
        if !has_ground {
            let ground = Link {
                name: self.name.clone(),
                joint_name: String::new(),
                parent: None,
                joint: JointKind::Weld,
                x_parent_joint: Pose::identity(),
                inertia: massless(),
                shapes: Vec::new(),
                limit: None,
                friction: Friction::default(),
                mimic: None,
            };
            self.links.insert(0, ground);
            for link in &mut self.links[1..] {
                link.parent = Some(link.parent.map_or(0, |p| p + 1));
                link.mimic = link.mimic.map(|m| Mimic { leader: m.leader + 1, ..m });
            }
            for frame in &mut self.frames {
                frame.link = Some(frame.link.map_or(0, |l| l + 1));
            }
        }
        let frame = Frame { name: MOUNT.to_owned(), link: Some(0), x_link_frame: Pose::identity() };
        let (root, others) = self.links.split_at_mut(1);
        let root = &mut root[0];
        joint_name.clone_into(&mut root.joint_name);
        root.joint = joint;
        root.limit = mount.joint.limit();
        root.inertia = moved(&root.inertia, &x_joint_root);
        for shape in &mut root.shapes {
            shape.x_link_shape = x_joint_root * shape.x_link_shape;
        }
        for link in others.iter_mut().filter(|link| link.parent == Some(0)) {
            link.x_parent_joint = x_joint_root * link.x_parent_joint;
        }
        for frame in self.frames.iter_mut().filter(|frame| frame.link == Some(0)) {
            frame.x_link_frame = x_joint_root * frame.x_link_frame;
        }
        self.frames.push(frame);
        self
    }

    /// Locks joints at 0: their links become parts of the links that carry them.
    fn locked(self, kept: &[bool]) -> Self {
        let mut links: Vec<Link> = Vec::with_capacity(self.links.len());
        let mut places: Vec<Place> = Vec::with_capacity(self.links.len());
        for (mut link, &is_kept) in self.links.into_iter().zip(kept) {
            let (carrier, x_carrier) = link.parent.map_or((None, Pose::identity()), |p| places[p]);
            let x = x_carrier * link.x_parent_joint;
            if is_kept {
                (link.parent, link.x_parent_joint) = (carrier, x);
                places.push((Some(links.len()), Pose::identity()));
                links.push(link);
                continue;
            }
            places.push((carrier, x));
            // What is fixed to the ground itself has neither inertia nor shapes there.
            let Some(carrier) = carrier else { continue };
            let carrier = &mut links[carrier];
            carrier.inertia = combined(&carrier.inertia, &moved(&link.inertia, &x));
            let shapes = link.shapes.into_iter();
            carrier.shapes.extend(shapes.map(|s| LinkShape { x_link_shape: x * s.x_link_shape, ..s }));
        }
        // A leader may stand behind its follower. Links that mimic a locked one stand, too, if they are kept for a reason of their own.
        for link in &mut links {
            link.mimic = link.mimic.filter(|mimic| kept[mimic.leader]).and_then(|mimic| {
                let leader = places[mimic.leader].0?;
                Some(Mimic { leader, ..mimic })
            });
        }
        let frames = self.frames.into_iter().map(|mut frame| {
            if let Some((on, x)) = frame.link.map(|link| places[link]) {
                (frame.link, frame.x_link_frame) = (on, x * frame.x_link_frame);
            }
            frame
        });
        Self { name: self.name, frames: frames.collect(), links }
    }

    /// Adds the mass of the config's payload to the link that carries the tool, at the tool's point.
    fn add_payload(&mut self, config: &RobotConfig) {
        let Some(payload) = &config.arm.payload else { return };
        let tool =
            self.frame(&config.parts.tcp_link).and_then(|frame| Some((frame.link?, frame.x_link_frame)));
        let Some((on, x_link_tool)) = tool else { return };
        let load = SpatialInertia { mass: payload.si(), ..massless() };
        let carrier = &mut self.links[on];
        carrier.inertia = combined(&carrier.inertia, &moved(&load, &x_link_tool));
    }

    /// Adds the boxes of the config's bucket to the link that carries the base.
    fn add_bucket(&mut self, config: &RobotConfig) {
        let Some(bucket) = &config.bucket else { return };
        let base =
            self.frame(&config.parts.base_link).and_then(|frame| Some((frame.link?, frame.x_link_frame)));
        let Some((base, x_link_base)) = base else { return };
        let [x, y, floor] = [&bucket.x, &bucket.y, &bucket.floor].map(|q| q.si());
        let (half, depth, wall) = (0.5 * bucket.width.si(), bucket.depth.si(), 0.5 * bucket.wall.si());
        let outer = half + 2.0 * wall;
        let boxes = [
            (Vec3::new(outer, outer, wall), Vec3::new(0.0, 0.0, -wall)),
            (Vec3::new(wall, outer, 0.5 * depth), Vec3::new(half + wall, 0.0, 0.5 * depth)),
            (Vec3::new(wall, outer, 0.5 * depth), Vec3::new(-half - wall, 0.0, 0.5 * depth)),
            (Vec3::new(outer, wall, 0.5 * depth), Vec3::new(0.0, half + wall, 0.5 * depth)),
            (Vec3::new(outer, wall, 0.5 * depth), Vec3::new(0.0, -half - wall, 0.5 * depth)),
        ];
        for (half, offset) in boxes {
            let p_base = Vec3::new(x, y, floor) + offset;
            let x_link_shape = x_link_base * Pose::from_parts(p_base.into(), Default::default());
            let part = config.parts.bucket_link.clone();
            self.links[base].shapes.push(LinkShape { part, shape: Shape::Box { half }, x_link_shape });
        }
    }
}

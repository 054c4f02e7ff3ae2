//! Parts that a harvester needs, and whether a robot has them.

use super::draft::{coupled, longest_row};
use crate::articulation::Articulation;
use crate::config::Parts;
use orchard_geometry::Shape;
use orchard_multibody::JointKind;
use serde::Serialize;

/// A part that a harvester needs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RoleFacts {
    /// The part, by its key in the config.
    pub role: &'static str,
    /// Kind of joint or link that the part must be.
    pub needs: &'static str,
    /// The name that the config looks for.
    pub wanted: String,
    /// True if the file has the part.
    pub is_there: bool,
    /// Links or joints of the file that could be the part.
    pub candidates: Vec<String>,
}

/// All parts of the config, in the config's order, as the harvester made of a robot has them; optional parts that the config does not name
/// are left out.
pub(super) fn roles(robot: &Articulation, harvester: &Articulation, parts: &Parts) -> Vec<RoleFacts> {
    let joint = |name: &str| harvester.link_of_joint(name).map(|l| &harvester.links[l]);
    let joints_of = |fits: &dyn Fn(&JointKind) -> bool| {
        robot.links.iter().filter(|l| fits(&l.joint)).map(|l| l.joint_name.clone()).collect::<Vec<_>>()
    };
    let is_hinge = |kind: &JointKind| matches!(kind, JointKind::Hinge(_));
    let is_slide = |kind: &JointKind| matches!(kind, JointKind::Slide(_));
    let is_planar = |kind: &JointKind| *kind == JointKind::Planar;
    let joint_role =
        |role, needs, wanted: &[String], fits: &dyn Fn(&JointKind) -> bool, candidates| RoleFacts {
            role,
            needs,
            wanted: wanted.join(" "),
            is_there: wanted.iter().all(|name| joint(name).is_some_and(|l| fits(&l.joint))),
            candidates,
        };
    let link_role = |role, needs, wanted: &str, is_there: bool, candidates| RoleFacts {
        role,
        needs,
        wanted: wanted.to_owned(),
        is_there,
        candidates,
    };
    let moves = |name: &str| harvester.frame(name).is_some_and(|f| f.link.is_some());
    let has_boxes = |name: &str| {
        harvester
            .links
            .iter()
            .flat_map(|l| &l.shapes)
            .any(|s| s.part == name && matches!(s.shape, Shape::Box { .. }))
    };
    let ends = leaves(robot);
    let row = longest_row(robot).into_iter().map(|l| robot.links[l].joint_name.clone()).collect();
    let drives = |kind: &JointKind| is_planar(kind) || is_slide(kind);
    let mut roles = vec![
        joint_role(
            "base_joint",
            "planar joint, or prismatic on a rail",
            parts.base_joint.as_slice(),
            &drives,
            joints_of(&is_planar),
        ),
        joint_role(
            "height_joint",
            "prismatic joint",
            parts.height_joint.as_slice(),
            &is_slide,
            joints_of(&is_slide),
        ),
        link_role("base_link", "link of the base", &parts.base_link, moves(&parts.base_link), Vec::new()),
        joint_role("arm_joints", "4 to 8 hinges in a row", &parts.arm_joints, &is_hinge, row),
        joint_role(
            "finger_joints",
            "2 prismatic joints or hinges on the last hinge",
            parts.finger_joints.as_ref().map_or(&[], |joints| &joints[..]),
            &|kind| is_slide(kind) || is_hinge(kind),
            finger_drives(robot),
        ),
        link_role(
            "hand_link",
            "link on the last hinge",
            &parts.hand_link,
            moves(&parts.hand_link),
            Vec::new(),
        ),
        link_role("tcp_link", "link on the last hinge", &parts.tcp_link, moves(&parts.tcp_link), ends),
        link_role(
            "bucket_link",
            "link of collision boxes",
            &parts.bucket_link,
            has_boxes(&parts.bucket_link),
            Vec::new(),
        ),
    ];
    roles.retain(|role| !role.wanted.is_empty());
    roles
}

/// Joints that slide; if there is none, those that mimic one another.
fn finger_drives(robot: &Articulation) -> Vec<String> {
    let is_coupled = coupled(robot);
    let names = |fits: &dyn Fn(usize) -> bool| -> Vec<String> {
        let links = (0..robot.links.len()).filter(|&l| fits(l));
        links.map(|l| robot.links[l].joint_name.clone()).collect()
    };
    let slides = names(&|l| matches!(robot.links[l].joint, JointKind::Slide(_)));
    if slides.is_empty() { names(&|l| is_coupled[l]) } else { slides }
}

/// URDF links without shapes that moving links carry and whose names suggest a tool.
fn leaves(robot: &Articulation) -> Vec<String> {
    let is_bare = |name: &str| robot.links.iter().flat_map(|l| &l.shapes).all(|s| s.part != name);
    let is_tool =
        |name: &str| ["tcp", "tool", "ee"].iter().any(|word| name.to_ascii_lowercase().contains(word));
    let on_link = robot.frames.iter().filter(|f| f.link.is_some());
    on_link.map(|f| &f.name).filter(|name| is_bare(name) && is_tool(name)).cloned().collect()
}

//! Parts that a harvester needs, and whether a robot has them.

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

/// All parts of the config, in the config's order.
pub(super) fn roles(robot: &Articulation, parts: &Parts) -> Vec<RoleFacts> {
    let joint = |name: &str| robot.link_of_joint(name).map(|l| &robot.links[l]);
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
    let moves = |name: &str| robot.frame(name).is_some_and(|f| f.link.is_some());
    let has_boxes = |name: &str| {
        robot
            .links
            .iter()
            .flat_map(|l| &l.shapes)
            .any(|s| s.part == name && matches!(s.shape, Shape::Box { .. }))
    };
    let ends = leaves(robot);
    vec![
        joint_role(
            "base_joint",
            "planar joint",
            std::slice::from_ref(&parts.base_joint),
            &is_planar,
            joints_of(&is_planar),
        ),
        joint_role(
            "height_joint",
            "prismatic joint",
            std::slice::from_ref(&parts.height_joint),
            &is_slide,
            joints_of(&is_slide),
        ),
        link_role("base_link", "moving link", &parts.base_link, moves(&parts.base_link), Vec::new()),
        joint_role("arm_joints", "7 hinges in a row", &parts.arm_joints, &is_hinge, longest_row(robot)),
        joint_role(
            "finger_joints",
            "2 prismatic joints",
            &parts.finger_joints,
            &is_slide,
            joints_of(&is_slide),
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
    ]
}

/// Names of the hinges of the longest serial chain, from the root out.
fn longest_row(robot: &Articulation) -> Vec<String> {
    let mut lengths: Vec<usize> = Vec::with_capacity(robot.links.len());
    for link in &robot.links {
        let before = link.parent.map_or(0, |p| lengths[p]);
        lengths.push(if matches!(link.joint, JointKind::Hinge(_)) { before + 1 } else { 0 });
    }
    let mut row = Vec::new();
    let longest = (0..lengths.len()).reduce(|a, b| if lengths[b] > lengths[a] { b } else { a });
    let mut at = longest;
    while let Some(link) = at.filter(|&l| lengths[l] > 0) {
        row.push(robot.links[link].joint_name.clone());
        at = robot.links[link].parent;
    }
    row.reverse();
    row
}

/// URDF links without shapes that moving links carry and whose names suggest a tool.
fn leaves(robot: &Articulation) -> Vec<String> {
    let is_bare = |name: &str| robot.links.iter().flat_map(|l| &l.shapes).all(|s| s.part != name);
    let is_tool =
        |name: &str| ["tcp", "tool", "ee"].iter().any(|word| name.to_ascii_lowercase().contains(word));
    let on_link = robot.frames.iter().filter(|f| f.link.is_some());
    on_link.map(|f| &f.name).filter(|name| is_bare(name) && is_tool(name)).cloned().collect()
}

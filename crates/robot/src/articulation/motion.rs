//! Motion of each joint: fixed, at one position, or free to move, with what it mimics.

use super::limits::{Limits, Room, limit_of};
use super::parts::Limit;
use super::tree::Tree;
use crate::RobotError;
use crate::plausible::{POSITION_MAX, within};
use crate::warning::Warning;
use std::collections::BTreeMap;
use urdf_rs::JointType;

/// Most joints that move, our own choice: a robot with two arms and hands has 101.
const MOVING_MAX: usize = 128;

/// Motion of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Motion {
    /// The joint stays at a position of the description [rad or m].
    At(f64),
    /// The joint moves.
    Free(Freedom),
}

/// Freedom of a joint that moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Freedom {
    /// Limits by the description, for hinges and slides.
    pub limit: Option<Limit>,
    /// Position of the description at which q is zero: the offset of a follower.
    pub zero: f64,
    /// Leading joint and ratio.
    pub mimic: Option<(usize, f64)>,
}

/// Coupling of a joint to another: q = ratio * q of the leader + offset, by the positions of the description.
#[derive(Debug, Clone, Copy)]
struct Following {
    leader: usize,
    ratio: f64,
    offset: f64,
}

/// Motions of all joints, in the order of the file.
pub(super) fn motions(
    robot: &urdf_rs::Robot,
    tree: &Tree,
    stated: &BTreeMap<String, [bool; 4]>,
    limits: &Limits,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Motion>, RobotError> {
    limits.check_names(&robot.joints)?;
    let leaders = leaders(robot)?;
    let is_leader = |j: usize| leaders.iter().flatten().any(|following| following.leader == j);
    let matters = matters(robot, tree);
    let mut motions = Vec::with_capacity(robot.joints.len());
    for (j, joint) in robot.joints.iter().enumerate() {
        let stated = stated.get(&joint.name).copied().unwrap_or_default();
        let free = |limit| Motion::Free(Freedom { limit, zero: 0.0, mimic: None });
        motions.push(match joint.joint_type {
            JointType::Fixed => Motion::At(0.0),
            _ if !matters[tree.child[j]] && !is_leader(j) => {
                warnings.push(Warning::MovesNothing { joint: joint.name.clone() });
                Motion::At(0.0)
            }
            JointType::Revolute | JointType::Continuous | JointType::Prismatic => {
                match limit_of(joint, stated, limits, warnings)? {
                    Room::Within(limit) => free(Some(limit)),
                    Room::At(position) => {
                        warnings.push(Warning::Locked { joint: joint.name.clone(), position });
                        Motion::At(position)
                    }
                }
            }
            _ => free(None),
        });
    }
    let moving = motions.iter().filter(|motion| matches!(motion, Motion::Free(_))).count();
    if moving > MOVING_MAX {
        return Err(RobotError::TooMany { what: "joints that move", most: MOVING_MAX });
    }
    for j in leading_first(robot, &leaders)? {
        let (Some(following), Motion::Free(freedom)) = (leaders[j], motions[j]) else {
            continue;
        };
        let Following { leader, ratio, offset } = following;
        motions[j] = match motions[leader] {
            Motion::At(position) => {
                let leader = robot.joints[leader].name.clone();
                warnings.push(Warning::MimicsFixed { joint: robot.joints[j].name.clone(), leader });
                Motion::At(ratio * position + offset)
            }
            Motion::Free(lead) => {
                let zero = ratio * lead.zero + offset;
                within(&format!("mimic of joint `{}`", robot.joints[j].name), &[zero], POSITION_MAX)?;
                Motion::Free(Freedom { zero, mimic: Some((leader, ratio)), ..freedom })
            }
        };
    }
    Ok(motions)
}

/// Coupling of each joint to another, if it has one.
fn leaders(robot: &urdf_rs::Robot) -> Result<Vec<Option<Following>>, RobotError> {
    let numbers: BTreeMap<&str, usize> =
        robot.joints.iter().enumerate().map(|(j, joint)| (joint.name.as_str(), j)).collect();
    let has_axis = |joint: &urdf_rs::Joint| {
        !matches!(joint.joint_type, JointType::Planar | JointType::Floating | JointType::Spherical)
    };
    let one = |joint: &urdf_rs::Joint| {
        let Some(mimic) = &joint.mimic else { return Ok(None) };
        // The ratio of a joint that cannot follow has no meaning.
        if joint.joint_type == JointType::Fixed || !has_axis(joint) {
            return Ok(None);
        }
        let place = format!("mimic of joint `{}`", joint.name);
        let leader = numbers.get(mimic.joint.as_str()).copied().filter(|&l| has_axis(&robot.joints[l]));
        let leader = leader.ok_or_else(|| RobotError::MissingJoint {
            by: place.clone(),
            kind: "one-axis",
            joint: mimic.joint.clone(),
        })?;
        let (ratio, offset) = (mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0));
        within(&place, &[ratio, offset], POSITION_MAX)?;
        Ok(Some(Following { leader, ratio, offset }))
    };
    robot.joints.iter().map(one).collect()
}

/// Joints in an order in which each leader stands before its followers.
fn leading_first(robot: &urdf_rs::Robot, leaders: &[Option<Following>]) -> Result<Vec<usize>, RobotError> {
    let mut order = Vec::with_capacity(leaders.len());
    let mut is_done = vec![false; leaders.len()];
    for start in 0..leaders.len() {
        let mut chain = Vec::new();
        let mut at = Some(start);
        while let Some(j) = at.filter(|&j| !is_done[j]) {
            if chain.contains(&j) {
                let problem = "it mimics itself through other joints";
                return Err(RobotError::Limit { joint: robot.joints[j].name.clone(), problem });
            }
            chain.push(j);
            at = leaders[j].map(|following| following.leader);
        }
        for j in chain.into_iter().rev() {
            is_done[j] = true;
            order.push(j);
        }
    }
    Ok(order)
}

/// True for links that have mass or collision shapes, or carry such links.
fn matters(robot: &urdf_rs::Robot, tree: &Tree) -> Vec<bool> {
    let has = |link: &urdf_rs::Link| link.inertial.mass.value > 0.0 || !link.collision.is_empty();
    let mut matters: Vec<bool> = robot.links.iter().map(has).collect();
    for &j in tree.order.iter().rev() {
        matters[tree.parent[j]] |= matters[tree.child[j]];
    }
    matters
}

//! Tree of the links of a description.

use crate::RobotError;
use std::collections::{BTreeMap, BTreeSet};

/// Links and joints by number, in the order of the file.
#[derive(Debug)]
pub(super) struct Tree {
    /// Joints by parent link, in file order.
    pub children: Vec<Vec<usize>>,
    /// Child link of each joint.
    pub child: Vec<usize>,
    /// Link that is nobody's child.
    pub root: usize,
    /// Joints from the root out, depth first and in file order.
    pub order: Vec<usize>,
    /// Parent link of each joint.
    pub parent: Vec<usize>,
}

impl Tree {
    pub fn new(robot: &urdf_rs::Robot) -> Result<Self, RobotError> {
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
        let (mut parents, mut child_of_joint) = (Vec::new(), Vec::with_capacity(robot.joints.len()));
        for (j, joint) in robot.joints.iter().enumerate() {
            let parent = find(joint, &joint.parent.link)?;
            let child = find(joint, &joint.child.link)?;
            if has_parent[child] {
                return Err(RobotError::TwoParents(link_names[child].to_owned()));
            }
            has_parent[child] = true;
            children[parent].push(j);
            parents.push(parent);
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
        let order = outward(&children, &child_of_joint, root);
        if order.len() + 1 < robot.links.len() {
            let placed: BTreeSet<usize> = order.iter().map(|&j| child_of_joint[j]).chain([root]).collect();
            let lost = (0..link_names.len()).find(|l| !placed.contains(l)).unwrap_or(root);
            return Err(RobotError::Cyclic(link_names[lost].to_owned()));
        }
        Ok(Self { children, child: child_of_joint, root, order, parent: parents })
    }
}

/// Joints depth first and in file order. It keeps its own stack: a file may hold chains longer than the call stack is deep.
fn outward(children: &[Vec<usize>], child: &[usize], root: usize) -> Vec<usize> {
    let mut order = Vec::with_capacity(child.len());
    let mut open: Vec<usize> = children[root].iter().rev().copied().collect();
    while let Some(j) = open.pop() {
        order.push(j);
        open.extend(children[child[j]].iter().rev());
    }
    order
}

fn refuse_duplicates(kind: &'static str, names: &[&str]) -> Result<(), RobotError> {
    let mut sorted = names.to_vec();
    sorted.sort_unstable();
    match sorted.windows(2).find(|w| w[0] == w[1]) {
        Some(w) => Err(RobotError::Duplicate { kind, name: w[0].to_owned() }),
        None => Ok(()),
    }
}

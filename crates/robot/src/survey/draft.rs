//! Guesses of the parts of a harvester in any robot: the first draft of a mapping.

use crate::articulation::{Articulation, Loaded};
use crate::finger;
use crate::roles::midway;
use orchard_multibody::JointKind;
use serde::Serialize;

/// A guess of a part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Guess {
    /// The part, by its key in the mapping.
    pub role: &'static str,
    /// Names of joints or links; empty if none could be the part.
    pub names: Vec<String>,
    /// Reason for the guess, or what was sought.
    pub why: &'static str,
}

/// Guesses of all parts, in the mapping's order.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Draft {
    /// The guesses.
    pub guesses: Vec<Guess>,
}

impl Draft {
    /// Guesses the parts of a robot.
    pub fn of(loaded: &Loaded) -> Self {
        let robot = &loaded.articulation;
        let arm = longest_row(robot);
        let wrist = arm.last().copied();
        let fingers = fingers(robot, wrist);
        let joints = |links: &[usize]| -> Vec<String> {
            links.iter().map(|&l| robot.links[l].joint_name.clone()).collect()
        };
        let before_arm = arm.first().map(|&first| chain_to(robot, first)).unwrap_or_default();
        let of_kind = |fits: &dyn Fn(&JointKind) -> bool| {
            let found = before_arm.iter().copied().find(|&l| fits(&robot.links[l].joint));
            joints(found.as_slice())
        };
        let hand = hand(robot, wrist);
        let tool = wrist.and_then(|wrist| frame_named(robot, Some(wrist), &["tcp", "tool", "grasp", "ee"]));
        let guess = |role, names, why| Guess { role, names, why };
        let base_joint = of_kind(&|k| *k == JointKind::Planar);
        // The lift of a robot that stands is locked at 0.
        let height = match base_joint.is_empty() {
            true => Vec::new(),
            false => of_kind(&|k| matches!(k, JointKind::Slide(_))),
        };
        let guesses = vec![
            guess(
                "base_link",
                massive(loaded, before_arm.last().copied()),
                "the first link with mass on the body that carries the arm, or else from the root out",
            ),
            guess("base_joint", base_joint, "a planar joint before the arm"),
            guess("height_joint", height, "the first prismatic joint before the arm, on a base that moves"),
            guess(
                "arm_joints",
                joints(&arm),
                "the longest row of hinges that mimic nothing and do not branch",
            ),
            guess(
                "finger_joints",
                joints(&fingers),
                "two prismatic joints beyond the arm, or else two hinges on its last link: those that mimic one another and carry most, or the only two",
            ),
            guess("hand_link", hand.clone(), "the link on the last hinge of the arm with the most shapes"),
            guess(
                "tcp_link",
                tool.map_or(hand, |name| vec![name]),
                "a frame on the last hinge that is named tool, tcp, grasp or ee; else the hand",
            ),
            guess(
                "bucket_link",
                frame_named(robot, None, &["bucket", "basket", "bin_"]).into_iter().collect(),
                "a link that is named bucket or basket",
            ),
        ];
        Self { guesses }
    }

    /// Reach of the arm from its second joint to the tool point \[m\]: the sum of its links' lengths.
    pub fn reach(&self, robot: &Articulation) -> f64 {
        let arm: Vec<usize> =
            self.names("arm_joints").iter().filter_map(|name| robot.link_of_joint(name)).collect();
        let lengths = arm.iter().skip(2).map(|&l| robot.links[l].x_parent_joint.translation.vector.norm());
        let tool = self.names("tcp_link").first().and_then(|name| robot.frame(name));
        lengths.sum::<f64>() + tool.map_or(0.0, |frame| frame.x_link_frame.translation.vector.norm())
    }

    /// Largest opening of each finger \[m\], as far as the guesses give one.
    pub fn opening(&self, robot: &Articulation) -> Option<f64> {
        let name = |role: &str| self.names(role).first().map_or("", String::as_str);
        let wrist = robot.link_of_joint(self.names("arm_joints").last()?)?;
        let mid = midway(robot, name("hand_link"), name("tcp_link"), wrist).ok()?;
        let fingers = finger::find(robot, self.names("finger_joints"), wrist, &mid).ok()?;
        fingers.first().map(|found| found.limit.upper)
    }

    /// Names that were guessed for a part.
    pub fn names(&self, role: &str) -> &[String] {
        self.guesses.iter().find(|guess| guess.role == role).map_or(&[], |guess| &guess.names)
    }
}

/// Links of the longest row of hinges, from the root out; of equal ones the first. A row ends where more than one moving link goes on, as
/// at a palm; hinges that follow or lead others are fingers.
pub(super) fn longest_row(robot: &Articulation) -> Vec<usize> {
    let is_coupled = coupled(robot);
    let mut carried = vec![0; robot.links.len()];
    for parent in robot.links.iter().filter_map(|link| link.parent) {
        carried[parent] += 1;
    }
    let mut lengths: Vec<usize> = Vec::with_capacity(robot.links.len());
    for (i, link) in robot.links.iter().enumerate() {
        let before = link.parent.filter(|p| carried[*p] == 1).map_or(0, |p| lengths[p]);
        let counts = matches!(link.joint, JointKind::Hinge(_)) && !is_coupled[i];
        lengths.push(if counts { before + 1 } else { 0 });
    }
    let longest = (0..lengths.len()).reduce(|a, b| if lengths[b] > lengths[a] { b } else { a });
    let mut row = Vec::new();
    let mut at = longest;
    while let Some(link) = at.filter(|&l| lengths[l] > 0) {
        row.push(link);
        at = robot.links[link].parent.filter(|_| lengths[link] > 1);
    }
    row.reverse();
    row
}

/// True for links whose joint mimics another or is mimicked.
pub(super) fn coupled(robot: &Articulation) -> Vec<bool> {
    let mut is_coupled = vec![false; robot.links.len()];
    for (i, link) in robot.links.iter().enumerate() {
        if let Some(mimic) = link.mimic {
            is_coupled[i] = true;
            is_coupled[mimic.leader] = true;
        }
    }
    is_coupled
}

/// Links from the root to one, without it.
fn chain_to(robot: &Articulation, link: usize) -> Vec<usize> {
    let parents = std::iter::successors(robot.links[link].parent, |&l| robot.links[l].parent);
    let mut chain: Vec<usize> = parents.collect();
    chain.reverse();
    chain
}

/// The first two links beyond the wrist that slide, or else two hinges on the wrist: of those that are coupled to one another the two that carry
/// most links, in the robot's order; if none is coupled, the only two. Empty if there are no such two.
fn fingers(robot: &Articulation, wrist: Option<usize>) -> Vec<usize> {
    let Some(wrist) = wrist else { return Vec::new() };
    let chains: Vec<Vec<usize>> = (0..robot.links.len()).map(|l| chain_to(robot, l)).collect();
    let beyond: Vec<usize> = (0..robot.links.len()).filter(|&l| chains[l].contains(&wrist)).collect();
    let slides = beyond.iter().copied().filter(|&l| matches!(robot.links[l].joint, JointKind::Slide(_)));
    let slides: Vec<usize> = slides.take(2).collect();
    if slides.len() == 2 {
        return slides;
    }
    let is_coupled = coupled(robot);
    let on_wrist = |l: &usize| {
        robot.links[*l].parent == Some(wrist) && matches!(robot.links[*l].joint, JointKind::Hinge(_))
    };
    let (mut hinges, others): (Vec<usize>, Vec<usize>) =
        beyond.iter().copied().filter(on_wrist).partition(|&l| is_coupled[l]);
    if hinges.len() < 2 {
        return if hinges.is_empty() && others.len() == 2 { others } else { Vec::new() };
    }
    let carried = |l: usize| beyond.iter().filter(|&&other| chains[other].contains(&l)).count();
    hinges.sort_by(|&a, &b| carried(b).cmp(&carried(a)).then(a.cmp(&b)));
    hinges.truncate(2);
    hinges.sort_unstable();
    hinges
}

/// The first link with mass on a moving link; if that has none, the first from the root out.
fn massive(loaded: &Loaded, on: Option<usize>) -> Vec<String> {
    let has_mass =
        |name: &str| loaded.urdf.links.iter().any(|l| l.name == name && l.inertial.mass.value > 0.0);
    let massive = || loaded.articulation.frames.iter().filter(|frame| has_mass(&frame.name));
    let first = massive().find(|frame| on.is_some() && frame.link == on).or_else(|| massive().next());
    first.map(|frame| frame.name.clone()).into_iter().collect()
}

/// The URDF link on the wrist with the most shapes; of equal ones the last.
fn hand(robot: &Articulation, wrist: Option<usize>) -> Vec<String> {
    let Some(wrist) = wrist else { return Vec::new() };
    let shapes = |name: &str| robot.links[wrist].shapes.iter().filter(|s| s.part == name).count();
    let on_wrist = robot.frames.iter().filter(|f| f.link == Some(wrist));
    on_wrist.max_by_key(|f| shapes(&f.name)).map(|f| f.name.clone()).into_iter().collect()
}

/// The last frame, on a link if one is given, whose name holds one of the words.
fn frame_named(robot: &Articulation, on: Option<usize>, words: &[&str]) -> Option<String> {
    let fits = |name: &str| words.iter().any(|word| name.to_ascii_lowercase().contains(word));
    let frames = robot.frames.iter().rev();
    let mut there = frames.filter(|frame| on.is_none() || frame.link == on);
    there.find(|frame| fits(&frame.name)).map(|frame| frame.name.clone())
}

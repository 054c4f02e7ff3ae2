//! Search for the fingers in a description, and measurement of their openings.

use super::{ChainJoint, Finger, FingerLink, FoundFinger, Opening, Turn, chain_pose, curve::Curve};
use crate::RobotError;
use crate::articulation::{Articulation, Limit};
use orchard_geometry::{Mat3, Pose, Vec3};
use orchard_multibody::JointKind;

/// Least slope of a measured opening as a share of the largest, our own choice: below it the finger is near a dead point.
const SLOPE_MIN: f64 = 0.02;

/// Step of the driving joint over which a slope is measured \[rad\].
const SLOPE_STEP: f64 = 1e-4;

/// Halvings of an interval in a search for a position: to a rounding error of doubles.
const HALVINGS: u32 = 60;

/// Finds the fingers that two joints drive; `wrist` is the last arm link. `x_wrist_mid` has its origin midway between the pads and its y along the
/// direction in which they open.
pub(crate) fn find(
    robot: &Articulation,
    drives: &[String],
    wrist: usize,
    x_wrist_mid: &Pose,
) -> Result<Vec<FoundFinger>, RobotError> {
    let drives: Vec<usize> =
        drives.iter().map(|name| driven(robot, name, wrist)).collect::<Result<_, _>>()?;
    let owners = owners(robot, &drives, wrist);
    let one = |(side, &drive): (usize, &usize)| {
        let followers = (0..robot.links.len()).filter(|&l| l != drive && owners[l] == Some(side));
        let links = std::iter::once(drive).chain(followers);
        let own = robot.lead(drive).1;
        let links: Vec<FingerLink<usize>> =
            links.map(|on| FingerLink { on, ratio: ratio(robot.lead(on).1, own) }).collect();
        finger(robot, drive, links, wrist, x_wrist_mid)
    };
    drives.iter().enumerate().map(one).collect()
}

/// Ratio of two joints that follow the same leader with these ratios; 1 for a joint and itself, exactly.
fn ratio(follower: f64, drive: f64) -> f64 {
    if follower == drive { 1.0 } else { follower / drive }
}

/// Link of a joint that can drive a finger: one axis, on the last arm link, with all limits.
fn driven(robot: &Articulation, name: &str, wrist: usize) -> Result<usize, RobotError> {
    let refused = || RobotError::MissingJoint {
        by: "finger_joints".to_owned(),
        kind: "revolute or prismatic (on the last arm link)",
        joint: name.to_owned(),
    };
    let limit = |problem| RobotError::Limit { joint: name.to_owned(), problem };
    let on_wrist = |l: &usize| robot.links[*l].parent == Some(wrist);
    let link = robot.link_of_joint(name).filter(on_wrist).ok_or_else(refused)?;
    let found = &robot.links[link];
    if !matches!(found.joint, JointKind::Hinge(_) | JointKind::Slide(_)) {
        return Err(refused());
    }
    if !found.limit.is_some_and(|limit| limit.is_complete()) {
        return Err(limit(
            "a joint that is driven needs limits of position, velocity and effort (--limits FILE)",
        ));
    }
    if robot.lead(link).1 == 0.0 {
        return Err(limit("a joint that drives a finger cannot follow another with ratio 0"));
    }
    Ok(link)
}

/// Finger of each link beyond the wrist that moves with a driving joint: the finger that carries it, else the one whose joint is nearest.
fn owners(robot: &Articulation, drives: &[usize], wrist: usize) -> Vec<Option<usize>> {
    let mut owners: Vec<Option<usize>> = vec![None; robot.links.len()];
    for (l, link) in robot.links.iter().enumerate() {
        if let Some(side) = drives.iter().position(|&drive| drive == l) {
            owners[l] = Some(side);
            continue;
        }
        let follows = |side: &usize| robot.lead(drives[*side]).0 == robot.lead(l).0;
        let carrier = link.parent.and_then(|p| owners[p]);
        owners[l] = match carrier {
            Some(side) => Some(side).filter(follows),
            None if link.parent == Some(wrist) => {
                let p = link.x_parent_joint.translation.vector;
                let away =
                    |side: &usize| (robot.links[drives[*side]].x_parent_joint.translation.vector - p).norm();
                (0..drives.len()).filter(follows).min_by(|a, b| away(a).total_cmp(&away(b)))
            }
            None => None,
        };
    }
    owners
}

/// Joints from the wrist to a link, outermost last.
fn chain(robot: &Articulation, links: &[FingerLink<usize>], to: usize, wrist: usize) -> Vec<ChainJoint> {
    let mut chain = Vec::new();
    let mut at = to;
    while at != wrist {
        let link = &robot.links[at];
        let ratio = links.iter().find(|own| own.on == at).map_or(0.0, |own| own.ratio);
        chain.push(ChainJoint {
            x_parent_joint: link.x_parent_joint,
            joint: link.joint,
            ratio,
            inertia: link.inertia,
        });
        let Some(parent) = link.parent else { break };
        at = parent;
    }
    chain.reverse();
    chain
}

fn finger(
    robot: &Articulation,
    drive: usize,
    links: Vec<FingerLink<usize>>,
    wrist: usize,
    x_wrist_mid: &Pose,
) -> Result<FoundFinger, RobotError> {
    let limit = robot.links[drive].limit.unwrap_or(Limit::NONE);
    let chains: Vec<Vec<ChainJoint>> =
        links.iter().map(|link| chain(robot, &links, link.on, wrist)).collect();
    let inertia = match (robot.links[drive].joint, chains.len()) {
        (JointKind::Slide(_), 1) => robot.links[drive].inertia.mass,
        _ => moved_inertia(&chains, 0.5 * (limit.lower + limit.upper)),
    };
    let (opening, limit, lever) = match robot.links[drive].joint {
        JointKind::Hinge(_) => {
            let pad = Pad::find(robot, &links, &chains, x_wrist_mid, &limit);
            let pad = pad.ok_or_else(|| no_opening(robot, drive, "its finger has no collision shapes"))?;
            pad.measure(&limit).map_err(|problem| no_opening(robot, drive, problem))?
        }
        _ => (Opening::Slide, limit, 1.0),
    };
    Ok(FoundFinger { finger: Finger { drive, links, opening }, limit, inertia, lever, chains })
}

fn no_opening(robot: &Articulation, drive: usize, problem: &'static str) -> RobotError {
    RobotError::Limit { joint: robot.links[drive].joint_name.clone(), problem }
}

/// Inertia that a driving joint moves at `q`: twice the kinetic energy of the finger at unit speed.
fn moved_inertia(chains: &[Vec<ChainJoint>], q: f64) -> f64 {
    chains.iter().map(|chain| moved_by_chain(chain, q)).sum()
}

fn moved_by_chain(chain: &[ChainJoint], q: f64) -> f64 {
    let Some(end) = chain.last() else { return 0.0 };
    let p_com = nalgebra::Point3::from(end.inertia.p_com);
    let com = (chain_pose(chain, q) * p_com).coords;
    let (mut turn, mut motion) = (Vec3::zeros(), Vec3::zeros());
    for (i, joint) in chain.iter().enumerate() {
        let x = chain_pose(&chain[..=i], q);
        match joint.joint {
            JointKind::Hinge(axis) => {
                let w = x.rotation * axis.into_inner() * joint.ratio;
                turn += w;
                motion += w.cross(&(com - x.translation.vector));
            }
            JointKind::Slide(axis) => motion += x.rotation * axis.into_inner() * joint.ratio,
            _ => {}
        }
    }
    let r: Mat3 = chain_pose(chain, q).rotation.to_rotation_matrix().into_inner();
    let spin = r.transpose() * turn;
    end.inertia.mass * motion.norm_squared() + spin.dot(&(end.inertia.i_com * spin))
}

/// The link of a finger that touches the fruit, with its shapes.
struct Pad<'a> {
    robot: &'a Articulation,
    link: usize,
    chain: &'a [ChainJoint],
    x_mid_wrist: Pose,
    /// 1 if the pad is on the positive side of the plane between the pads, else -1.
    side: f64,
}

impl<'a> Pad<'a> {
    /// Takes the link whose shapes are farthest from the driving joint, in the middle of the joint's range.
    fn find(
        robot: &'a Articulation,
        links: &[FingerLink<usize>],
        chains: &'a [Vec<ChainJoint>],
        x_wrist_mid: &Pose,
        limit: &Limit,
    ) -> Option<Self> {
        let x_mid_wrist = x_wrist_mid.inverse();
        let middle = 0.5 * (limit.lower + limit.upper);
        let root = chain_pose(&chains[0], middle).translation.vector;
        let away = |i: &usize| -> f64 {
            let x = chain_pose(&chains[*i], middle);
            let shapes = robot.links[links[*i].on].shapes.iter();
            let centres = shapes.map(|s| {
                let around = s.shape.aabb(&(x * s.x_link_shape));
                ((around.min + around.max) * 0.5 - root).norm()
            });
            centres.fold(f64::NEG_INFINITY, f64::max)
        };
        let has_shapes = |i: &usize| !robot.links[links[*i].on].shapes.is_empty();
        let i = (0..links.len()).filter(has_shapes).max_by(|a, b| away(a).total_cmp(&away(b)))?;
        let mut pad = Self { robot, link: links[i].on, chain: &chains[i], x_mid_wrist, side: 1.0 };
        let ends = [limit.lower, limit.upper].map(|q| pad.middle(q));
        let open = if ends[0].abs() > ends[1].abs() { ends[0] } else { ends[1] };
        pad.side = if open < 0.0 { -1.0 } else { 1.0 };
        Some(pad)
    }

    /// Lowest and highest y of the shapes with the driving joint at `q`, in the frame midway between the pads \[m\].
    fn extent(&self, q: f64) -> [f64; 2] {
        let x = self.x_mid_wrist * chain_pose(self.chain, q);
        let boxes = self.robot.links[self.link].shapes.iter().map(|s| s.shape.aabb(&(x * s.x_link_shape)));
        let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
        boxes.fold([low, high], |[low, high], b| [low.min(b.min.y), high.max(b.max.y)])
    }

    fn middle(&self, q: f64) -> f64 {
        let [low, high] = self.extent(q);
        0.5 * (low + high)
    }

    /// Distance of the pad from the plane midway between the pads \[m\]; negative beyond it.
    fn gap(&self, q: f64) -> f64 {
        let [low, high] = self.extent(q);
        if self.side > 0.0 { low } else { -high }
    }

    /// Slope of the gap, by kinematics also beyond the ends of the range.
    fn slope(&self, q: f64) -> f64 {
        (self.gap(q + SLOPE_STEP) - self.gap(q - SLOPE_STEP)) / (2.0 * SLOPE_STEP)
    }

    /// Opening, its limits and the mean lever.
    fn measure(&self, limit: &Limit) -> Result<(Opening, Limit, f64), &'static str> {
        let range = [limit.lower, limit.upper];
        if range[1] - range[0] <= 2.0 * SLOPE_STEP {
            return Err("a joint that drives a finger needs a range of positions");
        }
        let curve = Curve::through(range, Curve::INTERVALS, |q| [self.gap(q), self.slope(q)]);
        let at = |k: u32| range[0] + (range[1] - range[0]) * f64::from(k) / f64::from(Curve::INTERVALS);
        let slopes: Vec<f64> = (0..=Curve::INTERVALS).map(|k| curve.slope(at(k))).collect();
        let largest = slopes.iter().map(|slope| slope.abs()).fold(0.0, f64::max);
        let opens = curve.at(range[1]) > curve.at(range[0]);
        let is_even = |slope: &f64| (*slope > 0.0) == opens && slope.abs() >= SLOPE_MIN * largest;
        if largest <= 0.0 || !slopes.iter().all(is_even) {
            return Err("the pad must open evenly over the joint's range: limit the range (--limits FILE)");
        }
        let (closed, open) = if opens { (range[0], range[1]) } else { (range[1], range[0]) };
        if curve.at(open) <= 0.0 {
            return Err(
                "the pad lies beyond the plane between the pads at all positions: check tcp_link and hand_link",
            );
        }
        let span = [curve.at(closed).max(0.0), curve.at(open)];
        let position = |s: f64| {
            let (mut low, mut high) = (closed, open);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if curve.at(middle) < s { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        let joint = Curve::through(span, Curve::INTERVALS, |s| {
            let q = position(s);
            [q, 1.0 / curve.slope(q)]
        });
        let levers: Vec<f64> = slopes.iter().map(|slope| slope.abs()).collect();
        let least = levers.iter().copied().fold(f64::INFINITY, f64::min);
        let lever = levers.iter().sum::<f64>() / levers.len() as f64;
        let limit = Limit {
            lower: span[0],
            upper: span[1],
            velocity: limit.velocity * least,
            effort: limit.effort / largest,
        };
        Ok((Opening::Turn(Box::new(Turn { opening: curve, joint })), limit, lever))
    }
}

//! Distances between links of the robot, and between links and obstacles, with their gradients.
//!
//! Links are numbered by the arm joints before them: 0 is the base with the bucket, the last one the wrist with hand and fingers (wide open). A pair of
//! links is watched unless it shares a joint or [`watched_pairs`] leaves it out.

use crate::arm::{ArmKinematics, MountedShape, Pairs, RANKS};
use crate::joint_values::{JointVector, MAX_ARM_DOF};
use orchard_geometry::{Pose, Shape, Vec3, transform};
use orchard_multibody::{Gap, GapFinder};

/// Number of postures that [`watched_pairs`] samples.
const SAMPLES: u32 = 256;

/// The two links of the robot that are closest to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfDistance {
    /// Distance of their shapes \[m\]; negative while they overlap.
    pub distance: f64,
    /// The links, by the number of arm joints before them: 0 is the base, the last one the wrist.
    pub links: [usize; 2],
    /// Gradient of the distance by the joint positions [m/rad].
    pub gradient: JointVector,
}

/// A distance with its gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nearness {
    /// Distance \[m\].
    pub distance: f64,
    /// Gradient of the distance by the joint positions [m/rad].
    pub gradient: JointVector,
}

/// A shape in the base frame with its bounding ball.
struct Placed<'a> {
    rank: usize,
    shape: &'a Shape,
    x_base_shape: Pose,
    p_centre: Vec3,
    radius: f64,
}

impl Placed<'_> {
    fn of<'a>(rank: usize, shape: &'a Shape, x_base_shape: Pose) -> Placed<'a> {
        let (centre, radius) = ball_about(shape);
        Placed { rank, shape, x_base_shape, p_centre: transform(&x_base_shape, &centre), radius }
    }

    /// A lower bound on the distance.
    fn apart(&self, other: &Placed) -> f64 {
        (self.p_centre - other.p_centre).norm() - self.radius - other.radius
    }
}

/// Centre and radius of a bounding ball of a shape, in the shape's frame.
fn ball_about(shape: &Shape) -> (Vec3, f64) {
    match shape {
        Shape::Sphere { radius } => (Vec3::zeros(), *radius),
        Shape::Capsule { radius, length } => (Vec3::new(0.0, 0.0, 0.5 * length), radius + 0.5 * length),
        Shape::Box { half } => (Vec3::zeros(), half.norm()),
        other => {
            let around = other.aabb(&Pose::identity());
            (0.5 * (around.min + around.max), 0.5 * (around.max - around.min).norm())
        }
    }
}

/// The robot's shapes and joint axes in one posture.
pub(crate) struct Posture<'a> {
    placed: Vec<Placed<'a>>,
    axes: [Vec3; MAX_ARM_DOF],
    origins: [Vec3; MAX_ARM_DOF],
    finder: GapFinder,
}

impl<'a> Posture<'a> {
    /// Places the robot's shapes with the fingers wide open; `held` is the radius of a ball at the TCP that the hand carries \[m\].
    pub fn new(arm: &'a ArmKinematics, q: &JointVector, held: Option<&'a Shape>) -> Self {
        Self::with_fingers(arm, q, &[arm.finger_stroke(); 2], held)
    }

    fn with_fingers(
        arm: &'a ArmKinematics,
        q: &JointVector,
        finger_q: &[f64; 2],
        held: Option<&'a Shape>,
    ) -> Self {
        let links = arm.chain.link_poses(q);
        let drives = arm.finger_joints(finger_q);
        let place = |s: &'a MountedShape| Placed::of(s.rank, &s.shape, s.placed(&links, &drives));
        let mut placed: Vec<_> = arm.shapes.iter().map(place).collect();
        if let Some(ball) = held {
            let x = links[MAX_ARM_DOF - 1] * arm.mounts.x_wrist_tcp;
            placed.push(Placed::of(arm.dof(), ball, x));
        }
        Self {
            placed,
            axes: arm.chain.axes(&links),
            origins: std::array::from_fn(|i| links[i].translation.vector),
            finder: GapFinder::default(),
        }
    }

    /// Gradient of a distance by the joints between the two links; joints before both move the pair as one.
    fn gradient(&self, gap: &Gap, rank_a: usize, rank_b: usize) -> JointVector {
        let mut gradient = JointVector::zeros();
        let (low, high, sign) = if rank_a < rank_b { (rank_a, rank_b, -1.0) } else { (rank_b, rank_a, 1.0) };
        for joint in low..high {
            let v = self.axes[joint].cross(&(gap.p_world - self.origins[joint]));
            gradient[joint] = sign * gap.n_world.dot(&v);
        }
        gradient
    }

    /// All watched pairs of links nearer than `within` \[m\], with the nearest shapes of each.
    pub fn near_itself(&mut self, pairs: &Pairs, within: f64) -> Vec<SelfDistance> {
        let mut nearest: [[Option<Gap>; RANKS]; RANKS] = [[None; RANKS]; RANKS];
        for (i, a) in self.placed.iter().enumerate() {
            for b in &self.placed[i + 1..] {
                let (low, high) = (a.rank.min(b.rank), a.rank.max(b.rank));
                if !pairs[low][high] {
                    continue;
                }
                let best = &mut nearest[low][high];
                let within = best.map_or(within, |gap: Gap| gap.distance);
                if a.apart(b) >= within {
                    continue;
                }
                let (a, b) = if a.rank <= b.rank { (a, b) } else { (b, a) };
                let found = self.finder.find((a.shape, &a.x_base_shape), (b.shape, &b.x_base_shape), within);
                *best = found.or(*best);
            }
        }
        let mut found = Vec::new();
        for (low, row) in nearest.iter().enumerate() {
            for (high, gap) in row.iter().enumerate() {
                if let Some(gap) = gap {
                    let gradient = self.gradient(gap, low, high);
                    found.push(SelfDistance { distance: gap.distance, links: [low, high], gradient });
                }
            }
        }
        found
    }

    /// Distances below `within` \[m\] of the arm's links to a ball about a point of the base frame.
    pub fn near_ball(&mut self, p_base: &Vec3, radius: f64, within: f64, out: &mut Vec<Nearness>) {
        let ball = Shape::Sphere { radius };
        let ball = Placed::of(0, &ball, Pose::from_parts((*p_base).into(), Default::default()));
        for a in self.placed.iter().filter(|a| a.rank > 0) {
            if a.apart(&ball) >= within {
                continue;
            }
            let found =
                self.finder.find((a.shape, &a.x_base_shape), (ball.shape, &ball.x_base_shape), within);
            if let Some(gap) = found {
                let gradient = self.gradient(&gap, a.rank, 0);
                out.push(Nearness { distance: gap.distance, gradient });
            }
        }
    }
}

/// Share of the sampled postures in which two links with one link between them may overlap and still be watched.
const OFTEN: f64 = 0.1;

/// Finds the pairs of links that must not touch, from the geometry of the shapes.
///
/// Links that share a joint touch there by construction. Of the others a pair is left out
/// - if its shapes overlap in the home posture: a robot cannot start in collision with itself;
/// - if they overlap in all of 256 postures spread over the joint ranges;
/// - if one link lies between them and they overlap in more than a tenth of these postures: the joint limits keep such links apart, and the
///   shapes are larger than the links.
pub(crate) fn watched_pairs(arm: &ArmKinematics) -> Pairs {
    let mut pairs = [[false; RANKS]; RANKS];
    for (a, row) in pairs.iter_mut().enumerate() {
        for (b, watched) in row.iter_mut().enumerate() {
            *watched = a.abs_diff(b) > 1;
        }
    }
    let overlaps = |q: &JointVector| {
        let near = Posture::new(arm, q, None).near_itself(&pairs, 0.0);
        near.into_iter().map(|pair| pair.links).collect::<Vec<_>>()
    };
    let mut count = [[0_u32; RANKS]; RANKS];
    for n in 0..SAMPLES {
        for [a, b] in overlaps(&arm.spread_posture(n)) {
            count[a][b] += 1;
        }
    }
    let at_home = overlaps(&arm.home());
    for a in 0..RANKS {
        for b in a + 1..RANKS {
            let most = if b - a == 2 { OFTEN * f64::from(SAMPLES) } else { f64::from(SAMPLES - 1) };
            if f64::from(count[a][b]) > most || at_home.contains(&[a, b]) {
                (pairs[a][b], pairs[b][a]) = (false, false);
            }
        }
    }
    pairs
}

impl ArmKinematics {
    /// Returns the two watched links that are closest to each other, with the fingers wide open. The distance is infinite, and the links
    /// are 0 and 0, for a robot without watched shapes and for a posture that is not finite.
    pub fn self_distance(&self, q: &JointVector) -> SelfDistance {
        self.self_distance_with(q, &[self.finger_stroke(); 2])
    }

    /// Returns the same as [`ArmKinematics::self_distance`], with the fingers opened by `finger_q` \[m\].
    pub fn self_distance_with(&self, q: &JointVector, finger_q: &[f64; 2]) -> SelfDistance {
        let none = SelfDistance { distance: f64::INFINITY, links: [0, 0], gradient: JointVector::zeros() };
        if q.iter().chain(finger_q).any(|x| !x.is_finite()) {
            return none;
        }
        let mut posture = Posture::with_fingers(self, q, finger_q, None);
        // Most postures have a near pair, and distances of far pairs cost most.
        for within in [self.qp.influence, f64::INFINITY] {
            let near = posture.near_itself(&self.pairs, within);
            let closer =
                |best: SelfDistance, one: SelfDistance| if one.distance < best.distance { one } else { best };
            if let Some(closest) = near.into_iter().reduce(closer) {
                return closest;
            }
        }
        none
    }

    /// True if two links, numbered by the arm joints before them, are kept from touching each other.
    pub fn watches(&self, a: usize, b: usize) -> bool {
        a < RANKS && b < RANKS && self.pairs[a][b]
    }
}

//! OrchardBench's side of the comparison: rest, pull and release of a tree.

use anyhow::Context;
use orchard_geometry::Vec3;
use orchard_multibody::{BodyId, Data, StepReport, StepSettings, equilibrium, step};
use orchard_treegen::Skeleton;
use serde::Serialize;

use orchard_program::bare_tree::BareTree;

/// The pull \[N\]: 30 N; its direction (6, 0, -8) / 10 bends about both axes of a joint.
const PULL_WORLD: [f64; 3] = [18.0, 0.0, -24.0];
/// Duration of the pull, and of the observation after the release \[s\].
const PHASE: f64 = 2.0;
/// Largest joint move of the last iteration of the statics \[rad\].
const STATICS_TOLERANCE: f64 = 1e-12;

/// A point \[m\], world.
type Point = [f64; 3];

/// OrchardBench's results for one tree. Everything is in the world frame.
#[derive(Serialize)]
pub struct TreePaths {
    /// Name of the tree.
    name: String,
    /// Time step \[s\].
    h: f64,
    /// Duration of the pull, and of the release \[s\].
    phase: f64,
    /// Lengths of the segments \[m\]: a tip lies there on z of its link.
    lengths: Vec<f64>,
    /// Rest under gravity.
    rest: Pose,
    /// The pulls.
    pulls: Vec<Pull>,
}

/// Positions of all parts in equilibrium.
#[derive(Serialize)]
struct Pose {
    /// Tip of every segment.
    tips: Vec<Point>,
    /// Centre of every fruit.
    fruit: Vec<Point>,
}

/// One pull, from rest: the force acts for one phase, then to equilibrium, then is gone for one phase.
#[derive(Serialize)]
struct Pull {
    /// Name of the pulled part.
    name: &'static str,
    /// The segment, pulled at its centre of mass.
    segment: usize,
    /// The force \[N\].
    force: Point,
    /// Tip of the pulled segment after every step of the pull.
    pull_path: Vec<Point>,
    /// Equilibrium under the pull.
    pulled: Pose,
    /// Tip of the pulled segment after every step of the release.
    release_path: Vec<Point>,
}

/// Steps a tree through all pulls.
pub fn simulate(tree: &mut BareTree, h: f64) -> anyhow::Result<TreePaths> {
    equilibrium(&tree.model, &mut tree.data, &tree.gravity, STATICS_TOLERANCE)?;
    let rest = pose(tree, &tree.data);
    let picks = [("scaffold", scaffold(&tree.skeleton)), ("twig", twig(&tree.skeleton))];
    let mut pulls = Vec::new();
    for (name, segment) in picks {
        let segment = segment.with_context(|| format!("the tree has no {name}"))?;
        pulls.push(pull(tree, name, segment, h)?);
    }
    let lengths = tree.skeleton.segments.iter().map(|s| s.length).collect();
    Ok(TreePaths { name: tree.name.clone(), h, phase: PHASE, lengths, rest, pulls })
}

/// The outermost segment of a scaffold (order 1) that is at least half as thick as the thickest.
fn scaffold(skeleton: &Skeleton) -> Option<usize> {
    let segments = || skeleton.segments.iter().enumerate().filter(|(_, s)| s.order == 1);
    let thickest = segments().map(|(_, s)| s.radius).fold(0.0, f64::max);
    let reach = |i: usize| skeleton.segments[i].p_tip_world().xy().norm();
    segments()
        .filter(|(_, s)| s.radius >= 0.5 * thickest)
        .map(|(i, _)| i)
        .max_by(|&a, &b| reach(a).total_cmp(&reach(b)))
}

/// The thinnest segment that bears no other.
fn twig(skeleton: &Skeleton) -> Option<usize> {
    let radius = |i: usize| skeleton.segments[i].radius;
    let children = skeleton.children();
    (0..skeleton.segments.len())
        .filter(|&i| children[i].is_empty())
        .min_by(|&a, &b| radius(a).total_cmp(&radius(b)))
}

fn pull(tree: &BareTree, name: &'static str, segment: usize, h: f64) -> anyhow::Result<Pull> {
    let mut data = tree.data.clone();
    data.body_force_world[segment] = Vec3::from(PULL_WORLD);
    let pull_path = watch(tree, &mut data, segment, h);
    equilibrium(&tree.model, &mut data, &tree.gravity, STATICS_TOLERANCE)?;
    let pulled = pose(tree, &data);
    data.body_force_world[segment] = Vec3::zeros();
    let release_path = watch(tree, &mut data, segment, h);
    Ok(Pull { name, segment, force: PULL_WORLD, pull_path, pulled, release_path })
}

/// Steps for one phase.
fn watch(tree: &BareTree, data: &mut Data, segment: usize, h: f64) -> Vec<Point> {
    // Nothing touches: the contact figures are never used.
    let settings = StepSettings {
        h,
        gravity: tree.gravity,
        contact_dissipation_time: 0.0,
        contact_margin: 0.0,
        integrator: orchard_multibody::Integrator::default(),
        solver: orchard_multibody::Solver::default(),
        contact_path: orchard_multibody::ContactPath::default(),
    };
    let mut report = StepReport::default();
    let steps = (PHASE / h).round() as usize;
    let after_step = |_| {
        step(&tree.model, data, &settings, &mut report);
        tip(tree, data, segment)
    };
    (0..steps).map(after_step).collect()
}

fn pose(tree: &BareTree, data: &Data) -> Pose {
    Pose {
        tips: (0..tree.skeleton.segments.len()).map(|i| tip(tree, data, i)).collect(),
        fruit: data.point_p_world.iter().map(|&p| p.into()).collect(),
    }
}

fn tip(tree: &BareTree, data: &Data, segment: usize) -> Point {
    let along = Vec3::new(0.0, 0.0, tree.skeleton.segments[segment].length);
    orchard_geometry::transform(data.x_world_body(BodyId(segment as u32)), &along).into()
}

//! Suite `stem`: pulls, bends and twists at the fruit of `calibrated` trees against measured picks.

pub mod picks;
mod proxy;
mod pulls;

use std::sync::Arc;

use indicatif::{ProgressBar, ProgressStyle};
use orchard_batch::TreeWorld;
use orchard_fruit::{Fruit, Release, place};
use orchard_geometry::{Vec3, math, rotation_from_z};
use orchard_quantity::{Quantity, from_toml};
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_treegen::{Segment, Skeleton, grow, morphometry::distribution::quantile};
use proxy::Level;
use pulls::{End, Grasp, Hanging, Outcome};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::target::Target;
use crate::rows::{Effort, Measured, Row};

/// Trees whose fruit are pulled, in full and quick; seed and most fruit of a tree.
const TREES: [u32; 2] = [24, 1];
const SEED: u64 = 1;
const FRUIT: [usize; 2] = [40, 6];

/// Picks of the proxy at each level, in full and quick.
const PROXY_PICKS: [u32; 2] = [10, 2];

/// Longest pull \[s\].
const LONGEST: f64 = 20.0;
/// Size of the samples whose least and largest pulls were published.
const BATCH: usize = 25;

/// Measured picks: `configs/measured/stems.toml`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Picks {
    targets: Targets,
    picks: picks::Sample,
    grip: Grip,
    hand: Hand,
    rates: Rates,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Targets {
    pendulum: Target,
    pull_median: Target,
    wood_broke: Target,
    naive_success: Target,
    naive_peak: Target,
    hand_pull_95: Target,
    hand_twist_95: Target,
    horizontal_least: Target,
    horizontal_most: Target,
    spur_share: Target,
    stiffness_soft: Target,
    stiffness_hard: Target,
    slow_pull: Target,
    proxy_low: Target,
    proxy_medium: Target,
    proxy_high: Target,
    proxy_spring_low: Target,
    proxy_spring_medium: Target,
    proxy_spring_high: Target,
    pull_spread: Target,
    picks_brier: Target,
    picks_brier_paper: Target,
}

/// Distribution of the pull at which an apple slips out of the hand.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Grip {
    median: Quantity,
    spread: Quantity,
}

/// Motion of a picking hand.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Hand {
    bend: Quantity,
    torque: Quantity,
    hold: Quantity,
}

/// Rates of the pulls.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rates {
    pull: Quantity,
    slow: Quantity,
    twist: Quantity,
    probe: Quantity,
}

/// Picks of one fruit, each from the same rest.
struct Tried {
    /// As drawn \[N\].
    strength: f64,
    /// Pull along the stem, by a hand that an apple slips out of and by one that holds it.
    naive: Outcome,
    held: Outcome,
    slow: Outcome,
    hand: Outcome,
    twist: Outcome,
    horizontal: Outcome,
    stiffness: f64,
}

fn read() -> anyhow::Result<Picks> {
    Ok(from_toml("measured/stems.toml", include_str!("../../../configs/measured/stems.toml"))?)
}

/// Rows of picks that the user gives.
pub fn given_picks(picks: &[picks::Pick]) -> anyhow::Result<Vec<Row>> {
    let config = read()?;
    config.picks.rows(
        "stem.given_picks",
        picks,
        [&config.targets.picks_brier, &config.targets.picks_brier_paper],
        true,
    )
}

/// Pulls at the fruit and compares.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let picks = read()?;
    let which = usize::from(effort == Effort::Quick);
    let spec = Arc::new(Spec::preset(Preset::Calibrated));
    let style = ProgressStyle::with_template("{msg:20} [{bar:30}] {pos}/{len} trees")?;
    let bar = ProgressBar::new(u64::from(TREES[which])).with_style(style).with_message("pulling at fruit");
    let mut tried = Vec::new();
    for number in 0..TREES[which] {
        let skeleton = grow(&spec, SEED, number)?;
        let mut fruit = place(&spec.fruit, &skeleton, SEED, number);
        Stream::new(SEED, number, Purpose::Test).shuffle(&mut fruit);
        fruit.truncate(FRUIT[which]);
        let tree = TreeWorld::new(spec.clone(), &skeleton, fruit)?;
        let count = tree.plant().fruit.len();
        tried.par_extend((0..count).into_par_iter().map(|i| try_fruit(&picks, &tree, number, i)));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut rows = rows(&picks.targets, pendulum(&spec)?, &tried);
    let [brier, paper] = [&picks.targets.picks_brier, &picks.targets.picks_brier_paper];
    rows.extend(picks.picks.rows("stem.picks", &picks.picks.list(), [brier, paper], false)?);
    rows.extend(proxy_rows(&picks.targets, &proxy::levels(PROXY_PICKS[which])?));
    Ok(rows.into())
}

/// Rows of the laboratory's proxy.
fn proxy_rows(t: &Targets, levels: &[proxy::Level]) -> Vec<Row> {
    let targets = [
        (&t.proxy_low, &t.proxy_spring_low),
        (&t.proxy_medium, &t.proxy_spring_medium),
        (&t.proxy_high, &t.proxy_spring_high),
    ];
    let rows = levels.iter().zip(targets).flat_map(|(level, (force, spring))| {
        let Level { name, released_at, picks, stiffness } = level;
        let note =
            format!("median of {} releases in {picks} picks by the expert with an FR3", released_at.len());
        [
            force.row(&format!("stem.proxy_{name}"), quantile(released_at, 0.5), &note),
            spring.row(&format!("stem.proxy_spring_{name}"), *stiffness, "pulled sideways at the apple"),
        ]
    });
    rows.collect()
}

/// Everything that is done to one fruit.
fn try_fruit(picks: &Picks, tree: &TreeWorld, number: u32, fruit: usize) -> Tried {
    let (hanging, grown) = (Hanging::new(tree, fruit), &tree.plant().fruit.fruit[fruit]);
    let [axis, across] = hanging.axes_world();
    let weight = grown.mass * tree.plant().spec.sim.gravity.si();
    let lift = Vec3::new(0.0, 0.0, weight);
    let Rates { pull, slow, twist, probe } = &picks.rates;
    let ramp = |direction: Vec3, rate: f64| {
        hanging.load(LONGEST * pull.si() / rate.min(pull.si()), |time| Grasp {
            force_world: direction * (rate * time),
            torque: 0.0,
        })
    };
    let held = ramp(axis, pull.si());
    let mut stream = Stream::of_frame(SEED, number, fruit as u32, Purpose::Test);
    let grip = picks.grip.median.si() * math::exp(stream.normal(0.0, picks.grip.spread.si()));
    let naive = if held.force < grip { held } else { Outcome { end: End::Held, force: grip, torque: 0.0 } };
    let (sine, cosine) = math::sin_cos(picks.hand.bend.si());
    let turned = axis * cosine + across * sine;
    let hand = hanging.load(LONGEST, |time| {
        let hold = picks.hand.hold.si();
        // A second to turn the fruit, then the pull.
        let force = hold + pull.si() * (time - 1.0).max(0.0);
        Grasp { force_world: lift + turned * force, torque: picks.hand.torque.si() * time.min(1.0) }
    });
    // A light pull keeps the stem straight.
    let straight = axis * picks.hand.hold.si();
    let twist = hanging.load(LONGEST, |time| Grasp { force_world: straight, torque: twist.si() * time });
    let outward = Vec3::new(across.x, across.y, 0.0).try_normalize(f64::EPSILON).unwrap_or(across);
    Tried {
        strength: grown.detach_force,
        naive,
        held,
        slow: ramp(axis, slow.si()),
        hand,
        twist,
        horizontal: ramp(outward, pull.si()),
        stiffness: hanging.stiffness(outward * probe.si()),
    }
}

fn rows(t: &Targets, swing: f64, tried: &[Tried]) -> Vec<Row> {
    let is_off = |outcome: &Outcome| matches!(outcome.end, End::Off(_));
    let picked = |outcome: fn(&Tried) -> &Outcome| {
        let off = tried.iter().map(outcome).filter(|outcome| is_off(outcome));
        off.copied().collect::<Vec<Outcome>>()
    };
    let share = |outcomes: usize| outcomes as f64 / tried.len() as f64;
    let forces = |outcomes: &[Outcome]| outcomes.iter().map(|o| o.force).collect::<Vec<f64>>();
    // Of the fruit that came off: where the wood or the hand gave way first, the stem's force is not known.
    let quantile_of = |outcome: fn(&Tried) -> &Outcome, p: f64| quantile(&forces(&picked(outcome)), p);
    let strengths: Vec<f64> = tried.iter().map(|t| t.strength).collect();
    let broken = tried.iter().filter(|t| t.naive.end == End::Snapped).count();
    let naive = picked(|t| &t.naive);
    let twist = picked(|t| &t.twist);
    let horizontal = forces(&picked(|t| &t.horizontal));
    let held = picked(|t| &t.held);
    let spurs = held.iter().filter(|o| o.end == End::Off(Release::Spur)).count();
    let extremes = |choose: fn(f64, f64) -> f64| {
        let batches = horizontal.chunks_exact(BATCH.min(horizontal.len().max(1)));
        let found: Vec<f64> = batches.map(|b| b.iter().copied().fold(b[0], choose)).collect();
        if found.is_empty() { f64::NAN } else { quantile(&found, 0.5) }
    };
    let both_off = tried.iter().filter(|t| is_off(&t.slow) && is_off(&t.held));
    let slow: Vec<f64> = both_off.map(|t| t.slow.force / t.held.force).collect();
    let stiffness: Vec<f64> = tried.iter().map(|t| t.stiffness).filter(|k| k.is_finite()).collect();
    let torques: Vec<f64> = twist.iter().map(|o| o.torque).collect();
    let n = tried.len();
    let snapped = |outcome: fn(&Tried) -> &Outcome| {
        let count = tried.iter().filter(|t| outcome(t).end == End::Snapped).count();
        format!("{n} fruit; the wood broke first at {count}")
    };
    vec![
        t.pendulum.row("stem.pendulum", swing, "a fruit of 75 mm on a stem of 25 mm, first swing's period"),
        t.pull_median.row("stem.pull_median", quantile(&strengths, 0.5), "strengths as drawn"),
        t.pull_spread.row("stem.pull_spread", spread(&strengths), "standard deviation of their logarithm"),
        t.wood_broke.row("stem.wood_broke", share(broken), "straight pulls up to the limit of the grip"),
        t.naive_success.row("stem.naive_success", share(naive.len()), &snapped(|t| &t.naive)),
        t.naive_peak.row(
            "stem.naive_peak",
            quantile(&forces(&naive), 0.5),
            "median of the successful straight pulls",
        ),
        t.hand_pull_95.row("stem.hand_pull_95", quantile_of(|t| &t.hand, 0.95), &snapped(|t| &t.hand)),
        t.hand_twist_95.row("stem.hand_twist_95", quantile(&torques, 0.95), &snapped(|t| &t.twist)),
        t.horizontal_least.row("stem.horizontal_least", extremes(f64::min), &snapped(|t| &t.horizontal)),
        t.horizontal_most.row("stem.horizontal_most", extremes(f64::max), "median over samples of 25"),
        t.spur_share.row("stem.spur_share", spurs as f64 / held.len().max(1) as f64, &snapped(|t| &t.held)),
        t.stiffness_soft.row(
            "stem.stiffness_soft",
            quantile(&stiffness, 0.05),
            "5th percentile, pulled outward",
        ),
        t.stiffness_hard.row(
            "stem.stiffness_hard",
            quantile(&stiffness, 0.95),
            "95th percentile, pulled outward",
        ),
        t.slow_pull.row("stem.slow_pull", quantile(&slow, 0.5), &snapped(|t| &t.slow)),
    ]
}

/// Standard deviation of the logarithm.
fn spread(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().map(|x| math::ln(*x)).sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (math::ln(*x) - mean) * (math::ln(*x) - mean)).sum();
    (squares / (n - 1.0)).sqrt()
}

/// Frequency of a small swing of an apple of 75 mm on a twig that nothing bends \[Hz\].
fn pendulum(spec: &Spec) -> anyhow::Result<f64> {
    const RADIUS: f64 = 0.0375;
    const MASS: f64 = 0.2;
    /// Velocity of the push \[m/s\]: a swing of three degrees.
    const PUSH: f64 = 0.04;
    const FRAMES: u32 = 600;
    let mut spec = spec.clone();
    spec.wood.rigid = true;
    let p_base_world = Vec3::new(0.0, 0.0, 2.0);
    let twig = Segment {
        parent: None,
        p_base_world,
        r_world_segment: rotation_from_z(&Vec3::x()),
        length: 0.2,
        radius: 0.006,
        order: 2,
    };
    let arm = spec.fruit.stem_length.si() + RADIUS;
    let apple = Fruit {
        segment: 0,
        site: 0,
        p_segment: Vec3::zeros(),
        p_hang_world: p_base_world - Vec3::z() * arm,
        radius: RADIUS,
        mass: MASS,
        detach_force: f64::INFINITY,
        twist_strength: f64::INFINITY,
        spur_strength: f64::INFINITY,
    };
    let skeleton =
        Skeleton { segments: vec![twig], fruit_sites: Vec::new(), leaves: Vec::new(), spurs: Vec::new() };
    let mut world = TreeWorld::new(Arc::new(spec), &skeleton, vec![apple])?;
    let plant = world.plant().clone();
    let point = plant.fruit.points[0].index();
    world.data_mut().point_v_world[point] = Vec3::y() * PUSH;
    let mut crossings = Vec::new();
    let mut before = 0.0;
    for frame in 1..=FRAMES {
        world.step();
        let now = world.data().point_p_world[point].y;
        if before < 0.0 && now >= 0.0 {
            crossings.push((f64::from(frame) - now / (now - before)) * plant.spec.sim.frame());
        }
        before = now;
    }
    let (first, last) = (crossings.first().copied(), crossings.last().copied());
    let swings = crossings.len().saturating_sub(1) as f64;
    Ok(first.zip(last).map_or(f64::NAN, |(first, last)| swings / (last - first)))
}

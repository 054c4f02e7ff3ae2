//! Suite `physics`: substeps of tree worlds per second, ours and MuJoCo's measured alternately. Every timed world is kicked, and
//! may break and drop fruit. `docs/performance.md` explains each row.

mod contact;
pub(super) mod forest;
mod limit;
mod peer;
mod pushed;
mod scaling;
mod stems;
mod trees;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::process::Command;

use anyhow::Context;
use indicatif::ProgressBar;
use orchard_batch::Isa;

use super::timing::{Rounds, Side, alternate};
use super::{say, spinner};
use forest::Planting;
use limit::Peaks;
use orchard_program::rows::{Effort, Measured, Row};
use peer::{Course, Peer};

/// The tree that the figures refer to.
pub(super) const LINKS: usize = 151;
pub(super) const FRUIT: u32 = 30;
/// Worlds of a batch.
pub(super) const WORLDS: usize = 512;
/// Threads that share a batch.
const THREADS: usize = 2;
/// Worlds of the seed among which the trees are looked for.
pub(super) const SEARCHED: u32 = 8192;
/// Frames of a course: short enough that all bodies still move at its end.
const FRAMES: u32 = 15;

/// Amount of measurement.
#[derive(Debug, Clone, Copy)]
struct Plan {
    rounds: usize,
    /// Courses per round of one tree, and of MuJoCo's slower one.
    repeats: u32,
    peer_repeats: u32,
    /// Courses per round of the batches.
    batch_repeats: u32,
    /// Worlds of MuJoCo's batch; its models take long to load.
    peer_worlds: usize,
    /// Approximate product of substeps and links in a round of one tree size.
    work: f64,
}

impl Plan {
    fn new(effort: Effort) -> Self {
        match effort {
            Effort::Full => Self {
                rounds: 9,
                repeats: 300,
                peer_repeats: 60,
                batch_repeats: 4,
                peer_worlds: WORLDS,
                work: 1e6,
            },
            Effort::Quick => {
                Self { rounds: 3, repeats: 30, peer_repeats: 6, batch_repeats: 1, peer_worlds: 64, work: 2e5 }
            }
        }
    }
}

/// Settings and processes shared by all rows.
struct Bench {
    plan: Plan,
    peer: RefCell<Option<Peer>>,
    peaks: Peaks,
    bar: ProgressBar,
    /// Substeps per frame.
    substeps: u32,
}

pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let peer = match Peer::start() {
        Ok(peer) => Some(peer),
        Err(reason) => {
            eprintln!("NO COMPARISON with MuJoCo: {reason}");
            None
        }
    };
    let bar = spinner();
    let mut context = BTreeMap::new();
    context.insert("mujoco", peer.as_ref().map(|peer| peer.version.clone()));
    context.insert("rustc", rustc_version());
    context.insert("instructions_f32", Some(format!("{:?}", Isa::best())));
    context.insert("instructions_f64", Some(format!("baseline of {}", std::env::consts::ARCH)));

    say(&bar, "growing trees");
    let spec = forest::spec_with_fruit(FRUIT)?;
    let substeps = spec.sim.substeps.get();
    let mut forest = forest::nearest(spec, LINKS, WORLDS, SEARCHED)?;
    forest.sort_by_key(Planting::depth_squares);
    say(&bar, "peak rates of the processor");
    let peaks = Peaks::measure();
    let bench = Bench { plan: Plan::new(effort), peer: RefCell::new(peer), peaks, bar, substeps };

    let mut rows = trees::rows(&bench, &forest)?;
    let untouched = rows[0].value;
    rows.push(contact::row(&bench, &forest, untouched)?);
    rows.extend(stems::rows(&bench, &forest[forest.len() / 2])?);
    rows.extend(scaling::rows(&bench)?);
    bench.bar.finish_and_clear();
    Ok(Measured { rows, context, ..Measured::default() })
}

/// Version of the compiler on the search path, which is the one that `cargo xtask` uses.
fn rustc_version() -> Option<String> {
    let output = Command::new("rustc").arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    Some(text.trim().to_owned())
}

impl Bench {
    fn say(&self, what: &str) {
        say(&self.bar, what);
    }

    /// Measures ours and MuJoCo's subject `name` alternately. Ours returns substeps/s; MuJoCo's runs a course of some worlds on some
    /// threads.
    fn beside_peer<'a>(
        &'a self,
        name: &'a str,
        mut sides: Vec<Side<'a>>,
        course: Course,
        worlds: usize,
        threads: usize,
    ) -> anyhow::Result<(Vec<Rounds>, Option<Rounds>)> {
        let is_compared = self.peer.borrow().is_some();
        if is_compared {
            sides.push(Box::new(move || {
                let mut peer = self.peer.borrow_mut();
                let timed = peer.as_mut().context("no MuJoCo")?.time(name, course)?;
                anyhow::ensure!(timed.fastest > 0.0, "MuJoCo's {name} is at rest");
                let substeps = f64::from(course.steps * course.repeats) * worlds as f64;
                Ok(substeps * threads as f64 / timed.seconds)
            }));
        }
        self.say(name);
        let mut figures = alternate(self.plan.rounds, &mut sides)?;
        let theirs = if is_compared { figures.pop() } else { None };
        Ok((figures, theirs))
    }

    /// Loads models into MuJoCo, if it is there.
    fn load(&self, name: &str, models: impl FnOnce() -> anyhow::Result<Vec<String>>) -> anyhow::Result<()> {
        if let Some(peer) = self.peer.borrow_mut().as_mut() {
            self.say(&format!("{name}: models for MuJoCo"));
            let models = models()?;
            let threads = if models.len() > 1 { THREADS } else { 1 };
            peer.load(name, &models, threads)?;
        }
        Ok(())
    }

    /// A row of substeps per second.
    fn row(&self, name: &str, ours: &Rounds, theirs: Option<&Rounds>) -> Row {
        let mut row = Row::measured(name, ours.median(), "substeps/s");
        row.spread = Some(ours.spread());
        if let Some((theirs, peer)) = theirs.zip(self.peer.borrow().as_ref()) {
            row = row.beside(&format!("MuJoCo {}", peer.version), theirs.median());
            row.peer_spread = Some(theirs.spread());
        }
        row
    }
}

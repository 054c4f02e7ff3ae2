//! The row with contacts.

use super::Bench;
use super::forest::Planting;
use super::peer::{ContactCounts, Course};
use super::pushed::{CONTACTS, Push, PushedTree};
use crate::perf::timing::{Side, cpu_time};
use orchard_program::rows::Row;

const NAME: &str = "physics.contact_8";
/// Frames of a course: the capsule moves 0.15 m.
const FRAMES: u32 = 30;
/// Target: multiple of MuJoCo's rate.
const RATIO: f64 = 5.0;
const LIMIT: &str = "Only the operations without contacts are counted, since those of contacts depend on the number of iterations. The \
                     limit is small dense algebra in data-dependent order: contact pairs, their coupling through the wood, iterations";

/// Row of a capsule inside a canopy, with enough contacts in every substep. `untouched` is the rate of a tree alone.
pub fn row(bench: &Bench, forest: &[Planting], untouched: Option<f64>) -> anyhow::Result<Row> {
    bench.say(&format!("{NAME}: searching paths through the canopy"));
    let (push, theirs_watched) = choose(bench, PushedTree::busiest(forest, FRAMES)?)?;
    let course = course(bench, &push);
    let mut reached = push.start;
    for _ in 0..push.lead {
        reached.step();
    }
    let repeats = bench.plan.repeats.div_ceil(8);
    let ours: Side<'_> = Box::new(|| {
        let mut spent = 0.0;
        for _ in 0..repeats {
            let mut world = reached.clone();
            let start = cpu_time();
            for _ in 0..FRAMES {
                std::hint::black_box(world.step());
            }
            spent += (cpu_time() - start).as_secs_f64();
        }
        Ok(f64::from(FRAMES * bench.substeps * repeats) / spent)
    });
    let (ours, theirs) = bench.beside_peer(NAME, vec![ours], course, 1, 1)?;

    let mut end = reached.clone();
    for _ in 0..FRAMES {
        end.step();
    }
    let (breaks, loose) = end.losses();
    let mut note = format!(
        "{:.1} contacts on average, never fewer than {}; {breaks} breaks and {loose} detachments by the end",
        push.contacts.contacts, push.contacts.fewest
    );
    if let Some(untouched) = untouched {
        let (all, alone) = (1e6 / ours[0].median(), 1e6 / untouched);
        note += &format!("; a substep takes {all:.0} us, a tree of this size without contacts {alone:.0}");
    }
    if let Some(theirs) = theirs_watched {
        note +=
            &format!("; MuJoCo has {:.1} on average, never fewer than {}", theirs.contacts, theirs.fewest);
    }
    let mut row = bench.row(NAME, &ours[0], theirs.as_ref()).at_least_times(RATIO);
    row.note = Some(note);
    row.limit = Some(bench.peaks.of_f64(ours[0].median(), reached.operations(), LIMIT));
    Ok(row)
}

/// Of the pushes with enough contacts in OrchardBench, chooses and loads the one that has enough contacts in MuJoCo too and the most
/// similar mean number (MuJoCo computes its own motion). Without MuJoCo it takes the first.
fn choose(bench: &Bench, mut pushes: Vec<Push>) -> anyhow::Result<(Push, Option<ContactCounts>)> {
    let mut best: Option<(usize, ContactCounts)> = None;
    for (index, push) in pushes.iter().enumerate() {
        bench.load(NAME, || Ok(vec![push.start.mjcf()?]))?;
        if let Some(peer) = bench.peer.borrow_mut().as_mut() {
            let theirs = peer.watch(NAME, course(bench, push))?;
            let apart = |index: usize, theirs: &ContactCounts| {
                let lacking = CONTACTS.saturating_sub(theirs.fewest);
                (lacking, (theirs.contacts - pushes[index].contacts.contacts).abs())
            };
            let is_better =
                best.as_ref().is_none_or(|(i, watched)| apart(index, &theirs) < apart(*i, watched));
            if theirs.finite && is_better {
                best = Some((index, theirs));
            }
        }
    }
    let (index, watched) = best.map_or((0, None), |(index, watched)| (index, Some(watched)));
    let push = pushes.swap_remove(index);
    bench.load(NAME, || Ok(vec![push.start.mjcf()?]))?;
    Ok((push, watched))
}

fn course(bench: &Bench, push: &Push) -> Course {
    Course {
        lead: push.lead * bench.substeps,
        steps: FRAMES * bench.substeps,
        repeats: bench.plan.peer_repeats.div_ceil(4),
    }
}

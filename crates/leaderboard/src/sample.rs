//! Sample of the episodes of a submission that are run again.

use orchard_spec::{Purpose, Stream};

/// Returns the indices of `count` of `total` episodes, or of all, ascending. `draw` is the verifier's own random number: a sample that
/// follows from the submitted bytes could be drawn by the submitter again and again until it misses forged episodes.
pub fn drawn(draw: u64, total: usize, count: usize) -> Vec<usize> {
    let mut stream = Stream::new(draw, 0, Purpose::LeaderboardSample);
    let mut rest: Vec<usize> = (0..total).collect();
    let mut sample = Vec::new();
    while sample.len() < count && !rest.is_empty() {
        let index = stream.integer(0, rest.len() as u32 - 1);
        sample.push(rest.swap_remove(index as usize));
    }
    sample.sort_unstable();
    sample
}

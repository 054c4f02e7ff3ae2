//! Sample of the episodes of a submission that are run again.

use orchard_spec::{Purpose, Stream};

/// Draws `count` of `total` episodes (or all) from the hash of all records; returns their indices, ascending. The submitter cannot
/// choose the sample: a change of any byte draws another one.
pub fn drawn(records: &[u8; 32], total: usize, count: usize) -> Vec<usize> {
    let seed = records.iter().take(8).fold(0, |seed: u64, &byte| seed << 8 | u64::from(byte));
    let mut stream = Stream::new(seed, 0, Purpose::LeaderboardSample);
    let mut rest: Vec<usize> = (0..total).collect();
    let mut sample = Vec::new();
    while sample.len() < count && !rest.is_empty() {
        let index = stream.integer(0, rest.len() as u32 - 1);
        sample.push(rest.swap_remove(index as usize));
    }
    sample.sort_unstable();
    sample
}

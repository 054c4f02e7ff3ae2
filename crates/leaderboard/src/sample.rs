//! Sample of the episodes of a submission that are run again.

use orchard_spec::{Purpose, Stream};

/// Indices of `count` of `total` episodes, or all, ascending. They follow from the hash of all records, so that the submitter
/// cannot choose: another byte anywhere draws another sample.
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

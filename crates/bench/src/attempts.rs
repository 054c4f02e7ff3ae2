//! From the controller's log and the world's truth to attempt records.
//!
//! An attempt starts when a target is committed, false detections included. It is placed if a fruit that both
//! fingers have held landed in the bucket between its start and a short grace after its end; the controller's
//! own verdict decides nothing.

use crate::episode::{AttemptOutcome, AttemptRecord, FruitEvent, StateTime};
use crate::zones::Zone;

/// Reason of an attempt that the end of the episode cut off.
pub const RUN_ENDED: &str = "run_ended";
/// Reason of an attempt that the controller believed placed and was not.
pub const MISSED_BUCKET: &str = "missed_bucket";
/// Reason of an attempt that the controller left without ending it.
pub const ABANDONED: &str = "abandoned";

/// What is known about an attempt before truth is consulted.
#[derive(Debug, Clone, PartialEq)]
pub struct AttemptLog {
    /// Frame of the commitment.
    pub start_frame: u32,
    /// Committed target [m, odom].
    pub p_odom_target: [f64; 3],
    /// Fruit on the tree within one radius of the target.
    pub fruit: Option<u32>,
    /// Zone of the fruit or of the target.
    pub zone: Option<Zone>,
    /// States and the frames at which they were entered.
    pub states: Vec<(u32, String)>,
    /// Frame of the end and the controller's reason for failure; `None` while it runs.
    pub end: Option<(u32, Option<String>)>,
    /// Largest stem force so far [N].
    pub max_stem_pull: f64,
}

/// What befell fruit, each list in time order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FruitHistory {
    /// Both fingers closed on a fruit.
    pub gripped: Vec<FruitEvent>,
    /// A stem gave way.
    pub detached: Vec<FruitEvent>,
    /// A fruit landed in the bucket.
    pub deposited: Vec<FruitEvent>,
    /// A fruit reached the ground.
    pub dropped: Vec<FruitEvent>,
}

/// Lengths in frames that turn a log into records.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Frame length [s].
    pub frame: f64,
    /// Frames after its end in which a deposit still counts for an attempt.
    pub grace: u32,
    /// Frames of the whole episode.
    pub last: u32,
}

/// Judges every attempt of an episode.
pub fn judge(logs: &[AttemptLog], history: &FruitHistory, timing: Timing) -> Vec<AttemptRecord> {
    let mut records = Vec::with_capacity(logs.len());
    for (id, log) in logs.iter().enumerate() {
        // An attempt owns the frames (start, until], the next one's start at the latest.
        let end = log.end.as_ref().map_or(timing.last, |e| e.0);
        let next = logs.get(id + 1).map_or(timing.last, |n| n.start_frame);
        let owned = |e: &&FruitEvent, until: u32| e.frame > log.start_frame && e.frame <= until;
        let until = end.saturating_add(timing.grace).min(next).max(end);

        let held_before =
            |e: &FruitEvent| history.gripped.iter().any(|g| g.fruit == e.fruit && g.frame <= e.frame);
        let ids = |events: &[&FruitEvent]| {
            let mut ids: Vec<u32> = Vec::new();
            for e in events {
                if !ids.contains(&e.fruit) {
                    ids.push(e.fruit);
                }
            }
            ids
        };
        let gripped: Vec<&FruitEvent> = history.gripped.iter().filter(|e| owned(e, end)).collect();
        let detached: Vec<&FruitEvent> =
            history.detached.iter().filter(|e| owned(e, end) && held_before(e)).collect();
        let placed: Vec<&FruitEvent> =
            history.deposited.iter().filter(|e| owned(e, until) && held_before(e)).collect();

        let time = |frame: u32| f64::from(frame) * timing.frame;
        let failure_reason = match (&log.end, placed.is_empty()) {
            (_, false) => None,
            (None, true) => Some(RUN_ENDED.to_owned()),
            (Some((_, None)), true) => Some(MISSED_BUCKET.to_owned()),
            (Some((_, Some(reason))), true) => Some(reason.clone()),
        };
        records.push(AttemptRecord {
            id: id as u32,
            start_frame: log.start_frame,
            end_frame: end,
            start_time: time(log.start_frame),
            end_time: time(end),
            p_odom_target: log.p_odom_target,
            fruit: log.fruit,
            zone: log.zone,
            outcome: if placed.is_empty() { AttemptOutcome::Failed } else { AttemptOutcome::Placed },
            failure_reason,
            gripped: ids(&gripped),
            detached: ids(&detached),
            placed: ids(&placed),
            cycle_time: placed.first().map(|e| time(e.frame - log.start_frame)),
            states: log
                .states
                .iter()
                .map(|(frame, state)| StateTime { state: state.clone(), time: time(*frame) })
                .collect(),
            max_stem_pull_n: crate::episode::finite(log.max_stem_pull),
        });
    }
    records
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMING: Timing = Timing { frame: 0.5, grace: 2, last: 100 };

    fn log(start_frame: u32, end: Option<(u32, Option<&str>)>) -> AttemptLog {
        AttemptLog {
            start_frame,
            p_odom_target: [0.0; 3],
            fruit: None,
            zone: None,
            states: vec![(start_frame, "reach".into())],
            end: end.map(|(frame, reason)| (frame, reason.map(str::to_owned))),
            max_stem_pull: 3.0,
        }
    }

    fn events(list: &[(u32, u32)]) -> Vec<FruitEvent> {
        list.iter().map(|&(fruit, frame)| FruitEvent { fruit, frame, time: f64::from(frame) * 0.5 }).collect()
    }

    #[test]
    fn truth_overrules_the_controller() {
        let history = FruitHistory {
            gripped: events(&[(7, 12), (7, 15), (8, 42)]),
            detached: events(&[(7, 16), (3, 17)]),
            deposited: events(&[(7, 22)]),
            ..FruitHistory::default()
        };
        // Ended as failed at 20, but the fruit lands within the grace; then believed placed, but nothing lands.
        let logs = [log(10, Some((20, Some("grasp_stalled")))), log(40, Some((60, None)))];
        let records = judge(&logs, &history, TIMING);
        assert_eq!(records[0].outcome, AttemptOutcome::Placed);
        assert_eq!(records[0].failure_reason, None);
        assert_eq!(records[0].cycle_time, Some(6.0));
        assert_eq!(records[0].gripped, [7]);
        // Fruit 3 was shaken off, not held.
        assert_eq!(records[0].detached, [7]);
        assert_eq!(records[1].outcome, AttemptOutcome::Failed);
        assert_eq!(records[1].failure_reason.as_deref(), Some(MISSED_BUCKET));
        assert_eq!((records[1].gripped.as_slice(), records[1].detached.len()), ([8].as_slice(), 0));
    }

    #[test]
    fn a_deposit_after_the_grace_or_of_a_fruit_never_held_does_not_count() {
        let history = FruitHistory {
            gripped: events(&[(7, 12)]),
            deposited: events(&[(5, 15), (7, 23)]),
            ..FruitHistory::default()
        };
        let records = judge(&[log(10, Some((20, Some("blocked"))))], &history, TIMING);
        assert_eq!(records[0].failure_reason.as_deref(), Some("blocked"));
        assert_eq!(records[0].cycle_time, None);
    }

    #[test]
    fn a_deposit_belongs_to_one_attempt_only() {
        let history = FruitHistory {
            gripped: events(&[(7, 12)]),
            deposited: events(&[(7, 21)]),
            ..FruitHistory::default()
        };
        // The next attempt starts at 20: the deposit at 21 is within the first one's grace but not its own.
        let logs = [log(10, Some((20, None))), log(20, Some((30, Some("blocked"))))];
        let placed: Vec<bool> =
            judge(&logs, &history, TIMING).iter().map(|r| r.outcome == AttemptOutcome::Placed).collect();
        assert_eq!(placed, [false, true]);
    }

    #[test]
    fn the_end_of_the_run_ends_an_attempt() {
        let records = judge(&[log(90, None)], &FruitHistory::default(), TIMING);
        assert_eq!(records[0].end_frame, 100);
        assert_eq!(records[0].failure_reason.as_deref(), Some(RUN_ENDED));
    }
}

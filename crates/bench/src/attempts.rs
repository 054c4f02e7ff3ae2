//! From the controller's log and the world's truth to attempt records.
//!
//! An attempt starts when a target is committed, false detections included. It is placed if a fruit comes to
//! rest in the bucket that both fingers last held during this attempt; the controller's own verdict decides
//! nothing.

use crate::episode::{AttemptOutcome, AttemptRecord, FruitEvent, StateTime, finite};
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

/// Judges every attempt of an episode of `last` frames of `frame` seconds.
pub fn judge(logs: &[AttemptLog], history: &FruitHistory, frame: f64, last: u32) -> Vec<AttemptRecord> {
    let spans: Vec<(u32, u32)> =
        logs.iter().map(|log| (log.start_frame, log.end.as_ref().map_or(last, |end| end.0))).collect();
    let grips = |owner: usize| {
        let (start, end) = spans[owner];
        history.gripped.iter().filter(move |e| e.frame > start && e.frame <= end)
    };
    // What befalls a fruit off the hand belongs to the attempt that held it last.
    let owner = |event: &FruitEvent| {
        let grip = history.gripped.iter().rfind(|g| g.fruit == event.fruit && g.frame <= event.frame)?;
        spans.iter().rposition(|&(start, end)| grip.frame > start && grip.frame <= end)
    };
    let owned = |events: &[FruitEvent], id: usize| distinct(events.iter().filter(|e| owner(e) == Some(id)));
    let time = |frames: u32| f64::from(frames) * frame;

    let mut records = Vec::with_capacity(logs.len());
    for (id, log) in logs.iter().enumerate() {
        let end = spans[id].1;
        let placed = owned(&history.deposited, id);
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
            gripped: distinct(grips(id)),
            detached: owned(&history.detached, id),
            cycle_time: (!placed.is_empty()).then(|| time(end - log.start_frame)),
            placed,
            states: log
                .states
                .iter()
                .map(|(frame, state)| StateTime { state: state.clone(), time: time(*frame) })
                .collect(),
            max_stem_pull_n: finite(log.max_stem_pull),
        });
    }
    records
}

/// The fruit of a list of events, each once, in the order of their first event.
fn distinct<'a>(events: impl Iterator<Item = &'a FruitEvent>) -> Vec<u32> {
    let mut fruit = Vec::new();
    for event in events {
        if !fruit.contains(&event.fruit) {
            fruit.push(event.fruit);
        }
    }
    fruit
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge_all(logs: &[AttemptLog], history: &FruitHistory) -> Vec<AttemptRecord> {
        judge(logs, history, 0.5, 100)
    }

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
        // Ended as failed at 20, but the fruit comes to rest in the bucket; then believed placed, but none does.
        let logs = [log(10, Some((20, Some("grasp_stalled")))), log(40, Some((60, None)))];
        let records = judge_all(&logs, &history);
        assert_eq!(records[0].outcome, AttemptOutcome::Placed);
        assert_eq!(records[0].failure_reason, None);
        assert_eq!(records[0].cycle_time, Some(5.0));
        assert_eq!(records[0].gripped, [7]);
        // Fruit 3 was shaken off, not held.
        assert_eq!(records[0].detached, [7]);
        assert_eq!(records[1].outcome, AttemptOutcome::Failed);
        assert_eq!(records[1].failure_reason.as_deref(), Some(MISSED_BUCKET));
        assert_eq!((records[1].gripped.as_slice(), records[1].detached.len()), ([8].as_slice(), 0));
    }

    #[test]
    fn a_fruit_that_was_never_held_places_nothing() {
        let history = FruitHistory { deposited: events(&[(5, 15)]), ..FruitHistory::default() };
        let records = judge_all(&[log(10, Some((20, Some("blocked"))))], &history);
        assert_eq!(records[0].failure_reason.as_deref(), Some("blocked"));
        assert_eq!(records[0].cycle_time, None);
    }

    /// A fruit may roll in the bucket long after the next attempt began: it belongs to the one that let it go.
    #[test]
    fn a_deposit_belongs_to_the_last_attempt_that_held_the_fruit() {
        let history = FruitHistory {
            gripped: events(&[(7, 12), (6, 13), (6, 25), (9, 26)]),
            deposited: events(&[(7, 33), (6, 40)]),
            ..FruitHistory::default()
        };
        let logs = [log(10, Some((20, None))), log(20, Some((30, None))), log(31, Some((50, None)))];
        let placed: Vec<Vec<u32>> = judge_all(&logs, &history).into_iter().map(|r| r.placed).collect();
        assert_eq!(placed, [vec![7], vec![6], vec![]]);
    }

    #[test]
    fn the_end_of_the_run_ends_an_attempt() {
        let records = judge_all(&[log(90, None)], &FruitHistory::default());
        assert_eq!(records[0].end_frame, 100);
        assert_eq!(records[0].failure_reason.as_deref(), Some(RUN_ENDED));
    }
}

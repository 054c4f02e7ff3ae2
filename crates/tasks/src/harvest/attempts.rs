//! Makes attempt records from the controller's log and the world's events.
//!
//! An attempt starts when a target is committed, false detections included. It is placed if a fruit that both fingers last held
//! during this attempt comes to rest in the bucket; the controller's own verdict is not used. Events of fruit and wood after the
//! end of an attempt belong to it until the next attempt starts. Fruit was held or knocked off by its contact attempt, whatever the
//! controller declares.

use crate::harvest::episode::{
    AttemptOutcome, AttemptRecord, AttemptSnap, Belief, FruitMoment, HeldFruit, KnockedOff, SnapEvent,
    StateTime,
};
use crate::harvest::reason::{Facts, reason};
use crate::json::finite;
use crate::zones::Zone;

/// Log of an attempt before its outcome is determined.
#[derive(Debug, Clone, PartialEq)]
pub struct AttemptLog {
    /// Frame of the commitment.
    pub start_frame: u32,
    /// Committed target \[m, odom\].
    pub p_odom_target: [f64; 3],
    /// Fruit on the tree within one radius of the target.
    pub fruit: Option<u32>,
    /// Zone of the fruit or of the target.
    pub zone: Option<Zone>,
    /// States and the frames at which they were entered.
    pub states: Vec<(u32, String)>,
    /// Frame of the end and the controller's reason for failure; `None` while it runs.
    pub end: Option<(u32, Option<String>)>,
    /// Belief of the controller, without the reported outcome.
    pub belief: Belief,
    /// Largest stem force so far \[N\].
    pub max_stem_pull: f64,
    /// Largest force on a finger so far \[N\].
    pub max_finger_force: f64,
    /// Largest force on the hand so far \[N\].
    pub max_wrist_force: f64,
}

/// A spell of frames in which at least one finger pressed on a fruit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FingerContact {
    /// The fruit.
    pub fruit: u32,
    /// First frame.
    pub from_frame: u32,
    /// Last frame; `None` while it lasts.
    pub to_frame: Option<u32>,
}

/// Events of fruit and wood, and states of the controller, each list in time order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History {
    /// Contacts of the fingers with fruit.
    pub contacts: Vec<FingerContact>,
    /// Fruit gripped by both fingers.
    pub gripped: Vec<FruitMoment>,
    /// Broken stems.
    pub detached: Vec<FruitMoment>,
    /// Fruit that came to rest in the bucket.
    pub deposited: Vec<FruitMoment>,
    /// Fruit that reached the ground.
    pub dropped: Vec<FruitMoment>,
    /// Fruit that the suction cup lost its seal on with the valve open.
    pub seals_lost: Vec<FruitMoment>,
    /// Fruit that left the field with an exchanged bucket.
    pub taken_away: Vec<FruitMoment>,
    /// Intervals in which a detached fruit was held.
    pub held: Vec<HeldFruit>,
    /// Ruptures of wood.
    pub snapped: Vec<SnapEvent>,
    /// States that the controller entered, within attempts and between them.
    pub states: Vec<(u32, String)>,
}

impl History {
    /// State in which the controller gave the command of the step to a frame.
    fn state(&self, frame: u32) -> Option<String> {
        self.states.iter().rfind(|(since, _)| *since < frame).map(|(_, state)| state.clone())
    }

    /// Begins a contact of the fingers with a fruit.
    pub fn begin_contact(&mut self, fruit: u32, frame: u32) {
        self.contacts.push(FingerContact { fruit, from_frame: frame, to_frame: None });
    }

    /// Ends the contact of the fingers with a fruit; `frame` is the first one without.
    pub fn end_contact(&mut self, fruit: u32, frame: u32) {
        let last = self.contacts.iter_mut().rfind(|contact| contact.fruit == fruit);
        if let Some(contact) = last.filter(|contact| contact.to_frame.is_none()) {
            contact.to_frame = Some(frame.saturating_sub(1).max(contact.from_frame));
        }
    }
}

/// Makes the records of all attempts of an episode with `last` frames of `frame` seconds; `knocked_off` is the fruit that was not held
/// when it came off its stem.
pub fn judge(
    logs: &[AttemptLog],
    history: &History,
    knocked_off: &[FruitMoment],
    frame: f64,
    last: u32,
) -> Vec<AttemptRecord> {
    let spans: Vec<(u32, u32)> =
        logs.iter().map(|log| (log.start_frame, log.end.as_ref().map_or(last, |end| end.0))).collect();
    let grips = |owner: usize| {
        let (start, end) = spans[owner];
        history.gripped.iter().filter(move |e| e.frame > start && e.frame <= end)
    };
    // Events of a fruit that has left the hand belong to the attempt that held it last.
    let owner = |event: &FruitMoment| {
        let grip = history.gripped.iter().rfind(|g| g.fruit == event.fruit && g.frame <= event.frame)?;
        spans.iter().rposition(|&(start, end)| grip.frame > start && grip.frame <= end)
    };
    let owned = |events: &[FruitMoment], id: usize| distinct(events.iter().filter(|e| owner(e) == Some(id)));
    let time = |frames: u32| f64::from(frames) * frame;

    let mut records = Vec::with_capacity(logs.len());
    for (id, log) in logs.iter().enumerate() {
        let (start, end) = spans[id];
        // Frame of the next commitment.
        let until = logs.get(id + 1).map_or(last, |next| next.start_frame);
        let within = |frame: u32| frame > start && frame <= until;
        let came_off = || history.detached.iter().filter(|e| within(e.frame));
        let unheld = |e: &&FruitMoment| knocked_off.contains(e);
        let held: Vec<HeldFruit> = history.held.iter().filter(|h| within(h.from_frame)).cloned().collect();
        let placed = owned(&history.deposited, id);
        let facts = Facts {
            placed: !placed.is_empty(),
            target_is_fruit: log.fruit.is_some(),
            target_knocked_off: came_off()
                .filter(unheld)
                .any(|e| Some(e.fruit) == log.fruit && e.frame <= end),
            held: &held,
            end,
            gripped: grips(id).next().is_some(),
            believed: log.end.as_ref().map(|(_, failure)| failure.as_deref()),
        };
        let failure_reason = reason(&facts).map(str::to_owned);
        records.push(AttemptRecord {
            id: id as u32,
            start_frame: start,
            end_frame: end,
            start_time: time(start),
            end_time: time(end),
            p_odom_target: log.p_odom_target,
            fruit: log.fruit,
            zone: log.zone,
            outcome: if placed.is_empty() { AttemptOutcome::Failed } else { AttemptOutcome::Placed },
            failure_reason,
            gripped: distinct(grips(id)),
            detached: distinct(came_off().filter(|e| !unheld(e))),
            cycle_time: (!placed.is_empty()).then(|| time(end - start)),
            placed,
            states: log
                .states
                .iter()
                .map(|(frame, state)| StateTime { state: state.clone(), time: time(*frame) })
                .collect(),
            belief: Belief { end: log.end.as_ref().map(|(_, e)| believed_end(e)), ..log.belief.clone() },
            held,
            knocked_off: came_off()
                .filter(unheld)
                .map(|e| KnockedOff { fruit: e.fruit, time: e.time, state: history.state(e.frame) })
                .collect(),
            snapped: history
                .snapped
                .iter()
                .filter(|e| within(e.frame))
                .map(|e| AttemptSnap { segment: e.segment, time: e.time, state: history.state(e.frame) })
                .collect(),
            max_stem_pull_n: finite(log.max_stem_pull),
            max_finger_force_n: finite(log.max_finger_force),
            max_wrist_force_n: finite(log.max_wrist_force),
        });
    }
    records
}

/// Name of an outcome that the controller reported.
fn believed_end(failure: &Option<String>) -> String {
    failure.clone().unwrap_or_else(|| "deposited".to_owned())
}

/// The fruit of a list of events without duplicates, in the order of their first event.
fn distinct<'a>(events: impl Iterator<Item = &'a FruitMoment>) -> Vec<u32> {
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
    use crate::harvest::episode::HeldEnd;
    use crate::harvest::reason::{GRASP_MISSED, KNOCKED_OFF_BY_ARM, MISSED_BUCKET, RUN_ENDED, SLIPPED};

    fn judge_all(logs: &[AttemptLog], history: &History) -> Vec<AttemptRecord> {
        judge_with(logs, history, &[])
    }

    /// Judges where the given fruit was knocked off.
    fn judge_with(logs: &[AttemptLog], history: &History, knocked: &[FruitMoment]) -> Vec<AttemptRecord> {
        judge(logs, history, knocked, 0.5, 100)
    }

    fn log(start_frame: u32, end: Option<(u32, Option<&str>)>) -> AttemptLog {
        AttemptLog {
            start_frame,
            p_odom_target: [0.0; 3],
            fruit: None,
            zone: None,
            states: vec![(start_frame, "reach".into())],
            end: end.map(|(frame, reason)| (frame, reason.map(str::to_owned))),
            belief: Belief::default(),
            max_stem_pull: 3.0,
            max_finger_force: 5.0,
            max_wrist_force: 6.0,
        }
    }

    fn events(list: &[(u32, u32)]) -> Vec<FruitMoment> {
        list.iter()
            .map(|&(fruit, frame)| FruitMoment { fruit, frame, time: f64::from(frame) * 0.5 })
            .collect()
    }

    #[test]
    fn truth_overrules_the_controller() {
        let history = History {
            gripped: events(&[(7, 12), (7, 15), (8, 42)]),
            detached: events(&[(7, 16), (3, 17)]),
            deposited: events(&[(7, 22)]),
            ..History::default()
        };
        // Ended as failed at 20, but the fruit comes to rest in the bucket; then believed placed, but none does.
        let logs = [log(10, Some((20, Some("grasp_stalled")))), log(40, Some((60, None)))];
        let records = judge_with(&logs, &history, &events(&[(3, 17)]));
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
        let history = History { deposited: events(&[(5, 15)]), ..History::default() };
        let records = judge_all(&[log(10, Some((20, Some("blocked"))))], &history);
        assert_eq!(records[0].failure_reason.as_deref(), Some("blocked"));
        assert_eq!(records[0].cycle_time, None);
    }

    /// A fruit may roll in the bucket long after the next attempt began: it belongs to the one that let it go.
    #[test]
    fn a_deposit_belongs_to_the_last_attempt_that_held_the_fruit() {
        let history = History {
            gripped: events(&[(7, 12), (6, 13), (6, 25), (9, 26)]),
            deposited: events(&[(7, 33), (6, 40)]),
            ..History::default()
        };
        let logs = [log(10, Some((20, None))), log(20, Some((30, None))), log(31, Some((50, None)))];
        let placed: Vec<Vec<u32>> = judge_all(&logs, &history).into_iter().map(|r| r.placed).collect();
        assert_eq!(placed, [vec![7], vec![6], vec![]]);
    }

    #[test]
    fn the_end_of_the_run_ends_an_attempt() {
        let records = judge_all(&[log(90, None)], &History::default());
        assert_eq!(records[0].end_frame, 100);
        assert_eq!(records[0].failure_reason.as_deref(), Some(RUN_ENDED));
    }
    /// An attempt at fruit 7 from frame 10 to 20 that the controller ended as given; the next one starts at frame 30.
    fn aimed(end: Option<&str>) -> [AttemptLog; 2] {
        let aimed = AttemptLog { fruit: Some(7), ..log(10, Some((20, end))) };
        [aimed, log(30, Some((40, Some("blocked"))))]
    }

    fn held(from_frame: u32, to_frame: u32, end: HeldEnd) -> Vec<HeldFruit> {
        vec![HeldFruit { fruit: 7, from_frame, to_frame, end }]
    }

    #[test]
    fn a_fruit_that_was_held_off_its_stem_and_lost_has_slipped() {
        let mut history = History {
            gripped: events(&[(7, 12)]),
            detached: events(&[(7, 14)]),
            held: held(14, 18, HeldEnd::Lost),
            ..History::default()
        };
        // The controller reports a deposit, a block or a slip: the verdict is the same.
        for believed in [None, Some("blocked"), Some("slipped")] {
            let record = &judge_all(&aimed(believed), &history)[0];
            assert_eq!(record.failure_reason.as_deref(), Some(SLIPPED));
            assert_eq!(record.belief.end.as_deref(), Some(believed.unwrap_or("deposited")));
            assert_eq!((record.detached.as_slice(), record.knocked_off.len()), ([7].as_slice(), 0));
        }
        history.held = held(14, 18, HeldEnd::LetGo);
        assert_eq!(judge_all(&aimed(None), &history)[0].failure_reason.as_deref(), Some(MISSED_BUCKET));
        assert_eq!(
            judge_all(&aimed(Some("blocked")), &history)[0].failure_reason.as_deref(),
            Some("blocked")
        );
    }

    #[test]
    fn a_target_that_fell_unheld_was_knocked_off() {
        let reason = |gripped: &[(u32, u32)], detached: &[(u32, u32)], knocked: &[(u32, u32)]| {
            let history =
                History { gripped: events(gripped), detached: events(detached), ..History::default() };
            let logs = aimed(Some("no_fruit_at_detection"));
            judge_with(&logs, &history, &events(knocked))[0].failure_reason.clone().unwrap()
        };
        assert_eq!(reason(&[], &[(7, 14)], &[(7, 14)]), KNOCKED_OFF_BY_ARM);
        // Gripped only after its fall, it was still not held when it fell.
        assert_eq!(reason(&[(7, 15)], &[(7, 14)], &[(7, 14)]), KNOCKED_OFF_BY_ARM);
        // Another fruit fell, or the target after the end of the attempt.
        assert_eq!(reason(&[], &[(8, 14)], &[(8, 14)]), GRASP_MISSED);
        assert_eq!(reason(&[], &[(7, 21)], &[(7, 21)]), GRASP_MISSED);
        // Held as it came off, by a grip that may be older than the attempt.
        assert_eq!(reason(&[(7, 12)], &[(7, 14)], &[]), GRASP_MISSED);
        assert_eq!(reason(&[], &[(7, 14)], &[]), GRASP_MISSED);
        // A target where no fruit hung.
        let blank = AttemptLog { fruit: None, ..aimed(Some("no_fruit_at_detection"))[0].clone() };
        let record = &judge_all(&[blank], &History::default())[0];
        assert_eq!(record.failure_reason.as_deref(), Some("no_fruit_at_detection"));
    }

    #[test]
    fn what_falls_and_breaks_on_the_way_back_belongs_to_the_attempt() {
        let states = [(10, "align"), (15, "reach"), (20, "retreat"), (25, "scan"), (30, "align")];
        let snap =
            |segment, frame: u32| SnapEvent { segment, frame, time: f64::from(frame) * 0.5, at_union: false };
        let history = History {
            detached: events(&[(1, 5), (2, 16), (3, 26), (4, 31)]),
            snapped: vec![snap(40, 15), snap(41, 22), snap(42, 31)],
            states: states.map(|(frame, state)| (frame, state.to_owned())).into(),
            ..History::default()
        };
        let records = judge_with(&aimed(Some("blocked")), &history, &history.detached);
        let knocked: Vec<(u32, &str)> =
            records[0].knocked_off.iter().map(|k| (k.fruit, k.state.as_deref().unwrap())).collect();
        assert_eq!(knocked, [(2, "reach"), (3, "scan")]);
        // At frame 15 the command of `align` had led there.
        let snapped: Vec<(u32, &str)> =
            records[0].snapped.iter().map(|s| (s.segment, s.state.as_deref().unwrap())).collect();
        assert_eq!(snapped, [(40, "align"), (41, "retreat")]);
        assert_eq!((records[1].knocked_off[0].fruit, records[1].snapped[0].segment), (4, 42));
    }
}

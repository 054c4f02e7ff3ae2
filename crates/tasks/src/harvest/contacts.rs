//! Contact attempts: attempts by the truth of the world alone, whatever the controller declares.
//!
//! A contact attempt opens when a finger begins to press on a fruit that hangs, or that is off its stem and has neither rested in the
//! bucket nor touched the ground. While the fruit hangs, the attempt closes once no finger has touched it for `rules.contact_gap`. A fruit
//! that is off its stem stays with its attempt until it rests in the bucket or touches the ground: contacts of a hand that carries
//! it may flicker. Each fruit has attempts of its own, also at the same time as another fruit.

use crate::harvest::attempts::History;
use crate::harvest::episode::{ContactAttemptRecord, ContactOutcome, FruitMoment};

/// The contact attempts of an episode of `last` frames of `frame` seconds, by their beginning; `gap` is the time without contact that
/// closes one \[frames\].
pub(crate) fn contact_attempts(
    history: &History,
    gap: u32,
    frame: f64,
    last: u32,
) -> Vec<ContactAttemptRecord> {
    let mut touched: Vec<u32> = history.contacts.iter().map(|contact| contact.fruit).collect();
    touched.sort_unstable();
    touched.dedup();
    let mut attempts: Vec<ContactAttemptRecord> = touched
        .into_iter()
        .map(|fruit| FruitStory::of(fruit, history, gap, last))
        .flat_map(|story| story.spans().into_iter().map(move |span| story.judged(span, history, frame)))
        .collect();
    attempts.sort_by_key(|attempt| (attempt.start_frame, attempt.fruit));
    attempts
}

/// Fruit that came off its stem and was not held then.
pub(crate) fn knocked_off(history: &History, gap: u32) -> Vec<FruitMoment> {
    let unheld = |e: &&FruitMoment| !was_held(history, e.fruit, e.frame, gap);
    history.detached.iter().filter(unheld).cloned().collect()
}

/// True if a fruit whose stem gave way in frame `detached` was held then: both fingers had pressed on it at once in the contact attempt
/// that was open.
pub(crate) fn was_held(history: &History, fruit: u32, detached: u32, gap: u32) -> bool {
    let story = FruitStory::of(fruit, history, gap, detached);
    let open = story.spans().last().copied().filter(|[_, end]| detached < end.saturating_add(gap));
    open.is_some_and(|[start, _]| story.is_gripped(history, start, detached))
}

/// The contacts of the fingers with one fruit, and where it ended.
struct FruitStory {
    fruit: u32,
    /// First and last frame of each contact that counts.
    contacts: Vec<[u32; 2]>,
    /// Frame in which its stem gave way.
    detached: Option<u32>,
    /// Frame in which it first rested in the bucket or touched the ground; true for the bucket.
    settled: Option<(u32, bool)>,
    gap: u32,
    last: u32,
}

impl FruitStory {
    fn of(fruit: u32, history: &History, gap: u32, last: u32) -> Self {
        let first = |events: &[FruitMoment]| events.iter().find(|e| e.fruit == fruit).map(|e| e.frame);
        let deposited = first(&history.deposited).map(|frame| (frame, true));
        let dropped = first(&history.dropped).map(|frame| (frame, false));
        let settled = deposited.into_iter().chain(dropped).min_by_key(|(frame, _)| *frame);
        // A fruit that lies in the bucket or on the ground opens no attempt; nor does the robot that stands still after its time.
        let end = settled.map_or(last, |(frame, _)| frame.min(last));
        let is_free = |from: u32| from <= last && settled.is_none_or(|(frame, _)| from < frame);
        let contacts = history
            .contacts
            .iter()
            .filter(|contact| contact.fruit == fruit && is_free(contact.from_frame))
            .map(|contact| [contact.from_frame, contact.to_frame.unwrap_or(last).min(end)])
            .collect();
        Self { fruit, contacts, detached: first(&history.detached), settled, gap, last }
    }

    /// True if the stem gave way before an attempt closed that saw its last contact in frame `end`.
    fn is_off_stem(&self, end: u32) -> bool {
        self.detached.is_some_and(|frame| frame < end.saturating_add(self.gap))
    }

    /// First and last frame with contact of each attempt.
    fn spans(&self) -> Vec<[u32; 2]> {
        let mut spans: Vec<[u32; 2]> = Vec::new();
        for &[from, to] in &self.contacts {
            match spans.last_mut() {
                Some([_, end]) if from - *end < self.gap || self.is_off_stem(*end) => *end = to,
                _ => spans.push([from, to]),
            }
        }
        spans
    }

    /// True if both fingers began to press on it between two frames, both included.
    fn is_gripped(&self, history: &History, start: u32, end: u32) -> bool {
        history.gripped.iter().any(|e| e.fruit == self.fruit && (start..=end).contains(&e.frame))
    }

    fn judged(&self, [start, end]: [u32; 2], history: &History, frame: f64) -> ContactAttemptRecord {
        let gripped = self.is_gripped(history, start, end);
        let detached = self.is_off_stem(end);
        let outcome = match self.settled {
            Some((_, true)) if detached => ContactOutcome::Placed,
            None if detached && end == self.last => ContactOutcome::RunEnded,
            _ if detached && gripped => ContactOutcome::Dropped,
            _ if detached => ContactOutcome::KnockedOff,
            _ if self.last - end < self.gap => ContactOutcome::RunEnded,
            _ => ContactOutcome::LeftOnTree,
        };
        let time = |frames: u32| f64::from(frames) * frame;
        ContactAttemptRecord {
            fruit: self.fruit,
            start_frame: start,
            end_frame: end,
            start_time: time(start),
            end_time: time(end),
            gripped,
            detached,
            outcome,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::harvest::attempts::FingerContact;
    use orchard_spec::{Purpose, Stream};

    /// Frames without contact that close an attempt, and frames of an episode.
    const GAP: u32 = 4;
    const LAST: u32 = 100;

    fn events(list: &[(u32, u32)]) -> Vec<FruitMoment> {
        list.iter()
            .map(|&(fruit, frame)| FruitMoment { fruit, frame, time: f64::from(frame) * 0.5 })
            .collect()
    }

    /// A history of contacts as (fruit, first frame, last frame).
    fn touched(contacts: &[(u32, u32, u32)]) -> History {
        let contact = |&(fruit, from_frame, to_frame): &(u32, u32, u32)| FingerContact {
            fruit,
            from_frame,
            to_frame: Some(to_frame),
        };
        History { contacts: contacts.iter().map(contact).collect(), ..History::default() }
    }

    /// Attempts as (fruit, first frame, last frame, outcome).
    fn attempts(history: &History) -> Vec<(u32, u32, u32, ContactOutcome)> {
        let attempts = contact_attempts(history, GAP, 0.5, LAST);
        attempts.iter().map(|a| (a.fruit, a.start_frame, a.end_frame, a.outcome)).collect()
    }

    use ContactOutcome::{Dropped, KnockedOff, LeftOnTree, Placed, RunEnded};

    #[test]
    fn a_touched_fruit_that_stays_on_its_stem_is_left_on_the_tree() {
        let records = contact_attempts(&touched(&[(7, 10, 12)]), GAP, 0.5, LAST);
        let expected = ContactAttemptRecord {
            fruit: 7,
            start_frame: 10,
            end_frame: 12,
            start_time: 5.0,
            end_time: 6.0,
            gripped: false,
            detached: false,
            outcome: LeftOnTree,
        };
        assert_eq!(records, [expected]);
        assert_eq!(attempts(&History::default()), []);
    }

    #[test]
    fn contacts_within_the_gap_are_one_attempt_and_a_longer_gap_closes_it() {
        assert_eq!(attempts(&touched(&[(7, 10, 12), (7, 15, 16)])), [(7, 10, 16, LeftOnTree)]);
        // From the contact in frame 12 to the one in frame 16 pass 4 frames.
        let expected = [(7, 10, 12, LeftOnTree), (7, 16, 16, LeftOnTree)];
        assert_eq!(attempts(&touched(&[(7, 10, 12), (7, 16, 16)])), expected);
    }

    #[test]
    fn a_picked_fruit_is_placed_or_dropped() {
        let mut history = touched(&[(7, 10, 20)]);
        history.gripped = events(&[(7, 12)]);
        history.detached = events(&[(7, 15)]);
        assert_eq!(attempts(&history), [(7, 10, 20, Dropped)]);
        history.dropped = events(&[(7, 25)]);
        assert_eq!(attempts(&history), [(7, 10, 20, Dropped)]);
        history.dropped.clear();
        // The fruit may roll in the bucket for long, also after the end of the episode.
        for frame in [22, 60, LAST + 3] {
            history.deposited = events(&[(7, frame)]);
            assert_eq!(attempts(&history), [(7, 10, 20, Placed)]);
        }
        // It jumps out of the bucket later: it was placed, as for declared attempts.
        history.dropped = events(&[(7, LAST + 4)]);
        assert_eq!(attempts(&history), [(7, 10, 20, Placed)]);
    }

    #[test]
    fn a_fruit_off_its_stem_stays_with_its_attempt() {
        // The contact flickers for long while the hand carries the fruit.
        let mut history = touched(&[(7, 10, 20), (7, 40, 50)]);
        history.gripped = events(&[(7, 12)]);
        history.detached = events(&[(7, 23)]);
        history.deposited = events(&[(7, 60)]);
        assert_eq!(attempts(&history), [(7, 10, 50, Placed)]);
        // The attempt had closed when the stem gave way: what fell unheld and was caught is another attempt.
        history.detached = events(&[(7, 24)]);
        assert_eq!(attempts(&history), [(7, 10, 20, LeftOnTree), (7, 40, 50, Placed)]);
        // Not even caught: the deposit belongs to no attempt.
        history.contacts.pop();
        assert_eq!(attempts(&history), [(7, 10, 20, LeftOnTree)]);
    }

    #[test]
    fn a_fruit_in_the_bucket_or_on_the_ground_opens_none() {
        let mut history = touched(&[(7, 10, 20), (7, 30, 31), (7, 70, 71)]);
        history.detached = events(&[(7, 15)]);
        history.deposited = events(&[(7, 30)]);
        assert_eq!(attempts(&history), [(7, 10, 20, Placed)]);
        history.dropped = std::mem::take(&mut history.deposited);
        assert_eq!(attempts(&history), [(7, 10, 20, KnockedOff)]);
        // A contact that goes on while the fruit comes to rest ends with it.
        history.dropped = events(&[(7, 18)]);
        assert_eq!(attempts(&history), [(7, 10, 18, KnockedOff)]);
    }

    #[test]
    fn a_fruit_is_held_by_the_grip_of_the_open_attempt() {
        let mut history = touched(&[(7, 10, 12), (7, 15, 16), (7, 30, 31)]);
        let held = |history: &History, frame| was_held(history, 7, frame, GAP);
        assert!(!held(&history, 15), "touched, never gripped");
        history.gripped = events(&[(7, 11), (3, 30)]);
        // The attempt of frames 10 to 16 is open until frame 19. In that of frame 30 only another fruit was gripped.
        let frames: Vec<u32> = (1..40).filter(|frame| held(&history, *frame)).collect();
        assert_eq!(frames, (11..20).collect::<Vec<_>>());
        // A contact that still lasts when the stem gives way.
        history.contacts[2].to_frame = None;
        history.gripped = events(&[(7, 33)]);
        assert!(!held(&history, 32) && held(&history, 33) && held(&history, 90));
        assert!(!held(&History::default(), 1));
        // All other fruit off its stem was knocked off, whether touched or not.
        history.detached = events(&[(7, 40), (8, 41), (3, 42)]);
        assert_eq!(knocked_off(&history, GAP), events(&[(8, 41), (3, 42)]));
    }

    #[test]
    fn each_fruit_has_attempts_of_its_own() {
        let mut history = touched(&[(7, 10, 20), (3, 12, 13), (9, 12, 40)]);
        history.gripped = events(&[(7, 11), (9, 30)]);
        history.detached = events(&[(7, 15), (3, 14), (9, 31)]);
        history.deposited = events(&[(7, 22), (9, 45)]);
        history.dropped = events(&[(3, 17)]);
        let expected = [(7, 10, 20, Placed), (3, 12, 13, KnockedOff), (9, 12, 40, Placed)];
        assert_eq!(attempts(&history), expected);
    }

    #[test]
    fn the_end_of_the_episode_cuts_an_attempt_off() {
        assert_eq!(attempts(&touched(&[(7, 90, 97)])), [(7, 90, 97, RunEnded)]);
        assert_eq!(attempts(&touched(&[(7, 90, 96)])), [(7, 90, 96, LeftOnTree)]);
        // In the hand at the end, and let go before it.
        let mut history = touched(&[(7, 90, LAST + 5)]);
        history.gripped = events(&[(7, 91)]);
        history.detached = events(&[(7, 95)]);
        assert_eq!(attempts(&history), [(7, 90, LAST, RunEnded)]);
        history.contacts[0].to_frame = None;
        assert_eq!(attempts(&history), [(7, 90, LAST, RunEnded)]);
        history.contacts[0].to_frame = Some(LAST - 1);
        assert_eq!(attempts(&history), [(7, 90, LAST - 1, Dropped)]);
        // After the end nothing opens.
        assert_eq!(attempts(&touched(&[(7, LAST + 1, LAST + 2)])), []);
    }

    /// A fruit's random course, as the world could run it: hanging with contacts, off its stem or not, settled or not.
    fn draw(stream: &mut Stream, fruit: u32, history: &mut History) {
        let mut contacts = Vec::new();
        let mut frame = 1 + stream.integer(0, 30);
        for _ in 0..stream.integer(0, 5) {
            let to = frame + stream.integer(0, 9);
            contacts.push((fruit, frame, to));
            frame = to + 2 + stream.integer(0, 8);
        }
        for (_, from, to) in &contacts {
            if stream.integer(0, 1) == 0 {
                history.gripped.extend(events(&[(fruit, from + stream.integer(0, to - from))]));
            }
        }
        history.contacts.append(&mut touched(&contacts).contacts);
        if stream.integer(0, 2) > 0 {
            let detached = 1 + stream.integer(0, LAST);
            history.detached.extend(events(&[(fruit, detached)]));
            let settled = detached + 1 + stream.integer(0, 40);
            match stream.integer(0, 2) {
                0 => history.deposited.extend(events(&[(fruit, settled)])),
                1 => history.dropped.extend(events(&[(fruit, settled)])),
                _ => {}
            }
        }
    }

    /// Over random courses: attempts of one fruit lie apart; there are no more placed attempts than deposits; a deposit by hand, of a
    /// fruit that a finger touched less than the gap before it came off or after, belongs to exactly one attempt.
    #[test]
    fn every_deposit_by_hand_belongs_to_one_attempt() {
        let mut stream = Stream::new(5, 0, Purpose::Test);
        let (mut placed_ever, mut by_hand_ever) = (0, 0);
        for _ in 0..3000 {
            let mut history = History::default();
            for fruit in 0..4 {
                draw(&mut stream, fruit, &mut history);
            }
            let records = contact_attempts(&history, GAP, 0.5, LAST);
            assert!(records.is_sorted_by_key(|a| (a.start_frame, a.fruit)));
            let placed = records.iter().filter(|a| a.outcome == Placed).count();
            assert!(placed <= history.deposited.len(), "{history:?}");
            for fruit in 0..4 {
                let own: Vec<&ContactAttemptRecord> = records.iter().filter(|a| a.fruit == fruit).collect();
                assert!(own.windows(2).all(|pair| pair[0].end_frame + GAP <= pair[1].start_frame));
                assert!(own.iter().all(|a| a.start_frame <= a.end_frame && a.end_frame <= LAST));
                // Only the last attempt of a fruit takes it off its stem.
                assert!(own.iter().rev().skip(1).all(|a| a.outcome == LeftOnTree), "{history:?}");
                let at = |list: &[FruitMoment]| list.iter().find(|e| e.fruit == fruit).map(|e| e.frame);
                let (Some(off), Some(rest)) = (at(&history.detached), at(&history.deposited)) else {
                    continue;
                };
                let counts = |c: &&FingerContact| {
                    let to = c.to_frame.unwrap_or(LAST).min(LAST);
                    c.fruit == fruit && c.from_frame <= LAST && c.from_frame < rest && to + GAP > off
                };
                let by_hand = history.contacts.iter().any(|c| counts(&c));
                let placed = own.iter().filter(|a| a.outcome == Placed).count();
                assert_eq!(placed, usize::from(by_hand), "{history:?}");
                placed_ever += placed;
                by_hand_ever += usize::from(by_hand);
            }
        }
        assert!(placed_ever > 500 && placed_ever == by_hand_ever, "{placed_ever} of {by_hand_ever}");
    }
}

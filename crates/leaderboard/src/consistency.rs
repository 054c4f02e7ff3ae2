//! Checks that the fields of a record are consistent. They always are in records that the harness writes.

use orchard_tasks::harvest::episode::{
    AttemptOutcome, AttemptRecord, ContactAttemptRecord, ContactOutcome, EpisodeRecord, FruitState, Outcome,
};
use orchard_tasks::zones::zone_table;

/// The first contradiction in a record; `frame` is a frame's length \[s\].
pub fn contradiction(record: &EpisodeRecord, frame: f64) -> Option<String> {
    let of = |n: usize| n as u32;
    let time = |frames: u32| f64::from(frames) * frame;
    let is = |holds: bool, what: String| if holds { Ok(()) } else { Err(what) };
    let check = || -> Result<(), String> {
        let (frames, horizon) = (record.frames, record.key.horizon_frames);
        is(frames <= horizon, format!("frames is {frames}, more than the horizon of {horizon}"))?;
        let spent = record.outcome == Outcome::BudgetSpent;
        is(
            !spent || frames == horizon,
            format!("the outcome is budget_spent after {frames} of {horizon} frames"),
        )?;
        is(
            record.duration_s == time(frames),
            format!("duration_s is {}, which is not the time of {frames} frames", record.duration_s),
        )?;
        is(
            record.fruit_total == of(record.fruit.len()),
            format!("fruit_total is {}, but {} fruit are listed", record.fruit_total, record.fruit.len()),
        )?;
        is(
            (0..).zip(&record.fruit).all(|(i, f)| f.id == i),
            "the ids of the fruit do not count up from 0".to_owned(),
        )?;
        let reachable: Vec<u32> = record.fruit.iter().filter(|f| f.reachable).map(|f| f.id).collect();
        is(
            record.reachable == reachable && record.reachable_count == of(reachable.len()),
            format!(
                "reachable_count is {}, but {} fruit are reachable",
                record.reachable_count,
                reachable.len()
            ),
        )?;
        let mut census = zone_table(0);
        for zone in record.fruit.iter().filter(|f| f.reachable).filter_map(|f| f.zone) {
            *census.entry(zone).or_insert(0) += 1;
        }
        is(
            record.zone_census == census,
            "zone_census differs from the count of reachable fruit by zone".to_owned(),
        )?;
        for fruit in record.fruit.iter().filter(|f| f.final_state == FruitState::Deposited) {
            let known = record.fruit_deposited.iter().any(|event| event.fruit == fruit.id);
            is(known, format!("fruit {} is in the bucket, but no deposit is listed", fruit.id))?;
        }
        deposits_have_causes(record)?;
        let moments = record.fruit_knocked_off.iter().chain(&record.fruit_dropped).chain(&record.seals_lost);
        let moments = moments.chain(&record.fruit_taken_away).map(|e| (e.frame, e.time));
        let detached = record.fruit_detached.iter().map(|e| (e.frame, e.time));
        let deposits = record.fruit_deposited.iter().map(|e| (e.frame, e.time));
        let snaps = record.branches_snapped.iter().map(|e| (e.frame, e.time));
        for (at, time_s) in moments.chain(detached).chain(deposits).chain(snaps) {
            is(time_s == time(at), format!("an event of frame {at} has the time {time_s} s"))?;
        }
        let seen = &record.detection;
        is(
            seen.recalled <= seen.visible && seen.recalled <= seen.true_positives,
            format!(
                "{} of {} visible fruit were found, with {} true positives",
                seen.recalled, seen.visible, seen.true_positives
            ),
        )?;
        let first = |a: &ContactAttemptRecord| (a.start_frame, a.fruit);
        is(
            record.contact_attempts.is_sorted_by(|a, b| first(a) < first(b)),
            "contact attempts do not stand in their order".to_owned(),
        )?;
        (0..)
            .zip(&record.contact_attempts)
            .try_for_each(|(i, attempt)| check_contact_attempt(record, attempt, i, time))?;
        (0..).zip(&record.attempts).try_for_each(|(i, attempt)| check_attempt(attempt, i, frames, time))
    };
    check().err()
}

/// A fruit in the bucket came off its stem before, gripped or knocked off.
fn deposits_have_causes(record: &EpisodeRecord) -> Result<(), String> {
    for deposit in &record.fruit_deposited {
        let fruit = deposit.fruit;
        if !record.fruit_detached.iter().any(|e| e.fruit == fruit && e.frame <= deposit.frame) {
            return Err(format!("fruit {fruit} is in the bucket and never came off its stem"));
        }
        let gripped = record
            .contact_attempts
            .iter()
            .any(|a| a.fruit == fruit && a.gripped && a.start_frame <= deposit.frame);
        if !gripped && !record.fruit_knocked_off.iter().any(|e| e.fruit == fruit) {
            return Err(format!("fruit {fruit} is in the bucket and was neither gripped nor knocked off"));
        }
    }
    Ok(())
}

fn check_contact_attempt(
    record: &EpisodeRecord,
    attempt: &ContactAttemptRecord,
    id: u32,
    time: impl Fn(u32) -> f64,
) -> Result<(), String> {
    let ContactAttemptRecord { fruit, start_frame, end_frame, .. } = *attempt;
    let is =
        |holds: bool, what: &str| if holds { Ok(()) } else { Err(format!("contact attempt {id}: {what}")) };
    is(fruit < record.fruit_total, "there is no such fruit")?;
    is(start_frame <= end_frame && end_frame <= record.frames, "it does not lie within the episode")?;
    is(
        attempt.start_time == time(start_frame) && attempt.end_time == time(end_frame),
        "times are not those of its frames",
    )?;
    let off = record.fruit_detached.iter().any(|e| e.fruit == fruit);
    is(off || !attempt.detached, "its fruit never came off its stem")?;
    // The last attempt at a fruit that fell places it if its first rest is in the bucket.
    let rest = |frames: Option<u32>| frames.unwrap_or(u32::MAX);
    let deposited = rest(record.fruit_deposited.iter().find(|e| e.fruit == fruit).map(|e| e.frame));
    let dropped = rest(record.fruit_dropped.iter().find(|e| e.fruit == fruit).map(|e| e.frame));
    let placed = attempt.detached && deposited < dropped;
    is(placed == (attempt.outcome == ContactOutcome::Placed), "its outcome is not that of its fruit")
}

fn check_attempt(
    attempt: &AttemptRecord,
    id: u32,
    frames: u32,
    time: impl Fn(u32) -> f64,
) -> Result<(), String> {
    let (start, end) = (attempt.start_frame, attempt.end_frame);
    let placed = attempt.outcome == AttemptOutcome::Placed;
    let cycle = placed.then(|| time(end.saturating_sub(start)));
    let is = |holds: bool, what: &str| if holds { Ok(()) } else { Err(format!("attempt {id}: {what}")) };
    is(attempt.id == id, "the ids of the attempts do not count up from 0")?;
    is(start <= end && end <= frames, "its frames are outside the episode")?;
    is(
        attempt.start_time == time(start) && attempt.end_time == time(end),
        "its times are not those of its frames",
    )?;
    is(placed != attempt.placed.is_empty(), "its outcome contradicts its list of placed fruit")?;
    is(placed != attempt.failure_reason.is_some(), "it must be either placed or have a failure_reason")?;
    is(attempt.cycle_time == cycle, "cycle_time is not its duration")
}

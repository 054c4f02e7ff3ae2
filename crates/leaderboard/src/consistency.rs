//! Checks that a record agrees with itself. Records that the harness writes always do.

use orchard_tasks::harvest::episode::{AttemptOutcome, AttemptRecord, EpisodeRecord, FruitState, Outcome};
use orchard_tasks::zones::zone_table;

/// The first contradiction in a record; `frame` is a frame's length \[s\].
pub fn contradiction(record: &EpisodeRecord, frame: f64) -> Option<String> {
    let of = |n: usize| n as u32;
    let time = |frames: u32| f64::from(frames) * frame;
    let is = |holds: bool, what: String| if holds { Ok(()) } else { Err(what) };
    let check = || -> Result<(), String> {
        let (frames, horizon) = (record.frames, record.key.horizon_frames);
        is(frames <= horizon, format!("{frames} frames in a budget of {horizon}"))?;
        let spent = record.outcome == Outcome::BudgetSpent;
        is(!spent || frames == horizon, format!("the budget of {horizon} frames is spent after {frames}"))?;
        is(record.duration_s == time(frames), format!("{frames} frames take {} s", record.duration_s))?;
        is(
            record.fruit_total == of(record.fruit.len()),
            format!("fruit_total is {}, and {} fruit are listed", record.fruit_total, record.fruit.len()),
        )?;
        is((0..).zip(&record.fruit).all(|(i, f)| f.id == i), "fruit are not numbered from 0".to_owned())?;
        let reachable: Vec<u32> = record.fruit.iter().filter(|f| f.reachable).map(|f| f.id).collect();
        is(
            record.reachable == reachable && record.reachable_count == of(reachable.len()),
            format!(
                "reachable_count is {}, and {} fruit are reachable",
                record.reachable_count,
                reachable.len()
            ),
        )?;
        let mut census = zone_table(0);
        for zone in record.fruit.iter().filter(|f| f.reachable).filter_map(|f| f.zone) {
            *census.entry(zone).or_insert(0) += 1;
        }
        is(record.zone_census == census, "zone_census is not the count of the reachable fruit".to_owned())?;
        for fruit in record.fruit.iter().filter(|f| f.final_state == FruitState::Deposited) {
            let known = record.fruit_deposited.iter().any(|event| event.fruit == fruit.id);
            is(known, format!("fruit {} is in the bucket without an event", fruit.id))?;
        }
        let moments = record.fruit_knocked_off.iter().chain(&record.fruit_dropped).map(|e| (e.frame, e.time));
        let detached = record.fruit_detached.iter().map(|e| (e.frame, e.time));
        let deposits = record.fruit_deposited.iter().map(|e| (e.frame, e.time));
        let snaps = record.branches_snapped.iter().map(|e| (e.frame, e.time));
        for (at, told) in moments.chain(detached).chain(deposits).chain(snaps) {
            is(told == time(at), format!("an event of frame {at} has the time {told} s"))?;
        }
        let seen = &record.detection;
        is(
            seen.recalled <= seen.visible && seen.recalled <= seen.true_positives,
            format!(
                "{} of {} visible fruit are recalled by {} hits",
                seen.recalled, seen.visible, seen.true_positives
            ),
        )?;
        (0..).zip(&record.attempts).try_for_each(|(i, attempt)| check_attempt(attempt, i, frames, time))
    };
    check().err()
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
    is(attempt.id == id, "attempts are not numbered from 0")?;
    is(start <= end && end <= frames, "it does not lie within the episode")?;
    is(
        attempt.start_time == time(start) && attempt.end_time == time(end),
        "times are not those of its frames",
    )?;
    is(placed != attempt.placed.is_empty(), "its outcome is not that of the fruit that it placed")?;
    is(placed != attempt.failure_reason.is_some(), "an attempt either is placed or has a reason")?;
    is(attempt.cycle_time == cycle, "its cycle time is not its length")
}

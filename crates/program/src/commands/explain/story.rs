//! Description of an episode in words.

use orchard_tasks::harvest::episode::{AlarmTime, AttemptRecord, EpisodeRecord, HeldEnd, Outcome};

use super::replay::{Cause, CausedEvent};

/// Heading of the episode and its end.
pub fn head(record: &EpisodeRecord) -> String {
    let key = &record.key;
    let ended = match &record.outcome {
        Outcome::BudgetSpent => "the time limit was reached".to_owned(),
        Outcome::AllReachablePicked => "no reachable fruit was left".to_owned(),
        Outcome::Stalled => "the robot stood still for too long".to_owned(),
        Outcome::Quarantined { reason } => format!("the world was quarantined: {reason}"),
    };
    let repeat = if key.repeat > 0 { format!(", repeat {}", key.repeat) } else { String::new() };
    let ended = match &record.gave_up {
        None => ended,
        Some(told) => format!(
            "{ended}; the controller GAVE UP at {:.1} s and held the robot still: {}",
            told.time,
            words(&told.fault)
        ),
    };
    let until = |time: Option<f64>| time.map_or_else(String::new, |time| format!(" to {time:.1} s"));
    let alarm = |a: &AlarmTime| format!("\nALARM at {:.1} s{}: {}", a.from, until(a.until), words(&a.alarm));
    let alarms: String = record.alarms.iter().map(alarm).collect();
    format!(
        "{} on tree {} of seed {}{repeat}, {}, {:.1} s: {ended}\n\
         {} fruit, {} reachable; {} declared attempts, {} placed; {} contact attempts, {} placed; {} deposited, {} dropped, {} knocked off; {} branches snapped{alarms}",
        key.scenario.controller,
        key.world,
        key.seed,
        key.condition,
        record.duration_s,
        record.fruit_total,
        record.reachable_count,
        record.attempts.len(),
        record.placed().count(),
        record.contact_attempts.len(),
        record.placed_by_contact().count(),
        record.deposited().count(),
        record.dropped().count(),
        record.fruit_knocked_off.len(),
        record.branches_snapped.len(),
    )
}

/// One attempt: heading, events with times, and forces.
pub fn attempt(record: &EpisodeRecord, attempt: &AttemptRecord, causes: &[Cause]) -> String {
    let mut text = format!(
        "attempt {}, {:.1} to {:.1} s: {}\n  {}\n",
        attempt.id,
        attempt.start_time,
        attempt.end_time,
        verdict(attempt),
        target(record, attempt)
    );
    for (time, line) in lines(record, attempt, causes) {
        text += &format!("  {time:6.2} s  {line}\n");
    }
    let newton = |force: Option<f64>| force.map_or_else(|| "-".to_owned(), |n| format!("{n:.0} N"));
    let estimate = attempt.belief.pull_n;
    text += &format!(
        "  largest forces: stem {}, finger {}, wrist {}; pull estimated by the controller: {}\n",
        newton(attempt.max_stem_pull_n),
        newton(attempt.max_finger_force_n),
        newton(attempt.max_wrist_force_n),
        newton(estimate)
    );
    text
}

/// End of an attempt: the true outcome and the controller's report.
pub fn verdict(attempt: &AttemptRecord) -> String {
    let truth = match &attempt.failure_reason {
        None => format!("PLACED in {:.1} s", attempt.cycle_time.unwrap_or(0.0)),
        Some(reason) => format!("FAILED, {}", words(reason)),
    };
    match &attempt.belief.end {
        None => format!("{truth} (not ended by the controller)"),
        Some(end) => format!("{truth} (the controller believes: {})", words(end)),
    }
}

fn target(record: &EpisodeRecord, attempt: &AttemptRecord) -> String {
    let [x, y, z] = attempt.p_odom_target;
    let belief = &attempt.belief;
    let believed = format!("target ({x:.2}, {y:.2}, {z:.2}) m odom, radius {:.0} mm", 1e3 * belief.radius_m);
    let zone = attempt.zone.map_or_else(String::new, |zone| format!("; zone {}", words(&name(&zone))));
    let nearest = belief.nearest_fruit.zip(belief.nearest_distance_m);
    let truth = match (attempt.fruit, nearest) {
        (Some(fruit), _) => {
            let radius = record.fruit.get(fruit as usize).map_or(0.0, |f| f.radius);
            let off = nearest.filter(|(id, _)| *id == fruit).map_or(0.0, |(_, distance)| distance);
            let reachable = record.reachable.contains(&fruit);
            format!(
                "is fruit {fruit}, radius {:.0} mm, {:.0} mm away{}",
                1e3 * radius,
                1e3 * off,
                if reachable { "" } else { ", out of reach" }
            )
        }
        (None, Some((id, distance))) => {
            format!("is NO FRUIT: the nearest, fruit {id}, is {:.0} mm away", 1e3 * distance)
        }
        (None, None) => "is NO FRUIT: none is left on the tree".to_owned(),
    };
    format!("{believed}: {truth}{zone}")
}

/// Events of an attempt with their times, in the order of time.
fn lines(record: &EpisodeRecord, attempt: &AttemptRecord, causes: &[Cause]) -> Vec<(f64, String)> {
    let (start, until) = span(record, attempt);
    let within = |frame: u32| frame > start && frame <= until;
    // Frame times of the record are those of its events: the frame length is their ratio.
    let time = |frame: u32| f64::from(frame) * record.duration_s / f64::from(record.frames.max(1));
    let cause = |of: CausedEvent, frame: u32| {
        causes
            .iter()
            .find(|c| c.of == of && c.frame == frame)
            .map_or_else(String::new, |c| format!(": {}", c.text))
    };
    let state = |state: &Option<String>| state.as_deref().map_or_else(String::new, |s| format!(" (in {s})"));

    let mut lines: Vec<(f64, String)> = Vec::new();
    lines.extend(attempt.states.iter().map(|s| (s.time, format!("{} begins", s.state))));
    let belief = &attempt.belief;
    if let (Some(at), Some(width)) = (belief.grasp_time, belief.grasp_width_m) {
        lines.push((
            at,
            format!("the controller believes that it holds the fruit; finger distance {:.0} mm", 1e3 * width),
        ));
    }
    if let (Some(at), Some(pull)) = (belief.stem_time, belief.pull_n) {
        lines.push((at, format!("the controller believes that the stem broke, after a pull of {pull:.0} N")));
    }
    for yielding in &belief.yielded {
        let force = yielding.force_n.map_or_else(String::new, |force| format!(" with {force:.0} N"));
        lines
            .push((yielding.time, format!("the controller feels a contact of the hand{force} and retreats")));
    }
    let last = lines.last().map_or(attempt.end_time, |(at, _)| at.max(attempt.end_time));
    for held in &attempt.held {
        let fruit = held.fruit;
        lines.push((time(held.from_frame), format!("fruit {fruit} is off its stem and held")));
        let lost = match held.end {
            HeldEnd::InHand => continue,
            HeldEnd::LetGo => format!("the fingers let go of fruit {fruit}"),
            HeldEnd::Lost => format!("fruit {fruit} SLIPS out of the fingers"),
        };
        lines.push((time(held.to_frame), lost));
    }
    for event in record.fruit_detached.iter().filter(|e| within(e.frame)) {
        let knocked = attempt.knocked_off.iter().find(|k| k.fruit == event.fruit);
        let because = cause(CausedEvent::Stem(event.fruit), event.frame);
        let line = match knocked {
            Some(k) => format!("fruit {} is KNOCKED OFF{}{because}", event.fruit, state(&k.state)),
            None => format!("the stem of fruit {} breaks{because}", event.fruit),
        };
        lines.push((event.time, line));
    }
    for (snap, event) in
        attempt.snapped.iter().zip(record.branches_snapped.iter().filter(|e| within(e.frame)))
    {
        let because = cause(CausedEvent::Branch(event.segment), event.frame);
        lines.push((
            event.time,
            format!(
                "branch SNAPS at segment {}{}{}{because}",
                snap.segment,
                if event.at_union { ", at its union" } else { "" },
                state(&snap.state)
            ),
        ));
    }
    for event in record.seals_lost.iter().filter(|e| within(e.frame)) {
        lines.push((event.time, format!("the cup loses its seal on fruit {}", event.fruit)));
    }
    for event in record.fruit_dropped.iter().filter(|e| within(e.frame)) {
        lines.push((event.time, format!("fruit {} reaches the ground", event.fruit)));
    }
    for event in record.fruit_taken_away.iter().filter(|e| within(e.frame)) {
        lines.push((event.time, format!("fruit {} leaves the field with the bucket", event.fruit)));
    }
    for event in record.fruit_deposited.iter().filter(|e| within(e.frame)) {
        let figure =
            |value: Option<f64>, unit: &str| value.map_or_else(String::new, |x| format!(", {x:.3} {unit}"));
        lines.push((
            event.time,
            format!(
                "fruit {} rests in the bucket{}{}",
                event.fruit,
                figure(event.drop_height_m, "m of fall"),
                figure(event.impact_energy_j, "J of impact")
            ),
        ));
    }
    // Contacts are listed unless a fruit left its stem in the hand.
    let end = CausedEvent::End { attempt: attempt.id, fruit: attempt.fruit };
    let contacts = if attempt.held.is_empty() { cause(end, attempt.end_frame) } else { String::new() };
    lines.push((last, format!("the attempt ends{contacts}")));
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    lines
}

/// Every contact attempt, a line each.
pub fn contact_attempts(record: &EpisodeRecord) -> String {
    let mut text = format!("contact attempts, which the world counts: {}\n", record.contact_attempts.len());
    for attempt in &record.contact_attempts {
        text += &format!(
            "  {:6.2} to {:6.2} s  fruit {}{}: {}\n",
            attempt.start_time,
            attempt.end_time,
            attempt.fruit,
            if attempt.gripped { ", gripped" } else { "" },
            words(attempt.outcome.name())
        );
    }
    text
}

/// Frames from an attempt's start to the next one's.
pub fn span(record: &EpisodeRecord, attempt: &AttemptRecord) -> (u32, u32) {
    let next = record.attempts.get(attempt.id as usize + 1);
    (attempt.start_frame, next.map_or(record.frames, |next| next.start_frame))
}

/// Events before the first attempt, and the reachable fruit left on the tree.
pub fn tail(record: &EpisodeRecord, causes: &[Cause]) -> String {
    let first = record.attempts.first().map_or(record.frames, |a| a.start_frame);
    let mut text = String::new();
    for cause in causes.iter().filter(|cause| cause.frame <= first) {
        let what = match cause.of {
            CausedEvent::Branch(segment) => format!("branch snapped at segment {segment}"),
            CausedEvent::Stem(fruit) => format!("fruit {fruit} came off"),
            CausedEvent::End { .. } => continue,
        };
        text += &format!("before the first attempt, frame {}: {what}: {}\n", cause.frame, cause.text);
    }
    let left = record.reachable.iter().filter(|&&id| {
        use orchard_tasks::harvest::episode::FruitState::{OnBrokenLimb, OnTree};
        record.fruit.get(id as usize).is_some_and(|f| matches!(f.final_state, OnTree | OnBrokenLimb))
    });
    text + &format!("reachable fruit left on the tree: {}\n", left.count())
}

/// A name with spaces for underscores.
pub fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// The serialised name of a unit variant.
fn name(value: &impl serde::Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}

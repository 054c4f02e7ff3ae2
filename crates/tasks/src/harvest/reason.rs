//! Failure reasons of attempts. Facts of the world take precedence over the belief of the controller.

use crate::harvest::episode::{HeldEnd, HeldFruit};

/// The episode ended during the attempt.
pub const RUN_ENDED: &str = "run_ended";
/// The controller reported the attempt as placed, but it was not.
pub const MISSED_BUCKET: &str = "missed_bucket";
/// The controller started another attempt without ending this one.
pub const ABANDONED: &str = "abandoned";
/// A detached fruit was held and lost without being let go.
pub const SLIPPED: &str = "slipped";
/// The target came off its stem without being held.
pub const KNOCKED_OFF_BY_ARM: &str = "knocked_off_by_arm";
/// The fruit was gripped but stayed on its stem.
const STEM_TOO_STRONG: &str = "stem_too_strong";
/// A fruit hung at the target, but the attempt did not grip it.
pub const GRASP_MISSED: &str = "grasp_missed";
/// No fruit hung at the target: a false detection.
const NO_FRUIT: &str = "no_fruit_at_detection";

/// Facts on which the reason depends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facts<'a> {
    /// A fruit that the attempt held came to rest in the bucket.
    pub placed: bool,
    /// A fruit hung at the target when the controller committed to it.
    pub target_is_fruit: bool,
    /// The target came off its stem before the end of the attempt, and had not been held in it.
    pub target_knocked_off: bool,
    /// Intervals in which a detached fruit was held.
    pub held: &'a [HeldFruit],
    /// Frame of the end.
    pub end: u32,
    /// Both fingers closed on a fruit.
    pub gripped: bool,
    /// The outcome that the controller reported: its reason, or `Some(None)` if it believed the fruit placed; `None` if it reported none.
    pub believed: Option<Option<&'a str>>,
}

/// The reason of a failed attempt; `None` if it was placed. The first rule that applies, in the order of `docs/benchmark-v1.md`.
pub(crate) fn reason<'a>(facts: &Facts<'a>) -> Option<&'a str> {
    let lost = |h: &HeldFruit| h.end == HeldEnd::Lost && h.to_frame <= facts.end;
    let reason = match facts.believed {
        _ if facts.placed => return None,
        _ if facts.held.last().is_some_and(lost) => SLIPPED,
        _ if facts.held.is_empty() && facts.target_knocked_off => KNOCKED_OFF_BY_ARM,
        None => RUN_ENDED,
        Some(None) => MISSED_BUCKET,
        // The reported reason is not true: use the nearest true one. A fruit detached in the hand was let go.
        Some(Some(SLIPPED | STEM_TOO_STRONG | NO_FRUIT)) if !facts.held.is_empty() => MISSED_BUCKET,
        Some(Some(SLIPPED)) if facts.gripped => STEM_TOO_STRONG,
        // Truth, not the controller's perception, decides if there was a fruit.
        Some(Some(SLIPPED | KNOCKED_OFF_BY_ARM | NO_FRUIT)) if facts.target_is_fruit => GRASP_MISSED,
        Some(Some(SLIPPED | KNOCKED_OFF_BY_ARM)) => NO_FRUIT,
        Some(Some(believed)) => believed,
    };
    Some(reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(to_frame: u32, end: HeldEnd) -> Vec<HeldFruit> {
        vec![HeldFruit { fruit: 3, from_frame: 10, to_frame, end }]
    }

    /// Reason of an attempt that ended at frame 30.
    fn of(placed: bool, knocked: bool, held: &[HeldFruit], believed: Option<Option<&'static str>>) -> String {
        let facts = Facts {
            placed,
            target_is_fruit: true,
            target_knocked_off: knocked,
            held,
            end: 30,
            gripped: !held.is_empty(),
            believed,
        };
        reason(&facts).unwrap_or("none").to_owned()
    }

    #[test]
    fn the_first_fact_that_holds_is_the_reason() {
        let lost = held(20, HeldEnd::Lost);
        // Placed before all others, whatever the controller believed.
        assert_eq!(of(true, true, &lost, Some(Some("blocked"))), "none");
        for believed in [None, Some(None), Some(Some("blocked")), Some(Some("slipped"))] {
            assert_eq!(of(false, false, &lost, believed), "slipped");
            assert_eq!(of(false, true, &[], believed), "knocked_off_by_arm");
            // The fruit of another stem was held and lost: that is nearer to the bucket than the target's fall.
            assert_eq!(of(false, true, &lost, believed), "slipped");
        }
        assert_eq!(of(false, false, &[], None), "run_ended");
        assert_eq!(of(false, false, &[], Some(None)), "missed_bucket");
        assert_eq!(of(false, false, &[], Some(Some("grasp_stalled"))), "grasp_stalled");
    }

    #[test]
    fn what_is_let_go_or_in_the_hand_has_not_slipped() {
        for end in [HeldEnd::LetGo, HeldEnd::InHand] {
            assert_eq!(of(false, false, &held(20, end), Some(None)), "missed_bucket");
            assert_eq!(of(false, false, &held(20, end), Some(Some("blocked"))), "blocked");
            assert_eq!(of(false, false, &held(20, end), None), "run_ended");
        }
        // Lost after the controller gave up for another reason.
        assert_eq!(of(false, false, &held(31, HeldEnd::Lost), Some(Some("blocked"))), "blocked");
    }

    #[test]
    fn a_fruit_in_the_hand_had_neither_a_stem_nor_slipped() {
        for believed in [SLIPPED, STEM_TOO_STRONG, NO_FRUIT] {
            assert_eq!(of(false, false, &held(31, HeldEnd::LetGo), Some(Some(believed))), "missed_bucket");
        }
    }

    #[test]
    fn a_belief_in_what_did_not_happen_gives_way() {
        let facts = |target_is_fruit, gripped, believed| Facts {
            placed: false,
            target_is_fruit,
            target_knocked_off: false,
            held: &[],
            end: 30,
            gripped,
            believed: Some(Some(believed)),
        };
        assert_eq!(reason(&facts(true, true, SLIPPED)), Some("stem_too_strong"));
        for believed in [SLIPPED, KNOCKED_OFF_BY_ARM, NO_FRUIT] {
            assert_eq!(reason(&facts(false, false, believed)), Some("no_fruit_at_detection"));
            assert_eq!(reason(&facts(true, false, believed)), Some("grasp_missed"));
        }
    }

    /// A controller that sees no fruit where one hangs has missed it, whether or not its fingers touched it.
    #[test]
    fn a_fruit_at_the_target_is_never_a_false_detection() {
        let beliefs = [None, Some(None), Some(Some(NO_FRUIT)), Some(Some(SLIPPED)), Some(Some("blocked"))];
        let lost = held(20, HeldEnd::Lost);
        for believed in beliefs {
            for (knocked, held, gripped) in [
                (false, &[][..], false),
                (false, &[][..], true),
                (true, &[][..], false),
                (false, &lost[..], true),
            ] {
                let (target_is_fruit, target_knocked_off) = (true, knocked);
                let facts = Facts {
                    placed: false,
                    target_is_fruit,
                    target_knocked_off,
                    held,
                    end: 30,
                    gripped,
                    believed,
                };
                assert_ne!(reason(&facts), Some(NO_FRUIT), "{facts:?}");
            }
        }
    }
}

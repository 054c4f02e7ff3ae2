//! Intervals in which a detached fruit is held between both fingers: begin, end and outcome.

use orchard_world::truth::FruitState;

use crate::harvest::episode::{HeldEnd, HeldFruit};
use crate::harvest::interface::{BenchWorld, FruitTruth};

/// Tracks the intervals in which detached fruit is held.
///
/// Within an attempt an interval continues over frames without contact of a finger if contact returns; it ends with the last frame
/// in which both pressed. The command of the first frame without contact decides if the fingers let go of the fruit or lost it.
#[derive(Debug, Default)]
pub(crate) struct HoldWatch {
    /// Detached fruit that has not settled.
    loose: Vec<u32>,
    /// Intervals, in the order of their begin.
    pub spells: Vec<HeldFruit>,
    /// Index of the first interval of the current attempt.
    present: usize,
}

impl HoldWatch {
    /// An attempt begins.
    pub fn begin_attempt(&mut self) {
        self.present = self.spells.len();
    }

    /// A fruit came off its stem; `gripped` if the fingers had closed on it during this attempt.
    pub fn detached(&mut self, fruit: u32, gripped: bool, frame: u32) {
        if !self.loose.contains(&fruit) {
            self.loose.push(fruit);
        }
        if gripped {
            self.begin(fruit, frame);
        }
    }

    fn begin(&mut self, fruit: u32, frame: u32) {
        self.spells.push(HeldFruit { fruit, from_frame: frame, to_frame: frame, end: HeldEnd::InHand });
    }

    /// Updates the intervals after a step; `opening` is the commanded opening of each finger \[m\].
    pub fn look(&mut self, world: &impl BenchWorld, opening: f64, frame: u32) {
        if self.loose.is_empty() {
            return;
        }
        let fruit = world.fruit();
        for id in self.loose.clone() {
            if let Some(truth) = fruit.get(id as usize) {
                self.look_at(id, truth, opening, frame);
            }
        }
        self.loose.retain(|&id| {
            let settled = [FruitState::Deposited, FruitState::Dropped];
            fruit.get(id as usize).is_some_and(|f| !settled.contains(&f.state))
        });
    }

    fn look_at(&mut self, id: u32, truth: &FruitTruth, opening: f64, frame: u32) {
        let held = truth.state == FruitState::Held;
        let present = self.present;
        let goes_on = |(i, spell): &(usize, &mut HeldFruit)| {
            spell.fruit == id && (*i >= present || spell.end == HeldEnd::InHand)
        };
        match self.spells.iter_mut().enumerate().rfind(goes_on).map(|(_, spell)| spell) {
            Some(spell) if held => {
                (spell.to_frame, spell.end) = (frame, HeldEnd::InHand);
            }
            _ if held => self.begin(id, frame),
            // In the frame of its detachment a fruit that had been gripped counts as held.
            Some(spell) if spell.end == HeldEnd::InHand && spell.to_frame < frame => {
                spell.end = if opening > truth.radius { HeldEnd::LetGo } else { HeldEnd::Lost };
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::FakeWorld;

    /// Spells as (from, to, end) of fruit 0, whose state after each frame from 5 on is given with the fingers' command; the fruit
    /// comes off at frame 5, gripped or not.
    fn spells(gripped: bool, frames: &[(FruitState, f64)]) -> Vec<(u32, u32, HeldEnd)> {
        let mut world = FakeWorld::new(1, 0);
        let mut watch = HoldWatch::default();
        watch.begin_attempt();
        watch.detached(0, gripped, 5);
        for (frame, (state, opening)) in (5..).zip(frames) {
            world.fruit[0].state = *state;
            watch.look(&world, *opening, frame);
        }
        watch.spells.iter().map(|s| (s.from_frame, s.to_frame, s.end)).collect()
    }

    /// Commanded openings: closed, and wider than the fruit of 30 mm.
    const CLOSED: f64 = 0.0;
    const OPEN: f64 = 0.04;

    #[test]
    fn a_fruit_is_let_go_or_lost_by_the_command() {
        use FruitState::{Deposited, Held, Loose};
        let carried = [(Held, CLOSED), (Held, CLOSED), (Held, CLOSED)];
        assert_eq!(spells(true, &carried), [(5, 7, HeldEnd::InHand)]);
        let lost = [&carried[..], &[(Loose, CLOSED), (Loose, OPEN)]].concat();
        assert_eq!(spells(true, &lost), [(5, 7, HeldEnd::Lost)]);
        let let_go = [&carried[..], &[(Held, OPEN), (Loose, OPEN), (Deposited, OPEN)]].concat();
        assert_eq!(spells(true, &let_go), [(5, 8, HeldEnd::LetGo)]);
        // A finger's contact flickers: one spell.
        let flicker = [&carried[..], &[(Loose, CLOSED), (Held, CLOSED), (Loose, OPEN)]].concat();
        assert_eq!(spells(true, &flicker), [(5, 9, HeldEnd::LetGo)]);
    }

    #[test]
    fn a_gripped_fruit_counts_as_held_when_it_comes_off() {
        use FruitState::{Held, Loose};
        assert_eq!(spells(true, &[(Loose, CLOSED), (Loose, CLOSED)]), [(5, 5, HeldEnd::Lost)]);
        assert_eq!(spells(false, &[(Loose, CLOSED), (Loose, CLOSED)]), []);
        // Caught in its fall.
        assert_eq!(spells(false, &[(Loose, CLOSED), (Held, CLOSED)]), [(6, 6, HeldEnd::InHand)]);
    }

    #[test]
    fn a_later_attempt_begins_a_spell_of_its_own() {
        let mut world = FakeWorld::new(1, 0);
        let mut watch = HoldWatch::default();
        watch.detached(0, true, 5);
        world.fruit[0].state = FruitState::Loose;
        watch.look(&world, CLOSED, 6);
        watch.begin_attempt();
        world.fruit[0].state = FruitState::Held;
        watch.look(&world, CLOSED, 9);
        let frames: Vec<(u32, HeldEnd)> = watch.spells.iter().map(|s| (s.from_frame, s.end)).collect();
        assert_eq!(frames, [(5, HeldEnd::Lost), (9, HeldEnd::InHand)]);
    }
}

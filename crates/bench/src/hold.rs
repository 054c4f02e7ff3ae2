//! Which fruit off its stem is between both fingers, from when to when, and how that ended.

use crate::episode::{HeldEnd, HeldFruit};
use crate::interface::{BenchWorld, FruitTruth};
use orchard_world::truth::FruitState;

/// Follows fruit that came off its stem in the hand.
///
/// Within an attempt a spell goes on through frames in which the contact of a finger flickers; it ends with the last frame in
/// which both pressed.
/// Whether the fingers let go or lost the fruit is told by the command of the first frame without.
#[derive(Debug, Default)]
pub(crate) struct HoldWatch {
    /// Fruit off its stem that has not settled.
    loose: Vec<u32>,
    /// Spells, in the order of their beginnings.
    pub spells: Vec<HeldFruit>,
    /// Spells from here on belong to the present attempt.
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

    /// Looks after a step whose command told each finger to open so far [m].
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

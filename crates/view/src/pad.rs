//! A gamepad: its sticks and buttons as a person's wish and as actions, whatever library reads it.

use orchard_play::Wish;

/// A stick or a trigger that is read as a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PadAxis {
    /// Left stick, to the right.
    LeftX,
    /// Left stick, up.
    LeftY,
    /// Right stick, to the right.
    RightX,
    /// Right stick, up.
    RightY,
}

/// A button by its place: south is A of an Xbox pad and the cross of a PlayStation pad.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PadButton {
    /// Lower of the four at the right.
    South,
    /// Right one of the four.
    East,
    /// Left one of the four.
    West,
    /// Upper of the four.
    North,
    /// Left shoulder.
    LeftShoulder,
    /// Right shoulder.
    RightShoulder,
    /// Left trigger.
    LeftTrigger,
    /// Right trigger.
    RightTrigger,
    /// Cross, to the left.
    Left,
    /// Cross, to the right.
    Right,
    /// Start, menu or options.
    Start,
    /// Select, view or share.
    Select,
}

/// A change at a gamepad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PadEvent {
    /// A stick moved to a place from -1 to 1.
    Axis(PadAxis, f64),
    /// A button was pressed, or let go.
    Button(PadButton, bool),
    /// It was unplugged: everything on it is let go.
    Gone,
}

/// An action that a button starts when it is pressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PadAction {
    /// Closes or opens the hand.
    Hand,
    /// Takes the robot over, or gives it back.
    TakeOver,
    /// Pauses or goes on.
    Pause,
    /// Begins a demonstration, or ends and keeps it.
    Demonstrate,
    /// The view moves with the robot, or stands.
    Follow,
}

/// Deflection of a stick that counts as none; what is beyond it begins at 0.
const DEAD: f64 = 0.15;

/// Places of the parts of a gamepad, with words for the help.
pub const PAD: [(&str, &str); 9] = [
    ("left stick", "base forward, back, left, right"),
    ("cross left, right", "base turns"),
    ("right stick", "hand forward, back, left, right"),
    ("triggers", "hand up (right), down (left)"),
    ("with a shoulder", "right stick and triggers turn the hand about its axes"),
    ("south (A, cross)", "close or open the hand"),
    ("start", "take the robot over, give it back"),
    ("north (Y, triangle), select", "pause; begin or keep a demonstration"),
    ("west (X, square)", "follow the robot"),
];

/// A gamepad as it is held now.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pad {
    /// Sticks: left right and up, right right and up.
    sticks: [f64; 4],
    held: std::collections::BTreeSet<PadButton>,
}

impl Pad {
    /// Takes an event; the action of a button that was pressed.
    pub fn take(&mut self, event: PadEvent) -> Option<PadAction> {
        match event {
            PadEvent::Axis(axis, at) => {
                self.sticks[axis as usize] = beyond_dead(at);
                None
            }
            PadEvent::Button(button, false) => {
                self.held.remove(&button);
                None
            }
            PadEvent::Button(button, true) if self.held.insert(button) => match button {
                PadButton::South => Some(PadAction::Hand),
                PadButton::Start => Some(PadAction::TakeOver),
                PadButton::North => Some(PadAction::Pause),
                PadButton::Select => Some(PadAction::Demonstrate),
                PadButton::West => Some(PadAction::Follow),
                _ => None,
            },
            PadEvent::Button(..) => None,
            PadEvent::Gone => {
                *self = Self::default();
                None
            }
        }
    }

    /// The wish of the person who holds it, on top of one of the keyboard: deflections add up, the hand is that of the keyboard's.
    pub fn over(&self, keys: Wish) -> Wish {
        let axis = |more: PadButton, less: PadButton| {
            f64::from(u8::from(self.held.contains(&more))) - f64::from(u8::from(self.held.contains(&less)))
        };
        let [left_x, left_y, right_x, right_y] = self.sticks;
        // A stick to the right is to the robot's right, which is negative.
        let base = [left_y, -left_x, axis(PadButton::Left, PadButton::Right)];
        let three = [right_y, -right_x, axis(PadButton::RightTrigger, PadButton::LeftTrigger)];
        let turns = [PadButton::LeftShoulder, PadButton::RightShoulder].iter().any(|b| self.held.contains(b));
        let (hand, turn) = if turns { ([0.0; 3], three) } else { (three, [0.0; 3]) };
        let sum = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| (a[k] + b[k]).clamp(-1.0, 1.0));
        Wish {
            base: sum(keys.base, base),
            hand: sum(keys.hand, hand),
            turn: sum(keys.turn, turn),
            closes: keys.closes,
        }
    }
}

/// A deflection without its dead part, from 0 at its edge to 1 at the end; what is no number is none.
fn beyond_dead(at: f64) -> f64 {
    if at.is_nan() {
        return 0.0;
    }
    let at = at.clamp(-1.0, 1.0);
    at.signum() * (at.abs() - DEAD).max(0.0) / (1.0 - DEAD)
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_play::{Jog, PlayRules};
    use orchard_scenario::Scenario;

    fn held(events: &[PadEvent]) -> Pad {
        let mut pad = Pad::default();
        for event in events {
            pad.take(*event);
        }
        pad
    }

    #[test]
    fn sticks_and_buttons_are_a_wish() {
        use PadAxis::{LeftX, LeftY, RightX};
        use PadButton::{Left, LeftShoulder, RightTrigger};
        let wish = held(&[
            PadEvent::Axis(LeftY, 1.0),
            PadEvent::Axis(LeftX, 0.1),
            PadEvent::Axis(RightX, -1.0),
            PadEvent::Button(RightTrigger, true),
            PadEvent::Button(Left, true),
        ])
        .over(Wish { closes: true, ..Wish::default() });
        assert_eq!((wish.base, wish.hand, wish.turn), ([1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0; 3]));
        assert!(wish.closes);
        let turned = held(&[PadEvent::Axis(RightX, -1.0), PadEvent::Button(LeftShoulder, true)]);
        assert_eq!(turned.over(Wish::default()).turn, [0.0, 1.0, 0.0]);
        // Half way beyond the dead part; the keyboard adds up to the end.
        let half =
            held(&[PadEvent::Axis(LeftY, 0.575)]).over(Wish { base: [0.8, 0.0, 0.0], ..Wish::default() });
        assert_eq!(half.base[0], 1.0);
        assert!((held(&[PadEvent::Axis(LeftY, 0.575)]).over(Wish::default()).base[0] - 0.5).abs() < 1e-12);
        assert_eq!(held(&[PadEvent::Axis(LeftY, f64::NAN)]).over(Wish::default()), Wish::default());
        assert_eq!(
            held(&[PadEvent::Axis(LeftY, 1.0), PadEvent::Gone]).over(Wish::default()),
            Wish::default()
        );
    }

    #[test]
    fn a_button_acts_once_when_it_is_pressed() {
        let mut pad = Pad::default();
        let south = |pressed| PadEvent::Button(PadButton::South, pressed);
        let told = [true, true, false, true].map(|pressed| pad.take(south(pressed)));
        assert_eq!(told, [Some(PadAction::Hand), None, None, Some(PadAction::Hand)]);
        assert_eq!(pad.take(PadEvent::Button(PadButton::Start, true)), Some(PadAction::TakeOver));
    }

    /// From the events of a gamepad to the command of the robot: the base drives forward at its speed, and the hand rises.
    #[test]
    fn events_move_the_robot() {
        let scenario = Scenario::of(&[]).unwrap();
        let world = scenario.world(20250704, 0, 0).unwrap();
        let rules = PlayRules::v1().jog;
        let (robot, frame) = (world.robot(), world.spec().sim.frame());
        let mut jog = Jog::begin(robot, &world.sense(), &rules);
        let before = jog.x_base_tcp();
        let pad =
            held(&[PadEvent::Axis(PadAxis::LeftY, 1.0), PadEvent::Button(PadButton::RightTrigger, true)]);
        jog.wish = pad.over(Wish::default());
        let commands: Vec<_> = (0..60).map(|_| jog.act(robot, frame)).collect();
        let last = commands.last().unwrap();
        assert_eq!(last.base_velocity, [rules.base_speed.si(), 0.0, 0.0]);
        let risen = jog.x_base_tcp().translation.vector.z - before.translation.vector.z;
        assert!(risen > 0.05 && last.arm_q != commands[0].arm_q, "{risen} m");
    }
}

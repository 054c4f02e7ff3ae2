//! Keys of the window.

use eframe::egui::{InputState, Key};
use orchard_play::{Overlay, Wish};

use crate::pad::PadAction;

/// What a key does once, when it is pressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Pauses or goes on.
    Pause,
    /// Pauses, and steps a frame.
    Step,
    /// Back to the start.
    Reset,
    /// The same scenario under the next seed.
    NextSeed,
    /// Takes the robot over, or gives it back.
    TakeOver,
    /// The view moves with the robot, or stands.
    Follow,
    /// The view of the start.
    Home,
    /// Faster.
    Faster,
    /// Slower.
    Slower,
    /// Grabs what is in the middle, or lets go.
    Grab,
    /// Closes or opens the hand.
    Hand,
    /// Begins a demonstration, or ends and keeps it.
    Demonstrate,
    /// Writes a picture.
    Screenshot,
    /// Switches an overlay.
    Switch(Overlay),
}

/// Keys of the actions other than overlays, with words for the help.
pub const ACTIONS: [(Key, Action, &str); 13] = [
    (Key::Space, Action::Pause, "pause, go on"),
    (Key::Period, Action::Step, "a single step"),
    (Key::Plus, Action::Faster, "faster"),
    (Key::Minus, Action::Slower, "slower"),
    (Key::R, Action::Reset, "back to the start"),
    (Key::N, Action::NextSeed, "next seed"),
    (Key::T, Action::TakeOver, "take the robot over, give it back"),
    (Key::C, Action::Hand, "close or open the hand"),
    (Key::G, Action::Grab, "grab what is in the middle, let go"),
    (Key::F, Action::Follow, "follow the robot"),
    (Key::H, Action::Home, "first view"),
    (Key::B, Action::Demonstrate, "begin a demonstration (--demos), end and keep it"),
    (Key::P, Action::Screenshot, "write a picture"),
];

/// Keys of the overlays, in their order.
pub const OVERLAYS: [Key; 12] = [
    Key::Num1,
    Key::Num2,
    Key::Num3,
    Key::Num4,
    Key::Num5,
    Key::Num6,
    Key::Num7,
    Key::Num8,
    Key::Num9,
    Key::Num0,
    Key::Z,
    Key::X,
];

/// Keys by which a person drives, with words for the help.
pub const DRIVING: [(&str, &str); 6] = [
    ("W S", "base forward, back"),
    ("A D", "base left, right"),
    ("Q E", "base turns left, right"),
    ("I K  J L", "hand forward, back, left, right"),
    ("U O", "hand up, down"),
    ("with Shift", "I K, J L, U O turn the hand about its axes"),
];

/// The actions of keys that were pressed.
pub fn actions(input: &InputState) -> Vec<Action> {
    if input.modifiers.command || input.modifiers.alt {
        return Vec::new();
    }
    let named = ACTIONS.iter().filter(|(key, ..)| input.key_pressed(*key)).map(|(_, action, _)| *action);
    // The key of `+` without Shift on many keyboards.
    let equals = input.key_pressed(Key::Equals).then_some(Action::Faster);
    let switched = OVERLAYS.iter().zip(Overlay::ALL).filter(|(key, _)| input.key_pressed(**key));
    named.chain(equals).chain(switched.map(|(_, overlay)| Action::Switch(overlay))).collect()
}

/// The action of a gamepad's button.
pub fn of_pad(action: PadAction) -> Action {
    match action {
        PadAction::Hand => Action::Hand,
        PadAction::TakeOver => Action::TakeOver,
        PadAction::Pause => Action::Pause,
        PadAction::Demonstrate => Action::Demonstrate,
        PadAction::Follow => Action::Follow,
    }
}

/// The wish of a person by the keys that are down, without the hand.
pub fn wish(input: &InputState) -> Wish {
    let axis = |more: Key, less: Key| {
        f64::from(u8::from(input.key_down(more))) - f64::from(u8::from(input.key_down(less)))
    };
    let base = [axis(Key::W, Key::S), axis(Key::A, Key::D), axis(Key::Q, Key::E)];
    let three = [axis(Key::I, Key::K), axis(Key::J, Key::L), axis(Key::U, Key::O)];
    let zero = [0.0; 3];
    let (hand, turn) = if input.modifiers.shift { (zero, three) } else { (three, zero) };
    Wish { base, hand, turn, closes: false }
}

/// Movement of the view by the arrow keys and Page Up, Page Down: turns to the right and up, and the zoom, each -1 to 1.
pub fn view(input: &InputState) -> [f64; 3] {
    let axis = |more: Key, less: Key| {
        f64::from(u8::from(input.key_down(more))) - f64::from(u8::from(input.key_down(less)))
    };
    [
        axis(Key::ArrowRight, Key::ArrowLeft),
        axis(Key::ArrowUp, Key::ArrowDown),
        axis(Key::PageDown, Key::PageUp),
    ]
}

//! The gamepad of this machine, through `gilrs`.

use gilrs::{Axis, Button, EventType, Gilrs};

use crate::pad::{PadAxis, PadButton, PadEvent};

/// Reads gamepads; none where the system has none or does not tell of them.
pub struct Gamepads(Option<Gilrs>);

impl Gamepads {
    /// Looks for gamepads, now and later.
    pub fn find() -> Self {
        Self(Gilrs::new().ok())
    }

    /// The events since the last time, of all gamepads.
    pub fn events(&mut self) -> Vec<PadEvent> {
        let Some(gilrs) = &mut self.0 else { return Vec::new() };
        std::iter::from_fn(|| gilrs.next_event()).filter_map(|event| told(event.event)).collect()
    }
}

fn told(event: EventType) -> Option<PadEvent> {
    match event {
        EventType::AxisChanged(axis, at, _) => Some(PadEvent::Axis(axis_of(axis)?, f64::from(at))),
        EventType::ButtonPressed(button, _) => Some(PadEvent::Button(button_of(button)?, true)),
        EventType::ButtonReleased(button, _) => Some(PadEvent::Button(button_of(button)?, false)),
        EventType::Disconnected => Some(PadEvent::Gone),
        _ => None,
    }
}

fn axis_of(axis: Axis) -> Option<PadAxis> {
    Some(match axis {
        Axis::LeftStickX => PadAxis::LeftX,
        Axis::LeftStickY => PadAxis::LeftY,
        Axis::RightStickX => PadAxis::RightX,
        Axis::RightStickY => PadAxis::RightY,
        _ => return None,
    })
}

/// `gilrs` calls the shoulders triggers and the triggers second triggers.
fn button_of(button: Button) -> Option<PadButton> {
    Some(match button {
        Button::South => PadButton::South,
        Button::East => PadButton::East,
        Button::West => PadButton::West,
        Button::North => PadButton::North,
        Button::LeftTrigger => PadButton::LeftShoulder,
        Button::RightTrigger => PadButton::RightShoulder,
        Button::LeftTrigger2 => PadButton::LeftTrigger,
        Button::RightTrigger2 => PadButton::RightTrigger,
        Button::DPadLeft => PadButton::Left,
        Button::DPadRight => PadButton::Right,
        Button::Start => PadButton::Start,
        Button::Select => PadButton::Select,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sticks_and_buttons_have_their_places() {
        assert_eq!(axis_of(Axis::RightStickY), Some(PadAxis::RightY));
        assert_eq!(axis_of(Axis::LeftZ), None);
        assert_eq!(button_of(Button::LeftTrigger), Some(PadButton::LeftShoulder));
        assert_eq!(button_of(Button::RightTrigger2), Some(PadButton::RightTrigger));
        assert_eq!(told(EventType::Disconnected), Some(PadEvent::Gone));
    }
}

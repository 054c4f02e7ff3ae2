//! Those who watch every frame of a stage.

use orchard_play::Sight;
use orchard_world::{World, WorldEvent};

/// Watches the frames of a stage, and changes nothing.
pub trait Audience {
    /// Another world is on show, or the same one at another moment.
    fn begin(&mut self, world: &World);

    /// A frame is about to be stepped under a command.
    fn before(&mut self, world: &World, sight: &Sight<'_>);

    /// It was stepped, with these events.
    fn after(&mut self, world: &World, events: &[WorldEvent]);
}

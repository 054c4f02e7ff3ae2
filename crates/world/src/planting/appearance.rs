//! The colours of one tree.

use orchard_camera::{Item, Label, NO_INSTANCE, Tint};

/// Changes of the palette's colours; `None` leaves them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Appearance {
    /// Bark.
    pub wood: Option<Tint>,
    /// Leaves.
    pub leaf: Option<Tint>,
    /// Apples.
    pub fruit: Option<Tint>,
}

impl Appearance {
    /// Colours the tree among the items of a scene: segments, leaves and fruit. Stems and other items without a number keep the palette's.
    pub fn paint(&self, items: &mut [Item]) {
        for item in items.iter_mut().filter(|item| item.instance != NO_INSTANCE) {
            item.tint = match item.label {
                Label::Wood => self.wood,
                Label::Leaf => self.leaf,
                Label::Fruit => self.fruit,
                Label::None | Label::Robot | Label::Ground | Label::Scenery => item.tint,
            };
        }
    }
}

//! Overlays: what is drawn or told besides the world itself, each a switch.

use std::collections::BTreeSet;

/// An overlay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Overlay {
    /// Leaves of the tree.
    Leaves,
    /// Depth image of the wrist camera.
    Depth,
    /// Colour picture of the wrist camera, drawn anew with each depth image.
    Colour,
    /// Spheres that the detector found in the latest image, with their scores.
    Detections,
    /// The controller's state, its target, the pose that it commands, and its log.
    Plan,
    /// Contact forces as arrows.
    Contacts,
    /// Bending moment over rupture moment as the colour of wood.
    Moments,
    /// The arm's reach sphere.
    Reach,
    /// Axes of world, base, hand and camera.
    Frames,
    /// Plots of contact force and fruit.
    Plots,
    /// Canopy zones of the benchmark's metrics.
    Zones,
    /// Load of each stem over its strength.
    Stems,
}

impl Overlay {
    /// All overlays, in the order of their keys: 1 to 9, 0, Z and X.
    pub const ALL: [Self; 12] = [
        Self::Leaves,
        Self::Depth,
        Self::Colour,
        Self::Detections,
        Self::Plan,
        Self::Contacts,
        Self::Moments,
        Self::Reach,
        Self::Frames,
        Self::Plots,
        Self::Zones,
        Self::Stems,
    ];

    /// Name on the command line and in the window.
    pub fn name(self) -> &'static str {
        match self {
            Self::Leaves => "leaves",
            Self::Depth => "depth",
            Self::Colour => "colour",
            Self::Detections => "detections",
            Self::Plan => "plan",
            Self::Contacts => "contacts",
            Self::Moments => "moments",
            Self::Reach => "reach",
            Self::Frames => "frames",
            Self::Plots => "plots",
            Self::Zones => "zones",
            Self::Stems => "stems",
        }
    }

    /// One line for a person who rests the pointer on the switch.
    pub fn help(self) -> &'static str {
        match self {
            Self::Leaves => "leaves of the tree",
            Self::Depth => "depth image of the wrist camera, bright is near",
            Self::Colour => "colour picture of the wrist camera; it takes time to draw",
            Self::Detections => {
                "spheres that the detector finds in the latest image, with scores; it runs beside the controller's"
            }
            Self::Plan => "the controller's state, target, commanded pose and log",
            Self::Contacts => "contact forces as arrows, 1 m for 100 N",
            Self::Moments => "bending moment over rupture moment as the colour of wood",
            Self::Reach => "the arm's reach sphere",
            Self::Frames => "axes of world, base, hand and camera: x orange, y green, z blue",
            Self::Plots => "contact force and fruit over time",
            Self::Zones => {
                "canopy zones of the metrics: fruit blue in the lower third, green in the middle, red in the upper; dense inside the rings"
            }
            Self::Stems => "load of each stem over its strength as the colour of a line along it",
        }
    }
}

/// The overlays that are on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Overlays(BTreeSet<Overlay>);

impl Default for Overlays {
    fn default() -> Self {
        use Overlay::{Depth, Leaves, Plan, Plots};
        Self([Leaves, Depth, Plan, Plots].into())
    }
}

impl Overlays {
    /// Reads names with commas between; `none` and `all` stand alone.
    ///
    /// # Errors
    /// An unknown name; the message lists all.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "none" => return Ok(Self(BTreeSet::new())),
            "all" => return Ok(Self(Overlay::ALL.into())),
            _ => {}
        }
        let named = |name: &str| {
            Overlay::ALL.into_iter().find(|overlay| overlay.name() == name.trim()).ok_or_else(|| {
                let names = Overlay::ALL.map(Overlay::name).join(", ");
                format!("overlay `{}` is unknown; the overlays are: {names}; or all, or none", name.trim())
            })
        };
        text.split(',').map(named).collect::<Result<_, _>>().map(Self)
    }

    /// True if an overlay is on.
    pub fn has(&self, overlay: Overlay) -> bool {
        self.0.contains(&overlay)
    }

    /// Switches an overlay.
    pub fn switch(&mut self, overlay: Overlay) {
        if !self.0.remove(&overlay) {
            self.0.insert(overlay);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_unknown_ones_told() {
        let some = Overlays::parse("depth, moments").unwrap();
        assert!(some.has(Overlay::Depth) && some.has(Overlay::Moments) && !some.has(Overlay::Leaves));
        assert!(Overlay::ALL.iter().all(|o| Overlays::parse("all").unwrap().has(*o)));
        assert!(Overlay::ALL.iter().all(|o| !Overlays::parse("none").unwrap().has(*o)));
        assert!(Overlay::ALL.iter().all(|o| Overlays::parse(o.name()).unwrap().has(*o)));
        for bad in ["", "depths", "depth,,plan", "depth,all"] {
            let e = Overlays::parse(bad).unwrap_err();
            assert!(e.contains("is unknown; the overlays are: leaves, depth"), "{e}");
        }
        let mut overlays = Overlays::default();
        overlays.switch(Overlay::Leaves);
        overlays.switch(Overlay::Reach);
        assert!(!overlays.has(Overlay::Leaves) && overlays.has(Overlay::Reach));
    }
}

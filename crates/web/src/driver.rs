//! Who commands the robot.

use orchard_picker::Kind;

/// Who commands the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driver {
    /// A controller.
    Controller(Kind),
    /// No controller drives: the robot stands as it started.
    Nobody,
}

impl Driver {
    /// All drivers, the best controller first.
    pub const ALL: [Self; 4] = [
        Self::Controller(Kind::Expert),
        Self::Controller(Kind::Baseline),
        Self::Controller(Kind::Paper),
        Self::Nobody,
    ];

    /// Name of the driver.
    pub fn name(self) -> &'static str {
        match self {
            Self::Controller(kind) => kind.name(),
            Self::Nobody => "nobody",
        }
    }

    /// The driver of a name; `None` if there is none.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|driver| driver.name() == name)
    }
}

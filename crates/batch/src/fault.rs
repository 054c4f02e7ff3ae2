//! Faults of a batch's worlds, and their quarantine.

/// Part of a world that is no longer a finite number, or whose square overflows f32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Fault {
    /// Angles or rates of a joint: of the first segment, since one joint takes the whole tree along.
    #[error("the state of the joint at the base of segment {segment} is not finite")]
    Joint {
        /// Segment.
        segment: usize,
    },
    /// Motion of a fruit, while all joints are finite.
    #[error("the motion of fruit {fruit} is not finite")]
    Fruit {
        /// Index of the fruit.
        fruit: usize,
    },
    /// Coordinate or velocity of a robot.
    #[error("degree of freedom {dof} of the robot is not finite")]
    Robot {
        /// Degree of freedom.
        dof: usize,
    },
    /// A command.
    #[error("a command of the robot is not finite")]
    Command,
}

/// Time and reason at which a world of a batch was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quarantine {
    /// Frame at whose end it was found, from 1.
    pub frame: u32,
    /// Fault found.
    pub fault: Fault,
}

/// State of a world of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// It runs.
    Running,
    /// Something became non-finite; the world stands still from then on.
    Quarantined(Quarantine),
}

//! Options of a run that are no part of its plan.

/// Options of a run that are no part of its plan.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// Episodes of the harvest are recorded.
    pub record: bool,
    /// Episodes that advance together on a graphics device.
    pub lanes: Option<usize>,
    /// Threads.
    pub threads: usize,
}

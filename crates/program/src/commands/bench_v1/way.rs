//! Ways of a run that change no result on a processor.

/// How tasks are to be run.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// Episodes of the harvest are recorded.
    pub record: bool,
    /// Episodes that advance together on a graphics device.
    pub lanes: Option<usize>,
    /// Threads.
    pub threads: usize,
}

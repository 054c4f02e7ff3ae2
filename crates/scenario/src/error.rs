//! Error of a scenario that cannot be resolved.

/// An option that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{by}: {problem}")]
pub struct ScenarioError {
    /// The option, or file and field, that gave the value.
    pub by: String,
    /// Problem: the value, and the values that are allowed.
    pub problem: String,
}

impl ScenarioError {
    /// Builds the error for an option from its source and the problem.
    pub fn new(by: impl Into<String>, problem: impl ToString) -> Self {
        Self { by: by.into(), problem: problem.to_string() }
    }
}

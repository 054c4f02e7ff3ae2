//! State, inputs and scratch of one world.

/// State, the inputs of the next step, and scratch of one world.
#[derive(Debug, Clone)]
pub struct Data {}

//! A grown tree as a compliant, breakable articulation.

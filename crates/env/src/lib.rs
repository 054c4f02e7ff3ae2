//! Reset, step, observe and act over many worlds.

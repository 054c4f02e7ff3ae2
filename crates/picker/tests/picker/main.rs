//! The controllers in a simple test orchard.

mod commands;
mod cycle;
mod fake;

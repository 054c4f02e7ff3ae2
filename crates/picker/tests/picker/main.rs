//! The controllers in a made-up orchard.

mod commands;
mod cycle;
mod fake;

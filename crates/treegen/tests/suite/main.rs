//! Tests of `orchard-treegen` from outside, in one binary: a folder or file a subject.

mod annual_shoots;
mod common;
mod config_space;
mod grown_trees;
mod habits;
mod trained_trees;

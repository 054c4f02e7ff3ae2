//! Tests of `orchard-perception` from outside, in one binary: a folder or file a subject.

mod bad_input;
mod common;
mod gates;
mod spheres;

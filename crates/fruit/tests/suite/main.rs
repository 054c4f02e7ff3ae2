//! Tests of `orchard-fruit` from outside, in one binary: a folder or file a subject.

mod bent_stem;
mod clusters;
mod placement;
mod stem;

//! Tests of `orchard-fruit` from outside, in one binary: a folder or file a subject.

mod placement;
mod stem;

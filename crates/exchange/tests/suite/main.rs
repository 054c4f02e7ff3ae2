//! Tests of `orchard-exchange` from outside, in one binary: a folder or file a subject.

mod mjcf;
mod mtg;
mod round_trips;

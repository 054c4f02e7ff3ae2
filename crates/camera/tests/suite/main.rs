//! Tests of `orchard-camera` from outside, in one binary: a folder or file a subject.

mod brute_force;
mod common;
mod detector;
mod images;
mod light;
#[path = "common/ray_cast.rs"]
mod ray_cast;
mod real_cameras;
#[path = "common/score.rs"]
mod score;
#[path = "common/shapes.rs"]
mod shapes;

use common::direction;

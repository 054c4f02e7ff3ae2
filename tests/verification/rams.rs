//! The robot driven into trees: what it meets bends, breaks or stops it.

use orchard_geometry::Vec3;
use orchard_multibody::Owner;
use orchard_robot::{RobotConfig, RobotModel};
use orchard_spec::Spec;
use orchard_world::{Status, World};
use rayon::prelude::*;
use std::sync::Arc;

/// The world with one substep a frame, so that every substep is seen; what counts frames counts as before.
fn world(robot: &RobotModel, seed: u64) -> World {
    let mut spec = Spec::paper();
    let substeps = spec.sim.substeps.get();
    let rate = spec.sim.frame_rate.value() * f64::from(substeps);
    spec.sim.frame_rate = spec.sim.frame_rate.with_value(rate).unwrap();
    spec.sim.substeps = spec.sim.substeps.with_value(1).unwrap();
    let frames = &mut spec.wood.rupture_frames;
    *frames = frames.with_value(frames.get() * substeps).unwrap();
    World::new(Arc::new(spec), Arc::new(robot.clone()), seed, 0).unwrap()
}

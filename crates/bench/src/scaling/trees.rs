//! The worlds that are timed.

use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_spec::randomisation::{Axis, Mode};
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_world::Planting;
use rayon::prelude::*;

use super::plan::ScalingPlan;

/// The preset `randomised` in a mode, with all fruit of every tree: as the paper, which hides fruit and keeps their bodies.
pub fn spec_of(mode: Mode) -> Spec {
    let mut spec = Spec::preset(Preset::Randomised);
    spec.randomisation.mode = mode;
    let dial = spec.randomisation.strength_mut(Axis::FruitVisible);
    if let Ok(off) = dial.with_value(0.0) {
        *dial = off;
    }
    spec
}

/// The first `count` worlds of a mode at rest, then kicked: every joint at a rate of its own. Equal worlds share their model.
pub fn worlds(plan: &ScalingPlan, mode: Mode, count: u32) -> Result<Vec<TreeWorld>, String> {
    let spec = Arc::new(spec_of(mode));
    let built = |index: u32| -> Result<TreeWorld, String> {
        let Planting { spec, skeleton, fruit, .. } =
            Planting::draw(&spec, plan.seed, index, 0).map_err(|e| e.to_string())?;
        TreeWorld::new(spec, &skeleton, fruit).map_err(|e| e.to_string())
    };
    let first = built(0)?;
    (0..count)
        .into_par_iter()
        .map(|index| {
            let shares = index == 0 || mode == Mode::Homogeneous;
            let mut world = if shares { first.clone() } else { built(index)? };
            let mut stream = Stream::new(plan.seed, index, Purpose::ScalingKick);
            for v in &mut world.data_mut().v {
                *v = stream.uniform(-plan.kick, plan.kick);
            }
            Ok(world)
        })
        .collect()
}

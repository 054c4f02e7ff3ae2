//! The worlds that are timed.

use std::sync::Arc;
use std::time::Instant;

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
    switch_off(&mut spec, Axis::FruitVisible);
    spec
}

/// Takes an axis out of the randomisation.
pub fn switch_off(spec: &mut Spec, axis: Axis) {
    let dial = spec.randomisation.strength_mut(axis);
    if let Ok(off) = dial.with_value(0.0) {
        *dial = off;
    }
}

/// A world of a spec, at rest.
pub fn settled(spec: &Arc<Spec>, seed: u64, index: u32) -> Result<TreeWorld, String> {
    let Planting { spec, skeleton, fruit, .. } =
        Planting::draw(spec, seed, index, 0).map_err(|e| e.to_string())?;
    TreeWorld::new(spec, &skeleton, fruit).map_err(|e| e.to_string())
}

/// The worlds of a mode, each grown at rest, then kicked: every joint at a rate of its own. Equal worlds share their model, and
/// those beyond the plan's kinds repeat the plants of the first.
pub struct Forest<'a> {
    plan: &'a ScalingPlan,
    mode: Mode,
    spec: Arc<Spec>,
    worlds: Vec<TreeWorld>,
    /// Time that growing them has taken so far [s].
    pub grow_s: f64,
}

impl<'a> Forest<'a> {
    /// None of them yet.
    pub fn new(plan: &'a ScalingPlan, mode: Mode) -> Self {
        Self { plan, mode, spec: Arc::new(spec_of(mode)), worlds: Vec::new(), grow_s: 0.0 }
    }

    /// Grows the first `count` worlds, as far as they are not there.
    pub fn grow(&mut self, count: u32) -> Result<(), String> {
        let start = Instant::now();
        let grown = (if self.mode == Mode::Homogeneous { 1 } else { self.plan.kinds }).min(count);
        if self.worlds.is_empty() {
            self.worlds.push(self.kicked(settled(&self.spec, self.plan.seed, 0)?, 0));
        }
        let more = self.further(grown, |index| settled(&self.spec, self.plan.seed, index))?;
        self.worlds.extend(more);
        let more = self.further(count, |index| Ok(self.worlds[(index % grown) as usize].clone()))?;
        self.worlds.extend(more);
        self.grow_s += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Those that are there.
    pub fn worlds(&self) -> &[TreeWorld] {
        &self.worlds
    }

    /// The worlds from the next one on, up to `count` in all.
    fn further(
        &self,
        count: u32,
        world: impl Fn(u32) -> Result<TreeWorld, String> + Sync,
    ) -> Result<Vec<TreeWorld>, String> {
        let indices = (self.worlds.len() as u32..count).into_par_iter();
        indices.map(|index| Ok(self.kicked(world(index)?, index))).collect()
    }

    fn kicked(&self, mut world: TreeWorld, index: u32) -> TreeWorld {
        let mut stream = Stream::new(self.plan.seed, index, Purpose::ScalingKick);
        for v in &mut world.data_mut().v {
            *v = stream.uniform(-self.plan.kick, self.plan.kick);
        }
        world
    }
}

/// The first `count` worlds of a mode.
pub fn worlds(plan: &ScalingPlan, mode: Mode, count: u32) -> Result<Vec<TreeWorld>, String> {
    let mut forest = Forest::new(plan, mode);
    forest.grow(count)?;
    Ok(forest.worlds)
}

//! The worlds that are timed.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use orchard_batch::TreeWorld;
use orchard_spec::randomisation::{Axis, Mode};
use orchard_spec::{Purpose, Spec, Stream};
use orchard_world::Planting;
use rayon::prelude::*;

use crate::plan::ScalingPlan;

/// Config of a mode with all fruit of every tree present. (The paper hides fruit but keeps their bodies.)
pub fn spec_of(plan: &ScalingPlan, mode: Mode) -> Spec {
    let mut spec = Spec::clone(&plan.spec);
    spec.randomisation.mode = mode;
    switch_off(&mut spec, Axis::FruitVisible);
    spec
}

/// Switches off an axis of the randomisation.
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
    TreeWorld::drawn(spec, &skeleton, fruit, seed, index).map_err(|e| e.to_string())
}

/// Worlds of a batch, built on request, so that not all of them are in memory at once.
#[derive(Clone, Copy)]
pub struct Worlds<'a> {
    /// Number of worlds.
    pub count: u32,
    /// Builds the world of an index.
    pub world: &'a (dyn Fn(u32) -> TreeWorld + Sync),
}

impl Worlds<'_> {
    /// Builds the worlds of a range of indices.
    pub fn range(&self, range: Range<u32>) -> Vec<TreeWorld> {
        range.into_par_iter().map(self.world).collect()
    }

    /// Builds all worlds.
    pub fn all(&self) -> Vec<TreeWorld> {
        self.range(0..self.count)
    }
}

/// The worlds of a mode, grown and settled, then kicked: every joint gets a random rate. Equal worlds share their model; worlds beyond
/// the plan's number of different trees repeat the trees.
pub struct Forest<'a> {
    plan: &'a ScalingPlan,
    mode: Mode,
    spec: Arc<Spec>,
    /// Worlds with different trees, at rest.
    kinds: Vec<TreeWorld>,
    /// Time that growing them has taken so far \[s\].
    pub grow_s: f64,
}

impl<'a> Forest<'a> {
    /// Makes an empty forest.
    pub fn new(plan: &'a ScalingPlan, mode: Mode) -> Self {
        Self { plan, mode, spec: Arc::new(spec_of(plan, mode)), kinds: Vec::new(), grow_s: 0.0 }
    }

    /// Grows the missing trees of the first `count` worlds.
    pub fn grow(&mut self, count: u32) -> Result<(), String> {
        let start = Instant::now();
        let kinds = if self.mode == Mode::Homogeneous { 1 } else { self.plan.kinds }.min(count);
        let further = (self.kinds.len() as u32..kinds).into_par_iter();
        let further: Vec<TreeWorld> =
            further.map(|index| settled(&self.spec, self.plan.seed, index)).collect::<Result<_, _>>()?;
        self.kinds.extend(further);
        self.grow_s += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// A kicked world; its tree must have been grown.
    pub fn world(&self, index: u32) -> TreeWorld {
        self.kicked(self.kind(index).clone(), index)
    }

    /// Mean of a number over the first worlds.
    pub fn mean(&self, count: u32, of: fn(&TreeWorld) -> usize) -> f64 {
        (0..count).map(|index| of(self.kind(index))).sum::<usize>() as f64 / f64::from(count)
    }

    fn kind(&self, index: u32) -> &TreeWorld {
        &self.kinds[index as usize % self.kinds.len()]
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
    if forest.kinds.len() < count as usize {
        return Ok(Worlds { count, world: &|index| forest.world(index) }.all());
    }
    // Worlds are never copied, because the growth of the process is measured.
    let kinds = std::mem::take(&mut forest.kinds);
    Ok(kinds.into_iter().zip(0..).map(|(world, index)| forest.kicked(world, index)).collect())
}

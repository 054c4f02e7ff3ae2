//! What a graphics device leaves out.

use std::sync::Arc;

use orchard_spec::Spec;

/// Tables of a spec that [`simplified`] drops: on a device fruit are points on tethers, and the air is still.
pub fn left_out(spec: &Spec) -> Vec<&'static str> {
    let blows = spec.wind.as_ref().is_some_and(|wind| wind.speed.si() > 0.0);
    let tables = [("fruit.stem", spec.fruit.stem.is_some()), ("wind", blows)];
    tables.into_iter().filter(|(_, is_there)| *is_there).map(|(name, _)| name).collect()
}

/// The spec without what [`left_out`] names. A batch refuses worlds that have it, so that nothing is dropped unseen.
pub fn simplified(mut spec: Arc<Spec>) -> Arc<Spec> {
    if !left_out(&spec).is_empty() {
        let fruit = spec.fruit.on_tethers();
        let changed = Arc::make_mut(&mut spec);
        (changed.fruit, changed.wind) = (fruit, None);
    }
    spec
}

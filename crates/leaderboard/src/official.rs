//! The plan that a submission must contain.

use orchard_tasks::harvest::Extent;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::SeedSetName;

/// The official matrix: every condition of the full profile on a whole seed set, as `bench-v1` or `bench-field --profile full --seeds SET` runs it.
/// `None` for custom seeds and the set of another benchmark.
pub fn official(protocol: &Protocol, seed_set: SeedSetName) -> Option<Extent> {
    let (set, full) = (protocol.official_set(), &protocol.full);
    let (seeds, trees, repeats) = match seed_set {
        name if name == protocol.official => (protocol.official_seeds(), set.trees.get(), set.repeats.get()),
        SeedSetName::Tuning => (protocol.tuning_seeds.clone(), full.trees.get(), 1),
        _ => return None,
    };
    let conditions = full.conditions.clone();
    Some(Extent {
        profile: "full".to_owned(),
        conditions,
        seeds,
        trees,
        repeats,
        horizon_s: full.horizon.si(),
    })
}

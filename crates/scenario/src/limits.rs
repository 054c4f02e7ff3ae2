//! Limits of a resolved scenario that hold whatever its files say.

use std::sync::OnceLock;

use orchard_perception::DetectorConfig;
use orchard_quantity::CountLimits;
use orchard_spec::camera::CameraSpec;
use orchard_spec::{Preset, Spec};

/// Most leaves on an internode, our own choice: five times as many as a shoot bears. A tree of preset `paper` with so many took 14 MiB,
/// written as JSON (measured).
const MOST_LEAVES: u32 = 50;

/// Returns the first count of a world that is too large: its path and the problem.
pub(crate) fn of_world(spec: &Spec) -> Option<(String, String)> {
    static LIMITS: OnceLock<CountLimits> = OnceLock::new();
    let limits = LIMITS.get_or_init(|| {
        let presets = Preset::ALL.iter().map(|&preset| Spec::preset(preset));
        let named = |name| CameraSpec::named(name).unwrap_or_else(|e| unreachable!("embedded camera: {e}"));
        let cameras = CameraSpec::FILES.iter().map(|(name, _)| Spec { camera: named(name), ..Spec::paper() });
        CountLimits::of(&presets.chain(cameras).collect::<Vec<_>>())
    });
    let leaves = spec.foliage.leaves_per_internode();
    let too_many = (leaves > MOST_LEAVES).then(|| {
        let problem = format!(
            "{leaves} leaves an internode are more than {MOST_LEAVES}, the most that this program takes"
        );
        ("foliage".to_owned(), problem)
    });
    limits.problem(spec).or(too_many)
}

/// Returns the first count of a detector that is too large: its path and the problem.
pub(crate) fn of_detector(config: &DetectorConfig) -> Option<(String, String)> {
    static LIMITS: OnceLock<CountLimits> = OnceLock::new();
    let limits = LIMITS.get_or_init(|| {
        let named =
            |name| DetectorConfig::named(name).unwrap_or_else(|e| unreachable!("embedded detector: {e}"));
        CountLimits::of(&DetectorConfig::FILES.iter().map(|(name, _)| named(name)).collect::<Vec<_>>())
    });
    limits.problem(config)
}

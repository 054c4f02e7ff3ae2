//! Demonstrations whose worlds a graphics device moves.

use orchard_bench::store::Store;
use orchard_demos::{DemosResult, Plan};

use crate::failure::Failure;

/// Demonstrates a plan with up to so many episodes at once on a device; `threads` compute beside it.
#[cfg(feature = "gpu")]
pub fn demonstrate(
    plan: &Plan,
    store: &Store,
    lanes: Option<u32>,
    threads: usize,
) -> Result<DemosResult, Failure> {
    use crate::commands::bench_v1::task::lost_device;
    use crate::commands::bench_v1::together::{LANES, open_berths, say_where};

    let lanes = lanes.map_or(LANES, |lanes| lanes as usize).min(plan.episodes() as usize);
    let berths = open_berths("demonstrations", &[plan.share()], lanes, threads)?;
    let done = super::watched(plan, store, threads, |session, bar| {
        orchard_demos::run_in_berths(plan, session, &berths, bar)
    });
    if let Some(why) = berths.lost() {
        return Err(Failure::Failed(lost_device(&why)));
    }
    say_where(&berths);
    done
}

/// Tells that there is no device.
#[cfg(not(feature = "gpu"))]
pub fn demonstrate(_: &Plan, _: &Store, _: Option<u32>, _: usize) -> Result<DemosResult, Failure> {
    Err(Failure::BadInput("--backend gpu: this program was built without the feature `gpu`".to_owned()))
}

//! The benchmark on its own worlds, for a moment: whole files, the same bytes for any number of threads.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::harvest::Harvest;
use orchard_bench::store::Store;
use orchard_bench::{RunResult, Silent, run};

fn go(folder: &Path, threads: usize) -> RunResult {
    let harvest = Harvest::paper();
    let plan = harvest.plan("quick", vec![20250704, 11], 1, 1.5);
    let store = Store::open(folder).unwrap();
    run(&plan, &harvest, &store, threads, &AtomicBool::new(false), &Silent).unwrap()
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    ["summary.json", "episodes/nominal-20250704-000.json", "episodes/nominal-11-000.json"]
        .iter()
        .map(|name| ((*name).to_owned(), fs::read(folder.join(name)).unwrap()))
        .collect()
}

#[test]
fn same_bytes_for_one_thread_and_two() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let result = go(folders[0].path(), 1);
    go(folders[1].path(), 2);
    assert_eq!(files(folders[0].path()), files(folders[1].path()));

    // The condition is the nominal one, and the detector has looked.
    let params = &result.summary.conditions["nominal"].params;
    assert_eq!((params.fruit_count, params.foliage_density, params.terrain_amplitude_m), (40, 0.6, 0.0));
    for episode in &result.episodes {
        assert_eq!(episode.frames, 90);
        assert!(episode.reachable_count > 0 && episode.reachable_count <= episode.fruit_total);
        assert!(episode.detection.images > 0);
        assert_ne!(episode.fruit[0].p_world, [0.0; 3]);
    }
    assert_ne!(result.episodes[0].fruit, result.episodes[1].fruit);
}

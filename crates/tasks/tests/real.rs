//! The benchmark on its own worlds, for a moment: whole files, the same bytes for any number of threads.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::store::Store;
use orchard_bench::{NoProgress, Session};
use orchard_camera::{Item, Label};
use orchard_scenario::Scenario;
use orchard_tasks::detect::{RestingTree, Trees};
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::{RunResult, run};
use orchard_tasks::protocol::Protocol;
use orchard_tasks::vantage::vantages;

fn go(folder: &Path, threads: usize) -> RunResult {
    let harvest = Harvest::new(Scenario::of(&[]).unwrap()).unwrap();
    let plan = harvest.plan("quick", vec![20250704, 11], 1, 1.5);
    let store = Store::open(folder).unwrap();
    run(&plan, &harvest, &Session::whole(&store, threads, &AtomicBool::new(false)), &NoProgress).unwrap()
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    ["summary.json", "episodes/baseline-nominal-20250704-000.json", "episodes/baseline-nominal-11-000.json"]
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

    // The condition is the nominal one, and the detector has evaluated images.
    let dials = result.summary.as_ref().unwrap().conditions["nominal"].params.dials;
    assert_eq!((dials.fruit_count, dials.foliage_density, dials.terrain_amplitude_m), (40, 0.6, 0.0));
    for episode in &result.records {
        assert_eq!(episode.frames, 90);
        assert!(episode.reachable_count > 0 && episode.reachable_count <= episode.fruit_total);
        assert!(episode.detection.images > 0);
        assert_ne!(episode.fruit[0].p_world, [0.0; 3]);
    }
    assert_ne!(result.records[0].fruit, result.records[1].fruit);
}

/// Two frames of two real worlds: every fault at every operation of the store.
#[test]
fn a_harvest_survives_every_fault() {
    let harvest = Harvest::new(Scenario::of(&[]).unwrap()).unwrap();
    let plan = harvest.plan("quick", vec![20250704, 11], 1, 2.0 / 60.0);
    let scenario = orchard_bench::sweep::Scenario {
        prepare: &|_| (),
        run: &|folder: &Path| -> Result<(), String> {
            let store = Store::open(folder).map_err(|e| e.to_string())?;
            let _lock = store.lock().map_err(|e| e.to_string())?;
            let stop = AtomicBool::new(false);
            let session = Session::whole(&store, 1, &stop);
            run(&plan, &harvest, &session, &NoProgress).map(drop).map_err(|e| e.to_string())
        },
        last: &["summary.json"],
        derived: &[],
        timed: &["compute.json"],
    };
    // Two folders, an old summary removed; begin, write and name two records, the cost and the summary.
    assert_eq!(scenario.sweep(), 3 + 3 * 4);
}

/// The foliage dial changes nothing but leaves: wood, fruit, ground and views are the same bits at every density.
#[test]
fn trees_of_the_detection_task_are_paired() {
    let protocol = Protocol::paper();
    let rules = &protocol.detect;
    let trees = Scenario::of(&[]).unwrap();
    let tree = |foliage| trees.tree(20250704, 1, foliage).unwrap();
    let solids = |tree: &RestingTree| -> Vec<Item> {
        let kept = |item: &&Item| item.label != Label::Leaf;
        tree.scene.items.iter().filter(kept).cloned().collect()
    };
    let views = |tree: &RestingTree| vantages(&rules.vantage, &tree.scene, 20250704, 1, 8);
    let bare = tree(0.0);
    assert!(solids(&bare).iter().all(|item| item.label != Label::Robot));
    assert_eq!(solids(&bare).len(), bare.scene.items.len());
    let mut leaves = 0;
    for foliage in protocol.densities().into_iter().skip(1) {
        let tree = tree(foliage);
        assert_eq!(solids(&tree), solids(&bare));
        assert_eq!(
            (&tree.fruit, &tree.reachable, views(&tree)),
            (&bare.fruit, &bare.reachable, views(&bare))
        );
        let more = tree.scene.items.len() - bare.scene.items.len();
        assert!(more > leaves, "{foliage}: {more} leaves after {leaves}");
        leaves = more;
    }
}

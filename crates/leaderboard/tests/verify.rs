//! A small submission of real episodes is accepted, and refused when an episode is forged.

use std::sync::atomic::AtomicBool;

use orchard_bench::store::Store;
use orchard_bench::{NoProgress, Session};
use orchard_leaderboard::{Budget, Entry, verify};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::run;
use orchard_tasks::harvest::summary::Summary;
use orchard_tasks::harvest::{Extent, Harvest};

#[test]
fn real_episodes_come_out_as_they_were_submitted() {
    let harvest = Harvest::new(Scenario::of(&[("controller", "expert")]).unwrap()).unwrap();
    let extent = Extent {
        profile: "full".into(),
        conditions: vec!["nominal".into(), "fruit-20".into()],
        seeds: vec![20250704],
        trees: 1,
        repeats: 2,
        horizon_s: 1.0,
    };
    let plan = harvest.plan_of(extent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (store, stop) = (Store::open(folder.path()).unwrap(), AtomicBool::new(false));
    let result = run(&plan, &harvest, &Session::whole(&store, 2, &stop), &NoProgress).unwrap();
    let verified = verify(folder.path(), &plan, &harvest, 2, 2, &stop, &NoProgress).unwrap();
    assert_eq!(Some(&verified.summary), result.summary.as_ref());
    assert_eq!(verified.sample.len(), 2);
    let entry = Entry::new("expert", Budget::of_figures(0.0, 0.0).unwrap(), &verified).unwrap();
    assert_eq!((entry.episodes, entry.quarantined, entry.completeness), (3, 0, 0.0));

    // A position in the 17th digit, with a summary to match.
    let mut records = result.records;
    let p = &mut records[1].fruit[3].p_world[2];
    *p = p.next_up();
    store.write_record(&records[1]).unwrap();
    store.write("summary.json", &Summary::of_run(&plan, &records)).unwrap();
    let e = verify(folder.path(), &plan, &harvest, 3, 2, &stop, &NoProgress).unwrap_err().to_string();
    let forged = "episodes/expert-nominal-20250704-000-r1.json differs when run again: fruit[3].p_world[2]";
    assert!(e.starts_with(forged), "{e}");
}

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::store::Store;
use orchard_bench::task::{NoProgress, RunError, Session};
use orchard_scenario::Scenario;

use super::*;
use crate::fake::progress::files;

/// Trials that are too short to meet anything: two trees, two targets each, a second.
fn short() -> ComponentPlan {
    let mut plan = ComponentPlan::new(Scenario::of(&[]).unwrap(), "quick", vec![20250704], 2).unwrap();
    let rules = &mut plan.protocol.component;
    rules.grasp.targets = rules.grasp.targets.with_value(2).unwrap();
    rules.gentle.targets = rules.gentle.targets.with_value(2).unwrap();
    rules.grasp.time = rules.grasp.time.with_value(1.0).unwrap();
    rules.gentle.time = rules.gentle.time.with_value(1.0).unwrap();
    plan
}

fn repeats<C: Component>() -> ComponentResult<C> {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let go = |folder: &Path, threads: usize, stop: bool| {
        let store = Store::open(folder).unwrap();
        run::<C>(&short(), &Session::whole(&store, threads, &AtomicBool::new(stop)), &NoProgress)
    };
    let result = go(one.path(), 1, false).unwrap();
    let again = go(two.path(), 2, false).unwrap();
    assert_eq!((&again.records, &again.summary), (&result.records, &result.summary));
    let whole = files(one.path(), C::NAME);
    assert_eq!(whole.len(), 3);
    assert_eq!(files(two.path(), C::NAME), whole);
    // All records are whole: nothing is left to be stopped.
    let again = go(two.path(), 2, true).unwrap();
    assert_eq!((again.records, again.summary), (result.records.clone(), result.summary.clone()));
    fs::remove_file(two.path().join(TreeRecord::<C>::path_of(&result.records[1]))).unwrap();
    assert!(matches!(go(two.path(), 1, true), Err(RunError::Interrupted { done: 1, total: 2, .. })));
    assert!(!two.path().join(C::SUMMARY).exists());
    result
}

impl<C: Component> TreeRecord<C> {
    fn path_of(record: &Self) -> String {
        <Self as orchard_bench::Record>::path(&record.key)
    }
}

#[test]
fn both_tasks_repeat_and_go_on() {
    let grasp = repeats::<ReachAndGrasp>();
    let gentle = repeats::<Gentle>();
    let trial = &grasp.records[0].trials[0];
    assert_eq!((&trial.ended, trial.duration_s), (&TrialOutcome::TimeOver, 1.0));
    // In the first second the base sets out and nothing is touched.
    assert_eq!((trial.contact_impulse_n_s, trial.branches_snapped), (0.0, 0));
    assert!(trial.path_m > 0.0 && trial.path_m < 2.0);
    let (grasp, gentle) = (grasp.summary.unwrap(), gentle.summary.unwrap());
    assert_eq!(grasp.metrics["success"].n, 4);
    assert_eq!(grasp.metrics["time_s"].mean, None);
    assert_eq!(gentle.outcomes.values().sum::<u32>(), gentle.metrics["success"].n as u32);
}

#[test]
fn targets_are_what_the_tasks_say() {
    let plan = ComponentPlan::new(Scenario::of(&[]).unwrap(), "quick", vec![20250704], 1).unwrap();
    let rules = &plan.protocol.component;
    let world = plan.scenario.world(20250704, 0, 0).unwrap();
    let named = ReachAndGrasp::targets(&world, rules, 20250704);
    assert_eq!(named, ReachAndGrasp::targets(&world, rules, 20250704));
    assert_eq!(named.len(), 4);
    for (i, target) in named.iter().enumerate() {
        assert!(world.reachable()[target.fruit as usize]);
        assert!(named[..i].iter().all(|other| other.fruit != target.fruit));
        let p_odom = orchard_geometry::inverse_transform(&world.x_world_odom(), &target.p_world.into());
        let error = (p_odom - orchard_geometry::Vec3::from(target.p_odom_told)).norm();
        // Three axes of 3 mm each: 15 mm are beyond five standard deviations.
        assert!(error > 0.0 && error < 0.015, "{error}");
    }
    let points = Gentle::targets(&world, rules, 20250704);
    assert!(!points.is_empty());
    for point in &points {
        let p: orchard_geometry::Vec3 = point.p_world.into();
        assert!(rules.gentle.height.contains_si(p.z));
        assert!(rules.gentle.axis_distance.contains_si(p.xy().norm()));
        assert!(point.segments_before >= rules.gentle.corridor_segments.get());
        assert!(world.reaches(&p));
    }
}

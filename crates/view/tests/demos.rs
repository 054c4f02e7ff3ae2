//! Demonstrations that a person drives, kept as `orchard demos` writes them.
#![cfg(feature = "demos")]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::store::Store;
use orchard_demos::{Table, verify};
use orchard_env::{Settings, Task, TaskEnv};
use orchard_play::{Marks, Wish, mark_goal};
use orchard_scenario::Options;
use orchard_view::{DemoFolder, Dials, PERSON, Setup, Stage};

fn stage(seed: u64, folder: &Path) -> Stage {
    stage_of(Task::Harvest, seed, folder)
}

fn stage_of(task: Task, seed: u64, folder: &Path) -> Stage {
    let options = Some(Options::of(&[("controller", "expert")]).unwrap());
    let controllers = orchard_scenario::controllers();
    let mut stage = Stage::new(Setup { options, controllers, seed, index: 0 }).unwrap();
    let settings = Settings::of(task);
    let spaces = settings.spaces.observing(&["state", "depth"]).unwrap();
    let store = Store::open(folder).unwrap();
    stage.keep_on(Box::new(DemoFolder::new(store, Settings { spaces, ..settings })));
    stage
}

/// Drives forward with the hand going up, and closes the hand.
fn drive(stage: &mut Stage, frames: u32) {
    let wish = Wish { base: [0.4, 0.0, 0.2], hand: [0.0, 0.0, 0.5], closes: true, ..Wish::default() };
    stage.session_mut().wish(wish);
    (0..frames).for_each(|_| assert!(stage.step()));
}

/// A driven episode is read and verified like that of a controller, and it ends in the state that the person saw.
#[test]
fn what_is_driven_is_kept_as_a_demonstration() {
    let folder = tempfile::tempdir().unwrap();
    let mut stage = stage(1, folder.path());
    (0..5).for_each(|_| assert!(stage.step()));
    stage.begin_demonstration().unwrap();
    assert_eq!((stage.session().world().frame(), stage.demonstrated_frames()), (0, Some(0)));
    drive(&mut stage, 60);
    // The robot is given to a controller in the middle.
    stage.session_mut().give_back();
    (0..30).for_each(|_| assert!(stage.step()));
    let base = stage.session().told().p_world_base;
    let sentence = stage.end_demonstration().unwrap();
    assert!(sentence.contains("of seed 1 to ") && sentence.contains(": 1.5 s, 0 fruit"), "{sentence}");
    // The next seed goes beside it.
    stage.turn(Dials { seed: 2, ..stage.dials().clone() }).unwrap();
    stage.begin_demonstration().unwrap();
    drive(&mut stage, 12);
    stage.end_demonstration().unwrap();
    let never = AtomicBool::new(false);
    let verdict = verify(folder.path(), &orchard_scenario::controllers(), 1, &never, &|| ()).unwrap();
    assert_eq!((verdict.episodes, verdict.problems), (2, vec![]));
    let read = |name: &str| Table::from_parquet(std::fs::read(folder.path().join(name)).unwrap()).unwrap();
    let steps = read("steps/000001-00000.parquet");
    let phases = steps.texts("phase").unwrap();
    assert!(phases[..10].iter().all(|phase| phase == PERSON) && phases[14] == "scan", "{phases:?}");
    // Actions of the base are shares of its largest speed: the same ones move it in the environment as far as it went.
    let (width, actions) = steps.floats("action").unwrap();
    let mut env = TaskEnv::new(stage.scenario(), &Settings::of(Task::Harvest), 0..1).unwrap();
    env.reset(&[Some(1)], &[true]).unwrap();
    actions.chunks_exact(width).for_each(|action| env.step(action, &[true]).unwrap());
    let world = env.truth(0).unwrap().unwrap();
    let there = world.handle().x_world_base(world.data()).translation.vector;
    let apart = there.iter().zip(base).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 0.01, "{apart} m");
}

/// A task with a goal is demonstrated like the harvest: the goal is marked, a controller that takes over in the middle is given it, and the episode ends
/// with the task.
#[test]
fn tasks_with_goals_are_demonstrated() {
    for task in [Task::Reach, Task::Gentle] {
        let folder = tempfile::tempdir().unwrap();
        let mut stage = stage_of(task, 1, folder.path());
        assert!(stage.goal().is_none());
        stage.begin_demonstration().unwrap();
        let goal = *stage.goal().unwrap();
        let mut marks = Marks::default();
        mark_goal(&mut marks, stage.session().world(), &goal);
        assert!(marks.instances().iter().any(|list| !list.is_empty()));
        (0..12).for_each(|_| assert!(stage.step()));
        stage.session_mut().give_back();
        (0..1500).for_each(|_| assert!(stage.step()));
        let sentence = stage.end_demonstration().unwrap();
        assert!(sentence.ends_with(" s, success"), "{sentence}");
        let never = AtomicBool::new(false);
        let verdict = verify(folder.path(), &orchard_scenario::controllers(), 1, &never, &|| ()).unwrap();
        assert_eq!((verdict.episodes, verdict.problems), (1, vec![]));
        // Another tree has another goal, and a folder takes one task only.
        stage.turn(Dials { seed: 2, ..stage.dials().clone() }).unwrap();
        assert!(stage.goal().is_none());
        assert!(stage_of(Task::Harvest, 2, folder.path()).begin_demonstration().is_err());
    }
}

#[test]
fn what_cannot_be_kept_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let official = 59_313_826_611_509;
    let mut stage = stage(official, folder.path());
    let told = |stage: &mut Stage| stage.begin_demonstration().unwrap_err();
    assert!(told(&mut stage).contains("is one of the official set"));
    assert_eq!(stage.end_demonstration().unwrap_err(), "no demonstration is under way");
    stage.turn(Dials { seed: 1, index: 3, ..stage.dials().clone() }).unwrap();
    assert!(told(&mut stage).contains("of tree 0 of a seed"));
    stage.turn(Dials { index: 0, ..stage.dials().clone() }).unwrap();
    stage.begin_demonstration().unwrap();
    drive(&mut stage, 5);
    // Less than a step is not kept, and goes on.
    assert!(stage.end_demonstration().unwrap_err().starts_with("5 frames are less than a step"));
    drive(&mut stage, 1);
    stage.end_demonstration().unwrap();
    assert!(told(&mut stage).contains("seed 1 has a demonstration"));
    // A reset gives one up.
    stage.turn(Dials { seed: 2, ..stage.dials().clone() }).unwrap();
    stage.begin_demonstration().unwrap();
    stage.reset();
    assert_eq!(stage.demonstrated_frames(), None);
    // Another scenario does not go into the folder.
    stage.turn(Dials { foliage: Some(0.1), ..stage.dials().clone() }).unwrap();
    assert!(told(&mut stage).contains("holds"), "{}", told(&mut stage));
}

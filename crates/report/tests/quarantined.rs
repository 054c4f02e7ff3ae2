//! A world of the benchmark whose numbers overflow from the physics to the top of the page.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::store::Store;
use orchard_bench::{NoProgress, Session};
use orchard_report::{Figures, PaperFigures, Pictures, Results, page};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::episode::{EpisodeKey, Outcome};
use orchard_tasks::harvest::{RunResult, WorldFactory, run};
use orchard_tasks::protocol::Protocol;
use orchard_world::World;

const SEED: u64 = 20250704;

/// The benchmark's worlds, but that a joint of one tree turns at a rate whose square is no number in f64.
struct Overwound {
    harvest: Harvest,
    tree: Option<u32>,
}

impl WorldFactory for Overwound {
    type World = World;
    type Controller = <Harvest as WorldFactory>::Controller;

    fn build(&self, key: &EpisodeKey) -> Result<(World, Self::Controller), String> {
        let (mut world, controller) = self.harvest.build(key)?;
        if self.tree == Some(key.world) {
            let body = world.tree().bodies[world.tree().len() / 2];
            let dof = world.model().dofs(body).start;
            world.data_mut().v[dof] = 1e200;
        }
        Ok((world, controller))
    }
}

fn harvest(folder: &Path, tree: Option<u32>) -> RunResult {
    let harvest = Harvest::new(Scenario::of(&[]).unwrap()).unwrap();
    let plan = harvest.plan("quick", vec![SEED], 3, 1.0);
    let store = Store::open(folder).unwrap();
    let stop = AtomicBool::new(false);
    let session = Session::whole(&store, 2, &stop);
    run(&plan, &Overwound { harvest, tree }, &session, &NoProgress).unwrap()
}

fn record(folder: &Path, tree: u32) -> Vec<u8> {
    fs::read(folder.join(format!("episodes/baseline-nominal-{SEED}-{tree:03}.json"))).unwrap()
}

#[test]
fn one_world_is_quarantined_counted_and_told_and_the_others_go_on() {
    let [sound, sick] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    assert_eq!(harvest(sound.path(), None).summary.unwrap().quarantined, 0);
    let result = harvest(sick.path(), Some(1));

    // The physics stopped it in its first frame; the other worlds were not affected.
    let Outcome::Quarantined { reason } = &result.records[1].outcome else {
        panic!("{:?}", result.records[1].outcome);
    };
    assert!(reason.starts_with("frame 1: ") && reason.ends_with("not finite"), "{reason}");
    for tree in [0, 2] {
        assert_eq!(record(sick.path(), tree), record(sound.path(), tree));
    }

    // It is a tree like the others in the figures, with nothing harvested.
    let results = Results { harvest: result.summary, ..Results::default() };
    let summary = results.harvest.as_ref().unwrap();
    let nominal = &summary.conditions["nominal"];
    assert_eq!((summary.quarantined, nominal.outcomes["quarantined"]), (1, 1));
    assert_eq!(nominal.metrics["harvest_completeness"].mean, Some(0.0));
    assert_eq!(nominal.metrics["fruit_dropped_per_tree"].n, 3);

    // The warning is on top of the page.
    let (protocol, paper) = (Protocol::paper(), PaperFigures::paper());
    let figures = Figures::draw(&results, &protocol, &paper).unwrap();
    let text = page(&results, &figures, &Pictures::default(), &protocol, &paper);
    let html = scraper::Html::parse_document(&text);
    let first = html.select(&scraper::Selector::parse("main > *").unwrap()).next().unwrap();
    let told: String = first.text().collect();
    assert_eq!(first.attr("class"), Some("warnings"));
    assert!(told.trim_start().starts_with("1 world was quarantined."), "{told}");

    // A second call does not run the world again, and gives the same summary.
    let summary = fs::read(sick.path().join("summary.json")).unwrap();
    harvest(sick.path(), Some(1));
    assert_eq!(fs::read(sick.path().join("summary.json")).unwrap(), summary);
}

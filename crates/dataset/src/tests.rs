use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use orchard_bench::lock::LOCK_FILE;
use orchard_camera::Sensor;
use orchard_geometry::Intrinsics;
use orchard_scenario::Scenario;
use orchard_spec::Spec;
use serde_json::Value;

use super::*;

const SEEDS: Seeds = Seeds { first: 20250704, end: 20250706 };

fn small() -> DatasetConfig {
    let mut config = DatasetConfig::paper();
    config.sun_map = config.sun_map.with_value(256).unwrap();
    config.sky_map = config.sky_map.with_value(48).unwrap();
    config.supersampling = config.supersampling.with_value(1).unwrap();
    config
}

fn plan_of(camera: &str, change: impl FnOnce(&mut DatasetConfig)) -> Plan {
    let mut config = small();
    change(&mut config);
    let scenario = Scenario::of(&[("camera", camera)]).unwrap();
    let k = Intrinsics::from_vertical_fov(64, 48, 1.2);
    Plan::new(&scenario, &config, Some(k), SEEDS, 1, 2).unwrap()
}

fn plan() -> Plan {
    plan_of("paper", |_| ())
}

/// Counts views, and raises a flag after some.
#[derive(Default)]
struct Count {
    drawn: AtomicU64,
    kept: AtomicU64,
    stop: AtomicBool,
    stop_after: Option<u64>,
    notes: Mutex<Vec<String>>,
}

impl Progress for Count {
    fn views(&self, count: u64, kept: bool) {
        let counter = if kept { &self.kept } else { &self.drawn };
        let now = counter.fetch_add(count, Ordering::Relaxed) + count;
        if self.stop_after == Some(now) {
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    fn note(&self, line: &str) {
        self.notes.lock().unwrap().push(line.to_owned());
    }
}

impl Count {
    fn run(&self, plan: &Plan, out: &Path, threads: usize) -> Result<Done, DatasetError> {
        run(plan, &Folder::open(out, plan)?, threads, &self.stop, self)
    }

    fn notes(&self) -> Vec<String> {
        self.notes.lock().unwrap().clone()
    }

    fn counts(&self) -> (u64, u64) {
        (self.drawn.load(Ordering::Relaxed), self.kept.load(Ordering::Relaxed))
    }
}

fn make(plan: &Plan, out: &Path) -> Done {
    Count::default().run(plan, out, 1).unwrap()
}

/// All files under a folder.
fn contents(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![root.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).unwrap().flatten() {
            if entry.file_type().unwrap().is_dir() {
                open.push(entry.path());
            } else {
                let name = entry.path().strip_prefix(root).unwrap().display().to_string().replace('\\', "/");
                found.insert(name, fs::read(entry.path()).unwrap());
            }
        }
    }
    found
}

fn read(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(name)).unwrap()).unwrap()
}

#[test]
fn bytes_do_not_depend_on_threads_or_on_interruptions() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let done = make(&plan(), &at("one"));
    assert_eq!((done.trees, done.images, done.unfit_depth_px), (2, 4, 0));
    let whole = contents(&at("one"));
    // Five images a view, a record per tree, annotations, cameras, intrinsics, recipe, manifest, lock.
    assert_eq!(whole.len(), 5 * 4 + 2 + 6);
    Count::default().run(&plan(), &at("two"), 2).unwrap();
    assert!(contents(&at("two")) == whole);

    let stopped = Count { stop_after: Some(3), ..Count::default() };
    let error = stopped.run(&plan(), &at("three"), 1).unwrap_err();
    assert_eq!(
        error.to_string(),
        "interrupted: 1 of 2 trees are complete; run the same command again to continue"
    );
    assert!(!at("three").join("manifest.json").exists());
    let second = Count::default();
    second.run(&plan(), &at("three"), 1).unwrap();
    assert_eq!(second.counts(), (2, 2));
    assert!(contents(&at("three")) == whole);

    // What is missing, damaged or cut short is made again.
    fs::remove_file(at("one").join("depth/20250704-000-001.png")).unwrap();
    let third = Count::default();
    third.run(&plan(), &at("one"), 1).unwrap();
    assert_eq!(third.counts(), (2, 2));
    assert_eq!(
        third.notes(),
        ["depth/20250704-000-001.png is missing, damaged or edited: its tree will be drawn again"]
    );
    fs::write(at("one").join("label/20250704-000-000.png"), "x").unwrap();
    fs::write(at("one").join("trees/20250705-000.json"), "{").unwrap();
    make(&plan(), &at("one"));
    assert!(contents(&at("one")) == whole);
}

#[test]
fn a_folder_holds_one_recipe() {
    let folder = tempfile::tempdir().unwrap();
    make(&plan(), folder.path());
    let before = contents(folder.path());
    let other = plan_of("paper", |config| {
        config.light.sun_elevation = config.light.sun_elevation.with_value(20.0).unwrap();
    });
    let error = Count::default().run(&other, folder.path(), 1).unwrap_err();
    assert!(error.is_bad_input());
    assert!(error.to_string().contains("its light.sun_elevation_deg is 48.0, not 20.0"), "{error}");
    assert!(contents(folder.path()) == before);

    let strange = tempfile::tempdir().unwrap();
    fs::write(strange.path().join("letter.txt"), "").unwrap();
    let error = Count::default().run(&plan(), strange.path(), 1).unwrap_err();
    assert!(
        error.is_bad_input() && error.to_string().contains("holds letter.txt but no data set"),
        "{error}"
    );
    let error = Count::default().run(&plan(), &strange.path().join("letter.txt"), 1).unwrap_err();
    assert!(error.is_bad_input(), "{error}");
    fs::write(strange.path().join("recipe.json"), "{").unwrap();
    let error = Count::default().run(&plan(), strange.path(), 1).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("its recipe.json is damaged"), "{error}");
}

/// A pose that an editor changed, in the record of a tree or in the file that people read, is named and put right.
#[test]
fn edited_files_are_found() {
    let folder = tempfile::tempdir().unwrap();
    make(&plan(), folder.path());
    let whole = contents(folder.path());
    let edit = |name: &str, from: &str, to: &str| {
        let path = folder.path().join(name);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{text}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
    };
    let tree = "trees/20250705-000.json";
    edit(tree, "\"translation_m\": [\n          ", "\"translation_m\": [\n          1");
    edit("manifest.json", "\"images\": 4", "\"images\": 5");
    edit("cameras.json", "\"translation_m\":[", "\"translation_m\":[1");
    let again = Count::default();
    again.run(&plan(), folder.path(), 1).unwrap();
    assert_eq!(
        again.notes(),
        [
            "manifest.json is damaged or was edited: it will be written again",
            "trees/20250705-000.json is missing, damaged or edited: its tree will be drawn again",
            "cameras.json is damaged or was edited: it will be written again"
        ]
    );
    assert_eq!(again.counts(), (2, 2));
    assert!(contents(folder.path()) == whole);

    // The manifest holds the hash of every file but its own and the lock's, and carries its own.
    let manifest = orchard_bench::checksum::checked(&whole["manifest.json"]).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let mut listed: Vec<(String, String)> = Vec::new();
    for file in manifest["files"].as_array().unwrap() {
        listed.push(
            serde_json::from_value(Value::Array(vec![file["path"].clone(), file["sha256"].clone()])).unwrap(),
        );
    }
    listed.sort();
    let kept = |name: &&String| !["manifest.json", LOCK_FILE].contains(&name.as_str());
    let hashes = whole.keys().filter(kept).map(|name| (name.clone(), crate::record::sha256(&whole[name])));
    assert_eq!(listed, hashes.collect::<Vec<_>>());

    // A recipe cannot be put right: everything follows from it.
    edit("recipe.json", "\"views\": 2", "\"views\": 3");
    let error = Count::default().run(&plan(), folder.path(), 1).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("(does not match its checksum)"), "{error}");
}

#[test]
fn a_folder_has_one_run_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let first = Folder::open(folder.path(), &plan()).unwrap();
    fs::write(folder.path().join("color/.writing-abc"), "").unwrap();
    let error = Folder::open(folder.path(), &plan()).unwrap_err();
    assert!(
        error.is_bad_input() && error.to_string().contains("another run is using this folder"),
        "{error}"
    );
    drop(first);
    Folder::open(folder.path(), &plan()).unwrap();
    assert!(!folder.path().join("color/.writing-abc").exists());
    // A folder with something else in it gets no lock.
    let strange = tempfile::tempdir().unwrap();
    fs::write(strange.path().join("letter.txt"), "").unwrap();
    Folder::open(strange.path(), &plan()).unwrap_err();
    assert!(!strange.path().join(LOCK_FILE).exists());
}

/// Moves the folder away while the first tree is drawn.
struct MoveAway<'a>(&'a Path, &'a Path);

impl Progress for MoveAway<'_> {
    fn views(&self, _: u64, _: bool) {
        if self.0.exists() {
            fs::rename(self.0, self.1).unwrap();
        }
    }
}

#[cfg(unix)]
#[test]
fn a_folder_that_is_moved_ends_the_run() {
    let place = tempfile::tempdir().unwrap();
    let (out, away) = (place.path().join("out"), place.path().join("away"));
    let folder = Folder::open(&out, &plan()).unwrap();
    let error = run(&plan(), &folder, 1, &AtomicBool::new(false), &MoveAway(&out, &away)).unwrap_err();
    assert!(error.to_string().contains("was moved, removed or replaced"), "{error}");
    assert!(!out.exists() && !away.join("manifest.json").exists());
}

/// One tree, one view: every fault at every operation of the store.
#[test]
fn a_data_set_survives_every_fault() {
    let scenario = Scenario::of(&[("camera", "ideal")]).unwrap();
    let k = Intrinsics::from_vertical_fov(16, 12, 1.2);
    let seeds = Seeds { first: 20250704, end: 20250705 };
    let plan = Plan::new(&scenario, &small(), Some(k), seeds, 1, 1).unwrap();
    let sweep = orchard_bench::sweep::Scenario {
        prepare: &|_| (),
        run: &|folder| Count::default().run(&plan, folder, 1).map(drop),
        last: &["manifest.json"],
        derived: &[],
        timed: &[],
    };
    // The folder and five in it, an old manifest removed; begin, write and name four images and six other files.
    assert_eq!(sweep.sweep(), 6 + 1 + 3 * (4 + 6));
}

#[test]
fn annotations_and_poses_are_those_of_the_images() {
    let folder = tempfile::tempdir().unwrap();
    let done = make(&plan(), folder.path());
    let file = read(folder.path(), "annotations.json");
    let annotations = file["annotations"].as_array().unwrap();
    assert_eq!(annotations.len() as u64, done.annotations);
    assert!(done.annotations > 10, "{done:?}");
    let images = file["images"].as_array().unwrap();
    let poses = read(folder.path(), "cameras.json");
    for (i, (image, pose)) in images.iter().zip(poses["poses"].as_array().unwrap()).enumerate() {
        assert_eq!((&image["id"], &pose["image_id"]), (&Value::from(i + 1), &Value::from(i + 1)));
        assert_eq!(image["file_name"], pose["file_name"]);
        let rotation = pose["x_world_camera"]["rotation_xyzw"].as_array().unwrap();
        let norm: f64 = rotation.iter().map(|q| q.as_f64().unwrap() * q.as_f64().unwrap()).sum();
        assert!((norm - 1.0).abs() < 1e-12);
    }
    for (i, a) in annotations.iter().enumerate() {
        assert_eq!(a["id"], Value::from(i + 1));
        let rle: orchard_exchange::coco::Rle = serde_json::from_value(a["segmentation"].clone()).unwrap();
        let mask = rle.mask().unwrap();
        let inside: Vec<(usize, usize)> = (0..mask.width() * mask.height())
            .map(|i| (i % mask.width(), i / mask.width()))
            .filter(|&p| mask[p])
            .collect();
        let range = |of: fn(&(usize, usize)) -> usize| {
            (inside.iter().map(of).min().unwrap(), inside.iter().map(of).max().unwrap())
        };
        let (u, v) = (range(|p| p.0), range(|p| p.1));
        assert_eq!(a["bbox"], Value::from(vec![u.0, v.0, u.1 - u.0 + 1, v.1 - v.0 + 1]));
        assert_eq!(a["area"], Value::from(inside.len()));
        let fraction = a["visible_fraction"].as_f64().unwrap();
        assert!(fraction > 0.0 && fraction <= 1.0);
    }
}

#[test]
fn depth_that_does_not_fit_is_counted_and_reads_nothing() {
    let folder = tempfile::tempdir().unwrap();
    // 65535 of these are 0.66 m: most of a tree is farther.
    let plan = plan_of("ideal", |config| config.depth_unit = config.depth_unit.with_value(0.01).unwrap());
    let done = make(&plan, folder.path());
    let mut unfit = 0;
    for view in 0..4 {
        let (seed, number) = (SEEDS.first + view / 2, (view % 2) as u32);
        let name = format!("{}.png", view_name(seed, 0, number));
        let bytes = |kind: &str| fs::read(folder.path().join(kind).join(&name)).unwrap();
        let depth = orchard_exchange::depth_png::read(&bytes("depth"), 1e-5).unwrap();
        let label = orchard_exchange::image_png::read_grey8(&bytes("label")).unwrap();
        let pixels = depth.pixels().iter().zip(label.pixels());
        unfit += pixels.filter(|(z, class)| **z == 0.0 && **class > 0).count() as u64;
    }
    assert!(unfit > 1000, "{unfit}");
    assert_eq!(done.unfit_depth_px, unfit);
}

#[test]
fn a_camera_that_errs_has_its_truth_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    make(&plan_of("d435i", |_| ()), folder.path());
    let images = read(folder.path(), "annotations.json")["images"].clone();
    let path = images[0]["true_depth_file"].as_str().unwrap();
    let [truth, measured] = [path, images[0]["depth_file"].as_str().unwrap()]
        .map(|path| fs::read(folder.path().join(path)).unwrap());
    assert_ne!(truth, measured);
}

#[test]
fn what_cannot_be_made_is_told() {
    let plan = |first, end, trees, views| {
        Plan::new(&Scenario::of(&[]).unwrap(), &small(), None, Seeds { first, end }, trees, views)
            .map(|_| ())
            .map_err(|e| {
                assert!(e.is_bad_input());
                e.to_string()
            })
    };
    assert_eq!(plan(1, 3, 1, 1), Ok(()));
    assert!(plan(5, 5, 1, 1).unwrap_err().contains("--seeds 5..5 is empty"));
    assert!(plan(5, 4, 1, 1).unwrap_err().contains("--seeds 5..4 is empty"));
    assert_eq!(plan(1, 2, 0, 1), Err("--trees 0: must be at least 1".into()));
    assert_eq!(plan(1, 2, 1, 0), Err("--views 0: must be at least 1".into()));
    assert!(plan(0, u64::MAX, u32::MAX, u32::MAX).unwrap_err().contains("exceeds the limit"));
    let huge = Intrinsics { width: 8192, height: 8192, ..*Sensor::new(&Spec::paper().camera).intrinsics() };
    let mut config = DatasetConfig::paper();
    config.supersampling = config.supersampling.with_value(8).unwrap();
    let e = Plan::new(&Scenario::of(&[]).unwrap(), &config, Some(huge), SEEDS, 1, 1).map(|_| ()).unwrap_err();
    assert!(e.is_bad_input() && e.to_string().contains("--supersampling 8: 8192 x 8192 pixels"), "{e}");
}

/// A fruit too near or too far to be measured shows in the colour image, so it has a label and an annotation: the truth
/// does not depend on the camera.
#[test]
fn what_is_out_of_range_has_its_truth() {
    let truth = |camera: &str| {
        let folder = tempfile::tempdir().unwrap();
        make(&plan_of(camera, |_| ()), folder.path());
        let name = format!("{}.png", view_name(SEEDS.first, 0, 0));
        let label = fs::read(folder.path().join("label").join(name)).unwrap();
        (read(folder.path(), "annotations.json")["annotations"].clone(), label)
    };
    let ideal = truth("ideal");
    assert!(!ideal.0.as_array().unwrap().is_empty());
    assert_eq!(truth("paper"), ideal);
    assert_eq!(truth("d435i"), ideal);
}

#[test]
fn the_camera_s_own_pinhole_is_the_default() {
    let plan = Plan::new(&Scenario::of(&[]).unwrap(), &DatasetConfig::paper(), None, SEEDS, 2, 1).unwrap();
    assert_eq!(plan.recipe().intrinsics, *Sensor::new(&Spec::paper().camera).intrinsics());
    assert_eq!(plan.trees(), [(20250704, 0), (20250704, 1), (20250705, 0), (20250705, 1)]);
}

//! Makes a data set, tree by tree in parallel, and writes the files for the whole set.

use std::sync::atomic::{AtomicBool, Ordering};

use orchard_bench::checksum::Damage;
use orchard_exchange::coco::{Annotation, Annotations, Category, ImageEntry, Info};
use orchard_exchange::intrinsics;
use orchard_geometry::Intrinsics;
use rayon::prelude::*;
use serde::Serialize;

use crate::error::DatasetError;
use crate::folder::{Folder, RECIPE, StoredTree, file_hash, tree_file};
use crate::recipe::{Plan, Recipe};
use crate::record::{FileRecord, FruitTruth, PoseRecord, TreeRecord, sha256};
use crate::tables::{self, CLASSES, Class};
use crate::tree::draw;

/// Progress of a run; its methods are called from several threads.
pub trait Progress: Sync {
    /// Called when views are finished: drawn now, or kept from an earlier run.
    fn views(&self, count: u64, kept: bool) {
        let _ = (count, kept);
    }
    /// Called with a line that a user should read.
    fn note(&self, line: &str) {
        let _ = line;
    }
}

/// File name of the manifest, which is written last.
const MANIFEST: &str = "manifest.json";

/// Ignores everything.
pub struct NoProgress;

impl Progress for NoProgress {}

/// A finished data set.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Done {
    /// Trees.
    pub trees: u64,
    /// Images of each kind.
    pub images: u64,
    /// Annotations: visible fruit, counted in each image.
    pub annotations: u64,
    /// Pixels whose depth is outside the range of the depth images; they are written as 0 and keep their label.
    pub unfit_depth_px: u64,
}

/// Entry of an image, with fields beyond the COCO format.
#[derive(Serialize)]
struct View<'a> {
    depth_file: &'a str,
    label_file: &'a str,
    instance_file: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    true_depth_file: Option<&'a str>,
    seed: u64,
    tree: u32,
}

#[derive(Serialize)]
struct Cameras<'a> {
    intrinsics: &'a Intrinsics,
    poses: Vec<CameraPose<'a>>,
}

#[derive(Serialize)]
struct CameraPose<'a> {
    image_id: u64,
    file_name: &'a str,
    x_world_camera: PoseRecord,
}

#[derive(Serialize)]
struct Manifest<'a> {
    format: &'static str,
    recipe: &'a Recipe,
    counts: &'a Done,
    classes: &'a [Class],
    no_instance: u16,
    /// All files except this one, the lock and the preview pictures.
    files: Vec<FileRecord>,
}

/// Makes a data set in a folder that was opened for this plan, on `threads` threads. Finished trees of an earlier run of the same recipe
/// are kept. An edited file is noted and made again.
///
/// # Errors
/// A tree cannot be built, a file cannot be written, the folder or a file in it was moved or removed, or `stop` was raised.
pub fn run(
    plan: &Plan,
    folder: &Folder,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl Progress,
) -> Result<Done, DatasetError> {
    if folder.store().read(MANIFEST).is_err_and(|e| e.damage() == Some(Damage::WrongChecksum)) {
        progress.note(&format!("{MANIFEST} is damaged or was edited: it will be written again"));
    }
    // Until this run has ended, the folder is incomplete and has no manifest.
    folder.store().remove(MANIFEST)?;
    let keys = plan.trees();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let tree = |key: &(u64, u32)| tree(plan, folder, *key, stop, progress);
    let trees: Vec<Option<TreeRecord>> =
        pool.install(|| keys.par_iter().with_max_len(1).map(tree).collect::<Result<_, DatasetError>>())?;
    let trees: Vec<TreeRecord> = trees.into_iter().flatten().collect();
    if trees.len() < keys.len() {
        return Err(DatasetError::Interrupted { done: trees.len(), total: keys.len() });
    }
    finish(plan, folder, &trees, progress)
}

/// One tree; none if stopped.
fn tree(
    plan: &Plan,
    folder: &Folder,
    (seed, world): (u64, u32),
    stop: &AtomicBool,
    progress: &impl Progress,
) -> Result<Option<TreeRecord>, DatasetError> {
    match folder.stored_tree(seed, world, plan.recipe.views) {
        StoredTree::Whole(record) => {
            progress.views(record.views.len() as u64, true);
            return Ok(Some(*record));
        }
        StoredTree::Changed(file) => {
            progress.note(&format!("{file} is missing, damaged or edited: its tree will be drawn again"));
        }
        StoredTree::Missing => {}
    }
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let drawn = draw(plan, folder, (seed, world), stop, || progress.views(1, false))?;
    if let Some(record) = &drawn {
        folder.write_tree(record)?;
    }
    Ok(drawn)
}

/// Writes the files for the whole set; the manifest last.
fn finish(
    plan: &Plan,
    folder: &Folder,
    trees: &[TreeRecord],
    progress: &impl Progress,
) -> Result<Done, DatasetError> {
    let recipe = &plan.recipe;
    let views = || trees.iter().flat_map(|tree| tree.views.iter().map(move |view| (tree, view)));
    let numbered = || (1_u64..).zip(views());
    let images = numbered().map(|(id, (tree, view))| ImageEntry {
        id,
        file_name: view.files.color.path.clone(),
        width: recipe.intrinsics.width,
        height: recipe.intrinsics.height,
        more: View {
            depth_file: &view.files.depth.path,
            label_file: &view.files.label.path,
            instance_file: &view.files.instance.path,
            true_depth_file: view.files.true_depth.as_ref().map(|file| file.path.as_str()),
            seed: tree.seed,
            tree: tree.world,
        },
    });
    let fruit_class = &CLASSES[1];
    let fruit =
        numbered().flat_map(|(image_id, (_, view))| view.fruit.iter().map(move |fruit| (image_id, fruit)));
    let annotations = (1_u64..).zip(fruit).map(|(id, (image_id, fruit))| Annotation::<&FruitTruth> {
        id,
        image_id,
        category_id: fruit_class.value.into(),
        bbox: fruit.bbox,
        area: fruit.segmentation.area(),
        segmentation: fruit.segmentation.clone(),
        iscrowd: 0,
        more: &fruit.truth,
    });
    let annotations = Annotations {
        info: Info { description: "OrchardBench data set".into(), version: recipe.code_version.clone() },
        images: images.collect(),
        categories: vec![Category {
            id: fruit_class.value.into(),
            name: fruit_class.name.into(),
            supercategory: "orchard".into(),
        }],
        annotations: annotations.collect(),
    };
    let poses = numbered().map(|(image_id, (_, view))| CameraPose {
        image_id,
        file_name: &view.files.color.path,
        x_world_camera: view.pose,
    });
    let cameras = Cameras { intrinsics: &recipe.intrinsics, poses: poses.collect() };
    let done = Done {
        trees: trees.len() as u64,
        images: views().count() as u64,
        annotations: annotations.annotations.len() as u64,
        unfit_depth_px: views().map(|(_, view)| view.unfit_depth_px).sum(),
    };
    let mut files = Vec::new();
    for (name, bytes) in [
        ("annotations.json", encode(&annotations)),
        ("cameras.json", encode(&cameras)),
        ("intrinsics.json", intrinsics::write(&recipe.intrinsics).into_bytes()),
    ] {
        let hash = sha256(&bytes);
        if folder.hash(name).is_some_and(|found| found != hash) {
            progress.note(&format!("{name} is damaged or was edited: it will be written again"));
        }
        folder.store().write_bytes(name, &bytes)?;
        files.push(FileRecord { path: name.into(), sha256: hash });
    }
    files.extend(views().flat_map(|(_, view)| view.files.all().cloned()));
    files.push(FileRecord { path: RECIPE.into(), sha256: file_hash(recipe) });
    files.extend(
        trees
            .iter()
            .map(|tree| FileRecord { path: tree_file(tree.seed, tree.world), sha256: file_hash(tree) }),
    );
    folder.store().check_files(files.iter().map(|file| &file.path))?;
    let manifest = Manifest {
        format: "orchard-dataset",
        recipe,
        counts: &done,
        classes: &CLASSES,
        no_instance: tables::NO_INSTANCE,
        files,
    };
    folder.store().write(MANIFEST, &manifest)?;
    Ok(done)
}

/// JSON on one line: run lengths are long.
fn encode(value: &impl Serialize) -> Vec<u8> {
    let mut bytes =
        serde_json::to_vec(value).unwrap_or_else(|e| unreachable!("texts, numbers and lists are JSON: {e}"));
    bytes.push(b'\n');
    bytes
}

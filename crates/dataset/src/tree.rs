//! The views of one tree: its images as files, and a record of them that is written last.

use std::sync::atomic::{AtomicBool, Ordering};

use orchard_camera::picture::Studio;
use orchard_camera::{Frame, FruitView, ImageKey, Label, NO_INSTANCE, Scene, fruit_views, render};
use orchard_exchange::coco::Rle;
use orchard_exchange::{depth_png, image_png};
use orchard_geometry::Image;
use orchard_tasks::vantage::vantages;

use crate::error::DatasetError;
use crate::folder::Folder;
use crate::recipe::Plan;
use crate::record::{FileRecord, FruitRecord, FruitTruth, TreeRecord, ViewFiles, ViewRecord, sha256, stem};
use crate::tables;

/// Stem of the names of a view's files, the same in every folder.
pub fn view_name(seed: u64, world: u32, view: u32) -> String {
    format!("{}-{view:03}", stem(seed, world))
}

/// Draws and writes the views of a tree; none if stopped before the last. `on_view` is called after each.
pub(crate) fn draw(
    plan: &Plan,
    folder: &Folder,
    (seed, world): (u64, u32),
    stop: &AtomicBool,
    on_view: impl Fn(),
) -> Result<Option<TreeRecord>, DatasetError> {
    let built = plan.scenario.world(seed, world, 0);
    let built = built.map_err(|source| DatasetError::World { seed, tree: world, source })?;
    let (scene, colored) = (without_robot(built.scene()), without_robot(built.picture_scene()));
    let studio = Studio::new(&colored, &plan.style);
    let poses = vantages(&plan.vantage, &scene, seed, world, plan.recipe.views);
    let mut views = Vec::with_capacity(poses.len());
    for (number, x_world_camera) in (0_u32..).zip(&poses) {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let name = view_name(seed, world, number);
        let capture = plan.sensor.capture(&scene, x_world_camera, ImageKey { seed, world, frame: number });
        let color = studio.picture(plan.sensor.intrinsics(), x_world_camera);
        // The colour image has no range limit, so its labels have none.
        let mut truth = Frame::new(0, 0);
        render(&scene, plan.sensor.intrinsics(), x_world_camera, 0.0, f64::INFINITY, &mut truth);
        let numbers = numbers((seed, world), &truth)?;
        let unit = plan.recipe.depth_unit_m;
        let file = |kind: &str, encoded: Result<Vec<u8>, _>| -> Result<FileRecord, DatasetError> {
            let bytes = encoded.map_err(|e: png::EncodingError| DatasetError::Png(e.to_string()))?;
            let path = format!("{kind}/{name}.png");
            folder.store().write_bytes(&path, &bytes)?;
            Ok(FileRecord { path, sha256: sha256(&bytes) })
        };
        let true_depth = plan.needs_true_depth().then(|| depth_png::write(&truth.depth, unit));
        let files = ViewFiles {
            color: file("color", image_png::write_rgb(&color))?,
            depth: file("depth", depth_png::write(&capture.measured, unit))?,
            label: file("label", image_png::write_grey8(&numbers.label))?,
            instance: file("instance", image_png::write_grey16(&numbers.instance))?,
            true_depth: true_depth.map(|encoded| file("true_depth", encoded)).transpose()?,
        };
        let fruit = fruit_views(&truth, &scene, plan.sensor.intrinsics(), x_world_camera);
        views.push(ViewRecord {
            name,
            files,
            pose: x_world_camera.into(),
            unfit_depth_px: depth_png::unfit(&capture.measured, unit),
            fruit: fruit.iter().filter_map(|view| fruit_record(&truth, view)).collect(),
        });
        on_view();
    }
    Ok(Some(TreeRecord { recipe: folder.recipe_hash().to_owned(), seed, world, views }))
}

fn without_robot(mut scene: Scene) -> Scene {
    scene.items.retain(|item| item.label != Label::Robot);
    scene
}

/// Label and instance images as they are written.
struct Numbers {
    label: Image<u8>,
    instance: Image<u16>,
}

fn numbers((seed, tree): (u64, u32), frame: &Frame) -> Result<Numbers, DatasetError> {
    let (width, height) = (frame.label.width(), frame.label.height());
    let mut out = Numbers {
        label: Image::filled(width, height, 0),
        instance: Image::filled(width, height, tables::NO_INSTANCE),
    };
    let pixels = frame.label.pixels().iter().zip(frame.instance.pixels());
    let written = out.label.pixels_mut().iter_mut().zip(out.instance.pixels_mut());
    for ((shown, number), (label, instance)) in pixels.zip(written) {
        let class = tables::class(*shown);
        *label = class.value;
        if *number != NO_INSTANCE {
            let fits = u16::try_from(*number).ok().filter(|number| *number != tables::NO_INSTANCE);
            *instance =
                fits.ok_or(DatasetError::Instance { seed, tree, class: class.name, instance: *number })?;
        }
    }
    Ok(out)
}

/// Annotation of a visible fruit.
fn fruit_record(truth: &Frame, view: &FruitView) -> Option<FruitRecord> {
    let bounds = view.visible_box?;
    let (label, instance) = (truth.label.pixels(), truth.instance.pixels());
    let shows = label.iter().zip(instance).map(|(l, i)| *l == Label::Fruit && *i == view.instance).collect();
    let mask = Image::from_pixels(truth.label.width(), truth.label.height(), shows)?;
    Some(FruitRecord {
        bbox: [bounds.u.0, bounds.v.0, bounds.u.1 - bounds.u.0 + 1, bounds.v.1 - bounds.v.0 + 1],
        segmentation: Rle::of(&mask, |inside| *inside),
        truth: FruitTruth {
            // It has a pixel, so it fitted.
            instance: u16::try_from(view.instance).ok()?,
            visible_fraction: view.visible_fraction(),
            unoccluded_px: view.unoccluded_px,
            center_camera_m: view.p_camera.into(),
            radius_m: view.radius,
        },
    })
}

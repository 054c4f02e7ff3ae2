//! Contact sheet of a data set: some views, each as colour, depth in false colour and classes in colours.

use std::path::Path;

use anyhow::Context;
use orchard_bench::store::Store;
use orchard_camera::picture::depth_picture;
use orchard_dataset::{CLASSES, Plan, view_name};
use orchard_exchange::{depth_png, image_png};
use orchard_geometry::Image;

use crate::failure::Failure;
use crate::picture_file::{self, paste};

/// Most views on a sheet.
const MOST_VIEWS: usize = 6;
/// Largest depth of the colour scale \[m\].
const SHOWN_DEPTH: f32 = 4.0;
/// Gap between the pictures \[px\], and its colour.
const GAP: usize = 4;
const PAPER: [u8; 3] = [250, 249, 246];

/// Writes `contact_sheet.png` from the files of a finished data set.
pub fn write(folder: &Store, plan: &Plan) -> Result<(), Failure> {
    let rows =
        chosen(plan).iter().map(|name| row(folder.path(), plan, name)).collect::<anyhow::Result<Vec<_>>>()?;
    let (width, height) = (plan.recipe().intrinsics.width, plan.recipe().intrinsics.height);
    let mut sheet = Image::filled(3 * (width + GAP) + GAP, rows.len() * (height + GAP) + GAP, PAPER);
    for (v, row) in rows.iter().enumerate() {
        for (u, picture) in row.iter().enumerate() {
            paste(&mut sheet, picture, GAP + u * (width + GAP), GAP + v * (height + GAP));
        }
    }
    picture_file::write_in(folder, "contact_sheet.png", &sheet)
}

/// Names of views, spread over trees and bearings.
fn chosen(plan: &Plan) -> Vec<String> {
    let (trees, views) = (plan.trees(), plan.recipe().views as usize);
    let total = trees.len() * views;
    let count = total.min(MOST_VIEWS);
    let name = |i: usize| {
        let image = i * total / count;
        let (seed, world) = trees[image / views];
        view_name(seed, world, (image % views) as u32)
    };
    (0..count).map(name).collect()
}

fn row(folder: &Path, plan: &Plan, name: &str) -> anyhow::Result<[Image<[u8; 3]>; 3]> {
    let bytes = |kind: &str| {
        let path = folder.join(kind).join(format!("{name}.png"));
        orchard_input::bytes(&path, orchard_input::IMAGE).with_context(|| path.display().to_string())
    };
    let color = image_png::read_rgb(&bytes("color")?)?;
    let mut depth = depth_png::read(&bytes("depth")?, plan.recipe().depth_unit_m)?;
    depth.pixels_mut().iter_mut().for_each(|z| *z = z.min(SHOWN_DEPTH));
    let label = image_png::read_grey8(&bytes("label")?)?;
    let classes =
        label.pixels().iter().map(|&value| CLASSES[usize::from(value).min(CLASSES.len() - 1)].color);
    let classes =
        Image::from_pixels(label.width(), label.height(), classes.collect()).context("a colour a pixel")?;
    Ok([color, depth_picture(&depth, &[]), classes])
}

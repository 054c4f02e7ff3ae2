//! `orchard gallery`: a sheet of randomised trees.

pub mod caption;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use orchard_camera::picture::{PictureStyle, look_at, picture};
use orchard_camera::{Geometry, Label, NO_INSTANCE};
use orchard_geometry::{Image, Intrinsics, Pose, Shape, Vec3, math};
use orchard_spec::tree::Grammar;
use orchard_spec::{Preset, Spec};
use orchard_world::{Planting, tree_scene};
use rayon::prelude::*;

use crate::failure::Failure;
use crate::picture_file::{self, paste};

/// Draws a sheet of trees: a hundred randomised ones, then a row for each growth habit and each training system.
#[derive(clap::Args)]
#[command(
    after_help = "All trees of a group are drawn at the same scale, so that their sizes can be compared.\n\n\
                  Examples:\n  orchard gallery --out trees.png\n  orchard gallery --seed 7 --rows 2 --cell 240 --out few.png"
)]
pub struct Args {
    /// Seed of the population
    #[arg(long, default_value_t = 20250704, value_name = "S")]
    seed: u64,
    /// Rows of ten randomised trees
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100))]
    rows: u32,
    /// Foliage density of all trees: 0 is none, 1 the reference density
    #[arg(long, default_value_t = 1.2, value_name = "DIAL", allow_negative_numbers = true)]
    foliage: f64,
    /// Width of the picture of one tree [px]
    #[arg(long, default_value_t = 150, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(48..=512))]
    cell: u32,
    /// PNG file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Episode of the trees: the first.
const EPISODE: u32 = 0;
/// Trees per row.
const COLUMNS: u32 = 10;
/// Ratio of a cell's height to its width: trees are taller than wide.
const ASPECT: f64 = 1.25;
/// Distance of the camera from the trunk and its height \[m\].
const DISTANCE: f64 = 9.0;
const EYE_HEIGHT: f64 = 1.7;
/// Height that a cell shows at the trunk \[m\]; more where a group's tallest tree needs it.
const SHOWN: f64 = 3.0;
const SHOWN_OVER_TOP: f64 = 1.16;
/// Bearing of the camera from the direction across the row \[rad\]; an oblique view shows the planes of trained trees.
const SLANT: f64 = 0.7;
/// Gap between the cells \[px\], and its colour.
const GAP: usize = 3;
const PAPER: [u8; 3] = [250, 249, 246];

/// A group of rows with a caption.
struct Group {
    caption: String,
    /// Configuration that each tree is grown from, and the tree's world index in the seed.
    trees: Vec<(Arc<Spec>, u32)>,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    picture_file::check("--out", &args.out)?;
    let groups = groups(args.rows, args.foliage)?;
    let cell = [args.cell as usize, (f64::from(args.cell) * ASPECT).round() as usize];
    let count = groups.iter().map(|group| group.trees.len() as u64).sum();
    let bar = ProgressBar::new(count).with_style(
        ProgressStyle::with_template("{bar:30} {pos}/{len} trees")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let drawn: Vec<Vec<Image<[u8; 3]>>> = groups
        .iter()
        .map(|group| group.draw(args.seed, cell, &bar).with_context(|| group.caption.clone()))
        .collect::<anyhow::Result<_>>()?;
    bar.finish_and_clear();
    picture_file::write(&args.out, &sheet(&groups, &drawn, cell))
}

/// Groups of trees on the sheet, from top to bottom.
fn groups(rows: u32, foliage: f64) -> Result<Vec<Group>, Failure> {
    let randomised = Spec::preset(Preset::Randomised);
    let dial = randomised.foliage.density.with_value(foliage);
    let dial = dial.map_err(|e| Failure::BadInput(format!("--foliage: {e}")))?;
    let group = |caption: &str, mut spec: Spec, rows: u32| {
        spec.foliage.density = dial.clone();
        let spec = Arc::new(spec);
        let trees = (0..rows * COLUMNS).map(|world| (spec.clone(), world)).collect();
        Group { caption: caption.to_owned(), trees }
    };
    let all = "randomised: each tree with its own topology, dimensions, habit, fruit, leaves and colours";
    let mut groups = vec![group(all, randomised.clone(), rows)];
    for (caption, part) in HABITS {
        groups.push(group(&format!("habit: {caption}"), of_habit(&randomised, part)?, 1));
    }
    for preset in SYSTEMS {
        groups.push(group(preset.name(), Spec::preset(preset), 1));
    }
    Ok(groups)
}

/// Habits, as fractions of the droop interval.
const HABITS: [(&str, f64); 4] = [("upright", 0.0), ("spreading", 0.35), ("arching", 0.7), ("weeping", 1.0)];

/// Presets of training systems and other populations.
const SYSTEMS: [Preset; 5] =
    [Preset::Calibrated, Preset::CalibratedYoung, Preset::TallSpindle, Preset::VTrellis, Preset::VerticalUfo];

/// A population with a fixed droop: a fraction of the intervals of grammar and randomisation.
fn of_habit(spec: &Spec, part: f64) -> Result<Spec, Failure> {
    let mut spec = spec.clone();
    let Grammar::CentralLeader(grammar) = &mut spec.tree.grammar else {
        return Err(Failure::Failed(
            "the preset `randomised` does not use the central-leader grammar".into(),
        ));
    };
    for span in [&mut grammar.droop, &mut grammar.form, &mut spec.randomisation.droop.factor] {
        *span = span.at(part);
    }
    Ok(spec)
}

impl Group {
    /// All its trees at the same scale.
    fn draw(&self, seed: u64, cell: [usize; 2], bar: &ProgressBar) -> anyhow::Result<Vec<Image<[u8; 3]>>> {
        let plant = |(spec, world): &(Arc<Spec>, u32)| Ok(Planting::draw(spec, seed, *world, EPISODE)?);
        let plantings: Vec<Planting> = self.trees.par_iter().map(plant).collect::<anyhow::Result<_>>()?;
        Ok(portraits(&plantings, cell, || bar.inc(1)))
    }
}

/// Draws trees at the same scale, each centred in a picture of the given width and height \[px\].
pub fn portraits(plantings: &[Planting], cell: [usize; 2], drawn: impl Fn() + Sync) -> Vec<Image<[u8; 3]>> {
    let tips = plantings.iter().flat_map(|planting| &planting.skeleton.segments);
    let top = tips.map(|segment| segment.p_tip_world().z).fold(0.0, f64::max);
    let shown = SHOWN.max(SHOWN_OVER_TOP * top);
    let picture = |planting: &Planting| {
        let image = draw(planting, shown, cell);
        drawn();
        image
    };
    plantings.par_iter().map(picture).collect()
}

/// One tree, in the middle of its cell.
fn draw(planting: &Planting, shown: f64, [width, height]: [usize; 2]) -> Image<[u8; 3]> {
    let spec = &planting.spec;
    let bearing = if spec.scenery.is_some() { SLANT } else { 0.0 };
    let towards = Vec3::new(math::sin(bearing), -math::cos(bearing), 0.0);
    let across = Vec3::z().cross(&towards);
    let sides = planting.skeleton.segments.iter().map(|s| s.p_tip_world().dot(&across));
    let (left, right) = sides.fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
    let foot = across * (0.5 * (left + right));
    let eye = foot + towards * DISTANCE + Vec3::z() * EYE_HEIGHT;
    // Some ground in front of the trunk is visible.
    let target = foot + Vec3::z() * (0.44 * shown);
    let mut scene = tree_scene(planting);
    scene.push(Geometry::Shape(Shape::HalfSpace), Pose::identity(), Label::Ground, NO_INSTANCE);
    // The camera is far away to reduce perspective; the haze over that distance must not be visible.
    let style = PictureStyle { haze_length: 1.0e3, ..PictureStyle::default() };
    let fov = 2.0 * math::atan2(0.5 * shown, (eye - target).norm());
    let intrinsics = Intrinsics::from_vertical_fov(width, height, fov);
    picture(&scene, &intrinsics, &look_at(&eye, &target), &style)
}

/// Lays the trees out in rows under their captions.
fn sheet(groups: &[Group], drawn: &[Vec<Image<[u8; 3]>>], [width, height]: [usize; 2]) -> Image<[u8; 3]> {
    let columns = COLUMNS as usize;
    let rows: usize = drawn.iter().map(|images| images.len().div_ceil(columns)).sum();
    let sheet_width = columns * (width + GAP) + GAP;
    let sheet_height = rows * (height + GAP) + groups.len() * caption::HEIGHT + GAP;
    let mut sheet = Image::filled(sheet_width, sheet_height, PAPER);
    let mut top = 0;
    for (group, images) in groups.iter().zip(drawn) {
        caption::write(&mut sheet, &group.caption, 2 * GAP, top);
        top += caption::HEIGHT;
        for row in images.chunks(columns) {
            for (column, image) in row.iter().enumerate() {
                paste(&mut sheet, image, GAP + column * (width + GAP), top);
            }
            top += height + GAP;
        }
    }
    sheet
}

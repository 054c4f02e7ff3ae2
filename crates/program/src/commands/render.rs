//! `orchard render`: a picture of an episode at one moment, beside the wrist camera's image.

use crate::args::IndexArgs;
use crate::args::{ScenarioArgs, controller};
use crate::failure::Failure;
use crate::picture_file::{self, paste};
use crate::program::Program;
use orchard_camera::picture::{PictureStyle, depth_picture_enlarged, look_at, picture};
use orchard_geometry::{Image, Intrinsics, Vec3, inverse_transform, math};
use orchard_picker::Controller;
use orchard_robot::Observation;
use orchard_world::{Status, World};
use std::f64::consts::FRAC_PI_2;
use std::path::PathBuf;

/// Draws one moment of an episode: the scene from outside, and the wrist camera's depth image.
#[derive(clap::Args)]
#[command(
    after_help = "The episode is simulated up to --time. Beside the view from outside is the latest depth image of the wrist camera\n\
                  (bright is near) with a circle around every fruit that the controller detected in it.\n\n\
                  Examples:\n  orchard render --seed 20250704 --time 12 --out tree.png\n  \
                  orchard render --tree measured.mtg --out tree.png"
)]
pub struct Args {
    /// Seed of the population
    #[arg(long, default_value_t = 20250704, value_name = "S", allow_negative_numbers = true, value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    index: IndexArgs,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Time in the episode [s]
    #[arg(long, default_value_t = 0.0, value_name = "SECONDS", allow_negative_numbers = true)]
    time: f64,
    /// Terrain amplitude: largest bump or hollow of the ground [m] [default: the config's ground]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    terrain: Option<f64>,
    /// Height of the picture [px]
    #[arg(long, default_value_t = 720, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(64..=4096))]
    height: u32,
    /// PNG file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("must be a whole number in [0, {}]", u64::MAX))
}

/// Longest episode that is drawn \[s\]: a run to exhaustion in the field.
const LATEST: f64 = 1800.0;

/// Runs the episode up to the moment and writes the picture.
pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    if !(0.0..=LATEST).contains(&args.time) {
        return Err(Failure::BadInput(format!("--time {}: the allowed range is [0, {LATEST}] s", args.time)));
    }
    picture_file::check("--out", &args.out)?;
    let (index, scenario) = args.index.of(&args.scenario);
    let mut scenario = scenario.resolve(program)?;
    if let Some(amplitude) = args.terrain {
        let mut spec = (**scenario.spec()).clone();
        let terrain = spec.terrain.with_amplitude(amplitude);
        spec.terrain = terrain.map_err(|e| Failure::BadInput(format!("--terrain {amplitude}: {e}")))?;
        scenario = scenario.with_spec(spec);
    }
    let seed = args.seed;
    // Worlds depend on the user's options only, so a failure is bad input.
    let built = scenario.world(seed, index, 0);
    let mut world = built.map_err(|e| Failure::BadInput(format!("seed {seed}, tree {index}: {e}")))?;
    let mut picker = controller(&scenario)?;
    let mut wrist_view = None;
    while f64::from(world.frame()) * scenario.spec().sim.frame() <= args.time {
        let observation = world.observe();
        let command = picker.act(&observation);
        if observation.depth.is_some() {
            wrist_view = Some(wrist_picture(&world, &observation, &picker));
        }
        world.step(&command);
        if let Status::Quarantined { frame, reason } = world.status() {
            let at = f64::from(*frame) * scenario.spec().sim.frame();
            let tree = format!("seed {seed}, tree {index}");
            return Err(Failure::BadInput(format!(
                "--time {}: the world of {tree} stands still from {at:.2} s on, since {reason}; take an earlier time",
                args.time
            )));
        }
    }
    let outside = outside_view(&world, args.height as usize);
    let sheet = wrist_view.map_or_else(|| outside.clone(), |wrist| beside(&outside, &wrist));
    picture_file::write(&args.out, &sheet)
}

/// Camera pose a little above head height: at right angles to the robot's path to the trunk, or, for trees in a row, in the
/// robot's alley. It is farther away for trees taller than the default.
fn outside_view(world: &World, height: usize) -> Image<[u8; 3]> {
    const VERTICAL_FOV: f64 = 0.75;
    let intrinsics = Intrinsics::from_vertical_fov(height * 4 / 3, height, VERTICAL_FOV);
    let x_world_base = world.handle().x_world_base(world.data());
    let base = x_world_base.translation.vector;
    let robot = math::atan2(base.y, base.x);
    let bearing = match &world.spec().scenery {
        None => robot + 1.05,
        Some(_) => {
            let alley = FRAC_PI_2.copysign(robot);
            alley + if robot < alley { 0.55 } else { -0.55 }
        }
    };
    let scale = (world.spec().tree.height.si() / 2.4).max(1.0);
    let eye = Vec3::new(4.4 * math::cos(bearing), 4.4 * math::sin(bearing), 1.9) * scale;
    let target = Vec3::new(0.25 * base.x, 0.25 * base.y, 1.1 * scale);
    // For a row the camera looks at the middle of the tree.
    let segments = &world.skeleton().segments;
    let x_middle = segments.iter().map(|s| s.p_tip_world().x).sum::<f64>() / segments.len() as f64;
    let aside = world.spec().scenery.as_ref().map_or_else(Vec3::zeros, |_| Vec3::x() * x_middle);
    let x_world_camera = look_at(&(eye + aside), &(target + aside));
    picture(&world.picture_scene(), &intrinsics, &x_world_camera, &PictureStyle::default())
}

/// Depth image of an observation, with the picker's detections.
fn wrist_picture(world: &World, observation: &Observation, picker: &impl Controller) -> Image<[u8; 3]> {
    const WIDTH: usize = 576;
    let intrinsics = observation.intrinsics;
    let scale = (WIDTH / intrinsics.width.max(1)).max(1);
    let x_world_camera =
        world.camera_truth().map_or_else(|| world.x_world_camera(), |truth| truth.sight.x_world_camera);
    let x_odom_camera = world.x_world_odom().inverse() * x_world_camera;
    let seen = picker.record().images.last().map_or(&[][..], |image| &image.detections);
    let circles: Vec<(f64, f64, f64)> = seen
        .iter()
        .filter_map(|d| {
            let p_camera = inverse_transform(&x_odom_camera, &d.p_odom);
            let (u, v) = intrinsics.project(&p_camera)?;
            Some((u, v, intrinsics.fx * d.radius / p_camera.z))
        })
        .collect();
    let blank = || orchard_geometry::DepthImage::filled(intrinsics.width, intrinsics.height, 0.0);
    let depth = observation.depth.clone().unwrap_or_else(blank);
    depth_picture_enlarged(&depth, &circles, scale)
}

/// Two pictures side by side on a dark background, the smaller one centred vertically.
fn beside(left: &Image<[u8; 3]>, right: &Image<[u8; 3]>) -> Image<[u8; 3]> {
    const SHEET: [u8; 3] = [24, 26, 28];
    let height = left.height().max(right.height());
    let mut sheet = Image::filled(left.width() + right.width(), height, SHEET);
    for (image, left_edge) in [(left, 0), (right, left.width())] {
        paste(&mut sheet, image, left_edge, (height - image.height()) / 2);
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_seed_is_told_the_range() {
        assert_eq!(seed("20250704"), Ok(20250704));
        for bad in ["-1", "", "1.5", "18446744073709551616"] {
            assert!(seed(bad).is_err_and(|line| line.contains("[0, 18446744073709551615]")), "{bad}");
        }
    }
}

//! `orchard robot check`: loads a URDF with its meshes, lists its content, and tells what harvesting lacks.

use std::path::{Path, PathBuf};
use std::time::Instant;

use orchard_bench::store::{write_bytes, write_json};
use orchard_robot::{Articulation, Draft, Limits, Loaded, PAPER_TOML, RobotConfig, RobotModel, Survey};
use orchard_scenario::MeshFiles;

use super::{draft, picture, table};
use crate::commands::validate::ik;
use crate::failure::Failure;
use crate::picture_file;

/// Loads any URDF file with its meshes; reports joints, limits, masses, warnings, and the parts missing for the benchmark.
#[derive(clap::Args)]
#[command(
    after_help = "Output:\n  joints   type, axis and the limits of position, velocity and effort (rad or m, rad/s or m/s, N m or N)\n  \
                  links    mass, and a check of the inertia: positive definite, and no principal moment\n           \
                  larger than the sum of the others\n  \
                  meshes   collision meshes with their sizes and the convex shapes that stand for them\n  \
                  totals, the outline of the base on the ground, and the parts that a harvester needs: a planar base,\n  \
                  a height servo, an arm of seven hinges, two fingers, hand, tool point and bucket, by the names in the\n  \
                  mapping. A file without these parts is valid but cannot be used in the benchmark.\n  \
                  warnings: what the file leaves open or gets wrong, and what is assumed instead\n  \
                  the line `This robot can harvest here.`, only if it can\n\n\
                  Exit code 2 (one line that names the place): a missing file; xacro or MJCF; invalid XML; a collision mesh that\n\
                  is missing, broken, larger than 20 m or of more than a million triangles; a cycle of joints; two roots;\n\
                  duplicate names; a negative mass; an unknown joint type; a lowest position above the highest; a mimic of a\n\
                  missing joint; more than 128 joints that move. Exit code 3: --require-harvest, and the robot cannot harvest.\n\n\
                  Meshes (STL, OBJ, COLLADA) are sought relative to the URDF and in the folders of --package-path, those of\n\
                  package://NAME/PATH in the package NAME: in --package-path, around the URDF, or beside its own package. No\n\
                  name leads out of these folders. docs/robots.md tells what is assumed where a file leaves something open.\n\n\
                  Examples:\n  orchard robot check --urdf assets/robots/ridgeback-fr3/robot.urdf\n  \
                  orchard robot check --urdf arm_description/urdf/arm.urdf --package-path . --picture arm.png\n  \
                  orchard robot check --urdf my_robot.urdf --write-mapping my_robot.toml    names guessed, to be checked\n  \
                  orchard robot check --urdf my_robot.urdf --mapping my_robot.toml --require-harvest"
)]
pub struct Args {
    /// URDF file of the robot
    #[arg(long, value_name = "FILE")]
    urdf: PathBuf,
    /// Mapping: config with the names of the parts [default: that of ridgeback-fr3]
    #[arg(long, value_name = "FILE", alias = "config")]
    mapping: Option<PathBuf>,
    /// Write the first draft of a mapping, with guessed names
    #[arg(long, value_name = "FILE")]
    write_mapping: Option<PathBuf>,
    /// Folder that holds packages which package:// names, or other meshes; may be given several times
    #[arg(long, value_name = "DIR")]
    package_path: Vec<PathBuf>,
    /// Limits of joints: a TOML file with a table [JOINT] of lower, upper, velocity, effort [default: those of the mapping]
    #[arg(long, value_name = "FILE")]
    limits: Option<PathBuf>,
    /// Also write the report to a JSON file; missing limits are null
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draw the robot at q = 0 from the side and from above: a PNG file
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Let both inverse kinematics solve N reachable tool poses, and tell how many they solve; needs a robot that can harvest here
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    ik: Option<u32>,
    /// End with exit code 3 if the robot cannot harvest here
    #[arg(long)]
    require_harvest: bool,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(path) = &args.picture {
        picture_file::check("--picture", path)?;
    }
    let start = Instant::now();
    let Checked { survey, loaded, robot, bytes } = check(args)?;
    say!("{}", table::text(&survey).trim_end());
    // The time is told and stored nowhere: it differs from run to run.
    note!(
        "loaded in {:.2} s, {:.1} MB of collision meshes among it",
        start.elapsed().as_secs_f64(),
        bytes as f64 / 1e6
    );
    let guesses = Draft::of(&loaded);
    if let Some(path) = &args.json {
        write_json(path, &survey).map_err(|e| Failure::of_file(&e))?;
    }
    if let Some(path) = &args.write_mapping {
        let text = draft::text(&args.urdf.display().to_string(), &guesses, &loaded.articulation);
        write_bytes(path, text.as_bytes()).map_err(|e| Failure::of_file(&e))?;
        note!("{}: a draft, whose names are guesses", path.display());
    }
    if let Some(path) = &args.picture {
        picture_file::write(path, &picture::draw(&loaded.articulation, &parts(&survey, &guesses)))?;
    }
    match (args.ik, robot) {
        (Some(poses), Some(robot)) => {
            let solved = ik::solved(robot.kinematics(), poses, || ());
            say!(
                "Inverse kinematics: of {poses} reachable tool poses damped least squares solve {}, quadratic programs {}.",
                solved.least_squares,
                solved.programs
            );
        }
        (Some(_), None) => note!("--ik: no poses are tried, since the robot cannot harvest here"),
        (None, _) => {}
    }
    match survey.obstacle {
        Some(reason) if args.require_harvest => {
            Err(Failure::Unmet(format!("{}: this robot cannot harvest here: {reason}", args.urdf.display())))
        }
        _ => Ok(()),
    }
}

/// A robot that loads.
struct Checked {
    survey: Survey,
    loaded: Loaded,
    /// The robot, if it can harvest here.
    robot: Option<RobotModel>,
    /// Size of all collision meshes \[bytes\].
    bytes: usize,
}

fn check(args: &Args) -> Result<Checked, Failure> {
    let text = read(&args.urdf, orchard_input::ROBOT)?;
    let bad = |e: &dyn std::fmt::Display| Failure::BadInput(e.to_string());
    let config = match &args.mapping {
        Some(path) => {
            RobotConfig::from_toml(&path.display().to_string(), &read(path, orchard_input::CONFIG)?)
        }
        None => RobotConfig::from_toml("ridgeback-fr3/robot.toml", PAPER_TOML),
    };
    let config = config.map_err(|e| bad(&e))?;
    let limits = match (&args.limits, &args.mapping) {
        (Some(path), _) => {
            Limits::from_toml(&path.display().to_string(), &read(path, orchard_input::CONFIG)?)
        }
        (None, Some(_)) => Ok(config.limits.clone()),
        (None, None) => Ok(Limits::default()),
    };
    let limits = limits.map_err(|e| bad(&e))?;
    let beside = args.mapping.as_ref().and_then(|path| path.parent()).unwrap_or(Path::new(""));
    let own = config.package_path.iter().map(|folder| beside.join(folder));
    let packages: Vec<PathBuf> = args.package_path.iter().cloned().chain(own).collect();
    let mut files = MeshFiles::new(&args.urdf, &packages).map_err(|e| bad(&e))?;
    let loaded = Articulation::load(&text, &mut files, &limits)
        .map_err(|e| Failure::BadInput(format!("{}: {e}", args.urdf.display())))?;
    let survey = Survey::of(&text, &loaded, &config);
    let robot = RobotModel::of(&text, loaded.articulation.clone(), &config).ok();
    Ok(Checked { survey, loaded, robot, bytes: files.bytes })
}

/// Parts for the picture: those of the mapping that the robot has, else the guesses.
fn parts(survey: &Survey, guesses: &Draft) -> picture::Parts {
    let names = |role: &str| {
        let found = survey.roles.iter().find(|facts| facts.role == role && facts.is_there);
        match found {
            Some(facts) => facts.wanted.split(' ').map(str::to_owned).collect(),
            None => guesses.names(role).to_vec(),
        }
    };
    picture::Parts {
        arm: names("arm_joints"),
        fingers: names("finger_joints"),
        base: names("base_link").first().cloned(),
        tool: names("tcp_link").first().cloned(),
    }
}

fn read(path: &Path, most: u64) -> Result<String, Failure> {
    orchard_input::text(path, most)
        .map_err(|e| Failure::BadInput(format!("cannot read {}: {e}", path.display())))
}

#[cfg(test)]
mod tests;

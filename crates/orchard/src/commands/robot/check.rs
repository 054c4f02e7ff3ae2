//! `orchard robot check`: lists the content of a URDF file and the missing parts of a harvester.

use std::path::{Path, PathBuf};

use orchard_bench::store::write_json;
use orchard_robot::{PAPER_TOML, RobotConfig, Survey};

use super::{meshes, table};
use crate::failure::Failure;

/// Reads any URDF file and reports joints, limits, masses, and the parts missing for the benchmark.
#[derive(clap::Args)]
#[command(
    after_help = "Output:\n  joints   type, axis and the limits of position, velocity and effort (rad or m, rad/s or m/s, N m or N)\n  \
                  links    mass, and a check of the inertia: positive definite, and no principal moment\n           \
                  larger than the sum of the others\n  \
                  totals, the outline of the base on the ground, and the parts that a harvester needs: a planar base,\n  \
                  a height servo, an arm of seven hinges, two fingers, hand, tool point and bucket, by the names in the\n  \
                  config. A file without these parts is valid but cannot be used in the benchmark.\n\n\
                  Errors (exit code 2, one line that names the place): a missing file; invalid XML; a missing mesh file;\n\
                  a cycle of joints; two roots; duplicate names; a moving link without mass; an unknown joint type; a\n\
                  revolute or prismatic joint without limits; a limit without velocity; a mimic of a missing joint.\n\n\
                  Meshes are searched relative to the URDF; package://NAME/PATH in each parent folder, as NAME/PATH or, in\n\
                  a folder called NAME, as PATH. Mesh shapes are not read: collision shapes are boxes, cylinders, capsules\n\
                  and spheres.\n\n\
                  Examples:\n  orchard robot check --urdf assets/robots/ridgeback_fr3.urdf\n  \
                  orchard robot check --urdf my_arm.urdf --json my_arm.json\n  \
                  orchard robot check --urdf my_robot.urdf --config my_robot.toml    with your own names of the parts"
)]
pub struct Args {
    /// URDF file of the robot
    #[arg(long, value_name = "FILE")]
    urdf: PathBuf,
    /// Also write the report to a JSON file; missing limits are null
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Config with the names of the parts [default: configs/paper/robot.toml]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let survey = survey(&args.urdf, args.config.as_deref())?;
    say!("{}", table::text(&survey).trim_end());
    if let Some(path) = &args.json {
        write_json(path, &survey).map_err(|e| Failure::of_file(&e))?;
    }
    Ok(())
}

fn survey(urdf: &Path, config: Option<&Path>) -> Result<Survey, Failure> {
    let text = read(urdf, orchard_input::ROBOT)?;
    let config = match config {
        Some(path) => {
            RobotConfig::from_toml(&path.display().to_string(), &read(path, orchard_input::CONFIG)?)
        }
        None => RobotConfig::from_toml("paper/robot.toml", PAPER_TOML),
    };
    let config = config.map_err(|e| Failure::BadInput(e.to_string()))?;
    let survey =
        Survey::read(&text, &config).map_err(|e| Failure::BadInput(format!("{}: {e}", urdf.display())))?;
    meshes::find_all(urdf, &survey.meshes)
        .map_err(|line| Failure::BadInput(format!("{}: {line}", urdf.display())))?;
    Ok(survey)
}

fn read(path: &Path, most: u64) -> Result<String, Failure> {
    orchard_input::text(path, most)
        .map_err(|e| Failure::BadInput(format!("cannot read {}: {e}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: &str = "<limit lower='-1' upper='1' effort='5' velocity='2'/>";

    fn link(name: &str, mass: &str) -> String {
        format!(
            "<link name='{name}'><inertial><mass value='{mass}'/>\
             <inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link>"
        )
    }

    fn joint(name: &str, kind: &str, ends: [&str; 2], inside: &str) -> String {
        let [parent, child] = ends;
        format!(
            "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{inside}</joint>"
        )
    }

    /// Two links and a hinge between them, to be spoiled.
    fn hinge(kind: &str, inside: &str) -> String {
        link("a", "1") + &link("b", "1") + &joint("j", kind, ["a", "b"], inside)
    }

    fn check(inside: &str) -> Result<Survey, String> {
        check_text(&format!("<robot name='r'>{inside}</robot>"))
    }

    fn check_text(text: &str) -> Result<Survey, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("robot.urdf");
        std::fs::write(&path, text).unwrap();
        match survey(&path, None) {
            Ok(survey) => Ok(survey),
            Err(Failure::BadInput(line)) => Err(line),
            Err(other) => panic!("not bad input: {other}"),
        }
    }

    #[test]
    fn each_kind_of_bad_file_is_refused_by_the_name_of_the_place() {
        let good = hinge("revolute", LIMIT);
        assert!(check(&good).is_ok());
        let circle = joint("k", "revolute", ["b", "a"], LIMIT);
        let mesh =
            "<link name='m'><collision><geometry><mesh filename='no.stl'/></geometry></collision></link>";
        let no_velocity = "<limit lower='-1' upper='1' effort='5'/>";
        let cases: [(String, &[&str]); 16] = [
            (mesh.to_owned(), &["link `m`", "no.stl"]),
            (format!("{good}{circle}"), &["cycle"]),
            (format!("{good}{}", link("c", "1")), &["`a`", "`c`", "not connected"]),
            (good.replacen(&link("b", "1"), &link("b", "0"), 1), &["link `b`", "mass"]),
            (good.replacen(&link("b", "1"), &link("b", "-1"), 1), &["link `b`", "negative"]),
            (hinge("winch", LIMIT), &["joint `j`", "winch"]),
            (hinge("spherical", ""), &["joint `j`", "spherical"]),
            (hinge("revolute", ""), &["joint `j`", "limit"]),
            (hinge("revolute", no_velocity), &["joint `j`", "velocity"]),
            (hinge("continuous", no_velocity), &["joint `j`", "velocity"]),
            (hinge("prismatic", "<limit lower='-1' upper='1' velocity='1'/>"), &["joint `j`", "effort"]),
            (hinge("revolute", &format!("{LIMIT}<mimic joint='nobody'/>")), &["joint `j`", "nobody"]),
            (format!("{good}{}", link("a", "1")), &["two links", "`a`"]),
            (
                format!("{good}{}{}", link("c", "1"), joint("j", "revolute", ["b", "c"], LIMIT)),
                &["two joints", "`j`"],
            ),
            (joint("j", "revolute", ["a", "b"], LIMIT), &["joint `j`", "no link `a`"]),
            (String::new(), &["no link"]),
        ];
        for (text, words) in cases {
            let line = check(&text).expect_err(&text);
            assert!(line.contains("robot.urdf: ") && !line.contains('\n'), "{line}");
            assert!(words.iter().all(|w| line.contains(w)), "{line}: {words:?}");
        }
        assert!(check_text("no xml").unwrap_err().contains("URDF cannot be read"));
        let missing = survey(Path::new("no/such.urdf"), None);
        assert!(matches!(missing, Err(Failure::BadInput(line)) if line.contains("no/such.urdf")));
    }

    /// Massless links that joints move are refused wherever they are; massless frames are not.
    #[test]
    fn links_without_mass_between_moving_joints_are_refused() {
        let chain = |middle: &str| {
            let [a, c] = ["a", "c"].map(|name| link(name, "1"));
            let first = joint("j", "revolute", ["a", "b"], LIMIT);
            format!("{a}{middle}{c}{first}{}", joint("k", "revolute", ["b", "c"], LIMIT))
        };
        assert!(check(&chain("<link name='b'/>")).unwrap_err().contains("link `b`"));
        let frame = format!("{}<link name='f'/>{}", link("b", "1"), joint("w", "fixed", ["b", "f"], ""));
        assert!(check(&chain(&frame)).is_ok());
    }

    #[test]
    fn another_robot_is_reported_with_what_it_lacks() {
        let mesh = "<collision><geometry><mesh filename='package://arm/meshes/a.stl'/></geometry></collision></link>";
        let text = hinge("revolute", LIMIT).replacen("</link>", mesh, 1);
        let text = text.replacen("izz='0.1'", "izz='0.5'", 1);
        let folder = tempfile::tempdir().unwrap();
        let urdf = folder.path().join("arm/urdf/robot.urdf");
        std::fs::create_dir_all(folder.path().join("arm/meshes")).unwrap();
        std::fs::create_dir_all(urdf.parent().unwrap()).unwrap();
        std::fs::write(&urdf, format!("<robot name='r'>{text}</robot>")).unwrap();
        let missing = survey(&urdf, None);
        assert!(matches!(missing, Err(Failure::BadInput(line)) if line.contains("meshes/a.stl")));
        std::fs::write(folder.path().join("arm/meshes/a.stl"), "solid").unwrap();
        let survey = survey(&urdf, None).unwrap();
        assert_eq!(survey.meshes.len(), 1);
        assert!(survey.obstacle.is_some() && survey.roles.iter().all(|r| !r.is_there));
        assert_eq!(survey.roles.iter().find(|r| r.role == "arm_joints").unwrap().candidates, ["j"]);
        let table = table::text(&survey);
        for words in ["a principal moment is 2.50 times the sum", "revolute", "arm_joints", "a.stl"] {
            assert!(table.contains(words), "{words}: {table}");
        }
    }

    #[test]
    fn our_robot_lacks_nothing() {
        let survey = check_text(orchard_robot::PAPER_URDF).unwrap();
        assert_eq!(survey.obstacle, None);
        assert!(survey.roles.iter().all(|r| r.is_there), "{:?}", survey.roles);
        assert!((survey.mass - orchard_robot::RobotModel::paper().mass()).abs() < 1e-9);
        // The chassis is 0.96 m x 0.80 m and the bucket stands within it.
        assert_eq!(survey.footprint, [[-0.48, -0.4], [0.48, -0.4], [0.48, 0.4], [-0.48, 0.4]]);
        let json = serde_json::to_value(&survey).unwrap();
        assert_eq!(json["joints"].as_array().unwrap().len(), survey.joints.len());
        println!("{}", table::text(&survey));
    }
}

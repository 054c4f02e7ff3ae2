//! Bad and good files, as the command meets them.

use super::*;

const LIMIT: &str = "<limit lower='-1' upper='1' effort='5' velocity='2'/>";

fn link(name: &str, inside: &str) -> String {
    format!(
        "<link name='{name}'><inertial><mass value='1'/>\
         <inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial>{inside}</link>"
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
    link("a", "") + &link("b", "") + &joint("j", kind, ["a", "b"], inside)
}

fn collision(file: &str) -> String {
    format!("<collision><geometry><mesh filename='{file}'/></geometry></collision>")
}

fn arguments(urdf: &Path) -> Args {
    Args {
        urdf: urdf.to_owned(),
        mapping: None,
        write_mapping: None,
        package_path: Vec::new(),
        limits: None,
        json: None,
        picture: None,
        ik: None,
        require_harvest: false,
    }
}

/// Outcome for the links and joints of a robot beside which lie a good mesh and bad ones.
fn outcome(inside: &str) -> Result<Survey, String> {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    let corners = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0";
    let ascii =
        format!("solid t\nfacet normal 0 0 1\nouter loop\n{corners}\nendloop\nendfacet\nendsolid t\n");
    write("flat.stl", ascii.as_bytes());
    write("nan.stl", ascii.replace("vertex 1 0 0", "vertex nan 0 0").as_bytes());
    write("large.obj", b"v 0 0 0\nv 350 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n");
    let mut many = vec![0; 84];
    many[80..].copy_from_slice(&10_000_000_u32.to_le_bytes());
    write("many.stl", &many);
    many[80..].copy_from_slice(&100_u32.to_le_bytes());
    write("cut.stl", &many);
    write("robot.urdf", format!("<robot name='r'>{inside}</robot>").as_bytes());
    match check(&arguments(&folder.path().join("robot.urdf"))) {
        Ok(checked) => Ok(checked.survey),
        Err(Failure::BadInput(line)) => Err(line),
        Err(other) => panic!("not bad input: {other}"),
    }
}

#[test]
fn each_kind_of_bad_file_is_refused_by_the_name_of_the_place() {
    let good = hinge("revolute", LIMIT);
    assert!(outcome(&good).is_ok());
    let circle = joint("k", "revolute", ["b", "a"], LIMIT);
    let with_mesh = |file: &str| link("m", &collision(file));
    let many_joints: String = (0..200)
        .map(|i| {
            let (from, to) = (format!("l{i}"), format!("l{}", i + 1));
            link(&to, "") + &joint(&format!("j{i}"), "continuous", [&from, &to], "")
        })
        .collect();
    let cases: [(String, &[&str]); 20] = [
        (with_mesh("no.stl"), &["link `m`", "no.stl", "--package-path"]),
        (with_mesh("/etc/passwd"), &["link `m`", "/etc/passwd", "outside"]),
        (with_mesh("many.stl"), &["link `m`", "many.stl", "10000000 triangles", "1000000"]),
        (with_mesh("cut.stl"), &["link `m`", "cut.stl", "states 100 triangles and holds 0"]),
        (with_mesh("nan.stl"), &["link `m`", "nan.stl", "not finite"]),
        (with_mesh("large.obj"), &["link `m`", "large.obj", "350 m", "millimetres", "0.001"]),
        (with_mesh("robot.urdf"), &["link `m`", "robot.urdf", ".stl, .obj and .dae"]),
        (format!("{}{many_joints}", link("l0", "")), &["128 joints that move"]),
        (format!("{good}{circle}"), &["cycle"]),
        (format!("{good}{}", link("c", "")), &["`a`", "`c`", "not connected"]),
        (good.replacen("mass value='1'", "mass value='-1'", 2), &["link `a`", "negative"]),
        (good.replacen("mass value='1'", "mass value='nan'", 1), &["link `a`", "finite"]),
        (hinge("winch", LIMIT), &["joint `j`", "winch"]),
        (
            hinge("revolute", "<limit lower='1' upper='-1' effort='1' velocity='1'/>"),
            &["joint `j`", "--limits"],
        ),
        (hinge("revolute", &format!("{LIMIT}<mimic joint='nobody'/>")), &["joint `j`", "nobody"]),
        (format!("{good}{}", link("a", "")), &["two links", "`a`"]),
        (
            format!("{good}{}{}", link("c", ""), joint("j", "revolute", ["b", "c"], LIMIT)),
            &["two joints", "`j`"],
        ),
        (joint("j", "revolute", ["a", "b"], LIMIT), &["joint `j`", "no link `a`"]),
        (hinge("revolute", "<origin xyz='${x} 0 0'/>"), &["${x}", "`j`", "xacro robot.xacro > robot.urdf"]),
        (String::new(), &["no link"]),
    ];
    for (text, words) in cases {
        let start = Instant::now();
        let line = outcome(&text).expect_err(&text);
        assert!(start.elapsed().as_secs_f64() < 1.0, "{line}");
        assert!(line.contains("robot.urdf: ") && !line.contains('\n'), "{line}");
        assert!(words.iter().all(|w| line.contains(w)), "{line}: {words:?}");
    }
    let missing = check(&arguments(Path::new("no/such.urdf")));
    assert!(matches!(missing, Err(Failure::BadInput(line)) if line.contains("no/such.urdf")));
}

#[test]
fn another_robot_is_reported_with_what_it_lacks() {
    let inside = collision("flat.stl") + "<visual><geometry><mesh filename='gone.dae'/></geometry></visual>";
    let text = hinge("continuous", "").replacen("</link>", &format!("{inside}</link>"), 1);
    let survey = outcome(&text.replacen("izz='0.1'", "izz='0.5'", 1)).unwrap();
    assert_eq!(survey.meshes.len(), 2);
    assert!(survey.obstacle.is_some() && survey.roles.iter().all(|r| !r.is_there));
    assert_eq!(survey.roles.iter().find(|r| r.role == "arm_joints").unwrap().candidates, ["j"]);
    let table = table::text(&survey);
    for words in [
        "a principal moment is 2.50 times the sum",
        "arm_joints",
        "mesh `flat.stl` is flat",
        "visual mesh `gone.dae` cannot be found",
        "joint `j` has no usable limit of velocity and effort",
        "cannot harvest here",
    ] {
        assert!(table.contains(words), "{words}: {table}");
    }
    let json = serde_json::to_value(&survey).unwrap();
    assert_eq!(json["warnings"].as_array().unwrap().len(), survey.warnings.len());
    assert_eq!(json["warnings"][0]["kind"], "no_limit");
}

#[test]
fn our_robot_lacks_nothing_and_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("robot.urdf");
    std::fs::write(&urdf, orchard_robot::PAPER_URDF).unwrap();
    let (picture, mapping) = (folder.path().join("r.png"), folder.path().join("r.toml"));
    let args = Args {
        picture: Some(picture.clone()),
        write_mapping: Some(mapping.clone()),
        require_harvest: true,
        ..arguments(&urdf)
    };
    run(&args).unwrap();
    assert!(std::fs::read(picture).unwrap().starts_with(b"\x89PNG"));
    let survey = check(&args).unwrap().survey;
    assert_eq!((survey.obstacle, survey.warnings), (None, Vec::new()));
    assert!((survey.mass - orchard_robot::RobotModel::paper().mass()).abs() < 1e-9);
    // The chassis is 0.96 m x 0.80 m and the bucket stands within it.
    assert_eq!(survey.footprint, [[-0.48, -0.4], [0.48, -0.4], [0.48, 0.4], [-0.48, 0.4]]);
    // The guesses about our own robot are right, so the draft can be used as it is.
    let again = Args { mapping: Some(mapping), ..args };
    assert!(run(&again).is_ok());
}

#[test]
fn a_robot_that_cannot_harvest_ends_with_exit_code_3_where_that_is_required() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("robot.urdf");
    std::fs::write(&urdf, format!("<robot name='r'>{}</robot>", hinge("revolute", LIMIT))).unwrap();
    assert!(run(&arguments(&urdf)).is_ok());
    let required = run(&Args { require_harvest: true, ..arguments(&urdf) }).unwrap_err();
    assert_eq!(format!("{:?}", required.exit_code()), format!("{:?}", std::process::ExitCode::from(3)));
}

#[test]
fn limits_from_a_file_replace_those_of_the_urdf() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("robot.urdf");
    std::fs::write(&urdf, format!("<robot name='r'>{}</robot>", hinge("continuous", ""))).unwrap();
    let limits = folder.path().join("limits.toml");
    let args = Args { limits: Some(limits.clone()), ..arguments(&urdf) };
    std::fs::write(&limits, "[j]\nlower = -2.0\nupper = 2.0\nvelocity = 1.5\neffort = 30\n").unwrap();
    let joint = &check(&args).unwrap().survey.joints[0];
    assert_eq!(
        (joint.lower, joint.upper, joint.velocity, joint.effort),
        (Some(-2.0), Some(2.0), Some(1.5), Some(30.0))
    );
    for (text, words) in [
        ("[k]\nlower = 0.0", ["limits file", "`k`"]),
        ("[j]\nlower = 1.0\nupper = 0.0", ["limits.toml", "j.lower"]),
        ("[j]\nspeed = 1.0", ["limits.toml", "speed"]),
        ("[j]\nvelocity = -1.0", ["limits.toml", "j.velocity"]),
        ("[j]\nlower = nan", ["limits.toml", "j.lower"]),
        ("j = 3", ["limits.toml", "j"]),
    ] {
        std::fs::write(&limits, text).unwrap();
        let Err(Failure::BadInput(line)) = check(&args) else { panic!("{text}") };
        assert!(words.iter().all(|w| line.contains(w)), "{line}: {words:?}");
    }
}

//! Options to scenarios: names, files, layers, hashes, and what a user can get wrong.

use orchard_scenario::{Options, Scenario, StoredScenario, controllers};

fn of(options: &[(&str, &str)]) -> Scenario {
    Scenario::of(options).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(options: &[(&str, &str)]) -> String {
    Scenario::of(options).unwrap_err().to_string()
}

#[test]
fn no_options_are_the_benchmarks_own_scenario() {
    let scenario = of(&[]);
    assert_eq!(*scenario.names(), orchard_scenario::Names::paper("baseline"));
    assert_eq!(**scenario.spec(), orchard_spec::Spec::paper());
    assert_eq!(scenario.differences(), None);
    // Naming the defaults changes nothing.
    let named = of(&[("preset", "paper"), ("camera", "paper"), ("detector", "paper"), ("robot", "paper")]);
    assert_eq!((named.hash(), named.names()), (scenario.hash(), scenario.names()));
}

#[test]
fn every_part_is_in_the_hash_and_the_controller_not_in_the_scenes() {
    let base = of(&[]);
    let others = [
        ("preset", "v-trellis"),
        ("randomisation", "0.5"),
        ("camera", "d435i"),
        ("detector", "d435i"),
        ("controller", "expert"),
    ];
    for option in others {
        let other = of(&[option]);
        assert_ne!(other.hash(), base.hash(), "{option:?}");
        assert_eq!(other.scene_hash() == base.scene_hash(), option.0 == "controller", "{option:?}");
    }
}

#[test]
fn a_camera_brings_its_default_detector() {
    assert_eq!(of(&[("camera", "d435i")]).names().scene.detector, "learned");
    assert_eq!(of(&[("camera", "ideal")]).names().scene.detector, "paper");
    assert_eq!(of(&[("camera", "d435i"), ("detector", "paper")]).names().scene.detector, "paper");
}

/// Strength 1 on preset `paper` is the preset `randomised`; strength 0 on that is `paper` again.
#[test]
fn randomisation_is_one_strength_on_all_axes() {
    let (paper, randomised) = (of(&[]), of(&[("preset", "randomised")]));
    assert_eq!(of(&[("randomisation", "1")]).spec().randomisation, randomised.spec().randomisation);
    let off = of(&[("preset", "randomised"), ("randomisation", "0")]);
    assert_eq!(off.spec().randomisation, paper.spec().randomisation);
    for bad in ["2", "-0.1", "much", "nan"] {
        let e = refused(&[("randomisation", bad)]);
        assert!(e.starts_with(&format!("--randomisation {bad}: must be a strength in [0, 1]")), "{e}");
    }
}

#[test]
fn what_a_user_can_get_wrong_names_the_option_and_what_there_is() {
    let e = refused(&[("preset", "lemon")]);
    assert!(e.starts_with("--preset: ") && e.contains("'lemon'") && e.contains("v-trellis"), "{e}");
    let e = refused(&[("camera", "eye")]);
    assert!(e.starts_with("--camera: no camera 'eye'; the cameras are: ideal, paper, d435i"), "{e}");
    let e = refused(&[("robot", "r2")]);
    assert_eq!(
        e,
        "--robot: no robot 'r2'; the robots are: ridgeback-fr3, fr3-fixed, rail-xarm6-suction, husky-ur5e-2f85"
    );
    let e = refused(&[("robot", "no/such.toml")]);
    assert!(e.starts_with("--robot no/such.toml: ") && e.matches("no/such.toml").count() == 1, "{e}");
    let e = refused(&[("controller", "nobody")]);
    assert!(e.starts_with("--controller: no controller 'nobody'; the controllers are: baseline"), "{e}");
    let e = refused(&[("config", "no/such.toml")]);
    assert!(e.starts_with("--config no/such.toml: "), "{e}");
    let e = refused(&[("tree", "tree.txt")]);
    assert_eq!(e, "--tree tree.txt: the file name must end in .json or .mtg");
    let e = refused(&[("preset", "paper"), ("config", "mine.toml")]);
    assert!(e.starts_with("--preset and --config: "), "{e}");
}

/// A file of changed figures makes a variant of a built-in robot: its own name and hash, all else as it was; a result keeps what it needs.
#[test]
fn figures_of_a_built_in_robot_can_be_changed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("heavy.toml");
    let named = file.display().to_string();
    let write = |base: &str| {
        let error =
            "gravity_error = { value = 0.05, range = [-0.2, 0.2], unit = \"1\", source = \"protocol\" }";
        std::fs::write(&file, format!("base = \"{base}\"\n[arm]\n{error}\n")).unwrap();
    };
    write("fr3-fixed");
    let (variant, plain) = (of(&[("robot", &named)]), of(&[("robot", "fr3-fixed")]));
    assert_eq!(variant.names().scene.robot, "heavy");
    assert_ne!(variant.hash(), plain.hash());
    let mut arm = variant.robot().config().arm.clone();
    assert_eq!(arm.gravity_error.take().unwrap().si(), 0.05);
    assert_eq!(arm, plain.robot().config().arm);
    let stored = variant.stored();
    std::fs::remove_file(&file).unwrap();
    let restored = Scenario::from_stored(&stored, &controllers(), "plan.json").unwrap();
    assert_eq!((restored.hash(), restored.robot().config()), (variant.hash(), variant.robot().config()));
    write("common");
    let e = refused(&[("robot", &named)]);
    assert!(e.contains("heavy.toml: base: no robot 'common'; the robots are: ridgeback-fr3"), "{e}");
}

#[test]
fn a_scenario_file_holds_options_and_the_command_line_wins() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    let config = "base = \"paper\"\npreset = \"mine\"\n[tree]\nheight = { value = 2.2, range = [0.5, 6.0], unit = \"m\", source = \"protocol\" }\n";
    std::fs::write(folder.path().join("world.toml"), config).unwrap();
    std::fs::write(
        &file,
        "config = \"world.toml\"\nrandomisation = 0.5\ncamera = \"d435i\"\ncontroller = \"expert\"\n",
    )
    .unwrap();
    let options = Options::from_file(&file).unwrap();
    let scenario = Scenario::resolve(&options, &controllers()).unwrap();
    let names = scenario.names();
    assert_eq!((&*names.scene.preset, &*names.scene.camera, &*names.controller), ("mine", "d435i", "expert"));
    let height = scenario.figures().into_iter().find(|f| f.path == "world.tree.height").unwrap();
    assert!(height.from.ends_with("world.toml") && height.source == "protocol", "{height:?}");
    let density = scenario.figures().into_iter().find(|f| f.path == "world.wood.density").unwrap();
    assert_eq!(density.from, "preset paper");
    // A preset on the command line takes the place of the file's config.
    let above = Options::of(&[("preset", "v-trellis"), ("controller", "baseline")]).unwrap();
    let scenario = Scenario::resolve(&above.over(options), &controllers()).unwrap();
    let names = scenario.names();
    assert_eq!(
        (&*names.scene.preset, &*names.scene.camera, &*names.controller),
        ("v-trellis", "d435i", "baseline")
    );
    for (text, problem) in [("colour = 1", "colour"), ("preset = ", ""), ("camera = \"eye\"", "eye")] {
        std::fs::write(&file, text).unwrap();
        let e = Options::from_file(&file).and_then(|options| Scenario::resolve(&options, &controllers()));
        let e = e.unwrap_err().to_string();
        assert!(e.contains("mine.toml") && e.contains(problem), "{e}");
    }
}

#[test]
fn stored_scenarios_come_back_and_forged_ones_are_refused() {
    for options in
        [&[("preset", "vertical-ufo"), ("camera", "d435i")][..], &[("controller", "expert")][..], &[]]
    {
        let scenario = of(options);
        let text = serde_json::to_string(&scenario.stored()).unwrap();
        let stored: StoredScenario = serde_json::from_str(&text).unwrap();
        let back = Scenario::from_stored(&stored, &controllers(), "plan.json").unwrap();
        assert_eq!((back.hash(), back.names()), (scenario.hash(), scenario.names()));
        let mut forged = stored.clone();
        forged.world.wood.density = forged.world.wood.density.with_value(800.0).unwrap();
        let e = Scenario::from_stored(&forged, &controllers(), "plan.json").unwrap_err().to_string();
        assert!(e.starts_with("plan.json: the stored hash "), "{e}");
    }
}

/// The leaves and fruit of a digitised tree differ from world to world, its wood does not.
#[test]
fn a_digitised_tree_stands_in_every_world() {
    let grown = of(&[]).planting(20250704, 0).unwrap().skeleton;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("measured.json");
    std::fs::write(&file, orchard_digitised::json::write(&grown)).unwrap();
    let scenario = of(&[("tree", file.to_str().unwrap()), ("preset", "v-trellis")]);
    assert_eq!(scenario.names().scene.tree, "measured.json");
    let [a, b] = [0, 1].map(|world| scenario.world(1, world, 0).unwrap());
    assert_eq!(a.skeleton().segments, grown.segments);
    assert_eq!(b.skeleton().segments, grown.segments);
    assert_ne!(a.x_world_odom(), scenario.world(1, 0, 1).unwrap().x_world_odom());
}

/// Units and plant of an MTG file are options; a result keeps them; the file may be Latin-1.
#[test]
fn unit_and_plant_of_a_tree_are_options() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("measured.mtg");
    let text = "# mesur\u{e9}\nCODE:\tFORM-A\nCLASSES:\nP\t1\nU\t2\nFEATURES:\nXX\tREAL\nYY\tREAL\nZZ\tREAL\nTopDia\tREAL\nMTG:\n\
                TOPO\tXX\tYY\tZZ\tTopDia\n/P1/U1\t0\t0\t900\t400\n/P2/U1\t0\t0\t2000\t400\n";
    std::fs::write(&file, text.chars().map(|c| c as u8).collect::<Vec<u8>>()).unwrap();
    let tree = ("tree", file.to_str().unwrap());
    let scenario = of(&[tree, ("tree-unit", "mm,0.1mm"), ("tree-plant", "P2")]);
    let trunk = |scenario: &Scenario| {
        scenario.digitised_tree().unwrap().skeleton(scenario.spec(), 1, 0).segments[0].clone()
    };
    assert!((trunk(&scenario).length - 2.0).abs() < 1e-12 && (trunk(&scenario).radius - 0.02).abs() < 1e-12);
    assert!(scenario.digitised_tree().unwrap().notes().is_empty());
    let stored = serde_json::to_string(&scenario.stored()).unwrap();
    let restored =
        Scenario::from_stored(&serde_json::from_str(&stored).unwrap(), &controllers(), "plan.json").unwrap();
    assert_eq!((restored.hash(), trunk(&restored)), (scenario.hash(), trunk(&scenario)));
    assert_ne!(scenario.hash(), of(&[tree, ("tree-unit", "mm,0.1mm"), ("tree-plant", "P1")]).hash());
    let e = refused(&[tree]);
    assert!(
        e.starts_with(&format!("--tree {}: the file states no unit", tree.1)) && e.contains("--tree-unit"),
        "{e}"
    );
    let e = refused(&[tree, ("tree-unit", "inch")]);
    assert!(e.ends_with("the unit \"inch\" is no unit: m, cm, mm, or a multiple such as 0.1mm"), "{e}");
    let e = refused(&[("tree-plant", "P2")]);
    assert_eq!(e, "--tree-plant P2: there is no digitised tree: --tree FILE gives one");
}

use super::*;
use orchard_scenario::Scenario;

fn ask(driver: &str) -> Ask {
    Ask { driver: driver.to_owned(), ..Ask::default() }
}

/// A session moves as the benchmark's episode does: the same world, controller and commands, bit for bit.
#[test]
fn a_session_is_the_episode_of_the_benchmark() {
    let scenario = Scenario::of(&[("controller", "expert")]).unwrap();
    let mut world = scenario.world(20250704, 0, 0).unwrap();
    let mut controller = scenario.controller();
    let mut tab = grow(&ask("expert"), &Files::default()).unwrap();
    for _ in 0..120 {
        let command = controller.act(&world.observe());
        world.step(&command);
        tab.step();
        assert_eq!(tab.session().world().state_digest(), world.state_digest());
    }
    assert!(tab.told().told.state.is_some() && tab.told().told.time == 2.0);
}

/// The names mean what they mean on the command line.
#[test]
fn presets_are_those_of_scenarios() {
    for preset in orchard_scenario::presets() {
        let scenario = Scenario::of(&[("preset", preset)]).unwrap();
        let parts = Ask { preset: preset.into(), ..Ask::default() }.parts().unwrap();
        assert!(parts.spec == *scenario.spec() && parts.detector == *scenario.detector(), "{preset}");
        assert_eq!(parts.robot.articulation(), scenario.robot().articulation());
    }
}

#[test]
fn robots_and_cameras_are_those_of_scenarios() {
    let named = |robot: &str, camera: &str| Ask {
        robot: robot.into(),
        camera: Some(camera.into()),
        ..Ask::default()
    };
    let robots = orchard_scenario::robots().into_iter().map(|robot| (robot, "paper"));
    let cameras = orchard_scenario::cameras().into_iter().map(|camera| (RobotModel::PAPER, camera));
    for (robot, camera) in robots.chain(cameras) {
        let scenario = Scenario::of(&[("robot", robot), ("camera", camera)]).unwrap();
        let parts = named(robot, camera).parts().unwrap();
        assert!(parts.spec == *scenario.spec() && parts.detector == *scenario.detector(), "{camera}");
        assert_eq!(parts.robot.articulation(), scenario.robot().articulation());
    }
    let e = |ask: Ask| ask.parts().map(|_| ()).unwrap_err().to_string();
    assert!(e(named("mule", "paper")).starts_with("no robot 'mule'; the robots are: ridgeback-fr3, "));
    assert!(e(named("fr3-fixed", "box")).starts_with("no camera 'box'; the cameras are: "));
}

/// Another robot under another camera harvests as the scenario of the same names does.
#[test]
fn another_robot_moves_as_the_scenarios() {
    let options = [("robot", "rail-xarm6-suction"), ("camera", "d435i"), ("controller", "expert")];
    let scenario = Scenario::of(&options).unwrap();
    let (mut world, mut controller) = (scenario.world(20250704, 0, 0).unwrap(), scenario.controller());
    let [robot, camera] = ["rail-xarm6-suction", "d435i"].map(str::to_owned);
    let mut tab = grow(&Ask { robot, camera: Some(camera), ..ask("expert") }, &Files::default()).unwrap();
    for _ in 0..20 {
        let command = controller.act(&world.observe());
        world.step(&command);
        tab.step();
    }
    assert_eq!(tab.session().world().state_digest(), world.state_digest());
}

#[test]
fn what_cannot_be_grown_is_named_with_what_can() {
    let refused = |ask: Ask| grow(&ask, &Files::default()).map(|_| ()).unwrap_err().to_string();
    let e = refused(Ask { seed: "12x".into(), ..Ask::default() });
    assert_eq!(e, "seed `12x` is no whole number from 0 to 18446744073709551615");
    assert!(refused(Ask { seed: String::new(), ..Ask::default() }).starts_with("seed `` is no"));
    assert!(refused(Ask { seed: "18446744073709551616".into(), ..Ask::default() }).starts_with("seed `184"));
    let e = refused(Ask { preset: "lemon".into(), ..Ask::default() });
    assert!(e.starts_with("preset `lemon` is unknown; the presets are: paper, "), "{e}");
    let e = refused(ask("me"));
    assert_eq!(
        e,
        "driver `me` is unknown; the drivers are: expert, baseline, paper, nobody, and onnx:FILE.onnx"
    );
    for foliage in [-0.1, 3.5, f64::NAN] {
        let e = refused(Ask { foliage: Some(foliage), ..Ask::default() });
        assert!(e.starts_with("foliage: "), "{e}");
    }
    assert!(Ask::from_json("{").unwrap_err().to_string().starts_with("the options cannot be read: "));
    assert!(Ask::from_json(r#"{ "leaves": 1 }"#).unwrap_err().to_string().contains("leaves"));
}

#[test]
fn the_menu_has_the_names_that_can_be_asked_for() {
    let menu: serde_json::Value = serde_json::from_str(&crate::menu()).unwrap();
    let defaults: Ask = serde_json::from_value(menu["defaults"].clone()).unwrap();
    assert_eq!(defaults, Ask::default());
    assert!(menu["presets"].as_array().unwrap().iter().any(|name| *name == "tall-spindle"));
    assert_eq!(menu["foliage"], serde_json::json!([0.0, 3.0]));
}

#[test]
fn the_foliage_dial_changes_the_leaves() {
    let leaves = |foliage| {
        let tab = grow(&Ask { foliage: Some(foliage), ..ask("nobody") }, &Files::default()).unwrap();
        assert_eq!(tab.told().told.foliage, foliage);
        tab.session().world().skeleton().leaves.len()
    };
    assert!(leaves(0.0) == 0 && leaves(1.0) > leaves(0.3));
}

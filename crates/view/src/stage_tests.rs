use super::*;

fn stage(options: &[(&str, &str)]) -> Stage {
    let options = Options::of(options).unwrap();
    Stage::new(Setup { options, controllers: orchard_scenario::controllers(), seed: 20250704, index: 0 })
        .unwrap()
}

/// The viewer's world moves as the benchmark's does, bit for bit, whatever the scenario.
#[test]
fn the_world_on_show_is_the_scenarios() {
    let options = [("preset", "tall-spindle"), ("camera", "d435i"), ("controller", "expert")];
    let mut stage = stage(&options);
    let scenario = Scenario::of(&options).unwrap();
    let (mut world, mut controller) = (scenario.world(20250704, 0, 0).unwrap(), scenario.controller());
    for _ in 0..20 {
        let command = controller.act(&world.observe());
        world.step(&command);
        stage.session_mut().step();
    }
    assert_eq!(stage.session().world().state_digest(), world.state_digest());
}

#[test]
fn dials_grow_another_world_and_wrong_ones_keep_this() {
    let mut stage = stage(&[]);
    let leaves = |stage: &Stage| stage.session().world().skeleton().leaves.len();
    let before = (leaves(&stage), stage.session().world().state_digest());
    let dials = Dials { foliage: Some(0.1), wind: Some(4.0), ..stage.dials().clone() };
    stage.turn(dials.clone()).unwrap();
    assert!(leaves(&stage) < before.0 / 2 && stage.wind() == 4.0);
    assert_eq!(stage.session().world().spec().foliage.density.value(), 0.1);
    stage.turn(Dials { seed: 7, preset: Some("v-trellis".into()), ..dials.clone() }).unwrap();
    assert_eq!(stage.session().world().spec().preset, "v-trellis");
    let now = stage.session().world().state_digest();
    for wrong in [
        Dials { foliage: Some(99.0), ..dials.clone() },
        Dials { preset: Some("lemon".into()), ..dials.clone() },
        Dials { randomisation: Some(2.0), ..dials.clone() },
        Dials { driver: "me".into(), ..dials.clone() },
    ] {
        let e = stage.turn(wrong).unwrap_err();
        assert!(e.starts_with("the dial"), "{e}");
    }
    assert_eq!(stage.session().world().state_digest(), now);
}

#[test]
fn drivers_change_in_the_middle() {
    let mut stage = stage(&[]);
    assert_eq!(stage.dials().driver, "baseline");
    assert!(stage.drivers().iter().any(|name| name == "expert") && stage.drivers().contains(&NOBODY.into()));
    stage.session_mut().step();
    let digest = stage.session().world().state_digest();
    stage.drive_by(NOBODY).unwrap();
    assert!(stage.session().controller().is_none());
    stage.drive_by("expert").unwrap();
    assert!(stage.session().controller().is_some() && stage.drive_by("me").is_err());
    assert_eq!((stage.session().world().state_digest(), stage.dials().driver.as_str()), (digest, "expert"));
}

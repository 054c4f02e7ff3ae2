use super::*;

fn stage(options: &[(&str, &str)]) -> Stage {
    let options = Options::of(options).unwrap();
    Stage::new(Setup {
        options: Some(options),
        controllers: orchard_scenario::controllers(),
        seed: 20250704,
        index: 0,
    })
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
    assert!(leaves(&stage) < before.0, "{} leaves, {} before", leaves(&stage), before.0);
    assert_eq!(stage.wind(), 4.0);
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

/// A recorded episode runs as it was recorded, and the same at every frame to which one goes; whoever takes part makes another world of it.
#[test]
fn a_recording_is_scrubbed() {
    let scenario = Scenario::of(&[("controller", "expert")]).unwrap();
    let (mut world, mut controller) = (scenario.world(20250704, 0, 0).unwrap(), scenario.controller());
    let (mut commands, mut digests) = (Vec::new(), vec![world.state_digest()]);
    for _ in 0..150 {
        commands.push(controller.act(&world.observe()));
        world.step(commands.last().unwrap());
        digests.push(world.state_digest());
    }
    let setup = Setup {
        options: Some(Options::of(&[("controller", "expert")]).unwrap()),
        controllers: orchard_scenario::controllers(),
        seed: 20250704,
        index: 0,
    };
    let mut stage = Stage::of_recording(setup, scenario, 0, commands).unwrap();
    assert_eq!(stage.recorded_frames(), Some(150));
    let digest = |stage: &Stage| stage.session().world().state_digest();
    for frame in [70, 130, 61, 0, 150, 149, 7] {
        stage.seek(frame).unwrap();
        assert_eq!(digest(&stage), digests[frame as usize], "frame {frame}");
    }
    while stage.step() {}
    assert!(digest(&stage) == digests[150] && stage.is_as_recorded());
    stage.seek(100).unwrap();
    stage.session_mut().take_over();
    (0..10).for_each(|_| assert!(stage.step()));
    assert!(!stage.is_as_recorded() && digest(&stage) != digests[110]);
    stage.seek(110).unwrap();
    assert!(stage.is_as_recorded() && digest(&stage) == digests[110]);
    stage.drive_by(NOBODY).unwrap();
    stage.step();
    assert!(!stage.is_as_recorded());
    stage.reset();
    assert!(digest(&stage) == digests[0] && stage.dials().driver == RECORDED);
    // Another world is no recording.
    stage.turn(Dials { seed: 8, ..stage.dials().clone() }).unwrap();
    assert!(stage.recorded_frames().is_none() && stage.dials().driver == "expert");
}

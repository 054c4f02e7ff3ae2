use super::*;
use crate::harvest::plan::Extent;
use crate::harvest::worlds::Harvest;
use crate::protocol::Protocol;

fn scenario() -> Scenario {
    Scenario::of(&[]).unwrap()
}

fn matrix_of(protocol: &Protocol) -> Matrix {
    Matrix::of(protocol.matrix_rules(), &scenario()).unwrap()
}

fn matrix() -> Matrix {
    matrix_of(&Protocol::paper())
}

fn names_of(chosen: &[&MatrixCondition]) -> Vec<String> {
    chosen.iter().map(|condition| condition.name.clone()).collect()
}

#[test]
fn the_matrix_is_the_papers() {
    let all: Vec<String> = matrix().conditions.iter().map(|c| c.name.clone()).collect();
    let expected = [
        "nominal",
        "foliage-0",
        "foliage-0.3",
        "foliage-1",
        "foliage-1.5",
        "fruit-20",
        "fruit-60",
        "terrain-0.05",
        "terrain-0.1",
        "terrain-0.2",
        "exhaustion",
    ];
    assert_eq!(all, expected);
    let values: Vec<Vec<f64>> =
        matrix().sweeps.iter().map(|sweep| sweep.points.iter().map(|p| p.value).collect()).collect();
    assert_eq!(values, [vec![0.0, 0.3, 0.6, 1.0, 1.5], vec![20.0, 40.0, 60.0], vec![0.0, 0.05, 0.1, 0.2]]);
    // The nominal condition is in every sweep once.
    for sweep in matrix().sweeps {
        assert_eq!(sweep.points.iter().filter(|p| p.condition == NOMINAL).count(), 1, "{}", sweep.name);
    }
}

#[test]
fn sweeps_and_conditions_are_chosen_by_name() {
    let matrix = matrix();
    let choose = |list: &[&str]| {
        let list: Vec<String> = list.iter().map(|name| (*name).to_owned()).collect();
        matrix.choose(&list).map(|chosen| names_of(&chosen)).map_err(|e| e.to_string())
    };
    assert_eq!(choose(&["terrain-0.2", "nominal"]).unwrap(), ["nominal", "terrain-0.2"]);
    assert_eq!(choose(&["fruit", "nominal"]).unwrap(), ["nominal", "fruit-20", "fruit-60"]);
    // `DIAL-VALUE` with the nominal value is the nominal condition.
    assert_eq!(choose(&["fruit-40", "foliage-0.6", "terrain-0"]).unwrap(), ["nominal"]);
    assert!(choose(&["fruit-41"]).is_err());
    assert!(choose(&[]).unwrap().is_empty());
    let e = choose(&["windy"]).unwrap_err();
    assert!(
        e.starts_with(
            "windy is neither a condition nor a group or sweep of them; the names are foliage, fruit, terrain, nominal"
        ),
        "{e}"
    );
    // A sweep with only one condition is left out.
    assert!(matrix.sweeps_of(&["nominal", "exhaustion"]).is_empty());
    let cut = matrix.sweeps_of(&["nominal", "fruit-60"]);
    assert_eq!((cut.len(), cut[0].name.as_str(), cut[0].points.len()), (1, "fruit", 2));
}

#[test]
fn names_are_checked_without_worlds() {
    let protocol = Protocol::paper();
    let check = |list: &[&str]| {
        protocol.matrix_rules().check_names(&list.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
    };
    assert_eq!(check(&["nominal", "exhaustion", "fruit", "fruit-40", "fruit-20", "terrain-0.05"]), Ok(()));
    assert_eq!(check(&[]), Err("no condition".to_owned()));
    let e = check(&["nominal", "fruit-41"]).unwrap_err();
    assert!(
        e.starts_with(
            "fruit-41 is neither a condition nor a group or sweep of them; the names are foliage, fruit, terrain,"
        ),
        "{e}"
    );
}

/// In the field the populations, too, have conditions that run to exhaustion: their worlds, but for the exchange of the bucket, and the time of exhaustion.
#[test]
fn populations_run_to_exhaustion() {
    let harvest = Harvest::new(scenario().on_protocol("field")).unwrap();
    let horizon = harvest.protocol().exhaustion.horizon.si();
    let names: Vec<String> = ["nominal", "exhaustion", "exhaustions"].map(str::to_owned).into();
    let extent = Extent {
        profile: "full".into(),
        conditions: names,
        seeds: vec![1],
        trees: 1,
        repeats: 1,
        horizon_s: 75.0,
    };
    let plan = harvest.plan_of(extent).unwrap();
    assert_eq!(plan.conditions.len(), 8);
    for condition in &plan.conditions {
        let name = condition.name.as_str();
        assert_eq!(condition.params.horizon_s, if name == "nominal" { 75.0 } else { horizon }, "{name}");
        let mut spec = (**harvest.scenario_of(name).unwrap().spec()).clone();
        assert_eq!(spec.fruit.bucket_exchange.take().is_some(), is_exhaustion(name), "{name}");
        if let Some(own) = name.strip_prefix("exhaustion-") {
            assert!(spec == **field(own).spec(), "{name}");
            assert!(is_exhaustion(name) && !is_exhaustion(own));
        }
    }
    let mut wrong = Protocol::field();
    wrong.exhaustion.of.push("windy".into());
    let (at, problem) = wrong.matrix_rules().problem().unwrap();
    assert_eq!((at.as_str(), problem.as_str()), ("exhaustion.of", "windy is no single condition"));
}

/// The scenario of a condition of the benchmark in the field.
fn field(name: &str) -> Scenario {
    matrix_of(&Protocol::field()).condition(name).unwrap().of(&scenario()).unwrap()
}

#[test]
fn a_condition_changes_what_it_says_and_nothing_else() {
    let (own, paper) = (scenario(), Spec::paper());
    let same_but_spec = |changed: &Scenario| changed.with_spec(paper.clone()) == own;
    let figure = |name: &str, path: &str, value: f64, spec: Spec| {
        let changed = field(name);
        assert!(same_but_spec(&changed), "{name}");
        assert_eq!(changed.spec().figure(path).unwrap().value(), value, "{name}");
        assert_eq!(*changed.spec().with_figures("", &[]).as_ref().unwrap(), **changed.spec());
        // What is left when the dial is switched off again.
        assert_eq!(spec, paper, "{name}");
    };
    let of = |name: &str| (**field(name).spec()).clone();
    for speed in [3.0, 6.0, 9.0] {
        let name = format!("wind-{speed}");
        figure(&name, "wind.speed", speed, Spec { wind: None, ..of(&name) });
    }
    for name in ["odometry-0.05", "joint-noise-0.5", "camera-delay-0.1", "command-delay-0.1"] {
        let path = match name.rsplit_once('-').unwrap().0 {
            "odometry" => "sensing.odometry.distance_slip",
            "joint-noise" => "sensing.joints.offset",
            "camera-delay" => "sensing.camera_delay",
            _ => "sensing.command_delay",
        };
        let value = name.rsplit_once('-').unwrap().1.parse().unwrap();
        figure(name, path, value, Spec { sensing: None, ..of(name) });
    }
    let level = Spec { terrain: paper.terrain.clone(), ..of("slope-10") };
    figure("slope-10", "terrain.slope.angle", 10.0, level);
    let dry = |spec: Spec| Spec { fruit: paper.fruit.clone(), ..spec };
    figure("friction-0.5", "fruit.friction", 0.5, dry(of("friction-0.5")));
    assert_eq!(dry(of("clusters")), paper);
    assert!(of("clusters").fruit.cluster.is_some());
    // A preset brings its world, and the camera stays.
    let calibrated = field("calibrated");
    assert_eq!(
        **calibrated.spec(),
        Spec { camera: paper.camera.clone(), ..Spec::preset(orchard_spec::Preset::Calibrated) }
    );
    assert_eq!((calibrated.robot(), calibrated.detector()), (own.robot(), own.detector()));
    // A camera brings its default detector, and the world stays.
    let stereo = field("d435i");
    assert_eq!(
        (stereo.names().scene.camera.as_str(), stereo.names().scene.detector.as_str()),
        ("d435i", "learned")
    );
    assert_eq!(Spec { camera: paper.camera.clone(), ..(**stereo.spec()).clone() }, paper);
    assert_eq!(stereo, Scenario::of(&[("camera", "d435i")]).unwrap());
    // Sunlight is a dial of that camera.
    let dark = field("sunlight-1");
    assert_eq!(dark.spec().with_figures("", &[("camera.d435i.sunlight", 0.6)]).unwrap(), **stereo.spec());
    // Light brings eyes of colour.
    let evening = field("low-sun");
    assert_eq!(evening.names().scene.detector, "learned-colour");
    assert!(evening.detector().sees_colour() && evening.spec().light.is_some());
    for robot in orchard_scenario::robots() {
        if robot != orchard_robot::RobotModel::PAPER {
            assert_eq!(field(robot), Scenario::of(&[("robot", robot)]).unwrap());
        }
    }
}

#[test]
fn the_field_has_what_growers_meet() {
    let matrix = matrix_of(&Protocol::field());
    let groups: Vec<&str> = matrix.groups.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(groups, ["cameras", "crop", "faults", "light", "populations", "robots", "exhaustions"]);
    let sunlight = matrix.sweeps.iter().find(|sweep| sweep.name == "sunlight").unwrap();
    assert_eq!(sunlight.reference, "d435i");
    let names: Vec<&str> = sunlight.points.iter().map(|point| point.condition.as_str()).collect();
    assert_eq!(names, ["sunlight-0", "sunlight-0.3", "d435i", "sunlight-1"]);
    let choose = |name: &str| matrix.choose(&[name.to_owned()]).map(|chosen| names_of(&chosen));
    assert_eq!(choose("sunlight-0.6").unwrap(), ["d435i"]);
    assert_eq!(choose("wind").unwrap(), ["nominal", "wind-3", "wind-6", "wind-9"]);
    assert_eq!(choose("cameras").unwrap(), ["azure-kinect", "d435i"]);
    assert!(
        choose("gale")
            .unwrap_err()
            .to_string()
            .contains("the names are camera-delay, command-delay, foliage")
    );
}

#[test]
fn a_sweep_that_stands_elsewhere_is_switched_off_at_0() {
    let bumpy = Spec::paper().overlaid("x", "[terrain]\nenabled = true".parse().unwrap()).unwrap();
    let bumpy = scenario().with_spec(bumpy);
    let matrix = Matrix::of(Protocol::paper().matrix_rules(), &bumpy).unwrap();
    let flat = matrix.condition("terrain-0").unwrap().of(&bumpy).unwrap();
    assert_eq!(**flat.spec(), Spec::paper());
    let rough = matrix.condition("terrain-0.2").unwrap().of(&bumpy).unwrap();
    assert_eq!(Dials::of(rough.spec()).terrain_amplitude_m, 0.2);
}

#[test]
fn rules_that_make_no_matrix_are_refused() {
    let refused = |text: &str| {
        let text = format!("{text}\n{}", crate::protocol::FIELD_TOML);
        Protocol::from_toml("x.toml", &text).unwrap_err().to_string()
    };
    let e = refused("conditions.odd.\"../up\" = {}");
    assert_eq!(e, "x.toml: conditions: the name '../up' has other characters than letters, digits, - and .");
    let e = refused("conditions.odd.wind-3 = {}");
    assert_eq!(e, "x.toml: conditions: the name wind-3 is there twice");
    let e = refused("conditions.odd.far = { planet = 'mars' }");
    assert!(e.starts_with("x.toml: conditions.odd.far.planet: unknown field"), "{e}");
    // What depends on the worlds is told when they are known.
    let matrix = |text: &str| {
        let text = format!("{text}\n{}", crate::protocol::FIELD_TOML);
        let protocol = Protocol::from_toml("x.toml", &text).unwrap();
        let made = Matrix::of(protocol.matrix_rules(), &scenario());
        made.and_then(|matrix| matrix.conditions.iter().try_for_each(|c| c.of(&scenario()).map(drop)))
            .unwrap_err()
            .to_string()
    };
    let e = matrix("conditions.odd.far = { preset = 'mars' }");
    assert!(e.starts_with("far: the protocol: preset: no preset 'mars'; the presets are: paper"), "{e}");
    let e = matrix("conditions.odd.blind = { camera = 'eye' }");
    assert!(e.starts_with("blind: the protocol: camera: no camera 'eye'"), "{e}");
    let e = matrix(
        "sweeps.rain = { path = 'rain.rate', values = [{ value = 1, range = [0, 9], unit = '1', source = 'x' }] }",
    );
    assert_eq!(e, "rain: the world has no figure rain.rate");
    let e = matrix(
        "sweeps.heavy = { path = 'wood.density', values = [{ value = 1, range = [0, 9], unit = '1', source = 'x' }] }",
    );
    assert_eq!(e, "heavy: wood.density is in kg/m3, not 1");
}

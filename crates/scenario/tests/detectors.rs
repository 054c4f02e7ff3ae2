//! The detectors of cameras with a noise model follow from it by one rule (docs/computation/perception.md, "Presets of cameras").

use orchard_geometry::math;
use orchard_perception::DetectorConfig;
use orchard_scenario::{Changes, OptionValue, Options, Scenario};
use orchard_spec::camera::{CameraSpec, Measurement};

/// Focal length \[px\] of a number of columns and a horizontal field of view.
fn focal(columns: u32, fov: f64) -> f64 {
    0.5 * f64::from(columns) / math::tan(0.5 * fov)
}

#[test]
fn detectors_follow_from_the_noise_of_their_cameras() {
    for name in ["d435i", "d435i-aligned", "zed-mini", "azure-kinect", "azure-kinect-native"] {
        let (camera, detector) = (CameraSpec::named(name).unwrap(), DetectorConfig::named(name).unwrap());
        let view = camera.view();
        let of_view = focal(view.width.get(), view.horizontal_fov.as_ref().unwrap().si());
        let of_imager = camera.native().map_or(of_view, |n| focal(n.width.get(), n.horizontal_fov.si()));
        // Standard deviation at 1 m in full sun, and half-width of ramps in pixels of the imager.
        let (deviation, ramp) = match camera.measurement() {
            Measurement::Stereo(s) => {
                let ramp = f64::from(s.edge_ramp.get()) + 0.5;
                (s.disparity_noise.si().1 / (of_imager * s.baseline.si()), ramp)
            }
            Measurement::TimeOfFlight(s) => (s.noise.si().1, 2.0 * s.blur.si()),
            Measurement::Exact => unreachable!("{name} has noise"),
        };
        let fit = &detector.fit;
        let near = |what: &str, set: f64, rule: f64, tolerance: f64| {
            assert!((set - rule).abs() <= tolerance, "{name}: {what} is {set}, the rule gives {rule}");
        };
        near("fit.noise", fit.noise.si(), 2.5 * deviation, 0.1e-3);
        let sampling = (0.025 * of_view / 2.0 / 5.0).floor().max(1.0);
        near("fit.sampling", f64::from(fit.sampling.get()), sampling, 0.0);
        near("fit.ramp", fit.ramp.si(), ramp * of_view / of_imager / sampling, 0.05);
        let (low, high) = detector.segmentation.range.si();
        near("range.low", low, camera.range().0, 0.0);
        near("range.high", high, (0.010 / deviation).sqrt(), 0.05);
    }
}

/// A detector file may name a network beside it; the scenario holds the network, so a result can be run again without the file. What cannot be used is told with the file.
#[test]
fn own_networks_are_read_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("mine.onnx", include_bytes!("../../../configs/learned/detector.onnx"));
    write("colour.onnx", include_bytes!("../../../configs/learned-colour/detector.onnx"));
    write("boxes.onnx", include_bytes!("../../program/src/commands/detect/tests/red.onnx"));
    write("text.onnx", b"no network");
    let read = |base: &str, onnx: &str| {
        write("own.toml", format!("base = \"{base}\"\n[network]\nonnx = \"{onnx}\"\n").as_bytes());
        let given = OptionValue::new(at("own.toml"), "--detector");
        orchard_scenario::detector(&given, "d435i").map_err(|e| e.to_string())
    };
    let named =
        |name: &str| orchard_scenario::detector(&OptionValue::new(name, "--detector"), "d435i").unwrap();
    // The figures are those of the camera's detector and of the base; only the network differs.
    let mut own = read("learned", "mine.onnx").unwrap();
    assert_ne!(own, named("learned"));
    own.network.as_mut().unwrap().onnx = orchard_perception::Onnx::default();
    assert_eq!(own, named("learned"));
    assert!(read("learned-colour", "colour.onnx").unwrap().sees_colour());
    for name in ["learned", "learned-colour"] {
        assert_eq!(named(name).segmentation.range.si(), CameraSpec::named("d435i").unwrap().range());
    }
    for (onnx, problem) in [
        ("none.onnx", "none.onnx: No such file"),
        ("text.onnx", "text.onnx: not a model in ONNX format"),
        ("boxes.onnx", "boxes.onnx: input 1 has shape [1, 3, "),
    ] {
        let refused = read("learned", onnx).unwrap_err();
        assert!(
            refused.contains("own.toml") && refused.contains("network.onnx") && refused.contains(problem),
            "{refused}"
        );
    }
    read("learned", "mine.onnx").unwrap();
    let given = OptionValue::new(at("own.toml"), "--detector");
    let options = Options { detector: Some(given), ..Options::default() };
    let scenario = Scenario::resolve(&options, &orchard_scenario::controllers()).unwrap();
    let stored = scenario.stored();
    drop(folder);
    let again = Scenario::from_stored(&stored, &orchard_scenario::controllers(), "test").unwrap();
    assert_eq!(again.detector(), scenario.detector());
}

/// The detector with a network fits with the figures of the camera's own detector, or of `scored` where that one has no score, up to the range of the camera; it follows a change of
/// the camera.
#[test]
fn the_network_goes_with_every_camera() {
    let learned = |camera: &str| {
        orchard_scenario::detector(&OptionValue::new("learned", "--detector"), camera).unwrap()
    };
    let network = DetectorConfig::named("learned").unwrap().network;
    assert!(network.is_some());
    for (name, _) in CameraSpec::FILES {
        let own = DetectorConfig::named(orchard_scenario::geometric_detector_for(name)).unwrap();
        let mut fit = if own.score.on { own } else { DetectorConfig::named("scored").unwrap() };
        let (near, far) = CameraSpec::named(name).unwrap().range();
        // The exact camera `ideal` sees without end.
        assert_eq!(far.is_finite(), *name != "ideal");
        if far.is_finite() {
            let range = &mut fit.segmentation.range;
            *range = range.with_ends(near, far).unwrap();
        }
        assert_eq!(learned(name), DetectorConfig { network: network.clone(), ..fit }, "{name}");
    }
    let options = Options { detector: Some(OptionValue::new("learned", "--detector")), ..Options::default() };
    let scenario = Scenario::resolve(&options, &orchard_scenario::controllers()).unwrap();
    assert_eq!(*scenario.detector(), learned("paper"));
    let mut changes = Changes { camera: Some("d435i".to_owned()), ..Changes::default() };
    assert_eq!(*scenario.changed(&changes, "test").unwrap().detector(), learned("d435i"));
    // Changes may name a detector themselves; it is made for the new camera.
    changes.detector = Some("learned-colour".to_owned());
    let changed = scenario.changed(&changes, "test").unwrap();
    assert!(changed.detector().sees_colour() && changed.names().scene.detector == "learned-colour");
    changes.detector = Some("eyes".to_owned());
    let e = scenario.changed(&changes, "condition x").unwrap_err().to_string();
    assert!(e.starts_with("condition x: detector") && e.contains("eyes"), "{e}");
}

/// Of a camera with errors, robots and single images are searched by networks unless somebody named a detector: single images by the one that sees colour, also after the scenario was stored.
#[test]
fn single_images_have_a_default_of_their_own() {
    let names = |options: &[(&str, &str)]| {
        let scenario = Scenario::of(options).unwrap();
        let again =
            Scenario::from_stored(&scenario.stored(), &orchard_scenario::controllers(), "test").unwrap();
        let images = again.for_images().unwrap();
        assert_eq!(images.detector().sees_colour(), images.names().scene.detector == "learned-colour");
        (scenario.names().scene.detector.clone(), images.names().scene.detector.clone())
    };
    let both = |robot: &str, images: &str| (robot.to_owned(), images.to_owned());
    assert_eq!(names(&[("camera", "d435i")]), both("learned", "learned-colour"));
    assert_eq!(names(&[("camera", "d435i"), ("detector", "d435i")]), both("d435i", "d435i"));
    assert_eq!(names(&[]), both("paper", "paper"));
    // Changes that name a detector count as well.
    let changes = Changes { detector: Some("scored".to_owned()), ..Changes::default() };
    let changed = Scenario::of(&[("camera", "d435i")]).unwrap().changed(&changes, "test").unwrap();
    assert_eq!(changed.for_images().unwrap().names().scene.detector, "scored");
}

/// The default detector goes with the camera of a condition; one that somebody named stays, also if it is the default of the first camera. Names of a record stand for their options.
#[test]
fn a_condition_changes_the_default_detector_alone() {
    let of_condition = |options: &[(&str, &str)], camera: &str| {
        let changes = Changes { camera: Some(camera.to_owned()), ..Changes::default() };
        let scenario = Scenario::of(options).unwrap();
        let changed = scenario.changed(&changes, "test").unwrap();
        let read = Options::of_names(scenario.names()).unwrap();
        assert_eq!(
            read.detector.is_none(),
            scenario.names().scene.detector
                == orchard_scenario::detector_for(&scenario.names().scene.camera, false)
        );
        changed.names().scene.detector.clone()
    };
    assert_eq!(of_condition(&[], "d435i"), "learned");
    assert_eq!(of_condition(&[("camera", "d435i")], "paper"), "paper");
    assert_eq!(of_condition(&[("detector", "paper")], "d435i"), "paper");
    assert_eq!(of_condition(&[("camera", "d435i"), ("detector", "learned")], "paper"), "learned");
}

/// A world of a detector that looks at colour takes a colour image with each depth image; another takes none.
#[test]
fn colour_comes_with_depth_for_a_detector_that_looks_at_it() {
    for (detector, sees) in [("learned-colour", true), ("learned", false)] {
        let options =
            Options { detector: Some(OptionValue::new(detector, "--detector")), ..Options::default() };
        let scenario = Scenario::resolve(&options, &orchard_scenario::controllers()).unwrap();
        let seen = scenario.world(7, 0, 0).unwrap().observe();
        let depth = seen.depth.unwrap();
        assert_eq!(seen.colour.is_some(), sees, "{detector}");
        if let Some(colour) = seen.colour {
            assert_eq!((colour.width(), colour.height()), (depth.width(), depth.height()));
        }
    }
}

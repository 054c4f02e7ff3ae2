//! The window's pictures, drawn without a screen. Without a graphics device the tests are skipped with a message.
#![cfg(feature = "window")]

use std::io::Write;

use eframe::egui::{Event, Key, Modifiers, PointerButton, pos2};
use orchard_geometry::{Image, Vec3};
use orchard_scenario::Options;
use orchard_view::window::{Offscreen, ViewError, Viewer};
use orchard_view::{Overlays, Setup, Stage};

const SIZE: [u32; 2] = [960, 600];
const FRAME: f64 = 1.0 / 60.0;

/// A surface; `None`, with a message, where there is no graphics device. The message is added to the file that `cargo xtask test` counts.
fn screen(test: &str) -> Option<Offscreen> {
    match Offscreen::new(SIZE) {
        Ok(screen) => Some(screen),
        Err(ViewError::NoAdapter(why)) => {
            let line = format!("skipped, no adapter: {test} ({why})");
            eprintln!("{line}");
            if let Some(file) = std::env::var_os("ORCHARD_SKIPPED") {
                let mut file = std::fs::OpenOptions::new().create(true).append(true).open(file).unwrap();
                writeln!(file, "{line}").unwrap();
            }
            None
        }
        Err(e) => panic!("{e}"),
    }
}

fn viewer(screen: &Offscreen, options: &[(&str, &str)], overlays: &str) -> Viewer {
    let options = Options::of(options).unwrap();
    let controllers = orchard_scenario::controllers();
    let stage = Stage::new(Setup { options: Some(options), controllers, seed: 20250704, index: 0 }).unwrap();
    Viewer::new(stage, Overlays::parse(overlays).unwrap(), screen.state())
}

/// Draws twice, since panels learn their sizes by the first picture, and returns the second.
fn picture(screen: &mut Offscreen, viewer: &mut Viewer) -> Image<[u8; 3]> {
    viewer.owe(0);
    screen.draw(viewer, 0.0, Vec::new());
    screen.draw(viewer, 0.0, Vec::new());
    screen.picture().unwrap()
}

fn share(image: &Image<[u8; 3]>, is: impl Fn([i32; 3]) -> bool) -> f64 {
    let pixels = image.pixels();
    pixels.iter().filter(|pixel| is(pixel.map(i32::from))).count() as f64 / pixels.len() as f64
}

fn is_sky([r, g, b]: [i32; 3]) -> bool {
    (r - 223).abs() < 4 && (g - 232).abs() < 4 && (b - 238).abs() < 4
}

fn is_leaf([r, g, b]: [i32; 3]) -> bool {
    g > r + 12 && g > b + 8
}

fn is_fruit([r, g, b]: [i32; 3]) -> bool {
    r > 150 && g > 80 && b < 70 && r > g + 30
}

#[test]
fn a_tree_a_robot_and_fruit_are_seen() {
    let Some(mut screen) = screen("a_tree_a_robot_and_fruit_are_seen") else { return };
    let mut viewer = viewer(&screen, &[], "leaves");
    let whole = picture(&mut screen, &mut viewer);
    let [sky, leaf, fruit] = [share(&whole, is_sky), share(&whole, is_leaf), share(&whole, is_fruit)];
    assert!(sky > 0.15 && leaf > 0.004 && fruit > 0.0005, "{sky} {leaf} {fruit}");
    assert!(viewer.costs().draw_calls <= 60, "{:?}", viewer.costs());
    // Key 1 takes the leaves away, and nothing else.
    screen.draw(&mut viewer, FRAME, vec![key(Key::Num1, true), key(Key::Num1, false)]);
    let bare = picture(&mut screen, &mut viewer);
    assert!(share(&bare, is_leaf) < 0.25 * leaf && share(&bare, is_fruit) > fruit);
}

fn key(key: Key, pressed: bool) -> Event {
    Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: Modifiers::NONE }
}

fn button(at: [f32; 2], button: PointerButton, pressed: bool) -> Event {
    Event::PointerButton { pos: pos2(at[0], at[1]), button, pressed, modifiers: Modifiers::NONE }
}

fn moved(at: [f32; 2]) -> Event {
    Event::PointerMoved(pos2(at[0], at[1]))
}

/// Every overlay changes the picture and no bit of the world.
#[test]
fn overlays_change_pictures_and_not_the_world() {
    let Some(mut screen) = screen("overlays_change_pictures_and_not_the_world") else { return };
    let digest = |screen: &mut Offscreen, overlays: &str| {
        let mut viewer = viewer(screen, &[("controller", "expert")], overlays);
        viewer.owe(30);
        screen.draw(&mut viewer, 30.0 * FRAME, Vec::new());
        (picture(screen, &mut viewer), viewer.stage().session().world().state_digest())
    };
    let (plain, without) = digest(&mut screen, "none");
    for overlay in
        ["depth", "colour", "detections", "plan", "moments", "reach", "frames", "plots", "zones", "stems"]
    {
        let (shown, with) = digest(&mut screen, overlay);
        assert_eq!(with, without, "{overlay}");
        let differs = plain.pixels().iter().zip(shown.pixels()).filter(|(a, b)| a != b).count();
        assert!(differs > 300, "{overlay}: {differs} pixels");
    }
}

/// Dragged by the mouse, an apple is pulled; the drag beside the tree turns the view; let go, nothing is held.
#[test]
fn the_mouse_pulls_fruit_and_turns_the_view() {
    let Some(mut screen) = screen("the_mouse_pulls_fruit_and_turns_the_view") else { return };
    let mut viewer = viewer(&screen, &[("controller", "expert")], "none");
    let image = picture(&mut screen, &mut viewer);
    let fruit = (0..image.width() * image.height()).map(|k| (k % image.width(), k / image.width()));
    let at = fruit.filter(|&(u, v)| u > 280 && is_fruit(image[(u, v)].map(i32::from))).nth(40).unwrap();
    let at = [at.0 as f32, at.1 as f32];
    let frame = |screen: &mut Offscreen, viewer: &mut Viewer, events: Vec<Event>| {
        viewer.owe(1);
        screen.draw(viewer, FRAME, events);
    };
    let primary = PointerButton::Primary;
    frame(&mut screen, &mut viewer, vec![moved(at), button(at, primary, true)]);
    for k in 1..=20 {
        frame(&mut screen, &mut viewer, vec![moved([at[0], at[1] + 0.6 * k as f32])]);
    }
    let pull = viewer.stage().session().pull().expect("it holds the apple");
    let target = Vec3::from(pull.p_world_target);
    assert!(pull.force > 1.0 && target.z < Vec3::from(pull.p_world).z, "{pull:?}");
    frame(&mut screen, &mut viewer, vec![button([at[0], at[1] + 12.0], primary, false)]);
    assert!(viewer.stage().session().pull().is_none());
    let azimuth = viewer.orbit_mut().azimuth;
    let sky = [900.0, 60.0];
    frame(&mut screen, &mut viewer, vec![moved(sky), button(sky, primary, true)]);
    (1..=10).for_each(|k| frame(&mut screen, &mut viewer, vec![moved([900.0 - 5.0 * k as f32, 60.0])]));
    frame(&mut screen, &mut viewer, vec![button([850.0, 60.0], primary, false)]);
    assert!((viewer.orbit_mut().azimuth - azimuth).abs() > 0.1);
}

/// The keyboard takes the robot over, drives it, and gives it back.
#[test]
fn the_keyboard_drives_the_robot() {
    let Some(mut screen) = screen("the_keyboard_drives_the_robot") else { return };
    let mut viewer = viewer(&screen, &[("controller", "expert")], "none");
    let base = |viewer: &Viewer| Vec3::from(viewer.stage().session().told().p_world_base);
    let frames = |screen: &mut Offscreen, viewer: &mut Viewer, events: Vec<Event>, frames: u32| {
        viewer.owe(1);
        screen.draw(viewer, FRAME, events);
        viewer.owe(frames - 1);
        screen.draw(viewer, FRAME, Vec::new());
    };
    frames(&mut screen, &mut viewer, Vec::new(), 10);
    frames(&mut screen, &mut viewer, vec![key(Key::T, true), key(Key::T, false)], 1);
    assert!(viewer.stage().session().is_taken_over());
    let start = base(&viewer);
    frames(&mut screen, &mut viewer, vec![key(Key::S, true)], 60);
    let way = (base(&viewer) - start).norm();
    assert!((0.2..0.5).contains(&way), "{way} m");
    frames(&mut screen, &mut viewer, vec![key(Key::S, false), key(Key::T, true), key(Key::T, false)], 30);
    assert!(!viewer.stage().session().is_taken_over() && viewer.stage().session().told().state.is_some());
}

#[test]
fn a_size_that_no_device_draws_is_refused() {
    let Some(_) = screen("a_size_that_no_device_draws_is_refused") else { return };
    let refused = Offscreen::new([1_000_000, 10]).map(|_| ()).unwrap_err().to_string();
    assert!(refused.starts_with("--size 1000000x10: this device draws 1 to "), "{refused}");
}

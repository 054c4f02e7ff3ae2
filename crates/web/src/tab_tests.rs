use super::*;
use crate::{Ask, Files, grow};

fn tab(driver: &str) -> Tab {
    grow(&Ask { driver: driver.into(), ..Ask::default() }, &Files::default()).unwrap()
}

/// Overlays and looks through the wrist camera change no bit of any frame.
#[test]
fn overlays_change_no_bit() {
    let (mut bare, mut shown) = (tab("expert"), tab("expert"));
    bare.show("none").unwrap();
    for frame in 0..90 {
        shown.show(if frame < 45 { "all" } else { "depth,detections,plan" }).unwrap();
        let picture = shown.picture();
        assert_eq!(picture.counts.iter().sum::<usize>() * INSTANCE_FLOATS, picture.numbers.len());
        let _ = (shown.wrist(), shown.told(), shown.meshes());
        assert_eq!(shown.step_watched(), bare.step_watched(), "frame {frame}");
    }
    assert!(bare.wrist().is_none() && bare.told().log.is_empty() && !shown.told().log.is_empty());
    assert!(shown.trace().samples().len() == 15);
}

/// The view is the latest image that the controller has: it is given once, and again only if the image or the overlays are others.
#[test]
fn the_wrist_camera_shows_the_latest_image_once() {
    let mut tab = tab("expert");
    tab.show("depth,detections,plan").unwrap();
    let mut views = Vec::new();
    for _ in 0..240 {
        tab.step();
        views.extend(tab.wrist());
        assert!(tab.wrist().is_none());
    }
    let truth = tab.session().world().camera_truth().unwrap();
    let (last, image) = (views.last().unwrap(), truth.measured());
    assert!(last.frame == truth.sight.frame && last.size == [image.width(), image.height()]);
    assert!(last.picture == last.size && last.dots.len() == 4 * image.pixels().len());
    assert!(views.windows(2).all(|pair| pair[0].frame < pair[1].frame));
    let seen: Vec<&Found> = views.iter().flat_map(|view| &view.found).collect();
    assert!(!seen.is_empty() && seen.iter().all(|found| (0.0..=1.0).contains(&found.score)));
    assert!(seen.iter().all(|found| found.circle.radius > 1.0));
    assert!(views.iter().any(|view| view.target.is_some()), "no target in 4 s");
    tab.show("depth").unwrap();
    let view = tab.wrist().unwrap();
    assert!(view.frame == truth_frame(&tab) && view.found.is_empty() && view.target.is_none());
    tab.show("colour,detections").unwrap();
    let view = tab.wrist().unwrap();
    assert!(view.dots.len() == 4 * view.picture[0] * view.picture[1] && view.found.is_empty());
    tab.reset();
    assert!(tab.wrist().is_none() && tab.trace().samples().len() == 0);
}

fn truth_frame(tab: &Tab) -> u32 {
    tab.session().world().camera_truth().unwrap().sight.frame
}

#[test]
fn unknown_overlays_are_named_and_change_nothing() {
    let mut tab = tab("nobody");
    let leaves = |tab: &mut Tab| tab.picture().counts.iter().sum::<usize>();
    let before = leaves(&mut tab);
    let e = tab.show("leaves,smell").unwrap_err();
    assert!(e.starts_with("overlay `smell` is unknown; the overlays are: leaves, depth"), "{e}");
    assert!(tab.show("zones").unwrap_err().contains("`orchard view` has"));
    assert_eq!(leaves(&mut tab), before);
    tab.show("none").unwrap();
    assert!(leaves(&mut tab) < before / 2);
}

#[test]
fn a_mark_is_an_instance_of_its_mesh() {
    let mut tab = tab("nobody");
    tab.show("frames").unwrap();
    let picture = tab.picture();
    assert_eq!(picture.counts.len(), tab.meshes().len());
    let marks = &picture.counts[picture.counts.len() - Marks::meshes().len()..];
    assert!(marks[0] == 12 && marks[1] == 0 && marks[2] == 12, "{marks:?}");
}

/// A person who takes the robot over moves it; the controller that gets it back goes on. What is told says who drives.
#[test]
fn a_person_takes_over_and_gives_back() {
    let mut tab = tab("expert");
    (0..60).for_each(|_| tab.step());
    assert!(!tab.told().taken_over && tab.told().told.state.is_some());
    tab.session_mut().take_over();
    let before = tab.told().told.p_world_base;
    tab.session_mut().wish(orchard_play::Wish { base: [1.0, 0.0, 0.0], ..Default::default() });
    (0..60).for_each(|_| tab.step());
    let after = tab.told().told.p_world_base;
    let way = (0..3).map(|k| (after[k] - before[k]) * (after[k] - before[k])).sum::<f64>().sqrt();
    assert!(way > 0.2 && tab.told().taken_over && tab.told().target_distance.is_none(), "{way} m");
    tab.session_mut().give_back();
    (0..60).for_each(|_| tab.step());
    assert!(!tab.told().taken_over && tab.told().told.state.is_some());
    tab.session_mut().take_over();
    tab.reset();
    assert!(!tab.told().taken_over && tab.told().told.frame == 0);
}

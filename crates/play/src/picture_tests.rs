use super::*;
use crate::Session;
use orchard_scenario::Scenario;

fn picture(options: &[(&str, &str)]) -> (Session, Picture) {
    let scenario = Scenario::of(options).unwrap();
    let world = scenario.world(20250704, 0, 0).unwrap();
    let session = Session::new(world, Some(Box::new(move || scenario.controller())));
    let picture = session.picture();
    (session, picture)
}

#[test]
fn every_visible_thing_is_an_instance() {
    let (session, picture) = picture(&[]);
    let scene = session.world().picture_scene();
    let instances: usize = picture.groups.iter().map(|group| group.count).sum();
    assert_eq!(instances, scene.items.len());
    assert_eq!(picture.instances.len(), instances * INSTANCE_FLOATS);
    assert!(picture.instances.iter().all(|x| x.is_finite()));
    assert_eq!(picture.groups[BLADE].count, session.world().skeleton().leaves.len());
    assert!(picture.groups.iter().zip(&picture.meshes).all(|(g, mesh)| g.count == 0 || mesh.triangles() > 0));
}

/// The meshes stay the same while a world moves, so that a page sends them to the graphics device once.
#[test]
fn meshes_do_not_change() {
    let (mut session, first) = picture(&[]);
    (0..20).for_each(|_| session.step());
    let later = session.picture();
    assert_eq!(first.meshes, later.meshes);
    assert_ne!(first.instances, later.instances);
}

#[test]
fn every_preset_can_be_drawn() {
    for preset in orchard_scenario::presets() {
        let (_, picture) = picture(&[("preset", preset)]);
        assert!(picture.groups.iter().any(|group| group.count > 100), "{preset}");
    }
}

#[test]
fn leaves_can_be_left_out_and_wood_told_by_its_load() {
    let (session, plain) = picture(&[]);
    let mut drawing = session.drawing();
    session.draw(&mut drawing, &Paint { leaves: false, wood: WoodPaint::Load });
    assert!(drawing.instances()[BLADE].is_empty());
    assert_eq!(drawing.instances()[CAPSULE].len(), plain.groups[CAPSULE].count * INSTANCE_FLOATS);
    let capsules = |list: &[f32]| -> Vec<[f32; 3]> {
        list.chunks(INSTANCE_FLOATS).map(|i| [i[10], i[11], i[12]]).collect()
    };
    // Some joints bear far more of their strength than others; spurs and stems keep their colour.
    let loads = capsules(&drawing.instances()[CAPSULE]);
    let red = |colour: &[f32; 3]| colour[0];
    let least = loads.iter().map(red).fold(f32::INFINITY, f32::min);
    assert!(least < 0.05 && loads.iter().any(|c| *c != colour::WOOD && red(c) > least + 0.05), "{least}");
}

use super::*;
use crate::{Ask, Session};

fn picture(ask: &Ask) -> (Session, Picture) {
    let session = Session::grow(ask).unwrap();
    let picture = session.picture();
    (session, picture)
}

#[test]
fn every_visible_thing_is_an_instance() {
    let (session, picture) = picture(&Ask { driver: "nobody".into(), ..Ask::default() });
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
    let (mut session, first) = picture(&Ask::default());
    (0..20).for_each(|_| session.step());
    let later = session.picture();
    assert_eq!(first.meshes, later.meshes);
    assert_ne!(first.instances, later.instances);
}

#[test]
fn every_preset_can_be_drawn() {
    for preset in orchard_scenario::presets() {
        let (_, picture) = picture(&Ask { preset: preset.into(), driver: "nobody".into(), ..Ask::default() });
        assert!(picture.groups.iter().any(|group| group.count > 100), "{preset}");
    }
}

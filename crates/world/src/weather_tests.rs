use crate::{Status, World};
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Spec};
use std::sync::Arc;

/// A trained tree in a wind of a speed [m/s]; `None`: a config without wind.
fn world(speed: Option<f64>) -> World {
    let mut spec = Spec::preset(Preset::TallSpindle);
    match speed {
        Some(speed) => {
            let wind = spec.wind.as_mut().unwrap();
            wind.speed = wind.speed.with_value(speed).unwrap();
        }
        None => spec.wind = None,
    }
    World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 1, 0).unwrap()
}

/// Bits of the joints' angles and the fruits' places after some frames.
fn bits(world: &mut World, frames: u32) -> Vec<u64> {
    let hold = world.robot().start_command();
    for _ in 0..frames {
        world.step(&hold);
    }
    assert_eq!(*world.status(), Status::Running);
    let data = world.data();
    let places = data.point_p_world.iter().flat_map(|p| p.iter());
    data.q.iter().chain(places).map(|x| x.to_bits()).collect()
}

#[test]
fn still_air_costs_no_bit() {
    assert_eq!(bits(&mut world(Some(0.0)), 60), bits(&mut world(None), 60));
}

#[test]
fn wind_moves_the_tree_the_same_way_every_time() {
    let (mut a, mut b) = (world(Some(8.0)), world(Some(8.0)));
    let moved = bits(&mut a, 60);
    assert_eq!(moved, bits(&mut b, 60));
    assert_ne!(moved, bits(&mut world(Some(0.0)), 60));
    // A reset and a snapshot lead to the same states.
    a.reset();
    assert_eq!(moved, bits(&mut a, 60));
    let snapshot = b.snapshot();
    let on = bits(&mut b, 30);
    b.restore(&snapshot).unwrap();
    assert_eq!(on, bits(&mut b, 30));
}

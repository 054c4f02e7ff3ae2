//! Exchange of a full bucket for an empty one.

use crate::loose::{hold, in_bucket, motion, put};
use orchard_geometry::{Vec3, inverse_transform};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::truth::FruitState;
use orchard_world::{World, WorldEvent};
use std::sync::Arc;

const FULL: usize = 6;

/// Puts fruit into the bucket one by one, waits until all is still, and returns those that were taken away meanwhile.
fn add(world: &mut World, fruit: std::ops::Range<usize>) -> Vec<usize> {
    for i in fruit {
        let side = if i.is_multiple_of(2) { 0.5 } else { -0.5 };
        let at = [side, 0.3 * (i % FULL) as f64 - 0.75, 0.5];
        let p = in_bucket(world, at);
        put(world, i, p, Vec3::zeros(), &hold());
        (0..60).for_each(|_| world.step(&hold()));
    }
    (0..120).for_each(|_| world.step(&hold()));
    let gone = |event: WorldEvent| match event {
        WorldEvent::FruitTakenAway { fruit, .. } => Some(fruit),
        _ => None,
    };
    world.drain_events().into_iter().filter_map(gone).collect()
}

/// A bucket leaves the field once it holds as many fruit as the rule says, and the next one too. Fruit that left stay deposited and lie still; without the rule none leaves.
#[test]
fn a_full_bucket_is_exchanged() {
    let mut spec = Spec::paper();
    spec.fruit.count = spec.fruit.count.with_value(20).unwrap();
    spec.fruit.bucket_exchange = Some(spec.fruit.count.with_value(FULL as u32).unwrap());
    let ruled = World::new(Arc::new(spec.clone()), Arc::new(RobotModel::paper()), 3, 0).unwrap();
    spec.fruit.bucket_exchange = None;
    let free = World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 3, 0).unwrap();
    for (mut world, is_ruled) in [(ruled, true), (free, false)] {
        let taken =
            |expected: std::ops::Range<usize>| -> Vec<usize> { expected.filter(|_| is_ruled).collect() };
        assert_eq!(add(&mut world, 0..FULL - 1), Vec::<usize>::new());
        assert_eq!(add(&mut world, FULL - 1..FULL), taken(0..FULL));
        let far = motion(&world, 0);
        assert_eq!(add(&mut world, FULL..2 * FULL), taken(FULL..2 * FULL));
        let x_world_base = world.handle().x_world_base(world.data());
        for i in 0..2 * FULL {
            let p_base = inverse_transform(&x_world_base, &motion(&world, i)[0]);
            assert_eq!(world.handle().bucket.contains(&p_base), !is_ruled, "fruit {i}");
            assert_eq!(world.fruit_truth()[i].state, FruitState::Deposited, "fruit {i}");
        }
        assert_eq!(motion(&world, 0) == far, is_ruled);
    }
}

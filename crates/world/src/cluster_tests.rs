use crate::{World, groups};
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Spec};
use std::sync::Arc;

/// Closest distance of the centres of two neighbours in a cluster over the sum of their radii, while each is pushed at the other with 2 N.
fn nearest(touch: bool) -> f64 {
    let spec = Arc::new(Spec::preset(Preset::TallSpindle));
    let mut world = World::new(spec, Arc::new(RobotModel::paper()), 1, 0).unwrap();
    if !touch {
        for collider in world.fruit().colliders.clone() {
            world.data_mut().groups[collider.index()] = groups::HANGING_GROUPS;
        }
    }
    let fruit = &world.fruit().fruit;
    let first = (1..fruit.len()).find(|&i| fruit[i].site == fruit[i - 1].site).unwrap();
    let reach = fruit[first - 1].radius + fruit[first].radius;
    let points = [first - 1, first].map(|i| world.fruit().points[i].index());
    let hold = world.robot().start_command();
    let mut least = f64::INFINITY;
    for _ in 0..30 {
        let data = world.data_mut();
        let apart = data.point_p_world[points[1]] - data.point_p_world[points[0]];
        least = least.min(apart.norm() / reach);
        let push = apart.normalize() * 2.0;
        data.point_force_world[points[0]] = push;
        data.point_force_world[points[1]] = -push;
        world.step(&hold);
    }
    least
}

#[test]
fn neighbours_that_are_pushed_together_touch_and_do_not_pass_through_each_other() {
    let touching = nearest(true);
    assert!((0.98..1.0).contains(&touching), "{touching}");
    let passing = nearest(false);
    assert!(passing < 0.9, "{passing}");
}

//! Truth as an observation, for critics and teachers: no policy that reads it can be ranked.

use orchard_geometry::{Vec3, inverse_transform};
use orchard_policy::{Element, Field, Values};
use orchard_world::World;

/// Names and units, in the order of [`read`].
const ELEMENTS: [(&str, &str); 8] = [
    ("goal_x", "m"),
    ("goal_y", "m"),
    ("goal_z", "m"),
    ("left", "1"),
    ("held", "1"),
    ("stem_pull", "N"),
    ("wood_load", "1"),
    ("wood_impulse", "N s"),
];

/// The field `privileged`.
pub(crate) fn field() -> Field {
    let meaning = "truth: where the goal is (odom): the named fruit or point, else the reachable fruit on the tree that is nearest to the tool; \
                   reachable fruit left on the tree; fruit in the hand; largest force on a stem in the last frame; \
                   largest bending moment in the wood over its rupture moment and impulse of contacts with wood, so far";
    Field::numbers("privileged", meaning, ELEMENTS.map(|(name, unit)| Element::new(name, unit)).to_vec())
}

/// The numbers of a world with a goal and a number of fruit left.
pub(crate) fn read(world: &World, p_world_goal: Option<Vec3>, left: usize) -> Values {
    let goal = p_world_goal.map_or(Vec3::zeros(), |p| inverse_transform(&world.x_world_odom(), &p));
    let held = (0..world.fruit().len()).filter(|&fruit| world.is_held(fruit)).count();
    let load = world.wood_load();
    let numbers = [
        goal.x,
        goal.y,
        goal.z,
        left as f64,
        held as f64,
        world.fruit_lives().peak_tension(),
        load.peak_ratio,
        load.contact_impulse,
    ];
    Values::F32(numbers.map(|x| if x.is_finite() { x as f32 } else { 0.0 }).to_vec())
}

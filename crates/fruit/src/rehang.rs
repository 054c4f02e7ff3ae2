//! Fruit that stay on their wood when it changes its form.

use crate::Fruit;
use crate::clear::Wood;
use crate::place::{crowded, hang_point};
use orchard_spec::fruit::FruitSpec;
use orchard_treegen::{Skeleton, carried_to};

/// Takes fruit over from one form of a tree to another with the same segments: each stays on its segment, as far along it in
/// proportion. Radius and mass are as given. As with [`crate::place`], a fruit that would not hang clear of wood, ground and the
/// fruit before it does not set.
pub fn rehang(spec: &FruitSpec, fruit: Vec<Fruit>, from: &Skeleton, to: &Skeleton) -> Vec<Fruit> {
    let wood = Wood::new(to);
    let mut set: Vec<Fruit> = Vec::with_capacity(fruit.len());
    for fruit in fruit {
        let segment = &to.segments[fruit.segment];
        let p_segment = carried_to(&fruit.p_segment, &from.segments[fruit.segment], segment);
        let p_anchor_world = segment.p_base_world + segment.r_world_segment * p_segment;
        let p_hang_world = hang_point(spec, &p_anchor_world, fruit.radius);
        let fruit = Fruit { p_segment, p_hang_world, ..fruit };
        if wood.leaves_clear(&fruit) && !crowded(&set, &fruit, spec.spacing.si()) {
            set.push(fruit);
        }
    }
    set
}

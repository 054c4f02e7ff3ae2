//! Transfer of fruit to another form of their tree.

use crate::apple::{Fruit, hang_point};
use crate::clear::Wood;
use crate::place::crowded;
use orchard_spec::fruit::FruitSpec;
use orchard_treegen::{Skeleton, map_point};

/// Transfers fruit from one form of a tree to another with the same segments: each stays on its segment, at the same fraction of its
/// length. Radius and mass are kept. The fruit are visited in `order` until there are `count`; as with [`crate::place`], one that would
/// not hang clear of wood, ground and those before it is left out.
pub fn rehang(
    spec: &FruitSpec,
    fruit: &[Fruit],
    order: &[usize],
    count: usize,
    from: &Skeleton,
    to: &Skeleton,
) -> Vec<Fruit> {
    let wood = Wood::new(to);
    let mut indices = Vec::with_capacity(count);
    let mut set: Vec<Fruit> = Vec::with_capacity(count);
    for &index in order {
        if set.len() == count {
            break;
        }
        let old = &fruit[index];
        let segment = &to.segments[old.segment];
        let p_segment = map_point(&old.p_segment, &from.segments[old.segment], segment);
        let p_anchor_world = segment.p_base_world + segment.r_world_segment * p_segment;
        let p_hang_world = hang_point(spec, &p_anchor_world, old.radius);
        let moved = Fruit { p_segment, p_hang_world, ..old.clone() };
        if wood.leaves_clear(&moved) && !crowded(&set, &moved, spec.spacing.si()) {
            indices.push(index);
            set.push(moved);
        }
    }
    let mut set: Vec<(usize, Fruit)> = indices.into_iter().zip(set).collect();
    set.sort_by_key(|(index, _)| *index);
    set.into_iter().map(|(_, fruit)| fruit).collect()
}

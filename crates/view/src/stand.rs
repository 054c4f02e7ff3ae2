//! Trees in rows beside the one that moves.

use orchard_geometry::Vec3;
use orchard_play::{Drawing, INSTANCE_FLOATS, PlayRules};
use orchard_scenario::Scenario;
use rayon::prelude::*;

/// Trees in rows that stand still: they are drawn, and nothing else.
#[derive(Debug, Clone, PartialEq)]
pub struct Stand {
    instances: Vec<Vec<f32>>,
    extent: f64,
}

impl Stand {
    /// Grows the trees of a seed after that of an index, so that there are so many with it. It stands in the middle of the first row.
    ///
    /// # Errors
    /// A tree that cannot be grown; the message names it.
    pub fn grow(scenario: &Scenario, seed: u64, index: u32, trees: u32) -> Result<Self, String> {
        let rules = PlayRules::v1();
        let [row, tree] =
            [&rules.stand.row_distance, &rules.stand.tree_distance].map(|distance| distance.si());
        let places: Vec<Vec3> = places(trees).map(|[x, y]| Vec3::new(row * x, tree * y, 0.0)).collect();
        let grown: Result<Vec<Vec<Vec<f32>>>, String> = places
            .par_iter()
            .enumerate()
            .skip(1)
            .map(|(number, place)| {
                let index = index.checked_add(number as u32);
                let index = index.ok_or_else(|| format!("seed {seed} has no tree after {}", u32::MAX))?;
                let world = scenario.world(seed, index, 0);
                let world = world.map_err(|e| format!("tree {index} of seed {seed} cannot be built: {e}"))?;
                let mut drawing = Drawing::new(&world, &rules.ground);
                drawing.draw_tree(&world);
                let mut lists = drawing.instances()[..drawing.coarse().len()].to_vec();
                for instance in lists.iter_mut().flat_map(|list| list.chunks_exact_mut(INSTANCE_FLOATS)) {
                    (0..3).for_each(|k| instance[k] += place[k] as f32);
                }
                Ok(lists)
            })
            .collect();
        let mut instances: Vec<Vec<f32>> = Vec::new();
        for lists in grown? {
            instances.resize(lists.len(), Vec::new());
            instances.iter_mut().zip(lists).for_each(|(all, list)| all.extend(list));
        }
        let farthest = places.iter().map(|place| place.norm()).fold(0.0, f64::max);
        Ok(Self { instances, extent: rules.ground.extent.si() + farthest })
    }

    /// The instances of each mesh that has a coarser form.
    pub fn instances(&self) -> &[Vec<f32>] {
        &self.instances
    }

    /// Half the side of the ground under them \[m\].
    pub fn extent(&self) -> f64 {
        self.extent
    }
}

/// Places of trees, by row and by place in it: as many rows as trees in one, the first in the middle of its row.
fn places(trees: u32) -> impl Iterator<Item = [f64; 2]> {
    let each = f64::from(trees).sqrt().ceil() as u32;
    (0..trees).map(move |number| {
        let (row, place) = (number / each.max(1), number % each.max(1));
        let side = if place % 2 == 0 { 1.0 } else { -1.0 };
        [f64::from(row), side * f64::from(place.div_ceil(2))]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_stand_in_rows_each_in_its_own_place() {
        let all: Vec<[f64; 2]> = places(100).collect();
        assert_eq!((all.len(), all[0], all[1], all[2]), (100, [0.0, 0.0], [0.0, -1.0], [0.0, 1.0]));
        let mut sorted = all.clone();
        sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
        sorted.dedup();
        assert!(sorted.len() == 100 && all.iter().all(|[x, y]| *x < 10.0 && y.abs() <= 5.0));
        assert_eq!(places(1).collect::<Vec<_>>(), [[0.0, 0.0]]);
    }

    /// The trees are those of the seed, leaf by leaf, without robot and ground.
    #[test]
    fn a_stand_has_the_trees_of_the_seed() {
        let scenario = Scenario::of(&[]).unwrap();
        let stand = Stand::grow(&scenario, 20250704, 0, 3).unwrap();
        let worlds = [1, 2].map(|index| scenario.world(20250704, index, 0).unwrap());
        let leaves: usize = worlds.iter().map(|world| world.skeleton().leaves.len()).sum();
        let fruit: usize = worlds.iter().map(|world| world.fruit().len()).sum();
        let counts: Vec<usize> = stand.instances().iter().map(|list| list.len() / INSTANCE_FLOATS).collect();
        assert!(counts.contains(&leaves) && counts.contains(&fruit) && stand.extent() > 13.0, "{counts:?}");
        assert_eq!(Stand::grow(&scenario, 20250704, 0, 1).unwrap().instances(), [] as [Vec<f32>; 0]);
    }
}

//! Nesting of a sample: values within trees, trees within seeds.

/// The nesting of a sample: values (repeats) within trees within seeds.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Design {
    trees: Vec<Vec<usize>>,
    seeds: Vec<Vec<usize>>,
}

impl Design {
    /// The nesting of values given by the seed and the world of each; trees and seeds in the order of their first value.
    pub fn of(places: impl IntoIterator<Item = (u64, u32)>) -> Self {
        let mut design = Self::default();
        let (mut tree_of, mut seed_of) =
            (std::collections::BTreeMap::new(), std::collections::BTreeMap::new());
        for (value, (seed, world)) in places.into_iter().enumerate() {
            let tree = *tree_of.entry((seed, world)).or_insert_with(|| {
                let seed = *seed_of.entry(seed).or_insert_with(|| {
                    design.seeds.push(Vec::new());
                    design.seeds.len() - 1
                });
                design.trees.push(Vec::new());
                design.seeds[seed].push(design.trees.len() - 1);
                design.trees.len() - 1
            });
            design.trees[tree].push(value);
        }
        design
    }

    /// One value a tree: `groups` holds the values of each seed.
    pub fn of_groups(groups: &[Vec<usize>]) -> Self {
        let values = groups.iter().flatten().max().map_or(0, |last| last + 1);
        let seeds = groups.iter().filter(|group| !group.is_empty()).cloned().collect();
        Self { trees: (0..values).map(|value| vec![value]).collect(), seeds }
    }

    /// The values of each tree.
    pub fn trees(&self) -> &[Vec<usize>] {
        &self.trees
    }

    /// The trees of each seed.
    pub fn seeds(&self) -> &[Vec<usize>] {
        &self.seeds
    }

    /// True if some tree has more than one value.
    pub fn has_repeats(&self) -> bool {
        self.trees.iter().any(|values| values.len() > 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_find_their_trees_and_seeds() {
        let design = Design::of([(9, 0), (9, 0), (9, 1), (4, 0), (9, 1), (4, 0)]);
        assert_eq!(design.trees(), [vec![0, 1], vec![2, 4], vec![3, 5]]);
        assert_eq!(design.seeds(), [vec![0, 1], vec![2]]);
        assert!(design.has_repeats());
        let plain = Design::of_groups(&[vec![0, 1], vec![], vec![2]]);
        assert_eq!(plain, Design::of([(1, 0), (1, 1), (3, 0)]));
        assert!(!plain.has_repeats());
        assert_eq!(Design::of([]), Design::of_groups(&[]));
    }
}

//! The order of a board, and its Pareto front.

use crate::entry::{Budget, Entry};

/// An entry with its rank.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranked<'a> {
    /// Rank, from 1; `None` over budget.
    pub place: Option<u32>,
    /// The entry.
    pub entry: &'a Entry,
    /// True if the entry is on the Pareto front.
    pub on_front: bool,
}

/// Ranks the entries: those within budget by descending completeness, then by ascending damage, then by name; those over budget after
/// them in the same order. The budget is each entry's own, or `budget` for all.
pub fn ranking<'a>(entries: &'a [Entry], budget: Option<&Budget>) -> Vec<Ranked<'a>> {
    let within = |entry: &Entry| {
        budget.map_or(entry.within_budget, |b| b.admits(entry.snapped_per_tree, entry.dropped_per_tree))
    };
    let front = pareto_front(entries);
    let mut order: Vec<usize> = (0..entries.len()).collect();
    order.sort_by(|&i, &j| {
        let (a, b) = (&entries[i], &entries[j]);
        within(b)
            .cmp(&within(a))
            .then(b.completeness.total_cmp(&a.completeness))
            .then(a.damage().total_cmp(&b.damage()))
            .then(a.name.cmp(&b.name))
    });
    (1..)
        .zip(order)
        .map(|(place, index)| {
            let entry = &entries[index];
            Ranked { place: within(entry).then_some(place), entry, on_front: front.contains(&index) }
        })
        .collect()
}

/// Indices of the entries on the Pareto front, by damage. An entry is dominated if another one is at least as good in completeness and
/// damage, and better in one of them. Entries with equal figures are both on the front.
pub fn pareto_front(entries: &[Entry]) -> Vec<usize> {
    let dominates = |a: &Entry, b: &Entry| {
        let (more, less) = (a.completeness - b.completeness, b.damage() - a.damage());
        more >= 0.0 && less >= 0.0 && (more > 0.0 || less > 0.0)
    };
    let mut front: Vec<usize> =
        (0..entries.len()).filter(|&i| !entries.iter().any(|other| dominates(other, &entries[i]))).collect();
    front.sort_by(|&i, &j| entries[i].damage().total_cmp(&entries[j].damage()));
    front
}

//! The order of a board, and its Pareto front.

use crate::entry::{Budget, Class, Entry};

/// An entry in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranked<'a> {
    /// Place in its class from 1; `None` over budget.
    pub place: Option<u32>,
    /// The entry.
    pub entry: &'a Entry,
    /// True if the entry is on the Pareto front of its class.
    pub on_front: bool,
}

/// Entries by class, the strongest first, and in each class by place: those within budget by completeness, the most first, then by damage, the least first, then by name; those over
/// budget after them in the same order. The budget is each entry's own, or one for all.
pub fn ranking<'a>(entries: &'a [Entry], budget: Option<&Budget>) -> Vec<Ranked<'a>> {
    let within = |entry: &Entry| {
        budget.map_or(entry.within_budget, |b| b.admits(entry.snapped_per_tree, entry.dropped_per_tree))
    };
    Class::ALL.into_iter().flat_map(|class| of_class(entries, class, within)).collect()
}

fn of_class(entries: &[Entry], class: Class, within: impl Fn(&Entry) -> bool) -> Vec<Ranked<'_>> {
    let front = pareto_front(entries, class);
    let mut order: Vec<usize> = (0..entries.len()).filter(|&i| entries[i].checked.class == class).collect();
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

/// Indices of the entries of a class that no other of it dominates, by damage: another has as much completeness with as little damage, and more of the
/// one or less of the other. Entries with the same figures are both on the front.
pub fn pareto_front(entries: &[Entry], class: Class) -> Vec<usize> {
    let dominates = |a: &Entry, b: &Entry| {
        let (more, less) = (a.completeness - b.completeness, b.damage() - a.damage());
        more >= 0.0 && less >= 0.0 && (more > 0.0 || less > 0.0)
    };
    let own: Vec<usize> = (0..entries.len()).filter(|&i| entries[i].checked.class == class).collect();
    let dominated = |&i: &usize| own.iter().any(|&other| dominates(&entries[other], &entries[i]));
    let mut front: Vec<usize> = own.iter().copied().filter(|i| !dominated(i)).collect();
    front.sort_by(|&i, &j| entries[i].damage().total_cmp(&entries[j].damage()));
    front
}

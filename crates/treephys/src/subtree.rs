//! Sub-trees of a tree given by its parents.

/// Members of the sub-tree that starts at `root`, in index order; parents stand before their children.
pub(crate) fn members(parent: &[Option<usize>], root: usize) -> Vec<usize> {
    let mut inside = vec![false; parent.len()];
    inside[root] = true;
    let mut members = vec![root];
    for i in root + 1..parent.len() {
        if parent[i].is_some_and(|p| inside[p]) {
            inside[i] = true;
            members.push(i);
        }
    }
    members
}

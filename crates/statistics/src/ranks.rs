//! Ranks of the sizes of differences.

/// Signed ranks of differences; zeros are left out (Wilcoxon 1945).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SignedRanks {
    /// Differences that are not 0.
    pub n: usize,
    /// Sum of the ranks of positive differences.
    pub positive: f64,
    /// Sum of the ranks of negative differences.
    pub negative: f64,
    /// Sizes of the groups of equal sizes, those of one left out.
    pub ties: Vec<usize>,
}

impl SignedRanks {
    /// Ranks the sizes; equal sizes share the mean of their ranks.
    pub fn of(differences: &[f64]) -> Self {
        let mut sorted: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
        sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let mut ranks = Self { n: sorted.len(), ..Self::default() };
        let mut before = 0;
        for group in sorted.chunk_by(|a, b| a.abs() == b.abs()) {
            // Ranks are counted from 1: before + 1 to before + size.
            let rank = before as f64 + 0.5 * (group.len() as f64 + 1.0);
            let positive = group.iter().filter(|d| **d > 0.0).count();
            ranks.positive += rank * positive as f64;
            ranks.negative += rank * (group.len() - positive) as f64;
            if group.len() > 1 {
                ranks.ties.push(group.len());
            }
            before += group.len();
        }
        ranks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_sizes_share_their_ranks() {
        // Sizes 1, 2, 2, 3 have the ranks 1, 2.5, 2.5, 4.
        let ranks = SignedRanks::of(&[2.0, -1.0, 0.0, -2.0, 3.0]);
        assert_eq!(ranks, SignedRanks { n: 4, positive: 6.5, negative: 3.5, ties: vec![2] });
        assert_eq!(SignedRanks::of(&[0.0, -0.0]), SignedRanks::default());
    }
}

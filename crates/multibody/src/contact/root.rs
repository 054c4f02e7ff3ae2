//! Square roots of small matrices.

/// A pivot below this share of its diagonal entry is round-off.
const PIVOT_TOLERANCE: f64 = 1e-14;

/// Lower triangular C of a symmetric positive semidefinite matrix `C C^T`, both row after row. A frozen degree
/// of freedom is a zero row, and stays one; what has no inertia of its own in other ways has a zero column.
pub(super) fn lower_root<const N: usize>(matrix: &[f64], root: &mut [f64]) {
    for i in 0..N {
        for j in 0..=i {
            let done: f64 = (0..j).map(|k| root[i * N + k] * root[j * N + k]).sum();
            let rest = matrix[i * N + j] - done;
            root[i * N + j] = match (i == j, root[j * N + j]) {
                (true, _) if rest <= PIVOT_TOLERANCE * matrix[i * N + i] => 0.0,
                (true, _) => rest.sqrt(),
                (false, pivot) if pivot > 0.0 => rest / pivot,
                _ => 0.0,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn root_of_a_matrix_with_a_dead_row_skips_it() {
        let matrix = [4.0, 0.0, -2.0, 0.0, 0.0, 0.0, -2.0, 0.0, 5.0];
        let mut root = [0.0; 9];
        lower_root::<3>(&matrix, &mut root);
        assert_eq!(root, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 2.0]);
    }
}

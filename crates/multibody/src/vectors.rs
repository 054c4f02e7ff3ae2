//! Sums over long vectors.

/// `a^T b`, summed in four lanes.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// `y += x by`.
pub(crate) fn add_scaled(y: &mut [f64], x: &[f64], by: f64) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += x * by;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_any_length() {
        for length in 0..10 {
            let a: Vec<f64> = (0..length).map(f64::from).collect();
            let b: Vec<f64> = (0..length).map(|k| f64::from(k * k)).collect();
            assert_eq!(dot(&a, &b), (0..length).map(|k| f64::from(k * k * k)).sum::<f64>());
        }
    }
}

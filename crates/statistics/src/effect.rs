//! Effect sizes of paired differences.

use crate::ranks::SignedRanks;
use crate::undefined::Undefined;

/// Matched-pairs rank-biserial correlation (Kerby 2014): the positive rank sum less the negative one over their sum, -1 to 1.
/// Zeros are left out.
///
/// # Errors
/// No pair, all differences 0, one not finite.
pub fn rank_biserial(differences: &[f64]) -> Result<f64, Undefined> {
    finite(differences)?;
    let ranks = SignedRanks::of(differences);
    if ranks.n == 0 {
        return Err(Undefined::AllZero);
    }
    Ok((ranks.positive - ranks.negative) / (ranks.positive + ranks.negative))
}

/// Cohen's d_z (Cohen 1988, section 2.3): the mean difference over the standard deviation of the differences (of n - 1).
///
/// # Errors
/// Fewer than two pairs, all differences the same, one not finite.
pub fn cohens_dz(differences: &[f64]) -> Result<f64, Undefined> {
    finite(differences)?;
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    if differences.len() < 2 {
        return Err(Undefined::OnePair);
    }
    if differences.iter().all(|d| *d == differences[0]) {
        return Err(Undefined::NoSpread);
    }
    let variance = differences.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / (n - 1.0);
    // The differences are not all equal, but their squared deviations underflow to 0.
    if variance > 0.0 { Ok(mean / variance.sqrt()) } else { Err(Undefined::NoSpread) }
}

fn finite(differences: &[f64]) -> Result<(), Undefined> {
    if differences.is_empty() {
        Err(Undefined::NoPairs)
    } else if differences.iter().any(|d| !d.is_finite()) {
        Err(Undefined::NotFinite)
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        // Ranks 1, 2, 3 of -1, 2, 3.
        assert_eq!(rank_biserial(&[2.0, -1.0, 3.0, 0.0]), Ok(4.0 / 6.0));
        assert_eq!(rank_biserial(&[-1.0, -5.0]), Ok(-1.0));
        // Mean 2, variance 1.
        assert_eq!(cohens_dz(&[1.0, 2.0, 3.0]), Ok(2.0));
    }

    #[test]
    fn degenerate_samples_have_reasons() {
        assert_eq!(rank_biserial(&[]), Err(Undefined::NoPairs));
        assert_eq!(rank_biserial(&[0.0]), Err(Undefined::AllZero));
        assert_eq!(cohens_dz(&[0.1]), Err(Undefined::OnePair));
        assert_eq!(cohens_dz(&[0.1, 0.1, 0.1]), Err(Undefined::NoSpread));
        assert_eq!(cohens_dz(&[0.1, f64::NAN]), Err(Undefined::NotFinite));
    }
}

//! Allometry: pipe exponents at forks, and slopes of standardised major axes.

use orchard_geometry::math;

use super::branches::Branch;

/// Largest exponent searched; a fork without one below it counts as having none.
const EXPONENT_MAX: f64 = 50.0;

/// A slope in log-log space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Slope of the standardised major axis: sd(log y) / sd(log x), with the sign of the correlation.
    pub slope: f64,
    /// Squared correlation.
    pub r_squared: f64,
    /// Number of pairs.
    pub n: usize,
}

/// Standardised (reduced) major axis of log y on log x (Warton et al. 2006, Biol. Rev. 81:259-291). Pairs without
/// a logarithm are left out.
pub fn standardised_major_axis(pairs: impl IntoIterator<Item = (f64, f64)>) -> Slope {
    let positive = pairs.into_iter().filter(|&(x, y)| x > 0.0 && y > 0.0);
    let logs: Vec<(f64, f64)> = positive.map(|(x, y)| (math::ln(x), math::ln(y))).collect();
    let [xx, yy, xy] = squares(&logs);
    Slope { slope: (yy / xx).sqrt().copysign(xy), r_squared: xy * xy / (xx * yy), n: logs.len() }
}

/// Slope of the regression of y on x.
pub fn regression(pairs: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let pairs: Vec<(f64, f64)> = pairs.into_iter().collect();
    let [xx, _, xy] = squares(&pairs);
    xy / xx
}

/// A power law y = level (x / reference)^exponent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// Slope of the regression of log y on log x.
    pub exponent: f64,
    /// Figure of the law at the reference.
    pub level: f64,
    /// Standard deviation of log y about the law, with two degrees of freedom less than pairs.
    pub scatter: f64,
}

/// The power law through pairs, by the regression of log y on log x. Pairs without a logarithm are left out.
pub fn power_law(pairs: impl IntoIterator<Item = (f64, f64)>, reference: f64) -> PowerLaw {
    let positive = pairs.into_iter().filter(|&(x, y)| x > 0.0 && y > 0.0);
    let logs: Vec<(f64, f64)> = positive.map(|(x, y)| (math::ln(x / reference), math::ln(y))).collect();
    let n = logs.len() as f64;
    let [xx, yy, xy] = squares(&logs);
    let exponent = xy / xx;
    let mean = logs.iter().map(|(x, y)| y - exponent * x).sum::<f64>() / n;
    let scatter = ((yy - exponent * xy).max(0.0) / (n - 2.0)).sqrt();
    PowerLaw { exponent, level: math::exp(mean), scatter }
}

/// Sums of squares about the means: of x, of y, and of their products.
fn squares(pairs: &[(f64, f64)]) -> [f64; 3] {
    let n = pairs.len() as f64;
    let (mean_x, mean_y) = pairs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    pairs.iter().fold([0.0; 3], |[xx, yy, xy], (x, y)| {
        let (dx, dy) = (x - mean_x, y - mean_y);
        [xx + dx * dx, yy + dy * dy, xy + dx * dy]
    })
}

/// The exponent b of the pipe model at one fork, `sum d_child^b = d_parent^b`; `None` where a child is as thick as
/// the parent or the children are so thin that no b > 0 exists (a single child).
pub fn pipe_exponent(parent: f64, children: &[f64]) -> Option<f64> {
    if children.len() < 2 || children.iter().any(|&child| child >= parent) {
        return None;
    }
    let excess = |b: f64| children.iter().map(|child| math::pow(child / parent, b)).sum::<f64>() - 1.0;
    let (mut low, mut high) = (0.0, EXPONENT_MAX);
    if excess(high) > 0.0 {
        return None;
    }
    // The sum falls monotonically from the number of children, at b = 0, to 0. 60 halvings exhaust an f64.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

/// Diameter of every piece of wood that ends in a fork, and those of its children \[m\].
fn forks(branches: &[Branch]) -> Vec<(f64, Vec<f64>)> {
    let mut children = vec![Vec::new(); branches.len()];
    for branch in branches {
        if let Some(parent) = branch.parent {
            children[parent].push(branch.diameter);
        }
    }
    let forks = branches.iter().zip(children).map(|(branch, children)| (branch.diameter, children));
    forks.filter(|(_, children)| children.len() > 1).collect()
}

/// Diameter of every piece but the first over that of the piece on which it stands.
pub fn diameter_ratios(branches: &[Branch]) -> Vec<f64> {
    let ratio = |branch: &Branch| Some(branch.diameter / branches[branch.parent?].diameter);
    branches.iter().filter_map(ratio).collect()
}

/// Pipe exponents at a tree's forks, where they exist.
pub fn pipe_exponents(branches: &[Branch]) -> Vec<f64> {
    forks(branches).iter().filter_map(|(parent, children)| pipe_exponent(*parent, children)).collect()
}

/// Summed cross-sections of the children over the parent's, at a tree's forks.
pub fn area_ratios(branches: &[Branch]) -> Vec<f64> {
    let ratio = |(parent, children): &(f64, Vec<f64>)| {
        children.iter().map(|child| child * child).sum::<f64>() / (parent * parent)
    };
    forks(branches).iter().map(ratio).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_has_its_exponent() {
        let pairs = (1..20).map(|k| (f64::from(k), 3.0 * math::pow(f64::from(k), 2.57)));
        let fit = standardised_major_axis(pairs);
        assert!((fit.slope - 2.57).abs() < 1e-12 && (fit.r_squared - 1.0).abs() < 1e-12 && fit.n == 19);
        let falling = standardised_major_axis([(1.0, 4.0), (2.0, 2.0), (4.0, 1.0), (0.0, 5.0)]);
        assert!((falling.slope + 1.0).abs() < 1e-12 && falling.n == 3);
    }

    /// About y = 2 x^3 at x = 1, 1, e, e with log y one above and one below: the scatter is sqrt(4 / 2).
    #[test]
    fn a_law_has_its_exponent_level_and_scatter() {
        let e = std::f64::consts::E;
        let y = |x: f64, off: f64| (x, 2.0 * x * x * x * math::exp(off));
        let law = power_law([y(1.0, 1.0), y(1.0, -1.0), y(e, 1.0), y(e, -1.0), (0.0, 1.0)], e);
        assert!((law.exponent - 3.0).abs() < 1e-12 && (law.level - 2.0 * e * e * e).abs() < 1e-12);
        assert!((law.scatter - 2.0_f64.sqrt()).abs() < 1e-12);
    }

    /// The slope is the ratio of standard deviations for any correlation.
    #[test]
    fn scatter_steepens_the_major_axis() {
        let e = std::f64::consts::E;
        let fit = standardised_major_axis([(1.0, 1.0), (1.0, e * e), (e, e), (e, e * e * e)]);
        // sd of log x: 1/2; of log y (0, 2, 1, 3): sqrt(5)/2.
        assert!((fit.slope - 5.0_f64.sqrt()).abs() < 1e-12 && (fit.r_squared - 0.2).abs() < 1e-12);
    }

    #[test]
    fn exponents_of_known_forks() {
        let b = pipe_exponent(5.0, &[3.0, 4.0]).unwrap();
        assert!((b - 2.0).abs() < 1e-12, "{b}");
        let b = pipe_exponent(2.0, &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]).unwrap();
        assert!((b - 3.0).abs() < 1e-12, "{b}");
        assert_eq!(pipe_exponent(2.0, &[2.0, 1.0]), None);
        assert_eq!(pipe_exponent(2.0, &[1.0]), None);
    }
}

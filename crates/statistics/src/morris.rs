//! Screening of parameters by elementary effects.
//!
//! A trajectory walks through the unit cube of `k` parameters in `k` steps, each of which changes one parameter by [`STEP`], up or down; the
//! change of a figure over the step is the elementary effect of that parameter (Morris 1991). Over trajectories from random places, `mu*`, the
//! mean of the effects' magnitudes, ranks the parameters (Campolongo, Cariboni and Saltelli 2007), and `sigma`, their standard deviation, tells
//! how far an effect depends on where the other parameters stand.

use orchard_spec::{Purpose, Stream};
use serde::Serialize;

use crate::bootstrap::Resamples;
use crate::rules::BootstrapRules;
use crate::undefined::Undefined;

/// Levels of a parameter: 0, 1/3, 2/3 and 1 of its range.
pub const LEVELS: u32 = 4;

/// Step of a parameter, as a share of its range: `p / (2 (p - 1))` of `p` levels, with which all levels are equally likely (Morris 1991, section 4).
pub const STEP: f64 = LEVELS as f64 / (2 * (LEVELS - 1)) as f64;

/// A walk through the unit cube.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// The points, one more than there are parameters.
    pub points: Vec<Vec<f64>>,
    /// The parameter that changes between each point and the next.
    pub order: Vec<usize>,
}

impl Trajectory {
    /// Draws trajectory `number` of a seed.
    pub fn draw(parameters: usize, seed: u64, number: u32) -> Self {
        let mut stream = Stream::new(seed, number, Purpose::Screening);
        let level = |stream: &mut Stream| f64::from(stream.integer(0, LEVELS - 1)) / f64::from(LEVELS - 1);
        let start: Vec<f64> = (0..parameters).map(|_| level(&mut stream)).collect();
        let mut order: Vec<usize> = (0..parameters).collect();
        stream.shuffle(&mut order);
        let mut points = vec![start];
        for &parameter in &order {
            let mut next = points[points.len() - 1].clone();
            let low = next[parameter] < 0.5;
            next[parameter] = (next[parameter] + if low { STEP } else { -STEP }).clamp(0.0, 1.0);
            points.push(next);
        }
        Self { points, order }
    }

    /// The elementary effect of each parameter on a figure with these values at the points: change of the figure over change of the
    /// parameter, per whole range.
    ///
    /// # Panics
    /// There are fewer values than points.
    pub fn effects(&self, values: &[f64]) -> Vec<f64> {
        let mut effects = vec![0.0; self.order.len()];
        for (step, &parameter) in self.order.iter().enumerate() {
            let change = self.points[step + 1][parameter] - self.points[step][parameter];
            effects[parameter] = (values[step + 1] - values[step]) / change;
        }
        effects
    }
}

/// Summary of the elementary effects of one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Screened {
    /// Mean magnitude, per whole range of the parameter.
    pub mu_star: f64,
    /// Bootstrap interval over trajectories.
    pub mu_star_ci95: [f64; 2],
    /// Mean: its sign is the direction.
    pub mu: f64,
    /// Standard deviation (of n - 1).
    pub sigma: f64,
    /// Bootstrap interval over trajectories.
    pub sigma_ci95: [f64; 2],
}

impl Screened {
    /// Sums up the effects of one parameter, one of each trajectory.
    ///
    /// # Errors
    /// Fewer than two effects, or one that is not finite.
    pub fn of(effects: &[f64], rules: &BootstrapRules) -> Result<Self, Undefined> {
        if effects.iter().any(|effect| !effect.is_finite()) {
            return Err(Undefined::NotFinite);
        }
        if effects.len() < 2 {
            return Err(if effects.is_empty() { Undefined::NothingToMeasure } else { Undefined::OneTree });
        }
        let all: Vec<usize> = (0..effects.len()).collect();
        let resamples = Resamples::draw(std::slice::from_ref(&all), rules);
        let mean_of = |drawn: &[usize], of: &dyn Fn(f64) -> f64| {
            drawn.iter().map(|&i| of(effects[i])).sum::<f64>() / drawn.len() as f64
        };
        let mu_star = |drawn: &[usize]| mean_of(drawn, &f64::abs);
        let sigma = |drawn: &[usize]| {
            let mean = mean_of(drawn, &|effect| effect);
            let squares = drawn.iter().map(|&i| (effects[i] - mean) * (effects[i] - mean)).sum::<f64>();
            (squares / (drawn.len() - 1) as f64).sqrt()
        };
        Ok(Self {
            mu_star: mu_star(&all),
            mu_star_ci95: resamples.interval_of(|drawn| Some(mu_star(drawn)))?,
            mu: mean_of(&all, &|effect| effect),
            sigma: sigma(&all),
            sigma_ci95: resamples.interval_of(|drawn| Some(sigma(drawn)))?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rules::bootstrap;

    #[test]
    fn a_trajectory_changes_each_parameter_once_by_a_step() {
        for number in 0..50 {
            let walk = Trajectory::draw(7, 3, number);
            assert_eq!(walk.points.len(), 8);
            let mut changed = walk.order.clone();
            changed.sort_unstable();
            assert_eq!(changed, [0, 1, 2, 3, 4, 5, 6]);
            for (pair, &parameter) in walk.points.windows(2).zip(&walk.order) {
                for (i, (before, after)) in pair[0].iter().zip(&pair[1]).enumerate() {
                    let change = if i == parameter { STEP } else { 0.0 };
                    assert!(((after - before).abs() - change).abs() < 1e-12, "{walk:?}");
                }
            }
            assert!(walk.points.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
        }
        assert_eq!(Trajectory::draw(7, 3, 4), Trajectory::draw(7, 3, 4));
        assert_ne!(Trajectory::draw(7, 3, 4), Trajectory::draw(7, 3, 5));
        assert_ne!(Trajectory::draw(7, 3, 4), Trajectory::draw(7, 4, 4));
    }

    /// All four levels are visited about equally often, by starts and by ends of steps.
    #[test]
    fn levels_are_equally_likely() {
        let mut counts = [0_u32; LEVELS as usize];
        for number in 0..2000 {
            let walk = Trajectory::draw(1, 8, number);
            for point in &walk.points {
                counts[(point[0] * f64::from(LEVELS - 1)).round() as usize] += 1;
            }
        }
        // Binomial(4000, 1/4) of pairs: five standard deviations of 2000 pairs, each of which gives two levels of four.
        assert!(counts.iter().all(|&n| (f64::from(n) - 1000.0).abs() < 112.0), "{counts:?}");
    }

    fn screened(figure: fn(&[f64]) -> f64, parameters: usize) -> Vec<Screened> {
        let walks: Vec<Vec<f64>> = (0..200)
            .map(|number| {
                let walk = Trajectory::draw(parameters, 5, number);
                walk.effects(&walk.points.iter().map(|x| figure(x)).collect::<Vec<f64>>())
            })
            .collect();
        let of = |i: usize| walks.iter().map(|effects| effects[i]).collect::<Vec<f64>>();
        (0..parameters).map(|i| Screened::of(&of(i), &bootstrap()).unwrap()).collect()
    }

    /// The effects of a linear function are its coefficients, wherever a trajectory is.
    #[test]
    fn a_linear_function_shows_its_coefficients() {
        let found = screened(|x| 1.0 + 2.0 * x[0] - 3.0 * x[1] + 0.0 * x[2], 3);
        for (of, slope) in found.iter().zip([2.0, -3.0, 0.0_f64]) {
            assert!((of.mu - slope).abs() < 1e-9 && (of.mu_star - slope.abs()).abs() < 1e-9, "{of:?}");
            assert!(of.sigma < 1e-9 && of.mu_star_ci95[1] - of.mu_star_ci95[0] < 1e-9, "{of:?}");
        }
    }

    /// Of `f = (x0 - 1/2) x1 + x2` the effect of x1 is `x0 - 1/2`: one of -1/2, -1/6, 1/6, 1/2, with mean 0, mean magnitude 1/3 and variance
    /// 5/36. The effect of x0 is x1: mean 1/2 and the same variance. x2 does not interact.
    #[test]
    fn an_interaction_shows_in_sigma() {
        let [x0, x1, x2] = screened(|x| (x[0] - 0.5) * x[1] + x[2], 3)[..] else { panic!("three") };
        // 200 effects with the standard deviation 0.373: five standard errors of the mean are 0.13, of the magnitude (sd 1/6) 0.06.
        assert!(x1.mu.abs() < 0.13 && (x1.mu_star - 1.0 / 3.0).abs() < 0.06, "{x1:?}");
        assert!((x0.mu - 0.5).abs() < 0.13 && x0.mu == x0.mu_star, "{x0:?}");
        for of in [x0, x1] {
            // The standard error of the variance is below a tenth of it.
            assert!((of.sigma * of.sigma * 36.0 / 5.0 - 1.0).abs() < 0.3, "{of:?}");
            assert!(of.sigma_ci95[0] <= of.sigma && of.sigma <= of.sigma_ci95[1], "{of:?}");
        }
        assert!(x2.sigma < 1e-9 && (x2.mu_star - 1.0).abs() < 1e-9, "{x2:?}");
        assert!(x1.mu_star_ci95[0] < 1.0 / 3.0 + 0.06 && x1.mu_star_ci95[1] < x2.mu_star, "{x1:?}");
    }

    #[test]
    fn too_few_effects_have_reasons() {
        let of = |effects: &[f64]| Screened::of(effects, &bootstrap());
        assert_eq!(of(&[]), Err(Undefined::NothingToMeasure));
        assert_eq!(of(&[1.0]), Err(Undefined::OneTree));
        assert_eq!(of(&[1.0, f64::NAN]), Err(Undefined::NotFinite));
    }
}

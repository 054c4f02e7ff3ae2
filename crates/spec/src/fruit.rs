//! Apples: number, size, stem and detachment.

use orchard_quantity::{Count, Normal, Quantity, Span};
use serde::{Deserialize, Serialize};

use crate::Stream;

/// Apples and their stems.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FruitSpec {
    /// Number of fruit on a tree (fewer if the tree has fewer sites).
    pub count: Count,
    /// Radius, drawn uniformly and then rounded to `radius_step`.
    pub radius: Span,
    /// Step to which radii are rounded.
    pub radius_step: Quantity,
    /// Diameter, drawn in place of `radius`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter: Option<Normal>,
    /// Mass.
    pub mass: Span,
    /// Mass over the cube of the diameter, drawn in place of `mass`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_per_cube: Option<Normal>,
    /// Hanging distance from the spur to the skin of the fruit.
    pub stem_length: Quantity,
    /// Radius of the stem in pictures.
    pub stem_radius: Quantity,
    /// Stiffness of the stem tether, k_s.
    pub stem_stiffness: Quantity,
    /// Damping ratio of the fruit on its tether.
    pub stem_damping_ratio: Quantity,
    /// Largest reaction of the tether on the wood.
    pub reaction_cap: Quantity,
    /// True if the static weight of the fruit does not load the wood (the paper's rule).
    pub weight_compensated: bool,
    /// Direct pull that detaches a fruit, f_detach.
    pub detach_force: Span,
    /// Consecutive frames with a pull above f_detach before a fruit detaches.
    pub pull_frames: Count,
    /// Stem tension that detaches a fruit, as a multiple of f_detach.
    pub tension_factor: Quantity,
    /// Consecutive frames above that tension before a fruit detaches.
    pub tension_frames: Count,
    /// Friction coefficient of the skin.
    pub friction: Quantity,
    /// Contact stiffness of the flesh.
    pub contact_stiffness: Quantity,
    /// Quadratic drag coefficient of a loose sphere.
    pub drag_coefficient: Quantity,
    /// Rate at which a loose fruit loses its spin (rolling resistance of soil and grass).
    pub rolling_loss: Quantity,
    /// Stem that bends, twists and pulls taut. Without it a fruit is a point on a tether, as in the paper, and `detach_force`,
    /// `pull_frames`, `tension_factor` and `tension_frames` say when it comes off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stem: Option<StemSpec>,
    /// Density of air.
    pub air_density: Quantity,
    /// Part of the closing speed that a loose fruit keeps in a bounce.
    pub restitution: Quantity,
    /// Frames that a loose fruit must be free of the hand before the rigid-body engine takes it over.
    pub hand_over_frames: Count,
    /// Gap to both fingers, or to a finger and the hand, below which a loose fruit is taken into the coupled solve.
    pub grasp_range: Quantity,
    /// Impact energy from which an apple bruises.
    pub bruise_energy: Quantity,
    /// Volume of bruises; without it only their energies are recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bruise: Option<BruiseSpec>,
    /// Impact energy below which no event is recorded.
    pub impact_floor: Quantity,
    /// Chance that an eligible spur carries fruit, before the outerness factor.
    pub placement_probability: Quantity,
    /// Part of the placement chance that does not depend on outerness.
    pub placement_base: Quantity,
    /// Part that grows with outerness (0 at the trunk axis, 1 at the canopy's edge).
    pub placement_outer: Quantity,
    /// Thickest spur that carries fruit, radius.
    pub spur_radius_max: Quantity,
    /// Lowest branch order that carries fruit.
    pub min_order: Count,
    /// Least distance between the centres of two hanging fruit over the sum of their radii.
    pub spacing: Quantity,
    /// Number of fruit at rest in the bucket at which a helper exchanges it for an empty one, once the hand is not over it; without it nobody does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bucket_exchange: Option<Count>,
    /// Clusters; without it every spur bears one fruit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cluster: Option<ClusterSpec>,
}

/// Clusters of fruit on one spur.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawCluster")]
pub struct ClusterSpec {
    /// Share of the clusters with one fruit, with two, and so on; only their ratios count.
    pub shares: Vec<Quantity>,
    /// Distance between the centres of two fruit side by side in a cluster over the sum of their radii.
    pub gap: Quantity,
    /// Largest overlap of two fruit in the tree at rest over the sum of their radii; a fruit that would overlap another one more is left out.
    pub flat: Quantity,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCluster {
    shares: Vec<Quantity>,
    gap: Quantity,
    flat: Quantity,
}

impl TryFrom<RawCluster> for ClusterSpec {
    type Error = String;

    fn try_from(RawCluster { shares, gap, flat }: RawCluster) -> Result<Self, String> {
        if shares.iter().map(Quantity::si).sum::<f64>() > 0.0 {
            Ok(Self { shares, gap, flat })
        } else {
            Err("shares: one of them at least must be above 0".to_owned())
        }
    }
}

impl ClusterSpec {
    /// Draws the number of fruit of a cluster.
    pub fn draw(&self, stream: &mut Stream) -> usize {
        let mut left = stream.uniform(0.0, self.shares.iter().map(Quantity::si).sum());
        let is_drawn = |share: &Quantity| {
            left -= share.si();
            left < 0.0
        };
        // Rounding may leave the last one.
        1 + self.shares.iter().position(is_drawn).unwrap_or(self.shares.len() - 1)
    }
}

/// Volume of bruises.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BruiseSpec {
    /// Bruised volume for each joule of an impact above `bruise_energy`.
    pub susceptibility: Quantity,
    /// Squeeze by one finger for which a volume was measured.
    pub squeeze_force: Quantity,
    /// That volume.
    pub squeeze_volume: Quantity,
    /// Exponent by which the volume grows with the force.
    pub squeeze_exponent: Quantity,
}

impl FruitSpec {
    /// Returns these fruit as points on tethers: for backends without stems that bend.
    pub fn on_tethers(&self) -> Self {
        Self { stem: None, ..self.clone() }
    }
}

/// A stem on which a fruit turns as a body: a rod that bends and twists about the spur, straight from there to the fruit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StemSpec {
    /// Stiffness between the two ends of the rod, along it and across it.
    pub stiffness: Quantity,
    /// Damping ratio of the fruit on that stiffness.
    pub damping_ratio: Quantity,
    /// Bending stiffness at the spur.
    pub bending_stiffness: Quantity,
    /// Twisting stiffness.
    pub twisting_stiffness: Quantity,
    /// Damping ratio of the fruit as a pendulum, and of its twist.
    pub swing_damping_ratio: Quantity,
    /// When it comes off.
    pub release: ReleaseSpec,
}

/// Strength of the abscission zone, where the stem comes off its spur, and of the spur itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReleaseSpec {
    /// Pull along the zone's axis that a zone bears for `hold_time`, drawn for each fruit.
    pub pull_strength: Strength,
    /// Strength against a pull across the zone (a bent stem) over that along its axis.
    pub bent: Quantity,
    /// Torque about the stem that a zone bears for `hold_time`, drawn for each fruit.
    pub twist_strength: Strength,
    /// Pull that the spur bears for `hold_time`, drawn for each fruit.
    pub spur_strength: Strength,
    /// Time for which tissue bears its strength.
    pub hold_time: Quantity,
    /// Exponent n of the life of tissue under load: a load of u times its strength is borne for `hold_time / u^n`.
    pub rate_exponent: Quantity,
    /// Largest load at rest, u. A fruit that was drawn weaker gets the strength that it shows by hanging.
    pub rest_load: Quantity,
}

/// Distribution of a strength over fruit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Strength {
    /// The logarithm is normal.
    Lognormal {
        /// Median.
        median: Quantity,
        /// Standard deviation of the logarithm.
        spread: Quantity,
    },
    /// Weibull: the weakest of many links.
    Weibull {
        /// Strength that 1 / e of all exceed.
        scale: Quantity,
        /// Shape.
        shape: Quantity,
    },
}

impl Strength {
    /// Chance that what has borne a growing load up to here gives way, for each unit by which the load's logarithm grows: the hazard at the load \[N or
    /// N m\] times the load.
    pub fn hazard(&self, load: f64) -> f64 {
        match self {
            Self::Lognormal { median, spread } => {
                let z = libm::log(load / median.si()) / spread.si();
                let density = libm::exp(-0.5 * z * z) / libm::sqrt(std::f64::consts::TAU);
                let survival = 0.5 * libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2);
                density / (spread.si() * survival.max(f64::MIN_POSITIVE))
            }
            Self::Weibull { scale, shape } => shape.si() * libm::pow(load / scale.si(), shape.si()),
        }
    }

    /// Draws a strength \[N or N m\].
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        match self {
            Self::Lognormal { median, spread } => median.si() * libm::exp(stream.normal(0.0, spread.si())),
            Self::Weibull { scale, shape } => {
                scale.si() * libm::pow(-libm::log(1.0 - stream.unit()), 1.0 / shape.si())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Preset, Purpose, Spec};

    /// The share of draws in a short interval of loads, among those above its lower end, over the interval's logarithm.
    #[test]
    fn hazards_are_those_of_draws() {
        let stem = Spec::preset(Preset::Calibrated).fruit.stem.unwrap();
        let lognormal = stem.release.pull_strength;
        let Strength::Lognormal { median, spread } = &lognormal else { panic!("the preset's law") };
        // A Weibull law with scale 26 N and shape 0.598 takes the same numbers.
        let weibull = Strength::Weibull { scale: median.clone(), shape: spread.clone() };
        for law in [lognormal.clone(), weibull] {
            let mut stream = Stream::new(1, 0, Purpose::Test);
            let drawn: Vec<f64> = (0..200_000).map(|_| law.draw(&mut stream)).collect();
            for load in [10.0, 26.0, 50.0] {
                let (low, high) = (load * 0.98, load * 1.02);
                let above = drawn.iter().filter(|x| **x >= low).count() as f64;
                let within = drawn.iter().filter(|x| (low..high).contains(*x)).count() as f64;
                let seen = within / above / libm::log(high / low);
                // Four standard errors of a count, and 1 % for the width of the interval.
                let allowed = 4.0 / within.sqrt() + 0.01;
                assert!(
                    (law.hazard(load) / seen - 1.0).abs() < allowed + 0.5 * seen * 0.04,
                    "{law:?} {load}: {seen}"
                );
            }
        }
    }

    #[test]
    fn sizes_of_clusters_are_drawn_by_their_shares() {
        let law = Spec::preset(Preset::Calibrated).fruit.cluster.unwrap();
        let mut stream = Stream::new(2, 0, Purpose::Test);
        let n = 100_000;
        let mut counts = vec![0_u32; law.shares.len()];
        for _ in 0..n {
            counts[law.draw(&mut stream) - 1] += 1;
        }
        let sum: f64 = law.shares.iter().map(Quantity::si).sum();
        for (count, share) in counts.iter().zip(&law.shares) {
            let share = share.si() / sum;
            let error = (share * (1.0 - share) / f64::from(n)).sqrt();
            assert!((f64::from(*count) / f64::from(n) - share).abs() < 4.0 * error, "{counts:?}");
        }
    }
}

//! Impacts and squeezes of a fruit.

use orchard_geometry::math;
use orchard_spec::fruit::FruitSpec;
use serde::{Deserialize, Serialize};

/// Body that a fruit collided with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Partner {
    /// The ground.
    Ground,
    /// Posts and wires.
    Scenery,
    /// The bucket.
    Bucket,
    /// The chassis.
    Chassis,
    /// The arm up to the hand.
    Arm,
    /// Hand or finger.
    Hand,
    /// Another fruit, by its index.
    Fruit(usize),
}

/// Hardest impact and squeeze of a fruit so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Bruise {
    /// Energy of its hardest impact \[J\].
    pub peak_impact_energy: f64,
    /// Body that it collided with in that impact.
    pub peak_partner: Option<Partner>,
    /// Largest normal force with which one finger pressed on it \[N\], mean over a substep.
    pub peak_squeeze_force: f64,
}

impl Bruise {
    /// True if the hardest impact exceeds the bruise threshold.
    pub fn is_bruised(&self, spec: &FruitSpec) -> bool {
        self.peak_impact_energy > spec.bruise_energy.si()
    }

    /// Bruised volume \[m^3\]: of the hardest impact, in proportion to its energy above the threshold, and of the hardest squeeze, by a power of its
    /// force. `None` if the spec has no law of it.
    pub fn volume(&self, spec: &FruitSpec) -> Option<f64> {
        let law = spec.bruise.as_ref()?;
        let excess = (self.peak_impact_energy - spec.bruise_energy.si()).max(0.0);
        let squeeze = self.peak_squeeze_force / law.squeeze_force.si();
        let squeezed = law.squeeze_volume.si() * math::pow(squeeze, law.squeeze_exponent.si());
        Some(law.susceptibility.si() * excess + squeezed)
    }

    pub(crate) fn strike(&mut self, partner: Partner, energy: f64) {
        if energy > self.peak_impact_energy {
            self.peak_impact_energy = energy;
            self.peak_partner = Some(partner);
        }
    }

    pub(crate) fn squeeze(&mut self, force: f64) {
        self.peak_squeeze_force = self.peak_squeeze_force.max(force);
    }
}

/// Kinetic energy of an approach along the contact normal \[J\]: `m v_n^2 / 2` with the mass m of the fruit, or the
/// reduced mass `m_1 m_2 / (m_1 + m_2)` of two fruit (Johnson 1985, section 11.1: all that deforms the two bodies). The robot
/// counts as immovable. `approach` is their closing speed [m/s]; parting bodies have none.
pub fn impact_energy(mass: f64, other_mass: Option<f64>, approach: f64) -> f64 {
    let reduced = other_mass.map_or(mass, |other| mass * other / (mass + other));
    let approach = approach.max(0.0);
    0.5 * reduced * approach * approach
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_spec::{Preset, Spec};

    /// Squeezes of 57 and 106 N bruised 363 and 6233 mm3; a fall of 1 m of an apple of 180 g has 1.77 J.
    #[test]
    fn volumes_are_those_of_the_measured_loads() {
        let spec = Spec::preset(Preset::Calibrated).fruit;
        let volume = |energy: f64, force: f64| {
            let mut bruise = Bruise::default();
            bruise.strike(Partner::Bucket, energy);
            bruise.squeeze(force);
            1e9 * bruise.volume(&spec).unwrap()
        };
        assert!((volume(0.0, 57.0) - 363.0).abs() < 1.0);
        assert!((volume(0.0, 106.0) / 6233.0 - 1.0).abs() < 0.02);
        assert!((volume(1.77, 0.0) - 3000.0 * (1.77 - spec.bruise_energy.si())).abs() < 1e-6);
        assert_eq!(volume(0.5 * spec.bruise_energy.si(), 0.0), 0.0);
        assert_eq!(Bruise::default().volume(&Spec::paper().fruit), None);
    }
}

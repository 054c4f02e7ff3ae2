//! Impacts and squeezes of a fruit.

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

//! Spec of bumpy ground.

use orchard_quantity::{Count, Quantity};
use serde::{Deserialize, Serialize};

/// Bumpy ground: octaves of periodic value noise, flat about the trunk. If disabled, the ground is the plane z = 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TerrainSpec {
    /// True for bumpy ground, false for the plane z = 0.
    pub enabled: bool,
    /// Largest deviation of the ground from the plane z = 0, which the highest bump or the deepest hollow
    /// reaches exactly.
    pub amplitude: Quantity,
    /// Distance after which the ground repeats itself along x and along y: the pitch of trees in a row of worlds.
    pub period: Quantity,
    /// Cells of the ground's grid in a period.
    pub grid_cells: Count,
    /// Cells of the first octave's lattice in a period. Each further octave has twice as many.
    pub lattice_cells: Count,
    /// Number of octaves.
    pub octaves: Count,
    /// Height of an octave relative to the one before.
    pub persistence: Quantity,
    /// Radius of the flat disc about the trunk.
    pub flat_radius: Quantity,
    /// Width of the ring about the disc in which the bumps rise to their height.
    pub blend_width: Quantity,
    /// Slope of the plane that the bumps stand on, through the foot of the trunk; absent for a level one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slope: Option<SlopeSpec>,
}

/// A plane that rises.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlopeSpec {
    /// Angle to the horizontal.
    pub angle: Quantity,
    /// Bearing in which the ground rises, from the world's x axis.
    pub bearing: Quantity,
}

impl TerrainSpec {
    /// Returns enabled terrain of another amplitude \[m\].
    ///
    /// # Errors
    /// The amplitude is outside its range.
    pub fn with_amplitude(&self, amplitude: f64) -> Result<Self, String> {
        let amplitude = self.amplitude.with_value(amplitude / self.amplitude.unit().to_si())?;
        Ok(Self { enabled: true, amplitude, ..self.clone() })
    }

    /// Distance between the nodes of the ground's grid \[m\].
    pub fn spacing(&self) -> f64 {
        self.period.si() / f64::from(self.grid_cells.get())
    }
}

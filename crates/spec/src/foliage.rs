//! Leaf density, size and shape.

use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

/// Leaf density and shape. The blade's size follows the foliage dial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoliageSpec {
    /// The foliage dial: 0 is no leaf, 1 the reference density.
    pub density: Quantity,
    /// Leaves on a twig internode as the dial goes to 0.
    pub leaves_base: Quantity,
    /// Further leaves on a twig internode for each unit of the dial.
    pub leaves_slope: Quantity,
    /// Lowest branch order that bears leaves.
    pub min_order: Count,
    /// Lowest branch order that bears leaves where the dial is above `dense_above`.
    pub dense_min_order: Count,
    /// Dial above which lower orders bear leaves too.
    pub dense_above: Quantity,
    /// Blade length as the dial goes to 0.
    pub blade_length_base: Quantity,
    /// Further blade length for each unit of the dial.
    pub blade_length_slope: Quantity,
    /// Blade width as the dial goes to 0.
    pub blade_width_base: Quantity,
    /// Further blade width for each unit of the dial.
    pub blade_width_slope: Quantity,
    /// Relative difference in blade size from one of the three size classes to the next.
    pub size_step: Quantity,
    /// Roll from one leaf of an internode to the next.
    pub divergence: Span,
    /// Length of the petiole.
    pub petiole_length: Quantity,
    /// Angle between the twig and the petiole.
    pub petiole_angle: Span,
    /// Downward bend from the petiole to the blade.
    pub blade_droop: Span,
    /// Angle by which each half of a blade rises from its flat form.
    pub blade_fold: Quantity,
    /// Angle through which the midrib bends down from petiole to tip.
    pub blade_curl: Quantity,
    /// Leaf area by shoots, for grammars that grow shoots. It replaces the leaves an internode, the blade's size and the
    /// orders that bear leaves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaf_area: Option<LeafAreaSpec>,
}

/// Leaf area of a shoot of the last season from its length L: base + slope L at dial 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafAreaSpec {
    /// Base of a vegetative shoot.
    pub vegetative_base: Quantity,
    /// Slope of a vegetative shoot, area over length.
    pub vegetative_slope: Quantity,
    /// Base of a floral shoot.
    pub floral_base: Quantity,
    /// Slope of a floral shoot.
    pub floral_slope: Quantity,
    /// Mean area of a blade.
    pub blade_area: Quantity,
    /// Width of a blade over its length.
    pub aspect: Quantity,
}

impl LeafAreaSpec {
    /// Leaf area [m^2] at dial 1 of a shoot of a given length \[m\].
    pub fn of_shoot(&self, length: f64, floral: bool) -> f64 {
        let (base, slope) = if floral {
            (&self.floral_base, &self.floral_slope)
        } else {
            (&self.vegetative_base, &self.vegetative_slope)
        };
        base.si() + slope.si() * length
    }

    /// Number of blades of about the mean area that add up to an area [m^2].
    pub fn leaves(&self, area: f64) -> u32 {
        if area > 0.0 { (area / self.blade_area.si()).round().max(1.0) as u32 } else { 0 }
    }
}

impl FoliageSpec {
    /// Number of leaves on an internode that bears leaves.
    pub fn leaves_per_internode(&self) -> u32 {
        let dial = self.density.si();
        if dial == 0.0 { 0 } else { (self.leaves_base.si() + self.leaves_slope.si() * dial).round() as u32 }
    }

    /// Lowest branch order that bears leaves at this dial.
    pub fn lowest_order(&self) -> u32 {
        let dense = self.density.si() > self.dense_above.si();
        if dense { self.dense_min_order.get() } else { self.min_order.get() }
    }

    /// Length and width of a blade of the middle size class \[m\].
    pub fn blade_size(&self) -> (f64, f64) {
        let dial = self.density.si();
        (
            self.blade_length_base.si() + self.blade_length_slope.si() * dial,
            self.blade_width_base.si() + self.blade_width_slope.si() * dial,
        )
    }
}

//! Apples: number, size, stem and detachment.

use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

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
    /// Mass.
    pub mass: Span,
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
}

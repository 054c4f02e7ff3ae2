//! Material of every segment of a tree.

use orchard_quantity::Normal;
use orchard_spec::wood::{ScatterSpec, WoodSpec, YoungWoodSpec};
use orchard_spec::{Purpose, Stream};
use orchard_treegen::Skeleton;

/// Green density, modulus and strength of each segment of a tree, as drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Timber {
    /// Density [kg/m^3].
    pub density: Vec<f64>,
    /// Young's modulus \[Pa\].
    pub youngs_modulus: Vec<f64>,
    /// Rupture stress of the section \[Pa\].
    pub rupture_stress: Vec<f64>,
}

impl Timber {
    /// The mean wood: young wood is softer and tougher, and nothing scatters.
    pub fn mean(skeleton: &Skeleton, wood: &WoodSpec) -> Self {
        let n = skeleton.segments.len();
        let each = |mature: f64, of_shoots: fn(&YoungWoodSpec) -> f64| {
            skeleton.segments.iter().map(|s| by_age(wood, 2.0 * s.radius, mature, of_shoots)).collect()
        };
        Self {
            density: vec![wood.density.si(); n],
            youngs_modulus: each(wood.youngs_modulus.si(), |young| young.youngs_modulus.si()),
            rupture_stress: each(wood.rupture_stress.si(), |young| young.rupture_stress.si()),
        }
    }

    /// The wood of a world's tree: the mean times the factors of `wood.scatter`, one of the tree and one of each segment.
    /// Each property has a stream of its own.
    pub fn draw(skeleton: &Skeleton, wood: &WoodSpec, seed: u64, world: u32) -> Self {
        let mut timber = Self::mean(skeleton, wood);
        if let Some(ScatterSpec { density, modulus_tree, modulus, rupture_tree, rupture, rest_load: _ }) =
            &wood.scatter
        {
            let stream = |purpose| Stream::new(seed, world, purpose);
            vary(&mut timber.density, stream(Purpose::WoodDensity), None, density);
            vary(&mut timber.youngs_modulus, stream(Purpose::WoodModulus), Some(modulus_tree), modulus);
            vary(&mut timber.rupture_stress, stream(Purpose::WoodStrength), Some(rupture_tree), rupture);
        }
        timber
    }
}

/// Multiplies by a factor of the tree, then each value by its own.
fn vary(values: &mut [f64], mut stream: Stream, of_tree: Option<&Normal>, of_segment: &Normal) {
    let tree = of_tree.map_or(1.0, |factor| stream.cut_normal(factor));
    for value in values {
        *value *= tree * stream.cut_normal(of_segment);
    }
}

/// Mean of a property of wood of a diameter, that of mature wood and that of the shoots of a season.
fn by_age(wood: &WoodSpec, diameter: f64, mature: f64, of_shoots: impl Fn(&YoungWoodSpec) -> f64) -> f64 {
    let Some(young) = &wood.young else { return mature };
    let ((thin, thick), shoots) = (young.diameter.si(), of_shoots(young));
    let age = if thick > thin { ((diameter - thin) / (thick - thin)).clamp(0.0, 1.0) } else { 1.0 };
    shoots + (mature - shoots) * age
}

//! Base of a batch whose worlds the device draws: one tree with its fruit, and the table that the kernel `vary` reads.

use std::sync::Arc;

use orchard_batch::{TreeWorld, TreeWorldError};
use orchard_fruit::Fruit;
use orchard_geometry::Vec3;
use orchard_spec::fruit::FruitSpec;
use orchard_spec::randomisation::{Axis, Mode, RandomisationSpec};
use orchard_spec::wood::JointLaw;
use orchard_spec::{Purpose, Spec, Stream};
use orchard_treegen::{Segment, Skeleton, underside};

use crate::layout::{QUAD, axis, base, dial, fourth, fruit, fruit_entry, growth, link, segment, varied};
use crate::memory::Memory;

/// Parent of a segment that has none.
pub(crate) const NO_SEGMENT: u32 = u32::MAX;

/// Axes that act on physics, in the order of their entries ([`axis`]).
pub(crate) const AXES: [Axis; axis::COUNT] = [
    Axis::Scale,
    Axis::Stockiness,
    Axis::SegmentLength,
    Axis::SegmentRadius,
    Axis::SegmentBend,
    Axis::Droop,
    Axis::Lean,
    Axis::ForkSpread,
    Axis::Twist,
    Axis::WoodDensity,
    Axis::YoungsModulus,
    Axis::RuptureStress,
    Axis::FruitSize,
    Axis::FruitMass,
];

/// Error: a tree cannot be the base of a batch.
#[derive(Debug, thiserror::Error)]
pub enum BaseError {
    /// The spec asks for worlds of different topology.
    #[error(
        "randomisation.mode = distinct-topology: a graphics device changes the dimensions of one tree but cannot grow trees; use another mode, or grow the worlds on the host and use GpuBatch::new"
    )]
    Topology,
    /// The wood of the spec follows a law by which a graphics device does not draw it.
    #[error(
        "{law}: a graphics device does not draw wood by this law; grow the worlds on the host and use GpuBatch::new"
    )]
    Law {
        /// Table of the spec.
        law: &'static str,
    },
    /// The spec has fruit on stems that bend, which a graphics device steps but does not draw.
    #[error(
        "fruit.stem: a graphics device does not draw stems; draw the worlds on the host and use GpuBatch::new"
    )]
    Stems,
    /// The tree cannot form a world.
    #[error(transparent)]
    World(#[from] TreeWorldError),
}

/// Tree with its fruit, in static equilibrium, from which all worlds of a batch are drawn.
///
/// ```no_run
/// use orchard_gpu::{BaseTree, Choice, Gpu, GpuBatch};
/// use orchard_spec::{Preset, Spec, randomisation::Mode};
///
/// let (mut spec, seed) = (Spec::preset(Preset::Randomised), 1);
/// spec.randomisation.mode = Mode::SharedDimensions;
/// let skeleton = orchard_treegen::grow(&spec, seed, 0)?;
/// let fruit = orchard_fruit::place(&spec.fruit, &skeleton, seed, 0);
/// let base = BaseTree::new(spec.into(), &skeleton, fruit, seed)?;
/// let mut batch = GpuBatch::randomised(&Gpu::open(Choice::Any)?, &base, 4096)?;
/// batch.advance(60);
/// batch.redraw(&[0, 7], 1)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct BaseTree {
    spec: Arc<Spec>,
    segments: Vec<Segment>,
    seed: u64,
    world: TreeWorld,
}

impl BaseTree {
    /// Creates a base from a tree with its fruit before any randomisation; `spec.randomisation` sets the draws of the worlds, and `seed` their random streams.
    ///
    /// # Errors
    /// The mode of the spec gives every world a topology of its own, its fruit hang on stems that bend, a wind blows, its wood scatters, or follows another law that the device does not
    /// draw while some axis acts on wood, or the tree cannot form a world.
    pub fn new(
        spec: Arc<Spec>,
        skeleton: &Skeleton,
        fruit: Vec<Fruit>,
        seed: u64,
    ) -> Result<Self, BaseError> {
        if spec.randomisation.mode == Mode::DistinctTopology {
            return Err(BaseError::Topology);
        }
        if spec.fruit.stem.is_some() {
            return Err(BaseError::Stems);
        }
        let world = TreeWorld::new(spec.clone(), skeleton, fruit)?;
        let base = Self { spec, segments: skeleton.segments.clone(), seed, world };
        base.undrawn().map_or(Ok(base), |law| Err(BaseError::Law { law }))
    }

    /// A law of the wood that the kernel `vary` lacks. Scatter belongs to the world, whatever else is drawn; the others only matter where wood is drawn.
    fn undrawn(&self) -> Option<&'static str> {
        let wood = &self.spec.wood;
        let varies = AXES[..=axis::RUPTURE_STRESS].iter().any(|&axis| self.strength(axis) != 0.0);
        let laws = [
            ("wood.scatter", wood.scatter.is_some()),
            ("wood.modal_damping", varies && wood.modal_damping.is_some()),
            ("wood.young", varies && wood.young.is_some()),
            ("wood.union", varies && wood.union.is_some()),
        ];
        laws.into_iter().find(|(_, is_undrawn)| *is_undrawn).map(|(name, _)| name)
    }

    /// The base as a world.
    pub fn world(&self) -> &TreeWorld {
        &self.world
    }

    /// True if any physical axis acts; otherwise all worlds equal the base.
    pub(crate) fn varies(&self) -> bool {
        AXES.iter().any(|&axis| self.strength(axis) != 0.0)
    }

    /// Strength of an axis in the spec's mode.
    fn strength(&self, axis: Axis) -> f64 {
        let axes = &self.spec.randomisation;
        if axes.mode == Mode::Homogeneous { 0.0 } else { axes.strength(axis).si() }
    }

    /// Table of words in quads, for a memory whose first world is this tree.
    pub(crate) fn table(&self, memory: &Memory) -> Vec<[u32; QUAD]> {
        let mut words = self.head();
        for &axis in &AXES {
            words.extend(self.dial(axis));
        }
        words.extend(
            self.growths()
                .into_iter()
                .zip(&self.segments)
                .enumerate()
                .flat_map(|(index, (growth, segment))| self.segment(memory, index, growth as u32, segment)),
        );
        for (index, fruit) in self.world.plant().fruit.fruit.iter().enumerate() {
            words.extend(self.fruit_entry(memory, index, fruit));
        }
        words.chunks_exact(QUAD).map(|quad| std::array::from_fn(|k| quad[k])).collect()
    }

    fn head(&self) -> Vec<u32> {
        let (wood, fruit) = (&self.spec.wood, &self.spec.fruit);
        let mut words = vec![0; base::FIELDS];
        let forms = AXES[..=axis::TWIST].iter().any(|&axis| self.strength(axis) != 0.0);
        let law = match wood.joint_law {
            JointLaw::Paper => 0,
            JointLaw::Corrected => varied::CORRECTED,
            JointLaw::PerLevel => varied::PER_LEVEL,
        };
        words[base::FLAGS] = ((usize::from(forms) * varied::FORM) | law) as u32;
        words[base::SEGMENTS] = self.segments.len() as u32;
        words[base::FRUIT] = self.world.plant().fruit.len() as u32;
        let gravity = self.spec.sim.gravity.si();
        for (field, number) in [
            (base::CLEARANCE, self.spec.tree.clearance.si()),
            (base::DENSITY, wood.density.si()),
            (base::MODULUS, wood.youngs_modulus.si()),
            (base::STRESS, wood.rupture_stress.si()),
            (base::STIFFNESS_MIN, wood.stiffness_min.si()),
            (base::STIFFNESS_MAX, wood.stiffness_max.si()),
            (base::STEM, fruit.stem_length.si()),
            (base::STEM_DAMPING, 2.0 * fruit.stem_damping_ratio.si() * fruit.stem_stiffness.si().sqrt()),
            (base::AIR_DRAG, air_drag(fruit)),
            (base::BIAS, if fruit.weight_compensated { gravity } else { 0.0 }),
            (base::INTERNODE, self.spec.randomisation.droop.internode.si()),
        ] {
            words[field] = (number as f32).to_bits();
        }
        words
    }

    fn dial(&self, axis: Axis) -> [u32; dial::FIELDS] {
        let mut words = [0; dial::FIELDS];
        let key = Stream::key(self.seed, Purpose::Variation(axis));
        for (word, bytes) in words[dial::KEY..].iter_mut().zip(key.chunks_exact(size_of::<u32>())) {
            *word = u32::from_le_bytes(std::array::from_fn(|k| bytes[k]));
        }
        let axes = &self.spec.randomisation;
        let ([low, high], [least, most]) = drawn(axes, axis);
        for (field, number) in [
            (dial::STRENGTH, self.strength(axis)),
            (dial::LOW, low),
            (dial::HIGH, high),
            (dial::LEAST, least),
            (dial::MOST, most),
        ] {
            words[field] = (number as f32).to_bits();
        }
        words[dial::BY_EPISODE] = u32::from(axes.mode == Mode::SharedDimensions && axis.is_dimension());
        words
    }

    /// Place of each segment on the tree, bits [`growth`].
    fn growths(&self) -> Vec<usize> {
        // First segment of each segment's axis, and number of laterals of an axis so far, stored at its first segment.
        let mut axes: Vec<usize> = Vec::with_capacity(self.segments.len());
        let mut laterals = vec![0; self.segments.len()];
        let mut growths = Vec::with_capacity(self.segments.len());
        for (index, segment) in self.segments.iter().enumerate() {
            let mut bits = usize::from(segment.order > 0) * growth::BRANCH;
            let mut axis = index;
            if let Some(parent) = segment.parent {
                if segment.order == self.segments[parent].order {
                    axis = axes[parent];
                } else {
                    bits |= growth::LATERAL | laterals[axes[parent]] << growth::ORDINAL;
                    laterals[axes[parent]] += 1;
                }
            }
            axes.push(axis);
            growths.push(bits);
        }
        growths
    }

    fn segment(&self, memory: &Memory, index: usize, growth: u32, of: &Segment) -> [u32; segment::FIELDS] {
        let row = memory.row_of(0, index);
        let bits = |field: usize| memory.links[memory.link_at(0, row, field, 0)].to_bits();
        let mut words = [0; segment::FIELDS];
        words[segment::ROW] = row as u32;
        words[segment::PARENT] = of.parent.map_or(NO_SEGMENT, |parent| parent as u32);
        words[segment::GROWTH] = growth;
        let operation = memory.operations[memory.operation_at(0, row, 0)][3];
        words[segment::RADIUS_UNITS] = operation >> fourth::RADIUS & fourth::RADIUS_BITS as u32;
        let heading = of.heading();
        for k in 0..3 {
            words[segment::HEADING + k] = (heading[k] as f32).to_bits();
        }
        words[segment::LIMIT] = bits(link::LIMIT);
        for k in 0..QUAD {
            words[segment::DIRECTION + k] = bits(link::DIRECTION + k);
            words[segment::MASS + k] = bits(link::MASS + k);
        }
        words[segment::RADIUS] = (of.radius as f32).to_bits();
        words
    }

    fn fruit_entry(&self, memory: &Memory, index: usize, of: &Fruit) -> [u32; fruit_entry::FIELDS] {
        let row = memory.fruit_row_of(0, index);
        let bits = |field: usize| memory.fruit[memory.fruit_at(0, row, field, 0)].to_bits();
        let wood = &self.segments[of.segment];
        let level = Vec3::new(of.p_segment.x, of.p_segment.y, 0.0);
        let distance = level.norm();
        let across = if distance > 0.0 { level / distance } else { Vec3::zeros() };
        let under = underside(wood);
        // Division by a unit complex number is multiplication by its conjugate.
        let (real, imaginary) = (across.dot(&under), under.cross(&across).z);
        let mut words = [0; fruit_entry::FIELDS];
        words[fruit_entry::ROW] = row as u32;
        words[fruit_entry::SEGMENT] = of.segment as u32;
        for (field, number) in [
            (fruit_entry::OFF_BARK, distance - wood.radius),
            (fruit_entry::ACROSS, across.x),
            (fruit_entry::ACROSS + 1, across.y),
            (fruit_entry::FROM_UNDERSIDE, real),
            (fruit_entry::FROM_UNDERSIDE + 1, imaginary),
        ] {
            words[field] = (number as f32).to_bits();
        }
        for k in 0..QUAD {
            words[fruit_entry::MASS + k] = bits(fruit::MASS + k);
            words[fruit_entry::STIFFNESS + k] = bits(fruit::STIFFNESS + k);
            words[fruit_entry::ANCHOR + k] = bits(fruit::ANCHOR + k);
        }
        words
    }
}

/// Air drag of a fruit over the square of its radius [N s^2/m^4], as in `FruitSet`.
fn air_drag(fruit: &FruitSpec) -> f64 {
    0.5 * fruit.air_density.si() * fruit.drag_coefficient.si() * std::f64::consts::PI
}

/// Distribution of an axis ([`dial::LOW`], [`dial::HIGH`]), and its ends or the limits of the result ([`dial::LEAST`], [`dial::MOST`]).
fn drawn(axes: &RandomisationSpec, axis: Axis) -> ([f64; 2], [f64; 2]) {
    const NONE: [f64; 2] = [0.0; 2];
    let ends = |(low, high): (f64, f64)| [low, high];
    let uniform = |factor: &orchard_spec::randomisation::Factor| (ends(factor.factor.si()), NONE);
    let normal = |factor: &orchard_spec::randomisation::NormalFactor| {
        ([factor.factor.mean_si(), factor.factor.sd_si()], ends(factor.factor.ends_si()))
    };
    let clipped = |factor: &orchard_spec::randomisation::ClippedFactor| {
        (ends(factor.factor.si()), ends(factor.limits.si()))
    };
    match axis {
        Axis::Scale => uniform(&axes.scale),
        Axis::Stockiness => uniform(&axes.stockiness),
        Axis::SegmentLength => normal(&axes.segment_length),
        Axis::SegmentRadius => normal(&axes.segment_radius),
        Axis::SegmentBend => ([0.0, axes.segment_bend.sd.si()], NONE),
        Axis::Droop => (ends(axes.droop.factor.si()), NONE),
        Axis::Lean => (ends(axes.lean.angle.si()), NONE),
        Axis::ForkSpread => uniform(&axes.fork_spread),
        Axis::Twist => (ends(axes.twist.angle.si()), NONE),
        Axis::WoodDensity => uniform(&axes.wood_density),
        Axis::YoungsModulus => uniform(&axes.youngs_modulus),
        Axis::RuptureStress => uniform(&axes.rupture_stress),
        Axis::FruitSize => clipped(&axes.fruit_size),
        Axis::FruitMass => clipped(&axes.fruit_mass),
        // Not a physical axis: it has no entry.
        _ => (NONE, NONE),
    }
}

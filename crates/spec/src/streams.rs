//! Named, seeded, counter-based random streams.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use crate::axis::Axis;

/// Purpose of a stream's numbers. There is one stream for each (seed, world, purpose), so that more draws for one
/// purpose never shift those of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Purpose {
    /// Grammar draws: topology, angles, lengths.
    Growth,
    /// Choice of the spurs that carry fruit.
    FruitPlacement,
    /// Fruit sizes and masses.
    FruitSize,
    /// Sizes of clusters, and all but the first fruit of each.
    FruitCluster,
    /// Stem detachment thresholds.
    Stem,
    /// Leaf placement and shape.
    Foliage,
    /// Start pose of the robot.
    RobotStart,
    /// Depth-sensor noise.
    SensorNoise,
    /// Errors of wheel odometry that are constant for a world.
    WheelSlip,
    /// Errors of wheel odometry in each frame.
    OdometryNoise,
    /// Errors of joint sensors that are constant for a world.
    JointOffset,
    /// Errors of joint sensors in each frame.
    JointNoise,
    /// Camera poses of a data set or of the detection task.
    Vantage,
    /// Target fruit and hand poses of component tasks.
    ComponentTarget,
    /// Position errors that a component task adds to its target fruit.
    Localisation,
    /// Words of instructions for policies.
    Instruction,
    /// Densities of wood.
    WoodDensity,
    /// Moduli of wood.
    WoodModulus,
    /// Rupture stresses of wood.
    WoodStrength,
    /// Gusts of wind.
    Wind,
    /// Ground shape.
    Terrain,
    /// Colours.
    Appearance,
    /// Draws of one axis of the domain randomisation.
    Variation(Axis),
    /// Bootstrap resamples.
    Bootstrap,
    /// Sign patterns of a paired permutation test.
    Permutation,
    /// Joint rates of the trees that the scaling task times.
    ScalingKick,
    /// Choice of a submission's episodes that the leaderboard runs again.
    LeaderboardSample,
    /// Postures by which inverse kinematics are checked.
    Kinematics,
    /// Trajectories of a screening of parameters.
    Screening,
    /// Test fixtures.
    Test,
}

impl Purpose {
    /// Name that keys the stream. Part of the seed version: never rename.
    pub fn name(self) -> &'static str {
        match self {
            Purpose::Growth => "growth",
            Purpose::FruitPlacement => "fruit-placement",
            Purpose::FruitSize => "fruit-size",
            Purpose::FruitCluster => "fruit-cluster",
            Purpose::Stem => "stem",
            Purpose::Foliage => "foliage",
            Purpose::RobotStart => "robot-start",
            Purpose::SensorNoise => "sensor-noise",
            Purpose::WheelSlip => "wheel-slip",
            Purpose::OdometryNoise => "odometry-noise",
            Purpose::JointOffset => "joint-offset",
            Purpose::JointNoise => "joint-noise",
            Purpose::Vantage => "vantage",
            Purpose::ComponentTarget => "component-target",
            Purpose::Localisation => "localisation",
            Purpose::Instruction => "instruction",
            Purpose::WoodDensity => "wood-density",
            Purpose::WoodModulus => "wood-modulus",
            Purpose::WoodStrength => "wood-strength",
            Purpose::Wind => "wind",
            Purpose::Terrain => "terrain",
            Purpose::Appearance => "appearance",
            Purpose::Variation(axis) => axis.stream_name(),
            Purpose::Bootstrap => "bootstrap",
            Purpose::Permutation => "permutation",
            Purpose::ScalingKick => "scaling-kick",
            Purpose::LeaderboardSample => "leaderboard-sample",
            Purpose::Kinematics => "kinematics",
            Purpose::Screening => "screening",
            Purpose::Test => "test",
        }
    }
}

/// A portable stream of random numbers: ChaCha8, key = seed and purpose, stream number = world.
#[derive(Debug, Clone)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// Makes the stream of one purpose in one world of one seed.
    pub fn new(seed: u64, world: u32, purpose: Purpose) -> Self {
        let mut rng = ChaCha8Rng::from_seed(Self::key(seed, purpose));
        rng.set_stream(u64::from(world));
        Self(rng)
    }

    /// Key of a purpose's streams: the seed, then the purpose's name.
    pub fn key(seed: u64, purpose: Purpose) -> [u8; 32] {
        let mut key = [0_u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        for (slot, byte) in key[8..].iter_mut().zip(purpose.name().bytes()) {
            *slot = byte;
        }
        key
    }

    /// Makes the stream of one frame of a world: as [`Self::new`], with the frame in the upper half of the stream number.
    pub fn of_frame(seed: u64, world: u32, frame: u32, purpose: Purpose) -> Self {
        let mut stream = Self::new(seed, world, purpose);
        stream.0.set_stream(u64::from(frame) << 32 | u64::from(world));
        stream
    }

    /// Makes the stream of a repeat of a world, for draws that differ between repeats: that of [`Self::new`] for repeat 0,
    /// else one with the repeat in the upper half of the stream number.
    pub fn of_repeat(seed: u64, world: u32, repeat: u32, purpose: Purpose) -> Self {
        Self::of_frame(seed, world, repeat, purpose)
    }

    /// Fills a slice with random bytes, for noise of pixels.
    pub fn fill(&mut self, bytes: &mut [u8]) {
        self.0.fill_bytes(bytes);
    }

    /// Skips what [`Self::fill`] draws for some bytes: whole words of 32 bits.
    pub fn skip(&mut self, bytes: usize) {
        let words = bytes.div_ceil(size_of::<u32>());
        self.0.set_word_pos(self.0.get_word_pos() + words as u128);
    }

    /// Uniform number in [0, 1), 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Uniform number in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform number in an interval in the form of [`orchard_quantity::Span::si`].
    pub fn within(&mut self, interval: (f64, f64)) -> f64 {
        self.uniform(interval.0, interval.1)
    }

    /// Uniform whole number in [low, high], both included.
    pub fn integer(&mut self, low: u32, high: u32) -> u32 {
        let span = u64::from(high.max(low) - low) + 1;
        // Multiply-shift: the bias is below 2^-32 for the small spans used here.
        low + ((u128::from(self.0.next_u64()) * u128::from(span)) >> 64) as u32
    }

    /// True with probability `p`.
    pub fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }

    /// Normal deviate (Box-Muller). Every call uses the same count of draws.
    pub fn normal(&mut self, mean: f64, sigma: f64) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        mean + sigma * radius * libm::cos(std::f64::consts::TAU * self.unit())
    }

    /// Normal deviate between the ends of a distribution; values outside are drawn again. Returns the mean if a thousand
    /// draws fall outside.
    pub fn cut_normal(&mut self, normal: &orchard_quantity::Normal) -> f64 {
        const DRAWS: u32 = 1000;
        let (low, high) = normal.ends_si();
        let mut draws = (0..DRAWS).map(|_| self.normal(normal.mean_si(), normal.sd_si()));
        draws.find(|value| (low..=high).contains(value)).unwrap_or_else(|| normal.mean_si())
    }

    /// Shuffles a slice (Fisher-Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.integer(0, last as u32) as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first(seed: u64, world: u32, purpose: Purpose) -> u64 {
        Stream::new(seed, world, purpose).0.next_u64()
    }

    #[test]
    fn streams_are_distinct_and_repeat() {
        let base = first(1, 0, Purpose::Growth);
        assert_eq!(base, first(1, 0, Purpose::Growth));
        for other in [first(2, 0, Purpose::Growth), first(1, 1, Purpose::Growth), first(1, 0, Purpose::Stem)]
        {
            assert_ne!(base, other);
        }
    }

    #[test]
    fn frames_have_streams_of_their_own() {
        let first = |world, frame| Stream::of_frame(1, world, frame, Purpose::SensorNoise).0.next_u64();
        let all = [first(0, 0), first(0, 1), first(1, 0), first(1, 1), first(0, 2)];
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a != b), "{all:?}");
        }
        assert_eq!(first(1, 1), all[3]);
        let mut bytes = [0; 8];
        Stream::of_frame(1, 1, 1, Purpose::SensorNoise).fill(&mut bytes);
        assert_eq!(u64::from_le_bytes(bytes), all[3]);
    }

    #[test]
    fn skipping_is_filling() {
        for lengths in [[0, 5, 64], [1, 256, 255], [7, 1023, 2]] {
            let (mut a, mut b) =
                (Stream::of_frame(1, 2, 3, Purpose::Test), Stream::of_frame(1, 2, 3, Purpose::Test));
            for bytes in lengths {
                a.fill(&mut vec![0; bytes]);
                b.skip(bytes);
            }
            assert_eq!(a.unit(), b.unit());
        }
    }

    /// The numbers are part of the seed version: a change here changes every tree.
    #[test]
    fn golden_values() {
        let mut s = Stream::new(20250704, 3, Purpose::Growth);
        let values: Vec<u64> = (0..3).map(|_| (s.unit() * 1e9) as u64).collect();
        assert_eq!(values, GOLDEN);
    }
    const GOLDEN: [u64; 3] = [761_022_674, 332_419, 353_910_028];

    #[test]
    fn a_cut_normal_keeps_its_ends_however_close() {
        let normal = |low: f64, high: f64| -> orchard_quantity::Normal {
            let text = format!(
                "x = {{ mean = 1.0, sd = 5.0, low = {low}, high = {high}, range = [-9, 9], unit = '1', source = 'x' }}"
            );
            let mut table: std::collections::BTreeMap<String, orchard_quantity::Normal> =
                orchard_quantity::from_toml("x", &text).unwrap();
            table.remove("x").unwrap()
        };
        let mut s = Stream::new(7, 0, Purpose::Test);
        let wide = normal(-1.0, 2.0);
        assert!((0..1000).map(|_| s.cut_normal(&wide)).all(|x| (-1.0..=2.0).contains(&x)));
        assert_eq!(s.cut_normal(&normal(1.0, 1.0)), 1.0);
    }

    #[test]
    fn moments() {
        let mut s = Stream::new(7, 0, Purpose::Test);
        let n = 200_000;
        let (mut sum, mut sum2, mut counts) = (0.0, 0.0, [0_u32; 5]);
        for _ in 0..n {
            let x = s.normal(1.0, 2.0);
            sum += x;
            sum2 += x * x;
            counts[s.integer(3, 7) as usize - 3] += 1;
        }
        let mean = sum / f64::from(n);
        let var = sum2 / f64::from(n) - mean * mean;
        // Five standard errors of the mean and of the variance.
        assert!((mean - 1.0).abs() < 5.0 * 2.0 / f64::from(n).sqrt(), "{mean}");
        assert!((var - 4.0).abs() < 5.0 * 4.0 * (2.0 / f64::from(n)).sqrt(), "{var}");
        let p = f64::from(n) / 5.0;
        assert!(counts.iter().all(|&c| (f64::from(c) - p).abs() < 5.0 * (p * 0.8).sqrt()), "{counts:?}");
    }
}

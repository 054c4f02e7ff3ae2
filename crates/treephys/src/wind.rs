//! Turbulent wind over a tree: a frozen field of gusts that the mean wind carries past, and the drag of wood and leaves in it.

use crate::{Rupture, TreeBody};
use orchard_geometry::{Rotation, Vec3, math, rotation_from_z};
use orchard_multibody::{Data, Model, PointId};
use orchard_spec::{Purpose, Spec, Stream, wind::WindSpec, wood::WoodSpec};
use orchard_treegen::Skeleton;
use std::f64::consts::{PI, TAU};

/// Integral length of the von Karman spectrum over the length in its energy spectrum, sqrt(pi) Gamma(5/6) / Gamma(1/3).
const INTEGRAL_LENGTH: f64 = 0.746_834_284;

/// Intervals of Simpson's rule for the share of energy.
const INTERVALS: usize = 64;

/// Halvings of the interval in which a share of energy is sought.
const HALVINGS: usize = 50;

/// Modes of one wave vector.
const MODES_OF_A_WAVE: usize = 2;

/// Units of a turn in [`Wave::turns_back`].
const UNITS_OF_TURN: f64 = 4_294_967_296.0;

/// One Fourier mode of the gusts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mode {
    /// Wave vector [rad/m].
    wave: Vec3,
    /// Amplitude [m/s] at the height of the canopy, across the wave vector.
    amplitude: Vec3,
    phase: f64,
}

/// A wave of the gusts, both modes of one wave vector together: `cosine cos t + sine sin t` with the phase `t = wave . (x - U t)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Wave vector [rad/m].
    pub wave: Vec3,
    /// Amplitude of the cosine [m/s] at the height of the canopy.
    pub cosine: Vec3,
    /// Amplitude of the sine [m/s].
    pub sine: Vec3,
}

impl Wave {
    /// Phase at a place at time 0, in turns between -1/2 and 1/2: a short wave has thousands of turns along a tree, too many for f32.
    pub fn turns_at(&self, p_world: &Vec3) -> f64 {
        let turns = self.wave.dot(p_world) / TAU;
        turns - turns.round()
    }

    /// Turns by which a mean velocity [m/s] takes the phase back in a time \[s\], times 2^32 and without whole turns: multiples of it wrap around exactly.
    pub fn turns_back(&self, mean: &Vec3, time: f64) -> u32 {
        let turns = self.wave.dot(mean) * time / TAU;
        ((turns - turns.floor()) * UNITS_OF_TURN).round() as u64 as u32
    }
}

/// Wind of one world: a function of place and time, without state.
///
/// The gusts are `sum a_n cos(k_n . (x - U t) + phase_n)`, isotropic, with the von Karman energy spectrum
///
/// `E(k) ~ (k l)^4 / (1 + (k l)^2)^(17/6)`.
///
/// The wave numbers divide the energy evenly, one drawn in each part. Each has an orthogonal triple of random directions and, across each of
/// them, two amplitudes along the others, so that every component has the asked variance whatever is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Wind {
    spec: WindSpec,
    /// Mean velocity at the height of the canopy [m/s].
    mean: Vec3,
    modes: Vec<Mode>,
}

impl Wind {
    /// The wind of a world; `None` at speed 0.
    pub fn draw(spec: &WindSpec, seed: u64, world: u32) -> Option<Self> {
        let speed = spec.speed.si();
        if speed <= 0.0 {
            return None;
        }
        let mut stream = Stream::new(seed, world, Purpose::Wind);
        let (sin, cos) = math::sin_cos(spec.bearing.si());
        let count = spec.wave_numbers.get();
        let energy_length = spec.length.si() / INTEGRAL_LENGTH;
        // a^2 / 2 of six modes of a wave number: two of them act along each axis.
        let amplitude = spec.intensity.si() * speed / f64::from(count).sqrt();
        let mut modes = Vec::with_capacity(6 * count as usize);
        for part in 0..count {
            let share = (f64::from(part) + stream.unit()) / f64::from(count);
            let wave_number = wave_number(share) / energy_length;
            let frame = random_frame(&mut stream);
            for (along, others) in [(0, [1, 2]), (1, [2, 0]), (2, [0, 1])] {
                for across in others {
                    modes.push(Mode {
                        wave: frame[along] * wave_number,
                        amplitude: frame[across] * amplitude,
                        phase: stream.uniform(0.0, TAU),
                    });
                }
            }
        }
        Some(Self { spec: spec.clone(), mean: Vec3::new(cos, sin, 0.0) * speed, modes })
    }

    /// Mean speed at a height over that at the height of the canopy: exponential within, logarithmic above (`agclimtools`).
    pub fn profile(&self, height: f64) -> f64 {
        let canopy = self.spec.canopy_height.si();
        let part = height.max(0.0) / canopy;
        if part <= 1.0 {
            return math::exp(self.spec.attenuation.si() * (part - 1.0));
        }
        let (displacement, roughness) = (self.spec.displacement.si(), self.spec.roughness.si());
        math::ln((part - displacement) / roughness) / math::ln((1.0 - displacement) / roughness)
    }

    /// Velocity of the air at a place and time [m/s], world.
    pub fn velocity(&self, p_world: &Vec3, time: f64) -> Vec3 {
        let carried = p_world - self.mean * time;
        let gust = self.modes.iter().fold(Vec3::zeros(), |sum, mode| {
            sum + mode.amplitude * math::cos(mode.wave.dot(&carried) + mode.phase)
        });
        (self.mean + gust) * self.profile(p_world.z)
    }

    /// Mean velocity at the height of the canopy [m/s].
    pub fn mean(&self) -> Vec3 {
        self.mean
    }

    /// The gusts as waves: [`Self::velocity`] is the mean velocity and their sum, times the profile.
    pub fn waves(&self) -> impl Iterator<Item = Wave> {
        self.modes.chunks(MODES_OF_A_WAVE).map(|modes| {
            let mut of_both = Wave { wave: modes[0].wave, cosine: Vec3::zeros(), sine: Vec3::zeros() };
            for mode in modes {
                let (sin, cos) = math::sin_cos(mode.phase);
                of_both.cosine += mode.amplitude * cos;
                of_both.sine -= mode.amplitude * sin;
            }
            of_both
        })
    }

    /// Frequency \[Hz\] at which the mean wind carries each mode past a point, and its part of the variance of the component along the wind
    /// [m^2/s^2], at the height of the canopy: the spectrum of the field as it was drawn.
    pub fn lines(&self) -> impl Iterator<Item = (f64, f64)> {
        let along = self.mean.normalize();
        self.modes.iter().map(move |mode| {
            let amplitude = mode.amplitude.dot(&along);
            (mode.wave.dot(&self.mean).abs() / TAU, 0.5 * amplitude * amplitude)
        })
    }
}

/// One-sided spectrum of the component along the wind at a point [m^2/s], von Karman: `4 s^2 (L / U) / (1 + 70.8 (f L / U)^2)^(5/6)` for a
/// standard deviation s \[m/s\], an integral length L \[m\], a mean speed U \[m/s\] and a frequency f \[Hz\].
pub fn spectrum(deviation: f64, length: f64, speed: f64, frequency: f64) -> f64 {
    let time = length / speed;
    let x = frequency * time;
    4.0 * deviation * deviation * time * math::exp(-5.0 / 6.0 * math::ln(1.0 + 70.8 * x * x))
}

/// Wave number k l below which a share of the energy lies. With `(k l)^2 = (1 - s^3) / s^3` the energy is even in
/// `(1 - s^3)^(3/2) ds`, s from 1 (k = 0) to 0.
fn wave_number(share: f64) -> f64 {
    let above = 1.0 - share;
    let whole = energy_above(1.0);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if energy_above(middle) < above * whole { low = middle } else { high = middle }
    }
    let cube = high * high * high;
    ((1.0 - cube).max(0.0) / cube).sqrt()
}

/// Integral of (1 - x^3)^(3/2) from 0 to s, by Simpson's rule.
fn energy_above(s: f64) -> f64 {
    let density = |x: f64| {
        let rest = (1.0 - x * x * x).max(0.0);
        rest * rest.sqrt()
    };
    let h = s / INTERVALS as f64;
    let weight = |i: usize| match i {
        0 | INTERVALS => 1.0,
        i if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=INTERVALS).map(|i| weight(i) * density(i as f64 * h)).sum::<f64>() * h / 3.0
}

/// Three axes at right angles in a random direction, evenly over all.
fn random_frame(stream: &mut Stream) -> [Vec3; 3] {
    let z = stream.uniform(-1.0, 1.0);
    let (sin, cos) = math::sin_cos(stream.uniform(0.0, TAU));
    let flat = (1.0 - z * z).max(0.0).sqrt();
    let roll = Rotation::from_axis_angle(&Vec3::z_axis(), stream.uniform(0.0, TAU));
    let turn = rotation_from_z(&Vec3::new(flat * cos, flat * sin, z)) * roll;
    [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| turn * axis)
}

/// Places at which a tree samples the air, at rest and unloaded: gusts do not follow the sway of the wood.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    p_world: Vec<Vec3>,
    of_segment: Vec<usize>,
}

impl Places {
    /// Centres of segments. A segment shares the place of its parent up to a distance \[m\] from there; beyond, its own centre is a place.
    pub fn new(skeleton: &Skeleton, spacing: f64) -> Self {
        let mut places =
            Self { p_world: Vec::new(), of_segment: Vec::with_capacity(skeleton.segments.len()) };
        for segment in &skeleton.segments {
            let p_world = segment.p_base_world + segment.heading() * (0.5 * segment.length);
            let of_parent = segment.parent.map(|parent| places.of_segment[parent]);
            let shared = of_parent.filter(|&place| (places.p_world[place] - p_world).norm() <= spacing);
            places.of_segment.push(shared.unwrap_or(places.p_world.len()));
            if shared.is_none() {
                places.p_world.push(p_world);
            }
        }
        places
    }

    /// The places \[m\].
    pub fn p_world(&self) -> &[Vec3] {
        &self.p_world
    }

    /// Index of the place of a segment and of the fruit that it bears.
    pub fn of_segment(&self, segment: usize) -> usize {
        self.of_segment[segment]
    }
}

/// The parts of a tree on which the wind pulls.
#[derive(Debug, Clone, PartialEq)]
pub struct Sail {
    places: Places,
    /// Half air density times drag coefficient times area of each segment's wood across the wind [kg/m].
    wood: Vec<f64>,
    /// Half air density times drag coefficient times area of its leaves [kg/m].
    leaves: Vec<f64>,
    folding_speed: f64,
    /// Drag of the links in still air [1/s].
    still_drag: f64,
}

impl Sail {
    /// The wood and leaves of a tree in air of a density [kg/m^3].
    pub fn new(spec: &WindSpec, skeleton: &Skeleton, wood: &WoodSpec, air_density: f64) -> Self {
        let half = 0.5 * air_density;
        let of_wood = |radius: f64, length: f64| half * spec.wood_drag.si() * 2.0 * radius * length;
        let mut leaves = vec![0.0; skeleton.segments.len()];
        for leaf in &skeleton.leaves {
            leaves[leaf.segment] += half * spec.leaf_drag.si() * leaf.area();
        }
        Self {
            places: Places::new(skeleton, spec.spacing.si()),
            wood: skeleton.segments.iter().map(|s| of_wood(s.radius, s.length)).collect(),
            leaves,
            folding_speed: spec.folding_speed.si(),
            still_drag: wood.linear_drag.si(),
        }
    }

    /// Places at which the tree samples the air.
    pub fn places(&self) -> &Places {
        &self.places
    }

    /// Drag of the links in still air [1/s].
    pub fn still_drag(&self) -> f64 {
        self.still_drag
    }

    /// Velocity of the air at each place at a time [m/s], world.
    fn air(&self, wind: &Wind, time: f64) -> Vec<Vec3> {
        self.places.p_world.iter().map(|p_world| wind.velocity(p_world, time)).collect()
    }

    /// Half air density times drag coefficient times area, of a segment's wood across the wind and of its leaves [kg/m].
    pub fn of(&self, segment: usize) -> [f64; 2] {
        [self.wood[segment], self.leaves[segment]]
    }

    /// Drag of a segment's wood in air across it of a speed [m/s] \[N\].
    pub fn on_wood(&self, segment: usize, speed: f64) -> f64 {
        self.wood[segment] * speed * speed
    }

    /// Drag of a segment's leaves in air of a speed [m/s] \[N\]: quadratic up to the folding speed, then linear (`delangre2015`).
    pub fn on_leaves(&self, segment: usize, speed: f64) -> f64 {
        self.leaf_drag_rate(segment, speed) * speed
    }

    /// Drag of a segment's leaves over the speed of the air [N s/m].
    fn leaf_drag_rate(&self, segment: usize, speed: f64) -> f64 {
        self.leaves[segment] * speed.min(self.folding_speed)
    }

    /// Sets the force of the air at a time \[s\] on every link of the tree, until set again. Wood feels the velocity w across it, `b |w| w`; leaves the whole,
    /// `b min(|w|, folding speed) w`: quadratic, then linear as they fold. Speeds are those of now, and the link's own part of w is taken
    /// implicitly, as a drag of the link, so that light twigs with many leaves stay stable. Broken sub-trees feel still air.
    pub fn blow(
        &self,
        wind: &Wind,
        tree: &TreeBody,
        rupture: &Rupture,
        model: &Model,
        data: &mut Data,
        time: f64,
    ) {
        self.press(&self.air(wind, time), tree, rupture, model, data);
    }

    /// As [`Self::blow`], with the air at each place.
    fn press(&self, air: &[Vec3], tree: &TreeBody, rupture: &Rupture, model: &Model, data: &mut Data) {
        for (i, &body) in tree.bodies.iter().enumerate() {
            if rupture.is_debris(i) {
                continue;
            }
            let p_world = data.com_p_world(body);
            let v = data.point_velocity_world(body, &p_world);
            let w = air[self.places.of_segment[i]] - v;
            let along = data.x_world_body(body).rotation * Vec3::z();
            let across = w - along * w.dot(&along);
            let of_wood = self.wood[i] * across.norm();
            let of_leaves = self.leaf_drag_rate(i, w.norm());
            data.body_force_world[body.index()] =
                across * of_wood + w * of_leaves + v * (of_wood + of_leaves);
            let mass = model.body(body).inertia.mass;
            data.linear_drag[body.index()] = self.still_drag + (of_wood + of_leaves) / mass;
        }
    }
}

/// The wind of a world, and what it takes hold of.
#[derive(Debug, Clone)]
pub struct Weather {
    wind: Wind,
    sail: Sail,
    drag_coefficient: f64,
    air_density: f64,
}

impl Weather {
    /// The wind that a world's config asks for; `None` in still air.
    pub fn new(spec: &Spec, skeleton: &Skeleton, seed: u64, world: u32) -> Option<Self> {
        let of_spec = spec.wind.as_ref()?;
        let wind = Wind::draw(of_spec, seed, world)?;
        let air_density = spec.fruit.air_density.si();
        let sail = Sail::new(of_spec, skeleton, &spec.wood, air_density);
        Some(Self { wind, sail, drag_coefficient: spec.fruit.drag_coefficient.si(), air_density })
    }

    /// Velocity of the air.
    pub fn wind(&self) -> &Wind {
        &self.wind
    }

    /// The parts on which the wind pulls.
    pub fn sail(&self) -> &Sail {
        &self.sail
    }

    /// Half air density times drag coefficient times the area across the wind of a ball of a radius \[m\] [kg/m].
    pub fn of_ball(&self, radius: f64) -> f64 {
        0.5 * self.air_density * self.drag_coefficient * PI * radius * radius
    }

    /// Sets the forces of the air on wood and on fruit on its stem for a frame that begins at a time \[s\]; `fruit` has the point body, segment and radius
    /// \[m\] of each. Fruit off its stem feels still air.
    pub fn blow(
        &self,
        tree: &TreeBody,
        fruit: impl Iterator<Item = (PointId, usize, f64)>,
        rupture: &Rupture,
        model: &Model,
        data: &mut Data,
        time: f64,
    ) {
        let air = self.sail.air(&self.wind, time);
        self.sail.press(&air, tree, rupture, model, data);
        for (point, segment, radius) in fruit {
            let i = point.index();
            data.point_force_world[i] = if data.tethered[i] {
                let w = air[self.sail.places.of_segment[segment]] - data.point_v_world[i];
                w * (self.of_ball(radius) * w.norm())
            } else {
                Vec3::zeros()
            };
        }
    }
}

//! Trials of wood alone, as `orchard validate wood` and the tests run them: pluck a limb, load a beam, scale a tree.

mod elastica;

pub use elastica::elastica_tip;

use crate::wind::{Sail, Wind};
use crate::{Rupture, Timber, TreeBody, TreeGroups, step_settings, sway};
use orchard_geometry::{Vec3, math, rotation_from_z, transform};
use orchard_multibody::{
    Data, Groups, Model, ModelBuilder, ModelError, StaticsError, StepReport, StepSettings, equilibrium, step,
};
use orchard_spec::{sim::SimSpec, wind::WindSpec, wood::WoodSpec};
use orchard_treegen::{Segment, Skeleton};
use std::f64::consts::{PI, TAU};

/// Largest joint move of the last statics iteration \[rad\].
const AT_REST: f64 = 1e-13;

/// Density of air of the trials in wind [kg/m^3]; a choice that no figure of them depends on but through the strength of the response.
const AIR_DENSITY: f64 = 1.2;

/// A tree alone in a world without gravity, contacts and fruit.
#[derive(Debug, Clone)]
pub struct Trial {
    skeleton: Skeleton,
    wood: WoodSpec,
    model: Model,
    data: Data,
    tree: TreeBody,
    settings: StepSettings,
}

/// Free sway after a pluck.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sway {
    /// Frequency \[Hz\].
    pub frequency: f64,
    /// Damping ratio from the logarithmic decrement \[1\].
    pub ratio: f64,
}

impl Trial {
    /// A tree of the mean wood, stepped as `sim` says.
    ///
    /// # Errors
    /// The skeleton makes no valid model.
    pub fn new(skeleton: Skeleton, wood: &WoodSpec, sim: &SimSpec) -> Result<Self, ModelError> {
        let mut builder = ModelBuilder::new();
        let groups = TreeGroups { wood: Groups::NONE, debris: Groups::NONE };
        let tree = TreeBody::add_to(&mut builder, &skeleton, wood, groups);
        let model = builder.build()?;
        let mut data = Data::new(&model);
        tree.reset(&model, &mut data, wood);
        let settings = StepSettings { gravity: Vec3::zeros(), ..step_settings(sim) };
        Ok(Self { skeleton, wood: wood.clone(), model, data, tree, settings })
    }

    /// Tip of a segment \[m\], world.
    pub fn p_tip(&self, segment: usize) -> Vec3 {
        let tip = Vec3::new(0.0, 0.0, self.skeleton.segments[segment].length);
        transform(self.data.x_world_body(self.tree.bodies[segment]), &tip)
    }

    /// Bends the tree to its equilibrium under a force \[N\] at the tip of a segment, which keeps its direction.
    ///
    /// # Errors
    /// No equilibrium is found.
    pub fn load_tip(&mut self, segment: usize, force_world: Vec3) -> Result<(), StaticsError> {
        // The force acts at the centre of mass with a moment about it, whose arm is that of the pose: repeat until it is.
        const TURNS: usize = 200;
        const SETTLED: f64 = 1e-10;
        for _ in 0..TURNS {
            let body = self.tree.bodies[segment];
            let before = self.p_tip(segment);
            self.data.body_force_world[body.index()] = force_world;
            self.data.body_torque_world[body.index()] =
                (before - self.data.com_p_world(body)).cross(&force_world);
            equilibrium(&self.model, &mut self.data, &self.settings.gravity, AT_REST)?;
            if (self.p_tip(segment) - before).norm() < SETTLED {
                break;
            }
        }
        Ok(())
    }

    /// Moment about an axis at which the joint at a segment's base breaks, from half of `least` upwards in steps of 0.5 % \[N m\]; `None` if no joint has
    /// broken at four times of it.
    ///
    /// # Errors
    /// No equilibrium is found.
    pub fn breaking_moment(
        &mut self,
        segment: usize,
        axis_world: Vec3,
        least: f64,
    ) -> Result<Option<f64>, StaticsError> {
        const STEP: f64 = 1.005;
        let mut moment = 0.5 * least;
        while moment < 4.0 * least {
            self.data.body_torque_world[self.tree.bodies[segment].index()] = axis_world * moment;
            equilibrium(&self.model, &mut self.data, &self.settings.gravity, AT_REST)?;
            let mut rupture = Rupture::new(&self.tree);
            let mut data = self.data.clone();
            let broken = (0..self.wood.rupture_frames.get())
                .flat_map(|_| rupture.end_frame(&self.tree, &self.model, &mut data, &self.wood, 0.0))
                .count();
            if broken > 0 {
                return Ok(Some(moment));
            }
            moment *= STEP;
        }
        Ok(None)
    }

    /// Pulls the tip of a segment with a force, lets go, and reads the sway along the force over `swings` maxima after the first two,
    /// in which higher modes die out. `None` if it does not swing so often in 2000 substeps a swing.
    ///
    /// # Errors
    /// No equilibrium is found under the force.
    pub fn pluck(
        &mut self,
        segment: usize,
        force_world: Vec3,
        swings: usize,
    ) -> Result<Option<Sway>, StaticsError> {
        const SKIPPED: usize = 2;
        let (rest, along) = (self.p_tip(segment), force_world.normalize());
        self.load_tip(segment, force_world)?;
        self.data.body_force_world.fill(Vec3::zeros());
        self.data.body_torque_world.fill(Vec3::zeros());
        let mut rupture = Rupture::new(&self.tree);
        let mut signal = Vec::new();
        let mut maxima = Vec::new();
        for _ in 0..2000 * (swings + SKIPPED) {
            let h = self.settings.h;
            rupture.begin_substep(&self.tree, &self.model, &mut self.data, &self.wood, h);
            step(&self.model, &mut self.data, &self.settings, &mut StepReport::default());
            signal.push((self.p_tip(segment) - rest).dot(&along));
            if let [.., a, b, c] = signal[..]
                && b > 0.0
                && b >= a
                && b > c
            {
                // Top of the parabola through the three samples: time in substeps, and height.
                let bend = 2.0 * b - a - c;
                let at = (signal.len() - 2) as f64 + 0.5 * (c - a) / bend;
                maxima.push((at, b + (a - c) * (a - c) / (8.0 * bend)));
            }
            if maxima.len() > swings + SKIPPED {
                break;
            }
        }
        let (Some(first), Some(last)) = (maxima.get(SKIPPED), maxima.get(SKIPPED + swings)) else {
            return Ok(None);
        };
        let decrement = math::ln(first.1 / last.1) / swings as f64;
        Ok(Some(Sway {
            frequency: swings as f64 / ((last.0 - first.0) * self.settings.h),
            ratio: decrement / (TAU * TAU + decrement * decrement).sqrt(),
        }))
    }
}

/// Frequency of the strongest response of a bare limb along x at the height of the canopy to the gusts of a wind \[Hz\], over 2 minutes: of the bands of
/// a twentieth of `own` \[Hz\] from half of it to 2.5 times it, in the height of its tip.
///
/// # Errors
/// The limb makes no valid model.
pub fn response_in_wind(
    limb: &Skeleton,
    wood: &WoodSpec,
    sim: &SimSpec,
    (spec, wind): (&WindSpec, &Wind),
    own: f64,
) -> Result<f64, ModelError> {
    const SECONDS: f64 = 120.0;
    const BANDS: usize = 40;
    let mut lifted = limb.clone();
    for segment in &mut lifted.segments {
        segment.p_base_world.z += spec.canopy_height.si();
    }
    let sail = Sail::new(spec, &lifted, wood, AIR_DENSITY);
    let mut trial = Trial::new(lifted, wood, sim)?;
    let mut rupture = Rupture::new(&trial.tree);
    let frames = (SECONDS / sim.frame()).round() as usize;
    let mut heights = Vec::with_capacity(frames);
    for frame in 0..frames {
        let Trial { tree, model, data, .. } = &mut trial;
        sail.blow(wind, tree, &rupture, model, data, frame as f64 * sim.frame());
        for _ in 0..sim.substeps.get() {
            let h = trial.settings.h;
            rupture.begin_substep(&trial.tree, &trial.model, &mut trial.data, &trial.wood, h);
            step(&trial.model, &mut trial.data, &trial.settings, &mut StepReport::default());
        }
        heights.push(trial.p_tip(limb.segments.len() - 1).z);
    }
    let mean = heights.iter().sum::<f64>() / frames as f64;
    let power = |f: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (k, z) in heights.iter().enumerate() {
            let (sin, cos) = math::sin_cos(TAU * f * k as f64 * sim.frame());
            re += (z - mean) * cos;
            im += (z - mean) * sin;
        }
        re * re + im * im
    };
    let width = own / 20.0;
    let lines = (width * SECONDS).round().max(1.0) as usize;
    let start = |band: usize| 0.5 * own + band as f64 * width;
    let band =
        |i: usize| (0..lines).map(|k| power(start(i) + k as f64 / SECONDS)).sum::<f64>() / lines as f64;
    let powers: Vec<f64> = (0..BANDS).map(band).collect();
    let strongest = (0..BANDS).max_by(|a, b| powers[*a].total_cmp(&powers[*b])).unwrap_or(0);
    Ok(start(strongest) + 0.5 * width)
}

/// Frequency of the sway of a limb of the mean wood, clamped at its base \[Hz\], see [`sway::limb_frequency`]. Each segment carries a mass
/// \[kg\] at its middle.
pub fn sway_frequency(skeleton: &Skeleton, wood: &WoodSpec, root: usize, carried: &[f64]) -> f64 {
    let mut builder = ModelBuilder::new();
    let groups = TreeGroups { wood: Groups::NONE, debris: Groups::NONE };
    let tree = TreeBody::add_to(&mut builder, skeleton, wood, groups);
    let mut inertia = sway::inertias(skeleton, &Timber::mean(skeleton, wood).density);
    for (link, mass) in inertia.iter_mut().zip(carried) {
        link.mass += mass;
    }
    sway::limb_frequency(skeleton, &inertia, &tree.stiffness, root) / TAU
}

/// A straight limb of `n` equal segments along x, from the origin.
pub fn straight_limb(n: usize, length: f64, radius: f64) -> Skeleton {
    let segment = |k: usize| Segment {
        parent: k.checked_sub(1),
        p_base_world: Vec3::x() * (length * k as f64 / n as f64),
        r_world_segment: rotation_from_z(&Vec3::x()),
        length: length / n as f64,
        radius,
        order: 0,
    };
    Skeleton {
        segments: (0..n).map(segment).collect(),
        fruit_sites: Vec::new(),
        leaves: Vec::new(),
        spurs: Vec::new(),
    }
}

/// A trunk of one segment of 1 m, upright, with a limb of one segment of 0.5 m along x at its top.
pub fn trunk_and_limb(trunk_radius: f64, limb_radius: f64) -> Skeleton {
    let mut skeleton = straight_limb(1, 1.0, trunk_radius);
    skeleton.segments[0].r_world_segment = rotation_from_z(&Vec3::z());
    let limb = Segment {
        parent: Some(0),
        p_base_world: Vec3::z(),
        order: 1,
        ..straight_limb(1, 0.5, limb_radius).segments.remove(0)
    };
    skeleton.segments.push(limb);
    skeleton
}

/// Radius at which a straight limb of one modulus sways at a frequency \[m\], Euler-Bernoulli:
/// `f = (beta^2 / 2 pi) (r / (2 L^2)) sqrt(E / rho)`, beta = 1.8751.
pub fn radius_of_frequency(wood: &WoodSpec, length: f64, frequency: f64) -> f64 {
    const BETA: f64 = 1.875_104_068_711_961;
    let speed = (wood.youngs_modulus.si() / wood.density.si()).sqrt();
    4.0 * PI * frequency * length * length / (BETA * BETA * speed)
}

/// The tree with lengths and thicknesses scaled, its wood alone.
pub fn scaled(skeleton: &Skeleton, length: f64, radius: f64) -> Skeleton {
    let scaled = |s: &Segment| Segment {
        p_base_world: s.p_base_world * length,
        length: s.length * length,
        radius: s.radius * radius,
        ..s.clone()
    };
    Skeleton { segments: skeleton.segments.iter().map(scaled).collect(), ..straight_limb(0, 1.0, 1.0) }
}

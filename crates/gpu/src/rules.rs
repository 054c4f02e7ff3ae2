//! Constants that all worlds of a batch share, in the form that the kernels read.

use bytemuck::{Pod, Zeroable};
use orchard_batch::Plant;
use orchard_fruit::least_load;
use orchard_multibody::SLOW_TURN;
use orchard_multibody::contact::in_series;

use crate::layout::wave;

/// Constants of a step. `kernels/memory.wgsl` has the same fields in the same order.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Rules {
    /// Substep [s].
    pub h: f32,
    /// Gravity [m/s^2].
    pub gravity: f32,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Number of the frame, from 1.
    pub frame: u32,
    /// Largest number of external forces on the links of a world.
    pub pushes_each: u32,
    /// Number of successive frames over its limit after which a joint breaks.
    pub rupture_frames: u32,
    /// Number of successive frames of a direct pull after which a fruit comes off.
    pub pull_frames: u32,
    /// Number of successive frames of stem tension after which a fruit comes off.
    pub tension_frames: u32,
    /// Threshold of stem tension over that of the direct pull.
    pub tension_factor: f32,
    /// 1 if joints have dampers, else 0.
    pub damped: f32,
    /// Linear drag of wood [1/s].
    pub linear_drag: f32,
    /// Angular drag of wood [1/s].
    pub angular_drag: f32,
    /// Linear drag of broken limbs [1/s].
    pub broken_linear_drag: f32,
    /// Angular drag of broken limbs [1/s].
    pub broken_angular_drag: f32,
    /// Friction of a broken joint over the moment of its limb's weight.
    pub friction_ratio: f32,
    /// Factor by which that friction grows.
    pub friction_ramp: f32,
    /// Time over which it grows [s].
    pub friction_ramp_time: f32,
    /// Rate below which friction acts as a damper [rad/s].
    pub friction_regularisation: f32,
    /// Residual damping of a broken joint over its limb's inertia [1/s].
    pub residual_damping: f32,
    /// Largest residual damping of a broken joint [N m s/rad].
    pub residual_damping_max: f32,
    /// Rate at which the brake of a broken joint acts [rad/s].
    pub rate_limit: f32,
    /// Strength of that brake over the inertia [1/s].
    pub rate_brake: f32,
    /// Stiffness of fruit and ground in series [N/m].
    pub ground_stiffness: f32,
    /// Dissipation time of a contact [s].
    pub dissipation_time: f32,
    /// Coulomb coefficient of fruit on the ground.
    pub ground_friction: f32,
    /// Loss of spin of loose fruit [1/s].
    pub spin_loss: f32,
    /// Stiffness of wood and ground in series [N/m].
    pub wood_stiffness: f32,
    /// Coulomb coefficient of wood on the ground.
    pub wood_friction: f32,
    /// Stiffness of stems that bend, in bending [N m/rad]; 0 on tethers, as the next five.
    pub stem_bending: f32,
    /// In twist [N m/rad].
    pub stem_twisting: f32,
    /// Strength of a zone against a pull across it over that along its axis.
    pub stem_bent: f32,
    /// Share of a life that passes in a substep under a load of the strength.
    pub stem_wear: f32,
    /// Exponent of that share by the load.
    pub stem_exponent: f32,
    /// Square of the load over the strength from which wear is counted.
    pub stem_least_load: f32,
    /// Number of waves of a world's gusts, filled up with waves of size 0 to whole reads; 0 in still air, as the next four.
    pub waves: u32,
    /// Largest number of places at which a world samples the air, over four.
    pub fours: u32,
    /// Mean velocity of the air at the height of the canopy [m/s], along x.
    pub wind_x: f32,
    /// Along y.
    pub wind_y: f32,
    /// Speed above which leaves fold [m/s].
    pub folding_speed: f32,
    /// Number of the substep in the frame, from 0, of passes that advance one substep.
    pub substep: u32,
    /// Rate of a link from which on velocity products are not explicit in f64 [rad/s]; worlds with a robot tell of it.
    pub slow_rate: f32,
}

/// Steps from rest to the static equilibrium: length of a step [s], and number of steps. Long steps are Newton steps on the statics without geometric stiffness, which overshoot in limp twigs, where
/// gravity is stiffer than the spring; inertia limits the short steps between them, which correct that. (`orchard_multibody::equilibrium`
/// chooses the length of each step; a device uses the same for all worlds.)
const SETTLING: [(f32, u32); 4] = [(1e3, 2), (0.3, 2), (0.1, 4), (0.03, 8)];
/// Number of rounds of these steps.
const SETTLING_ROUNDS: usize = 8;

impl Rules {
    /// Rules of the passes that settle worlds before the next frame: without dampers, since every step starts at rest.
    pub fn settling(self) -> impl Iterator<Item = Self> {
        let steps = std::iter::repeat_n(SETTLING, SETTLING_ROUNDS).flatten().chain([SETTLING[0]]);
        steps.map(move |(h, substeps)| Self { h, substeps, frame: self.frame + 1, damped: 0.0, ..self })
    }

    /// Rules of a plant at frame 0.
    pub fn of(plant: &Plant) -> Self {
        let (sim, wood, fruit) = (&plant.spec.sim, &plant.spec.wood, &plant.spec.fruit);
        Self {
            h: plant.settings.h as f32,
            gravity: sim.gravity.si() as f32,
            substeps: sim.substeps.get(),
            frame: 0,
            pushes_each: 0,
            rupture_frames: wood.rupture_frames.get(),
            pull_frames: fruit.pull_frames.get(),
            tension_frames: fruit.tension_frames.get(),
            tension_factor: fruit.tension_factor.si() as f32,
            damped: 1.0,
            linear_drag: wood.linear_drag.si() as f32,
            angular_drag: wood.angular_drag.si() as f32,
            broken_linear_drag: (wood.linear_drag.si() * wood.broken_linear_drag_scale.si()) as f32,
            broken_angular_drag: (wood.angular_drag.si() * wood.broken_angular_drag_scale.si()) as f32,
            friction_ratio: wood.broken_friction_ratio.si() as f32,
            friction_ramp: wood.broken_friction_ramp.si() as f32,
            friction_ramp_time: wood.broken_friction_ramp_time.si() as f32,
            friction_regularisation: wood.friction_regularisation.si() as f32,
            residual_damping: wood.broken_residual_damping.si() as f32,
            residual_damping_max: wood.broken_residual_damping_max.si() as f32,
            rate_limit: wood.broken_rate_limit.si() as f32,
            rate_brake: wood.broken_rate_brake.si() as f32,
            ground_stiffness: in_series(fruit.contact_stiffness.si(), sim.ground_stiffness.si()) as f32,
            dissipation_time: sim.contact_dissipation_time.si() as f32,
            ground_friction: (fruit.friction.si() * sim.ground_friction.si()).sqrt() as f32,
            spin_loss: fruit.rolling_loss.si() as f32,
            wood_stiffness: in_series(wood.contact_stiffness.si(), sim.ground_stiffness.si()) as f32,
            slow_rate: (SLOW_TURN / plant.settings.h) as f32,
            wood_friction: (wood.friction.si() * sim.ground_friction.si()).sqrt() as f32,
            ..Self::of_stems_and_wind(plant)
        }
    }

    /// Those of stems and wind; all others are 0.
    fn of_stems_and_wind(plant: &Plant) -> Self {
        let mut rules = Self::zeroed();
        if let Some(stem) = &plant.spec.fruit.stem {
            let release = &stem.release;
            let least = least_load(release);
            rules.stem_bending = stem.bending_stiffness.si() as f32;
            rules.stem_twisting = stem.twisting_stiffness.si() as f32;
            rules.stem_bent = release.bent.si() as f32;
            rules.stem_wear = (plant.settings.h / release.hold_time.si()) as f32;
            rules.stem_exponent = release.rate_exponent.si() as f32;
            rules.stem_least_load = (least * least) as f32;
        }
        if let (Some(spec), Some(weather)) = (&plant.spec.wind, &plant.weather) {
            let mean = weather.wind().mean();
            rules.waves = weather.wind().waves().count().next_multiple_of(wave::AT_ONCE) as u32;
            (rules.wind_x, rules.wind_y) = (mean.x as f32, mean.y as f32);
            rules.folding_speed = spec.folding_speed.si() as f32;
        }
        rules
    }
}

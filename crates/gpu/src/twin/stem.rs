//! Fruit: on a stem eliminated as leaves, off it thrown, rolling or at rest on the ground.

use super::Lane;
use super::math::Vec3;
use super::motion::Motion;
use crate::layout::{UNBOUNDED, fruit};

/// Regularisation of a contact as a share of its own inverse inertia, as in `orchard_multibody`.
const NEAR_RIGID: f32 = 1e-4;
/// Rotational inertia of a ball by mass and square of the radius.
pub(super) const BALL: f32 = 0.4;

/// A fruit with its stem, which a kernel reads at once.
#[derive(Clone, Copy)]
pub(super) struct Stem {
    pub mass: f32,
    pub radius: f32,
    pub threshold: f32,
    air_drag: f32,
    pub stiffness: f32,
    damping: f32,
    pub bias: f32,
    cap: f32,
    pub anchor: Vec3,
    pub drop: f32,
    pub force: Vec3,
    pub frames_over: u32,
    pub p: Vec3,
    pub v: Vec3,
    inverse_mass: f32,
    pub arm: Vec3,
    impulse: Vec3,
}

/// What the ground does to a loose fruit.
struct Met {
    impulse: Vec3,
    spin: Vec3,
}

impl Lane<'_> {
    pub(super) fn read_stem(&self, row: usize) -> Stem {
        let (number, vector) = (|field| self.fruit(row, field), |field| self.fruit3(row, field));
        let hangs = number(fruit::CAME_OFF).to_bits() == 0;
        let of_stem = |field| if hangs { number(field) } else { 0.0 };
        Stem {
            mass: number(fruit::MASS),
            radius: number(fruit::RADIUS),
            threshold: number(fruit::THRESHOLD),
            air_drag: number(fruit::AIR_DRAG),
            stiffness: of_stem(fruit::STIFFNESS),
            damping: of_stem(fruit::DAMPING),
            bias: number(fruit::BIAS),
            cap: number(fruit::CAP),
            anchor: vector(fruit::ANCHOR),
            drop: number(fruit::DROP),
            force: vector(fruit::FORCE),
            frames_over: number(fruit::FRAMES_OVER).to_bits(),
            p: vector(fruit::P),
            v: vector(fruit::V),
            inverse_mass: number(fruit::INVERSE_MASS),
            arm: vector(fruit::ARM),
            impulse: vector(fruit::IMPULSE),
        }
    }

    /// Arm and impulse of a stem on its link, and the mass that the fruit adds there.
    pub(super) fn stem_reaction(&self, row: usize) -> (Vec3, Vec3, f32) {
        (self.fruit3(row, fruit::ARM), self.fruit3(row, fruit::REACTION), self.fruit(row, fruit::ADDED_MASS))
    }

    /// What the next substep starts from, with the link's motion and position at its joint. Gives the square of the stem's stretch.
    pub(super) fn stem_start(
        &mut self,
        row: usize,
        stem: &Stem,
        own: &Motion,
        p: Vec3,
        is_debris: bool,
    ) -> f32 {
        let (h, gravity) = (self.memory.rules.h, self.memory.rules.gravity);
        let arm = own.axes.x * stem.anchor.x + own.axes.y * stem.anchor.y + own.axes.z * stem.anchor.z;
        let mut stretch = stem.p - (p + arm);
        stretch.z -= stem.drop;
        let u_relative = stem.v - (own.v + own.w.cross(&arm));

        // Impulse of the stem on the anchor, with both velocities as they are.
        let kappa = h * (stem.damping + h * stem.stiffness);
        let pull = stretch * (h * stem.stiffness) + u_relative * kappa;
        let hangs = stem.stiffness > 0.0;
        let drag = if hangs { 0.0 } else { stem.air_drag * stem.v.norm() };
        let mass = stem.mass + h * drag;
        let inverse_mass = 1.0 / (mass + kappa);
        let share = kappa * inverse_mass;
        let mut impulse = (stem.force - stem.v * drag) * h - pull;
        impulse.z -= h * stem.mass * gravity;

        // What the anchor feels. On live wood the weight at rest is taken off it, and above the cap its size is the cap's and the fruit adds no mass.
        let (bias, cap) = if hangs && !is_debris { (stem.bias, stem.cap) } else { (0.0, UNBOUNDED) };
        let mut reaction = pull + impulse * share;
        reaction.z += h * bias;
        let (size, largest) = (reaction.norm(), h * cap);
        let is_capped = size > largest;
        let reaction = if is_capped { reaction * (largest / size) } else { reaction };
        self.set_fruit(row, fruit::INVERSE_MASS, inverse_mass);
        self.set_fruit3(row, fruit::ARM, if hangs { arm } else { stem.arm });
        self.set_fruit3(row, fruit::REACTION, reaction);
        self.set_fruit(row, fruit::ADDED_MASS, if is_capped { 0.0 } else { mass * share });
        self.set_fruit3(row, fruit::IMPULSE, impulse);
        if hangs { stretch.norm_squared() } else { 0.0 }
    }

    /// The fruit at the end of a substep, the link having been turned and shifted at its joint.
    pub(super) fn stem_end(&mut self, row: usize, mut stem: Stem, turn: Vec3, shift: Vec3) -> Stem {
        let h = self.memory.rules.h;
        let mut impulse = stem.impulse;
        if stem.stiffness > 0.0 {
            let kappa = h * (stem.damping + h * stem.stiffness);
            impulse += (shift + turn.cross(&stem.arm)) * kappa;
        } else {
            let met = self.ground_impulse(&stem);
            impulse += met.impulse;
            stem.arm = met.spin;
        }
        stem.v += impulse * stem.inverse_mass;
        stem.p += stem.v * h;
        if self.memory.settles {
            stem.v = Vec3::zeros();
        }
        self.set_fruit3(row, fruit::V, stem.v);
        self.set_fruit3(row, fruit::P, stem.p);
        stem
    }

    /// Impulse of the ground on a loose fruit, in closed form, and its spin after it (`orchard_batch`'s ground).
    fn ground_impulse(&self, stem: &Stem) -> Met {
        let rules = &self.memory.rules;
        // The velocity that it would end the substep with.
        let v = stem.v + stem.impulse * stem.inverse_mass;
        let inertia = BALL * stem.mass * stem.radius * stem.radius;
        let mut spin = stem.arm / (1.0 + rules.h * rules.spin_loss);
        let gap = stem.p.z - stem.radius;
        let time = if gap > 0.0 { rules.h } else { rules.h + rules.dissipation_time };
        let admittance = rules.h * rules.ground_stiffness * time;
        let compliance = (1.0 / admittance).max(NEAR_RIGID * stem.inverse_mass);
        let pressed = (-gap / time - v.z) / (compliance + stem.inverse_mass);
        let mut impulse = Vec3::zeros();
        if pressed > 0.0 {
            let arm = Vec3::new(0.0, 0.0, -stem.radius);
            let slip = v + spin.cross(&arm);
            let across = stem.inverse_mass + stem.radius * stem.radius / inertia;
            let stick = Vec3::new(slip.x, slip.y, 0.0) * (-1.0 / ((1.0 + NEAR_RIGID) * across));
            let (size, most) = (stick.norm(), rules.ground_friction * pressed);
            let held = if size > most { stick * (most / size) } else { stick };
            spin += arm.cross(&held) / inertia;
            impulse = held + Vec3::new(0.0, 0.0, pressed);
        }
        Met { impulse, spin }
    }
}

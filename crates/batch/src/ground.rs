//! Loose fruit and debris on the ground, the plane z = 0.
//!
//! The law is that of the f64 world (`docs/computation/dynamics.md`, Contact) for one contact at a time: normal impulse
//! `-h k (gap + t v_n)` with the velocity at the end of the substep, t = h + dissipation time (h while still apart),
//! and Coulomb friction. A ball has no other contact, so that this one is solved in closed form. The tip of a
//! broken link meets the ground through a damper that the factor takes implicitly.

use orchard_geometry::Vec3;
use orchard_multibody::StepSettings;

/// Least normal regularisation and the tangential one, as a share of the contact's own inverse inertia: the f64 law's.
const NEAR_RIGID: f64 = 1e-4;
/// Speed below which friction on debris acts as a damper [m/s]: the creep of a sticking tip.
const CREEP: f64 = 1e-3;

/// Contact at a gap, before its impulse is known.
#[derive(Debug, Clone, Copy)]
struct Normal {
    /// h k t \[kg\].
    admittance: f64,
    /// Velocity at which the impulse vanishes [m/s].
    v_hat: f64,
}

impl Normal {
    fn new(settings: &StepSettings, stiffness: f64, gap: f64) -> Self {
        let h = settings.h;
        // Surfaces that are still apart have only the spring of the predicted overlap.
        let time = if gap > 0.0 { h } else { h + settings.contact_dissipation_time };
        Self { admittance: h * stiffness * time, v_hat: -gap / time }
    }

    /// Impulse [N s] on a body that ends the substep with a vertical velocity; negative where the ground would have to pull.
    fn impulse(&self, v_z: f64) -> f64 {
        self.admittance * (self.v_hat - v_z)
    }
}

/// A ball off its stem.
#[derive(Debug, Clone)]
pub(crate) struct Ball {
    pub radius: f64,
    /// Rotational inertia [kg m^2].
    pub inertia: f64,
    /// Coulomb coefficient of the pair.
    pub friction: f64,
    /// Contact stiffness of the pair [N/m].
    pub stiffness: f64,
    /// Loss of spin [1/s].
    pub spin_loss: f64,
    /// Angular velocity [rad/s].
    pub w_world: Vec3,
}

impl Ball {
    /// Reduces the spin over a substep, and returns the impulse of the ground [N s] on a ball at height `z` that would end the
    /// substep with the velocity `v` and has an inverse mass [1/kg].
    pub fn meet_ground(&mut self, settings: &StepSettings, z: f64, v: Vec3, inverse_mass: f64) -> Vec3 {
        self.w_world /= 1.0 + settings.h * self.spin_loss;
        let normal = Normal::new(settings, self.stiffness, z - self.radius);
        let compliance = (1.0 / normal.admittance).max(NEAR_RIGID * inverse_mass);
        let pressed = (normal.v_hat - v.z) / (compliance + inverse_mass);
        if pressed <= 0.0 {
            return Vec3::zeros();
        }
        let arm = Vec3::new(0.0, 0.0, -self.radius);
        let slip = v + self.w_world.cross(&arm);
        let across = inverse_mass + self.radius * self.radius / self.inertia;
        let stick = Vec3::new(slip.x, slip.y, 0.0) / -((1.0 + NEAR_RIGID) * across);
        let most = self.friction * pressed;
        let held = if stick.norm() > most { stick * (most / stick.norm()) } else { stick };
        self.w_world += arm.cross(&held) / self.inertia;
        held + Vec3::new(0.0, 0.0, pressed)
    }
}

/// The tip of a link of a broken limb.
#[derive(Debug, Clone)]
pub(crate) struct DebrisTip {
    pub row: usize,
    pub radius: f64,
    /// Coulomb coefficient of the pair.
    pub friction: f64,
    /// Contact stiffness of the pair [N/m].
    pub stiffness: f64,
    /// Ground inertia that held it in the last substep, and its vertical velocity before [m/s].
    held: Option<(Normal, f64)>,
}

/// Damper at the tip, and its impulse at the tip's present velocity.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Prop {
    /// Damper times h, along the ground \[kg\].
    pub across: f64,
    /// Inertia that the ground adds along the normal \[kg\].
    pub normal: f64,
    /// Impulse [N s].
    pub impulse: Vec3,
}

impl DebrisTip {
    pub fn new(row: usize, radius: f64, friction: f64, stiffness: f64) -> Self {
        Self { row, radius, friction, stiffness, held: None }
    }

    /// Contact of the ground over the next substep with a tip at height `z` with the velocity `v`, of which the substep
    /// before changed the vertical one by `lift`. The impulse is unknown before the solve: friction follows the normal impulse of the substep before, and a tip that
    /// pressed then is held for another substep, since the limb's stiff joints turn a rebound round within the substep.
    pub fn meet_ground(&mut self, settings: &StepSettings, z: f64, v: Vec3, lift: f64) -> Prop {
        let pressed_before = self.held.map_or(0.0, |(held, v_z)| held.impulse(v_z + lift).max(0.0));
        let normal = Normal::new(settings, self.stiffness, z - self.radius);
        let pressed = normal.impulse(v.z);
        if pressed <= 0.0 && pressed_before == 0.0 {
            self.held = None;
            return Prop::default();
        }
        self.held = Some((normal, v.z));
        let slip = Vec3::new(v.x, v.y, 0.0);
        let across = self.friction * pressed_before / slip.norm().max(CREEP);
        Prop { across, normal: normal.admittance, impulse: Vec3::new(0.0, 0.0, pressed) - across * slip }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_spec::Spec;
    use orchard_treephys::step_settings;

    const MASS: f64 = 0.16;
    const RADIUS: f64 = 0.0375;
    const STIFFNESS: f64 = 5e4;

    fn ball(friction: f64) -> Ball {
        let inertia = 0.4 * MASS * RADIUS * RADIUS;
        Ball {
            radius: RADIUS,
            inertia,
            friction,
            stiffness: STIFFNESS,
            spin_loss: 0.0,
            w_world: Vec3::zeros(),
        }
    }

    /// Runs substeps on the ground from a velocity; returns the remaining velocity and the lowest height.
    fn slide(ball: &mut Ball, mut v: Vec3, substeps: usize) -> (Vec3, f64) {
        let settings = step_settings(&Spec::paper().sim);
        let (mut z, mut lowest) = (RADIUS, RADIUS);
        for _ in 0..substeps {
            let free = v + settings.h * settings.gravity;
            v = free + ball.meet_ground(&settings, z, free, 1.0 / MASS) / MASS;
            z += settings.h * v.z;
            lowest = lowest.min(z);
        }
        (v, lowest)
    }

    #[test]
    fn a_ball_that_slides_ends_up_rolling_at_five_sevenths() {
        let mut ball = ball(0.5);
        // Friction 0.5 g takes 2/7 of 1 m/s in 0.058 s; a second leaves a wide margin.
        let (v, _) = slide(&mut ball, Vec3::new(1.0, 0.0, 0.0), 180);
        assert!((v.x - 5.0 / 7.0).abs() < 1e-3, "{v}");
        assert!((ball.w_world.y * RADIUS - v.x).abs() < 1e-3, "{}", ball.w_world);
    }

    #[test]
    fn a_ball_at_rest_sinks_in_by_its_weight_over_the_stiffness() {
        let settings = step_settings(&Spec::paper().sim);
        let (v, lowest) = slide(&mut ball(0.5), Vec3::zeros(), 180);
        let sag = MASS * -settings.gravity.z / STIFFNESS;
        assert!(v.norm() < 1e-6 && (RADIUS - lowest - sag).abs() < 0.01 * sag, "{v} {}", RADIUS - lowest);
    }

    #[test]
    fn the_ground_neither_pulls_nor_acts_at_a_distance() {
        let settings = step_settings(&Spec::paper().sim);
        let mut tip = DebrisTip::new(0, 0.01, 0.5, STIFFNESS);
        assert_eq!(tip.meet_ground(&settings, 0.5, Vec3::new(1.0, 0.0, -4.0), 0.0), Prop::default());
        assert_eq!(tip.meet_ground(&settings, 0.009, Vec3::new(0.0, 0.0, 4.0), 0.0), Prop::default());
        let prop = tip.meet_ground(&settings, 0.009, Vec3::new(1.0, 0.0, -1.0), 0.0);
        assert!(prop.impulse.z > 0.0 && prop.across == 0.0, "{prop:?}");
        // Held before, it is braked.
        assert!(tip.meet_ground(&settings, 0.009, Vec3::new(1.0, 0.0, 0.0), 1.0).impulse.x < 0.0);
    }

    #[test]
    fn a_rebound_is_held_until_the_ground_would_have_had_to_pull() {
        let settings = step_settings(&Spec::paper().sim);
        let mut tip = DebrisTip::new(0, 0.01, 0.5, STIFFNESS);
        let down = Vec3::new(0.0, 0.0, -1.0);
        assert!(tip.meet_ground(&settings, 0.009, down, 0.0).normal > 0.0);
        // Stopped by the ground, then turned up by the limb: it may press again.
        assert!(tip.meet_ground(&settings, 0.009, -down, 1.0).normal > 0.0);
        // It would have kept rising.
        assert_eq!(tip.meet_ground(&settings, 0.009, -down, 0.0), Prop::default());
    }
}

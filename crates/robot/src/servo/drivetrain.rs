//! Drivetrain of a joint: the inertia of its rotor and gears, and its friction, between motor and link.
//!
//! A drivetrain with armature B, Coulomb friction F and viscous friction b exerts `-B (v' - v) / h - b v' - f` on its joint over a substep of
//! length h, with `|f| <= F`. The first two terms are a damper and a torque, which the step takes implicitly. f is foreseen from the joint
//! alone: with the momentum p = J v + h tau that it would have at the end of the substep without friction and at rest, J with B in it, it
//! sticks if |p| <= h F, and slips with f = F sign(p) otherwise. A joint that sticks creeps: f = F v' / [`Drivetrain::CREEP`]. If what is not
//! foreseen (contact, other joints) would need more than F, the joint breaks free and the substep is repeated.

use super::{Input, Joint};

/// Armature and friction of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drivetrain {
    /// Inertia of rotor and gears as the joint feels it [kg m^2].
    pub armature: f64,
    /// Coulomb friction [N m].
    pub coulomb: f64,
    /// Viscous friction [N m s/rad].
    pub viscous: f64,
}

/// Torque that a drivetrain takes from its joint in one substep: `torque - damping v'`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Loss {
    /// Torque of the armature [N m].
    armature_torque: f64,
    /// Damping of armature and viscous friction [N m s/rad].
    smooth_damping: f64,
    coulomb: Coulomb,
}

/// Coulomb friction in one substep.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Coulomb {
    #[default]
    None,
    /// The joint sticks; its Coulomb friction [N m].
    Sticks(f64),
    /// The joint slips under this torque [N m].
    Slips(f64),
}

impl Drivetrain {
    /// Speed of a joint that sticks under the whole Coulomb friction [rad/s], our own choice: 0.6 deg in 100 s.
    pub const CREEP: f64 = 1e-4;

    /// Foresees the loss of a joint, whose inertia has the armature in it, under its servo and a known load [N m].
    pub(super) fn loss(&self, joint: &Joint, servo: &Input, load: f64, h: f64) -> Loss {
        let inertia = self.armature / h;
        let coulomb = if self.coulomb > 0.0 {
            let effort = servo.stiffness * (servo.rest - joint.q) + servo.torque + load;
            let momentum = joint.inertia * joint.v + h * effort;
            if momentum.abs() <= h * self.coulomb {
                Coulomb::Sticks(self.coulomb)
            } else {
                Coulomb::Slips(-self.coulomb.copysign(momentum))
            }
        } else {
            Coulomb::None
        };
        Loss { armature_torque: inertia * joint.v, smooth_damping: inertia + self.viscous, coulomb }
    }
}

impl Loss {
    /// The part that does not depend on the speed [N m].
    pub fn torque(&self) -> f64 {
        match self.coulomb {
            Coulomb::Slips(torque) => self.armature_torque + torque,
            _ => self.armature_torque,
        }
    }

    /// The part that grows with the speed [N m s/rad].
    pub fn damping(&self) -> f64 {
        match self.coulomb {
            Coulomb::Sticks(most) => self.smooth_damping + most / Drivetrain::CREEP,
            _ => self.smooth_damping,
        }
    }

    /// Lets a joint slip that stuck and has more than its Coulomb friction to bear at speed `v` [rad/s]; true if it did.
    pub fn breaks_free(&mut self, v: f64, slack: f64) -> bool {
        let Coulomb::Sticks(most) = self.coulomb else { return false };
        let breaks = v.abs() > Drivetrain::CREEP * (1.0 + slack);
        if breaks {
            self.coulomb = Coulomb::Slips(-most.copysign(v));
        }
        breaks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::{Mat3, Pose, Vec3};
    use orchard_multibody::{
        Body, ContactPath, Data, Integrator, JointKind, Model, ModelBuilder, Solver, SpatialInertia,
        StepReport, StepSettings, step,
    };

    const H: f64 = 1.0 / 180.0;
    /// Inertia of the wheel [kg m^2].
    const INERTIA: f64 = 0.3;

    /// A wheel on a hinge, without gravity.
    struct Wheel {
        model: Model,
        data: Data,
        drivetrain: Drivetrain,
    }

    impl Wheel {
        fn new(drivetrain: Drivetrain) -> Self {
            let mut builder = ModelBuilder::new();
            builder.add_body(Body {
                parent: None,
                joint: JointKind::Hinge(Vec3::z_axis()),
                x_parent_joint: Pose::identity(),
                inertia: SpatialInertia {
                    mass: 1.0,
                    p_com: Vec3::zeros(),
                    i_com: Mat3::from_diagonal(&Vec3::new(0.2, 0.2, INERTIA)),
                },
            });
            let model = builder.build().unwrap();
            let data = Data::new(&model);
            Self { model, data, drivetrain }
        }

        /// Runs under a motor's torque that the drivetrain foresees, and another that it does not [N m].
        fn run(&mut self, motor: f64, other: f64, steps: u32) {
            let settings = StepSettings {
                h: H,
                gravity: Vec3::zeros(),
                contact_dissipation_time: 0.01,
                contact_margin: 0.005,
                integrator: Integrator::default(),
                solver: Solver::default(),
                contact_path: ContactPath::default(),
            };
            let mut report = StepReport::default();
            for _ in 0..steps {
                let (q, v) = (self.data.q[0], self.data.v[0]);
                let joint = Joint { q, v, inertia: INERTIA + self.drivetrain.armature };
                let mut loss = self.drivetrain.loss(&joint, &Input::constant(motor), 0.0, H);
                let mut before = orchard_multibody::Motion::default();
                self.data.save_motion(&mut before);
                loop {
                    self.data.torque[0] = motor + other + loss.torque();
                    self.data.damping[0] = loss.damping();
                    step(&self.model, &mut self.data, &settings, &mut report);
                    if !loss.breaks_free(self.data.v[0], 1e-9) {
                        break;
                    }
                    self.data.restore_motion(&before);
                }
            }
        }
    }

    /// From rest a torque gives the speed tau t / (I + B).
    #[test]
    fn an_armature_slows_the_acceleration_as_inertia_does() {
        let armature = 0.6;
        let mut wheel = Wheel::new(Drivetrain { armature, ..Drivetrain::default() });
        wheel.run(0.9, 0.0, 90);
        let expected = 0.9 * 90.0 * H / (INERTIA + armature);
        assert!((wheel.data.v[0] - expected).abs() < 1e-12, "{} {expected}", wheel.data.v[0]);
    }

    /// Below its level Coulomb friction holds, whether the load is foreseen or not; above, the rest accelerates; afterwards the joint stops
    /// within v I / F.
    #[test]
    fn coulomb_friction_holds_below_its_level_and_takes_it_off_above() {
        let drivetrain = Drivetrain { coulomb: 0.5, ..Drivetrain::default() };
        for (motor, other) in [(0.49, 0.0), (-0.3, -0.19), (0.0, 0.49)] {
            let mut wheel = Wheel::new(drivetrain);
            wheel.run(motor, other, 180);
            let crept = wheel.data.q[0].abs();
            assert!(crept < 1.001e-4, "{motor} and {other} N m: {crept} rad in a second");
        }
        for (motor, other) in [(0.8, 0.0), (0.2, 0.6), (0.0, 0.8)] {
            let mut wheel = Wheel::new(drivetrain);
            wheel.run(motor, other, 90);
            let expected = 0.3 * 90.0 * H / INERTIA;
            // In the first substep an unforeseen load may meet the joint at its creep.
            assert!((wheel.data.v[0] - expected).abs() < 2e-4, "{} {expected}", wheel.data.v[0]);
            let stops_after = (wheel.data.v[0] * INERTIA / 0.5 / H).ceil() as u32;
            wheel.run(0.0, 0.0, stops_after - 2);
            assert!(wheel.data.v[0] > 1e-3, "{}", wheel.data.v[0]);
            wheel.run(0.0, 0.0, 3);
            assert!(wheel.data.v[0].abs() < 1e-4, "{}", wheel.data.v[0]);
        }
    }

    /// Under a constant torque the speed goes to tau / b; with implicit steps as (1 - (1 + h b / I)^-n).
    #[test]
    fn viscous_friction_bounds_the_speed() {
        let mut wheel = Wheel::new(Drivetrain { viscous: 2.0, ..Drivetrain::default() });
        wheel.run(1.0, 0.0, 20);
        let expected = 0.5 * (1.0 - orchard_geometry::math::pow(1.0 + H * 2.0 / INERTIA, -20.0));
        assert!((wheel.data.v[0] - expected).abs() < 1e-12, "{} {expected}", wheel.data.v[0]);
        wheel.run(1.0, 0.0, 400);
        assert!((wheel.data.v[0] - 0.5).abs() < 1e-6, "{}", wheel.data.v[0]);
    }
}

//! A hand that pulls wood, fruit or the robot like a spring.
//!
//! The spring is taken implicitly, with the compliance C of the grabbed place over a frame T: the force that is exact at the end of the frame,
//! `f = k (p_target - p(T))` with `p(T) = p_free(T) + C f`, is `f = (I / k + C)^-1 (p_target - p_free(T))`. So the place approaches the target
//! and never overshoots it by the spring alone, however light the twig is. C and `p_free(T)` come from trial steps of the length of a frame on
//! a copy of the state, without a force and with a small one along each axis.

use orchard_geometry::{Mat3, Vec3};
use orchard_multibody::{StepReport, StepSettings, step};
use orchard_treephys::step_settings;
use orchard_world::World;

use crate::grip::Grip;
use crate::rules::HandRules;

/// A hand; it holds at most one place.
#[derive(Debug)]
pub struct Hand {
    rules: HandRules,
    held: Option<Grip>,
    p_world_target: Vec3,
    force_world: Vec3,
    /// Force and torque of the held body, or force of the held fruit, without the hand.
    before: [Vec3; 2],
}

impl Hand {
    /// An empty hand.
    pub fn new(rules: &HandRules) -> Self {
        let zero = Vec3::zeros();
        Self { rules: rules.clone(), held: None, p_world_target: zero, force_world: zero, before: [zero; 2] }
    }

    /// Takes a place, with the pointer on it \[m\], world.
    pub fn take(&mut self, grip: Grip, p_world_target: Vec3) {
        (self.held, self.p_world_target, self.force_world) = (Some(grip), p_world_target, Vec3::zeros());
    }

    /// Moves the pointer \[m\], world. A place that is not finite is left out.
    pub fn pull_to(&mut self, p_world: &Vec3) {
        if p_world.iter().all(|x| x.is_finite()) {
            self.p_world_target = *p_world;
        }
    }

    /// Lets go.
    pub fn release(&mut self) {
        (self.held, self.force_world) = (None, Vec3::zeros());
    }

    /// The held place.
    pub fn grip(&self) -> Option<&Grip> {
        self.held.as_ref()
    }

    /// The pointer \[m\], world.
    pub fn target(&self) -> Vec3 {
        self.p_world_target
    }

    /// Force of the last frame \[N\], world.
    pub fn force(&self) -> Vec3 {
        self.force_world
    }

    /// Puts the hand's force on the world for the next frame. An empty hand leaves every bit as it is.
    pub(crate) fn load(&mut self, world: &mut World) {
        let Some(grip) = self.held else { return };
        if !grip.holds(world) {
            self.release();
            return;
        }
        self.force_world = self.spring(&grip, world);
        let inputs = grip.inputs(world);
        self.before = inputs.read(world.data());
        let loads = grip.loads(world, world.data(), &self.force_world);
        inputs.add(world.data_mut(), loads);
    }

    /// Takes the hand's force from the world, and lets go of what broke off.
    pub(crate) fn unload(&mut self, world: &mut World) {
        let Some(grip) = self.held else { return };
        let inputs = grip.inputs(world);
        inputs.write(world.data_mut(), self.before);
        if !grip.holds(world) {
            self.release();
        }
    }

    /// Force of the spring over the next frame \[N\].
    fn spring(&self, grip: &Grip, world: &World) -> Vec3 {
        let sim = &world.spec().sim;
        let settings = StepSettings { h: sim.frame(), ..step_settings(sim) };
        let after = |force_world: &Vec3| {
            let mut data = world.data().clone();
            let loads = grip.loads(world, &data, force_world);
            grip.inputs(world).add(&mut data, loads);
            step(world.model(), &mut data, &settings, &mut StepReport::default());
            grip.place(world, &data)
        };
        let (probe, largest) = (self.rules.probe_force.si(), self.rules.largest_force.si());
        let free = after(&Vec3::zeros());
        let columns = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| (after(&(axis * probe)) - free) / probe);
        let compliance = Mat3::from_columns(&columns) + Mat3::identity() / self.rules.stiffness.si();
        let force = compliance.try_inverse().map_or_else(Vec3::zeros, |k| k * (self.p_world_target - free));
        let size = force.norm();
        if !size.is_finite() {
            return Vec3::zeros();
        }
        if size > largest { force * (largest / size) } else { force }
    }
}

#[cfg(test)]
#[path = "hand_tests.rs"]
mod tests;

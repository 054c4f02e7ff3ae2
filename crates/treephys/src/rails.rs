//! Three limits (rails) on forces that a hand, a brush or a test applies to a link.
//!
//! They keep a gram-scale twig from being flung when the wood that held it breaks. The solver does not need
//! them to stay finite and no benchmark world uses them. None acts on a link that stays
//! at rest, so that a branch bent until it snaps feels the whole force:
//!
//! 1. power fade: the part of a force along the velocity fades out between `fade_speed` and `speed_limit`;
//! 2. speed brake: above the limit, the force `-brake * mass * (|v| - limit)` along v;
//! 3. impulse cap: a force that would take its link past the limit within one substep, with all that holds
//!    the link, is scaled to reach it.
//!
//! Torques go by the angular velocity and its limits. Velocities are those of the centre of mass.

use orchard_geometry::{Mat3, Vec3};
use orchard_multibody::{BodyId, Data, Model, StepReport, StepSettings, step};
use orchard_spec::wood::RailsSpec;

/// Applies the rails to the external forces and torques of some links, which then hold for the next substep.
/// The kinematics of `data` must be valid. The impulse cap tries one substep for each loaded link.
pub fn restrain(
    rails: &RailsSpec,
    model: &Model,
    data: &mut Data,
    settings: &StepSettings,
    bodies: &[BodyId],
) {
    let (speed_limit, spin_limit, brake) = (rails.speed_limit.si(), rails.spin_limit.si(), rails.brake.si());
    for &id in bodies {
        let index = id.index();
        let (v, omega) = velocity(data, id);
        let link = &model.body(id).inertia;
        let turn = data.x_world_body(id).rotation.to_rotation_matrix();
        let i_com: Mat3 = turn.matrix() * link.i_com * turn.matrix().transpose();
        let force = faded(&data.body_force_world[index], &v, rails.fade_speed.si(), speed_limit);
        let torque = faded(&data.body_torque_world[index], &omega, rails.fade_spin.si(), spin_limit);
        data.body_force_world[index] = force - excess(&v, speed_limit) * (brake * link.mass);
        data.body_torque_world[index] = torque - i_com * excess(&omega, spin_limit) * brake;
    }
    for &id in bodies {
        let index = id.index();
        let (force, torque) = (data.body_force_world[index], data.body_torque_world[index]);
        if force == Vec3::zeros() && torque == Vec3::zeros() {
            continue;
        }
        let (v, omega) = after_a_substep(model, data.clone(), settings, id);
        if v.norm() <= speed_limit && omega.norm() <= spin_limit {
            continue;
        }
        let mut unloaded = data.clone();
        unloaded.body_force_world[index] = Vec3::zeros();
        unloaded.body_torque_world[index] = Vec3::zeros();
        let (v_free, omega_free) = after_a_substep(model, unloaded, settings, id);
        let share = share_within(&v_free, &v, speed_limit).min(share_within(&omega_free, &omega, spin_limit));
        data.body_force_world[index] = force * share;
        data.body_torque_world[index] = torque * share;
    }
}

/// Velocity of the centre of mass and angular velocity of a link.
fn velocity(data: &Data, id: BodyId) -> (Vec3, Vec3) {
    (data.point_velocity_world(id, &data.com_p_world(id)), data.velocity(id).angular)
}

fn after_a_substep(model: &Model, mut data: Data, settings: &StepSettings, id: BodyId) -> (Vec3, Vec3) {
    step(model, &mut data, settings, &mut StepReport::default());
    velocity(&data, id)
}

/// A force without the part along the velocity that the power fade takes.
fn faded(force: &Vec3, v: &Vec3, fade: f64, limit: f64) -> Vec3 {
    let speed = v.norm();
    let power = force.dot(v);
    if speed <= fade || power <= 0.0 {
        return *force;
    }
    let kept = if limit > fade { ((limit - speed) / (limit - fade)).max(0.0) } else { 0.0 };
    force - v * ((1.0 - kept) * power / (speed * speed))
}

/// The part of a velocity above its limit.
fn excess(v: &Vec3, limit: f64) -> Vec3 {
    let speed = v.norm();
    if speed > limit { v * (1.0 - limit / speed) } else { Vec3::zeros() }
}

/// Largest s in 0..1 with `|free + s (loaded - free)| <= limit`. Where `free` is past the limit already, a load
/// that slows is kept whole and one that speeds up is dropped.
fn share_within(free: &Vec3, loaded: &Vec3, limit: f64) -> f64 {
    if loaded.norm() <= limit {
        return 1.0;
    }
    let gain = loaded - free;
    let (a, b, c) = (gain.norm_squared(), free.dot(&gain), free.norm_squared() - limit * limit);
    if c >= 0.0 {
        return if loaded.norm() <= free.norm() { 1.0 } else { 0.0 };
    }
    // The positive root of a s^2 + 2 b s + c = 0, in the form that does not cancel for b > 0.
    let root = (b * b - a * c).sqrt();
    if b > 0.0 { -c / (b + root) } else { (root - b) / a }
}

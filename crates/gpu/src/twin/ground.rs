//! The tips of broken limbs on the ground, the plane z = 0 (`orchard_batch`'s ground): a damper that the factor takes implicitly, and the impulse that it gives while
//! the tip's velocity stays as it is.

use super::Lane;
use super::load::Load;
use super::math::Vec3;
use crate::layout::{RADIUS_UNITS, UNBOUNDED, fourth, work};

/// Speed below which friction on wood acts as a damper [m/s]: what a sticking tip may creep at.
const CREEP: f32 = 1e-3;

/// What held a tip in the last substep: the velocity at which the normal impulse vanishes, and the tip's vertical velocity before; [`UNBOUNDED`] if
/// nothing did.
pub(super) type Held = [f32; 2];

impl Lane<'_> {
    /// h k t of a contact [kg], t the time over which an overlap is taken back: surfaces that are still apart feel only the overlap to come.
    fn admittance(&self, is_apart: bool) -> f32 {
        let rules = &self.memory.rules;
        let time = if is_apart { rules.h } else { rules.h + rules.dissipation_time };
        rules.h * rules.wood_stiffness * time
    }

    /// What the ground does over the next substep to a tip at a height with a velocity, of which the substep before changed the vertical one by `lift`.
    /// Friction follows the normal impulse of the substep before, and a tip that pressed then is held on.
    pub(super) fn meet_ground(
        &mut self,
        row: usize,
        fourth_word: usize,
        z: f32,
        v: Vec3,
        lift: f32,
        held: Held,
    ) {
        let rules = self.memory.rules;
        let radius = (fourth_word >> fourth::RADIUS & 0x7fff) as f32 / RADIUS_UNITS;
        let pressed_before = (self.admittance(held[0] < 0.0) * (held[0] - (held[1] + lift))).max(0.0);
        let gap = z - radius;
        let time = if gap > 0.0 { rules.h } else { rules.h + rules.dissipation_time };
        let (normal, v_hat) = (self.admittance(gap > 0.0), -gap / time);
        let pressed = normal * (v_hat - v.z);
        let at = self.work_at(row);
        if pressed <= 0.0 && pressed_before == 0.0 {
            self.set_quad(at, work::PROP, [0.0; 4]);
            self.set_quad(at, work::HELD, [0.0, 0.0, UNBOUNDED, 0.0]);
        } else {
            let across = rules.wood_friction * pressed_before / (v.x * v.x + v.y * v.y).sqrt().max(CREEP);
            self.set_quad(at, work::PROP, [-across * v.x, -across * v.y, pressed, across]);
            self.set_quad(at, work::HELD, [normal, v_hat, v.z, 0.0]);
        }
    }

    /// What a tip bears with the ground below it, and what holds it.
    pub(super) fn propped(&self, row: usize, mut load: Load) -> (Load, Held) {
        let at = self.work_at(row);
        let [x, y, z, across] = self.quad(at, work::PROP);
        let [normal, v_hat, v_z, _] = self.quad(at, work::HELD);
        load.linear[0].x += across;
        load.linear[1].x += across;
        load.linear[1].z += normal;
        load.force += Vec3::new(x, y, z);
        (load, [v_hat, v_z])
    }
}

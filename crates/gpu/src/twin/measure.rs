//! Mechanical energy of a world, as `orchard_multibody::energy` defines it: zero at the height of the world's origin.

use super::Lane;
use super::math::Vec3;
use super::motion::{Axes, Motion};
use super::outward::kinematics;
use super::stem::{BALL, Stem};
use crate::layout::{first, state, third, tile, world};
use crate::schedule::{LEVELS, PARTS, WARPS};

impl Lane<'_> {
    /// Sums up a world's energy in the order of its warps. It changes nothing that a frame starts from.
    pub(super) fn measure(&mut self) {
        let of_parts: Vec<f32> = (0..PARTS).map(|part| self.energy_of(part)).collect();
        let of_warp = |warp: usize| {
            let trunk = if warp == 0 { of_parts[0] } else { 0.0 };
            (0..LEVELS).fold(trunk, |sum, level| sum + of_parts[1 + level * WARPS + warp])
        };
        let energy = (0..WARPS).map(of_warp).reduce(|sum, of| sum + of).unwrap_or_default();
        self.set_world(world::ENERGY, energy);
    }

    fn energy_of(&mut self, part: usize) -> f32 {
        let (start, end) = (self.header(tile::STARTS + part), self.header(tile::STARTS + part + 1));
        let mut tip = self.ground_tip();
        let mut energy = 0.0;
        let gravity = self.memory.rules.gravity;
        for row in start..end {
            let [a, _, c, _] = self.operation(row);
            if a & first::ACTIVE == 0 {
                continue;
            }
            let (bits, own) = (self.state(row), self.read_link(row));
            if a & first::ROOT != 0 {
                tip = self.ground_tip();
            } else if a & (first::FROM_SLOT | first::FROM_CROSS) != 0 {
                tip = self.fork(self.parent_fork_at(a));
            }
            let p_joint = tip.p;
            let at_joint = kinematics(&self.read_hinge(row), &tip.motion);
            let d = at_joint.axes.z * own.length;
            let v_d = at_joint.w.cross(&d);
            tip.motion = Motion { v: at_joint.v + v_d, ..at_joint };
            tip.p += d;

            let v_com = at_joint.v + v_d * 0.5;
            let along = at_joint.w.dot(&at_joint.axes.z);
            let turning = own.across * at_joint.w.norm_squared() + own.excess * along * along;
            energy += 0.5 * (own.mass * v_com.norm_squared() + turning);
            energy += own.mass * gravity * (p_joint.z + 0.5 * d.z);
            if bits & state::BROKEN == 0 {
                energy += 0.5 * own.stiffness * (own.q[0] * own.q[0] + own.q[1] * own.q[1]);
            }
            let first_fruit = c >> third::FIRST_FRUIT & 0xfff;
            for k in first_fruit..first_fruit + (c >> third::FRUIT & 0x3f) {
                let stem = self.read_stem(k);
                energy += self.energy_of_fruit(&stem, &at_joint.axes, p_joint, bits & state::DEBRIS != 0);
            }
            if a & first::TO_SLOT != 0 {
                self.set_fork(self.slot_at(a >> first::SLOT & 0xff), &tip);
            }
            if a & first::TO_CROSS != 0 {
                self.set_fork(self.cross_fork_at(a >> first::FORK), &tip);
            }
        }
        energy
    }

    fn energy_of_fruit(&self, stem: &Stem, axes: &Axes, p_joint: Vec3, is_debris: bool) -> f32 {
        let gravity = self.memory.rules.gravity;
        let energy = stem.mass * (0.5 * stem.v.norm_squared() + gravity * stem.p.z);
        if stem.stiffness == 0.0 {
            let inertia = BALL * stem.mass * stem.radius * stem.radius;
            return energy + 0.5 * inertia * stem.arm.norm_squared();
        }
        let p_anchor = p_joint + axes.x * stem.anchor.x + axes.y * stem.anchor.y + axes.z * stem.anchor.z;
        let mut stretch = stem.p - p_anchor;
        stretch.z -= stem.drop;
        let bias = if is_debris { 0.0 } else { stem.bias };
        energy + 0.5 * stem.stiffness * stretch.norm_squared() - bias * p_anchor.z
    }
}

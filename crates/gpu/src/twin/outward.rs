//! Root to tips: velocity changes, the new state, and the motion that the next way in starts from.

use super::Lane;
use super::ground::Held;
use super::math::{Vec3, is_finite};
use super::motion::{Axes, Hinge, Motion, joint_outward};
use super::stem::Stem;
use crate::layout::{QUAD, UNBOUNDED, first, fork, fruit, link, notice, second, state, third, tile, work};

/// No angle moves further in a step of settling [rad]: `orchard_multibody::equilibrium`'s.
const LARGEST_MOVE: f32 = 0.3;

/// What an outward walk is for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// Only the motion of the state as it is.
    Look,
    /// A substep.
    Advance,
    /// The last substep of a frame, with its tests.
    Test,
}

/// What the tests found.
#[derive(Clone, Copy, Default)]
pub(super) struct Found {
    /// Bits of a notice.
    pub notice: usize,
    /// Largest square of an angle over its limit's.
    pub peak: f32,
}

/// Where the walk is: a link's tip.
#[derive(Clone, Copy)]
pub(super) struct Tip {
    /// Axes at the start of the substep.
    old: Axes,
    /// Change of velocity in the substep.
    turn: Vec3,
    shift: Vec3,
    pub motion: Motion,
    pub p: Vec3,
}

/// What the way in has left at a link.
struct Left {
    g_1n: Vec3,
    g_1f: Vec3,
    g_2n: Vec3,
    g_2f: Vec3,
    e: [f32; 2],
    held: Held,
}

impl Lane<'_> {
    fn read_left(&self, at: usize) -> Left {
        let [n_1, f_1, n_2, f_2] =
            [work::G_1N, work::G_1F, work::G_2N, work::G_2F].map(|field| self.quad(at, field));
        let vector = |quad: [f32; 4]| Vec3::new(quad[0], quad[1], quad[2]);
        Left {
            g_1n: vector(n_1),
            g_1f: vector(f_1),
            g_2n: vector(n_2),
            g_2f: vector(f_2),
            e: [n_1[3], f_1[3]],
            held: [n_2[3], f_2[3]],
        }
    }

    /// One part of the walk.
    pub(super) fn outward(&mut self, part: usize, way: Way) -> Found {
        let (start, end) = (self.header(tile::STARTS + part), self.header(tile::STARTS + part + 1));
        let mut tip = self.ground_tip();
        let mut found = Found::default();
        for row in start..end {
            let [a, b, c, d] = self.operation(row);
            if a & first::ACTIVE == 0 {
                continue;
            }
            let mut own = self.read_hinge(row);
            if a & first::ROOT != 0 {
                tip = self.ground_tip();
            } else if a & (first::FROM_SLOT | first::FROM_CROSS) != 0 {
                tip = self.fork(self.parent_fork_at(a));
            }
            // Change of velocity at the joint.
            let (shift, mut held) = (tip.shift, [0.0, UNBOUNDED]);
            if way != Way::Look {
                let left = self.read_left(self.work_at(row));
                (own.q, own.v) = self.advance(&own, &left, &mut tip);
                held = left.held;
                for k in 0..2 {
                    self.set_link(row, link::Q + k, own.q[k]);
                    self.set_link(row, link::V + k, own.v[k]);
                }
            }
            let p_joint = tip.p;
            let at_joint = kinematics(&own, &tip.motion);
            let to_tip = at_joint.axes.z * own.length;
            let v_d = at_joint.w.cross(&to_tip);
            let b_d = at_joint.b_w.cross(&to_tip) + at_joint.w.cross(&v_d);
            tip.motion = Motion { v: at_joint.v + v_d, b_v: at_joint.b_v + b_d, ..at_joint };
            tip.p += to_tip;
            let is_debris = self.state(row) & state::DEBRIS != 0;
            let first_fruit = c >> third::FIRST_FRUIT & 0xfff;
            for fruit in first_fruit..first_fruit + (c >> third::FRUIT & 0x3f) {
                let mut stem = self.read_stem(fruit);
                if way != Way::Look {
                    stem = self.stem_end(fruit, stem, tip.turn, shift);
                }
                let stretch = self.stem_start(fruit, &stem, &at_joint, p_joint, is_debris);
                if way == Way::Test {
                    found.notice |= self.test_stem(fruit, &stem, stretch);
                }
            }
            if way == Way::Test {
                self.test_joint(row, &own, &mut found);
            }
            if is_debris {
                let lift = if way == Way::Look { 0.0 } else { tip.shift.z };
                self.meet_ground(row, d, tip.p.z, tip.motion.v, lift, held);
            }
            if b & second::CARRIES == 0 {
                self.set_motion(self.leaf_at(c >> third::LEAF & 0x3ff), 0, &tip.motion);
            }
            if a & first::TO_SLOT != 0 {
                self.set_fork(self.slot_at(a >> first::SLOT & 0xff), &tip);
            }
            if a & first::TO_CROSS != 0 {
                self.set_fork(self.cross_fork_at(a >> first::FORK), &tip);
            }
        }
        found
    }

    pub(super) fn ground_tip(&self) -> Tip {
        let zero = Vec3::zeros();
        Tip { old: Axes::world(), turn: zero, shift: zero, motion: Motion::still(), p: self.p_trunk() }
    }

    pub(super) fn fork(&self, at: usize) -> Tip {
        let [y, z, turn, shift] = self.vectors(at, fork::CHANGE);
        let [.., x, y_tip] = self.quad(at, fork::HEIGHT - QUAD);
        let p = Vec3::new(x, y_tip, self.quad(at, fork::HEIGHT)[0]);
        Tip { old: Axes::of(y, z), turn, shift, motion: self.motion(at, fork::MOTION), p }
    }

    pub(super) fn set_fork(&mut self, at: usize, tip: &Tip) {
        self.set_vectors(at, fork::CHANGE, &[tip.old.y, tip.old.z, tip.turn, tip.shift]);
        self.set_motion(at, fork::MOTION, &tip.motion);
        let mut last = self.quad(at, fork::HEIGHT - QUAD);
        (last[2], last[3]) = (tip.p.x, tip.p.y);
        self.set_quad(at, fork::HEIGHT - QUAD, last);
        self.set_quad(at, fork::HEIGHT, [tip.p.z, 0.0, 0.0, 0.0]);
    }

    /// A link's new angles and rates, and its tip's change of velocity.
    fn advance(&self, own: &Hinge, left: &Left, tip: &mut Tip) -> ([f32; 2], [f32; 2]) {
        let joint = joint_outward(&tip.old, own.direction, own.q);
        let dv = [
            left.e[0] - left.g_1n.dot(&tip.turn) - left.g_1f.dot(&tip.shift),
            left.e[1] - left.g_2n.dot(&tip.turn) - left.g_2f.dot(&tip.shift),
        ];
        tip.turn += joint.first * dv[0] + joint.axes.y * dv[1];
        tip.shift += tip.turn.cross(&(joint.axes.z * own.length));
        tip.old = joint.axes;
        let v = [own.v[0] + dv[0], own.v[1] + dv[1]];
        let h = self.memory.rules.h;
        if self.memory.settles {
            let moved = v.map(|v| (v * h).clamp(-LARGEST_MOVE, LARGEST_MOVE));
            return ([own.q[0] + moved[0], own.q[1] + moved[1]], [0.0; 2]);
        }
        ([own.q[0] + v[0] * h, own.q[1] + v[1] * h], v)
    }

    /// Counts frames over the limit of an unbroken joint, and looks for numbers that are none.
    fn test_joint(&mut self, row: usize, own: &Hinge, found: &mut Found) {
        let limit = self.link(row, link::LIMIT);
        let bits = self.state(row);
        let square = |pair: [f32; 2]| pair[0] * pair[0] + pair[1] * pair[1];
        let bend = square(own.q);
        if !(is_finite(bend) && is_finite(square(own.v))) {
            found.notice |= notice::NON_FINITE;
        }
        if bits & state::DEBRIS != 0 {
            return;
        }
        found.peak = found.peak.max(bend / limit);
        let frames = bits & state::FRAMES_OVER;
        let over = if bend > limit { (frames + 1).min(state::FRAMES_OVER) } else { 0 };
        if over >= self.memory.rules.rupture_frames as usize {
            found.notice |= notice::SNAPS;
        }
        if over != frames {
            self.set_state(row, bits - frames + over);
        }
    }

    /// Counts frames over both limits of a stem; gives bits of a notice.
    fn test_stem(&mut self, row: usize, stem: &Stem, stretch: f32) -> usize {
        let is_sound = is_finite(stem.p.norm_squared()) && is_finite(stem.v.norm_squared());
        let mut notice = if is_sound { 0 } else { notice::NON_FINITE };
        if stem.stiffness > 0.0 {
            let longest = self.memory.rules.tension_factor * stem.threshold / stem.stiffness;
            let count = |over: bool, frames: u32| if over { (frames + 1).min(0xff) } else { 0 };
            let tension = count(stretch > longest * longest, stem.frames_over & 0xff);
            let is_pulled = stem.force.norm_squared() > stem.threshold * stem.threshold;
            let pull = count(is_pulled, stem.frames_over >> 8 & 0xff);
            self.set_fruit(row, fruit::FRAMES_OVER, f32::from_bits(tension | pull << 8));
            if tension >= self.memory.rules.tension_frames || pull >= self.memory.rules.pull_frames {
                notice |= notice::DETACHES;
            }
        }
        notice
    }
}

/// A link's motion at its joint, with its own axes, from its parent's at the tip.
pub(super) fn kinematics(own: &Hinge, parent: &Motion) -> Motion {
    let joint = joint_outward(&parent.axes, own.direction, own.q);
    let s_w = joint.first * own.v[0] + joint.axes.y * own.v[1];
    let b_w = parent.b_w + parent.w.cross(&s_w) + joint.third * (own.v[0] * own.v[1]);
    Motion { axes: joint.axes, w: parent.w + s_w, b_w, v: parent.v, b_v: parent.b_v }
}

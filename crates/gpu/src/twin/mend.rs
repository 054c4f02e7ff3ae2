//! The rare part of a frame's end: joints break, fruit come off, worlds that are no longer finite stop.

use super::Lane;
use super::math::Vec3;
use super::motion::{Axes, joint_outward};
use crate::layout::{first, fourth, fruit, link, notice, state, third, tile, world};
use crate::schedule::PARTS;

/// Where a pass over all links leaves their second and third axes and tips, in their rows' work.
const PLACED: usize = 0;
/// The trace's third of an inertia, by its part across and its excess.
const THIRD: f32 = 1.0 / 3.0;

impl Lane<'_> {
    /// Acts on what a frame's tests found.
    pub(super) fn mend(&mut self) {
        let found = self.world(world::NOTICE).to_bits() as usize;
        if found & notice::NON_FINITE != 0 {
            self.set_world(world::STOPPED, f32::from_bits(self.memory.rules.frame));
        }
        if found & (notice::NON_FINITE | notice::SNAPS | notice::DETACHES) == 0 {
            return;
        }
        let mut left = 0;
        if found & notice::NON_FINITE == 0 {
            if found & notice::SNAPS != 0 {
                self.snap();
            }
            if found & notice::DETACHES != 0 {
                self.detach();
            }
            left = notice::STALE;
        }
        self.set_world(world::NOTICE, f32::from_bits(left as u32));
    }

    fn count(&mut self, field: usize) {
        let count = self.world(field).to_bits() + 1;
        self.set_world(field, f32::from_bits(count));
    }

    /// Breaks the joints that were over their limits for long enough, those nearest to the trunk first: what hangs from them is no longer loaded.
    fn snap(&mut self) {
        self.place_links();
        let rows = self.header(tile::STARTS + PARTS);
        for row in 0..rows {
            let ([a, ..], bits) = (self.operation(row), self.state(row));
            let over = bits & state::FRAMES_OVER;
            let is_live = a & first::ACTIVE != 0 && bits & state::DEBRIS == 0;
            if is_live && over >= self.memory.rules.rupture_frames as usize {
                self.break_joint(row, rows);
            }
        }
    }

    /// Axes and tip of every link. Parents have smaller rows.
    pub(super) fn place_links(&mut self) {
        for row in 0..self.header(tile::STARTS + PARTS) {
            let [a, .., d] = self.operation(row);
            if a & first::ACTIVE == 0 {
                continue;
            }
            let (axes, p) = self.placed_parent(a, d);
            let q = [self.link(row, link::Q), self.link(row, link::Q + 1)];
            let joint = joint_outward(&axes, self.direction(row), q);
            let at = self.work_at(row);
            let p_tip = p + joint.axes.z * self.link(row, link::LENGTH);
            self.set_vectors(at, PLACED, &[joint.axes.y, joint.axes.z, p_tip]);
        }
    }

    /// Axes and tip of a link's parent.
    fn placed_parent(&self, first_word: usize, fourth_word: usize) -> (Axes, Vec3) {
        if first_word & first::ROOT != 0 {
            return (Axes::world(), self.p_trunk());
        }
        self.placed(fourth_word >> fourth::PARENT_ROW)
    }

    /// Axes and tip of a link that has been placed.
    pub(super) fn placed(&self, row: usize) -> (Axes, Vec3) {
        let [y, z, p] = self.vectors(self.work_at(row), PLACED);
        (Axes::of(y, z), p)
    }

    /// Breaks a joint in place, as `treephys::Rupture` does: the spring goes, the sub-tree becomes debris with less drag. Its fruit count towards its moment and
    /// inertia.
    fn break_joint(&mut self, broken: usize, rows: usize) {
        let [a, .., d] = self.operation(broken);
        let (_, p_joint) = self.placed_parent(a, d);
        let (mut moment, mut inertia) = (Vec3::zeros(), 0.0);
        for row in broken..rows {
            let [a, _, c, d] = self.operation(row);
            if row != broken && !self.hangs(a, d) {
                continue;
            }
            self.set_state(row, self.state(row) | state::DEBRIS | state::BREAKING);
            let at = self.work_at(row);
            let [_, z, p_tip] = self.vectors(at, PLACED);
            let half = z * (0.5 * self.link(row, link::LENGTH));
            let (arm, mass) = (p_tip - half - p_joint, self.link(row, link::MASS));
            moment += arm * mass;
            inertia += mass * arm.norm_squared()
                + self.link(row, link::ACROSS)
                + THIRD * self.link(row, link::EXCESS);
            let first_fruit = c >> third::FIRST_FRUIT & 0xfff;
            for fruit_row in first_fruit..first_fruit + (c >> third::FRUIT & 0x3f) {
                let stem = self.read_stem(fruit_row);
                if stem.stiffness > 0.0 {
                    let arm = stem.p - p_joint;
                    moment += arm * stem.mass;
                    inertia += stem.mass * arm.norm_squared();
                }
            }
        }
        for row in broken..rows {
            self.set_state(row, self.state(row) & !state::BREAKING);
        }
        let frame = self.memory.rules.frame as usize;
        self.set_state(broken, self.state(broken) | state::BROKEN | frame << state::BROKE);
        let rules = self.memory.rules;
        self.set_link(broken, link::BROKEN_INERTIA, inertia);
        self.set_link(broken, link::FRICTION, rules.friction_ratio * rules.gravity * moment.norm());
        self.set_link(broken, link::LAST_RATE, 0.0);
        self.count(world::SNAPPED);
    }

    /// Whether a link's parent belongs to the limb that is breaking off.
    fn hangs(&self, first_word: usize, fourth_word: usize) -> bool {
        if first_word & first::ACTIVE == 0 || first_word & first::ROOT != 0 {
            return false;
        }
        self.state(fourth_word >> fourth::PARENT_ROW) & state::BREAKING != 0
    }

    /// Takes the fruit off whose stem was over a limit for long enough.
    fn detach(&mut self) {
        for row in 0..self.world(world::FRUIT).to_bits() as usize {
            let frames = self.fruit(row, fruit::FRAMES_OVER).to_bits();
            let rules = self.memory.rules;
            let is_over = frames & 0xff >= rules.tension_frames || frames >> 8 >= rules.pull_frames;
            if self.read_stem(row).stiffness == 0.0 || !is_over {
                continue;
            }
            // From now on its spin.
            self.set_fruit3(row, fruit::ARM, Vec3::zeros());
            self.set_fruit(row, fruit::CAME_OFF, f32::from_bits(rules.frame));
            self.count(world::DETACHED);
        }
    }
}

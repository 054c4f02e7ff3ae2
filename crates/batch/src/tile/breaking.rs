//! Breaking, detachment and contact with the ground: the rare parts of a step, lane by lane.

use super::{BatchEvent, Tile};
use crate::ground::Prop;
use crate::kernel::Numbers;
use crate::layout::{fruit, fruit_work, limit, link, prop, tip_motion};
use crate::tree_world::TreeEvent;
use orchard_fruit::Release;
use orchard_geometry::Vec3;

impl Tile {
    /// Adds the impulses of the ground on loose fruit and debris over the next substep.
    pub(super) fn meet_ground(&mut self) {
        let lanes = self.lanes;
        let Numbers { fruit, fruit_work, tip_motion, props, .. } = &mut self.numbers;
        let (fruit, fruit_work) = (fruit.as_slice(), fruit_work.as_mut_slice());
        let (tip_motion, props) = (tip_motion.as_slice(), props.as_mut_slice());
        for (lane, world) in self.worlds.iter_mut().enumerate().filter(|(_, world)| world.is_running()) {
            let settings = &world.plant.settings;
            let vector = |from: &[f32], at: usize| Vec3::from_fn(|k, _| f64::from(from[at + k * lanes]));
            for (i, ball) in &mut world.loose {
                let row = world.fruit_row[*i];
                let state = |field: usize| (row * fruit::FIELDS + field) * lanes + lane;
                let left = |field: usize| (row * fruit_work::FIELDS + field) * lanes + lane;
                let inverse_mass = f64::from(fruit_work[left(fruit_work::INVERSE_MASS)]);
                let impulse = vector(fruit_work, left(fruit_work::IMPULSE));
                let v = vector(fruit, state(fruit::V)) + inverse_mass * impulse;
                let z = f64::from(fruit[state(fruit::P + 2)]);
                let impulse = impulse + ball.meet_ground(settings, z, v, inverse_mass);
                for k in 0..3 {
                    fruit_work[left(fruit_work::IMPULSE + k)] = impulse[k] as f32;
                }
            }
            for tip in &mut world.debris {
                let motion = |field: usize| (tip.row * tip_motion::FIELDS + field) * lanes + lane;
                let z = f64::from(tip_motion[motion(tip_motion::Z)]);
                let v = vector(tip_motion, motion(tip_motion::V));
                let lift = f64::from(tip_motion[motion(tip_motion::LIFT)]);
                let Prop { across, normal, impulse } = tip.meet_ground(settings, z, v, lift);
                let numbers = [across, normal, impulse.x, impulse.y, impulse.z];
                for (field, number) in numbers.into_iter().enumerate() {
                    props[(tip.row * prop::FIELDS + field) * lanes + lane] = number as f32;
                }
            }
        }
    }

    /// Friction and brake of broken joints, which follow their rates.
    pub(super) fn brake(&mut self) {
        let lanes = self.lanes;
        let links = self.numbers.links.as_mut_slice();
        for (lane, world) in self.worlds.iter_mut().enumerate().filter(|(_, w)| w.is_braking()) {
            let at = |row: usize, field: usize| (row * link::FIELDS + field) * lanes + lane;
            world.brake(|row| [0, 1].map(|k| f64::from(links[at(row, link::V + k)])));
            for &row in &world.broken_rows {
                let (h, wood) = (world.plant.settings.h, &world.wood[row]);
                links[at(row, link::ARMATURE)] = wood.armature(h) as f32;
                links[at(row, link::H_DAMPING)] = wood.h_damping(h) as f32;
            }
        }
    }

    /// Breaks the joints that were over their rupture moment for long enough.
    pub(super) fn snap(&mut self) {
        let lanes = self.lanes;
        let mut hits: Vec<(usize, usize)> = Vec::new();
        for row in 0..self.numbers.schedule.rows.len() {
            let q = &self.numbers.links.as_slice()[(row * link::FIELDS + link::Q) * lanes..][..2 * lanes];
            let (q_1, q_2) = q.split_at(lanes);
            let limit = &self.numbers.bend_limits.as_slice()[row * lanes..][..lanes];
            let frames = &mut self.bend_frames[row * lanes..][..lanes];
            for lane in 0..lanes {
                let is_over = q_1[lane] * q_1[lane] + q_2[lane] * q_2[lane] > limit[lane];
                frames[lane] = if is_over { frames[lane] + 1 } else { 0 };
            }
            if frames.iter().any(|frames| *frames > 0) {
                self.is_counting = true;
                for (lane, world) in self.worlds.iter().enumerate() {
                    if frames[lane] > 0 && frames[lane] >= world.plant.spec.wood.rupture_frames.get() {
                        hits.push((lane, world.walk.links[row]));
                    }
                }
            }
        }
        hits.sort_unstable();
        for (lane, segment) in hits {
            if !self.worlds[lane].rupture.is_debris(segment) {
                self.break_joint(lane, segment);
            }
        }
    }

    /// Breaks a joint in place, by the rule of the f64 world.
    pub fn break_joint(&mut self, lane: usize, segment: usize) {
        if !self.worlds[lane].is_running() {
            return;
        }
        let mut data = self.worlds[lane].take_shadow();
        self.store(lane, &mut data);
        self.worlds[lane].break_joint(&mut data, segment);
        self.load_wood(lane, &data);
        self.worlds[lane].keep_shadow(data);
        self.expect_debris(lane);
        let world = &self.worlds[lane];
        self.pushes.retain(|push| push.lane != lane || !world.rupture.is_debris(world.walk.links[push.row]));
        let event = TreeEvent::Snapped { segment };
        self.events.push(BatchEvent { frame: self.frame, world: world.index, event });
        self.is_stale = true;
    }

    pub(super) fn expect_debris(&mut self, lane: usize) {
        self.numbers.expect_debris(self.lanes);
        self.worlds[lane].list_debris();
    }

    /// Detaches the fruit whose stem was over a limit for long enough, or has worn out.
    pub(super) fn detach(&mut self) {
        if self.has_stems() {
            return self.take_off_stems();
        }
        let lanes = self.lanes;
        let mut hits = Vec::new();
        for row in 0..self.numbers.schedule.fruit_rows() {
            let stretch = &self.numbers.fruit_work.as_slice()
                [(row * fruit_work::FIELDS + fruit_work::STRETCH) * lanes..][..3 * lanes];
            let force =
                &self.numbers.fruit.as_slice()[(row * fruit::FIELDS + fruit::FORCE) * lanes..][..3 * lanes];
            let square = |v: &[f32], lane: usize| {
                let (x, y, z) = (v[lane], v[lanes + lane], v[2 * lanes + lane]);
                x * x + y * y + z * z
            };
            let limits = &self.numbers.stem_limits.as_slice()[row * limit::FIELDS * lanes..];
            for lane in 0..lanes {
                let at = row * lanes + lane;
                let count = |over: bool, frames: u32| if over { frames + 1 } else { 0 };
                let stretch_is_over = square(stretch, lane) > limits[limit::STRETCH * lanes + lane];
                let pull_is_over = square(force, lane) > limits[limit::PULL * lanes + lane];
                self.stretch_frames[at] = count(stretch_is_over, self.stretch_frames[at]);
                self.pull_frames[at] = count(pull_is_over, self.pull_frames[at]);
                if self.stretch_frames[at] + self.pull_frames[at] > 0 {
                    self.is_counting = true;
                    if self.worlds[lane].is_detached_after(self.pull_frames[at], self.stretch_frames[at]) {
                        hits.push((lane, row));
                    }
                }
            }
        }
        for (lane, row) in hits {
            self.take_off(lane, row, Vec3::zeros(), None);
        }
    }

    /// Takes the fruit of a row off its stem, with an angular velocity [rad/s].
    pub(super) fn take_off(&mut self, lane: usize, row: usize, w_world: Vec3, release: Option<Release>) {
        let Some((i, air_drag)) = self.worlds[lane].loose_fruit(row) else { return };
        for field in [fruit::H_STIFFNESS, fruit::KAPPA, fruit::H_BIAS] {
            *self.fruit_mut(row, field, lane) = 0.0;
        }
        *self.fruit_mut(row, fruit::AIR_DRAG, lane) = air_drag as f32;
        self.shelter(row, lane);
        for field in [limit::STRETCH, limit::PULL] {
            *self.stem_limit_mut(row, field, lane) = f32::INFINITY;
        }
        self.worlds[lane].let_loose(i, w_world);
        let event = TreeEvent::Detached { fruit: i, release };
        self.events.push(BatchEvent { frame: self.frame, world: self.worlds[lane].index, event });
        self.is_stale = true;
    }
}

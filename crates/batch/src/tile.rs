//! As many worlds as a vector has lanes, their numbers side by side.

use crate::isa::Isa;
use crate::kernel::{Phase, Step, Work};
use crate::lane_world::LaneWorld;
use crate::layout::{Aligned, change, fruit, fruit_work, link, load, pose, work};
use crate::schedule::{Schedule, Walk};
use crate::tree_world::{TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_multibody::Data;

/// Constants of a padding link: anything that keeps its pivot away from zero.
const PADDING_STIFFNESS: f32 = 1.0;
/// Mass of a padding fruit: anything but zero.
const PADDING_MASS: f32 = 1.0;

/// What happened, where and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct BatchEvent {
    /// Frame, from 1.
    pub frame: u32,
    /// Index of the world.
    pub world: usize,
    /// What happened.
    pub event: TreeEvent,
}

/// Some worlds, one a lane.
#[derive(Debug, Clone)]
pub(crate) struct Tile {
    isa: Isa,
    lanes: usize,
    pub(crate) schedule: Schedule,
    /// First row of fruit of each row of links, and their number at the end.
    pub(crate) fruit_start: Vec<usize>,
    pub(crate) links: Aligned,
    pub(crate) work: Aligned,
    pub(crate) fruit: Aligned,
    pub(crate) fruit_work: Aligned,
    /// Tips of the forks that are open, and the world frame.
    pub(crate) poses: Aligned,
    pub(crate) loads: Aligned,
    pub(crate) changes: Aligned,
    /// Square of the joint angle that ruptures, by row and lane; infinite where nothing can break.
    bend_limit: Vec<f32>,
    /// Frames in a row over it.
    bend_frames: Vec<u32>,
    /// Square of the stem stretch that detaches, by row of fruit and lane; infinite off the stem.
    stretch_limit: Vec<f32>,
    /// Square of the direct pull that detaches, likewise.
    pull_limit: Vec<f32>,
    /// Frames in a row over either.
    stretch_frames: Vec<u32>,
    pull_frames: Vec<u32>,
    worlds: Vec<LaneWorld>,
    /// External force and torque about the centre of mass, by link.
    pushes: Vec<Push>,
    /// Whether an input has changed since the last outward pass.
    stale: bool,
    step: Step,
    substeps: u32,
    frame: u32,
    events: Vec<BatchEvent>,
}

#[derive(Debug, Clone)]
struct Push {
    row: usize,
    lane: usize,
    force_world: Vec3,
    torque_world: Vec3,
}

impl Tile {
    /// Puts worlds side by side; `indices` are their places in the batch.
    pub fn new(isa: Isa, worlds: &[(usize, &TreeWorld)]) -> Self {
        let lanes = isa.lanes();
        let walks: Vec<Walk> =
            worlds.iter().map(|(_, world)| Walk::depth_first(&world.plant().tree.parent)).collect();
        let schedule = Schedule::new(&walks.iter().collect::<Vec<_>>(), lanes);

        // As many rows of fruit at a row of links as the fullest lane needs.
        let fruit_at: Vec<Vec<Vec<usize>>> =
            worlds.iter().zip(&walks).map(|((_, world), walk)| fruit_by_row(world, walk)).collect();
        let mut fruit_start = vec![0];
        for row in 0..schedule.rows {
            let most = fruit_at.iter().map(|rows| rows.get(row).map_or(0, Vec::len)).max().unwrap_or(0);
            fruit_start.push(fruit_start[row] + most);
        }
        let (rows, fruit_rows, slots) = (schedule.rows, fruit_start[schedule.rows], schedule.slots);
        let spec = &worlds[0].1.plant().spec;
        let numbers = |rows: usize, fields: usize| Aligned::zeros(rows * fields * lanes);
        let mut tile = Tile {
            isa,
            lanes,
            fruit_start,
            links: numbers(rows, link::FIELDS),
            work: numbers(rows, work::FIELDS),
            fruit: numbers(fruit_rows, fruit::FIELDS),
            fruit_work: numbers(fruit_rows, fruit_work::FIELDS),
            poses: numbers(slots, pose::FIELDS),
            loads: numbers(slots, load::FIELDS),
            changes: numbers(slots, change::FIELDS),
            bend_limit: vec![f32::INFINITY; rows * lanes],
            bend_frames: vec![0; rows * lanes],
            stretch_limit: vec![f32::INFINITY; fruit_rows * lanes],
            pull_limit: vec![f32::INFINITY; fruit_rows * lanes],
            stretch_frames: vec![0; fruit_rows * lanes],
            pull_frames: vec![0; fruit_rows * lanes],
            worlds: Vec::new(),
            pushes: Vec::new(),
            stale: true,
            step: Step { h: spec.sim.substep() as f32, gravity: spec.sim.gravity.si() as f32 },
            substeps: spec.sim.substeps.get(),
            frame: 0,
            events: Vec::new(),
            schedule,
        };
        tile.pad();
        for (lane, ((&(index, world), walk), fruit_at)) in worlds.iter().zip(walks).zip(fruit_at).enumerate()
        {
            let mut fruit_row = vec![0; world.plant().fruit.len()];
            for (row, here) in fruit_at.iter().enumerate() {
                for (k, &fruit) in here.iter().enumerate() {
                    fruit_row[fruit] = tile.fruit_start[row] + k;
                }
            }
            tile.worlds.push(LaneWorld::new(index, world, walk, fruit_row));
            tile.load_lane(lane, world);
        }
        tile
    }

    /// Fills every lane with links and fruit that have no effect and never move.
    fn pad(&mut self) {
        for lane in 0..self.lanes {
            for row in 0..self.schedule.rows {
                *self.link_mut(row, link::REST, lane) = 1.0;
                *self.link_mut(row, link::REST + 4, lane) = 1.0;
                *self.link_mut(row, link::STIFFNESS, lane) = PADDING_STIFFNESS;
            }
            for row in 0..self.fruit_start[self.schedule.rows] {
                *self.fruit_mut(row, fruit::MASS, lane) = PADDING_MASS;
            }
            for k in 0..3 {
                let lanes = self.lanes;
                self.poses.as_mut_slice()[(pose::AXES + 4 * k) * lanes + lane] = 1.0;
            }
        }
    }

    /// Constants and state of a world.
    fn load_lane(&mut self, lane: usize, world: &TreeWorld) {
        let plant = world.plant().clone();
        let (model, data, tree) = (&plant.model, world.data(), &plant.tree);
        for row in 0..self.worlds[lane].walk.links.len() {
            let segment = self.worlds[lane].walk.links[row];
            let id = tree.bodies[segment];
            let body = model.body(id);
            let rest = body.x_parent_joint.rotation.to_rotation_matrix();
            for k in 0..6 {
                *self.link_mut(row, link::REST + k, lane) = rest[(k % 3, k / 3)] as f32;
            }
            if body.parent.is_none() {
                let lanes = self.lanes;
                for k in 0..3 {
                    self.poses.as_mut_slice()[(pose::P + k) * lanes + lane] =
                        body.x_parent_joint.translation.vector[k] as f32;
                }
            }
            let i_com = &body.inertia.i_com;
            let constants = [
                (link::LENGTH, 2.0 * body.inertia.p_com.z),
                (link::MASS, body.inertia.mass),
                (link::ACROSS, i_com[(0, 0)]),
                (link::AXIAL_EXCESS, i_com[(2, 2)] - i_com[(0, 0)]),
            ];
            for (field, number) in constants {
                *self.link_mut(row, field, lane) = number as f32;
            }
            let (dof, q) = (model.dofs(id).start, model.qs(id).start);
            for k in 0..2 {
                *self.link_mut(row, link::Q + k, lane) = data.q[q + k] as f32;
                *self.link_mut(row, link::V + k, lane) = data.v[dof + k] as f32;
            }
            let (force_world, torque_world) =
                (data.body_force_world[id.index()], data.body_torque_world[id.index()]);
            if force_world != Vec3::zeros() || torque_world != Vec3::zeros() {
                self.pushes.push(Push { row, lane, force_world, torque_world });
            }
        }
        self.load_wood(lane, data);
        for i in 0..plant.fruit.len() {
            let (row, id) = (self.worlds[lane].fruit_row[i], plant.fruit.points[i]);
            let point = model.point(id);
            let mut constants = vec![
                (fruit::MASS, point.mass),
                (fruit::WEIGHT, point.mass * -plant.settings.gravity.z),
                (fruit::AIR_DRAG, data.point_quadratic_drag[id.index()]),
            ];
            for k in 0..3 {
                constants.push((fruit::FORCE + k, data.point_force_world[id.index()][k]));
                constants.push((fruit::P + k, data.point_p_world[id.index()][k]));
                constants.push((fruit::V + k, data.point_v_world[id.index()][k]));
            }
            if let Some(tether) = point.tether.as_ref().filter(|_| data.tethered[id.index()]) {
                for k in 0..3 {
                    constants.push((fruit::ANCHOR + k, tether.p_body[k]));
                }
                constants.extend([
                    (fruit::DROP, tether.offset_world.z),
                    (fruit::CAP, data.reaction_cap[id.index()]),
                    (fruit::STIFFNESS, tether.stiffness),
                    (fruit::DAMPING, tether.damping),
                    (fruit::BIAS, data.anchor_bias_world[id.index()].z),
                ]);
                let threshold = plant.fruit.fruit[i].detach_force;
                let stretch = plant.spec.fruit.tension_factor.si() * threshold / tether.stiffness;
                self.stretch_limit[row * self.lanes + lane] = (stretch * stretch) as f32;
                self.pull_limit[row * self.lanes + lane] = (threshold * threshold) as f32;
            }
            for (field, number) in constants {
                *self.fruit_mut(row, field, lane) = number as f32;
            }
        }
    }

    /// What breaking changes: springs, dampers, drag, whether wood feels its fruit, and which joints can still break.
    fn load_wood(&mut self, lane: usize, data: &Data) {
        let plant = self.worlds[lane].plant.clone();
        for row in 0..self.worlds[lane].walk.links.len() {
            let segment = self.worlds[lane].walk.links[row];
            let id = plant.tree.bodies[segment];
            let dof = plant.model.dofs(id).start;
            *self.link_mut(row, link::LINEAR_DRAG, lane) = data.linear_drag[id.index()] as f32;
            *self.link_mut(row, link::ANGULAR_DRAG, lane) = data.angular_drag[id.index()] as f32;
            *self.link_mut(row, link::STIFFNESS, lane) = data.stiffness[dof] as f32;
            *self.link_mut(row, link::DAMPING, lane) = data.damping[dof] as f32;
            let limit = plant.tree.rupture_moment[segment] / plant.tree.stiffness[segment];
            self.bend_limit[row * self.lanes + lane] =
                if self.worlds[lane].rupture.is_debris(segment) || plant.tree.parent[segment].is_none() {
                    f32::INFINITY
                } else {
                    (limit * limit) as f32
                };
        }
        for (i, point) in plant.fruit.points.iter().enumerate() {
            if data.tethered[point.index()] {
                let row = self.worlds[lane].fruit_row[i];
                *self.fruit_mut(row, fruit::BIAS, lane) = data.anchor_bias_world[point.index()].z as f32;
                *self.fruit_mut(row, fruit::CAP, lane) = data.reaction_cap[point.index()] as f32;
            }
        }
    }

    /// Writes the state of a lane's world, and what breaking and detachment have changed.
    pub fn store(&self, lane: usize, data: &mut Data) {
        let world = &self.worlds[lane];
        let plant = &world.plant;
        for (row, &segment) in world.walk.links.iter().enumerate() {
            let id = plant.tree.bodies[segment];
            let number = |field: usize| f64::from(self.link(row, field, lane));
            for k in 0..2 {
                data.q[plant.model.qs(id).start + k] = number(link::Q + k);
                let dof = plant.model.dofs(id).start + k;
                data.v[dof] = number(link::V + k);
                data.stiffness[dof] = number(link::STIFFNESS);
                data.damping[dof] = number(link::DAMPING);
            }
            data.linear_drag[id.index()] = number(link::LINEAR_DRAG);
            data.angular_drag[id.index()] = number(link::ANGULAR_DRAG);
        }
        for (i, &row) in world.fruit_row.iter().enumerate() {
            let point = plant.fruit.points[i].index();
            let vector = |field: usize| Vec3::from_fn(|k, _| f64::from(self.fruit(row, field + k, lane)));
            data.point_p_world[point] = vector(fruit::P);
            data.point_v_world[point] = vector(fruit::V);
            data.point_quadratic_drag[point] = f64::from(self.fruit(row, fruit::AIR_DRAG, lane));
            data.tethered[point] = self.is_hanging(row, lane);
        }
        plant.fruit.weigh_on(data, |segment| world.rupture.is_debris(segment));
    }

    fn is_hanging(&self, fruit_row: usize, lane: usize) -> bool {
        self.pull_limit[fruit_row * self.lanes + lane].is_finite()
    }

    /// Sets the external force [N] and torque [N m] on a link, at and about its centre of mass.
    pub fn push(&mut self, lane: usize, segment: usize, force_world: Vec3, torque_world: Vec3) {
        let Some(row) = self.worlds[lane].walk.links.iter().position(|link| *link == segment) else { return };
        self.pushes.retain(|push| (push.row, push.lane) != (row, lane));
        if !self.worlds[lane].rupture.is_debris(segment) {
            self.pushes.push(Push { row, lane, force_world, torque_world });
        }
        self.stale = true;
    }

    /// Sets the external force on a fruit [N].
    pub fn pull(&mut self, lane: usize, fruit_index: usize, force_world: Vec3) {
        let row = self.worlds[lane].fruit_row[fruit_index];
        for k in 0..3 {
            *self.fruit_mut(row, fruit::FORCE + k, lane) = force_world[k] as f32;
        }
        self.stale = true;
    }

    /// Advances all worlds by whole frames.
    pub fn run(&mut self, frames: u32) {
        for _ in 0..frames {
            for _ in 0..self.substeps {
                if self.stale {
                    self.outward();
                }
                self.brake();
                self.work(Phase::Solve);
                self.outward();
            }
            self.frame += 1;
            self.snap();
            self.detach();
        }
    }

    fn work(&mut self, phase: Phase) {
        let (isa, step) = (self.isa, self.step);
        isa.run(Work { tile: self, step, phase });
    }

    /// Kinematics and impulses of the present state and inputs.
    fn outward(&mut self) {
        self.work(Phase::Outward);
        self.stale = false;
        let (lanes, h) = (self.lanes, self.step.h);
        for push in &self.pushes {
            let half = 0.5 * f64::from(self.link(push.row, link::LENGTH, push.lane));
            let work = self.work.as_mut_slice();
            let at = |field: usize| (push.row * work::FIELDS + field) * lanes + push.lane;
            let r_com = Vec3::from_fn(|k, _| half * f64::from(work[at(work::Z + k)]));
            let torque = push.torque_world + r_com.cross(&push.force_world);
            for k in 0..3 {
                work[at(work::IMPULSE + k)] += h * torque[k] as f32;
                work[at(work::IMPULSE + 3 + k)] += h * push.force_world[k] as f32;
            }
        }
    }

    /// Friction and brake of broken joints, which follow their rates.
    fn brake(&mut self) {
        for lane in 0..self.worlds.len() {
            if self.worlds[lane].rupture.breaks().is_empty() {
                continue;
            }
            let rates: Vec<(usize, [f64; 2])> = self.worlds[lane]
                .broken_rows()
                .map(|row| (row, [0, 1].map(|k| f64::from(self.link(row, link::V + k, lane)))))
                .collect();
            for (row, damping) in self.worlds[lane].brake(&rates) {
                *self.link_mut(row, link::DAMPING, lane) = damping as f32;
            }
        }
    }

    /// Breaks the joints that were over their rupture moment for long enough.
    fn snap(&mut self) {
        let lanes = self.lanes;
        let mut hits: Vec<(usize, usize)> = Vec::new();
        for row in 0..self.schedule.rows {
            let q = &self.links.as_slice()[(row * link::FIELDS + link::Q) * lanes..][..2 * lanes];
            let (q_1, q_2) = q.split_at(lanes);
            let limit = &self.bend_limit[row * lanes..][..lanes];
            let frames = &mut self.bend_frames[row * lanes..][..lanes];
            for lane in 0..lanes {
                let is_over = q_1[lane] * q_1[lane] + q_2[lane] * q_2[lane] > limit[lane];
                frames[lane] = if is_over { frames[lane] + 1 } else { 0 };
            }
            if frames.iter().any(|frames| *frames > 0) {
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
        let mut data = self.worlds[lane].take_shadow();
        self.store(lane, &mut data);
        self.worlds[lane].break_joint(&mut data, segment);
        self.load_wood(lane, &data);
        self.worlds[lane].keep_shadow(data);
        let world = &self.worlds[lane];
        self.pushes.retain(|push| push.lane != lane || !world.rupture.is_debris(world.walk.links[push.row]));
        let event = TreeEvent::Snapped { segment };
        self.events.push(BatchEvent { frame: self.frame, world: world.index, event });
        self.stale = true;
    }

    /// Takes the fruit off whose stem was pulled too hard for long enough.
    fn detach(&mut self) {
        let lanes = self.lanes;
        let mut hits = Vec::new();
        for row in 0..self.fruit_start[self.schedule.rows] {
            let stretch = &self.fruit_work.as_slice()
                [(row * fruit_work::FIELDS + fruit_work::STRETCH) * lanes..][..3 * lanes];
            let force = &self.fruit.as_slice()[(row * fruit::FIELDS + fruit::FORCE) * lanes..][..3 * lanes];
            let square = |v: &[f32], lane: usize| {
                let (x, y, z) = (v[lane], v[lanes + lane], v[2 * lanes + lane]);
                x * x + y * y + z * z
            };
            for lane in 0..lanes {
                let at = row * lanes + lane;
                let count = |over: bool, frames: u32| if over { frames + 1 } else { 0 };
                let stretch_is_over = square(stretch, lane) > self.stretch_limit[at];
                let pull_is_over = square(force, lane) > self.pull_limit[at];
                self.stretch_frames[at] = count(stretch_is_over, self.stretch_frames[at]);
                self.pull_frames[at] = count(pull_is_over, self.pull_frames[at]);
                if self.stretch_frames[at] + self.pull_frames[at] > 0
                    && self.worlds[lane].is_detached_after(self.pull_frames[at], self.stretch_frames[at])
                {
                    hits.push((lane, row));
                }
            }
        }
        for (lane, row) in hits {
            let Some((i, air_drag)) = self.worlds[lane].loose_fruit(row) else { continue };
            for field in [fruit::STIFFNESS, fruit::DAMPING, fruit::BIAS] {
                *self.fruit_mut(row, field, lane) = 0.0;
            }
            *self.fruit_mut(row, fruit::AIR_DRAG, lane) = air_drag as f32;
            self.stretch_limit[row * lanes + lane] = f32::INFINITY;
            self.pull_limit[row * lanes + lane] = f32::INFINITY;
            let event = TreeEvent::Detached { fruit: i };
            self.events.push(BatchEvent { frame: self.frame, world: self.worlds[lane].index, event });
            self.stale = true;
        }
    }

    /// Takes the events since the last call.
    pub fn drain_events(&mut self) -> std::vec::Drain<'_, BatchEvent> {
        self.events.drain(..)
    }

    /// Bytes of the tile's numbers.
    pub fn bytes(&self) -> usize {
        let floats =
            [&self.links, &self.work, &self.fruit, &self.fruit_work, &self.poses, &self.loads, &self.changes];
        let limits = self.bend_limit.len() * 2 + self.stretch_limit.len() * 4;
        size_of::<f32>() * (floats.iter().map(|part| part.as_slice().len()).sum::<usize>() + limits)
    }

    fn link(&self, row: usize, field: usize, lane: usize) -> f32 {
        self.links.as_slice()[(row * link::FIELDS + field) * self.lanes + lane]
    }

    fn link_mut(&mut self, row: usize, field: usize, lane: usize) -> &mut f32 {
        &mut self.links.as_mut_slice()[(row * link::FIELDS + field) * self.lanes + lane]
    }

    fn fruit(&self, row: usize, field: usize, lane: usize) -> f32 {
        self.fruit.as_slice()[(row * fruit::FIELDS + field) * self.lanes + lane]
    }

    fn fruit_mut(&mut self, row: usize, field: usize, lane: usize) -> &mut f32 {
        &mut self.fruit.as_mut_slice()[(row * fruit::FIELDS + field) * self.lanes + lane]
    }
}

/// The fruit of each row of a world's walk.
fn fruit_by_row(world: &TreeWorld, walk: &Walk) -> Vec<Vec<usize>> {
    let mut by_segment = vec![Vec::new(); walk.links.len()];
    for (i, fruit) in world.plant().fruit.fruit.iter().enumerate() {
        by_segment[fruit.segment].push(i);
    }
    walk.links.iter().map(|segment| std::mem::take(&mut by_segment[*segment])).collect()
}

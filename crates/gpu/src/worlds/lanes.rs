//! Lanes: places of a batch in which worlds come and go. Their rules are applied elsewhere; the device moves them.

use std::sync::Arc;

use orchard_batch::{Plant, StemMotion, TreeWorld};
use orchard_geometry::{Pose, Vec3};
use orchard_multibody::{Data, Model};
use orchard_robot::{RobotHandle, RobotModel, SetPoints, Suction};
use rayon::prelude::*;

use super::meeting::Meeting;
use super::quads::Gathered;
use super::scatter::{Parcel, scatter};
use super::table::stand_alike;
use super::told::{Course, News, Question, Told, Wish};
use super::{SUBSTEP, WorldBatch, check, timed};
use crate::BatchError;
use crate::batch::encode_each;
use crate::clock::Clock;
use crate::device::{Gpu, GpuError};
use crate::laws::Laws;
use crate::layout::{QUAD, meeting, robot, system};
use crate::memory::{PlacedQuad, Room};
use crate::robots::cup::suction;
use crate::robots::exchange::set_points;
use crate::robots::{RobotBatch, Surroundings, row_place};
use crate::rules::Rules;
use crate::schedule::Schedule;

/// Frame in which an empty lane counts as stopped.
const NEVER_RAN: u32 = 1;

/// The order in which the links of a tree are computed, from [`WorldBatch::fitted`].
#[derive(Debug, Clone)]
pub struct Fitted(pub(super) Arc<Schedule>);

/// A world that comes into a lane.
#[derive(Debug, Clone, Copy)]
pub struct Tenant<'a> {
    /// The lane.
    pub lane: usize,
    /// True if its tree stands in the lane already, and only its state has changed.
    pub is_back: bool,
    /// Tree and fruit in their present state.
    pub tree: &'a TreeWorld,
    /// The order of its links.
    pub fitted: &'a Fitted,
    /// Pose of the odom frame at the start.
    pub x_world_odom: &'a Pose,
    /// Model, robot and state: that of the robot is taken.
    pub model: &'a Model,
    /// The robot's parts in it.
    pub handle: &'a RobotHandle,
    /// The present state.
    pub data: &'a Data,
    /// The state at the start of the episode, by which loads of the wood are counted.
    pub start: &'a Data,
    /// Set points of the robot's servos.
    pub set_points: &'a SetPoints,
    /// Vacuum of its suction cup; the default without a cup.
    pub suction: &'a Suction,
}

/// Numbers read from the device after the frames of a course. Those of robots are in two sections, lane by lane: servos and then losses of the joints; states. Those of trees are in [`Told`].
#[derive(Debug)]
pub(super) struct Read {
    robots: Gathered,
    trees: Told,
    /// The reading under way.
    asked: Option<wgpu::SubmissionIndex>,
}

const DRIVES: usize = 0;
const ROBOTS: usize = 1;

/// Quads of a lane in these sections.
const DRIVE: usize = 2 * robot::DOFS;
const ROBOT: usize = robot::FIELDS / QUAD;

fn are_alike(one: &Plant, other: &Plant) -> bool {
    Rules::of(one) == Rules::of(other)
        && Laws::of(one) == Laws::of(other)
        && stand_alike(&one.model, &other.model)
}

impl WorldBatch {
    /// Creates lanes, all empty, for worlds like a sample, whose trees have no more than a size, and that take at most so many frames at a time. [`Self::plant`] puts worlds into them. Then the device computes motion and contacts; breaking of wood and detachment of fruit
    /// are left to the caller, who gives the worlds their next frames ([`Self::advance_lanes`]) and reads the motion that came of them ([`Self::fetch`]).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_lanes(
        gpu: &Gpu,
        room: Room,
        sample: &TreeWorld,
        robot: &RobotModel,
        lanes: usize,
        frames: usize,
    ) -> Result<Self, GpuError> {
        let trees = vec![sample.clone(); lanes];
        let starts = vec![Pose::identity(); lanes];
        let motion = Laws::of(sample.plant()).fruit_motion().len();
        let each = [room.links(), room.fruit(), motion, frames];
        let mut batch = Self::in_room(gpu, &trees, robot, &starts, room, frames)?;
        let (of_trees, meetings) = (&batch.trees.buffers, &batch.buffers.meetings);
        let sections = [(meetings, lanes * DRIVE), (&batch.robots.buffers.robots, lanes * ROBOT)];
        let read = Gathered::new(gpu, &sections, frames);
        let told = [&batch.buffers.tables, meetings, &of_trees.worlds, &of_trees.links, &of_trees.fruit];
        let trees = Told::new(gpu, lanes, each, told)?;
        let drives = (0..lanes).flat_map(|lane| {
            let fields = (0..DRIVE).map(|k| system::SERVO + QUAD * k);
            fields.map(move |field| (row_place(lane, field, system::FIELDS) / QUAD) as u32)
        });
        read.set_places(gpu, DRIVES, 0, &drives.collect::<Vec<_>>());
        let robots = (0..lanes).flat_map(RobotBatch::quad_places);
        read.set_places(gpu, ROBOTS, 0, &robots.collect::<Vec<_>>());
        batch.read = Some(Read { robots: read, trees, asked: None });
        (0..lanes).for_each(|lane| batch.retire(lane));
        Ok(batch)
    }

    /// True if two worlds with the same robot may be in lanes of one batch: they have the same rules, and the same posts and wires.
    pub fn may_share(one: &TreeWorld, other: &TreeWorld) -> bool {
        are_alike(one.plant(), other.plant())
    }

    /// The order of the links of a tree; `None` if the lanes have no room for it.
    ///
    /// # Errors
    /// The kernels cannot step it.
    pub fn fitted(&self, tree: &TreeWorld, x_world_odom: &Pose) -> Result<Option<Fitted>, GpuError> {
        let plant = tree.plant();
        check(plant, x_world_odom).map_err(|why| BatchError::World { world: 0, why })?;
        if !are_alike(plant, &self.trees.plants[0]) {
            return Err(BatchError::Rules { world: 0 }.into());
        }
        let schedule = self.trees.memory.schedule(tree)?;
        let size = Room::of(&schedule, plant);
        Ok(self.room.holds(&size).then_some(Fitted(schedule)))
    }

    /// Puts worlds into their lanes, in the place of what was there. The other lanes go on as they were, and nothing waits for the device.
    pub fn plant(&mut self, tenants: &[Tenant<'_>]) {
        let (back, new): (Vec<Tenant<'_>>, Vec<_>) = tenants.iter().partition(|tenant| tenant.is_back);
        let Some(read) = &self.read else { panic!("the batch has no lanes") };
        let mut trees = Vec::new();
        if !new.is_empty() {
            let memory = &self.trees.memory;
            let seedling =
                |of: &Tenant<'_>| (of.lane, memory.seedling(of.lane, of.tree, &of.fitted.0, of.start));
            trees = self.trees.plant(new.par_iter().map(seedling).collect());
        }
        for tenant in &new {
            self.trees.plants[tenant.lane] = tenant.tree.plant().clone();
        }
        let (memory, table) = (&self.trees.memory, &self.table);
        let told = |&Tenant { lane, tree, x_world_odom, .. }: &Tenant<'_>| {
            let own = table.places_of(memory, lane, tree.plant(), x_world_odom);
            (own, read.trees.places_of(lane, memory.motion_quads(lane)))
        };
        let (tables, asked): (Vec<_>, Vec<_>) = new.par_iter().map(told).unzip();
        for tenant in &back {
            trees.push(self.trees.memory.resume(tenant.lane, tenant.tree, tenant.start));
            self.trees.send_flags(tenant.lane);
        }
        let (mut robots, mut meetings) = (Vec::new(), Vec::new());
        for tenant in tenants {
            let Tenant { lane, model, handle, data, set_points, suction, .. } = *tenant;
            self.robots.load(lane, model, handle, data, set_points, suction);
            robots.extend(self.robots.state_quads(lane).map(|(at, quad)| PlacedQuad::new(at, quad)));
            let record = (self.table.records + lane * self.table.record) / QUAD;
            let own = record as u32..(record + meeting::FIELDS / QUAD) as u32;
            meetings.extend(own.map(|at| PlacedQuad::new(at, [0_u32; QUAD])));
        }
        let others = [
            Parcel::quads(&self.buffers.tables, tables.iter()),
            Parcel::words(read.trees.asked(), asked.iter()),
            Parcel::quads(&self.robots.buffers.robots, std::iter::once(&robots)),
            Parcel::quads(&self.buffers.meetings, std::iter::once(&meetings)),
        ];
        let parcels: Vec<_> = self.trees.parcels(&trees).into_iter().chain(others).collect();
        scatter(&self.gpu, &mut self.sent, &parcels);
    }

    /// Empties a lane.
    pub fn retire(&mut self, lane: usize) {
        self.trees.stop(lane, NEVER_RAN);
    }

    /// Submits frames of the worlds in lanes, one course a lane, and the reading of what came of them, and returns at once. A world whose course has no frames stands still; its motion is read as it is unless it wishes for news only. Nothing is submitted if nothing is to be done.
    ///
    /// # Errors
    /// A command is for another number of arm joints.
    ///
    /// # Panics
    /// There is not one course a lane, one is too long, or the batch has no lanes.
    pub fn advance_lanes(&mut self, courses: &[Course<'_>]) -> Result<(), GpuError> {
        let around = |course: &Course<'_>| Surroundings { climb: course.climb, under_lip: course.under_lip };
        let commands: Vec<_> = courses.iter().map(|course| (course.commands, around(course))).collect();
        self.robots.command_frames(&commands)?;
        let question = |course: &Course<'_>| Question { frames: course.commands.len(), wish: course.wish };
        self.submit(courses.iter().map(question).collect(), true);
        Ok(())
    }

    /// Submits the reading of the motion of some lanes' trees as they stand.
    ///
    /// # Panics
    /// There is not one flag a lane, or the batch has no lanes.
    pub fn ask(&mut self, lanes: &[bool]) {
        let wish = |is_asked: bool| if is_asked { Wish::Last } else { Wish::News };
        self.submit(
            lanes.iter().map(|&is_asked| Question { frames: 0, wish: wish(is_asked) }).collect(),
            false,
        );
    }

    /// Submits questions and their answers, with frames before them if `advances`.
    fn submit(&mut self, questions: Vec<Question>, advances: bool) {
        assert_eq!(questions.len(), self.len(), "there is one course a lane");
        self.trees.send_inputs();
        self.robots.send_inputs();
        let Some(mut read) = self.read.take() else { panic!("the batch has no lanes") };
        let given: Vec<usize> = questions.iter().map(|question| question.frames).collect();
        let frames = read.trees.ask(&self.gpu, questions, self.trees.memory.missed());
        let most = self.buffers.bindings.len();
        assert!(frames <= most, "a course has {frames} frames, more than {most}");
        if frames > 0 {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let mut clock = self.clock.take();
            if advances {
                self.send_rules(frames as u32);
                for (lane, own) in given.into_iter().enumerate() {
                    self.trees.memory.stand_still(lane, (frames - own) as u32);
                }
            }
            read.trees.encode_give(&self.gpu, &mut encoder, &mut clock);
            for frame in 0..frames {
                if advances {
                    self.encode_frame(&mut encoder, frame, &mut clock);
                }
                read.robots.encode(&self.gpu, &mut encoder, frame, &mut clock);
                read.trees.encode_tell(&self.gpu, &mut encoder, &mut clock);
            }
            read.trees.encode_copy(&mut encoder);
            read.asked = Some(self.gpu.queue.submit([encoder.finish()]));
            read.robots.map(frames);
            read.trees.map();
            self.clock = clock;
            if let Some(clock) = &mut self.clock {
                clock.ask(&self.gpu);
            }
        }
        self.read = Some(read);
    }

    /// Encodes the passes of a frame, whose rules were sent with those of the frames around it.
    fn encode_frame(&self, encoder: &mut wgpu::CommandEncoder, frame: usize, clock: &mut Option<Clock>) {
        let substeps = self.trees.memory.rules.substeps as usize;
        // Ruptures and detachments are left to the caller.
        let passes = (0..substeps).map(|_| &SUBSTEP[..SUBSTEP.len() - 1]);
        let dispatch =
            |pass: &mut wgpu::ComputePass<'_>, rules: u32, kind| self.dispatch(pass, rules, kind, frame);
        encode_each(encoder, frame * substeps, passes, &dispatch, &mut timed(clock));
    }

    /// Waits until the answers are there, without reading them.
    ///
    /// # Errors
    /// The device was lost.
    pub fn await_answers(&self) -> Result<(), GpuError> {
        let asked = self.read.as_ref().and_then(|read| read.asked.clone());
        asked.map_or(Ok(()), |asked| self.gpu.wait_for(Some(asked)))
    }

    /// Waits for the answers to [`Self::advance_lanes`] or [`Self::ask`]; frames of other batches that were submitted behind them go on.
    ///
    /// # Errors
    /// The device was lost.
    pub fn fetch(&mut self) -> Result<(), GpuError> {
        self.await_answers()?;
        let Some(read) = &mut self.read else { return Ok(()) };
        if read.asked.take().is_some() {
            read.robots.take(read.trees.frames())?;
            read.trees.fetch(&self.gpu)?;
        }
        if let Some(clock) = &mut self.clock {
            clock.fetch(&self.gpu)?;
        }
        Ok(())
    }

    /// News of a lane after a frame of its course that it took, from 0, as [`Self::fetch`] read it.
    pub fn news(&self, lane: usize, frame: usize) -> News {
        self.read.as_ref().map(|read| read.trees.news(lane, frame)).unwrap_or_default()
    }

    /// Writes the motion of a lane's robot after a frame of its course, as [`Self::fetch`] read it, with the efforts of its servos, into the state of the model from which its world came. Returns the set points of its servos.
    ///
    /// # Panics
    /// The batch has no lanes.
    pub fn store_driven(
        &self,
        (lane, frame): (usize, usize),
        model: &Model,
        handle: &RobotHandle,
        data: &mut Data,
    ) -> SetPoints {
        let Some(read) = &self.read else { panic!("the batch has no lanes") };
        let state = &read.robots.section(frame, ROBOTS)[lane * ROBOT..][..ROBOT];
        let number = |field: usize| state[field / QUAD][field % QUAD];
        self.robots.alone.store(number, model, handle, data);
        let own = &self.robots.alone.model;
        let drives = &read.robots.section(frame, DRIVES)[lane * DRIVE..][..DRIVE];
        let (servos, losses) = drives.split_at(robot::DOFS);
        for (id, &body) in own.body_ids().zip(&handle.bodies) {
            for (dof, to) in own.dofs(id).zip(model.dofs(body)) {
                let [servo, loss] = [servos[dof], losses[dof]].map(|quad| quad.map(f64::from));
                data.stiffness[to] = servo[0];
                data.damping[to] = servo[1] + loss[1] + loss[2] / orchard_robot::Drivetrain::CREEP;
                data.rest[to] = servo[2];
                data.torque[to] = servo[3] + loss[0];
            }
        }
        set_points(number, handle)
    }

    /// Vacuum of the suction cup of a lane's robot after a frame of its course, as [`Self::fetch`] read it.
    pub fn suction(&self, lane: usize, frame: usize) -> Suction {
        let number = |state: &[[f32; QUAD]], field: usize| state[field / QUAD][field % QUAD];
        let read =
            self.read.as_ref().map(|read| &read.robots.section(frame, ROBOTS)[lane * ROBOT..][..ROBOT]);
        read.map_or_else(Suction::default, |state| suction(|field| number(state, field)))
    }

    /// Writes the motion of a lane's tree after a frame of its course, of the wood and of the fruit that hang in `data` or are in the hand, into the state of its model. Returns its contacts, with counts and loads since the world came; `None` if the motion was not read.
    pub fn store_whole(
        &self,
        (lane, frame): (usize, usize),
        model: &Model,
        data: &mut Data,
    ) -> Option<Meeting> {
        let whole = self.read.as_ref()?.trees.whole(lane, frame)?;
        let plant = &self.trees.plants[lane];
        for (&id, motion) in plant.tree.bodies.iter().zip(whole.links) {
            let (dof, q) = (model.dofs(id).start, model.qs(id).start);
            for k in 0..2 {
                data.q[q + k] = f64::from(motion[k]);
                data.v[dof + k] = f64::from(motion[2 + k]);
            }
        }
        let vector = |quad: &[f32; QUAD]| Vec3::from_fn(|k, _| f64::from(quad[k]));
        let motions = whole.fruit.chunks_exact(self.trees.memory.laws.fruit_motion().len());
        for (i, (id, motion)) in plant.fruit.points.iter().zip(motions).enumerate() {
            let at = id.index();
            if let [rotation, rate, _] = &motion[3..] {
                StemMotion::store(plant, data, i, rotation.map(f64::from), vector(rate));
            }
            if !data.point_carried[at] {
                data.point_p_world[at] = vector(&motion[0]);
                data.point_v_world[at] = vector(&motion[1]);
                if !data.tethered[at] {
                    data.point_w_world[at] = vector(&motion[2]);
                }
            }
        }
        Some(Meeting::of(whole.record.as_flattened(), self.trees.memory.rules.h))
    }

    /// Wear of the stems of a lane, of zone and spur, as [`Self::store_whole`] has their motion; none on tethers, or if the motion was not read.
    pub fn stem_wear(&self, lane: usize, frame: usize) -> impl Iterator<Item = [f64; 2]> {
        let whole = self.read.as_ref().and_then(|read| read.trees.whole(lane, frame));
        let motions = whole.map_or(&[][..], |whole| whole.fruit);
        let motions = motions.chunks_exact(self.trees.memory.laws.fruit_motion().len());
        motions.filter_map(|motion| match motion[3..] {
            [_, [.., zone], [.., spur]] => Some([zone, spur].map(f64::from)),
            _ => None,
        })
    }

    /// Velocities of the fruit of a lane a frame before those of [`Self::store_whole`] [m/s, world]; none if the motion was not read.
    pub fn fruit_before(&self, lane: usize, frame: usize) -> impl Iterator<Item = Vec3> {
        let whole = self.read.as_ref().and_then(|read| read.trees.whole(lane, frame));
        let before = whole.map_or(&[][..], |whole| whole.before);
        before.iter().map(|quad| Vec3::from_fn(|k, _| f64::from(quad[k])))
    }
}

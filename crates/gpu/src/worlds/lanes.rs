//! Lanes: places of a batch in which worlds come and go. Their rules are applied elsewhere; the device moves them.

use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_geometry::Pose;
use orchard_multibody::{Data, Model};
use orchard_robot::{RobotHandle, RobotModel, SetPoints};

use super::meeting::Meeting;
use super::{WorldBatch, check};
use crate::BatchError;
use crate::device::{Gpu, GpuError};
use crate::layout::{LANES, meeting, system};
use crate::memory::{Room, quad_at};
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
    /// Set points of the robot's servos.
    pub set_points: &'a SetPoints,
}

/// What was read from the device after the latest frame.
#[derive(Debug, Default)]
pub(super) struct Read {
    /// Beginnings of the records of contacts, one a lane.
    records: Vec<f32>,
    /// Servos and losses of the robots' joints, by block.
    drives: Vec<f32>,
}

/// Fields of servos and losses of a block of robots.
const DRIVES: std::ops::Range<usize> = system::SERVO..system::LINK;

impl WorldBatch {
    /// Creates lanes, all empty, for worlds like a sample, whose trees have no more than a size. [`Self::plant`] puts worlds into them. Then the device computes motion and contacts; breaking of wood and detachment of fruit
    /// are left to the caller, who reads the motion after every frame ([`Self::fetch`]).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_lanes(
        gpu: &Gpu,
        room: Room,
        sample: &TreeWorld,
        robot: &RobotModel,
        lanes: usize,
    ) -> Result<Self, GpuError> {
        let trees = vec![sample.clone(); lanes];
        let starts = vec![Pose::identity(); lanes];
        let mut batch = Self::in_room(gpu, &trees, robot, &starts, room)?;
        batch.judges = false;
        (0..lanes).for_each(|lane| batch.retire(lane));
        Ok(batch)
    }

    /// The order of the links of a tree; `None` if the lanes have no room for it.
    ///
    /// # Errors
    /// The kernels cannot step it.
    pub fn fitted(&self, tree: &TreeWorld, x_world_odom: &Pose) -> Result<Option<Fitted>, GpuError> {
        let plant = tree.plant();
        check(plant, x_world_odom).map_err(|why| BatchError::World { world: 0, why })?;
        if Rules::of(plant) != Rules::of(&self.trees.plants[0]) {
            return Err(BatchError::Rules { world: 0 }.into());
        }
        let schedule = self.trees.memory.schedule(tree)?;
        let size = Room::of(&schedule, &plant.tree.parent);
        Ok(self.room.holds(&size).then_some(Fitted(schedule)))
    }

    /// Puts worlds into their lanes, in the place of what was there. The other lanes go on as they were.
    ///
    /// # Errors
    /// The device was lost.
    pub fn plant(&mut self, tenants: &[Tenant<'_>]) -> Result<(), GpuError> {
        let lanes: Vec<usize> = tenants.iter().map(|tenant| tenant.lane).collect();
        if lanes.is_empty() {
            return Ok(());
        }
        self.trees.change(&lanes, |memory| {
            for tenant in tenants {
                memory.plant(tenant.lane, tenant.tree, &tenant.fitted.0);
            }
        })?;
        self.robots.fetch_all()?;
        let queue = &self.gpu.queue;
        let zeros = [0.0_f32; meeting::FIELDS];
        for tenant in tenants {
            let Tenant { lane, tree, x_world_odom, model, handle, data, set_points, .. } = *tenant;
            self.trees.plants[lane] = tree.plant().clone();
            self.robots.load(lane, model, handle, data, set_points);
            let (at, count) = self.table.plant(&self.trees.memory, lane, tree.plant(), x_world_odom);
            let words = &self.table.words[at..at + count];
            queue.write_buffer(&self.buffers.tables, 4 * at as u64, bytemuck::cast_slice(words));
            let record = 4 * (self.table.records + lane * self.table.record) as u64;
            queue.write_buffer(&self.buffers.meetings, record, bytemuck::cast_slice(&zeros));
        }
        self.robots.send_states(&lanes);
        Ok(())
    }

    /// Empties a lane.
    pub fn retire(&mut self, lane: usize) {
        self.trees.stop(lane, NEVER_RAN);
    }

    /// Reads the motion of all lanes, after waiting for all frames.
    ///
    /// # Errors
    /// The device was lost.
    pub fn fetch(&mut self) -> Result<(), GpuError> {
        self.trees.fetch_motion()?;
        self.robots.fetch_all()?;
        let records = (0..self.len()).map(|lane| {
            let first = self.table.records + lane * self.table.record;
            (&self.buffers.meetings, first..first + Meeting::NUMBERS)
        });
        self.read.records = self.gpu.read(&records.collect::<Vec<_>>())?;
        let each = system::FIELDS * LANES;
        let drives = (0..self.len().div_ceil(LANES)).map(|block| {
            let first = block * each;
            (&self.buffers.meetings, first + DRIVES.start * LANES..first + DRIVES.end * LANES)
        });
        self.read.drives = self.gpu.read(&drives.collect::<Vec<_>>())?;
        Ok(())
    }

    /// Writes the motion that [`Self::fetch`] read, of the wood, of the fruit that hang in `data` and of the robot, with the efforts of its servos, into the state of the model from which a lane's world came. Returns the set points of its servos.
    pub fn store(&self, lane: usize, model: &Model, handle: &RobotHandle, data: &mut Data) -> SetPoints {
        self.trees.memory.store_motion(lane, &self.trees.plants[lane], data);
        self.robots.store_fetched(lane, model, handle, data);
        let own = &self.robots.alone.model;
        let number = |dof: usize, field: usize| {
            let at = (field - DRIVES.start) + 4 * dof;
            let block = lane / LANES * DRIVES.len() * LANES;
            move |k: usize| f64::from(self.read.drives[block + quad_at(at + k, lane % LANES)])
        };
        for (id, &body) in own.body_ids().zip(&handle.bodies) {
            for (dof, to) in own.dofs(id).zip(model.dofs(body)) {
                let (servo, loss) = (number(dof, system::SERVO), number(dof, system::LOSS));
                data.stiffness[to] = servo(0);
                data.damping[to] = servo(1) + loss(1) + loss(2) / orchard_robot::Drivetrain::CREEP;
                data.rest[to] = servo(2);
                data.torque[to] = servo(3) + loss(0);
            }
        }
        self.robots.set_points(lane, handle)
    }

    /// Contacts of a lane's world that [`Self::fetch`] read. Counts and loads are those since the world came.
    pub fn contacts(&self, lane: usize) -> Meeting {
        let numbers = &self.read.records[lane * Meeting::NUMBERS..(lane + 1) * Meeting::NUMBERS];
        Meeting::of(numbers, self.trees.memory.rules.h)
    }
}

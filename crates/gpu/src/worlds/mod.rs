//! Batches of whole worlds: in each a tree with its fruit, and a robot that touches them.

mod buffers;
mod lanes;
mod meeting;
pub(crate) mod pipelines;
mod quads;
mod scatter;
mod table;
mod told;

use std::collections::BTreeMap;

use orchard_batch::{BatchEvent, Plant, Status, TreeWorld};
use orchard_geometry::{Pose, Vec3};
use orchard_multibody::{Data, Model};
use orchard_robot::{Command, RobotHandle, RobotModel};

use crate::BatchError;
use crate::batch::{GpuBatch, Options, Statistics};
use crate::clock::{Clock, Timed};
use crate::device::{Gpu, GpuError};
use crate::layout::{self, LANES, QUAD, place};
use crate::memory::Room;
use crate::pipelines::Pass;
use crate::robots::RobotBatch;
use crate::robots::table::{Table, refused};
use crate::rules::Rules;
use buffers::WorldBuffers;
use lanes::Read;
pub use lanes::{Fitted, Tenant};
pub use meeting::{ContactPoint, Meeting};
use pipelines::WorldPass;
pub(crate) use scatter::Parcel;
use scatter::Records;
pub use table::world_colliders;
use table::{WorldTable, desks, overlaps, stand_alike};
pub use told::{Course, News, Wish};

/// Largest tilt of an odom frame: its z axis is as near to the vertical as rounding allows.
const UPRIGHT: f64 = 1e-9;

/// Worlds on level ground, each with a tree and a robot of one kind, which advance together on a graphics device. The robot touches live wood, hanging fruit, fruit that came in its hand, itself, posts and wires, and level ground by the law of
/// `orchard_multibody::contact`, and draws fruit against a suction cup by that of [`orchard_robot::Cup`]; wood that it pushes breaks. Their state stays there; only what is asked for is read.
///
/// The wind of each world blows on wood and hanging fruit. Hanging fruit touch each other where they grow in clusters. The robot touches nothing else: neither fruit that come off here or lie elsewhere, nor broken limbs, nor uneven ground. Posts and wires are the same in all worlds. The result of a world does not
/// depend on the other worlds or on their number.
#[derive(Debug)]
pub struct WorldBatch {
    gpu: Gpu,
    trees: GpuBatch,
    robots: RobotBatch,
    buffers: WorldBuffers,
    table: WorldTable,
    /// Workgroups that solve the contacts of a substep.
    desks: usize,
    room: Room,
    /// Numbers that a batch of lanes reads from the device after every frame; `None` in a batch of fixed worlds.
    read: Option<Read>,
    /// Buffer through which the numbers of new worlds go to their lanes.
    sent: Records,
    /// Times of the kernels, if they are kept.
    clock: Option<Clock>,
}

impl WorldBatch {
    /// Creates a batch with the state and the external forces of some trees, and in each world a robot in its start posture, at rest at `x_world_odom`, under the command that holds it.
    ///
    /// # Errors
    /// The kernels cannot step a tree, or the robot; the trees differ in their rules; an odom frame is tilted; or the worlds do not fit into the device.
    pub fn new(
        gpu: &Gpu,
        trees: &[TreeWorld],
        robot: &RobotModel,
        x_world_odom: &[Pose],
    ) -> Result<Self, GpuError> {
        Self::in_room(gpu, trees, robot, x_world_odom, Room::default(), 1)
    }

    /// As [`Self::new`], with room for larger trees, and for the commands of some frames.
    fn in_room(
        gpu: &Gpu,
        trees: &[TreeWorld],
        robot: &RobotModel,
        x_world_odom: &[Pose],
        room: Room,
        frames: usize,
    ) -> Result<Self, GpuError> {
        if trees.len() != x_world_odom.len() || trees.is_empty() {
            return Err(BatchError::Starts { starts: x_world_odom.len(), worlds: trees.len() }.into());
        }
        for (world, (tree, x_world_odom)) in trees.iter().zip(x_world_odom).enumerate() {
            check(tree.plant(), x_world_odom).map_err(|why| BatchError::World { world, why })?;
        }
        let plants: Vec<&Plant> = trees.iter().map(|tree| &**tree.plant()).collect();
        if let Some(world) = plants.iter().position(|plant| !stand_alike(&plant.model, &plants[0].model)) {
            return Err(BatchError::Rules { world }.into());
        }
        let sim = &plants[0].spec.sim;
        let robots = RobotBatch::with_frames(gpu, robot, sim, trees.len() as u32, frames)?;
        let batch = GpuBatch::over_tiles(gpu, trees, Options::default(), Some(&room))?;
        let links: Result<_, String> = <Table as bytemuck::Zeroable>::zeroed().set_links(&robots.alone.model);
        let links = links.map_err(|why| refused(robot, &why))?;
        let alone = &robots.alone;
        let table = WorldTable::new(&batch.memory, &plants, robot, alone, &links, x_world_odom, &room)?;
        let buffers = WorldBuffers::new(gpu, &table, &batch, &robots)?;
        let desks = desks(trees.len());
        let (gpu, trees) = (gpu.clone(), batch);
        Ok(Self {
            gpu,
            trees,
            robots,
            buffers,
            table,
            desks,
            room,
            read: None,
            sent: Records::default(),
            clock: None,
        })
    }

    /// Lets so few workgroups solve the contacts of all worlds.
    #[cfg(test)]
    pub(crate) fn share_desks(&mut self, desks: usize) {
        self.desks = self.desks.min(desks);
    }

    /// Number of worlds.
    pub fn len(&self) -> usize {
        self.trees.len()
    }

    /// True if there is no world.
    pub fn is_empty(&self) -> bool {
        self.trees.is_empty()
    }

    /// Substeps of a frame.
    pub fn substeps(&self) -> u32 {
        self.trees.memory.rules.substeps
    }

    /// Memory on the device \[bytes\].
    pub fn bytes(&self) -> usize {
        let own = self.table.meetings(self.len()) + self.table.words.len();
        self.trees.bytes() + self.robots.bytes() + 4 * own
    }

    /// Sets the command of a world's robot, for every frame until it is changed. Leaves do not get under the lip of a suction cup here.
    ///
    /// # Errors
    /// The command is for another number of arm joints.
    pub fn command(&mut self, world: usize, given: &Command) -> Result<(), GpuError> {
        self.robots.command(world, given)
    }

    /// Sets the external force \[N\] at, and torque [N m] about, a segment's centre of mass until changed. Returns false if the world has no room for another force.
    #[must_use]
    pub fn push(&mut self, world: usize, segment: usize, force_world: Vec3, torque_world: Vec3) -> bool {
        self.trees.push(world, segment, force_world, torque_world)
    }

    /// Submits whole frames of every world to the device and returns at once. Reading results waits for them.
    pub fn advance(&mut self, frames: u32) {
        self.trees.send_inputs();
        self.robots.send_inputs();
        let steps = self.next_rules(frames).map(|rules| {
            let is_last = rules.substep + 1 == rules.substeps;
            (rules, if is_last { &SUBSTEP[..] } else { &SUBSTEP[..SUBSTEP.len() - 1] })
        });
        let mut clock = self.clock.take();
        let dispatch =
            |pass: &mut wgpu::ComputePass<'_>, rules: u32, kind| self.dispatch(pass, rules, kind, 0);
        self.trees.run_each(steps, dispatch, timed(&mut clock));
        self.clock = clock;
    }

    /// Rules of the substeps of the next frames, which are counted.
    fn next_rules(&mut self, frames: u32) -> impl Iterator<Item = Rules> + use<> {
        let first = self.trees.memory.rules.frame + 1;
        self.trees.memory.rules.frame += frames;
        let rules = self.trees.memory.rules;
        let substeps = move |frame| (0..rules.substeps).map(move |substep| Rules { frame, substep, ..rules });
        (first..first + frames).flat_map(substeps)
    }

    /// Sends the rules of the next frames, all at once.
    fn send_rules(&mut self, frames: u32) {
        let rules: Vec<Rules> = self.next_rules(frames).collect();
        self.trees.send_rules(rules.iter());
    }

    /// Dispatches a pass with the rules at an offset in their buffer, and the commands of a frame of those that were sent.
    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, rules: u32, kind: WorldPass, frame: usize) {
        let pipelines = self.gpu.world_pipelines(self.trees.memory.laws);
        let worlds = self.len() as u32;
        let blocks = worlds.div_ceil(LANES as u32);
        let (pipeline, groups) = match kind {
            WorldPass::Trees(kind) => return self.trees.dispatch(pass, rules, kind),
            WorldPass::RobotBegin => (&pipelines.robot_begin, blocks),
            WorldPass::Seek => (&pipelines.seek, worlds),
            WorldPass::Meet => (&pipelines.meet, worlds),
            WorldPass::Answer => (&pipelines.answer, self.desks as u32),
            WorldPass::RobotEnd => (&pipelines.robot_end, blocks),
        };
        pass.set_bind_group(0, &self.buffers.bindings[frame], &[rules]);
        pass.set_pipeline(pipeline);
        pass.dispatch_workgroups(groups, 1, 1);
    }

    /// Keeps the times of kernels by the device's clock from now on, or no more ([`Self::times`]). Every kernel is a pass of its own then, which takes a little longer.
    pub fn keep_times(&mut self, keeps: bool) {
        self.clock = keeps.then(|| Clock::new(&self.gpu)).flatten();
    }

    /// Contacts of each world in the latest substep, and Newton iterations of their solve.
    ///
    /// # Errors
    /// The device was lost.
    pub fn solves(&self) -> Result<Vec<[u32; 2]>, GpuError> {
        let own = |world| {
            let first = self.table.records + world * self.table.record;
            (&self.buffers.meetings, first..first + QUAD)
        };
        let numbers = self.gpu.read::<u32>(&(0..self.len()).map(own).collect::<Vec<_>>())?;
        let fields = [layout::meeting::CONTACTS, layout::meeting::ITERATIONS];
        Ok(numbers.chunks_exact(QUAD).map(|own| fields.map(|field| own[field])).collect())
    }

    /// Seconds that kernels took since [`Self::keep_times`], by name; `all` is the time from the beginning of the first to the end of the last before each reading. Empty where the adapter has no clock.
    pub fn times(&self) -> BTreeMap<&'static str, f64> {
        self.clock.as_ref().map(|clock| clock.seconds().clone()).unwrap_or_default()
    }

    /// Resets some worlds while the others stay as they are: the tree as [`GpuBatch::reset`] does, the robot at its start posture, at rest, under the command that holds it.
    pub fn reset(&mut self, worlds: &[usize]) {
        self.trees.reset(worlds);
        self.robots.reset(worlds);
        let zeros = [0.0_f32; crate::layout::meeting::FIELDS];
        for &world in worlds {
            let at = 4 * (self.table.records + world * self.table.record) as u64;
            self.gpu.queue.write_buffer(&self.buffers.meetings, at, bytemuck::cast_slice(&zeros));
        }
    }

    /// Waits until all frames are done, and takes the times of their kernels, if they are kept.
    ///
    /// # Errors
    /// The device was lost.
    pub fn wait(&mut self) -> Result<(), GpuError> {
        if let Some(clock) = &mut self.clock {
            clock.ask(&self.gpu);
            clock.fetch(&self.gpu)?;
        }
        self.gpu.wait()
    }

    /// Returns the events of the trees since the last call, sorted by frame and world.
    ///
    /// # Errors
    /// The device was lost.
    pub fn events(&mut self) -> Result<Vec<BatchEvent>, GpuError> {
        self.trees.events()
    }

    /// Returns whether a world runs or is in quarantine: both of its robot and its tree stand still then.
    ///
    /// # Errors
    /// The device was lost.
    pub fn status(&mut self, world: usize) -> Result<Status, GpuError> {
        match self.robots.own_status(world)? {
            Some(stopped @ Status::Quarantined(_)) => Ok(stopped),
            Some(Status::Running) | None => self.trees.status(world),
        }
    }

    /// Returns counts and peaks of every tree, and its energy now.
    ///
    /// # Errors
    /// The device was lost.
    pub fn statistics(&mut self) -> Result<Vec<Statistics>, GpuError> {
        self.trees.statistics()
    }

    /// Writes the state of a world's tree into the f64 state of its model.
    ///
    /// # Errors
    /// The device was lost.
    pub fn store_tree(&mut self, world: usize, data: &mut Data) -> Result<(), GpuError> {
        self.trees.store(world, data)
    }

    /// Writes the state of a world's robot, in its odom frame, into the f64 state of a model that holds this robot, of which `handle` is.
    ///
    /// # Errors
    /// The device was lost.
    pub fn store_robot(
        &mut self,
        world: usize,
        model: &Model,
        handle: &RobotHandle,
        data: &mut Data,
    ) -> Result<(), GpuError> {
        self.robots.store(world, model, handle, data)
    }

    /// Reads what a world keeps of its contacts.
    ///
    /// # Errors
    /// The device was lost.
    pub fn meeting(&self, world: usize) -> Result<Meeting, GpuError> {
        let first = self.table.records + world * self.table.record;
        let numbers = self.gpu.read(&[(&self.buffers.meetings, first..first + Meeting::NUMBERS)])?;
        Ok(Meeting::of(&numbers, self.trees.memory.rules.h))
    }
}

/// Passes of a substep; the last of them ends a frame.
const SUBSTEP: [WorldPass; 8] = [
    WorldPass::Trees(Pass::Inward),
    WorldPass::RobotBegin,
    WorldPass::Seek,
    WorldPass::Meet,
    WorldPass::Answer,
    WorldPass::RobotEnd,
    WorldPass::Trees(Pass::Outward),
    WorldPass::Trees(Pass::Events),
];

/// A clock that times passes of worlds by their names.
fn timed(clock: &mut Option<Clock>) -> Timed<'_, WorldPass> {
    clock.as_mut().map(|clock| (clock, WorldPass::name as fn(WorldPass) -> &'static str))
}

/// Checks that the kernels can step a tree with a robot beside it.
///
/// # Errors
/// They cannot.
fn check(plant: &Plant, x_world_odom: &Pose) -> Result<(), &'static str> {
    let up = x_world_odom.rotation * Vec3::z();
    for (refused, why) in [
        (overlaps(plant).count() > place::MOST_OVERLAPS, "too many of its fruit have grown into each other"),
        (!(up - Vec3::z()).norm().le(&UPRIGHT), "its odom frame is tilted or not finite"),
        (!x_world_odom.translation.vector.iter().all(|x| x.is_finite()), "its odom frame is not finite"),
    ] {
        if refused {
            return Err(why);
        }
    }
    Ok(())
}

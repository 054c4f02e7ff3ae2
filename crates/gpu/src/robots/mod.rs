//! Batches of robots on a device.

mod buffers;
pub(crate) mod cup;
pub(crate) mod exchange;
pub(crate) mod pipelines;
pub(crate) mod table;

use orchard_batch::{Fault, Quarantine, Status};
use orchard_multibody::{Data, Model};
use orchard_robot::{Climb, Command, RobotHandle, RobotModel, UnderLip};
use orchard_spec::sim::SimSpec;
use rayon::prelude::*;

use crate::BatchError;
use crate::buffers::PASSES_AT_ONCE;
use crate::device::{Gpu, GpuError};
use crate::layout::{LANES, command, robot};
use crate::memory::quad_at;
use buffers::RobotBuffers;
use pipelines::RobotPass;
pub(crate) use table::Alone;
use table::Table;

/// Numbers of a command are cut off here, our own choice: far beyond all limits of a robot, and the square is finite on the device.
const LARGEST_COMMAND: f64 = 1e9;

/// Robots of one kind that advance together on a graphics device, each in a world of its own that holds nothing else, on level ground. Their state stays there; only what is asked for is read.
///
/// The servos take commands as those of `orchard_world::World` do, except that a command that is not finite stops its world. The result of a world does not depend on the other worlds or on their
/// number.
#[derive(Debug)]
pub struct RobotBatch {
    gpu: Gpu,
    pub(crate) alone: Alone,
    start_command: Command,
    worlds: usize,
    pub(crate) buffers: RobotBuffers,
    /// States as they were read last.
    states: Vec<f32>,
    /// Commands of all worlds, frame after frame for as many as are sent at once.
    commands: Vec<f32>,
    /// Number of frames of which commands are to be sent.
    commands_changed: usize,
}

impl RobotBatch {
    /// Creates `worlds` robots in their start posture, at rest at the origins of their odom frames, under the command that holds it.
    ///
    /// # Errors
    /// The robot has more joints than the kernels know, or the worlds do not fit into the device.
    pub fn new(gpu: &Gpu, robot_model: &RobotModel, sim: &SimSpec, worlds: u32) -> Result<Self, GpuError> {
        Self::with_frames(gpu, robot_model, sim, worlds, 1)
    }

    /// As [`Self::new`], with room for the commands of some frames ([`Self::command_frames`]).
    pub(crate) fn with_frames(
        gpu: &Gpu,
        robot_model: &RobotModel,
        sim: &SimSpec,
        worlds: u32,
        frames: usize,
    ) -> Result<Self, GpuError> {
        let alone = Alone::new(robot_model)?;
        let table = Table::new(robot_model, &alone, sim, worlds)?;
        let worlds = worlds as usize;
        let blocks = worlds.div_ceil(LANES);
        let mut states = vec![0.0; blocks * robot::FIELDS * LANES];
        for world in 0..blocks * LANES {
            for (field, number) in table.start.iter().enumerate() {
                states[row_place(world, field, robot::FIELDS)] = *number;
            }
        }
        let commands = vec![0.0; frames * blocks * command::FIELDS * LANES];
        let buffers = RobotBuffers::new(gpu, &table, &states, commands.len())?;
        let start_command = robot_model.start_command();
        let mut batch = Self {
            gpu: gpu.clone(),
            alone,
            start_command,
            worlds,
            buffers,
            states,
            commands,
            commands_changed: 1,
        };
        (0..worlds).for_each(|world| batch.write(world, &start_command));
        Ok(batch)
    }

    /// Number of worlds.
    pub fn len(&self) -> usize {
        self.worlds
    }

    /// True if there is no world.
    pub fn is_empty(&self) -> bool {
        self.worlds == 0
    }

    /// Memory on the device \[bytes\].
    pub fn bytes(&self) -> usize {
        size_of::<Table>() + size_of_val(&*self.states) + size_of_val(&*self.commands)
    }

    /// Sets the command of a world, for every frame until it is changed. The valve of a suction cup has no effect on a robot alone: there is nothing to hold.
    ///
    /// # Errors
    /// The command is for another number of arm joints.
    pub fn command(&mut self, world: usize, given: &Command) -> Result<(), GpuError> {
        let has = self.alone.handle.arm.len();
        for numbers in [given.arm_q.len(), given.arm_v.len()] {
            if numbers != has {
                return Err(BatchError::Joints { world, given: numbers, has }.into());
            }
        }
        self.write(world, given);
        Ok(())
    }

    /// Sets the commands of the next frames of many worlds, given in their order, as many as each has; in later frames the kernels are not to see the world.
    ///
    /// # Errors
    /// As [`Self::command`].
    pub(crate) fn command_frames(&mut self, given: &[(&[Command], Surroundings)]) -> Result<(), GpuError> {
        let has = self.alone.handle.arm.len();
        let numbers = |command: &Command| [command.arm_q.len(), command.arm_v.len()];
        let wrong = |(world, (commands, _)): (usize, &(&[Command], Surroundings))| {
            let given = commands.iter().flat_map(numbers).find(|&numbers| numbers != has)?;
            Some(BatchError::Joints { world, given, has })
        };
        if let Some(wrong) = given.iter().enumerate().find_map(wrong) {
            return Err(wrong.into());
        }
        let frames = given.iter().map(|(commands, _)| commands.len()).max().unwrap_or(0);
        let each = self.words_of_commands();
        for (frame, all) in self.commands.chunks_mut(each).enumerate().take(frames) {
            let blocks = all.par_chunks_mut(command::FIELDS * LANES).zip(given.par_chunks(LANES));
            blocks.for_each(|(block, given)| {
                for (lane, (commands, around)) in given.iter().enumerate() {
                    if let Some(command) = commands.get(frame) {
                        write(block, lane, command, *around);
                    }
                }
            });
        }
        self.commands_changed = frames;
        Ok(())
    }

    /// Numbers of the commands of all worlds in a frame.
    pub(crate) fn words_of_commands(&self) -> usize {
        self.worlds.div_ceil(LANES) * command::FIELDS * LANES
    }

    fn write(&mut self, world: usize, given: &Command) {
        let each = command::FIELDS * LANES;
        let block = &mut self.commands[world / LANES * each..][..each];
        write(block, world % LANES, given, Surroundings::default());
        self.commands_changed = self.commands_changed.max(1);
    }

    /// Submits whole frames of every world to the device and returns at once. Reading results waits for them.
    pub fn advance(&mut self, frames: u32) {
        self.send_inputs();
        let mut left = frames as usize;
        while left > 0 {
            let now = left.min(PASSES_AT_ONCE);
            self.buffers.run(&self.gpu, RobotPass::Frame, now);
            left -= now;
        }
    }

    /// Sends the commands, if they have changed.
    pub(crate) fn send_inputs(&mut self) {
        let frames = std::mem::take(&mut self.commands_changed);
        if frames > 0 {
            self.buffers.send_commands(&self.gpu, &self.commands[..frames * self.words_of_commands()]);
        }
    }

    /// Puts some worlds back to their start, out of quarantine and under the command that holds them there, while the others stay as they are.
    pub fn reset(&mut self, worlds: &[usize]) {
        let start = self.start_command;
        for &world in worlds {
            self.write(world, &start);
            self.commands[row_place(world, command::RESET, command::FIELDS)] = 1.0;
        }
        self.buffers.send_commands(&self.gpu, &self.commands);
        self.buffers.run(&self.gpu, RobotPass::Reset, 1);
        for &world in worlds {
            self.commands[row_place(world, command::RESET, command::FIELDS)] = 0.0;
        }
        self.commands_changed = 1;
    }

    /// Waits until all frames are done.
    ///
    /// # Errors
    /// The device was lost.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.gpu.wait()
    }

    /// Returns whether a world runs or is in quarantine.
    ///
    /// # Errors
    /// The device was lost.
    pub fn status(&mut self, world: usize) -> Result<Status, GpuError> {
        Ok(self.own_status(world)?.unwrap_or(Status::Running))
    }

    /// As [`Self::status`]; `None` if the world was stopped because of its tree.
    pub(crate) fn own_status(&mut self, world: usize) -> Result<Option<Status>, GpuError> {
        self.fetch(world)?;
        let bits = |field| self.number(world, field).to_bits();
        Ok(match (bits(robot::STOPPED), bits(robot::FAULT) as usize) {
            (0, _) => Some(Status::Running),
            (_, robot::OF_TREE) => None,
            (frame, robot::DOFS) => Some(Status::Quarantined(Quarantine { frame, fault: Fault::Command })),
            (frame, dof) => Some(Status::Quarantined(Quarantine { frame, fault: Fault::Robot { dof } })),
        })
    }

    /// Writes coordinates and velocities of a world's robot into the f64 state of a model that holds this robot, of which `handle` is.
    ///
    /// # Errors
    /// The device was lost.
    pub fn store(
        &mut self,
        world: usize,
        model: &Model,
        handle: &RobotHandle,
        data: &mut Data,
    ) -> Result<(), GpuError> {
        self.fetch(world)?;
        self.alone.store(|field| self.number(world, field), model, handle, data);
        Ok(())
    }

    /// Overwrites a number of a world's state on the device.
    #[cfg(test)]
    pub(crate) fn overwrite(&self, world: usize, field: usize, value: f32) {
        let at = 4 * row_place(world, field, robot::FIELDS) as u64;
        self.gpu.queue.write_buffer(&self.buffers.robots, at, &value.to_ne_bytes());
    }

    fn number(&self, world: usize, field: usize) -> f32 {
        self.states[row_place(world, field, robot::FIELDS)]
    }

    /// Reads the block of a world.
    fn fetch(&mut self, world: usize) -> Result<(), GpuError> {
        let (block, each) = (world / LANES, robot::FIELDS * LANES);
        let range = block * each..(block + 1) * each;
        self.gpu.fetch(&mut [(&self.buffers.robots, &mut self.states, vec![range])])
    }
}

/// Inputs of a frame that the processor computes, because neither uneven ground nor leaves are on the device.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Surroundings {
    /// Set point of the chassis' height.
    pub climb: Climb,
    /// Points of the suction cup's lip over leaves, and points on which something presses.
    pub under_lip: UnderLip,
}

/// Writes the command of a world into those of its block.
fn write(block: &mut [f32], lane: usize, given: &Command, Surroundings { climb, under_lip }: Surroundings) {
    // A valve that is not a number vents the cup.
    let valve = if given.vacuum.is_finite() { given.vacuum } else { 0.0 };
    for (field, values) in [
        (command::ARM_Q, &given.arm_q[..]),
        (command::ARM_V, &given.arm_v),
        (command::BASE, &given.base_velocity),
        (command::FINGER_Q, &[given.finger_q]),
        (command::FINGER_FORCE, &[given.finger_force]),
        (command::HEIGHT, &[climb.height]),
        (command::CLIMB, &[climb.rate]),
        (command::VALVE, &[valve]),
        (command::LEAVES, &[under_lip.leaves as f64]),
        (command::PRESSED, &[under_lip.pressed as f64]),
    ] {
        for (k, value) in values.iter().enumerate() {
            let largest = value.clamp(-LARGEST_COMMAND, LARGEST_COMMAND);
            let number = if value.is_finite() { largest as f32 } else { f32::NAN };
            block[row_place(lane, field + k, command::FIELDS)] = number;
        }
    }
}

/// Place of a field of a world in a buffer of rows with `fields` fields.
pub(crate) fn row_place(world: usize, field: usize, fields: usize) -> usize {
    world / LANES * fields * LANES + quad_at(field, world % LANES)
}

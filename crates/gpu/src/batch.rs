//! Batches of worlds on a device.

mod lanes;

use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

use orchard_batch::{BatchEvent, Plant, Status, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_multibody::Data;

use crate::BatchError;
use crate::buffers::{Buffers, PASSES_AT_ONCE, RULES_STRIDE, Use};
use crate::clock::Timed;
use crate::device::{Gpu, GpuError};
use crate::layout::{LANES, fourth, notice, world};
use crate::memory::{Memory, Room};
use crate::pipelines::{Pass, Pipelines};
use crate::rules::Rules;
use crate::solver::Solver;
use crate::table::BaseTree;

/// Pairs (n, workgroups): a graphics card spreads up to n worlds of different topology over so many workgroups, one for each multiprocessor of a large card, then two.
/// `docs/computation/gpu.md` compares other numbers.
const TILES_OF_A_CARD: [(usize, usize); 2] = [(1024, 128), (usize::MAX, 256)];

/// Options of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Largest number of external forces on the links of a world at once.
    pub pushes_each: usize,
    /// Solver of the linear system.
    pub solver: Solver,
    /// Largest number of workgroups over which worlds of different topologies are spread; in one workgroup the slowest world delays the others. The number changes no bit of the results. `None` means 128 for up to
    /// 1,024 worlds and 256 for more on a graphics card, and 1 on adapters in software or in a processor. A card with far fewer than 128 multiprocessors is faster with as many as it has; no portable interface
    /// reports that number.
    pub tiles: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Self { pushes_each: 4, solver: Solver::Aba, tiles: None }
    }
}

/// Tree worlds that advance together on a graphics device. Their state stays there; only what is asked for is read.
///
/// The result of a world does not depend on the other worlds or on their number.
#[derive(Debug)]
pub struct GpuBatch {
    gpu: Gpu,
    pub(crate) plants: Vec<Arc<Plant>>,
    pub(crate) memory: Memory,
    pub(crate) buffers: Buffers,
    pipelines: Arc<Pipelines>,
    bindings: wgpu::BindGroup,
    /// Bindings of the pass that draws worlds, if there is a base.
    vary_bindings: Option<wgpu::BindGroup>,
    /// Events reported so far, by world.
    reported: Vec<Reported>,
    inputs_changed: bool,
    /// True if the device has drawn radii that the host's operations do not have yet.
    has_new_radii: bool,
}

/// Part of a world's history that [`GpuBatch::events`] has reported.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Reported {
    /// Number of joints that broke and of fruit that came off, and the frame in which the world stopped.
    counts: [u32; 3],
    /// Last frame that has been reported.
    until: u32,
}

impl GpuBatch {
    /// Creates a batch with the state and the external forces of some worlds. Counts of frames over a limit start at zero.
    ///
    /// # Errors
    /// The worlds differ in their rules, one has a broken limb already, or they do not fit into the device.
    pub fn new(gpu: &Gpu, worlds: &[TreeWorld]) -> Result<Self, GpuError> {
        Self::with_options(gpu, worlds, Options::default())
    }

    /// As [`Self::new`], with options.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_options(gpu: &Gpu, worlds: &[TreeWorld], options: Options) -> Result<Self, GpuError> {
        Self::over_tiles(gpu, worlds, options, None)
    }

    /// As [`Self::with_options`]; with `room` a robot may touch wood and fruit, and trees of that size may take the places of the given ones.
    pub(crate) fn over_tiles(
        gpu: &Gpu,
        worlds: &[TreeWorld],
        options: Options,
        room: Option<&Room>,
    ) -> Result<Self, GpuError> {
        let card = TILES_OF_A_CARD.iter().find(|(most, _)| gpu.info().is_discrete && worlds.len() <= *most);
        let tiles = options.tiles.or(card.map(|(_, tiles)| *tiles)).unwrap_or(1);
        let tiles = tiles.clamp(1, gpu.device.limits().max_compute_workgroups_per_dimension as usize);
        let memory = Memory::spread_over(tiles, worlds, options.pushes_each.max(1), options.solver, room)?;
        Self::of(gpu, memory, worlds.iter().map(|world| world.plant().clone()).collect())
    }

    /// Creates worlds that the device draws from a base tree: each world draws dimensions, habit, wood and fruit from its own random streams, as
    /// `orchard_world::Planting` draws them for the same spec, seed and world (episode 0), and is in static equilibrium. All fruit of the base are there, on the
    /// segments on which they grew; only the host selects the fruit that a planting shows. Where no axis acts, the worlds have the bits of the base.
    ///
    /// [`Self::store`] and [`Self::status`] use the base's model, with the base's own constants, for every world.
    ///
    /// # Errors
    /// The base has no schedule, or the worlds do not fit into the device.
    pub fn randomised(gpu: &Gpu, base: &BaseTree, worlds: u32) -> Result<Self, GpuError> {
        Self::randomised_with_options(gpu, base, worlds, Options::default())
    }

    /// As [`Self::randomised`], with options.
    ///
    /// # Errors
    /// As [`Self::randomised`].
    pub fn randomised_with_options(
        gpu: &Gpu,
        base: &BaseTree,
        worlds: u32,
        options: Options,
    ) -> Result<Self, GpuError> {
        let count = worlds as usize;
        let memory = Memory::replicated(base, count, options.pushes_each.max(1), options.solver)?;
        let mut batch = Self::of(gpu, memory, vec![base.world().plant().clone(); count])?;
        batch.vary_bindings = Some(batch.buffers.bind(gpu, &batch.pipelines.kernels.bindings, Use::Varies));
        if base.varies() {
            batch.redraw(&(0..count).collect::<Vec<_>>(), 0)?;
        }
        Ok(batch)
    }

    fn of(gpu: &Gpu, memory: Memory, plants: Vec<Arc<Plant>>) -> Result<Self, GpuError> {
        let buffers = Buffers::new(gpu, &memory)?;
        let pipelines = gpu.pipelines();
        // Every batch steps: compiling them now spares the first frame the wait.
        let whole = [Pass::Frame, Pass::Events];
        let split = [Pass::Inward, Pass::Outward, Pass::Events];
        for &pass in if memory.laws.touched { &split[..] } else { &whole } {
            pipelines.of(pass, memory.laws);
        }
        let batch = Self {
            bindings: buffers.bind(gpu, &pipelines.kernels.bindings, Use::Steps),
            vary_bindings: None,
            gpu: gpu.clone(),
            reported: vec![Reported::default(); plants.len()],
            plants,
            memory,
            buffers,
            pipelines,
            inputs_changed: false,
            has_new_radii: false,
        };
        batch.begin_wind();
        Ok(batch)
    }

    /// Number of worlds.
    pub fn len(&self) -> usize {
        self.memory.len()
    }

    /// True if there is no world.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory on the device \[bytes\].
    pub fn bytes(&self) -> usize {
        self.memory.bytes()
    }

    /// Submits whole frames of every world to the device and returns at once. Reading results waits for them.
    pub fn advance(&mut self, frames: u32) {
        self.send_inputs();
        let first = self.memory.rules.frame + 1;
        self.memory.rules.frame += frames;
        let rules = self.memory.rules;
        let steps = (first..first + frames).map(|frame| Rules { frame, ..rules });
        let passes = Pass::of_a_frame(self.memory.solver);
        self.run(steps.map(|rules| (rules, passes)));
    }

    /// Resets some worlds while the others stay as they are: unbroken, every fruit on its stem, at rest in the static equilibrium under their weight, without
    /// external forces, set or scripted, with counts and peaks at zero. Events of these worlds that have not been read are lost. Fruit that were off their stems when the batch was created
    /// stay off.
    pub fn reset(&mut self, worlds: &[usize]) {
        self.restart(worlds, &[Pass::Reset]);
    }

    /// Draws some worlds of [`Self::randomised`] again and resets them as [`Self::reset`] does. In the mode of shared dimensions the dimensions belong to the
    /// episode; all other draws belong to the world and are the same in every episode.
    ///
    /// # Errors
    /// The batch was made of given worlds and has no base.
    pub fn redraw(&mut self, worlds: &[usize], episode: u32) -> Result<(), GpuError> {
        if self.vary_bindings.is_none() {
            return Err(BatchError::NoBase.into());
        }
        self.memory.set_episode(episode);
        self.buffers.send_head(&self.gpu, &self.memory);
        self.restart(worlds, &[Pass::Vary, Pass::Reset]);
        self.has_new_radii = true;
        Ok(())
    }

    /// Marks worlds, submits passes, and lets the worlds settle.
    fn restart(&mut self, worlds: &[usize], passes: &[Pass]) {
        self.inputs_changed |= self.memory.clear_pushes(worlds);
        self.send_inputs();
        self.memory.mark(worlds);
        let frame = self.memory.rules.frame;
        for &index in worlds {
            self.reported[index] = Reported { until: frame, ..Reported::default() };
        }
        for (at, marks) in self.memory.marks() {
            self.gpu.queue.write_buffer(&self.buffers.worlds, 4 * at as u64, bytemuck::cast_slice(marks));
        }
        let rules = self.memory.rules;
        let settling = rules.settling().map(|rules| (rules, &[Pass::Settle][..]));
        self.run(std::iter::once((rules, passes)).chain(settling));
        self.begin_wind();
    }

    /// Sets the air of worlds that have just begun.
    fn begin_wind(&self) {
        if self.memory.laws.wind {
            self.run(std::iter::once((self.memory.rules, &[Pass::Begin][..])));
        }
    }

    /// Submits passes to the device, each with its rules, in order.
    pub(crate) fn run<'a>(&self, passes: impl Iterator<Item = (Rules, &'a [Pass])>) {
        self.run_each(passes, |pass, slot, kind| self.dispatch(pass, slot, kind), None);
    }

    /// As [`Self::run`] with passes of any kind; `dispatch` dispatches one, with the rules at an offset in the buffer of rules. Under a clock every pass is timed by its name.
    pub(crate) fn run_each<'a, K: Copy + 'a>(
        &self,
        passes: impl Iterator<Item = (Rules, &'a [K])>,
        dispatch: impl Fn(&mut wgpu::ComputePass<'_>, u32, K),
        mut clock: Timed<'_, K>,
    ) {
        let tiles = self.memory.tile_count();
        let mut passes = passes.peekable();
        while passes.peek().is_some() && tiles > 0 {
            let now: Vec<(Rules, &[K])> = passes.by_ref().take(PASSES_AT_ONCE).collect();
            self.send_rules(now.iter().map(|(rules, _)| rules));
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let kinds = now.iter().map(|(_, kinds)| *kinds);
            encode_each(&mut encoder, 0, kinds, &dispatch, &mut clock);
            self.gpu.queue.submit([encoder.finish()]);
        }
    }

    /// Sends the rules of the passes that follow, at most [`PASSES_AT_ONCE`].
    pub(crate) fn send_rules<'a>(&self, rules: impl ExactSizeIterator<Item = &'a Rules>) {
        let mut bytes = vec![0; RULES_STRIDE * rules.len()];
        for (slot, own) in bytes.chunks_mut(RULES_STRIDE).zip(rules) {
            slot[..size_of::<Rules>()].copy_from_slice(bytemuck::bytes_of(own));
        }
        self.gpu.queue.write_buffer(&self.buffers.rules, 0, &bytes);
    }

    /// Dispatches a pass with the rules at an offset in their buffer.
    pub(crate) fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, rules: u32, kind: Pass) {
        let varied = self.vary_bindings.as_ref().filter(|_| kind == Pass::Vary);
        pass.set_bind_group(0, varied.unwrap_or(&self.bindings), &[rules]);
        pass.set_pipeline(self.pipelines.of(kind, self.memory.laws));
        pass.dispatch_workgroups(self.memory.tile_count() as u32, kind.groups_of_a_tile(self.memory.laws), 1);
    }

    /// Waits until all frames are done.
    ///
    /// # Errors
    /// The device was lost.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.gpu.wait()
    }

    /// Returns the events since the last call, sorted by frame and world.
    ///
    /// # Errors
    /// The device was lost.
    pub fn events(&mut self) -> Result<Vec<BatchEvent>, GpuError> {
        self.fetch_worlds()?;
        let counts = |memory: &Memory, index: usize| {
            [world::SNAPPED, world::DETACHED, world::STOPPED].map(|field| memory.world_number(index, field))
        };
        let changed: Vec<usize> = (0..self.len())
            .filter(|&index| counts(&self.memory, index) != self.reported[index].counts)
            .collect();
        self.fetch_state(&changed)?;
        let mut events = Vec::new();
        for world in changed {
            let reported = self.reported[world];
            let (broke, off) = self.memory.lost(world);
            let snapped =
                broke.into_iter().enumerate().map(|(segment, frame)| (frame, TreeEvent::Snapped { segment }));
            let came_off = off
                .into_iter()
                .enumerate()
                .map(|(fruit, (frame, release))| (frame, TreeEvent::Detached { fruit, release }));
            let new = snapped.chain(came_off).filter(|(frame, _)| *frame > reported.until);
            events.extend(new.map(|(frame, event)| BatchEvent { frame, world, event }));
            if let (Status::Quarantined(quarantine), 0) = (self.memory.status(world), reported.counts[2]) {
                let event = TreeEvent::Quarantined { fault: quarantine.fault };
                events.push(BatchEvent { frame: quarantine.frame, world, event });
            }
            self.reported[world] =
                Reported { counts: counts(&self.memory, world), until: self.memory.rules.frame };
        }
        events.sort_unstable();
        Ok(events)
    }

    /// Returns whether a world runs or is in quarantine.
    ///
    /// # Errors
    /// The device was lost.
    pub fn status(&mut self, index: usize) -> Result<Status, GpuError> {
        self.fetch_worlds()?;
        self.fetch_state(&[index])?;
        Ok(self.memory.status(index))
    }

    /// Returns counts and peaks of every world, and its energy now.
    ///
    /// # Errors
    /// The device was lost.
    pub fn statistics(&mut self) -> Result<Vec<Statistics>, GpuError> {
        self.run(std::iter::once((self.memory.rules, &[Pass::Measure][..])));
        self.fetch_worlds()?;
        let of = |index| Statistics {
            snapped: self.memory.world_number(index, world::SNAPPED),
            detached: self.memory.world_number(index, world::DETACHED),
            peak_moment: f32::from_bits(self.memory.world_number(index, world::PEAK)).sqrt(),
            energy: f32::from_bits(self.memory.world_number(index, world::ENERGY)),
        };
        Ok((0..self.len()).map(of).collect())
    }

    /// Writes a world's state into the f64 state of its model.
    ///
    /// # Errors
    /// The device was lost.
    pub fn store(&mut self, index: usize, data: &mut Data) -> Result<(), GpuError> {
        self.fetch_state(&[index])?;
        self.memory.store(index, &self.plants[index], data);
        Ok(())
    }

    /// Sets the external force \[N\] at, and torque [N m] about, a segment's centre of mass until changed. Returns
    /// false if the world has no room for another force.
    #[must_use]
    pub fn push(&mut self, index: usize, segment: usize, force_world: Vec3, torque_world: Vec3) -> bool {
        self.inputs_changed = true;
        self.memory.push(index, segment, force_world, torque_world)
    }

    /// Adds a force \[N\] at, and a torque [N m] about, a segment's centre of mass that act in some later frames; the first frame of the batch has number 1. Returns
    /// false if the world has no room for another force. A force whose frames are over takes no room.
    #[must_use]
    pub fn script(
        &mut self,
        index: usize,
        segment: usize,
        force_world: Vec3,
        torque_world: Vec3,
        frames: RangeInclusive<u32>,
    ) -> bool {
        self.inputs_changed = true;
        self.memory.script(index, segment, force_world, torque_world, frames)
    }

    /// Sets the external force \[N\] on a fruit until changed.
    pub fn pull(&mut self, index: usize, fruit_index: usize, force_world: Vec3) {
        for at in self.memory.pull(index, fruit_index, force_world) {
            let bytes = self.memory.fruit[at].to_ne_bytes();
            self.gpu.queue.write_buffer(&self.buffers.fruit, 4 * at as u64, &bytes);
        }
        let at = self.memory.notice_of(index);
        self.gpu.queue.write_buffer(
            &self.buffers.worlds,
            4 * at as u64,
            &(notice::STALE as u32).to_ne_bytes(),
        );
    }

    /// Links, fruit and operations as they are on the device.
    #[cfg(test)]
    pub(crate) fn fetched(&mut self) -> Result<&Memory, GpuError> {
        self.fetch_state(&(0..self.len()).collect::<Vec<_>>())?;
        self.fetch_radii();
        Ok(&self.memory)
    }

    /// Sends the forces on links, if they have changed.
    pub(crate) fn send_inputs(&mut self) {
        if std::mem::take(&mut self.inputs_changed) {
            if std::mem::take(&mut self.has_new_radii) {
                self.fetch_radii();
            }
            let queue = &self.gpu.queue;
            queue.write_buffer(&self.buffers.pushes, 0, bytemuck::cast_slice(&self.memory.pushes));
            queue.write_buffer(&self.buffers.operations, 0, bytemuck::cast_slice(&self.memory.operations));
        }
    }

    /// Reads the operations, with the radii that the device has drawn, and keeps the marks of forces.
    fn fetch_radii(&mut self) {
        let operations = &mut self.memory.operations;
        let marks: Vec<u32> = operations.iter().map(|words| words[3] & fourth::PUSHED as u32).collect();
        let whole = 0..operations.len();
        // A lost device is reported by the next read.
        let _ = self.gpu.fetch(&mut [(&self.buffers.operations, operations, vec![whole])]);
        operations.iter_mut().zip(marks).for_each(|(words, mark)| words[3] |= mark);
    }

    fn fetch_worlds(&mut self) -> Result<(), GpuError> {
        let whole = 0..self.memory.worlds.len();
        self.gpu.fetch(&mut [(&self.buffers.worlds, &mut self.memory.worlds, vec![whole])])
    }

    /// Reads links, fruit and states of the blocks in which some worlds are.
    fn fetch_state(&mut self, indices: &[usize]) -> Result<(), GpuError> {
        let blocks = self.memory.blocks_of(indices);
        let times = |rows: &Range<usize>, each: usize| rows.start * each * LANES..rows.end * each * LANES;
        let each = self.memory.laws.fruit_fields();
        let links = blocks.iter().map(|block| block.links.clone()).collect();
        let fruit = blocks.iter().map(|block| times(&block.fruit_rows, each)).collect();
        let states = blocks.iter().map(|block| times(&block.rows, 1)).collect();
        let memory = &mut self.memory;
        self.gpu.fetch(&mut [
            (&self.buffers.links, &mut memory.links, links),
            (&self.buffers.fruit, &mut memory.fruit, fruit),
        ])?;
        self.gpu.fetch(&mut [(&self.buffers.states, &mut memory.states, states)])
    }
}

/// Counts, peak load and energy of a world.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Statistics {
    /// Number of joints that broke.
    pub snapped: u32,
    /// Number of fruit that came off.
    pub detached: u32,
    /// Largest moment of a joint at the end of any frame, over its rupture moment.
    pub peak_moment: f32,
    /// Kinetic, gravitational (zero at the height of the world's origin) and elastic energy of wood, stems and fruit \[J\], as defined by `orchard_multibody::energy`.
    pub energy: f32,
}

/// Encodes passes, of which those with the same rules are given together; `first` is the place of the first rules among those that were sent.
pub(crate) fn encode_each<'a, K: Copy + 'a>(
    encoder: &mut wgpu::CommandEncoder,
    first: usize,
    passes: impl Iterator<Item = &'a [K]>,
    dispatch: &impl Fn(&mut wgpu::ComputePass<'_>, u32, K),
    clock: &mut Timed<'_, K>,
) {
    let offsets = (first..).map(|slot| (slot * RULES_STRIDE) as u32);
    let each = offsets.zip(passes).flat_map(|(at, kinds)| kinds.iter().map(move |&kind| (at, kind)));
    if let Some((clock, name)) = clock {
        for (rules, kind) in each {
            let timestamp_writes = clock.stamp(name(kind));
            let timed = wgpu::ComputePassDescriptor { label: None, timestamp_writes };
            dispatch(&mut encoder.begin_compute_pass(&timed), rules, kind);
        }
    } else {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        each.for_each(|(rules, kind)| dispatch(&mut pass, rules, kind));
    }
}

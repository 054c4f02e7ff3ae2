//! Worlds on a device.

use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

use orchard_batch::{BatchEvent, Plant, Status, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_multibody::Data;

use crate::BatchError;
use crate::buffers::{Buffers, PASSES_AT_ONCE, RULES_APART, Use};
use crate::device::{Gpu, GpuError};
use crate::layout::{LANES, fourth, fruit, notice, world};
use crate::memory::Memory;
use crate::pipelines::{Pass, Pipelines};
use crate::rules::Rules;
use crate::table::BaseTree;

/// What the linear system of a substep is solved by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Solver {
    /// The articulated-body algorithm: exact, and the fastest.
    #[default]
    Aba,
    /// Conjugate gradients without a matrix, preconditioned by each joint's own block of the inertia: for comparison.
    ConjugateGradients,
}

/// Workgroups over which worlds of different topology are spread on a graphics card, if there are no more worlds than so many: one a multiprocessor of a large card, then two.
/// Others are compared in `docs/computation/gpu.md`.
const TILES_OF_A_CARD: [(usize, usize); 2] = [(1024, 128), (usize::MAX, 256)];

/// How a batch is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Forces that a world can have on its links at once.
    pub pushes_each: usize,
    /// Solver.
    pub solver: Solver,
    /// Workgroups over which a batch is spread at most if its topologies differ and it needs fewer: worlds hold each other up in a workgroup. It changes no bit. Without a number it is 128 for up to
    /// 1,024 worlds and 256 for more on a graphics card, and 1 on adapters in software or in a processor. A card with far fewer than 128 multiprocessors (which no portable interface tells) is faster with as
    /// many as it has.
    pub tiles: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Self { pushes_each: 4, solver: Solver::Aba, tiles: None }
    }
}

/// Tree worlds that advance together on a graphics device. Their state stays there; what is asked for is read.
///
/// The result of a world does not depend on the others or on their number.
#[derive(Debug)]
pub struct GpuBatch {
    gpu: Gpu,
    plants: Vec<Arc<Plant>>,
    memory: Memory,
    buffers: Buffers,
    pipelines: Arc<Pipelines>,
    bindings: wgpu::BindGroup,
    /// Of worlds that are drawn from a base.
    vary_bindings: Option<wgpu::BindGroup>,
    /// By world.
    told: Vec<Told>,
    inputs_changed: bool,
    /// Whether the device has drawn radii that the host's operations do not have yet.
    has_new_radii: bool,
}

/// What [`GpuBatch::events`] has told of a world.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Told {
    /// Joints that broke, fruit that came off, and the frame in which it stopped.
    counts: [u32; 3],
    /// Up to which frame.
    until: u32,
}

impl GpuBatch {
    /// Takes over the state and the applied forces of some worlds. Counts of frames over a limit start anew.
    ///
    /// # Errors
    /// The worlds do not step alike, one is broken already, or they do not fit into the device.
    pub fn new(gpu: &Gpu, worlds: &[TreeWorld]) -> Result<Self, GpuError> {
        Self::with_options(gpu, worlds, Options::default())
    }

    /// The same with other options.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_options(gpu: &Gpu, worlds: &[TreeWorld], options: Options) -> Result<Self, GpuError> {
        let card = TILES_OF_A_CARD.iter().find(|(most, _)| gpu.info().is_discrete && worlds.len() <= *most);
        let tiles = options.tiles.or(card.map(|(_, tiles)| *tiles)).unwrap_or(1);
        let tiles = tiles.clamp(1, gpu.device.limits().max_compute_workgroups_per_dimension as usize);
        let memory = Memory::spread_over(tiles, worlds, options.pushes_each.max(1), options.solver)?;
        Self::of(gpu, memory, worlds.iter().map(|world| world.plant().clone()).collect())
    }

    /// Worlds that the device draws by itself: the base tree in dimensions, habit, wood and fruit that every world draws from its own random streams, as
    /// `orchard_world::Planting` draws them for the same spec, seed and world (episode 0), in static equilibrium. All of the base's fruit are there, on the
    /// segments that they grew on; which of them a planting shows is settled on the host. Where no axis acts, the worlds are the base to the last bit.
    ///
    /// For [`Self::store`] and its like every world has the base's model, with the base's own constants.
    ///
    /// # Errors
    /// The base makes no batch, or the worlds do not fit into the device.
    pub fn randomised(gpu: &Gpu, base: &BaseTree, worlds: u32) -> Result<Self, GpuError> {
        Self::randomised_with_options(gpu, base, worlds, Options::default())
    }

    /// The same with options.
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
        let memory = Memory::repeated(base, count, options.pushes_each.max(1), options.solver)?;
        let mut batch = Self::of(gpu, memory, vec![base.world().plant().clone(); count])?;
        batch.vary_bindings = Some(batch.buffers.bind(gpu, &batch.pipelines.bindings, Use::Varies));
        if base.varies() {
            batch.redraw(&(0..count).collect::<Vec<_>>(), 0)?;
        }
        Ok(batch)
    }

    fn of(gpu: &Gpu, memory: Memory, plants: Vec<Arc<Plant>>) -> Result<Self, GpuError> {
        let buffers = Buffers::new(gpu, &memory)?;
        let pipelines = gpu.pipelines();
        Ok(Self {
            bindings: buffers.bind(gpu, &pipelines.bindings, Use::Steps),
            vary_bindings: None,
            gpu: gpu.clone(),
            told: vec![Told::default(); plants.len()],
            plants,
            memory,
            buffers,
            pipelines,
            inputs_changed: false,
            has_new_radii: false,
        })
    }

    /// Number of worlds.
    pub fn len(&self) -> usize {
        self.memory.len()
    }

    /// Whether there is no world.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory on the device [bytes].
    pub fn bytes(&self) -> usize {
        self.memory.bytes()
    }

    /// Asks the device for whole frames of every world. It returns at once; whoever reads waits.
    pub fn advance(&mut self, frames: u32) {
        self.send_inputs();
        let first = self.memory.rules.frame + 1;
        self.memory.rules.frame += frames;
        let rules = self.memory.rules;
        let steps = (first..first + frames).map(|frame| Rules { frame, ..rules });
        let passes: &[Pass] = match self.memory.solver {
            Solver::Aba => &[Pass::Frame, Pass::Mend],
            Solver::ConjugateGradients => &[Pass::Conjugate, Pass::Mend],
        };
        self.run(steps.map(|rules| (rules, passes)));
    }

    /// Puts some worlds back to their beginning while the others stay as they are: unbroken, every fruit on its stem, at rest in the static equilibrium under
    /// what is applied to them, with counts and peaks at zero. Their events that have not been read are gone. Fruit that had come off when the batch began
    /// stay off.
    pub fn reset(&mut self, worlds: &[usize]) {
        self.restart(worlds, &[Pass::Reset]);
    }

    /// Draws some worlds of [`Self::randomised`] anew and puts them to their beginning as [`Self::reset`] does. In the mode of shared dimensions these are the
    /// episode's; all else is the world's for good.
    ///
    /// # Errors
    /// The batch was made of given worlds.
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

    /// Marks worlds, sends passes and lets the worlds settle.
    fn restart(&mut self, worlds: &[usize], passes: &[Pass]) {
        self.send_inputs();
        self.memory.mark(worlds);
        let frame = self.memory.rules.frame;
        for &index in worlds {
            self.told[index] = Told { until: frame, ..Told::default() };
        }
        for (at, marks) in self.memory.marks() {
            self.gpu.queue.write_buffer(&self.buffers.worlds, 4 * at as u64, bytemuck::cast_slice(marks));
        }
        let rules = self.memory.rules;
        let settling = rules.settling().map(|rules| (rules, &[Pass::Settle][..]));
        self.run(std::iter::once((rules, passes)).chain(settling));
    }

    /// Sends passes to the device, each with its rules, in order.
    pub(crate) fn run<'a>(&self, passes: impl Iterator<Item = (Rules, &'a [Pass])>) {
        let tiles = self.memory.tile_count() as u32;
        let mut passes = passes.peekable();
        while passes.peek().is_some() && tiles > 0 {
            let now: Vec<(Rules, &[Pass])> = passes.by_ref().take(PASSES_AT_ONCE).collect();
            let mut rules = vec![0; RULES_APART * now.len()];
            for (slot, (own, _)) in rules.chunks_mut(RULES_APART).zip(&now) {
                slot[..size_of::<Rules>()].copy_from_slice(bytemuck::bytes_of(own));
            }
            self.gpu.queue.write_buffer(&self.buffers.rules, 0, &rules);
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            for (slot, (_, kinds)) in now.iter().enumerate() {
                for &kind in *kinds {
                    let varied = self.vary_bindings.as_ref().filter(|_| kind == Pass::Vary);
                    let bindings = varied.unwrap_or(&self.bindings);
                    pass.set_bind_group(0, bindings, &[(slot * RULES_APART) as u32]);
                    pass.set_pipeline(self.pipelines.of(kind));
                    pass.dispatch_workgroups(tiles, 1, 1);
                }
            }
            drop(pass);
            self.gpu.queue.submit([encoder.finish()]);
        }
    }

    /// Waits until all frames are done.
    ///
    /// # Errors
    /// The device was lost.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.gpu.wait()
    }

    /// What has happened since the last call, by frame and world.
    ///
    /// # Errors
    /// The device was lost.
    pub fn events(&mut self) -> Result<Vec<BatchEvent>, GpuError> {
        self.fetch_worlds()?;
        let counts = |memory: &Memory, index: usize| {
            [world::SNAPPED, world::DETACHED, world::STOPPED].map(|field| memory.world_number(index, field))
        };
        let changed: Vec<usize> =
            (0..self.len()).filter(|&index| counts(&self.memory, index) != self.told[index].counts).collect();
        self.fetch_state(&changed)?;
        let mut events = Vec::new();
        for world in changed {
            let told = self.told[world];
            let (broke, off) = self.memory.lost(world);
            let snapped =
                broke.into_iter().enumerate().map(|(segment, frame)| (frame, TreeEvent::Snapped { segment }));
            let came_off =
                off.into_iter().enumerate().map(|(fruit, frame)| (frame, TreeEvent::Detached { fruit }));
            let new = snapped.chain(came_off).filter(|(frame, _)| *frame > told.until);
            events.extend(new.map(|(frame, event)| BatchEvent { frame, world, event }));
            if let (Status::Quarantined(quarantine), 0) = (self.memory.status(world), told.counts[2]) {
                let event = TreeEvent::Quarantined { fault: quarantine.fault };
                events.push(BatchEvent { frame: quarantine.frame, world, event });
            }
            self.told[world] = Told { counts: counts(&self.memory, world), until: self.memory.rules.frame };
        }
        events.sort_unstable();
        Ok(events)
    }

    /// Whether a world runs.
    ///
    /// # Errors
    /// The device was lost.
    pub fn status(&mut self, index: usize) -> Result<Status, GpuError> {
        self.fetch_worlds()?;
        self.fetch_state(&[index])?;
        Ok(self.memory.status(index))
    }

    /// What every world has gone through, and its energy now.
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

    /// Sets the external force [N] at, and torque [N m] about, a segment's centre of mass until changed. Gives whether the world had room for it.
    #[must_use]
    pub fn push(&mut self, index: usize, segment: usize, force_world: Vec3, torque_world: Vec3) -> bool {
        self.inputs_changed = true;
        self.memory.push(index, segment, force_world, torque_world)
    }

    /// Adds a force [N] at, and a torque [N m] about, a segment's centre of mass that act in some frames to come, the first frame of the batch being 1. Gives
    /// whether the world had room for it; what is over has made room.
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

    /// Sets the external force [N] on a fruit until changed.
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

    /// The device's links, fruit and operations, as the host lays them out.
    #[cfg(test)]
    pub(crate) fn fetched(&mut self) -> Result<&Memory, GpuError> {
        self.fetch_state(&(0..self.len()).collect::<Vec<_>>())?;
        self.fetch_radii();
        Ok(&self.memory)
    }

    fn send_inputs(&mut self) {
        if std::mem::take(&mut self.inputs_changed) {
            if std::mem::take(&mut self.has_new_radii) {
                self.fetch_radii();
            }
            let queue = &self.gpu.queue;
            queue.write_buffer(&self.buffers.pushes, 0, bytemuck::cast_slice(&self.memory.pushes));
            queue.write_buffer(&self.buffers.operations, 0, bytemuck::cast_slice(&self.memory.operations));
        }
    }

    /// Takes over what the device has drawn into the operations, and keeps the marks of forces.
    fn fetch_radii(&mut self) {
        let operations = &mut self.memory.operations;
        let marks: Vec<u32> = operations.iter().map(|words| words[3] & fourth::PUSHED as u32).collect();
        let whole = 0..operations.len();
        // A device that is lost tells whoever reads from it next.
        let _ = self.gpu.fetch(&mut [(&self.buffers.operations, operations, vec![whole])]);
        operations.iter_mut().zip(marks).for_each(|(words, mark)| words[3] |= mark);
    }

    fn fetch_worlds(&mut self) -> Result<(), GpuError> {
        let whole = 0..self.memory.worlds.len();
        self.gpu.fetch(&mut [(&self.buffers.worlds, &mut self.memory.worlds, vec![whole])])
    }

    /// Reads links and fruit of some worlds, and of those that share a block with them.
    fn fetch_state(&mut self, indices: &[usize]) -> Result<(), GpuError> {
        let blocks = self.memory.blocks_of(indices);
        let times = |rows: &Range<usize>, each: usize| rows.start * each * LANES..rows.end * each * LANES;
        let links = blocks.iter().map(|block| block.links.clone()).collect();
        let fruit = blocks.iter().map(|block| times(&block.fruit_rows, fruit::FIELDS)).collect();
        let states = blocks.iter().map(|block| times(&block.rows, 1)).collect();
        let memory = &mut self.memory;
        self.gpu.fetch(&mut [
            (&self.buffers.links, &mut memory.links, links),
            (&self.buffers.fruit, &mut memory.fruit, fruit),
        ])?;
        self.gpu.fetch(&mut [(&self.buffers.states, &mut memory.states, states)])
    }
}

/// What a world has gone through so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Statistics {
    /// Joints that broke.
    pub snapped: u32,
    /// Fruit that came off.
    pub detached: u32,
    /// Largest moment of a joint at the end of any frame, over the one that breaks it.
    pub peak_moment: f32,
    /// Kinetic, gravitational (zero at the height of the world's origin) and elastic energy of wood, stems and fruit [J], as `orchard_multibody::energy` sums it
    /// up.
    pub energy: f32,
}

//! News of lanes after frames: the device sends a few numbers of each lane, and the motion of a tree only if something happened to it or the host wants it.

use rayon::prelude::*;
use wgpu::BufferUsages;

use super::meeting::Meeting;
use super::quads::NOWHERE;
use crate::buffers::{check_limits, create_buffer};
use crate::clock::Clock;
use crate::device::{Gpu, GpuError};
use crate::layout::{QUAD, asked, told, wish};
use crate::memory::PlacedWord;
use orchard_robot::{Climb, Command, UnderLip};

/// Bytes of a quad.
const QUAD_BYTES: usize = 4 * QUAD;
/// Quads of a lane, and of a record of contacts.
const OWN: usize = told::FIELDS / QUAD;
const RECORD: usize = Meeting::NUMBERS / QUAD;
/// Threads of a workgroup of kernel `give`.
const GIVE_THREADS: usize = 64;
/// Slots are read before it is known how many were given: the wanted ones, `AS_MANY` times those that the last reading gave beyond them, and `SOME` and one for every `PER_SLOT` lanes. All are our own choice; slots beyond are read afterwards, which waits
/// for the work of other batches.
const AS_MANY: usize = 2;
const SOME: usize = 16;
const PER_SLOT: usize = 16;

/// Frames that the world of a lane is to take, as many as there are commands. All others stand still meanwhile.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Course<'a> {
    /// Command of each frame, at most as many as the lanes have room for.
    pub commands: &'a [Command],
    /// After which of the frames the motion of the tree is read.
    pub wish: Wish,
    /// Set point of the chassis' height, the same in each of them, so that a world on uneven ground takes one frame; zeros on level ground.
    pub climb: Climb,
    /// Points of the suction cup's lip over leaves, in all of the frames, and points on which something presses, in the first substep of each. The device itself finds the points that were pressed on in the substep before.
    pub under_lip: UnderLip,
}

/// Frames of a lane after which the motion of its tree is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wish {
    /// A few numbers; the motion of the tree only after the first frame in which something happens to it, and after those that follow.
    #[default]
    News,
    /// The motion of the tree after the last frame as well.
    Last,
    /// The motion of the tree after each.
    Each,
}

/// Question about a lane: its number of frames, and the wish about them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Question {
    /// Frames that it takes; with none, its motion as it is.
    pub frames: usize,
    pub wish: Wish,
}

impl Question {
    /// Number of frames, or instants, that are told of the lane.
    fn told(self) -> usize {
        if self.wish == Wish::News { self.frames } else { self.frames.max(1) }
    }

    /// Number of times that the motion of the tree is wanted.
    fn wanted(self) -> usize {
        match self.wish {
            Wish::News => 0,
            Wish::Last => 1,
            Wish::Each => self.told(),
        }
    }

    fn word(self) -> u32 {
        let wish = match self.wish {
            Wish::News if self.frames == 0 => wish::NOTHING,
            Wish::News => wish::NEWS,
            Wish::Last => wish::LAST,
            Wish::Each => wish::EACH,
        };
        (wish | self.frames << wish::FRAMES_BIT) as u32
    }
}

/// News of a lane since its world came, but for excess and tension, which are those of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct News {
    /// True if the motion of the tree was read.
    pub is_whole: bool,
    /// Pairs of colliders and contact points that were left out.
    pub lost: u32,
    /// Solves that did not converge.
    pub unsolved: u32,
    /// Impulse of the robot on live wood [N s].
    pub contact_impulse: f32,
    /// Largest sum of its forces on live wood in a substep \[N\].
    pub peak_contact_force: f32,
    /// Largest bending moment of a joint over its rupture moment, less what it was at the start of the episode; at least 0.
    pub excess: f32,
    /// Largest tension of a stem \[N\].
    pub tension: f32,
}

/// Questions about lanes, and the answers.
#[derive(Debug)]
pub(super) struct Told {
    lanes: usize,
    /// Room for links and fruit of a lane, and quads of the motion of a fruit.
    links: usize,
    fruit: usize,
    motion: usize,
    asked: wgpu::Buffer,
    told: wgpu::Buffer,
    given: wgpu::Buffer,
    staging: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    questions: Vec<Question>,
    /// Number of slots that the reading under way reads.
    copied: usize,
    /// Slots that the last reading gave beyond the wanted ones.
    more: usize,
    /// As they were read last: numbers of all lanes frame after frame; slots.
    numbers: Vec<[f32; QUAD]>,
    slots: Vec<[f32; QUAD]>,
}

impl Told {
    /// Makes the tables of some lanes, each with room for links and fruit, whose motion takes some quads, and for some frames. The buffers: tables, meetings, worlds, links, fruit.
    ///
    /// # Errors
    /// They do not fit into the device.
    pub fn new(
        gpu: &Gpu,
        lanes: usize,
        [links, fruit, motion, frames]: [usize; 4],
        of: [&wgpu::Buffer; 5],
    ) -> Result<Self, GpuError> {
        let each = links + (1 + motion) * fruit + RECORD;
        let quads = lanes * (frames * (OWN + each) + fruit);
        check_limits(gpu, lanes, QUAD_BYTES * quads, 0, lanes)?;
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let places = lanes * (links + motion * fruit);
        let asked = create_buffer(gpu, "asked", 4 * (asked::FIELDS + 2 * lanes + places), storage);
        let told = create_buffer(gpu, "told", QUAD_BYTES * quads, storage);
        let given = create_buffer(gpu, "given", 4, storage);
        let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = create_buffer(gpu, "staging", QUAD_BYTES * lanes * frames * (OWN + each), read);
        let mut words = vec![wish::NOTHING as u32; asked::FIELDS + 2 * lanes];
        for (field, value) in [
            (asked::LANES, lanes),
            (asked::LINKS, links),
            (asked::FRUIT, fruit),
            (asked::FRAMES, frames),
            (asked::MOTION, motion),
        ] {
            words[field] = value as u32;
        }
        words.resize(words.len() + places, NOWHERE);
        gpu.queue.write_buffer(&asked, 0, bytemuck::cast_slice(&words));
        let resources = of.into_iter().chain([&asked, &told, &given]);
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let layout = &gpu.quad_pipelines().tell_bindings;
        let bindings = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        });
        Ok(Self {
            lanes,
            links,
            fruit,
            motion,
            asked,
            told,
            given,
            staging,
            bindings,
            questions: vec![Question::default(); lanes],
            copied: 0,
            more: 0,
            numbers: vec![[0.0; QUAD]; lanes * frames * OWN],
            slots: Vec::new(),
        })
    }

    /// Quads of a slot.
    fn each(&self) -> usize {
        self.links + (1 + self.motion) * self.fruit + RECORD
    }

    /// The quads of the links and of the motion of the fruit of a lane, for [`Self::asked`].
    pub fn places_of(&self, lane: usize, [mut links, mut fruit]: [Vec<u32>; 2]) -> Vec<PlacedWord> {
        let first = asked::FIELDS + 2 * self.lanes;
        let of_fruit = first + self.lanes * self.links;
        links.resize(self.links, NOWHERE);
        fruit.resize(self.motion * self.fruit, NOWHERE);
        let from = |first: usize, places: Vec<u32>| {
            (first as u32..).zip(places).map(|(at, bits)| PlacedWord { at, bits })
        };
        let links = from(first + lane * self.links, links);
        links.chain(from(of_fruit + lane * self.motion * self.fruit, fruit)).collect()
    }

    /// The buffer of questions and places.
    pub fn asked(&self) -> &wgpu::Buffer {
        &self.asked
    }

    /// Sends the questions, one a lane, and in how many frames each has stood still; returns the number of frames that are told, of the lane with most.
    pub fn ask(&mut self, gpu: &Gpu, questions: Vec<Question>, missed: impl Iterator<Item = u32>) -> usize {
        let words: Vec<u32> = questions.iter().map(|question| question.word()).chain(missed).collect();
        gpu.queue.write_buffer(&self.asked, 4 * asked::FIELDS as u64, bytemuck::cast_slice(&words));
        gpu.queue.write_buffer(&self.given, 0, &0_u32.to_ne_bytes());
        self.questions = questions;
        self.frames()
    }

    /// Number of frames that are told, of the lane with most.
    pub fn frames(&self) -> usize {
        self.questions.iter().map(|question| question.told()).max().unwrap_or(0)
    }

    /// Encodes the kernel that gives the lanes their frames.
    pub fn encode_give(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, clock: &mut Option<Clock>) {
        let groups = self.lanes.div_ceil(GIVE_THREADS);
        self.encode(encoder, &gpu.quad_pipelines().give, ("give", groups), clock);
    }

    /// Encodes the kernel that tells of a frame.
    pub fn encode_tell(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, clock: &mut Option<Clock>) {
        self.encode(encoder, &gpu.quad_pipelines().tell, ("tell", self.lanes), clock);
    }

    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        kernel: &wgpu::ComputePipeline,
        (name, groups): (&'static str, usize),
        clock: &mut Option<Clock>,
    ) {
        let timestamp_writes = clock.as_mut().and_then(|clock| clock.stamp(name));
        let timed = wgpu::ComputePassDescriptor { label: None, timestamp_writes };
        let mut pass = encoder.begin_compute_pass(&timed);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.set_pipeline(kernel);
        pass.dispatch_workgroups(groups as u32, 1, 1);
    }

    /// Encodes the copy of the answers.
    pub fn encode_copy(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let most = self.questions.iter().map(|question| question.told()).sum();
        self.copied = (self.wanted() + AS_MANY * self.more + SOME + self.lanes / PER_SLOT).min(most);
        let numbers = (QUAD_BYTES * self.lanes * self.frames() * OWN) as u64;
        encoder.copy_buffer_to_buffer(&self.told, 0, &self.staging, 0, numbers);
        self.copy(encoder, 0, self.copied);
    }

    /// Number of times that the motion of a tree is wanted.
    fn wanted(&self) -> usize {
        self.questions.iter().map(|question| question.wanted()).sum()
    }

    /// The staging buffer up to the end of so many slots.
    fn staged(&self, slots: usize) -> wgpu::BufferSlice<'_> {
        self.staging.slice(..(QUAD_BYTES * (self.numbers.len() + slots * self.each())) as u64)
    }

    /// Maps the copy of the answers, which was submitted. A lost device is reported by the wait.
    pub fn map(&self) {
        self.staged(self.copied).map_async(wgpu::MapMode::Read, |_| {});
    }

    /// Copies slots, the first of which is in its place in the staging buffer behind the numbers of all lanes.
    fn copy(&self, encoder: &mut wgpu::CommandEncoder, first: usize, count: usize) {
        if count == 0 {
            return;
        }
        let (numbers, each) = (self.numbers.len(), self.each());
        let from = (QUAD_BYTES * (numbers + self.lanes * self.fruit + first * each)) as u64;
        let to = (QUAD_BYTES * (numbers + first * each)) as u64;
        let bytes = (QUAD_BYTES * count * each) as u64;
        encoder.copy_buffer_to_buffer(&self.told, from, &self.staging, to, bytes);
    }

    /// Takes the answers out of the mapped buffer, after the wait for their submission. Work submitted behind it goes on, unless more happened than was foreseen.
    ///
    /// # Errors
    /// The device was lost.
    pub fn fetch(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        let copied = self.copied;
        self.take(0, copied)?;
        let told = self
            .questions
            .iter()
            .enumerate()
            .flat_map(|(lane, question)| (0..question.told()).map(move |frame| (lane, frame)));
        let slots = told.filter_map(|(lane, frame)| self.slot(lane, frame));
        let given = slots.map(|slot| slot + 1).max().unwrap_or(0);
        if given > copied {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            self.copy(&mut encoder, copied, given - copied);
            let asked = gpu.queue.submit([encoder.finish()]);
            self.copied = given;
            self.map();
            gpu.wait_for(Some(asked))?;
            self.take(copied, given)?;
        }
        self.more = given.saturating_sub(self.wanted());
        Ok(())
    }

    /// Takes the numbers of all lanes, and slots from one to another, out of the mapped buffer.
    fn take(&mut self, first: usize, end: usize) -> Result<(), GpuError> {
        let each = self.each();
        let view = self.staged(end).get_mapped_range().map_err(|e| GpuError::Lost(e.to_string()))?;
        let mapped: &[[f32; QUAD]] = bytemuck::cast_slice(&view);
        let told = self.lanes * self.frames() * OWN;
        self.numbers[..told].copy_from_slice(&mapped[..told]);
        self.slots.resize((end * each).max(self.slots.len()), [0.0; QUAD]);
        let slots = &mapped[self.numbers.len()..];
        let (here, there) = (&mut self.slots[first * each..end * each], &slots[first * each..]);
        here.par_chunks_mut(each)
            .zip(there.par_chunks(each))
            .for_each(|(here, there)| here.copy_from_slice(there));
        drop(view);
        self.staging.unmap();
        Ok(())
    }

    fn number(&self, lane: usize, frame: usize, field: usize) -> f32 {
        self.numbers[(frame * self.lanes + lane) * OWN + field / QUAD][field % QUAD]
    }

    /// The slot of a lane after a frame.
    fn slot(&self, lane: usize, frame: usize) -> Option<usize> {
        let slot = self.number(lane, frame, told::SLOT).to_bits();
        (slot != NOWHERE).then_some(slot as usize)
    }

    /// News of a lane after a frame that it took.
    pub fn news(&self, lane: usize, frame: usize) -> News {
        News {
            is_whole: self.slot(lane, frame).is_some(),
            lost: self.number(lane, frame, told::LOST).to_bits(),
            unsolved: self.number(lane, frame, told::UNSOLVED).to_bits(),
            contact_impulse: self.number(lane, frame, told::IMPULSE),
            peak_contact_force: self.number(lane, frame, told::PEAK),
            excess: self.number(lane, frame, told::EXCESS),
            tension: self.number(lane, frame, told::TENSION),
        }
    }

    /// Motion of the tree of a lane after a frame that it took, if it was read.
    pub fn whole(&self, lane: usize, frame: usize) -> Option<Whole<'_>> {
        let each = self.each();
        let quads = self.slots.get(self.slot(lane, frame)? * each..)?.get(..each)?;
        let (links, rest) = quads.split_at(self.links);
        let (fruit, rest) = rest.split_at(self.motion * self.fruit);
        let (record, before) = rest.split_at(RECORD);
        Some(Whole { links, fruit, record, before })
    }
}

/// Motion of a lane's tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Whole<'a> {
    /// Angles and rates of each link.
    pub links: &'a [[f32; QUAD]],
    /// Motion of each fruit: place, velocity, and spin or stem's arm; of a stem that bends also rotation, rate and rest, the last two with the wear.
    pub fruit: &'a [[f32; QUAD]],
    /// Beginning of the record of contacts.
    pub record: &'a [[f32; QUAD]],
    /// Velocity of each fruit a frame ago.
    pub before: &'a [[f32; QUAD]],
}

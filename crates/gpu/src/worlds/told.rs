//! News of lanes after a frame: the device sends a few numbers of each lane, and the motion of a tree only if something happened to it or the host wants it.

use rayon::prelude::*;
use wgpu::BufferUsages;

use super::meeting::Meeting;
use super::quads::NOWHERE;
use crate::buffers::{check_limits, create_buffer};
use crate::clock::Clock;
use crate::device::{Gpu, GpuError};
use crate::layout::{QUAD, asked, told, wish};

/// Bytes of a quad.
const QUAD_BYTES: usize = 4 * QUAD;
/// Quads of a lane, and of a record of contacts.
const OWN: usize = told::FIELDS / QUAD;
const RECORD: usize = Meeting::NUMBERS / QUAD;
/// Quads of the motion of a fruit.
pub(super) const MOTION: usize = 3;
/// Slots are read before it is known how many were given: the wanted ones, `AS_MANY` times those that the last frame gave beyond them, and `SOME`. Both are our own choice; slots beyond are read afterwards.
const AS_MANY: usize = 2;
const SOME: usize = 16;

/// Wish about a lane after a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wish {
    /// Nothing is asked.
    #[default]
    Nothing,
    /// A few numbers; the motion of the tree only if something happened to it.
    News,
    /// The motion of the tree as well.
    Whole,
}

/// News of a lane since its world came, but for excess and tension, which are those of the latest frame.
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
    /// Room for links and fruit of a lane.
    links: usize,
    fruit: usize,
    asked: wgpu::Buffer,
    told: wgpu::Buffer,
    given: wgpu::Buffer,
    staging: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    wishes: Vec<Wish>,
    /// The reading under way, and how many slots it reads.
    reading: Option<(wgpu::SubmissionIndex, usize)>,
    /// Slots that the last frame gave beyond the wanted ones.
    more: usize,
    /// As they were read last: numbers of all lanes, then slots.
    numbers: Vec<[f32; QUAD]>,
    slots: Vec<[f32; QUAD]>,
}

impl Told {
    /// Makes the tables of some lanes, each with room for links and fruit. The buffers: tables, meetings, worlds, links, fruit.
    ///
    /// # Errors
    /// They do not fit into the device.
    pub fn new(
        gpu: &Gpu,
        lanes: usize,
        [links, fruit]: [usize; 2],
        of: [&wgpu::Buffer; 5],
    ) -> Result<Self, GpuError> {
        let each = links + (1 + MOTION) * fruit + RECORD;
        let quads = lanes * (OWN + fruit + each);
        check_limits(gpu, lanes, QUAD_BYTES * quads, lanes)?;
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let places = lanes * (links + MOTION * fruit);
        let asked = create_buffer(gpu, "asked", 4 * (asked::FIELDS + lanes + places), storage);
        let told = create_buffer(gpu, "told", QUAD_BYTES * quads, storage);
        let given = create_buffer(gpu, "given", 4, storage);
        let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = create_buffer(gpu, "staging", QUAD_BYTES * lanes * (OWN + each), read);
        let mut words = vec![wish::NOTHING as u32; asked::FIELDS + lanes];
        for (field, value) in [(asked::LANES, lanes), (asked::LINKS, links), (asked::FRUIT, fruit)] {
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
            asked,
            told,
            given,
            staging,
            bindings,
            wishes: vec![Wish::Nothing; lanes],
            reading: None,
            more: 0,
            numbers: vec![[0.0; QUAD]; lanes * OWN],
            slots: Vec::new(),
        })
    }

    /// Quads of a slot.
    fn each(&self) -> usize {
        self.links + (1 + MOTION) * self.fruit + RECORD
    }

    /// Sets the quads of the links and of the fruit of a lane, three by three.
    pub fn set_places(&self, gpu: &Gpu, lane: usize, [mut links, mut fruit]: [Vec<u32>; 2]) {
        let first = asked::FIELDS + self.lanes;
        let of_fruit = first + self.lanes * self.links;
        links.resize(self.links, NOWHERE);
        fruit.resize(MOTION * self.fruit, NOWHERE);
        for (at, places) in
            [(first + lane * self.links, links), (of_fruit + lane * MOTION * self.fruit, fruit)]
        {
            gpu.queue.write_buffer(&self.asked, 4 * at as u64, bytemuck::cast_slice(&places));
        }
    }

    /// Submits the questions, one a lane, behind all work submitted so far.
    pub fn ask(&mut self, gpu: &Gpu, wishes: &[Wish], clock: Option<&mut Clock>) {
        self.wishes.copy_from_slice(wishes);
        let words = wishes.iter().map(|wish| match wish {
            Wish::Nothing => wish::NOTHING as u32,
            Wish::News => wish::NEWS as u32,
            Wish::Whole => wish::WHOLE as u32,
        });
        let words: Vec<u32> = words.collect();
        gpu.queue.write_buffer(&self.asked, 4 * asked::FIELDS as u64, bytemuck::cast_slice(&words));
        gpu.queue.write_buffer(&self.given, 0, &0_u32.to_ne_bytes());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let timestamp_writes = clock.and_then(|clock| clock.stamp("tell"));
            let timed = wgpu::ComputePassDescriptor { label: None, timestamp_writes };
            let mut pass = encoder.begin_compute_pass(&timed);
            pass.set_bind_group(0, &self.bindings, &[]);
            pass.set_pipeline(&gpu.quad_pipelines().tell);
            pass.dispatch_workgroups(self.lanes as u32, 1, 1);
        }
        let most = wishes.iter().filter(|wish| **wish != Wish::Nothing).count();
        let slots = (self.wanted() + AS_MANY * self.more + SOME).min(most);
        let own = (QUAD_BYTES * self.lanes * OWN) as u64;
        encoder.copy_buffer_to_buffer(&self.told, 0, &self.staging, 0, own);
        self.copy(&mut encoder, 0, slots);
        self.reading = Some((gpu.queue.submit([encoder.finish()]), slots));
        self.map(slots);
    }

    /// The reading under way.
    pub fn asked(&self) -> Option<wgpu::SubmissionIndex> {
        self.reading.as_ref().map(|(asked, _)| asked.clone())
    }

    /// Number of lanes of which the motion is wanted.
    fn wanted(&self) -> usize {
        self.wishes.iter().filter(|wish| **wish == Wish::Whole).count()
    }

    /// The staging buffer up to the end of so many slots.
    fn staged(&self, slots: usize) -> wgpu::BufferSlice<'_> {
        self.staging.slice(..(QUAD_BYTES * (self.lanes * OWN + slots * self.each())) as u64)
    }

    /// Maps the staging buffer. A lost device is reported by the wait.
    fn map(&self, slots: usize) {
        self.staged(slots).map_async(wgpu::MapMode::Read, |_| {});
    }

    /// Copies slots, the first of which is in its place in the staging buffer behind the numbers of all lanes.
    fn copy(&self, encoder: &mut wgpu::CommandEncoder, first: usize, count: usize) {
        if count == 0 {
            return;
        }
        let (own, each) = (self.lanes * OWN, self.each());
        let from = (QUAD_BYTES * (own + self.lanes * self.fruit + first * each)) as u64;
        let to = (QUAD_BYTES * (own + first * each)) as u64;
        let bytes = (QUAD_BYTES * count * each) as u64;
        encoder.copy_buffer_to_buffer(&self.told, from, &self.staging, to, bytes);
    }

    /// Waits for the answers, if there was a question. Work submitted behind it goes on, unless more happened than was foreseen.
    ///
    /// # Errors
    /// The device was lost.
    pub fn fetch(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        let Some((asked, copied)) = self.reading.take() else { return Ok(()) };
        gpu.wait_for(Some(asked))?;
        self.take(0, copied)?;
        let given =
            (0..self.lanes).filter_map(|lane| self.slot(lane)).map(|slot| slot + 1).max().unwrap_or(0);
        if given > copied {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            self.copy(&mut encoder, copied, given - copied);
            let asked = gpu.queue.submit([encoder.finish()]);
            self.map(given);
            gpu.wait_for(Some(asked))?;
            self.take(copied, given)?;
        }
        self.more = given.saturating_sub(self.wanted());
        Ok(())
    }

    /// Takes the numbers of all lanes, and slots from one to another, out of the mapped buffer.
    fn take(&mut self, first: usize, end: usize) -> Result<(), GpuError> {
        let (own, each) = (self.lanes * OWN, self.each());
        let view = self.staged(end).get_mapped_range().map_err(|e| GpuError::Lost(e.to_string()))?;
        let mapped: &[[f32; QUAD]] = bytemuck::cast_slice(&view);
        self.numbers.copy_from_slice(&mapped[..own]);
        self.slots.resize((end * each).max(self.slots.len()), [0.0; QUAD]);
        let (here, there) = (&mut self.slots[first * each..end * each], &mapped[own + first * each..]);
        here.par_chunks_mut(each)
            .zip(there.par_chunks(each))
            .for_each(|(here, there)| here.copy_from_slice(there));
        drop(view);
        self.staging.unmap();
        Ok(())
    }

    fn number(&self, lane: usize, field: usize) -> f32 {
        self.numbers[lane * OWN + field / QUAD][field % QUAD]
    }

    fn slot(&self, lane: usize) -> Option<usize> {
        let slot = self.number(lane, told::SLOT).to_bits();
        (self.wishes[lane] != Wish::Nothing && slot != NOWHERE).then_some(slot as usize)
    }

    /// News of a lane about which something was asked.
    pub fn news(&self, lane: usize) -> News {
        News {
            is_whole: self.slot(lane).is_some(),
            lost: self.number(lane, told::LOST).to_bits(),
            unsolved: self.number(lane, told::UNSOLVED).to_bits(),
            contact_impulse: self.number(lane, told::IMPULSE),
            peak_contact_force: self.number(lane, told::PEAK),
            excess: self.number(lane, told::EXCESS),
            tension: self.number(lane, told::TENSION),
        }
    }

    /// Motion of the tree of a lane, if it was read.
    pub fn whole(&self, lane: usize) -> Option<Whole<'_>> {
        let each = self.each();
        let quads = self.slots.get(self.slot(lane)? * each..)?.get(..each)?;
        let (links, rest) = quads.split_at(self.links);
        let (fruit, rest) = rest.split_at(MOTION * self.fruit);
        let (record, before) = rest.split_at(RECORD);
        Some(Whole { links, fruit, record, before })
    }
}

/// Motion of a lane's tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Whole<'a> {
    /// Angles and rates of each link.
    pub links: &'a [[f32; QUAD]],
    /// Place, velocity, and spin or stem's arm of each fruit.
    pub fruit: &'a [[f32; QUAD]],
    /// Beginning of the record of contacts.
    pub record: &'a [[f32; QUAD]],
    /// Velocity of each fruit a frame ago.
    pub before: &'a [[f32; QUAD]],
}

//! A tile: one world a lane of a vector, their numbers side by side.

mod breaking;
mod load;
mod quarantine;
mod stems;
mod wind;

use crate::fault::Status;
use crate::isa::Isa;
use crate::kernel::{Found, Numbers, Phase, Step, Work};
use crate::lane_world::LaneWorld;
use crate::layout::{Aligned, fruit, limit, link, work};
use crate::schedule::{Schedule, Walk};
use crate::tree_world::{TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use wind::LaneAir;

/// Event of a world of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct BatchEvent {
    /// Frame, from 1.
    pub frame: u32,
    /// Index of the world.
    pub world: usize,
    /// The event.
    pub event: TreeEvent,
}

/// Some worlds, one a lane: all with fruit on stems that bend, or all with fruit on tethers.
#[derive(Debug, Clone)]
pub(crate) struct Tile {
    isa: Isa,
    lanes: usize,
    numbers: Numbers,
    /// Frames in a row that a joint was over its limit, by row and lane.
    bend_frames: Vec<u32>,
    /// Frames in a row that a stem was over either limit, by row of fruit and lane.
    stretch_frames: Vec<u32>,
    pull_frames: Vec<u32>,
    /// True if any of these counts is above 0.
    is_counting: bool,
    worlds: Vec<LaneWorld>,
    /// External force and torque about the centre of mass, by link.
    pushes: Vec<Push>,
    /// Air of each world; empty in still air.
    airs: Vec<Option<LaneAir>>,
    /// Memory for the air.
    scratch: Aligned,
    /// True if an input has changed since the last outward pass.
    is_stale: bool,
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
            worlds.iter().map(|(_, world)| Walk::in_turns(&world.plant().tree.parent)).collect();
        // As many rows of fruit at a row of links as the fullest lane needs.
        let fruit_at: Vec<Vec<Vec<usize>>> =
            worlds.iter().zip(&walks).map(|((_, world), walk)| fruit_by_row(world, walk)).collect();
        let longest = walks.iter().map(|walk| walk.links.len()).max().unwrap_or(0);
        let fruit_rows: Vec<usize> = (0..longest)
            .map(|row| fruit_at.iter().map(|rows| rows.get(row).map_or(0, Vec::len)).max().unwrap_or(0))
            .collect();
        let schedule = Schedule::new(&walks.iter().collect::<Vec<_>>(), lanes, &fruit_rows);
        let (rows, fruit_rows) = (schedule.rows.len(), schedule.fruit_rows());
        let has_stems = worlds[0].1.has_stems();
        let spec = &worlds[0].1.plant().spec;
        let mut tile = Tile {
            isa,
            lanes,
            numbers: Numbers::new(schedule, lanes, has_stems),
            bend_frames: vec![0; rows * lanes],
            stretch_frames: vec![0; fruit_rows * lanes],
            pull_frames: vec![0; fruit_rows * lanes],
            is_counting: false,
            worlds: Vec::new(),
            pushes: Vec::new(),
            airs: Vec::new(),
            scratch: Aligned::zeros(0),
            is_stale: true,
            step: Step {
                h: spec.sim.substep() as f32,
                gravity: spec.sim.gravity.si() as f32,
                has_loose: false,
            },
            substeps: spec.sim.substeps.get(),
            frame: 0,
            events: Vec::new(),
        };
        tile.expect_wind(worlds, &walks);
        (0..lanes).for_each(|lane| tile.pad(lane));
        for (lane, ((&(index, world), walk), fruit_at)) in worlds.iter().zip(walks).zip(fruit_at).enumerate()
        {
            let mut fruit_row = vec![0; world.plant().fruit.len()];
            for (row, here) in fruit_at.iter().enumerate() {
                for (k, &fruit) in here.iter().enumerate() {
                    fruit_row[fruit] = tile.numbers.schedule.rows[row].fruit.0 + k;
                }
            }
            tile.worlds.push(LaneWorld::new(index, world, walk, fruit_row, 0));
            tile.load_lane(lane, world);
        }
        tile
    }

    fn stem_limit_mut(&mut self, fruit_row: usize, field: usize, lane: usize) -> &mut f32 {
        &mut self.numbers.stem_limits.as_mut_slice()[(fruit_row * limit::FIELDS + field) * self.lanes + lane]
    }

    /// Puts a lane's world back to its state at rest.
    pub fn reset(&mut self, lane: usize) {
        let LaneWorld { index, ref plant, ref walk, ref fruit_row, .. } = self.worlds[lane];
        let world = TreeWorld::at_rest(plant.clone());
        self.worlds[lane] = LaneWorld::new(index, &world, walk.clone(), fruit_row.clone(), self.frame);
        self.events.retain(|event| event.world != index);
        self.empty(lane);
        self.load_lane(lane, &world);
    }

    /// State of a lane's world.
    pub fn status(&self, lane: usize) -> Status {
        self.worlds[lane].status()
    }

    /// Sets the external force \[N\] and torque [N m] on a link, at and about its centre of mass.
    pub fn push(&mut self, lane: usize, segment: usize, force_world: Vec3, torque_world: Vec3) {
        if !self.worlds[lane].is_running() {
            return;
        }
        let Some(row) = self.worlds[lane].walk.links.iter().position(|link| *link == segment) else { return };
        self.pushes.retain(|push| (push.row, push.lane) != (row, lane));
        if !self.worlds[lane].rupture.is_debris(segment) {
            self.pushes.push(Push { row, lane, force_world, torque_world });
        }
        self.is_stale = true;
    }

    /// Sets the external force on a fruit \[N\].
    pub fn pull(&mut self, lane: usize, fruit_index: usize, force_world: Vec3) {
        if !self.worlds[lane].is_running() {
            return;
        }
        let row = self.worlds[lane].fruit_row[fruit_index];
        for k in 0..3 {
            *self.pull_mut(row, k, lane) = force_world[k] as f32;
        }
        self.is_stale = true;
    }

    /// Advances all worlds by whole frames.
    pub fn run(&mut self, frames: u32) {
        for _ in 0..frames {
            for left in (0..self.substeps).rev() {
                if self.is_stale {
                    self.sample_air(self.frame);
                    self.work(Phase::Start, true);
                    self.push_links();
                }
                self.meet_ground();
                self.brake();
                let is_last = left == 0;
                if is_last {
                    self.sample_air(self.frame + 1);
                }
                let found = self.work(Phase::Advance, is_last);
                self.push_links();
                if found.over_limit {
                    self.wear_stems();
                }
            }
            self.frame += 1;
            let found = self.work(Phase::Test, false);
            if found.non_finite || self.worlds.iter().any(|world| world.bad_spin().is_some()) {
                self.quarantine();
            }
            // Rarely is anything over a limit, or was it so a frame ago.
            if found.over_limit || self.is_counting {
                self.is_counting = false;
                self.snap();
                self.detach();
            }
        }
    }

    fn work(&mut self, phase: Phase, blows: bool) -> Found {
        self.step.has_loose = self.worlds.iter().any(|world| !world.loose.is_empty());
        self.isa.run(Work { numbers: &mut self.numbers, step: self.step, phase, blows })
    }

    /// Adds the pushes to the impulses of a new state.
    fn push_links(&mut self) {
        self.is_stale = false;
        let (lanes, h) = (self.lanes, f64::from(self.step.h));
        for push in &self.pushes {
            let work = self.numbers.work.as_mut_slice();
            let at = |field: usize| (push.row * work::FIELDS + field) * lanes + push.lane;
            let r_com = 0.5 * Vec3::from_fn(|k, _| f64::from(work[at(work::D + k)]));
            let torque = push.torque_world + r_com.cross(&push.force_world);
            for k in 0..3 {
                work[at(work::RESISTANCE + k)] -= (h * torque[k]) as f32;
                work[at(work::RESISTANCE + 3 + k)] -= (h * push.force_world[k]) as f32;
            }
        }
    }

    /// Takes the events since the last call.
    pub fn drain_events(&mut self) -> std::vec::Drain<'_, BatchEvent> {
        self.events.drain(..)
    }

    /// Bytes of the tile's numbers.
    pub fn bytes(&self) -> usize {
        let counts = self.bend_frames.len() + self.stretch_frames.len() + self.pull_frames.len();
        let of_airs: usize = self.airs.iter().flatten().map(LaneAir::bytes).sum();
        self.numbers.bytes() + size_of::<u32>() * counts + of_airs
    }

    /// A number of a lane's world, quarantined or not.
    fn link(&self, row: usize, field: usize, lane: usize) -> f32 {
        let at = row * link::FIELDS + field;
        match self.worlds[lane].remains() {
            Some(remains) => remains.links[at],
            None => self.numbers.links.as_slice()[at * self.lanes + lane],
        }
    }

    fn link_mut(&mut self, row: usize, field: usize, lane: usize) -> &mut f32 {
        &mut self.numbers.links.as_mut_slice()[(row * link::FIELDS + field) * self.lanes + lane]
    }

    /// A fruit's number of a lane's world, quarantined or not.
    fn fruit(&self, row: usize, field: usize, lane: usize) -> f32 {
        let at = row * fruit::FIELDS + field;
        match self.worlds[lane].remains() {
            Some(remains) => remains.fruit[at],
            None => self.numbers.fruit.as_slice()[at * self.lanes + lane],
        }
    }

    fn fruit_mut(&mut self, row: usize, field: usize, lane: usize) -> &mut f32 {
        &mut self.numbers.fruit.as_mut_slice()[(row * fruit::FIELDS + field) * self.lanes + lane]
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

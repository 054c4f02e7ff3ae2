//! Seats: a lockstep shared by threads, each of which runs one world as if it were alone.
//!
//! A thread takes a seat, builds its world, and steps it; its step returns when all seats that are taken have given their commands and the frame is over. So code that runs one world after the other, an episode of the
//! benchmark for one, needs no change to run many at once.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use orchard_gpu::GpuError;
use orchard_robot::Command;
use orchard_world::World;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::lane::{Lockstep, LockstepError};
use crate::step::Turn;
use crate::tally::Tally;

/// A lockstep shared by threads.
#[derive(Debug)]
pub struct Seats {
    table: Mutex<Table>,
    /// Told when a frame is over, or a seat is free.
    changed: Condvar,
    pool: ThreadPool,
}

#[derive(Debug)]
struct Table {
    lockstep: Lockstep,
    free: Vec<usize>,
    /// Seats taken.
    taken: usize,
    /// Worlds that wait for the frame, by lane, with their commands.
    waiting: Vec<Option<(Box<World>, Command)>>,
    /// Worlds whose frame is over, by lane.
    done: Vec<Option<Box<World>>>,
    /// The error that ended everything.
    lost: Option<String>,
}

/// A seat, which is given back when it is dropped.
#[derive(Debug)]
pub struct Seat {
    seats: Arc<Seats>,
    lane: usize,
}

impl Seats {
    /// Shares a lockstep; `threads` compute its frames beside the device.
    ///
    /// # Errors
    /// The threads cannot be started.
    pub fn new(lockstep: Lockstep, threads: usize) -> Result<Arc<Self>, ThreadPoolBuildError> {
        let lanes = lockstep.len();
        let table = Table {
            lockstep,
            free: (0..lanes).rev().collect(),
            taken: 0,
            waiting: (0..lanes).map(|_| None).collect(),
            done: (0..lanes).map(|_| None).collect(),
            lost: None,
        };
        let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
        Ok(Arc::new(Self { table: Mutex::new(table), changed: Condvar::new(), pool }))
    }

    fn table(&self) -> MutexGuard<'_, Table> {
        // A thread that panicked has left the table between two frames.
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a seat, and waits for one if none is free. The others wait from now on until this thread steps its world or leaves.
    pub fn take(self: &Arc<Self>) -> Seat {
        let mut table = self.table();
        loop {
            if let Some(lane) = table.free.pop() {
                table.taken += 1;
                return Seat { seats: self.clone(), lane };
            }
            table = self.changed.wait(table).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Counts of all frames so far.
    pub fn tally(&self) -> Tally {
        self.table().lockstep.tally().clone()
    }

    /// Reason for which the device was lost, if it was.
    pub fn lost(&self) -> Option<String> {
        self.table().lost.clone()
    }

    /// Computes a frame if all seats that are taken have their commands.
    fn step_if_all_wait(&self, table: &mut Table) {
        let waiting = table.waiting.iter().flatten().count();
        if waiting == 0 || waiting < table.taken {
            return;
        }
        let Table { lockstep, waiting, done, lost, .. } = table;
        let mut worlds: Vec<(usize, Box<World>, Command)> = waiting
            .iter_mut()
            .enumerate()
            .filter_map(|(lane, slot)| slot.take().map(|(world, command)| (lane, world, command)))
            .collect();
        if lost.is_none() {
            let stepped: Result<(), GpuError> = self.pool.install(|| {
                let turns = worlds.iter_mut().map(|(lane, world, command)| Turn {
                    lane: *lane,
                    world,
                    command: *command,
                });
                lockstep.step(&mut turns.collect::<Vec<_>>())
            });
            *lost = stepped.err().map(|e| e.to_string());
        }
        for (lane, world, _) in worlds {
            done[lane] = Some(world);
        }
        self.changed.notify_all();
    }
}

impl Seat {
    /// Lets a world sit here.
    ///
    /// # Errors
    /// The device cannot step it.
    pub fn enter(&self, world: &World) -> Result<(), LockstepError> {
        self.seats.table().lockstep.enter(self.lane, world)
    }

    /// Advances the world that sits here by a frame, together with all others. Once the device is lost ([`Seats::lost`]) no world moves any more.
    pub fn step(&self, world: Box<World>, command: Command) -> Box<World> {
        let mut table = self.seats.table();
        table.waiting[self.lane] = Some((world, command));
        self.seats.step_if_all_wait(&mut table);
        loop {
            if let Some(world) = table.done[self.lane].take() {
                return world;
            }
            table = self.seats.changed.wait(table).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut table = self.seats.table();
        table.lockstep.leave(self.lane);
        table.free.push(self.lane);
        table.taken -= 1;
        self.seats.step_if_all_wait(&mut table);
        self.seats.changed.notify_all();
    }
}

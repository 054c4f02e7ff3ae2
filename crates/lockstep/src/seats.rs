//! Seats: locksteps shared by threads, each of which runs one world as if it were alone.
//!
//! A thread takes a seat, builds its world, and steps it; its step returns when all seats of the crew that are taken have given their commands and the frame is over. So code that runs one world after the other, an episode of the
//! benchmark for one, needs no change to run many at once. While one crew's frame is on the device, the threads of the other compute their commands.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use orchard_gpu::{Gpu, GpuError};
use orchard_robot::Command;
use orchard_world::{Turn, World};
use rayon::ThreadPool;
use rayon::prelude::*;

use crate::eyes::Eyes;
use crate::lane::{Lockstep, LockstepError};
use crate::tally::Tally;

/// Locksteps shared by threads.
#[derive(Debug)]
pub struct Seats {
    crews: Vec<Crew>,
    /// Crew and lane of the seats that are free.
    free: Mutex<Vec<(usize, usize)>>,
    /// Told when a seat is free.
    freed: Condvar,
    pool: Arc<ThreadPool>,
}

/// Seats of one lockstep, whose worlds advance together.
#[derive(Debug)]
struct Crew {
    table: Mutex<Table>,
    /// By lane. A thread waits at its own: all that are told at one place would have to pass one lock, one by one.
    desks: Vec<Desk>,
}

#[derive(Debug)]
struct Table {
    lockstep: Lockstep,
    /// Draws the worlds' images; none once it could not, and the worlds draw their own.
    eyes: Option<Eyes>,
    /// Reason for that.
    undrawn: Option<String>,
    /// Seats taken, and those of them that wait for the frame.
    taken: usize,
    waits: usize,
    /// Worlds that wait for the frame, by lane, with their commands.
    waiting: Vec<Option<(Box<World>, Command)>>,
    /// The error that ended everything.
    lost: Option<String>,
}

/// Place where a thread waits for its world.
#[derive(Debug, Default)]
struct Desk {
    /// The world after its frame.
    done: Mutex<Option<Box<World>>>,
    told: Condvar,
}

/// A seat, which is given back when it is dropped.
#[derive(Debug)]
pub struct Seat {
    seats: Arc<Seats>,
    crew: usize,
    lane: usize,
}

/// Calls a function on a thread of no pool, and waits. A thread of a pool that waits for another pool meanwhile takes up other work of its own: here that may be the next episode,
/// which would wait for the lock that this thread holds.
fn outside(call: impl FnOnce() + Send) {
    std::thread::scope(|scope| {
        if let Err(panic) = scope.spawn(call).join() {
            std::panic::resume_unwind(panic);
        }
    });
}

/// Locks data that a thread which panicked has left between two frames.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Seats {
    /// Shares locksteps on a device, which draws the images of their worlds, too; the threads of `pool` compute their frames beside the device. They must not be those that take seats.
    pub fn new(gpu: &Gpu, crews: Vec<Lockstep>, pool: Arc<ThreadPool>) -> Arc<Self> {
        let mut free: Vec<(usize, usize)> = crews
            .iter()
            .enumerate()
            .flat_map(|(crew, of)| (0..of.len()).map(move |lane| (crew, lane)))
            .collect();
        // The last is taken first: lane by lane, the crews in turn.
        free.sort_unstable_by_key(|&(crew, lane)| std::cmp::Reverse((lane, crew)));
        let crews = crews.into_iter().map(|lockstep| {
            let lanes = lockstep.len();
            let waiting = (0..lanes).map(|_| None).collect();
            let table = Table {
                lockstep,
                eyes: Some(Eyes::new(gpu)),
                undrawn: None,
                taken: 0,
                waits: 0,
                waiting,
                lost: None,
            };
            Crew { table: Mutex::new(table), desks: (0..lanes).map(|_| Desk::default()).collect() }
        });
        Arc::new(Self { crews: crews.collect(), free: Mutex::new(free), freed: Condvar::new(), pool })
    }

    /// Takes a seat, and waits for one if none is free. The others of its crew wait from now on until this thread steps its world or leaves.
    pub fn take(self: &Arc<Self>) -> Seat {
        let mut free = lock(&self.free);
        let (crew, lane) = loop {
            match free.pop() {
                Some(place) => break place,
                None => free = self.freed.wait(free).unwrap_or_else(PoisonError::into_inner),
            }
        };
        drop(free);
        lock(&self.crews[crew].table).taken += 1;
        Seat { seats: self.clone(), crew, lane }
    }

    /// Counts of all frames so far.
    pub fn tally(&self) -> Tally {
        let tables = self.crews.iter().map(|crew| lock(&crew.table));
        tables.fold(Tally::default(), |tally, table| tally.with(table.lockstep.tally()))
    }

    /// Reason for which the device does not draw the images of some worlds any more, if there is one.
    pub fn undrawn(&self) -> Option<String> {
        self.crews.iter().find_map(|crew| lock(&crew.table).undrawn.clone())
    }

    /// Reason for which the device was lost, if it was.
    pub fn lost(&self) -> Option<String> {
        self.crews.iter().find_map(|crew| lock(&crew.table).lost.clone())
    }
}

impl Crew {
    /// Computes a frame if all seats that are taken have their commands.
    fn step_if_all_wait(&self, table: &mut Table, pool: &ThreadPool) {
        if table.waits == 0 || table.waits < table.taken {
            return;
        }
        table.waits = 0;
        let Table { lockstep, eyes, undrawn, waiting, lost, .. } = table;
        let mut worlds: Vec<(usize, Box<World>, Command)> = waiting
            .iter_mut()
            .enumerate()
            .filter_map(|(lane, slot)| slot.take().map(|(world, command)| (lane, world, command)))
            .collect();
        outside(|| {
            pool.install(|| {
                if lost.is_none() {
                    let turns = worlds.iter_mut().map(|(lane, world, command)| Turn {
                        lane: *lane,
                        world,
                        command: *command,
                        is_whole: true,
                    });
                    let stepped: Result<(), GpuError> = lockstep.step(&mut turns.collect::<Vec<_>>());
                    *lost = stepped.err().map(|e| e.to_string());
                    if let (Some(own), None) = (eyes.as_mut(), &lost) {
                        let each = worlds.iter_mut().map(|(lane, world, _)| (*lane, &mut **world));
                        match own.prepare(&mut each.collect::<Vec<_>>()) {
                            Ok(()) => {}
                            Err(e @ GpuError::Lost(_)) => *lost = Some(e.to_string()),
                            Err(e) => (*eyes, *undrawn) = (None, Some(e.to_string())),
                        }
                    }
                }
                worlds.into_par_iter().for_each(|(lane, world, _)| {
                    let desk = &self.desks[lane];
                    *lock(&desk.done) = Some(world);
                    desk.told.notify_one();
                });
            });
        });
    }
}

impl Seat {
    fn crew(&self) -> &Crew {
        &self.seats.crews[self.crew]
    }

    /// Lets a world sit here.
    ///
    /// # Errors
    /// The device cannot step it.
    pub fn enter(&self, world: &World) -> Result<(), LockstepError> {
        lock(&self.crew().table).lockstep.enter(&[(self.lane, world)])
    }

    /// Advances the world that sits here by a frame, together with all others of its crew. Once the device is lost ([`Seats::lost`]) no world moves any more.
    pub fn step(&self, world: Box<World>, command: Command) -> Box<World> {
        let crew = self.crew();
        let mut table = lock(&crew.table);
        table.waiting[self.lane] = Some((world, command));
        table.waits += 1;
        crew.step_if_all_wait(&mut table, &self.seats.pool);
        drop(table);
        let desk = &crew.desks[self.lane];
        let mut done = lock(&desk.done);
        loop {
            if let Some(world) = done.take() {
                return world;
            }
            done = desk.told.wait(done).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let crew = self.crew();
        let mut table = lock(&crew.table);
        table.lockstep.leave(self.lane);
        table.taken -= 1;
        crew.step_if_all_wait(&mut table, &self.seats.pool);
        drop(table);
        lock(&self.seats.free).push((self.crew, self.lane));
        self.seats.freed.notify_one();
    }
}

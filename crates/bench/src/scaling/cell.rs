//! One batch, timed.

use std::hint::black_box;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use orchard_batch::{Batch, BatchError, Status, TreeWorld};
#[cfg(test)]
use orchard_multibody::Data;
use orchard_multibody::Solver;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::plan::{ScalingPlan, SolverName};
use super::process::processor_time;

/// Shortest time that a clock tells [s]: keeps rates finite.
const CLOCK_RESOLUTION: f64 = 1e-9;

/// Worlds as they are before every course.
pub enum Start<'a> {
    /// In lanes.
    Lanes(Box<Batch>),
    /// In f64.
    Each(&'a [TreeWorld], Solver),
}

/// The same after a course.
pub enum End {
    /// In lanes.
    Lanes(Box<Batch>),
    /// In f64.
    Each(Vec<TreeWorld>),
}

/// What a course took.
#[derive(Debug, Clone, Copy, Default)]
pub struct Spent {
    /// Time elapsed.
    pub elapsed: Duration,
    /// Processor time of all threads.
    pub processor: Duration,
}

/// A cell's figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Timed {
    /// Frames of the whole batch a second, by repeat.
    pub rates: Vec<f64>,
    /// Courses of all repeats.
    pub courses: u32,
    /// Processor time of all of them [s].
    pub processor_s: f64,
    /// Worlds that are no longer finite at the end of a course.
    pub unfinite: u32,
}

impl<'a> Start<'a> {
    /// The worlds under a solver that this build has.
    pub fn new(worlds: &'a [TreeWorld], solver: SolverName) -> Result<Self, BatchError> {
        match solver.of_f64() {
            Some(solver) => Ok(Self::Each(worlds, solver)),
            None => Ok(Self::Lanes(Box::new(Batch::new(worlds)?))),
        }
    }

    /// A course. A frame begins when all worlds have ended the one before.
    pub fn course(&self, frames: u32, pool: &ThreadPool) -> (Spent, End) {
        match self {
            Self::Lanes(start) => {
                let mut batch = start.clone();
                let spent = pool.install(|| {
                    timed(frames, || {
                        black_box(batch.step(1));
                    })
                });
                (spent, End::Lanes(batch))
            }
            Self::Each(start, solver) => {
                let mut worlds = start.to_vec();
                let spent = pool.install(|| {
                    timed(frames, || {
                        worlds.par_iter_mut().for_each(|world| {
                            black_box(world.step_by(*solver));
                        });
                    })
                });
                (spent, End::Each(worlds))
            }
        }
    }
}

impl End {
    /// Writes the state of a world into data of its model.
    #[cfg(test)]
    pub fn store(&self, world: usize, data: &mut Data) {
        match self {
            Self::Lanes(batch) => batch.store(world, data),
            Self::Each(worlds) => data.clone_from(worlds[world].data()),
        }
    }

    /// Worlds that are no longer finite.
    pub fn unfinite(&self) -> u32 {
        let count = match self {
            Self::Lanes(batch) => (0..batch.len()).filter(|&i| batch.status(i) != Status::Running).count(),
            Self::Each(worlds) => worlds.iter().filter(|world| !world.data().is_finite()).count(),
        };
        count as u32
    }
}

fn timed(frames: u32, mut frame: impl FnMut()) -> Spent {
    let (start, processor) = (Instant::now(), processor_time());
    for _ in 0..frames {
        frame();
    }
    Spent { elapsed: start.elapsed(), processor: processor_time().saturating_sub(processor) }
}

/// Times a batch: whole courses for a part of the cell's time, as many times as the plan says. `None` if `stop` was raised.
pub fn time(plan: &ScalingPlan, start: &Start<'_>, pool: &ThreadPool, stop: &AtomicBool) -> Option<Timed> {
    let share = plan.cell_time / f64::from(plan.repeats);
    let mut timed = Timed { rates: Vec::new(), courses: 0, processor_s: 0.0, unfinite: 0 };
    for _ in 0..plan.repeats {
        let (mut elapsed, mut courses) = (0.0, 0);
        while courses == 0 || elapsed < share {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let (spent, end) = start.course(plan.frames, pool);
            elapsed += spent.elapsed.as_secs_f64();
            timed.processor_s += spent.processor.as_secs_f64();
            timed.unfinite = timed.unfinite.max(end.unfinite());
            courses += 1;
        }
        timed.rates.push(f64::from(plan.frames) * f64::from(courses) / elapsed.max(CLOCK_RESOLUTION));
        timed.courses += courses;
    }
    Some(timed)
}

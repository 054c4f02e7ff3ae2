//! Timing of one batch.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use orchard_batch::{Stepper, StepperError, TreeEvent, TreeWorld};
use rayon::ThreadPool;

use crate::device::{self, Gpu};
use crate::error::ScalingError;
use crate::plan::{ContinuousTiming, ScalingPlan};
use crate::process::processor_time;
use crate::solver::SolverName;
use crate::stepper::batch;
use crate::trees::Worlds;

/// Resolution of the clock \[s\]: keeps rates finite.
const CLOCK_RESOLUTION: f64 = 1e-9;
/// Frames per call of the world that keeps a device busy.
const FRAMES_AWAKE: u32 = 60;

/// Worlds at the start of the first course, and their solver.
#[derive(Clone, Copy)]
pub struct BatchStart<'a> {
    /// The worlds.
    pub worlds: Worlds<'a>,
    /// Solver.
    pub solver: SolverName,
    /// Device of the GPU solvers.
    pub gpu: Option<&'a Gpu>,
}

/// Elapsed and processor time.
#[derive(Debug, Clone, Copy, Default)]
pub struct WorkTime {
    /// Time elapsed.
    pub elapsed: Duration,
    /// Processor time of all threads.
    pub processor: Duration,
}

/// A cell's figures.
#[derive(Debug, Clone, PartialEq)]
pub struct CellTiming {
    /// Frames of the whole batch per second, by repeat.
    pub rates: Vec<f64>,
    /// Number of courses in all repeats.
    pub courses: u32,
    /// Processor time of all courses \[s\].
    pub processor_s: f64,
    /// Time to kick the worlds, make the batch and send it to a device \[s\].
    pub pack_s: f64,
    /// Memory of the numbers read and written by a step \[bytes\], if the batch reports it.
    pub bytes: Option<usize>,
    /// Number of worlds that were not finite at the end of a course.
    pub unfinite: u32,
}

impl BatchStart<'_> {
    /// The batch.
    pub fn batch(&self) -> Result<Box<dyn Stepper>, ScalingError> {
        batch(self.solver, &self.worlds, self.gpu)
    }
}

/// Steps some frames of a batch. A frame begins when all worlds have ended the previous one.
pub fn course(batch: &mut dyn Stepper, frames: u32, pool: &ThreadPool) -> Result<WorkTime, StepperError> {
    pool.install(|| {
        let (start, processor) = (Instant::now(), processor_time());
        batch.advance(frames);
        batch.wait()?;
        let processor = processor_time().saturating_sub(processor);
        Ok(WorkTime { elapsed: start.elapsed(), processor })
    })
}

/// Number of worlds that became non-finite since the last call.
fn unfinite(batch: &mut dyn Stepper) -> Result<u32, StepperError> {
    let events = batch.events()?;
    let is_stop = |event: &TreeEvent| matches!(event, TreeEvent::Quarantined { .. });
    Ok(events.iter().filter(|happened| is_stop(&happened.event)).count() as u32)
}

/// Keeps a device busy with one world for a time \[s\].
///
/// # Errors
/// The world cannot be sent to the device, or the device was lost.
pub fn wake(gpu: &Gpu, world: &TreeWorld, time: f64) -> Result<(), StepperError> {
    let mut batch = device::single(gpu, world)?;
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < time {
        Stepper::advance(&mut batch, FRAMES_AWAKE);
        Stepper::wait(&mut batch)?;
    }
    Ok(())
}

/// Times a batch: for each repeat as many courses as fit into its share of the cell's time. `None` if `stop` was raised.
pub fn time(
    plan: &ScalingPlan,
    start: &BatchStart<'_>,
    pool: &ThreadPool,
    stop: &AtomicBool,
) -> Result<Option<CellTiming>, ScalingError> {
    let share = plan.cell_time / f64::from(plan.repeats);
    let packing = Instant::now();
    let new_batch = || pool.install(|| start.batch());
    let mut batch = new_batch()?;
    batch.wait()?;
    let pack_s = packing.elapsed().as_secs_f64();
    let bytes = batch.bytes();
    let mut timed =
        CellTiming { rates: Vec::new(), courses: 0, processor_s: 0.0, pack_s, bytes, unfinite: 0 };
    if let Some(ContinuousTiming { wake: busy, warm_up, .. }) = plan.continuous {
        if let Some(gpu) = start.gpu {
            wake(gpu, &(start.worlds.world)(0), busy)?;
        }
        course(&mut *batch, warm_up, pool)?;
    }
    for _ in 0..plan.repeats {
        let (mut elapsed, mut courses) = (0.0, 0);
        while courses == 0 || elapsed < share && plan.has_course(courses) {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            if plan.continuous.is_none() && timed.courses + courses > 0 {
                // Two of them may not fit.
                drop(batch);
                batch = new_batch()?;
            }
            let spent = course(&mut *batch, plan.frames, pool)?;
            elapsed += spent.elapsed.as_secs_f64();
            timed.processor_s += spent.processor.as_secs_f64();
            courses += 1;
            if plan.continuous.is_none() {
                timed.unfinite = timed.unfinite.max(unfinite(&mut *batch)?);
            }
        }
        timed.rates.push(f64::from(plan.frames) * f64::from(courses) / elapsed.max(CLOCK_RESOLUTION));
        timed.courses += courses;
    }
    if plan.continuous.is_some() {
        timed.unfinite = unfinite(&mut *batch)?;
    }
    Ok(Some(timed))
}

impl ScalingPlan {
    /// True if a repeat may have another course after `courses` courses. Courses without a reset share the time in which everything moves.
    fn has_course(&self, courses: u32) -> bool {
        let of =
            |continuous: &ContinuousTiming| continuous.most.saturating_sub(continuous.warm_up) / self.repeats;
        self.continuous.as_ref().is_none_or(|continuous| (courses + 1) * self.frames <= of(continuous))
    }
}

//! Many pictures, one after another.

use std::time::{Duration, Instant};

use super::ViewError;
use super::clock::program_time;
use super::offscreen::Offscreen;
use super::viewer::Viewer;

/// Costs of many pictures.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Pictures.
    pub pictures: u32,
    /// Time for all of them.
    pub whole: Duration,
    /// Processor time of this thread for them, without the steps of the world.
    pub own: Duration,
    /// Processor time of the whole program for them: where a driver in software draws, most of it is the driver's.
    pub program: Duration,
    /// Time of the world's steps.
    pub stepping: Duration,
    /// Largest number of draw calls of a picture.
    pub draw_calls: u32,
}

impl Tally {
    /// The figures in a line.
    pub fn line(&self) -> String {
        let (whole, each) = (self.whole.as_secs_f64(), |time: Duration| {
            time.as_secs_f64() * 1e3 / f64::from(self.pictures.max(1))
        });
        let rate = f64::from(self.pictures) / whole.max(f64::MIN_POSITIVE);
        let (own, all, stepping) = (each(self.own), each(self.program), each(self.stepping));
        format!(
            "{} pictures, {rate:.1} a second; of each, viewer {own:.1} ms of processor time, world {stepping:.1} ms, all threads {all:.1} ms of processor time; at most {} draw calls of the scene",
            self.pictures, self.draw_calls
        )
    }
}

/// Steps a number of frames of the world, with a picture after every `every` frames and at the end; the pictures go to `take` with their number, from 1.
///
/// # Errors
/// The device failed, or `take` did.
pub fn video(
    screen: &mut Offscreen,
    viewer: &mut Viewer,
    frames: u32,
    every: u32,
    mut take: impl FnMut(u32, &Offscreen) -> Result<(), ViewError>,
) -> Result<Tally, ViewError> {
    let mut tally = Tally::default();
    let frame = viewer.frame_time();
    let (mut left, every) = (frames, every.max(1));
    // The first picture loads fonts and meshes; it is not counted.
    screen.draw(viewer, 0.0, Vec::new());
    loop {
        let steps = left.min(every);
        let (start, program) = (Instant::now(), program_time());
        viewer.owe(steps);
        screen.draw(viewer, f64::from(steps) * frame, Vec::new());
        screen.wait()?;
        tally.whole += start.elapsed();
        tally.program += program_time().saturating_sub(program);
        tally.own += screen.own_time();
        tally.stepping += viewer.costs().stepping;
        tally.draw_calls = tally.draw_calls.max(viewer.costs().draw_calls);
        tally.pictures += 1;
        left -= steps;
        take(tally.pictures, screen)?;
        if left == 0 {
            return Ok(tally);
        }
    }
}

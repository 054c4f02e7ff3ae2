//! Observers of episodes: read-only access to every frame.

use orchard_bench::store::StoreError;
use orchard_robot::io::{Command, Observation};
use orchard_world::WorldEvent;

use crate::harvest::episode::{EpisodeKey, EpisodeRecord};
use crate::harvest::interface::ControllerEvent;

/// Observer of one episode, frame by frame.
pub trait Observer<W> {
    /// Called before frame k is stepped; the world is in the state of the observation.
    fn before_step(&mut self, world: &W, frame: &FrameInput<'_>) {
        let _ = (world, frame);
    }

    /// Called after the step, with its events; the world is at frame k + 1.
    fn after_step(&mut self, world: &W, events: &[WorldEvent]) {
        let _ = (world, events);
    }
}

/// Input of a frame.
#[derive(Debug, Clone, Copy)]
pub struct FrameInput<'a> {
    /// Observation of the controller; none while the robot stands still after the end of the time.
    pub observation: Option<&'a Observation>,
    /// Events that the controller logged on this observation.
    pub controller_events: &'a [ControllerEvent],
    /// The command of the frame.
    pub command: &'a Command,
}

/// Observer that does nothing.
#[derive(Debug, Clone, Copy)]
pub struct NoObserver;

impl<W> Observer<W> for NoObserver {}

/// Makes the observers of a run's episodes and manages their files.
pub trait ObserverFactory<W>: Sync {
    /// Observer of one episode.
    type Observer: Observer<W>;

    /// True if the files that belong to a stored record exist and are as the episode wrote them. Otherwise the episode is run again.
    fn is_kept(&self, record: &EpisodeRecord) -> bool;

    /// Makes the observer of an episode that begins.
    fn begin(&self, key: &EpisodeKey, world: &W) -> Self::Observer;

    /// Called when the episode is over: gives its files their final names.
    ///
    /// # Errors
    /// A file cannot be written.
    fn end(&self, observer: Self::Observer, world: &W, record: &EpisodeRecord) -> Result<(), StoreError>;
}

/// An optional observer.
impl<W, O: ObserverFactory<W>> ObserverFactory<W> for Option<O> {
    type Observer = Option<O::Observer>;

    fn is_kept(&self, record: &EpisodeRecord) -> bool {
        self.as_ref().is_none_or(|watch| watch.is_kept(record))
    }

    fn begin(&self, key: &EpisodeKey, world: &W) -> Self::Observer {
        self.as_ref().map(|watch| watch.begin(key, world))
    }

    fn end(&self, observer: Self::Observer, world: &W, record: &EpisodeRecord) -> Result<(), StoreError> {
        self.as_ref().zip(observer).map_or(Ok(()), |(watch, observer)| watch.end(observer, world, record))
    }
}

impl<W, O: Observer<W>> Observer<W> for Option<O> {
    fn before_step(&mut self, world: &W, frame: &FrameInput<'_>) {
        if let Some(observer) = self {
            observer.before_step(world, frame);
        }
    }

    fn after_step(&mut self, world: &W, events: &[WorldEvent]) {
        if let Some(observer) = self {
            observer.after_step(world, events);
        }
    }
}

/// Two observers of the same episodes.
impl<W, A: ObserverFactory<W>, B: ObserverFactory<W>> ObserverFactory<W> for (A, B) {
    type Observer = (A::Observer, B::Observer);

    fn is_kept(&self, record: &EpisodeRecord) -> bool {
        self.0.is_kept(record) && self.1.is_kept(record)
    }

    fn begin(&self, key: &EpisodeKey, world: &W) -> Self::Observer {
        (self.0.begin(key, world), self.1.begin(key, world))
    }

    fn end(&self, (a, b): Self::Observer, world: &W, record: &EpisodeRecord) -> Result<(), StoreError> {
        self.0.end(a, world, record)?;
        self.1.end(b, world, record)
    }
}

impl<W, A: Observer<W>, B: Observer<W>> Observer<W> for (A, B) {
    fn before_step(&mut self, world: &W, frame: &FrameInput<'_>) {
        self.0.before_step(world, frame);
        self.1.before_step(world, frame);
    }

    fn after_step(&mut self, world: &W, events: &[WorldEvent]) {
        self.0.after_step(world, events);
        self.1.after_step(world, events);
    }
}

/// Keeps nothing.
#[derive(Debug, Clone, Copy)]
pub struct NoObservers;

impl<W> ObserverFactory<W> for NoObservers {
    type Observer = NoObserver;

    fn is_kept(&self, _: &EpisodeRecord) -> bool {
        true
    }

    fn begin(&self, _: &EpisodeKey, _: &W) -> NoObserver {
        NoObserver
    }

    fn end(&self, _: NoObserver, _: &W, _: &EpisodeRecord) -> Result<(), StoreError> {
        Ok(())
    }
}

//! Movers of worlds: the processor, or a graphics device.

#[cfg(feature = "gpu")]
use std::collections::BTreeMap;
#[cfg(feature = "gpu")]
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Instant;

use orchard_robot::{Command, Observation};
use orchard_scenario::Scenario;
use orchard_tasks::plan_file::Backend;
use orchard_world::{Span, Turn, World};
use rayon::prelude::*;

use crate::error::EnvError;

/// Number of crews of many worlds: one is on the device while the processor, which is what is short, applies the rules of the other. Up to so many worlds take the device hardly longer than half of them, so they are one crew. Both are our own choice.
#[cfg(feature = "gpu")]
const CREWS: usize = 2;
#[cfg(feature = "gpu")]
const ONE_CREW: usize = 2048;

/// Most frames of a step that are sent to a device at once, our own choice: steps at 7.5 Hz and faster. Each takes 5 kB a world there and here.
#[cfg(feature = "gpu")]
const MOST_FRAMES: usize = 8;

/// Frames of a crew under way.
#[cfg(feature = "gpu")]
pub(crate) type Begun = orchard_lockstep::Begun;
/// There is none without a device.
#[cfg(not(feature = "gpu"))]
pub(crate) type Begun = std::convert::Infallible;

/// Moves the worlds of some lanes.
#[derive(Debug)]
pub(crate) enum Mover {
    /// In f64, in parallel on the current rayon pool.
    Cpu,
    /// On a graphics device, in crews whose frames overlap: lanes in the order of the crews.
    #[cfg(feature = "gpu")]
    Gpu(Device),
}

/// Crews on a graphics device, and what draws the images of their worlds.
#[cfg(feature = "gpu")]
#[derive(Debug)]
pub(crate) struct Device {
    crews: Vec<orchard_lockstep::Lockstep>,
    pub eyes: Box<orchard_lockstep::Eyes>,
    gpu: Arc<orchard_gpu::Gpu>,
    /// Constants of the worlds of a pool by index.
    fittings: BTreeMap<u32, Arc<orchard_lockstep::Fitting>>,
    /// Observations that stay there, if they do.
    pub observed: Option<Box<crate::on_device::OnDevice>>,
    /// False once it had no room for pictures: the processor draws them.
    pub draws_pictures: bool,
    /// Times of the environments' own parts of a frame, if they are kept.
    profile: Option<orchard_lockstep::Profile>,
}

/// The device of all environments that this process has open, opened for the first of them: its kernels are compiled once. A lost one is replaced.
#[cfg(feature = "gpu")]
fn open_device() -> Result<Arc<orchard_gpu::Gpu>, orchard_gpu::GpuError> {
    static OPEN: Mutex<Weak<orchard_gpu::Gpu>> = Mutex::new(Weak::new());
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(gpu) = open.upgrade().filter(|gpu| !gpu.is_lost()) {
        return Ok(gpu);
    }
    let gpu = Arc::new(orchard_gpu::Gpu::open(orchard_gpu::Choice::Any)?);
    *open = Arc::downgrade(&gpu);
    Ok(gpu)
}

#[cfg(feature = "gpu")]
pub(crate) fn device(e: &dyn std::error::Error) -> EnvError {
    EnvError::Device(e.to_string())
}

impl Mover {
    /// Makes the mover of a scenario's worlds in some lanes, which take up to so many frames at once.
    ///
    /// # Errors
    /// There is no device, or it cannot step these worlds.
    pub fn new(scenario: &Scenario, backend: Backend, lanes: usize, frames: usize) -> Result<Self, EnvError> {
        match backend {
            Backend::Cpu => Ok(Self::Cpu),
            #[cfg(not(feature = "gpu"))]
            Backend::Gpu => {
                let _ = (scenario, lanes, frames);
                Err(EnvError::Device("this program was built without the feature `gpu`".to_owned()))
            }
            #[cfg(feature = "gpu")]
            Backend::Gpu => {
                let gpu = open_device().map_err(|e| device(&e))?;
                let samples = orchard_lockstep::samples(scenario);
                let crews = if lanes > ONE_CREW { CREWS } else { 1 };
                let crews =
                    orchard_lockstep::Lockstep::crews(&gpu, &samples, lanes, crews, frames.min(MOST_FRAMES));
                let (crews, eyes) =
                    (crews.map_err(|e| device(&e))?, Box::new(orchard_lockstep::Eyes::new(&gpu)));
                let fittings = BTreeMap::new();
                Ok(Self::Gpu(Device {
                    crews,
                    eyes,
                    gpu,
                    fittings,
                    observed: None,
                    draws_pictures: true,
                    profile: None,
                }))
            }
        }
    }

    /// Lets worlds enter lanes. `returns`: the worlds are those of a pool and will come again, so that their fittings are kept by index.
    ///
    /// # Errors
    /// The device cannot step one of them; the others have entered.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, clippy::unnecessary_wraps))]
    pub fn enter(&mut self, entering: &[(usize, &World)], returns: bool) -> Result<(), EnvError> {
        match self {
            Self::Cpu => Ok(()),
            #[cfg(feature = "gpu")]
            Self::Gpu(device) => device.enter(entering, returns),
        }
    }

    /// Tells that the state of a lane's world has changed.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables))]
    pub fn renew(&mut self, lane: usize) {
        match self {
            Self::Cpu => {}
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { crews, .. }) => {
                let (crew, lane) = place(crews, lane);
                crews[crew].renew(lane);
            }
        }
    }

    /// Number of crews.
    pub fn crews(&self) -> usize {
        match self {
            Self::Cpu => 1,
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { crews, .. }) => crews.len(),
        }
    }

    /// Number of lanes of a crew, if there are so many lanes in all; those of the first crew come first.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables))]
    pub fn lanes(&self, crew: usize, all: usize) -> usize {
        match self {
            Self::Cpu => all,
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { crews, .. }) => crews[crew].len(),
        }
    }

    /// Begins frames of worlds of one crew. On the CPU they are over when this returns, and there is nothing to end.
    ///
    /// # Errors
    /// The device was lost.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, clippy::unnecessary_wraps))]
    pub fn begin<S: Span>(&mut self, crew: usize, spans: &mut [S]) -> Result<Option<Begun>, EnvError> {
        match self {
            Self::Cpu => {
                spans.par_iter_mut().for_each(|span| {
                    for _ in 0..span.frames().1.len() {
                        let (world, commands) = span.frames();
                        world.step(&commands[0]);
                        if !span.after_frame() {
                            break;
                        }
                    }
                });
                Ok(None)
            }
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { crews, .. }) => crews[crew].begin(spans).map(Some).map_err(|e| device(&e)),
        }
    }

    /// Ends the frames that were begun with these spans.
    ///
    /// # Errors
    /// The device was lost.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables))]
    pub fn end<S: Span>(&mut self, crew: usize, spans: &mut [S], begun: Begun) -> Result<(), EnvError> {
        match self {
            Self::Cpu => Ok(()),
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { crews, .. }) => crews[crew].end(spans, begun).map_err(|e| device(&e)),
        }
    }

    /// Brings wood and fruit of worlds that are behind up to their robots; a world is given with its lane.
    ///
    /// # Errors
    /// The device was lost.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, clippy::unnecessary_wraps))]
    pub fn catch_up(&mut self, worlds: Vec<(usize, &mut World)>) -> Result<(), EnvError> {
        match self {
            Self::Cpu => Ok(()),
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { crews, .. }) => {
                let mut of_crews: Vec<Vec<(usize, &mut World)>> = crews.iter().map(|_| Vec::new()).collect();
                for (lane, world) in worlds.into_iter().filter(|(_, world)| world.is_behind()) {
                    let (crew, lane) = place(crews, lane);
                    of_crews[crew].push((lane, world));
                }
                let mut each = crews.iter_mut().zip(&mut of_crews);
                each.try_for_each(|(crew, worlds)| crew.catch_up(worlds)).map_err(|e| device(&e))
            }
        }
    }

    /// Advances worlds by a frame.
    ///
    /// # Errors
    /// The device was lost.
    pub fn step(&mut self, worlds: &mut [World], commands: &[Command]) -> Result<(), EnvError> {
        let (mut begun, mut turns) = (Vec::new(), turns(worlds, commands));
        for crew in 0..self.crews() {
            let mut own: Vec<Turn<'_>> = turns.by_ref().take(self.lanes(crew, commands.len())).collect();
            own.iter_mut().enumerate().for_each(|(lane, turn)| turn.lane = lane);
            begun.push((self.begin(crew, &mut own)?, own));
        }
        for (crew, (begun, mut own)) in begun.into_iter().enumerate() {
            if let Some(begun) = begun {
                self.end(crew, &mut own, begun)?;
            }
        }
        Ok(())
    }

    /// Returns the observation of each world, which is given with its lane, with the images that cameras deliver now; each image is its world's latest from now on. Nothing is returned where images stay on the device.
    ///
    /// # Errors
    /// The device has no room for the images, or was lost.
    #[cfg_attr(not(feature = "gpu"), expect(clippy::unnecessary_wraps))]
    pub fn observe(&mut self, worlds: &mut [(usize, &mut World)]) -> Result<Vec<Observation>, EnvError> {
        match self {
            Self::Cpu => Ok(worlds.par_iter_mut().map(|(_, world)| world.observe()).collect()),
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { eyes, observed, .. }) => {
                match observed.as_ref().and_then(|observed| observed.depths()) {
                    Some(depths) => eyes.observe_into(worlds, depths).map(|()| Vec::new()),
                    None => eyes.observe(worlds),
                }
            }
            .map_err(|e| device(&e)),
        }
    }

    /// Draws the latest images of worlds again where the device draws them: those of a restored or fresh world were drawn on the processor.
    ///
    /// # Errors
    /// As [`Self::observe`].
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, clippy::unnecessary_wraps))]
    pub fn look_again(&mut self, worlds: &mut [(usize, &mut World)]) -> Result<(), EnvError> {
        match self {
            Self::Cpu => Ok(()),
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { eyes, observed, .. }) => {
                match observed.as_ref().and_then(|observed| observed.depths()) {
                    Some(depths) => eyes.look_again_into(worlds, depths),
                    None => eyes.look_again(worlds),
                }
            }
            .map_err(|e| device(&e)),
        }
    }

    /// Keeps the observations of some lanes on the device; `shared`: in memory that others can open.
    ///
    /// # Errors
    /// There is no device, it has no room, or it cannot share memory.
    #[cfg(feature = "gpu")]
    pub fn keep_there(
        &mut self,
        fields: &[orchard_policy::Field],
        lanes: usize,
        shared: bool,
    ) -> Result<(), EnvError> {
        let Self::Gpu(Device { gpu, observed, .. }) = self else {
            return Err(EnvError::Device("the observations are the processor's".to_owned()));
        };
        let made = crate::on_device::OnDevice::new(gpu, fields, lanes, shared);
        *observed = Some(Box::new(made.map_err(|e| device(&e))?));
        Ok(())
    }

    /// The observations that stay on the device, if they do.
    #[cfg(feature = "gpu")]
    pub fn observed(&mut self) -> Option<&mut crate::on_device::OnDevice> {
        match self {
            Self::Cpu => None,
            Self::Gpu(Device { observed, .. }) => observed.as_deref_mut(),
        }
    }

    /// True if the worlds move in f64, each on its own.
    pub fn is_cpu(&self) -> bool {
        matches!(self, Self::Cpu)
    }

    /// Keeps the times of a frame's parts from now on, or no more.
    #[cfg(feature = "gpu")]
    pub fn keep_profile(&mut self, detail: Option<orchard_lockstep::Detail>) {
        if let Self::Gpu(Device { crews, profile, .. }) = self {
            crews.iter_mut().for_each(|crew| crew.keep_profile(detail));
            *profile = detail.map(|_| orchard_lockstep::Profile::default());
        }
    }

    /// The times that are kept, if they are.
    #[cfg(feature = "gpu")]
    pub fn profile(&self) -> Option<orchard_lockstep::Profile> {
        let Self::Gpu(Device { crews, profile, .. }) = self else { return None };
        let of_crews = crews.iter().filter_map(orchard_lockstep::Lockstep::profile);
        Some(of_crews.fold(profile.clone()?, |all, crew| all.with(&crew)))
    }

    /// Adds what a part of the environments' own took to the times, if they are kept.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables))]
    pub fn note(&mut self, part: &'static str, since: Instant) {
        match self {
            Self::Cpu => {}
            #[cfg(feature = "gpu")]
            Self::Gpu(Device { profile, .. }) => {
                if let Some(profile) = profile {
                    profile.add(part, since);
                }
            }
        }
    }

    /// Counts of frames by the place where they were computed; `None` on the CPU.
    #[cfg(feature = "gpu")]
    pub fn tally(&self) -> Option<orchard_lockstep::Tally> {
        match self {
            Self::Cpu => None,
            Self::Gpu(Device { crews, .. }) => {
                let tallies = crews.iter().map(orchard_lockstep::Lockstep::tally);
                Some(tallies.fold(orchard_lockstep::Tally::default(), orchard_lockstep::Tally::with))
            }
        }
    }
}

#[cfg(feature = "gpu")]
impl Device {
    fn enter(&mut self, entering: &[(usize, &World)], returns: bool) -> Result<(), EnvError> {
        let Self { crews, fittings, .. } = self;
        let fitting = |(_, world): &(usize, &World)| match fittings.get(&world.index()).filter(|_| returns) {
            Some(known) => Ok(known.clone()),
            // All crews have the same room.
            None => crews[0].fit(world).map(Arc::new),
        };
        let found: Vec<_> = entering.par_iter().map(fitting).collect();
        let mut entered = Ok(());
        for (&(lane, world), found) in entering.iter().zip(found) {
            let (crew, lane) = place(crews, lane);
            match found {
                Ok(fitting) => {
                    if returns {
                        fittings.insert(world.index(), fitting.clone());
                    }
                    crews[crew].enter_fitted(lane, fitting);
                }
                Err(e) => {
                    crews[crew].leave(lane);
                    entered = entered.and(Err(device(&e)));
                }
            }
        }
        entered
    }
}

/// Crew of a lane, and its lane in it.
#[cfg(feature = "gpu")]
fn place(crews: &[orchard_lockstep::Lockstep], lane: usize) -> (usize, usize) {
    // All but the last have the same number of lanes.
    let each = crews[0].len();
    (lane / each, lane % each)
}

/// Turns of worlds, each in the lane of its place.
fn turns<'a>(worlds: &'a mut [World], commands: &'a [Command]) -> impl Iterator<Item = Turn<'a>> {
    let all = worlds.iter_mut().zip(commands).enumerate();
    all.map(|(lane, (world, command))| Turn { lane, world, command: *command, is_whole: true })
}

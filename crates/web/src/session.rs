//! A world under a driver, stepped frame by frame.

use orchard_geometry::Vec3;
use orchard_picker::{Controller, Event, State};
use orchard_robot::Command;
use orchard_world::truth::FruitState;
use orchard_world::{Status, World, WorldEvent};

use crate::ask::{Ask, AskError, Parts};
use crate::digest::{FrameDigest, frame_digest};
use crate::driver::Driver;
use crate::hand::{Grip, Hand};
use crate::picture::Picture;
use crate::rules::WebRules;
use crate::told::{Pull, Told};

/// A world with its driver and a hand.
pub struct Session {
    parts: Parts,
    rules: WebRules,
    driver: Driver,
    world: World,
    controller: Option<Box<dyn Controller>>,
    hand: Hand,
    /// Branches that snapped since the start.
    snapped: u32,
    /// Events of the controller's record that were read.
    events_read: usize,
    state: Option<State>,
}

impl Session {
    /// Grows the world that the options ask for.
    ///
    /// # Errors
    /// An option that cannot be used, or a world that cannot be built.
    pub fn grow(ask: &Ask) -> Result<Self, AskError> {
        let (seed, driver, parts) = (ask.seed()?, ask.driver()?, ask.parts()?);
        let world = World::new(parts.spec.clone(), parts.robot.clone(), seed, ask.tree);
        let world = world.map_err(|e| {
            AskError(format!("tree {} of seed {seed} cannot be built: {e}; take another seed", ask.tree))
        })?;
        let rules = WebRules::v1();
        let hand = Hand::new(&rules.hand);
        let mut session = Self {
            parts,
            rules,
            driver,
            world,
            controller: None,
            hand,
            snapped: 0,
            events_read: 0,
            state: None,
        };
        session.begin();
        Ok(session)
    }

    /// Brings the world and the driver back to the start of the episode.
    pub fn reset(&mut self) {
        self.world.reset();
        self.begin();
    }

    fn begin(&mut self) {
        self.hand.release();
        (self.snapped, self.events_read, self.state) = (0, 0, None);
        self.controller = match self.driver {
            Driver::Controller(kind) => Some(kind.controller(&self.parts.robot, self.parts.detector.clone())),
            Driver::Nobody => None,
        };
    }

    /// Advances one frame: the controller sees and commands, the hand pulls, the world steps.
    pub fn step(&mut self) {
        self.advance(false);
    }

    /// Advances one frame and returns its digest.
    pub fn step_watched(&mut self) -> FrameDigest {
        self.advance(true).unwrap_or_default()
    }

    fn advance(&mut self, watched: bool) -> Option<FrameDigest> {
        let observation = self.controller.as_ref().map(|_| self.world.observe());
        let command = match (&mut self.controller, &observation) {
            (Some(controller), Some(observation)) => controller.act(observation),
            _ => self.idle(),
        };
        self.hand.load(&mut self.world);
        self.world.step(&command);
        self.hand.unload(&mut self.world);
        let snapped = |event: &WorldEvent| matches!(event, WorldEvent::BranchSnapped { .. });
        self.snapped += self.world.drain_events().iter().filter(|event| snapped(event)).count() as u32;
        self.read_state();
        watched.then(|| frame_digest(observation.as_ref(), &command, &self.world))
    }

    fn idle(&self) -> Command {
        self.parts.robot.start_command()
    }

    /// Reads the controller's state from the new events of its record.
    fn read_state(&mut self) {
        let Some(controller) = &self.controller else { return };
        let events = &controller.record().events;
        for event in events.iter().skip(self.events_read) {
            if let Event::StateChanged { state, .. } = event {
                self.state = Some(*state);
            }
        }
        self.events_read = events.len();
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Grabs the wood or the fruit that a ray meets first, or misses by little. `p_world` \[m\] is the ray's start, `along` its direction; with
    /// `by_key` it may miss by more. Returns the grabbed place \[m\], world; `None` if there is nothing, and then the hand is empty.
    pub fn grab(&mut self, p_world: &Vec3, along: &Vec3, by_key: bool) -> Option<Vec3> {
        self.hand.release();
        let hand = &self.rules.hand;
        let angle = if by_key { &hand.key_grab_angle } else { &hand.grab_angle };
        let grip = Grip::along(&self.world, p_world, along, angle.si())?;
        let place = grip.place(&self.world, self.world.data());
        self.hand.take(grip, place);
        Some(place)
    }

    /// Moves the pointer to which the hand pulls \[m\], world.
    pub fn pull_to(&mut self, p_world: &Vec3) {
        self.hand.pull_to(p_world);
    }

    /// Lets go.
    pub fn release(&mut self) {
        self.hand.release();
    }

    /// The picture of the present state.
    pub fn picture(&self) -> Picture {
        Picture::of(&self.world, self.hand.grip(), &self.rules.ground)
    }

    /// The figures of the present state.
    pub fn told(&self) -> Told {
        let count = |states: &[FruitState]| {
            self.world.fruit_truth().iter().filter(|fruit| states.contains(&fruit.state)).count() as u32
        };
        let spec = self.world.spec();
        let fault = match self.world.status() {
            Status::Running => None,
            Status::Quarantined { reason, .. } => Some(reason.clone()),
        };
        Told {
            frame: self.world.frame(),
            time: f64::from(self.world.frame()) * spec.sim.frame(),
            frame_rate: spec.sim.frame_rate.si(),
            foliage: spec.foliage.density.value(),
            hanging: count(&[FruitState::OnTree, FruitState::OnBrokenLimb]),
            picked: count(&[FruitState::Deposited]),
            dropped: count(&[FruitState::Dropped]),
            snapped: self.snapped,
            p_world_base: self.world.handle().x_world_base(self.world.data()).translation.vector.into(),
            state: self.state,
            pull: self.hand.grip().map(|grip| {
                let place = grip.place(&self.world, self.world.data());
                Pull {
                    p_world: place.into(),
                    p_world_target: self.hand.target().into(),
                    force: self.hand.force().norm(),
                }
            }),
            fault,
        }
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;

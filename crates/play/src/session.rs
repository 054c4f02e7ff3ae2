//! A world under a driver, stepped frame by frame.

use orchard_geometry::Vec3;
use orchard_picker::{Controller, Event, State};
use orchard_robot::{Command, Observation};
use orchard_world::truth::FruitState;
use orchard_world::{Snapshot, SnapshotError, Status, World, WorldEvent};

use crate::digest::{FrameDigest, frame_digest};
use crate::grip::{Grip, Reach};
use crate::hand::Hand;
use crate::jog::{Jog, Wish};
use crate::paint::Paint;
use crate::picture::{Drawing, Picture};
use crate::rules::PlayRules;
use crate::told::{Pull, Told};

/// Makes a controller at the start of an episode.
pub type Make = Box<dyn Fn() -> Box<dyn Controller> + Send>;

/// Input of a frame, as the driver saw and commanded it.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// Observation; none where nobody drives.
    pub observation: Option<&'a Observation>,
    /// The controller, if one drives: its log has what it noted on this observation.
    pub controller: Option<&'a dyn Controller>,
    /// The command of the frame.
    pub command: &'a Command,
}

/// A world with its driver and a hand. The driver is a controller, a person ([`Session::take_over`]), or nobody: then the robot stands as it started.
pub struct Session {
    rules: PlayRules,
    world: World,
    make: Option<Make>,
    controller: Option<Box<dyn Controller>>,
    jog: Option<Jog>,
    hand: Hand,
    /// Branches that snapped since the start.
    snapped: u32,
    /// Events of the controller's record that were read.
    events_read: usize,
    state: Option<State>,
    /// Events of the latest frame.
    news: Vec<WorldEvent>,
    /// Command of the latest frame.
    command: Option<Command>,
}

impl Session {
    /// A session of a world at the start of its episode; without `make` nobody drives.
    pub fn new(world: World, make: Option<Make>) -> Self {
        let rules = PlayRules::v1();
        let mut session = Self {
            hand: Hand::new(&rules.hand),
            rules,
            world,
            make,
            controller: None,
            jog: None,
            snapped: 0,
            events_read: 0,
            state: None,
            news: Vec::new(),
            command: None,
        };
        session.begin();
        session
    }

    /// Brings the world and the driver back to the start of the episode.
    pub fn reset(&mut self) {
        self.world.reset();
        self.begin();
    }

    fn begin(&mut self) {
        self.hand.release();
        self.snapped = 0;
        self.news.clear();
        self.command = None;
        self.let_drive();
    }

    /// Hands the robot to a new controller, which finds the world as it is.
    fn let_drive(&mut self) {
        (self.jog, self.events_read, self.state) = (None, 0, None);
        self.controller = self.make.as_ref().map(|make| make());
    }

    /// Lets another controller drive from now on; `None`: nobody.
    pub fn drive_by(&mut self, make: Option<Make>) {
        self.make = make;
        self.let_drive();
    }

    /// Takes the robot over from the driver: from now on it obeys [`Self::wish`].
    pub fn take_over(&mut self) {
        let seen = self.world.sense();
        self.jog = Some(Jog::begin(self.world.robot(), &seen, &self.rules.jog));
        (self.controller, self.state) = (None, None);
    }

    /// Gives the robot back to the driver that was there: to a new controller of its kind, which finds the world as it is.
    pub fn give_back(&mut self) {
        if self.jog.is_some() {
            self.let_drive();
        }
    }

    /// True while a person drives.
    pub fn is_taken_over(&self) -> bool {
        self.jog.is_some()
    }

    /// Sets the controls of a person who drives; without one nothing changes.
    pub fn wish(&mut self, wish: Wish) {
        if let Some(jog) = &mut self.jog {
            jog.wish = wish;
        }
    }

    /// Advances one frame: the driver sees and commands, the hand pulls, the world steps.
    pub fn step(&mut self) {
        self.advance(&mut |_, _| ());
    }

    /// Advances one frame; `before` is called when the driver has commanded and the world has not stepped yet.
    pub fn step_seen(&mut self, before: &mut dyn FnMut(&World, &Sight<'_>)) {
        self.advance(before);
    }

    /// Advances one frame and returns its digest.
    pub fn step_watched(&mut self) -> FrameDigest {
        let (observation, command) = self.advance(&mut |_, _| ());
        frame_digest(observation.as_ref(), &command, &self.world)
    }

    fn advance(&mut self, before: &mut dyn FnMut(&World, &Sight<'_>)) -> (Option<Observation>, Command) {
        let (observation, command) = self.drive();
        self.command = Some(command);
        let controller = self.controller.as_deref();
        before(&self.world, &Sight { observation: observation.as_ref(), controller, command: &command });
        self.hand.load(&mut self.world);
        self.world.step(&command);
        self.hand.unload(&mut self.world);
        self.news = self.world.drain_events();
        let snapped = |event: &WorldEvent| matches!(event, WorldEvent::BranchSnapped { .. });
        self.snapped += self.news.iter().filter(|event| snapped(event)).count() as u32;
        self.read_state();
        (observation, command)
    }

    fn drive(&mut self) -> (Option<Observation>, Command) {
        if let Some(jog) = &mut self.jog {
            // Whoever drives by hand sees the camera's images, too.
            let observation = self.world.observe();
            let command = jog.act(self.world.robot(), self.world.spec().sim.frame());
            return (Some(observation), command);
        }
        let observation = self.controller.as_ref().map(|_| self.world.observe());
        let command = match (&mut self.controller, &observation) {
            (Some(controller), Some(observation)) => controller.act(observation),
            _ => self.world.robot().start_command(),
        };
        (observation, command)
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

    /// Brings the world to a moment that was kept of it. The driver begins anew there, and the hand is empty.
    ///
    /// # Errors
    /// The snapshot is of another world; then nothing has changed.
    pub fn restore(&mut self, moment: &Snapshot) -> Result<(), SnapshotError> {
        self.world.restore(moment)?;
        self.begin();
        self.snapped = self.world.rupture().breaks().len() as u32;
        Ok(())
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The controller, while one drives.
    pub fn controller(&self) -> Option<&dyn Controller> {
        self.controller.as_deref()
    }

    /// State of the controller, by its log; none before it tells one, and while a person drives.
    pub fn state(&self) -> Option<State> {
        self.state
    }

    /// The set points of a person who drives.
    pub fn jog(&self) -> Option<&Jog> {
        self.jog.as_ref()
    }

    /// Command of the latest frame.
    pub fn command(&self) -> Option<&Command> {
        self.command.as_ref()
    }

    /// True if the command of the latest frame closes the hand: fingers less than half open, or the valve of a suction cup open.
    pub fn hand_is_closed(&self) -> bool {
        let half_open = 0.5 * self.world.robot().kinematics().finger_stroke();
        self.command.is_some_and(|command| command.vacuum > 0.5 || command.finger_q < half_open)
    }

    /// Events of the latest frame.
    pub fn news(&self) -> &[WorldEvent] {
        &self.news
    }

    /// Grabs what a ray meets first within reach, or misses by little. `p_world` \[m\] is the ray's start, `along` its direction; with
    /// `by_key` it may miss by more. Returns the grabbed place \[m\], world; `None` if there is nothing, and then the hand is empty.
    pub fn grab(&mut self, p_world: &Vec3, along: &Vec3, by_key: bool, reach: Reach) -> Option<Vec3> {
        self.hand.release();
        let hand = &self.rules.hand;
        let angle = if by_key { &hand.key_grab_angle } else { &hand.grab_angle };
        let grip = Grip::along(&self.world, p_world, along, angle.si(), reach)?;
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

    /// A drawing for pictures of this session's world.
    pub fn drawing(&self) -> Drawing {
        Drawing::new(&self.world, &self.rules.ground)
    }

    /// Lists the instances of the present state in a drawing of this world.
    pub fn draw(&self, drawing: &mut Drawing, paint: &Paint) {
        drawing.draw(&self.world, self.hand.grip(), paint);
    }

    /// The pull of the hand; `None` while it holds nothing.
    pub fn pull(&self) -> Option<Pull> {
        self.hand.grip().map(|grip| Pull {
            p_world: grip.place(&self.world, self.world.data()).into(),
            p_world_target: self.hand.target().into(),
            force: self.hand.force().norm(),
        })
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
            pull: self.pull(),
            fault,
        }
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;

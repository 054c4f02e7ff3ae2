//! The world on show, and the dials that grow another.

use std::sync::Arc;

use orchard_picker::{Controller, ControllerKind, Goal};
use orchard_play::{Make, Session, state_name};
use orchard_robot::Command;
use orchard_scenario::{Changes, OptionValue, Options, Scenario, ScenarioError};
use orchard_spec::Spec;
use orchard_tasks::protocol::Protocol;
use orchard_world::{World, WorldError};

use crate::audience::Audience;
use crate::canopy::Canopy;
use crate::demonstration::{DrivenFrame, PERSON, Shelf, Start};
use crate::recorded::Reel;

/// Name of the driver that does nothing.
pub const NOBODY: &str = "nobody";

/// Name of the driver that returns recorded commands.
pub const RECORDED: &str = "recording";

/// Paths of the dials in a world's config.
const FOLIAGE: &str = "foliage.density";
const WIND: &str = "wind.speed";

/// Options of a viewer.
pub struct Setup {
    /// Options of the scenario; none for a recorded one with a part that came from a file: no other world grows of it.
    pub options: Option<Options>,
    /// Controllers of the program.
    pub controllers: Vec<Arc<dyn ControllerKind>>,
    /// Seed of the population.
    pub seed: u64,
    /// Index of the tree within the seed.
    pub index: u32,
}

/// What a viewer can change without the command line. `None` leaves a part as the options say.
#[derive(Debug, Clone, PartialEq)]
pub struct Dials {
    /// Preset of the world.
    pub preset: Option<String>,
    /// Foliage.
    pub foliage: Option<f64>,
    /// Mean wind at the height of the canopy [m/s].
    pub wind: Option<f64>,
    /// Strength of the randomisation on all axes, 0 to 1.
    pub randomisation: Option<f64>,
    /// Name of the controller, or [`NOBODY`].
    pub driver: String,
    /// Seed.
    pub seed: u64,
    /// Index of the tree.
    pub index: u32,
}

/// The world on show.
pub struct Stage {
    setup: Setup,
    dials: Dials,
    scenario: Scenario,
    session: Session,
    /// Canopy zones of the world at its start.
    canopy: Canopy,
    /// The recorded episode on show, if it is one.
    reel: Option<Reel>,
    /// Keeps demonstrations, if it is asked to.
    shelf: Option<Box<dyn Shelf>>,
    /// Frames of a demonstration under way.
    driven: Option<Vec<DrivenFrame>>,
    /// Goal of the demonstrated task.
    goal: Option<Goal>,
    /// Who watches every frame.
    audience: Option<Box<dyn Audience>>,
}

impl Stage {
    /// Grows the world of a setup.
    ///
    /// # Errors
    /// An option that cannot be used, or a world that cannot be built; the message names it.
    pub fn new(setup: Setup) -> Result<Self, String> {
        let options = setup.options.clone().unwrap_or_default();
        let driver = options.controller.as_ref().map(|given| given.value.clone());
        let scenario = Scenario::resolve(&options, &setup.controllers).map_err(told)?;
        let dials = Dials {
            preset: None,
            foliage: None,
            wind: None,
            randomisation: None,
            driver: driver.unwrap_or_else(|| scenario.names().controller.clone()),
            seed: setup.seed,
            index: setup.index,
        };
        let (session, canopy) = grow(&scenario, &dials, None)?;
        Ok(Self {
            setup,
            dials,
            scenario,
            session,
            canopy,
            reel: None,
            shelf: None,
            driven: None,
            goal: None,
            audience: None,
        })
    }

    /// Shows a recorded episode: the world of a setup's seed and index in a scenario, driven by the commands of every frame.
    ///
    /// # Errors
    /// The world cannot be built.
    pub fn of_recording(
        setup: Setup,
        scenario: Scenario,
        repeat: u32,
        commands: Vec<Command>,
    ) -> Result<Self, String> {
        let (seed, index) = (setup.seed, setup.index);
        let world = scenario.world(seed, index, repeat).map_err(|e| no_world(seed, index, &e))?;
        let canopy = canopy(&scenario, &world)?;
        let reel = Reel::new(commands, &world);
        let make = reel.make(&world);
        let dials = Dials {
            preset: None,
            foliage: None,
            wind: None,
            randomisation: None,
            driver: RECORDED.to_owned(),
            seed: setup.seed,
            index: setup.index,
        };
        let session = Session::new(world, Some(make));
        Ok(Self {
            setup,
            dials,
            scenario,
            session,
            canopy,
            reel: Some(reel),
            shelf: None,
            driven: None,
            goal: None,
            audience: None,
        })
    }

    /// Advances one frame. Returns false, and does nothing, at the end of a recording that nobody changed.
    pub fn step(&mut self) -> bool {
        let by_reel = self.dials.driver == RECORDED;
        let at = self.session.world().frame();
        if self.reel.as_ref().is_some_and(|reel| by_reel && reel.is_true() && at >= reel.frames()) {
            return false;
        }
        match &mut self.audience {
            None => self.session.step(),
            Some(audience) => {
                self.session.step_seen(&mut |world, sight| audience.before(world, sight));
                audience.after(self.session.world(), self.session.news());
            }
        }
        self.note();
        if let Some(reel) = &mut self.reel {
            reel.keep(&self.session, by_reel);
        }
        true
    }

    /// Notes the frame that was stepped in the demonstration under way. One in which a hand pulled is given up: its commands alone do not lead there.
    fn note(&mut self) {
        let Some(driven) = &mut self.driven else { return };
        if self.session.pull().is_some() {
            self.driven = None;
            return;
        }
        let Some(command) = self.session.command().copied() else { return };
        let state = self.session.state().map_or("", state_name);
        let phase = if self.session.is_taken_over() { PERSON } else { state };
        driven.push(DrivenFrame { command, phase: phase.to_owned() });
    }

    /// Shows every frame from now on to an audience.
    pub fn show_to(&mut self, audience: Box<dyn Audience>) {
        self.audience = Some(audience);
        self.tell_audience();
    }

    /// Tells the audience of another world or moment.
    fn tell_audience(&mut self) {
        if let Some(audience) = &mut self.audience {
            audience.begin(self.session.world());
        }
    }

    /// Keeps demonstrations on a shelf from now on.
    pub fn keep_on(&mut self, shelf: Box<dyn Shelf>) {
        self.shelf = Some(shelf);
    }

    /// True if demonstrations are kept.
    pub fn has_shelf(&self) -> bool {
        self.shelf.is_some()
    }

    /// Begins a demonstration: the world grows anew, and a person drives from its first frame. A task with a goal takes the first tree that has one.
    ///
    /// # Errors
    /// A sentence that says why none can be kept: no shelf, a recording, another tree than 0, or a seed that the shelf does not take.
    pub fn begin_demonstration(&mut self) -> Result<(), String> {
        let Some(shelf) = &self.shelf else {
            return Err("start the viewer with --demos DIR to keep demonstrations".to_owned());
        };
        if self.reel.is_some() {
            return Err("a recorded world gives no demonstration; grow another".to_owned());
        }
        if self.dials.index != 0 {
            return Err("demonstrations are of tree 0 of a seed; take another seed".to_owned());
        }
        let Start { index, goal } = shelf.start(&self.scenario, self.dials.seed)?;
        let dials = Dials { index, ..self.dials.clone() };
        (self.session, self.canopy) = grow(&self.scenario, &dials, goal.as_ref())?;
        self.session.take_over();
        (self.driven, self.goal) = (Some(Vec::new()), goal);
        self.tell_audience();
        Ok(())
    }

    /// Ends the demonstration under way, keeps it, and returns a sentence about it.
    ///
    /// # Errors
    /// A sentence that says why it cannot be kept; it goes on then.
    pub fn end_demonstration(&mut self) -> Result<String, String> {
        let (Some(shelf), Some(driven)) = (&mut self.shelf, &self.driven) else {
            return Err("no demonstration is under way".to_owned());
        };
        let sentence = shelf.keep(&self.scenario, self.dials.seed, driven)?;
        self.driven = None;
        Ok(sentence)
    }

    /// Frames of the demonstration under way; none without one.
    pub fn demonstrated_frames(&self) -> Option<usize> {
        self.driven.as_ref().map(Vec::len)
    }

    /// Goal of the task that is demonstrated in this world; none for the harvest.
    pub fn goal(&self) -> Option<&Goal> {
        self.goal.as_ref()
    }

    /// Frames of the recording on show; `None` for a live world.
    pub fn recorded_frames(&self) -> Option<u32> {
        self.reel.as_ref().map(Reel::frames)
    }

    /// True for a live world, and for a recorded one in which nobody took part.
    pub fn is_as_recorded(&self) -> bool {
        self.reel.as_ref().is_none_or(Reel::is_true)
    }

    /// Goes to a frame of the recording on show, which drives again from there; a live world stays.
    ///
    /// # Errors
    /// The kept moments are of another world.
    pub fn seek(&mut self, frame: u32) -> Result<(), String> {
        let Some(reel) = &mut self.reel else { return Ok(()) };
        if self.dials.driver != RECORDED {
            self.dials.driver = RECORDED.to_owned();
            self.session.drive_by(Some(reel.make(self.session.world())));
        }
        let sought = reel.seek(&mut self.session, frame);
        self.tell_audience();
        sought
    }

    /// Grows the world that the dials ask for, and gives a demonstration under way up. If there is none, the present one stays.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn turn(&mut self, mut dials: Dials) -> Result<(), String> {
        if dials.driver == RECORDED {
            // Another world has no recording.
            dials.driver = self.scenario.names().controller.clone();
        }
        let scenario = resolve(&self.setup, &dials).map_err(told)?;
        (self.session, self.canopy) = grow(&scenario, &dials, None)?;
        (self.scenario, self.dials, self.reel) = (scenario, dials, None);
        (self.driven, self.goal) = (None, None);
        self.tell_audience();
        Ok(())
    }

    /// Lets another driver drive from now on, in the world as it is.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn drive_by(&mut self, driver: &str) -> Result<(), String> {
        let dials = Dials { driver: driver.to_owned(), ..self.dials.clone() };
        if let Some(reel) = self.reel.as_ref().filter(|_| driver == RECORDED) {
            self.session.drive_by(Some(reel.make(self.session.world())));
            self.dials = dials;
            return Ok(());
        }
        if driver == NOBODY {
            self.session.drive_by(None);
            self.dials = dials;
            return Ok(());
        }
        let scenario = resolve(&self.setup, &dials).map_err(told)?;
        self.session.drive_by(make(&scenario, &dials.driver, self.goal.as_ref())?);
        (self.scenario, self.dials) = (scenario, dials);
        Ok(())
    }

    /// Brings the world back to its start; a demonstration under way is given up.
    pub fn reset(&mut self) {
        self.driven = None;
        // A recorded world goes back to the recorded start.
        let is_back = self.reel.is_some() && self.seek(0).is_ok();
        if !is_back {
            self.session.reset();
            self.tell_audience();
        }
    }

    /// The dials.
    pub fn dials(&self) -> &Dials {
        &self.dials
    }

    /// The scenario.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Canopy zones of the world at its start.
    pub fn canopy(&self) -> &Canopy {
        &self.canopy
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The session, to step it, pull and drive.
    pub fn session_mut(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Names of the drivers: the program's controllers, that of the options, and nobody.
    pub fn drivers(&self) -> Vec<String> {
        let mut names: Vec<String> =
            self.setup.controllers.iter().map(|kind| kind.name().to_owned()).collect();
        if let Some(given) = self.setup.options.as_ref().and_then(|options| options.controller.as_ref())
            && !names.contains(&given.value)
        {
            names.push(given.value.clone());
        }
        names.push(NOBODY.to_owned());
        names.extend(self.reel.as_ref().map(|_| RECORDED.to_owned()));
        names
    }

    /// Range of the foliage dial.
    pub fn foliage_range(&self) -> [f64; 2] {
        self.scenario.spec().foliage.density.range()
    }

    /// Mean wind at the height of the canopy [m/s].
    pub fn wind(&self) -> f64 {
        self.scenario.spec().wind.as_ref().map_or(0.0, |wind| wind.speed.value())
    }
}

fn told(e: ScenarioError) -> String {
    e.to_string()
}

/// The scenario of a setup under dials.
fn resolve(setup: &Setup, dials: &Dials) -> Result<Scenario, ScenarioError> {
    let by_dial = |value: &str, dial: &str| Some(OptionValue::new(value, format!("the dial {dial}")));
    let Some(mut options) = setup.options.clone() else {
        let problem = "a part of the recorded scenario came from a file; give its options beside --recording to change it";
        return Err(ScenarioError::new("the dials", problem));
    };
    if let Some(preset) = &dials.preset {
        (options.config, options.tree) = (None, None);
        (options.tree_unit, options.tree_plant) = (None, None);
        options.preset = by_dial(preset, "preset");
    }
    if let Some(strength) = dials.randomisation {
        options.randomisation = by_dial(&strength.to_string(), "randomisation");
    }
    if dials.driver != NOBODY {
        options.controller = by_dial(&dials.driver, "driver");
    }
    let scenario = Scenario::resolve(&options, &setup.controllers)?;
    let mut spec: Spec = (**scenario.spec()).clone();
    let mut figures = Vec::new();
    figures.extend(dials.foliage.map(|foliage| (FOLIAGE, foliage)));
    if let Some(wind) = dials.wind {
        if spec.wind.is_none() {
            spec = in_wind(&spec)?;
        }
        figures.push((WIND, wind));
    }
    if figures.is_empty() && dials.wind.is_none() {
        return Ok(scenario);
    }
    let changed = spec.with_figures("the dials", &figures);
    changed.map(|spec| scenario.with_spec(spec)).map_err(|e| ScenarioError::new("the dials", e))
}

/// A world's config with still air that can blow.
fn in_wind(spec: &Spec) -> Result<Spec, ScenarioError> {
    let base = toml::Table::from_iter([("base".to_owned(), toml::Value::from("measured"))]);
    let world = toml::Table::from_iter([("wind".to_owned(), toml::Value::Table(base))]);
    Changes { world, ..Changes::default() }.of_world(spec, "the dial wind")
}

fn grow(scenario: &Scenario, dials: &Dials, goal: Option<&Goal>) -> Result<(Session, Canopy), String> {
    let (seed, index) = (dials.seed, dials.index);
    let make = make(scenario, &dials.driver, goal)?;
    let world = scenario.world(seed, index, 0).map_err(|e| no_world(seed, index, &e))?;
    let canopy = canopy(scenario, &world)?;
    Ok((Session::new(world, make), canopy))
}

/// The canopy zones of a world at its start.
fn canopy(scenario: &Scenario, world: &World) -> Result<Canopy, String> {
    let protocol = Protocol::of_scenario(scenario).map_err(|e| e.to_string())?;
    Ok(Canopy::of(world, &protocol.zones))
}

fn no_world(seed: u64, index: u32, e: &WorldError) -> String {
    format!("tree {index} of seed {seed} cannot be built: {e}")
}

/// Makes controllers of a scenario, with a task's goal if there is one; none for [`NOBODY`].
fn make(scenario: &Scenario, driver: &str, goal: Option<&Goal>) -> Result<Option<Make>, String> {
    if driver == NOBODY {
        return Ok(None);
    }
    let scenario = scenario.clone();
    if let Some(goal) = goal.copied() {
        if !scenario.controller_kind().takes_goals() {
            return Err(format!(
                "controller {driver}: it takes no goals, which the task has; choose another, or {NOBODY}"
            ));
        }
        let made = move || scenario.controller_with_goal(&goal).unwrap_or_else(|| scenario.controller());
        return Ok(Some(Box::new(made)));
    }
    if scenario.controller_kind().needs_goal() {
        let problem = "it needs a goal, which only the tasks reach-and-grasp and gentle give";
        return Err(format!("controller {driver}: {problem}"));
    }
    Ok(Some(Box::new(move || -> Box<dyn Controller> { scenario.controller() })))
}

#[cfg(test)]
#[path = "stage_tests.rs"]
mod tests;

//! The official benchmark under a policy in Python.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use numpy::PyReadonlyArray1;
use orchard_policy::{Encoding, Pilot, Spaces, Target};
use orchard_tasks::harvest::command_log::CommandLog;
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::interface::ControllerEvent;
use orchardbench::{
    Command, Controller, ControllerKind, DetectorConfig, Failure, Goal, Observation, PictureRequest, Program,
    Record, RobotModel,
};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays;
use crate::core::{resolved, spaces_of};
use crate::guard::{fault, setting};

/// Time between two looks for Ctrl-C, and stack of the program's thread: a choice without effect on results.
const LOOK: Duration = Duration::from_millis(50);
const STACK: usize = 8 << 20;

/// The policy and how it is asked.
struct Door {
    /// Called with the conventions (JSON) as an episode begins; returns what answers observations.
    begin: Py<PyAny>,
    spaces: Spaces,
    /// Pictures that the policy sees.
    pictures: Option<Arc<PictureRequest>>,
    /// True if the policy answers each frame with the command itself.
    commands: bool,
    depth_size: [usize; 2],
    frame_rate: f64,
    stop: Arc<AtomicBool>,
    /// The first exception.
    failed: Mutex<Option<PyErr>>,
}

impl Door {
    /// Ends the run; the first exception is kept.
    fn fail(&self, e: PyErr) {
        self.failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(e);
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// The kind of controllers that ask the policy.
struct PolicyKind {
    name: String,
    configs: Vec<(String, String)>,
    door: Arc<Door>,
}

impl std::fmt::Debug for PolicyKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:?}", self.name, self.configs)
    }
}

impl PolicyKind {
    fn make(&self, robot: &RobotModel, told: Option<(Target, [f64; 4])>) -> Box<dyn Controller> {
        let door = self.door.clone();
        let begun = || -> PyResult<(Pilot, Py<PyAny>)> {
            let spaces = Spaces { target: told.map(|told| told.0), ..door.spaces.clone() };
            let encoding =
                Encoding::new(robot, &spaces, door.depth_size, door.frame_rate).map_err(setting)?;
            let interface = serde_json::to_string(encoding.interface()).map_err(fault)?;
            let policy = Python::attach(|py| door.begin.call1(py, (interface,)))?;
            Ok((Pilot::new(Arc::new(encoding), told.map(|told| told.1)), policy))
        };
        let begun = begun().map_err(|e| door.fail(e)).ok();
        Box::new(PolicyController { door, begun, record: Record::default() })
    }
}

impl ControllerKind for PolicyKind {
    fn name(&self) -> &str {
        &self.name
    }

    fn configs(&self) -> Vec<(String, String)> {
        self.configs.clone()
    }

    fn pictures(&self) -> Option<Arc<PictureRequest>> {
        self.door.pictures.clone()
    }

    fn controller(&self, robot: &RobotModel, _: &DetectorConfig) -> Box<dyn Controller> {
        self.make(robot, None)
    }

    fn takes_goals(&self) -> bool {
        true
    }

    fn with_goal(&self, goal: &Goal, robot: &RobotModel, _: &DetectorConfig) -> Option<Box<dyn Controller>> {
        let told = match *goal {
            Goal::Grasp { p_odom, radius } => (Target::Fruit, [p_odom.x, p_odom.y, p_odom.z, radius]),
            Goal::Reach { p_odom, heading_odom } => {
                (Target::Point, [p_odom.x, p_odom.y, p_odom.z, heading_odom])
            }
        };
        Some(self.make(robot, Some(told)))
    }
}

/// The policy in one episode.
struct PolicyController {
    door: Arc<Door>,
    /// Controller that drives the robot, and the policy that answers it; none if the policy failed to begin.
    begun: Option<(Pilot, Py<PyAny>)>,
    record: Record,
}

impl Controller for PolicyController {
    fn act(&mut self, seen: &Observation) -> Command {
        self.command(seen).unwrap_or_else(|e| {
            self.door.fail(e);
            Command::still(seen)
        })
    }

    fn record(&self) -> &Record {
        &self.record
    }
}

impl PolicyController {
    fn command(&mut self, seen: &Observation) -> PyResult<Command> {
        let Some((pilot, policy)) = &mut self.begun else { return Ok(Command::still(seen)) };
        let Some(values) = pilot.see(seen) else { return Ok(pilot.command(seen)) };
        Python::attach(|py| {
            let fields = &pilot.encoding().interface().observation;
            let observation = arrays::single(py, fields, values)?;
            let answer = policy.bind(py).call1((observation,))?;
            let (answer, log): (Bound<'_, PyAny>, Option<String>) = answer.extract()?;
            if let Some(log) = log {
                note(&log, &mut self.record, seen.time)?;
            }
            if self.door.commands {
                return command_of(&answer, seen);
            }
            let action: PyReadonlyArray1<'_, f32> = answer.extract()?;
            let action = action.as_slice()?;
            if let Some((channel, value)) = pilot.encoding().refused(action) {
                let text = format!("action: {} is {value}, which is not a finite number", channel.name);
                return Err(PyValueError::new_err(text));
            }
            pilot.act(action);
            Ok(pilot.command(seen))
        })
    }
}

/// Adds the events that a policy logged, as JSON, to a record.
fn note(log: &str, record: &mut Record, time: f64) -> PyResult<()> {
    let events: Vec<ControllerEvent> =
        serde_json::from_str(log).map_err(|e| PyValueError::new_err(format!("log: {e}")))?;
    let noted = events.iter().try_for_each(|event| event.note_in(record, time));
    noted.map_err(|e| PyValueError::new_err(format!("log: {e}")))
}

/// A command that the policy gives itself: arm_q, arm_v, base_velocity, finger_q, finger_force, vacuum.
fn command_of(answer: &Bound<'_, PyAny>, seen: &Observation) -> PyResult<Command> {
    type Parts = (Vec<f64>, Vec<f64>, [f64; 3], f64, f64, f64);
    let (arm_q, arm_v, base_velocity, finger_q, finger_force, vacuum): Parts = answer.extract()?;
    let dof = seen.arm_q.len();
    for (name, numbers) in [("arm_q", &arm_q), ("arm_v", &arm_v)] {
        if numbers.len() != dof {
            let text = format!("command: {name} has {} numbers for {dof} joints", numbers.len());
            return Err(PyValueError::new_err(text));
        }
    }
    let rest = [finger_q, finger_force, vacuum];
    if !arm_q.iter().chain(&arm_v).chain(&base_velocity).chain(&rest).all(|x| x.is_finite()) {
        return Err(PyValueError::new_err("command: it has a number that is not finite"));
    }
    let joints = |numbers: Vec<f64>| numbers.try_into().map_err(fault);
    let (arm_q, arm_v) = (joints(arm_q)?, joints(arm_v)?);
    Ok(Command { arm_q, arm_v, base_velocity, finger_q, finger_force, vacuum })
}

/// Runs a command line of the program (first word: the program's name) with a policy as an additional controller. `begin` is called with the
/// conventions as JSON at the start of every episode, and returns what answers observations: with an action or command, and the events
/// to log as JSON.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the keyword arguments of Python")]
pub fn run_benchmark(
    py: Python<'_>,
    begin: Py<PyAny>,
    name: String,
    configs: Vec<(String, String)>,
    scenario: Option<PathBuf>,
    options: Vec<(String, String)>,
    obs: Vec<String>,
    pixels: (u32, u32, u32),
    control: Option<&str>,
    control_hz: u32,
    line: Vec<String>,
) -> PyResult<()> {
    let mut spaces =
        spaces_of(&obs, pixels, control.unwrap_or("joint_delta"), control_hz).map_err(setting)?;
    let scenario = resolved(py, scenario, options)?;
    let (view, frame_rate) = (scenario.spec().camera.view(), scenario.spec().sim.frame_rate.si());
    if control.is_none() {
        spaces.control_hz = frame_rate.round() as u32;
    }
    let depth_size = [view.width.get() as usize, view.height.get() as usize];
    // Bad settings are told before anything runs.
    let encoding = Encoding::new(scenario.robot(), &spaces, depth_size, frame_rate).map_err(setting)?;
    let pictures = encoding.pictures().cloned();
    let stop = Arc::new(AtomicBool::new(false));
    let (commands, failed) = (control.is_none(), Mutex::new(None));
    let stopped = stop.clone();
    let door = Door { begin, spaces, pictures, commands, depth_size, frame_rate, stop: stopped, failed };
    let door = Arc::new(door);
    let kind = PolicyKind { name, configs, door: door.clone() };
    let program = Program::new().with(kind).stopped_by(stop);
    let run = thread::Builder::new().stack_size(STACK).spawn(move || {
        catch_unwind(AssertUnwindSafe(|| program.call(line))).unwrap_or_else(|panic| {
            let text = crate::guard::panic_text(&*panic);
            Err(Failure::Failed(format!("a fault in OrchardBench, please report it: {text}")))
        })
    })?;
    while !run.is_finished() {
        py.detach(|| thread::sleep(LOOK));
        if let Err(e) = py.check_signals() {
            door.fail(e);
        }
    }
    let result = py.detach(|| run.join());
    if let Some(e) = door.failed.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(e);
    }
    match result.unwrap_or_else(|_| Err(Failure::Failed("the run ended without a result".to_owned()))) {
        Ok(()) => Ok(()),
        Err(e @ Failure::BadInput(_)) => Err(PyValueError::new_err(e.to_string())),
        Err(e @ Failure::Interrupted(_)) => Err(PyKeyboardInterrupt::new_err(e.to_string())),
        Err(e) => Err(PyRuntimeError::new_err(e.to_string())),
    }
}

/// The command log of an episode under a result folder, as JSON: `commands`, one a frame, and `events` with their frames. `episode` is the name
/// of its record without `.json`.
#[pyfunction]
pub fn command_log(folder: PathBuf, episode: &str) -> PyResult<String> {
    let file = folder.join("episodes").join(format!("{episode}.json"));
    let read = || -> Result<String, String> {
        let at = |problem: String| format!("{}: {problem}", file.display());
        let text = orchard_input::text(&file, orchard_input::RESULT).map_err(|e| at(e.to_string()))?;
        let record: EpisodeRecord = serde_json::from_str(&text).map_err(|e| at(e.to_string()))?;
        let log = CommandLog::read(&folder, &record.key).map_err(|e| e.to_string())?;
        serde_json::to_string(&log).map_err(|e| e.to_string())
    };
    read().map_err(PyValueError::new_err)
}

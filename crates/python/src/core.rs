//! The environments as a Python object.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use orchard_bench::store::write_json;
use orchard_env::{EnvError, Pool, Settings, Task, TaskEnv};
use orchard_policy::{Control, Pixels, SettingError, Spaces};
use orchard_scenario::{Options, Scenario, controllers};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::arrays;
use crate::buffers::{self, Buffers};
use crate::guard::{detached, exception};
use crate::tensors::OnCard;

/// Environments of one task that step together.
#[pyclass(module = "orchardbench._native")]
pub struct Core {
    env: TaskEnv,
    /// Threads of its own, which do not outlive it.
    pool: ThreadPool,
    /// Arrays of its own for observations; none if each observation has new ones.
    buffers: Option<Buffers>,
    /// Observations that stay on a card, if they do.
    card: Option<OnCard>,
    /// The process that made it: threads are not in a forked one.
    process: u32,
}

/// The spaces of names; `pixels` are height, width and rate of pictures, if they are observed.
pub fn spaces_of(
    obs: &[String],
    pixels: (u32, u32, u32),
    control: &str,
    control_hz: u32,
) -> Result<Spaces, SettingError> {
    let groups: Vec<&str> = obs.iter().map(String::as_str).collect();
    let control = Control::named(control)?;
    let spaces = Spaces::default().observing(&groups)?;
    let (height, width, hz) = pixels;
    let pixels = spaces.pixels.map(|_| Pixels { height, width, hz });
    Ok(Spaces { pixels, control, control_hz, ..spaces })
}

#[cfg(feature = "gpu")]
fn frames_of(env: &TaskEnv) -> Option<std::collections::BTreeMap<String, u64>> {
    env.tally().map(|tally| tally.frames)
}

#[cfg(feature = "gpu")]
fn times_of(env: &mut TaskEnv) -> Option<std::collections::BTreeMap<String, f64>> {
    let profile = env.profile();
    if profile.is_none() {
        env.keep_profile(Some(orchard_env::Detail::Kernels));
    }
    let profile = profile.or_else(|| env.profile())?;
    let host = profile.host.into_iter().map(|(part, seconds)| (format!("host.{part}"), seconds));
    let device = profile.device.into_iter().map(|(kernel, seconds)| (format!("device.{kernel}"), seconds));
    Some(host.chain(device).chain([("rounds".to_owned(), profile.rounds as f64)]).collect())
}

#[cfg(not(feature = "gpu"))]
fn times_of(_: &mut TaskEnv) -> Option<std::collections::BTreeMap<String, f64>> {
    None
}

#[cfg(not(feature = "gpu"))]
fn frames_of(_: &TaskEnv) -> Option<std::collections::BTreeMap<String, u64>> {
    None
}

/// The scenario of a file and of options over it.
pub fn resolved(py: Python<'_>, file: Option<PathBuf>, options: Vec<(String, String)>) -> PyResult<Scenario> {
    let resolve = || {
        let pairs: Vec<(&str, &str)> = options.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
        let given = Options::of(&pairs)?;
        let below = file.as_deref().map(Options::from_file).transpose()?.unwrap_or_default();
        Scenario::resolve(&given.over(below), &controllers())
    };
    detached(py, resolve)?.map_err(|e| PyValueError::new_err(e.to_string()))
}

#[pymethods]
impl Core {
    /// Makes environments: `options` are those of a scenario on the command line, `pixels` height, width and rate of pictures, `backend` cpu or gpu, `pool` number and seed of the trees that are kept, `worlds` the first index and the number of worlds, `threads` 0 for
    /// one a core; with `copy` each observation has arrays of its own. With `card` the observations stay on the graphics device, which must be CUDA's device of that number, or any of CUDA's if it is negative.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        task: &str,
        scenario: Option<PathBuf>,
        options: Vec<(String, String)>,
        obs: Vec<String>,
        pixels: (u32, u32, u32),
        control: &str,
        control_hz: u32,
        reward: &str,
        privileged: bool,
        backend: &str,
        pool: Option<(u32, u64)>,
        worlds: (u32, u32),
        threads: usize,
        copy: bool,
        card: Option<i64>,
    ) -> PyResult<Self> {
        let settings = || -> Result<Settings, EnvError> {
            let settings = Settings::of(Task::named(task)?).rewarding(reward)?;
            let spaces = spaces_of(&obs, pixels, control, control_hz)?;
            let backend = backend.parse().map_err(|problem| SettingError {
                option: "backend",
                value: backend.to_owned(),
                problem,
            })?;
            let pool = pool.map(|(trees, seed)| Pool { trees, seed });
            Ok(Settings { spaces, privileged, backend, pool, ..settings })
        };
        let settings = settings().map_err(exception)?;
        let scenario = resolved(py, scenario, options)?;
        let (first, count) = worlds;
        let range = first..first.saturating_add(count);
        let mut env = detached(py, || TaskEnv::new(&scenario, &settings, range))?.map_err(exception)?;
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|e| PyRuntimeError::new_err(format!("threads {threads}: {e}")))?;
        let card = card.map(|number| OnCard::new(py, &mut env, number.try_into().ok())).transpose()?;
        let buffers = if copy || card.is_some() { None } else { Some(Buffers::new(py, &env)?) };
        Ok(Self { env, pool, buffers, card, process: std::process::id() })
    }

    /// The conventions as JSON text.
    fn interface(&self) -> PyResult<String> {
        serde_json::to_string(self.env.interface()).map_err(|e| PyRuntimeError::new_err(e.to_string()))
    }

    /// Writes the conventions into a JSON file.
    fn write_interface(&self, file: PathBuf) -> PyResult<()> {
        write_json(&file, self.env.interface()).map_err(|e| PyOSError::new_err(e.to_string()))
    }

    fn reset(
        &mut self,
        py: Python<'_>,
        seeds: Vec<Option<u64>>,
        mask: PyReadonlyArray1<'_, bool>,
    ) -> PyResult<()> {
        let mask = mask.as_slice()?.to_vec();
        self.compute(py, |env| env.reset(&seeds, &mask))
    }

    /// Takes the actions, a row an environment; those that `resets` names begin their next episodes instead.
    fn step(
        &mut self,
        py: Python<'_>,
        actions: PyReadonlyArray2<'_, f32>,
        resets: Option<PyReadonlyArray1<'_, bool>>,
    ) -> PyResult<()> {
        let actions = actions.as_slice()?.to_vec();
        let resets = resets.map(|mask| mask.as_slice().map(<[bool]>::to_vec)).transpose()?;
        self.compute(py, |env| {
            let Some(resets) = resets else { return env.step(&actions, &vec![true; env.len()]) };
            env.step(&actions, &resets.iter().map(|reset| !reset).collect::<Vec<_>>())?;
            env.reset(&vec![None; env.len()], &resets)
        })
    }

    /// The observations in new arrays, or in arrays of our own, which stay as they are until the call after the next; with `again` the latest of
    /// these are written once more.
    fn observations<'py>(&mut self, py: Python<'py>, again: bool) -> PyResult<Bound<'py, PyDict>> {
        let given = match &mut self.buffers {
            None => buffers::zeros(py, &self.env)?,
            Some(buffers) => buffers.turned(py, !again).copy()?,
        };
        self.observe_into(py, &given)?;
        for (key, texts) in buffers::texts(py, &self.env)? {
            given.set_item(key, texts)?;
        }
        Ok(given)
    }

    /// Writes the observations, but for text, into arrays of the caller's.
    fn observe_into(&self, py: Python<'_>, arrays: &Bound<'_, PyDict>) -> PyResult<()> {
        self.check_process()?;
        let (env, pool) = (&self.env, &self.pool);
        buffers::with_numbers(env, arrays, |numbers| {
            if buffers::is_much(&numbers) {
                return detached(py, || pool.install(|| buffers::fill(env, numbers)));
            }
            buffers::fill(env, numbers);
            Ok(())
        })
    }

    /// The arrays on the card by key, the same at every time; none if the observations do not stay there.
    fn card_arrays<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.card.as_ref().map(|card| card.arrays(py)).transpose()
    }

    /// Sends the observations to the arrays on the card and waits until they are there; returns the texts, which are not.
    fn send<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        #[cfg(feature = "gpu")]
        self.compute(py, TaskEnv::send)?;
        let texts = PyDict::new(py);
        for (key, text) in buffers::texts(py, &self.env)? {
            texts.set_item(key, text)?;
        }
        Ok(texts)
    }

    /// Rewards, ends, true if an episode ended, and info of the environments that the mask names, of all without one.
    fn reports<'py>(
        &self,
        py: Python<'py>,
        mask: Option<Bound<'py, PyArray1<bool>>>,
    ) -> PyResult<arrays::Reports<'py>> {
        arrays::reports(py, &self.env, mask)
    }

    /// Reward, ends and info of the only environment, as plain values.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<(f64, bool, bool, Bound<'py, PyDict>)> {
        arrays::report(py, &self.env)
    }

    /// Numbers of frames by the place where they were computed; none on the CPU.
    fn frames(&self) -> Option<std::collections::BTreeMap<String, u64>> {
        frames_of(&self.env)
    }

    /// Seconds by the part of a step; none on the CPU. They are kept from the first call on.
    fn times(&mut self) -> Option<std::collections::BTreeMap<String, f64>> {
        times_of(&mut self.env)
    }

    fn snapshot<'py>(&mut self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        let states = self.compute(py, |env| env.snapshot())?;
        Ok(states.iter().map(|state| PyBytes::new(py, state)).collect())
    }

    fn restore(&mut self, py: Python<'_>, states: Vec<Vec<u8>>) -> PyResult<()> {
        self.compute(py, |env| env.restore(&states))
    }
}

impl Core {
    fn check_process(&self) -> PyResult<()> {
        let now = std::process::id();
        if now == self.process {
            return Ok(());
        }
        Err(PyRuntimeError::new_err(format!(
            "this environment was made in process {} and cannot be used in its fork {now}: make it after the fork, or start processes with the method spawn",
            self.process
        )))
    }

    /// Computes on the own threads, without the interpreter's lock, after work of CUDA that may read what is written.
    fn compute<T: Send>(
        &mut self,
        py: Python<'_>,
        compute: impl FnOnce(&mut TaskEnv) -> Result<T, EnvError> + Send,
    ) -> PyResult<T> {
        self.check_process()?;
        let (env, pool, card) = (&mut self.env, &self.pool, &self.card);
        let all = || {
            card.as_ref().map_or(Ok(()), OnCard::wait)?;
            pool.install(|| compute(env))
        };
        detached(py, all)?.map_err(exception)
    }
}

//! Observations of all environments in numpy arrays that are written in place, one row an environment.

use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use orchard_env::TaskEnv;
use orchard_policy::{Field, Values};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rayon::prelude::*;

/// Two sets of arrays that are written by turns: what a step gives out stays as it is during the next step.
pub struct Buffers {
    sets: [Py<PyDict>; 2],
    latest: usize,
}

impl Buffers {
    pub fn new(py: Python<'_>, env: &TaskEnv) -> PyResult<Self> {
        Ok(Self { sets: [zeros(py, env)?.unbind(), zeros(py, env)?.unbind()], latest: 0 })
    }

    /// The latest arrays, or with `turn` the other ones.
    pub fn turned<'py>(&mut self, py: Python<'py>, turn: bool) -> Bound<'py, PyDict> {
        if turn {
            self.latest = 1 - self.latest;
        }
        self.sets[self.latest].bind(py).clone()
    }
}

/// Arrays of zeros for all fields but text.
pub fn zeros<'py>(py: Python<'py>, env: &TaskEnv) -> PyResult<Bound<'py, PyDict>> {
    let arrays = PyDict::new(py);
    for field in &env.interface().policy.observation {
        let shape = shape_of(field, env.len());
        match field.dtype {
            "str" => {}
            "uint8" => arrays.set_item(field.key, PyArrayDyn::<u8>::zeros(py, shape, false))?,
            _ => arrays.set_item(field.key, PyArrayDyn::<f32>::zeros(py, shape, false))?,
        }
    }
    Ok(arrays)
}

/// Shape of a field of all environments.
fn shape_of(field: &Field, envs: usize) -> Vec<usize> {
    [&[envs], field.shape.as_slice()].concat()
}

/// An array that is being written.
enum Open<'py> {
    F32(PyReadwriteArrayDyn<'py, f32>),
    U8(PyReadwriteArrayDyn<'py, u8>),
}

/// The numbers of an array.
pub enum Numbers<'a> {
    F32(&'a mut [f32]),
    U8(&'a mut [u8]),
}

/// Opens the arrays of a dictionary for all fields but text, and hands their numbers, each with the index of its field, to `write`.
pub fn with_numbers<T>(
    env: &TaskEnv,
    arrays: &Bound<'_, PyDict>,
    write: impl FnOnce(Vec<(usize, Numbers<'_>)>) -> PyResult<T>,
) -> PyResult<T> {
    let mut open = Vec::new();
    for (i, field) in env.interface().policy.observation.iter().enumerate() {
        open.push((
            i,
            match field.dtype {
                "str" => continue,
                "uint8" => Open::U8(opened(arrays, field, env.len())?),
                _ => Open::F32(opened(arrays, field, env.len())?),
            },
        ));
    }
    let mut numbers = Vec::new();
    for (i, array) in &mut open {
        numbers.push((
            *i,
            match array {
                Open::F32(array) => Numbers::F32(array.as_slice_mut()?),
                Open::U8(array) => Numbers::U8(array.as_slice_mut()?),
            },
        ));
    }
    write(numbers)
}

/// The array of a field, if it has its type and shape and can be written.
fn opened<'py, T: Element>(
    arrays: &Bound<'py, PyDict>,
    field: &Field,
    envs: usize,
) -> PyResult<PyReadwriteArrayDyn<'py, T>> {
    let (key, shape) = (field.key, shape_of(field, envs));
    let refused = |problem: String| PyValueError::new_err(format!("observations: {key} {problem}"));
    let found = arrays.get_item(key)?.ok_or_else(|| refused("is missing".to_owned()))?;
    let array = found.cast_into::<PyArrayDyn<T>>().map_err(|_| {
        PyTypeError::new_err(format!("observations: {key} must be a numpy array of {}", field.dtype))
    })?;
    if array.shape() != shape {
        return Err(refused(format!("has the shape {:?}, but {shape:?} is needed", array.shape())));
    }
    if !array.is_c_contiguous() {
        return Err(refused("must be contiguous, rows first".to_owned()));
    }
    array.try_readwrite().map_err(|e| refused(format!("cannot be written: {e}")))
}

/// Writes the observations of all environments on the current threads; an environment before its first reset has zeros, and so have images that stay on a device.
pub fn fill(env: &TaskEnv, numbers: Vec<(usize, Numbers<'_>)>) {
    for (i, numbers) in numbers {
        match numbers {
            Numbers::F32(all) => rows(all, env.len(), |k, row| match env.observation(k).get(i) {
                Some(Values::F32(values)) if values.len() == row.len() => row.copy_from_slice(values),
                _ => row.fill(0.0),
            }),
            Numbers::U8(all) => rows(all, env.len(), |k, row| match env.observation(k).get(i) {
                Some(Values::U8(values)) if values.len() == row.len() => row.copy_from_slice(values),
                _ => row.fill(0),
            }),
        }
    }
}

/// Numbers of an array from which it is worth while to write its rows on several threads: our own choice, without effect on results.
const MUCH: usize = 1 << 16;

/// True if it is worth while to write on several threads.
pub fn is_much(numbers: &[(usize, Numbers<'_>)]) -> bool {
    numbers.iter().any(|(_, numbers)| match numbers {
        Numbers::F32(all) => all.len() >= MUCH,
        Numbers::U8(all) => all.len() >= MUCH,
    })
}

fn rows<T: Send>(all: &mut [T], envs: usize, write: impl Fn(usize, &mut [T]) + Sync) {
    let size = (all.len() / envs).max(1);
    if all.len() < MUCH {
        all.chunks_mut(size).enumerate().for_each(|(k, row)| write(k, row));
    } else {
        all.par_chunks_mut(size).enumerate().for_each(|(k, row)| write(k, row));
    }
}

/// Texts of all environments by key, each a tuple.
pub fn texts<'py>(py: Python<'py>, env: &TaskEnv) -> PyResult<Vec<(&'static str, Bound<'py, PyTuple>)>> {
    let fields = env.interface().policy.observation.iter().enumerate();
    let texts = fields.filter(|(_, field)| field.dtype == "str").map(|(i, field)| {
        let text = |k: usize| match env.observation(k).get(i) {
            Some(Values::Text(text)) => text.as_str(),
            _ => "",
        };
        Ok((field.key, PyTuple::new(py, (0..env.len()).map(text))?))
    });
    texts.collect()
}

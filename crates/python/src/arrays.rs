//! One observation, and what steps were worth, as fresh numpy arrays.

use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods};
use orchard_env::{Report, Statistics, TaskEnv};
use orchard_policy::{Field, Values};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

/// One observation by key.
pub fn single<'py>(py: Python<'py>, fields: &[Field], values: Vec<Values>) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (field, values) in fields.iter().zip(values) {
        let array = match values {
            Values::F32(numbers) => numbers.into_pyarray(py).reshape(field.shape.clone())?.into_any(),
            Values::U8(bytes) => bytes.into_pyarray(py).reshape(field.shape.clone())?.into_any(),
            Values::Text(text) => PyString::new(py, &text).into_any(),
        };
        all.set_item(field.key, array)?;
    }
    Ok(all)
}

/// Rewards and ends (terminated, truncated) of all environments, true if one has ended, and info.
pub type Reports<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
    bool,
    Bound<'py, PyDict>,
);

/// Returns rewards, ends and info of the latest steps. The info has the environments of a mask, or all if there is no mask.
pub fn reports<'py>(
    py: Python<'py>,
    env: &TaskEnv,
    mask: Option<Bound<'py, PyArray1<bool>>>,
) -> PyResult<Reports<'py>> {
    let reports: Vec<&Report> = (0..env.len()).map(|k| env.report(k)).collect();
    let mask = mask.unwrap_or_else(|| PyArray1::from_slice(py, &vec![true; env.len()]));
    let info = Info { py, env, reports: &reports, mask: Some(&mask) };
    let (terminated, truncated) = (info.array(|_, r| r.terminated), info.array(|_, r| r.truncated));
    let ended = reports.iter().any(|r| r.terminated || r.truncated);
    Ok((info.array(|_, r| r.reward), terminated, truncated, ended, info.written()?))
}

/// Reward, ends and info of the latest step of the first environment.
pub fn report<'py>(py: Python<'py>, env: &TaskEnv) -> PyResult<(f64, bool, bool, Bound<'py, PyDict>)> {
    let report = env.report(0);
    let info = Info { py, env, reports: &[report], mask: None }.written()?;
    Ok((report.reward, report.terminated, report.truncated, info))
}

/// A name and that of the mask beside it, as strings of Python that are made once: a step writes some twenty of them.
macro_rules! named {
    ($py:expr, $name:literal) => {
        [pyo3::intern!($py, $name), pyo3::intern!($py, concat!("_", $name))]
    };
}

/// A name and that of its mask.
type Names<'a, 'py> = [&'a Bound<'py, PyString>; 2];

/// Info in Gymnasium's form. Without a mask: plain values of one environment. With one: an array of all environments, and beside it, under its
/// name after a `_`, the mask of those that it speaks of.
struct Info<'a, 'py> {
    py: Python<'py>,
    env: &'a TaskEnv,
    reports: &'a [&'a Report],
    mask: Option<&'a Bound<'py, PyArray1<bool>>>,
}

impl<'py> Info<'_, 'py> {
    fn written(&self) -> PyResult<Bound<'py, PyDict>> {
        let py = self.py;
        let all = PyDict::new(py);
        self.put(&all, named!(py, "is_success"), |_, r| r.is_success)?;
        self.put(&all, named!(py, "cost"), |_, r| r.cost)?;
        self.put(&all, named!(py, "outcome"), |_, r| self.text(r.outcome.as_deref()))?;
        self.group(&all, named!(py, "reward_terms"), |terms| {
            let mut named = self.env.interface().reward.iter().enumerate();
            named.try_for_each(|(i, term)| {
                let name = PyString::new(py, term.name);
                let mask = PyString::new(py, &format!("_{}", term.name));
                self.put(terms, [&name, &mask], |_, r| r.terms[i])
            })
        })?;
        self.group(&all, named!(py, "statistics"), |statistics| {
            let put = |names, value: fn(&Statistics) -> f64| {
                self.put(statistics, names, |_, r| value(&r.statistics))
            };
            let count = |names, value: fn(&Statistics) -> u32| {
                self.put(statistics, names, |_, r| i64::from(value(&r.statistics)))
            };
            put(named!(py, "return"), |s| s.total_reward)?;
            put(named!(py, "cost"), |s| s.total_cost)?;
            count(named!(py, "length"), |s| s.length)?;
            put(named!(py, "time"), |s| s.time)?;
            count(named!(py, "deposited"), |s| s.deposited)?;
            put(named!(py, "completeness"), |s| s.completeness)?;
            count(named!(py, "branches_snapped"), |s| s.damage.branches_snapped)?;
            count(named!(py, "fruit_dropped"), |s| s.damage.fruit_dropped)?;
            count(named!(py, "spurs_torn"), |s| s.damage.spurs_torn)
        })?;
        let world = |k| self.env.world(k).unwrap_or_default();
        self.put(&all, named!(py, "seed"), |k, _| world(k).0)?;
        self.put(&all, named!(py, "world"), |k, _| i64::from(world(k).1))?;
        Ok(all)
    }

    /// A text, or Python's `None`.
    fn text(&self, text: Option<&str>) -> Py<PyAny> {
        text.map_or_else(|| self.py.None(), |text| PyString::new(self.py, text).into_any().unbind())
    }

    /// Puts a value of each environment, from its index and report.
    fn put<T: Element + IntoPyObject<'py>>(
        &self,
        to: &Bound<'py, PyDict>,
        names: Names<'_, 'py>,
        value: impl Fn(usize, &Report) -> T,
    ) -> PyResult<()> {
        if self.mask.is_none() {
            return to.set_item(names[0], value(0, self.reports[0]));
        }
        to.set_item(names[0], self.array(value))?;
        self.mark(to, names)
    }

    fn array<T: Element>(&self, value: impl Fn(usize, &Report) -> T) -> Bound<'py, PyArray1<T>> {
        let values = self.reports.iter().enumerate().map(|(k, report)| value(k, report));
        PyArray1::from_slice(self.py, &values.collect::<Vec<T>>())
    }

    fn group(
        &self,
        to: &Bound<'py, PyDict>,
        names: Names<'_, 'py>,
        write: impl FnOnce(&Bound<'py, PyDict>) -> PyResult<()>,
    ) -> PyResult<()> {
        let group = PyDict::new(self.py);
        write(&group)?;
        to.set_item(names[0], group)?;
        self.mark(to, names)
    }

    /// Puts the mask beside a value.
    fn mark(&self, to: &Bound<'py, PyDict>, [_, mask]: Names<'_, 'py>) -> PyResult<()> {
        self.mask.map_or(Ok(()), |of| to.set_item(mask, of))
    }
}

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
        let all = PyDict::new(self.py);
        self.put(&all, "is_success", |_, r| r.is_success)?;
        self.put(&all, "cost", |_, r| r.cost)?;
        self.put(&all, "outcome", |_, r| self.text(r.outcome.as_deref()))?;
        self.group(&all, "reward_terms", |terms| {
            let mut named = self.env.interface().reward.iter().enumerate();
            named.try_for_each(|(i, term)| self.put(terms, term.name, |_, r| r.terms[i]))
        })?;
        self.group(&all, "statistics", |statistics| {
            let put =
                |name, value: fn(&Statistics) -> f64| self.put(statistics, name, |_, r| value(&r.statistics));
            let count = |name, value: fn(&Statistics) -> u32| {
                self.put(statistics, name, |_, r| i64::from(value(&r.statistics)))
            };
            put("return", |s| s.total_reward)?;
            put("cost", |s| s.total_cost)?;
            count("length", |s| s.length)?;
            put("time", |s| s.time)?;
            count("deposited", |s| s.deposited)?;
            put("completeness", |s| s.completeness)?;
            count("branches_snapped", |s| s.damage.branches_snapped)?;
            count("fruit_dropped", |s| s.damage.fruit_dropped)?;
            count("spurs_torn", |s| s.damage.spurs_torn)
        })?;
        let world = |k| self.env.world(k).unwrap_or_default();
        self.put(&all, "seed", |k, _| world(k).0)?;
        self.put(&all, "world", |k, _| i64::from(world(k).1))?;
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
        name: &str,
        value: impl Fn(usize, &Report) -> T,
    ) -> PyResult<()> {
        if self.mask.is_none() {
            return to.set_item(name, value(0, self.reports[0]));
        }
        to.set_item(name, self.array(value))?;
        self.mark(to, name)
    }

    fn array<T: Element>(&self, value: impl Fn(usize, &Report) -> T) -> Bound<'py, PyArray1<T>> {
        let values = self.reports.iter().enumerate().map(|(k, report)| value(k, report));
        PyArray1::from_slice(self.py, &values.collect::<Vec<T>>())
    }

    fn group(
        &self,
        to: &Bound<'py, PyDict>,
        name: &str,
        write: impl FnOnce(&Bound<'py, PyDict>) -> PyResult<()>,
    ) -> PyResult<()> {
        let group = PyDict::new(self.py);
        write(&group)?;
        to.set_item(name, group)?;
        self.mark(to, name)
    }

    /// Puts the mask beside a value.
    fn mark(&self, to: &Bound<'py, PyDict>, name: &str) -> PyResult<()> {
        self.mask.map_or(Ok(()), |mask| to.set_item(format!("_{name}"), mask))
    }
}

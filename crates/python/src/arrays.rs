//! Results of all environments as fresh numpy arrays, one row an environment.

use numpy::{Element, IntoPyArray, PyArrayMethods};
use orchard_env::{Report, Statistics, TaskEnv};
use orchard_policy::{Field, Values};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// The observations by key.
pub fn observations<'py>(py: Python<'py>, env: &TaskEnv) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (i, field) in env.interface().policy.observation.iter().enumerate() {
        let rows = || (0..env.len()).filter_map(move |k| env.observation(k).get(i));
        let array = match field.dtype {
            "uint8" => {
                let rows = rows().filter_map(|v| if let Values::U8(v) = v { Some(v) } else { None });
                stacked(py, rows, field, env.len())?
            }
            _ => {
                let rows = rows().filter_map(|v| if let Values::F32(v) = v { Some(v) } else { None });
                stacked(py, rows, field, env.len())?
            }
        };
        all.set_item(field.key, array)?;
    }
    Ok(all)
}

/// One array of the rows of all environments; an environment before its first reset has zeros.
fn stacked<'py, 'a, T: Element + Copy + Default + 'a>(
    py: Python<'py>,
    rows: impl Iterator<Item = &'a Vec<T>>,
    field: &Field,
    envs: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let mut all: Vec<T> = Vec::with_capacity(envs * field.shape.iter().product::<usize>());
    rows.for_each(|row| all.extend_from_slice(row));
    let mut shape = vec![envs];
    shape.extend(&field.shape);
    all.resize(shape.iter().product(), T::default());
    Ok(all.into_pyarray(py).reshape(shape)?.into_any())
}

/// Rewards, ends and statistics by name.
pub fn reports<'py>(py: Python<'py>, env: &TaskEnv) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let reports: Vec<&Report> = (0..env.len()).map(|k| env.report(k)).collect();
    let put = |name: &str, value: &dyn Fn(&Report) -> f64| {
        all.set_item(name, reports.iter().map(|r| value(r)).collect::<Vec<f64>>().into_pyarray(py))
    };
    let flag = |name: &str, value: &dyn Fn(&Report) -> bool| {
        all.set_item(name, reports.iter().map(|r| value(r)).collect::<Vec<bool>>().into_pyarray(py))
    };
    put("reward", &|r| r.reward)?;
    put("cost", &|r| r.cost)?;
    flag("terminated", &|r| r.terminated)?;
    flag("truncated", &|r| r.truncated)?;
    flag("is_success", &|r| r.is_success)?;
    let outcomes = reports.iter().map(|r| r.outcome.as_deref());
    all.set_item("outcome", PyList::new(py, outcomes)?)?;
    let terms = PyDict::new(py);
    for (i, term) in env.interface().reward.iter().enumerate() {
        terms
            .set_item(term.name, reports.iter().map(|r| r.terms[i]).collect::<Vec<f64>>().into_pyarray(py))?;
    }
    all.set_item("reward_terms", terms)?;
    let statistics = PyDict::new(py);
    let put = |name: &str, value: &dyn Fn(&Statistics) -> f64| {
        statistics.set_item(
            name,
            reports.iter().map(|r| value(&r.statistics)).collect::<Vec<f64>>().into_pyarray(py),
        )
    };
    let count = |name: &str, value: &dyn Fn(&Statistics) -> u32| {
        let values = reports.iter().map(|r| i64::from(value(&r.statistics))).collect::<Vec<i64>>();
        statistics.set_item(name, values.into_pyarray(py))
    };
    put("return", &|s| s.total_reward)?;
    put("cost", &|s| s.total_cost)?;
    count("length", &|s| s.length)?;
    put("time", &|s| s.time)?;
    count("deposited", &|s| s.deposited)?;
    put("completeness", &|s| s.completeness)?;
    count("branches_snapped", &|s| s.damage.branches_snapped)?;
    count("fruit_dropped", &|s| s.damage.fruit_dropped)?;
    count("spurs_torn", &|s| s.damage.spurs_torn)?;
    all.set_item("statistics", statistics)?;
    let worlds: Vec<(u64, u32)> = (0..env.len()).map(|k| env.world(k).unwrap_or_default()).collect();
    all.set_item("seed", worlds.iter().map(|w| w.0).collect::<Vec<u64>>().into_pyarray(py))?;
    all.set_item("world", worlds.iter().map(|w| i64::from(w.1)).collect::<Vec<i64>>().into_pyarray(py))?;
    Ok(all)
}

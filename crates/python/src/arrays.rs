//! One observation, and what steps were worth, as fresh numpy arrays.

use numpy::{IntoPyArray, PyArrayMethods};
use orchard_env::{Report, Statistics, TaskEnv};
use orchard_policy::{Field, Values};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};

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

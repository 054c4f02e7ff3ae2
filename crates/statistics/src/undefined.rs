//! Reasons for which a figure is undefined on a sample.

use serde::{Deserialize, Serialize};

/// Reason why there is no figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum Undefined {
    /// All denominators are 0, or there is no value at all.
    #[error("there is nothing to measure")]
    NothingToMeasure,
    /// The metric is defined for one tree only, so the spread between trees is unknown.
    #[error("only one tree says anything")]
    OneTree,
    /// The metric is defined for one seed only.
    #[error("only one seed says anything")]
    OneSeed,
    /// Every seed for which the metric is defined has only one tree with a value.
    #[error("no seed has two trees")]
    OneTreeASeed,
    /// No tree has two values.
    #[error("no tree is repeated")]
    NoRepeats,
    /// No pair.
    #[error("there is no pair")]
    NoPairs,
    /// One pair: it has no spread.
    #[error("there is only one pair")]
    OnePair,
    /// Both sides of every pair are equal.
    #[error("all differences are 0")]
    AllZero,
    /// All differences are the same, so that a ratio to their spread means nothing.
    #[error("the differences have no spread")]
    NoSpread,
    /// A value is infinite or not a number.
    #[error("a value is not finite")]
    NotFinite,
}

/// A figure; null with the reason where there is none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// The figure.
    pub value: Option<f64>,
    /// Reason why it is null, if so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undefined: Option<Undefined>,
}

impl From<Result<f64, Undefined>> for Figure {
    fn from(result: Result<f64, Undefined>) -> Self {
        match result {
            Ok(value) if value.is_finite() => Self { value: Some(value), undefined: None },
            Ok(_) => Self { value: None, undefined: Some(Undefined::NotFinite) },
            Err(undefined) => Self { value: None, undefined: Some(undefined) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_has_a_number_or_null_with_a_reason() {
        let json = |result: Result<f64, Undefined>| serde_json::to_string(&Figure::from(result)).unwrap();
        assert_eq!(json(Ok(0.5)), r#"{"value":0.5}"#);
        assert_eq!(json(Ok(f64::NAN)), r#"{"value":null,"undefined":"not_finite"}"#);
        assert_eq!(json(Err(Undefined::OneTree)), r#"{"value":null,"undefined":"one_tree"}"#);
    }
}

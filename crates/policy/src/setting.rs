//! Settings that are refused.

/// A setting that does not exist or does not fit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{option} {value}: {problem}")]
pub struct SettingError {
    /// Setting.
    pub option: &'static str,
    /// Value given.
    pub value: String,
    /// Problem with the value, and the values that are allowed.
    pub problem: String,
}

impl SettingError {
    /// The choice of a name.
    ///
    /// # Errors
    /// No choice has the name; the error lists them.
    pub fn choice<T: Copy>(option: &'static str, name: &str, all: &[(&'static str, T)]) -> Result<T, Self> {
        let found = all.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
        let known = || all.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| Self {
            option,
            value: name.to_owned(),
            problem: format!("unknown; it is one of {}", known()),
        })
    }
}

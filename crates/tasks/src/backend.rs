//! Backends of tasks.

use serde::{Deserialize, Serialize};

/// Backend: what computes the motion of worlds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// The processor, in f64 (batches of trees: in f32).
    #[default]
    Cpu,
    /// A graphics device, in f32.
    Gpu,
}

impl Backend {
    /// All backends.
    pub const ALL: [Self; 2] = [Self::Cpu, Self::Gpu];

    /// True for the processor, which files do not name.
    pub fn is_cpu(&self) -> bool {
        *self == Self::Cpu
    }

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        }
    }
}

impl std::str::FromStr for Backend {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.map(Self::name).join(" and ");
        let found = Self::ALL.into_iter().find(|backend| backend.name() == text);
        found.ok_or_else(|| format!("must be one of {known}"))
    }
}

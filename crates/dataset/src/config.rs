//! Settings of a data set and their defaults.

use orchard_camera::picture::{PictureStyle, ShadowMaps};
use orchard_quantity::{ConfigError, Count, Quantity, from_toml};
use orchard_spec::light::LightSpec;
use serde::{Deserialize, Serialize};

/// The defaults as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/paper/dataset.toml");

/// Files and light of a data set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetConfig {
    /// Depth of value 1 in the depth images.
    pub depth_unit: Quantity,
    /// Samples per side of a pixel of the colour images.
    pub supersampling: Count,
    /// Pixels per side of the sun's shadow map.
    pub sun_map: Count,
    /// Pixels per side of the map of each part of the sky.
    pub sky_map: Count,
    /// The light of the colour images.
    pub light: LightSpec,
}

impl DatasetConfig {
    /// Reads a config from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml(file, text)
    }

    /// The defaults.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        match Self::from_toml("paper/dataset.toml", PAPER_TOML) {
            Ok(config) => config,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }

    /// Style of the colour images.
    pub fn style(&self) -> PictureStyle {
        let style = PictureStyle {
            shadows: ShadowMaps { sun: self.sun_map.get() as usize, sky: self.sky_map.get() as usize },
            supersampling: self.supersampling.get() as usize,
            ..PictureStyle::default()
        };
        style.under(Some(&self.light))
    }
}

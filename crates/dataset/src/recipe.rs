//! Recipe of a data set: all inputs that determine it.

use orchard_bench::CODE_VERSION;
use orchard_bench::digest::{config_hash, config_text};
use orchard_camera::Sensor;
use orchard_camera::picture::PictureStyle;
use orchard_geometry::Intrinsics;
use orchard_scenario::Scenario;
use orchard_spec::camera::CameraSpec;
use orchard_spec::light::LightSpec;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::vantage::VantageSpec;
use serde::Serialize;

use crate::config::DatasetConfig;
use crate::error::{DatasetError, MOST_VIEWS};

/// Version of the layout of a data set's files.
pub const SCHEMA_VERSION: u32 = 2;

/// Seeds from `first` to `end`, `end` not included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Seeds {
    /// First seed.
    pub first: u64,
    /// Seed after the last.
    pub end: u64,
}

/// All inputs that determine the bytes of a data set. A folder holds one recipe.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recipe {
    /// Layout version of the data set.
    pub schema_version: u32,
    /// [`CODE_VERSION`].
    pub code_version: String,
    /// SHA-256 over world, camera, robot, vantages and settings, hexadecimal.
    pub config_hash: String,
    /// Preset of the config.
    pub preset: String,
    /// Seeds.
    pub seeds: Seeds,
    /// Trees per seed.
    pub trees: u32,
    /// Views per tree.
    pub views: u32,
    /// The depth camera, with all its figures.
    pub camera: CameraSpec,
    /// Poses of the camera about a tree.
    pub vantage: VantageSpec,
    /// Nearest and farthest valid depth \[m\]; none where there is no limit.
    pub camera_range_m: (f64, Option<f64>),
    /// The pinhole of all images.
    pub intrinsics: Intrinsics,
    /// Depth of value 1 in the depth images \[m\].
    pub depth_unit_m: f64,
    /// Samples per side of a pixel of the colour images.
    pub supersampling: u32,
    /// Light of the colour images.
    pub light: LightFigures,
}

/// The light dials as figures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightFigures {
    /// Azimuth of the sun from the world's x axis, counter-clockwise seen from above \[deg\].
    pub sun_azimuth_deg: f64,
    /// Elevation of the sun over the horizon \[deg\].
    pub sun_elevation_deg: f64,
    /// Strength of the sun relative to the sky's.
    pub sun_strength: f64,
    /// Part of the sky that cloud covers.
    pub overcast: f64,
}

/// A recipe with the scenario and settings needed to run it.
#[derive(Debug, Clone)]
pub struct Plan {
    pub(crate) recipe: Recipe,
    pub(crate) scenario: Scenario,
    pub(crate) sensor: Sensor,
    pub(crate) vantage: VantageSpec,
    pub(crate) style: PictureStyle,
}

impl Plan {
    /// Plans `views` of each of the first `trees` of every seed. `intrinsics` replace those of the camera.
    ///
    /// # Errors
    /// No seed, no tree, no view, or more than a data set may hold.
    pub fn new(
        scenario: &Scenario,
        config: &DatasetConfig,
        intrinsics: Option<Intrinsics>,
        seeds: Seeds,
        trees: u32,
        views: u32,
    ) -> Result<Self, DatasetError> {
        check(seeds, trees, views)?;
        let spec = scenario.spec();
        let vantage = Protocol::of_scenario(scenario)?.detect.vantage;
        let sensor = Sensor::new(&spec.camera);
        let sensor = intrinsics.map_or(sensor.clone(), |intrinsics| sensor.with_intrinsics(intrinsics));
        check_samples(sensor.intrinsics(), config.supersampling.get())?;
        let LightSpec { sun_azimuth, sun_elevation, sun_strength, overcast } = &config.light;
        let (near, far) = spec.camera.range();
        let recipe = Recipe {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: config_hash(&[
                ("scene", &scenario.scene_hash()),
                ("vantage", &config_text(&vantage)),
                ("dataset", &config_text(config)),
            ]),
            preset: spec.preset.clone(),
            seeds,
            trees,
            views,
            camera: spec.camera.clone(),
            vantage: vantage.clone(),
            camera_range_m: (near, Some(far).filter(|far| far.is_finite())),
            intrinsics: *sensor.intrinsics(),
            depth_unit_m: config.depth_unit.si(),
            supersampling: config.supersampling.get(),
            light: LightFigures {
                sun_azimuth_deg: sun_azimuth.value(),
                sun_elevation_deg: sun_elevation.value(),
                sun_strength: sun_strength.value(),
                overcast: overcast.value(),
            },
        };
        Ok(Self { recipe, scenario: scenario.clone(), sensor, vantage, style: config.style() })
    }

    /// Returns the recipe.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// Trees: seed and world, in order.
    pub fn trees(&self) -> Vec<(u64, u32)> {
        let Recipe { seeds, trees, .. } = self.recipe;
        (seeds.first..seeds.end).flat_map(|seed| (0..trees).map(move |world| (seed, world))).collect()
    }

    /// True if measured depth differs from true depth, because the camera has errors or a limited range.
    pub(crate) fn needs_true_depth(&self) -> bool {
        !matches!(self.scenario.spec().camera, CameraSpec::Ideal(_))
    }
}

fn check(seeds: Seeds, trees: u32, views: u32) -> Result<(), DatasetError> {
    let Seeds { first, end } = seeds;
    let count = end.checked_sub(first).filter(|count| *count > 0);
    let count = count.ok_or(DatasetError::NoSeeds { first, end })?;
    for (option, number) in [("trees", trees), ("views", views)] {
        if number == 0 {
            return Err(DatasetError::Nothing { option });
        }
    }
    let total = count.checked_mul(u64::from(trees)).and_then(|n| n.checked_mul(u64::from(views)));
    match total {
        Some(total) if total <= MOST_VIEWS => Ok(()),
        _ => Err(DatasetError::TooMany(format!("{count} x {trees} x {views}"))),
    }
}

/// Samples of a colour image, of 8 bytes each while it is drawn: a gigabyte a thread.
const MOST_SAMPLES: u64 = 1 << 27;

fn check_samples(&Intrinsics { width, height, .. }: &Intrinsics, side: u32) -> Result<(), DatasetError> {
    let samples =
        [width as u64, height as u64, side.into(), side.into()].into_iter().try_fold(1, u64::checked_mul);
    if samples.is_some_and(|samples| samples <= MOST_SAMPLES) {
        return Ok(());
    }
    Err(DatasetError::Samples { width, height, side, most: MOST_SAMPLES })
}

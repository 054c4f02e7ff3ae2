//! Models of errors that the kernels have.

use orchard_camera::{CoveredPixels, ImageKey, Sensor, StereoErrors, TimeOfFlightErrors};

/// Columns that an imager may have: a row lies in the memory of a workgroup.
const MOST_COLUMNS: usize = 1920;
/// Largest radius of a matching window: sums down its columns have 16 bits.
const MOST_RADIUS: usize = 7;
/// Numbers of steps of disparity that a table of registration may have, our own choice: some tens of megabytes.
const MOST_STEPS: usize = 1 << 13;

/// Errors of a camera, and the view to which its images are registered.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Model {
    pub errors: Kind,
    pub covered: Option<CoveredPixels>,
}

/// Figures of errors.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    Stereo(StereoErrors),
    TimeOfFlight(TimeOfFlightErrors),
}

impl Model {
    /// Errors of a camera; `None` if it is exact, or if the kernels do not hold for them.
    pub fn of(sensor: &Sensor) -> Option<Self> {
        let covered = sensor.covered();
        let errors = match (sensor.stereo(), sensor.time_of_flight()) {
            (Some(errors), _) => {
                // Rectangles come from a table by the steps of disparity; depths between pixels are no whole steps.
                let registers =
                    covered.is_none_or(|covered| covered.bridge == 0.0 && steps(&errors).is_some());
                let fits = errors.width <= MOST_COLUMNS && errors.window_radius <= MOST_RADIUS;
                (registers && fits).then_some(Kind::Stereo(errors))?
            }
            (_, Some(errors)) => {
                let bridges = covered.is_none_or(|covered| covered.bridge > 0.0);
                (bridges && errors.noise_window <= MOST_RADIUS).then_some(Kind::TimeOfFlight(errors))?
            }
            (None, None) => return None,
        };
        Some(Self { errors, covered })
    }

    /// Columns and rows of the imager.
    pub fn size(&self) -> (usize, usize) {
        match &self.errors {
            Kind::Stereo(errors) => (errors.width, errors.height),
            Kind::TimeOfFlight(errors) => (errors.width, errors.height),
        }
    }

    /// Columns and rows of a measured image.
    pub fn measured_size(&self) -> (usize, usize) {
        self.covered.as_ref().map_or_else(|| self.size(), CoveredPixels::size)
    }

    /// Radius of the windows over which random fields are averaged, and how often each is.
    pub fn fields(&self) -> (usize, &'static [usize]) {
        match &self.errors {
            Kind::Stereo(errors) => (errors.window_radius, &StereoErrors::AVERAGES),
            Kind::TimeOfFlight(errors) => (errors.noise_window, &[1; TimeOfFlightErrors::FIELDS]),
        }
    }

    /// Faults of an image ([`StereoErrors::faults`]).
    pub fn faults(&self, key: ImageKey) -> Vec<u32> {
        match &self.errors {
            Kind::Stereo(errors) => errors.faults(key),
            Kind::TimeOfFlight(_) => Vec::new(),
        }
    }
}

/// Steps of disparity that a measured depth may have: the first, and their number; `None` if there are too many for a table.
pub(super) fn steps(errors: &StereoErrors) -> Option<(usize, usize)> {
    let (near, far) = errors.range;
    let of =
        |depth: f32| f64::from(errors.focal_baseline) / (f64::from(depth) * f64::from(errors.disparity_step));
    // A step more on both sides, for roundings.
    let (first, last) = ((of(far).floor() - 1.0).max(1.0), of(near).ceil() + 1.0);
    (last - first < MOST_STEPS as f64).then(|| (first as usize, (last - first) as usize + 1))
}

//! Models of errors that the kernels have.

use orchard_camera::{CoveredPixels, ImageKey, Sensor, StereoErrors, TimeOfFlightErrors};

use super::law::{self, MOST_COLUMNS, MOST_RADIUS};

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
                    covered.is_none_or(|covered| covered.bridge == 0.0 && law::steps(&errors).is_some());
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

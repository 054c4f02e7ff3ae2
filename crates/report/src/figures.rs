//! All figures of a result.

mod attempts;
mod conditions;
mod detect;
mod front;
mod populations;
mod scaling;
mod screening;
mod sweep;
mod trees;
mod zones;

pub(crate) use attempts::{attempts_of, ranked, seconds_in, states_of};
pub use detect::{detection, precision_recall};
pub use front::pareto;
pub use populations::populations;
pub use screening::{ScreenedParameter, screening};
pub(crate) use sweep::dial;

use orchard_scaling::{PublishedScaling, ScalingRules};
use orchard_tasks::protocol::Protocol;

use crate::figure::{Figure, FigureError};
use crate::published::PaperFigures;
use crate::results::{Results, has_singles, main_condition};

/// Figures by section of the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Figures {
    /// All conditions beside each other.
    pub conditions: Vec<Figure>,
    /// Figures of each sweep.
    pub sweeps: Vec<(String, Vec<Figure>)>,
    /// The detection task.
    pub detect: Vec<Figure>,
    /// Canopy zones.
    pub zones: Vec<Figure>,
    /// Outcomes of attempts, and their times.
    pub attempts: Vec<Figure>,
    /// Tree by tree.
    pub trees: Vec<Figure>,
    /// Damage against throughput.
    pub damage: Vec<Figure>,
    /// Throughput over parallel worlds.
    pub scaling: Vec<Figure>,
    /// The paper's figures for the scaling task, if it is drawn.
    pub published_scaling: Option<PublishedScaling>,
}

impl Figures {
    /// Draws all figures for which the results have data.
    ///
    /// # Errors
    /// A figure cannot be drawn.
    pub fn draw(results: &Results, protocol: &Protocol, paper: &PaperFigures) -> Result<Self, FigureError> {
        let mut figures = Self::default();
        if let Some(harvest) = &results.harvest {
            if has_singles(harvest) {
                figures.conditions = conditions::figures(harvest)?;
            }
            for (name, sweep) in &harvest.sweeps {
                figures.sweeps.push((name.clone(), sweep::figures(harvest, name, sweep, paper)?));
            }
            if let Some((name, main)) = main_condition(harvest) {
                figures.zones = vec![zones::success(main)?, zones::completeness(main)?];
                if attempts_of(main) > 0 {
                    figures.attempts = vec![attempts::endings(name, main)?, attempts::times(name, main)?];
                }
                figures.trees = vec![trees::deposited(name, main)?];
                figures.trees.extend(trees::completeness(name, main)?);
            }
            for metric in ["fruit_dropped_per_tree", "branches_snapped_per_tree"] {
                figures.damage.extend(trees::damage(harvest, metric)?);
            }
        }
        if let Some(detect) = &results.detect {
            figures.detect = vec![
                detection(detect, &protocol.detect)?,
                detect::errors(detect)?,
                precision_recall(detect)?,
                detect::calibration(detect)?,
            ];
        }
        if results.scaling.iter().any(|scaling| !scaling.rows.is_empty()) {
            let rules = ScalingRules::of(protocol)
                .map_err(|e| FigureError { stem: "scaling".to_owned(), problem: e.to_string() })?;
            figures.scaling = scaling::figures(&results.scaling, &rules.published)?;
            figures.published_scaling = Some(rules.published);
        }
        Ok(figures)
    }

    /// All figures, in the order of the page.
    pub fn all(&self) -> impl Iterator<Item = &Figure> {
        let sweeps = self.sweeps.iter().flat_map(|(_, figures)| figures);
        sweeps
            .chain(&self.conditions)
            .chain(&self.detect)
            .chain(&self.zones)
            .chain(&self.attempts)
            .chain(&self.trees)
            .chain(&self.damage)
            .chain(&self.scaling)
    }
}

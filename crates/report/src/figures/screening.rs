//! Figure of a screening: what each parameter does to a metric.

use orchard_statistics::MetricInfo;
use orchard_statistics::morris::Screened;

use crate::bars::{Bar, bars};
use crate::figure::{Figure, FigureError, colour};

/// A parameter with its effects on a metric.
#[derive(Debug, Clone, Copy)]
pub struct ScreenedParameter<'a> {
    /// Short name.
    pub name: &'a str,
    /// Elementary effects.
    pub screened: Screened,
}

/// Draws `mu*` of each parameter on a metric with its interval, in the given order, and `sigma` as text.
///
/// # Errors
/// The figure cannot be drawn.
pub fn screening(metric: &MetricInfo, parameters: &[ScreenedParameter<'_>]) -> Result<Figure, FigureError> {
    let list: Vec<Bar> = parameters
        .iter()
        .map(|ScreenedParameter { name, screened }| Bar {
            name: (*name).to_owned(),
            parts: vec![(screened.mu_star, colour::SKY)],
            ci95: Some(screened.mu_star_ci95),
            label: format!("{:.3} ({:.3})", screened.mu_star, screened.sigma),
        })
        .collect();
    let line = |ScreenedParameter { name, screened }: &ScreenedParameter<'_>| {
        let [low, high] = screened.mu_star_ci95;
        format!("{name}: mu* {:.3} ({low:.3} to {high:.3}), sigma {:.3}", screened.mu_star, screened.sigma)
    };
    let unit = if metric.unit == "1" { String::new() } else { format!(" [{}]", metric.unit) };
    let title = format!("{}{unit}: \u{3bc}* (\u{3c3})", metric.title);
    let description = format!("{title}. {}.", parameters.iter().map(line).collect::<Vec<_>>().join("; "));
    bars(&format!("sensitivity-{}", metric.name), &title, &description, &list, &[])
}

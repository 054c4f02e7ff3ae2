//! Figure of a leaderboard: completeness against damage, with the Pareto front.

mod labels;

use orchard_leaderboard::{Board, Budget, Class, Entry, pareto_front};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::figure::{Area, Drawn, Figure, FigureError, drawn};
use labels::Labels;

/// Size of the figure \[px\].
const SIZE: (u32, u32) = (760, 500);
/// Margin beyond the largest value, as a share of the range.
const MARGIN: f64 = 0.12;
/// Smallest range of the damage axis.
const LEAST_DAMAGE: f64 = 0.5;
/// Size of names \[px\].
const FONT: i32 = 13;
/// Share of the range that is shown below 0.
const BEFORE: f64 = 0.04;
/// Fraction of the range up to which the name of a budget is to the right of its line.
const TURN: f64 = 0.2;

const POINT: RGBColor = RGBColor(40, 70, 150);
const FRONT: RGBColor = RGBColor(170, 60, 40);
const BUDGET: RGBColor = RGBColor(90, 90, 90);

/// Draws the entries of a board, their budgets and the Pareto front.
///
/// # Errors
/// The figure cannot be drawn.
pub fn pareto(board: &Board) -> Result<Figure, FigureError> {
    let practice = if board.seed_set.is_official() { "" } else { " (practice: not the official seeds)" };
    let title = format!("OrchardBench {}: completeness against damage{practice}", board.config_version);
    let line = |entry: &Entry| {
        format!("{}: completeness {:.2}, damage {:.2}", entry.name, entry.completeness, entry.damage())
    };
    let description = board.entries.iter().map(line).collect::<Vec<_>>().join("; ");
    drawn("leaderboard", &title, &description, SIZE, |area| draw(area, board, &title))
}

/// Ends of the axes: damage and completeness.
fn ranges(entries: &[Entry], budgets: &[&Budget]) -> (f64, f64) {
    let damage = entries.iter().map(Entry::damage).chain(budgets.iter().map(|budget| total(budget)));
    let high = |entry: &Entry| entry.completeness_ci95[1].unwrap_or(entry.completeness);
    let completeness = entries.iter().map(high).fold(0.0, f64::max);
    let damage = damage.fold(LEAST_DAMAGE, f64::max);
    (damage * (1.0 + MARGIN), (completeness * (1.0 + MARGIN)).clamp(0.1, 1.05))
}

/// Largest total damage that a budget allows.
fn total(budget: &Budget) -> f64 {
    budget.snapped + budget.dropped
}

fn draw(root: &Area, board: &Board, title: &str) -> Drawn {
    let entries = &board.entries;
    let mut budgets: Vec<&Budget> = Vec::new();
    for entry in entries {
        if !budgets.contains(&&entry.budget) {
            budgets.push(&entry.budget);
        }
    }
    budgets.sort_by(|a, b| total(a).total_cmp(&total(b)));
    let (most_damage, most_completeness) = ranges(entries, &budgets);
    let mut chart = ChartBuilder::on(root)
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(55)
        // Points without damage must not lie on the axis.
        .build_cartesian_2d(-BEFORE * most_damage..most_damage, 0.0..most_completeness)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("damage per tree: branches snapped + fruit dropped")
        .y_desc("harvest completeness")
        .draw()?;

    for budget in &budgets {
        let x = total(budget);
        let line = DashedLineSeries::new([(x, 0.0), (x, most_completeness)], 6, 4, BUDGET.stroke_width(1));
        chart.draw_series(line)?;
        let (h, shift) = if x < TURN * most_damage { (HPos::Left, 4) } else { (HPos::Right, -4) };
        let style = ("sans-serif", 12).into_font().color(&BUDGET).pos(Pos::new(h, VPos::Top));
        let name = budget.class.clone().unwrap_or_else(|| format!("{} + {}", budget.snapped, budget.dropped));
        let at = (x, most_completeness);
        chart.draw_series([EmptyElement::at(at) + Text::new(format!("budget {name}"), (shift, 2), style)])?;
    }

    // The front of the class that is proven best.
    let class = entries.iter().map(|entry| entry.checked.class).min().unwrap_or(Class::ReRun);
    let front: Vec<&Entry> = pareto_front(entries, class).into_iter().map(|index| &entries[index]).collect();
    let mut steps: Vec<(f64, f64)> = Vec::new();
    for entry in &front {
        // The front is a step function: up to the damage of the next entry the best completeness is that of this one.
        if let Some(&(_, below)) = steps.last() {
            steps.push((entry.damage(), below));
        }
        steps.push((entry.damage(), entry.completeness));
    }
    if let Some(&(_, last)) = steps.last() {
        steps.push((most_damage, last));
    }
    chart
        .draw_series(LineSeries::new(steps, FRONT.stroke_width(2)))?
        .label(format!("Pareto front, {}", class.name()))
        .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], FRONT.stroke_width(2)));

    for within in [true, false] {
        let own: Vec<&Entry> = entries.iter().filter(|entry| entry.within_budget == within).collect();
        if own.is_empty() {
            continue;
        }
        let dot = move |at| Circle::new(at, 5, if within { POINT.filled() } else { POINT.stroke_width(2) });
        for entry in &own {
            if let [Some(low), Some(high)] = entry.completeness_ci95 {
                let x = entry.damage();
                chart.draw_series([PathElement::new([(x, low), (x, high)], POINT.mix(0.5))])?;
            }
        }
        let at = |entry: &&Entry| (entry.damage(), entry.completeness);
        chart.draw_series(own.iter().map(at).map(|at| Circle::new(at, 5, WHITE.filled())))?;
        chart
            .draw_series(own.iter().map(at).map(dot))?
            .label(if within { "within its budget, 95 % interval" } else { "over its budget" })
            .legend(move |(x, y)| {
                Circle::new((x + 8, y), 5, if within { POINT.filled() } else { POINT.stroke_width(2) })
            });
    }
    let pixels = |entry: &Entry| chart.backend_coord(&(entry.damage(), entry.completeness));
    let mut labels = Labels::around(entries.iter().map(pixels).collect());
    for entry in entries {
        let label = match entry.checked.class {
            Class::ReRun => entry.name.clone(),
            class => format!("{} ({})", entry.name, class.name()),
        };
        let (text_at, h, v) = labels.place(pixels(entry), label.chars().count());
        let style = ("sans-serif", FONT).into_font().color(&BLACK).pos(Pos::new(h, v));
        root.draw(&Text::new(label, text_at, style))?;
    }
    if !entries.is_empty() {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerRight)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
    }
    Ok(())
}

//! Maps of the 3 x 2 canopy zones with numbers.

use orchard_tasks::harvest::summary::{ConditionSummary, ZoneSummary};
use orchard_tasks::zones::Zone;
use plotters::element::{Rectangle, Text};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use crate::figure::{Figure, FigureError, LETTERS, WIDTH, colour, drawn, heading, letters};
use crate::results::ends;
use crate::words::{interval, number};

/// Rows from the top of the canopy down.
const ROWS: [(&str, [Zone; 2]); 3] = [
    ("upper", [Zone::UpperInner, Zone::UpperOuter]),
    ("middle", [Zone::MiddleInner, Zone::MiddleOuter]),
    ("lower", [Zone::LowerInner, Zone::LowerOuter]),
];
/// Colours of the rates 0 and 1 and of an unknown rate, and of letters on light and on dark ground.
const NONE: RGBColor = RGBColor(0xE9, 0xF1, 0xF8);
const ALL: RGBColor = RGBColor(0x08, 0x45, 0x7E);
const UNKNOWN: RGBColor = RGBColor(0xD5, 0xDA, 0xDF);
const DARK: RGBColor = RGBColor(0x10, 0x18, 0x20);
const BRIGHT: RGBColor = RGBColor(0xFD, 0xFD, 0xFD);

/// Values of one zone on a map.
struct ZoneRate {
    rate: Option<f64>,
    part: u32,
    of: u32,
    ci95: [Option<f64>; 2],
}

/// Place success by zone, over the attempts there.
pub(crate) fn success(results: &ConditionSummary) -> Result<Figure, FigureError> {
    let rate = |z: &ZoneSummary| ZoneRate {
        rate: z.place_success,
        part: z.placed,
        of: z.attempts,
        ci95: z.place_success_ci95,
    };
    map("zones-success", "Place success by canopy zone", "attempts", results, rate)
}

/// Completeness by zone, over the reachable fruit in the zone.
pub(crate) fn completeness(results: &ConditionSummary) -> Result<Figure, FigureError> {
    let rate = |z: &ZoneSummary| ZoneRate {
        rate: z.completeness,
        part: z.deposited,
        of: z.reachable,
        ci95: z.completeness_ci95,
    };
    map("zones-completeness", "Completeness by canopy zone", "reachable", results, rate)
}

fn map(
    stem: &str,
    title: &str,
    counted: &str,
    results: &ConditionSummary,
    rate: impl Fn(&ZoneSummary) -> ZoneRate,
) -> Result<Figure, FigureError> {
    const MARGIN: i32 = 10;
    const LEFT: i32 = 66;
    const TOP: i32 = 58;
    const HEIGHT: i32 = 70;
    const GAP: i32 = 4;
    let cell_width = (WIDTH as i32 - LEFT - MARGIN - GAP) / 2;
    let cell = |zone: &Zone| {
        results.zones.get(zone).map_or(ZoneRate { rate: None, part: 0, of: 0, ci95: [None; 2] }, &rate)
    };
    let words: Vec<String> = ROWS
        .iter()
        .flat_map(|(row, zones)| {
            zones.iter().zip(["inner", "outer"]).map(move |(zone, column)| (row, column, zone))
        })
        .map(|(row, column, zone)| {
            let cell = cell(zone);
            let ci95 = interval(cell.ci95, 2);
            format!(
                "{row} {column} {} ({ci95}), {} of {} {counted}",
                number(cell.rate, 2),
                cell.part,
                cell.of
            )
        })
        .collect();
    let height = TOP + 3 * (HEIGHT + GAP) + MARGIN - GAP;
    drawn(stem, title, &format!("{title}: {}.", words.join("; ")), (WIDTH, height as u32), |area| {
        area.draw(&Text::new(title.to_owned(), (MARGIN, MARGIN), heading()))?;
        for (j, name) in ["inner", "outer"].into_iter().enumerate() {
            let x = LEFT + j as i32 * (cell_width + GAP) + cell_width / 2;
            area.draw(&Text::new(
                name,
                (x, TOP - 12),
                letters(LETTERS, colour::SOFT, HPos::Center, VPos::Center),
            ))?;
        }
        for (i, (name, zones)) in ROWS.iter().enumerate() {
            let y = TOP + i as i32 * (HEIGHT + GAP);
            let style = letters(LETTERS, colour::SOFT, HPos::Right, VPos::Center);
            area.draw(&Text::new((*name).to_owned(), (LEFT - 10, y + HEIGHT / 2), style))?;
            for (j, zone) in zones.iter().enumerate() {
                let x = LEFT + j as i32 * (cell_width + GAP);
                let cell = cell(zone);
                let ground = cell.rate.map_or(UNKNOWN, between);
                area.draw(&Rectangle::new([(x, y), (x + cell_width, y + HEIGHT)], ground.filled()))?;
                let ink = if is_dark(ground) { BRIGHT } else { DARK };
                let middle = x + cell_width / 2;
                let large = letters(19.0, ink, HPos::Center, VPos::Center);
                area.draw(&Text::new(number(cell.rate, 2), (middle, y + HEIGHT / 2 - 17), large))?;
                let small = letters(LETTERS - 1.0, ink, HPos::Center, VPos::Center);
                let count = format!("{} of {} {counted}", cell.part, cell.of);
                area.draw(&Text::new(count, (middle, y + HEIGHT / 2 + 22), small.clone()))?;
                if ends(cell.ci95).is_some() {
                    area.draw(&Text::new(interval(cell.ci95, 2), (middle, y + HEIGHT / 2 + 5), small))?;
                }
            }
        }
        Ok(())
    })
}

/// The colour of a rate between 0 and 1.
fn between(rate: f64) -> RGBColor {
    let mix = |none: u8, all: u8| {
        let part = rate.clamp(0.0, 1.0);
        (f64::from(none) + part * (f64::from(all) - f64::from(none))).round() as u8
    };
    RGBColor(mix(NONE.0, ALL.0), mix(NONE.1, ALL.1), mix(NONE.2, ALL.2))
}

/// True if bright text is easier to read on a background, by its luma (ITU-R BT.601).
fn is_dark(ground: RGBColor) -> bool {
    0.299 * f64::from(ground.0) + 0.587 * f64::from(ground.1) + 0.114 * f64::from(ground.2) < 140.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_stand_out() {
        assert_eq!((between(0.0), between(1.0), between(7.0)), (NONE, ALL, ALL));
        assert!(!is_dark(between(0.2)) && is_dark(between(0.8)) && !is_dark(UNKNOWN));
    }
}

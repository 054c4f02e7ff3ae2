//! Horizontal bars with a name on the left and a number on the right, whole or stacked.

use plotters::element::{PathElement, Rectangle, Text};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor, ShapeStyle};

use crate::figure::{Figure, FigureError, LETTERS, WIDTH, colour, drawn, heading, letters, text_width};

/// A bar.
pub(crate) struct Bar {
    /// Name, left of the bar.
    pub name: String,
    /// Parts of the bar from left to right: size and colour.
    pub parts: Vec<(f64, RGBColor)>,
    /// 95 % interval of the bar's end, if there is one.
    pub ci95: Option<[f64; 2]>,
    /// Text, right of the bar.
    pub label: String,
}

/// An entry of the legend.
pub(crate) type Key = (String, RGBColor);

const MARGIN: i32 = 10;
/// Height of a bar with and without the gap below it \[px\].
const ROW: i32 = 27;
const THICK: i32 = 17;
/// Half height of the caps of an interval \[px\].
const CAP: i32 = 4;
/// Height of a line of the legend \[px\].
const LINE: i32 = 19;

/// Draws bars at a common scale.
pub(crate) fn bars(
    stem: &str,
    title: &str,
    description: &str,
    bars: &[Bar],
    keys: &[Key],
) -> Result<Figure, FigureError> {
    let size = LETTERS - 1.0;
    let widest =
        |of: &dyn Fn(&Bar) -> &String| bars.iter().map(|bar| text_width(of(bar), size)).max().unwrap_or(0);
    let left = MARGIN + widest(&|bar| &bar.name) + 8;
    let right = WIDTH as i32 - MARGIN - widest(&|bar| &bar.label) - 6;
    let total = |bar: &Bar| bar.parts.iter().map(|(size, _)| size).sum::<f64>();
    let reach = |bar: &Bar| bar.ci95.map_or(0.0, |[_, high]| high).max(total(bar));
    let longest = bars.iter().map(reach).fold(0.0, f64::max);
    let scale = if longest > 0.0 { f64::from(right - left) / longest } else { 0.0 };
    let legend = laid_out(keys, size);
    let top = MARGIN + 24 + LINE * legend.last().map_or(0, |(.., line)| line + 1) + 4;
    let height = top + ROW * bars.len() as i32 + MARGIN - (ROW - THICK);
    drawn(stem, title, description, (WIDTH, height.max(80) as u32), |area| {
        let head = heading();
        area.draw(&Text::new(title.to_owned(), (MARGIN, MARGIN), head))?;
        for ((name, colour), x, line) in &legend {
            let y = MARGIN + 24 + LINE * line + LINE / 2;
            area.draw(&Rectangle::new([(*x, y - 5), (x + 11, y + 6)], colour.filled()))?;
            let style = letters(size, colour::INK, HPos::Left, VPos::Center);
            area.draw(&Text::new(name.clone(), (x + 16, y), style))?;
        }
        for (i, bar) in bars.iter().enumerate() {
            let y = top + ROW * i as i32;
            let middle = y + THICK / 2;
            let before = letters(size, colour::INK, HPos::Right, VPos::Center);
            area.draw(&Text::new(bar.name.clone(), (left - 8, middle), before))?;
            let mut from = 0.0;
            for (size, colour) in &bar.parts {
                let ends = [from, from + size].map(|at| left + (at * scale).round() as i32);
                area.draw(&Rectangle::new([(ends[0], y), (ends[1], y + THICK)], colour.filled()))?;
                from += size;
            }
            let at = |x: f64| left + (x * scale).round() as i32;
            if let Some(ends) = bar.ci95 {
                let [low, high] = ends.map(at);
                let thin = ShapeStyle::from(colour::INK).stroke_width(1);
                for stroke in [
                    [(low, middle), (high, middle)],
                    [(low, middle - CAP), (low, middle + CAP)],
                    [(high, middle - CAP), (high, middle + CAP)],
                ] {
                    area.draw(&PathElement::new(stroke, thin))?;
                }
            }
            let end = at(reach(bar)) + 6;
            let behind = letters(size, colour::SOFT, HPos::Left, VPos::Center);
            area.draw(&Text::new(bar.label.clone(), (end, middle), behind))?;
        }
        Ok(())
    })
}

/// Keys with their left edge and their line.
fn laid_out(keys: &[Key], size: f64) -> Vec<(&Key, i32, i32)> {
    let (mut left, mut line) = (MARGIN, 0);
    let lay = |key| {
        let (name, _): &Key = key;
        let width = 16 + text_width(name, size);
        if left > MARGIN && left + width > WIDTH as i32 - MARGIN {
            (left, line) = (MARGIN, line + 1);
        }
        let at = (key, left, line);
        left += width + 14;
        at
    };
    keys.iter().map(lay).collect()
}

//! A chart of points over an axis: lines with intervals, published values, reference lines and bands.

use plotters::backend::SVGBackend;
use plotters::chart::ChartBuilder;
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::drawing::DrawingArea;
use plotters::element::{Circle, DashedPathElement, PathElement, Polygon, Rectangle, Text};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor, ShapeStyle};

use crate::axis::Axis;
use crate::figure::{
    Drawn, Figure, FigureError, LETTERS, WIDTH, colour, drawn, heading, letters, text_width,
};

/// A chart.
pub(crate) struct Chart {
    /// Name of the figure.
    pub stem: String,
    /// Title above the vertical axis: the quantity with its unit.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Series, the last on top.
    pub series: Vec<Series>,
    /// Bands behind everything.
    pub bands: Vec<Band>,
}

/// Points of one kind.
pub(crate) struct Series {
    /// Name in the legend; if empty, the series is not in the legend.
    pub name: String,
    /// Colour.
    pub colour: RGBColor,
    /// Marker of a point.
    pub mark: Mark,
    /// Style of the line through the points.
    pub line: Line,
    /// The points, from left to right.
    pub points: Vec<Point>,
    /// Horizontal shift \[px\], so that intervals do not overlap.
    pub shift: i32,
}

/// A value with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    /// Horizontal position.
    pub x: f64,
    /// Vertical position.
    pub y: f64,
    /// 95 % interval, if there is one.
    pub ci95: Option<[f64; 2]>,
}

/// Marker of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    /// A disc.
    Disc,
    /// A small, translucent disc, for many points.
    Dot,
    /// A hollow diamond, for published values.
    Hollow,
    /// Nothing.
    None,
}

/// Style of the line through the points of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Line {
    /// Solid.
    Solid,
    /// Dashed.
    Dashed,
    /// Dotted.
    Dotted,
    /// Nothing.
    None,
}

/// A reference interval on the vertical axis, drawn as a band, or as a line if both ends are equal.
pub(crate) struct Band {
    /// Name in the legend.
    pub name: String,
    /// Lower and upper end.
    pub ends: [f64; 2],
}

/// Height of the plot with its axes \[px\].
const PLOT: i32 = 234;
/// Margin about the figure \[px\].
const MARGIN: i32 = 10;
/// Height of a line of the legend \[px\].
const LEGEND: i32 = 19;
/// Space for the horizontal and the vertical axis \[px\].
const BELOW: i32 = 46;
const BESIDE: i32 = 46;
/// Half width of the caps of an interval \[px\].
const CAP: i32 = 4;

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Chart {
    /// Draws the chart.
    pub fn figure(&self, description: &str) -> Result<Figure, FigureError> {
        let legend = self.legend();
        let top = MARGIN + 22 + LEGEND * legend.last().map_or(0, |entry| entry.line + 1);
        let size = (WIDTH, (top + PLOT + MARGIN) as u32);
        drawn(&self.stem, &self.title, description, size, |area| {
            let title = heading();
            area.draw(&Text::new(self.title.clone(), (MARGIN, MARGIN), title))?;
            for entry in &legend {
                self.draw_entry(area, entry)?;
            }
            let (_, plot) = area.split_vertically(top);
            self.draw_plot(&plot)
        })
    }

    fn draw_plot(&self, area: &Canvas) -> Drawn {
        let mut chart = ChartBuilder::on(area)
            .margin_right(MARGIN + 6)
            .margin_top(12)
            .margin_bottom(MARGIN)
            .x_label_area_size(BELOW - 6)
            .y_label_area_size(BESIDE)
            .build_cartesian_2d(self.x.clone(), self.y.clone())?;
        for band in &self.bands {
            self.draw_band(chart.plotting_area(), band)?;
        }
        let soft = letters(LETTERS - 1.0, colour::SOFT, HPos::Center, VPos::Center);
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(plotters::style::TRANSPARENT)
            .bold_line_style(colour::GRID)
            .axis_style(colour::AXIS)
            .set_all_tick_mark_size(4)
            .x_labels(self.x.ticks.len())
            .y_labels(self.y.ticks.len())
            .x_label_style(soft.clone())
            .y_label_style(soft)
            .x_desc(self.x.label.clone())
            .axis_desc_style(letters(LETTERS, colour::INK, HPos::Center, VPos::Center))
            .draw()?;
        // Drawn on the whole figure, so that marks at the edge of the plot are not cut off.
        let (left, top) = area.get_base_pixel();
        let pixel = |x: f64, y: f64, shift: i32| {
            let (u, v) = chart.backend_coord(&(self.x.place(x), self.y.place(y)));
            (u - left + shift, v - top)
        };
        for series in &self.series {
            draw_series(area, series, &pixel)?;
        }
        Ok(())
    }

    fn draw_band(&self, area: &DrawingArea<SVGBackend, Cartesian2d<Axis, Axis>>, band: &Band) -> Drawn {
        let [low, high] = band.ends.map(|end| self.y.place(end));
        let [left, right] = self.x.ends;
        if low < high {
            let style = colour::AXIS.mix(0.28).filled();
            area.draw(&Rectangle::new([(left, low), (right, high)], style))?;
        } else {
            let style = ShapeStyle::from(colour::SOFT).stroke_width(1);
            area.draw(&DashedPathElement::new([(left, low), (right, low)], 6, 4, style))?;
        }
        Ok(())
    }

    /// Entries of the legend, laid out in lines.
    fn legend(&self) -> Vec<Entry> {
        const SIGN: i32 = 24;
        const BETWEEN: i32 = 14;
        let named = self.series.iter().enumerate().filter(|(_, series)| !series.name.is_empty());
        let signs = named.map(|(i, series)| (Sign::Series(i), series.name.clone()));
        let bands =
            self.bands.iter().map(|band| (Sign::Band(band.ends[0] < band.ends[1]), band.name.clone()));
        let (mut left, mut line) = (MARGIN, 0);
        let lay = |(sign, name): (Sign, String)| {
            let width = SIGN + text_width(&name, LETTERS - 1.0);
            if left > MARGIN && left + width > WIDTH as i32 - MARGIN {
                (left, line) = (MARGIN, line + 1);
            }
            let entry = Entry { sign, name, left, line };
            left += width + BETWEEN;
            entry
        };
        signs.chain(bands).map(lay).collect()
    }

    fn draw_entry(&self, area: &Canvas, entry: &Entry) -> Drawn {
        let (left, y) = (entry.left, MARGIN + 22 + LEGEND * entry.line + LEGEND / 2);
        let soft = letters(LETTERS - 1.0, colour::INK, HPos::Left, VPos::Center);
        area.draw(&Text::new(entry.name.clone(), (left + 24, y), soft))?;
        let ends = [(left, y), (left + 18, y)];
        match entry.sign {
            Sign::Series(i) => {
                let series = &self.series[i];
                draw_line(area, series, &ends)?;
                draw_mark(area, series, (left + 9, y))
            }
            Sign::Band(true) => {
                let style = colour::AXIS.mix(0.28).filled();
                Ok(area.draw(&Rectangle::new([(left, y - 5), (left + 18, y + 5)], style))?)
            }
            Sign::Band(false) => {
                let style = ShapeStyle::from(colour::SOFT).stroke_width(1);
                Ok(area.draw(&DashedPathElement::new(ends, 6, 4, style))?)
            }
        }
    }
}

/// An entry of the legend.
struct Entry {
    sign: Sign,
    name: String,
    left: i32,
    line: i32,
}

enum Sign {
    Series(usize),
    /// A band; true if its ends differ.
    Band(bool),
}

fn draw_series(area: &Canvas, series: &Series, pixel: &impl Fn(f64, f64, i32) -> (i32, i32)) -> Drawn {
    let places: Vec<(i32, i32)> = series.points.iter().map(|p| pixel(p.x, p.y, series.shift)).collect();
    draw_line(area, series, &places)?;
    let thin = ShapeStyle::from(series.colour).stroke_width(1);
    for (point, (x, _)) in series.points.iter().zip(&places) {
        let Some([low, high]) = point.ci95 else { continue };
        let [low, high] = [low, high].map(|end| pixel(point.x, end, series.shift).1);
        for stroke in
            [[(*x, low), (*x, high)], [(x - CAP, low), (x + CAP, low)], [(x - CAP, high), (x + CAP, high)]]
        {
            area.draw(&PathElement::new(stroke, thin))?;
        }
    }
    places.iter().try_for_each(|place| draw_mark(area, series, *place))
}

fn draw_line(area: &Canvas, series: &Series, places: &[(i32, i32)]) -> Drawn {
    let style = ShapeStyle::from(series.colour).stroke_width(2);
    match series.line {
        Line::None => {}
        Line::Solid => area.draw(&PathElement::new(places.to_vec(), style))?,
        Line::Dashed => area.draw(&DashedPathElement::new(places.to_vec(), 5, 4, style))?,
        Line::Dotted => area.draw(&DashedPathElement::new(places.to_vec(), 2, 3, style))?,
    }
    Ok(())
}

fn draw_mark(area: &Canvas, series: &Series, (x, y): (i32, i32)) -> Drawn {
    match series.mark {
        Mark::None => {}
        Mark::Disc => {
            // A rim in the background colour separates crossing lines.
            area.draw(&Circle::new((x, y), 5, colour::PAPER.filled()))?;
            area.draw(&Circle::new((x, y), 4, series.colour.filled()))?;
        }
        Mark::Dot => area.draw(&Circle::new((x, y), 4, series.colour.mix(0.45).filled()))?,
        Mark::Hollow => {
            let diamond = [(x, y - 6), (x + 6, y), (x, y + 6), (x - 6, y), (x, y - 6)];
            area.draw(&Polygon::new(diamond, colour::PAPER.filled()))?;
            let style = ShapeStyle::from(series.colour).stroke_width(2);
            area.draw(&PathElement::new(diamond, style))?;
        }
    }
    Ok(())
}

//! A figure: SVG with a title and a text description, in colours that are distinguishable with any colour vision.

use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::prelude::{Color, RGBColor, Rectangle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, IntoFont, TextStyle};

/// A drawn figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of its file, without the extension; also its identifier on the page.
    pub stem: String,
    /// Short title.
    pub title: String,
    /// Text description of the figure with its numbers, for readers who cannot see it.
    pub description: String,
    /// The SVG text, the same in its file and on the page.
    pub svg: String,
}

/// A figure that could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("figure {stem}: {problem}")]
pub struct FigureError {
    /// Name of the figure.
    pub stem: String,
    /// Problem.
    pub problem: String,
}

/// Drawing area of a figure.
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Result of drawing.
pub(crate) type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Colours of data, distinguishable with any colour vision (Okabe and Ito 2008), and of axes, grid and text.
pub(crate) mod colour {
    use super::RGBColor;

    /// First series.
    pub const BLUE: RGBColor = RGBColor(0x00, 0x72, 0xB2);
    /// Second series.
    pub const VERMILION: RGBColor = RGBColor(0xD5, 0x5E, 0x00);
    /// Third series.
    pub const GREEN: RGBColor = RGBColor(0x00, 0x9E, 0x73);
    /// Fourth series.
    pub const PURPLE: RGBColor = RGBColor(0xCC, 0x79, 0xA7);
    /// Fifth series.
    pub const ORANGE: RGBColor = RGBColor(0xE6, 0x9F, 0x00);
    /// Sixth series.
    pub const SKY: RGBColor = RGBColor(0x56, 0xB4, 0xE9);
    /// Text, and published values.
    pub const INK: RGBColor = RGBColor(0x1F, 0x29, 0x33);
    /// Secondary text.
    pub const SOFT: RGBColor = RGBColor(0x5B, 0x67, 0x74);
    /// Axes.
    pub const AXIS: RGBColor = RGBColor(0x8A, 0x95, 0xA1);
    /// Grid lines.
    pub const GRID: RGBColor = RGBColor(0xE3, 0xE7, 0xEB);
    /// The background.
    pub const PAPER: RGBColor = RGBColor(0xFF, 0xFF, 0xFF);
    /// All series in their order.
    pub const SERIES: [RGBColor; 6] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY];
}

/// Dark-mode colours. Series with too little contrast on the dark background are lightened.
const AT_NIGHT: [(RGBColor, &str); 6] = [
    (colour::INK, "#E6EAEE"),
    (colour::SOFT, "#A9B4BF"),
    (colour::AXIS, "#7C8894"),
    (colour::GRID, "#2C353E"),
    (colour::PAPER, "#171C21"),
    (colour::BLUE, "#3D9BD6"),
];

/// Width of a figure \[px\]: that of a phone screen; on wider screens figures are placed side by side.
pub(crate) const WIDTH: u32 = 400;
/// Font size \[px\].
pub(crate) const LETTERS: f64 = 13.0;
/// Font size of a title \[px\].
const TITLE: f64 = 14.5;
/// Line height over font size. plotters takes the font size as line height, so sizes are scaled up by this factor.
const LINE_PER_LETTER: f64 = 1.24;
/// Approximate ratio of a letter's width to the font size.
const LETTER_WIDTH: f64 = 0.57;

/// Text style with a font size, a colour and an anchor.
pub(crate) fn letters(size: f64, colour: RGBColor, h: HPos, v: VPos) -> TextStyle<'static> {
    ("sans-serif", size * LINE_PER_LETTER).into_font().color(&colour).pos(Pos::new(h, v))
}

/// A figure's title, at its upper left.
pub(crate) fn heading() -> TextStyle<'static> {
    let font = ("sans-serif", TITLE * LINE_PER_LETTER, FontStyle::Bold).into_font();
    font.color(&colour::INK).pos(Pos::new(HPos::Left, VPos::Top))
}

/// Approximate width of a line \[px\]; no font metrics are available here.
pub(crate) fn text_width(text: &str, size: f64) -> i32 {
    (text.chars().count() as f64 * size * LETTER_WIDTH).ceil() as i32
}

/// Draws a figure of a size \[px\].
pub(crate) fn drawn(
    stem: &str,
    title: &str,
    description: &str,
    (width, height): (u32, u32),
    draw: impl FnOnce(&Area) -> Drawn,
) -> Result<Figure, FigureError> {
    let mut svg = String::new();
    let on = |svg: &mut String| -> Drawn {
        let area = SVGBackend::with_string(svg, (width, height)).into_drawing_area();
        let corners = [(0, 0), (width as i32, height as i32)];
        area.draw(&Rectangle::new(corners, colour::PAPER.filled()))?;
        draw(&area)?;
        area.present()?;
        Ok(())
    };
    on(&mut svg).map_err(|e| FigureError { stem: stem.to_owned(), problem: e.to_string() })?;
    let svg = with_words(&svg, stem, title, description);
    Ok(Figure { stem: stem.to_owned(), title: title.to_owned(), description: description.to_owned(), svg })
}

/// Adds title and description, and the dark-mode colours.
fn with_words(svg: &str, stem: &str, title: &str, description: &str) -> String {
    let (head, body) = svg.split_once(">\n").unwrap_or((svg, ""));
    let head = head.replacen(
        "<svg ",
        &format!("<svg class=\"of\" role=\"img\" aria-labelledby=\"{stem}-t {stem}-d\" "),
        1,
    );
    let (title, description) = (escaped(title), escaped(description));
    format!(
        "{head}>\n<title id=\"{stem}-t\">{title}</title>\n<desc id=\"{stem}-d\">{description}</desc>\n{}\n{}",
        style(),
        body.trim_end()
    )
}

fn style() -> String {
    let hex = |c: RGBColor| format!("#{:02X}{:02X}{:02X}", c.0, c.1, c.2);
    let night = AT_NIGHT.map(|(by_day, by_night)| {
        let day = hex(by_day);
        format!(".of [fill=\"{day}\"]{{fill:{by_night}}}.of [stroke=\"{day}\"]{{stroke:{by_night}}}")
    });
    format!(
        "<style>.of text{{font-family:system-ui,-apple-system,\"Segoe UI\",Roboto,\"Helvetica Neue\",Arial,sans-serif}}\
         @media screen and (prefers-color-scheme:dark){{{}}}</style>",
        night.concat()
    )
}

fn escaped(text: &str) -> String {
    maud::html! { (text) }.into_string()
}

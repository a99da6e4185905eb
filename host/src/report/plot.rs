//! What all pictures of the tool's pages are: SVG elements with axes of one look.
//!
//! ```text
//!       ┌──────────────── top (room for words over the frame)
//! y     │   grid: grey lines at the ticks
//! words │
//!       └──────────────── x words
//! ```

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

pub(crate) const FONT: &str = "sans-serif";
pub(crate) const GRID: RGBColor = RGBColor(228, 228, 228);
/// Pixels around everything.
const MARGIN: i32 = 8;
/// At the right the last tick's number stands out beyond the frame.
const RIGHT: i32 = 16;
/// Pixels for the numbers and words at the left.
const LEFT: u32 = 60;

pub(crate) type Failure = DrawingAreaErrorKind<std::io::Error>;
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws into an SVG element of a width and height in pixels. Drawing into a string does not fail; should it, the page says so instead
/// of the tool stopping.
pub(crate) fn svg(size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Result<(), Failure>) -> String {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        if let Err(error) = area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present()) {
            return format!("<p>This figure could not be drawn: {error}.</p>");
        }
    }
    text
}

/// What a line or a sign of a picture looks like, for its legend: drawn on 44 by 14 pixels.
pub(crate) fn swatch(draw: impl FnOnce(&Area<'_>) -> Result<(), Failure>) -> String {
    svg((44, 14), draw)
}

/// A line for a legend; `dashes` are pixels on and off.
pub(crate) fn line_swatch(style: impl Into<ShapeStyle>, dashes: Option<(i32, i32)>) -> String {
    let style = style.into();
    let (on, off) = dashes.unwrap_or((44, 0));
    swatch(|area| {
        let mut x = 0;
        while x < 44 {
            area.draw(&PathElement::new(vec![(x, 7), ((x + on).min(44), 7)], style))?;
            x += on + off;
        }
        Ok(())
    })
}

/// Two linear axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes<'a> {
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    /// Quantity and unit; `None` where the picture below says it.
    pub(crate) x_words: Option<&'a str>,
    pub(crate) y_words: &'a str,
    /// About so many ticks along x and y.
    pub(crate) ticks: (usize, usize),
    /// Height of the numbers, pixels; the words are a pixel higher.
    pub(crate) font: i32,
    /// Pixels over the frame.
    pub(crate) top: i32,
}

impl Axes<'_> {
    /// A chart with these axes drawn.
    pub(crate) fn on<'a, 'b>(&self, area: &'a Area<'b>) -> Result<Chart<'a, 'b>, Failure> {
        let mut chart = self.empty(area)?;
        self.draw(&mut chart)?;
        Ok(chart)
    }

    /// A chart without anything: for what lies below the grid.
    pub(crate) fn empty<'a, 'b>(&self, area: &'a Area<'b>) -> Result<Chart<'a, 'b>, Failure> {
        ChartBuilder::on(area)
            .margin(MARGIN)
            .margin_top(self.top)
            .margin_right(RIGHT)
            .x_label_area_size(if self.x_words.is_some() { 40 } else { 22 })
            .y_label_area_size(LEFT)
            .build_cartesian_2d(self.x.0..self.x.1, self.y.0..self.y.1)
    }

    /// Grid, axes, numbers and words.
    pub(crate) fn draw(&self, chart: &mut Chart<'_, '_>) -> Result<(), Failure> {
        let x_tick = |value: &f64| tick(*value, self.x.1 - self.x.0);
        let y_tick = |value: &f64| tick(*value, self.y.1 - self.y.0);
        let mut mesh = chart.configure_mesh();
        mesh.light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(BLACK)
            .x_labels(self.ticks.0)
            .y_labels(self.ticks.1)
            .y_desc(self.y_words)
            .x_label_formatter(&x_tick)
            .y_label_formatter(&y_tick)
            .label_style((FONT, self.font))
            .axis_desc_style((FONT, self.font + 1));
        if let Some(words) = self.x_words {
            mesh.x_desc(words);
        }
        mesh.draw()
    }
}

/// A tick's number with the digits that its axis needs.
pub(crate) fn tick(value: f64, span: f64) -> String {
    let decimals = (2.0 - span.abs().log10()).ceil().clamp(0.0, 7.0) as usize;
    let text = format!("{value:.decimals$}");
    // Ticks are round: trailing zeros say nothing.
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    if text == "-0" { "0".to_owned() } else { text }
}

//! A recording as SVG: what was observed with the simulation before and after, and below it what each leaves, over the noise.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::pictured::Pictured;
use crate::report::curve::thinned;
pub(super) use crate::report::figure::tick;

pub(super) const OBSERVED: RGBColor = RGBColor(178, 178, 178);
pub(super) const REST: RGBColor = RGBColor(150, 150, 150);
pub(super) const SHADE: RGBColor = RGBColor(236, 236, 232);
pub(super) const GRID: RGBColor = RGBColor(228, 228, 228);
pub(super) const FONT: &str = "sans-serif";
/// Points of a line in a figure of the full width.
const POINTS: usize = 900;

pub(super) type Failure = DrawingAreaErrorKind<std::io::Error>;

/// Draws into an SVG element; should that fail, the page says so instead of the tool stopping.
pub(super) fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Failure>,
) -> String {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        if let Err(error) = area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present()) {
            return format!("<p>This figure could not be drawn: {error}.</p>");
        }
    }
    text
}

/// One recording. `large` has axes with names; the small ones share them with their neighbours.
pub(super) fn recording(pictured: &Pictured, quantity: &str, large: bool) -> String {
    let size = if large { (940, 560) } else { (420, 330) };
    svg(size, |area| {
        let (upper, lower) = area.split_vertically((f64::from(size.1) * 0.62) as u32);
        let scale = Scale { large, points: if large { POINTS } else { POINTS / 3 } };
        curves(&upper, pictured, quantity, scale)?;
        rests(&lower, pictured, scale)
    })
}

#[derive(Clone, Copy)]
struct Scale {
    large: bool,
    points: usize,
}

impl Scale {
    fn font(self) -> i32 {
        if self.large { 13 } else { 14 }
    }
}

fn within(pictured: &Pictured, line: &[(f64, f64)], points: usize) -> Vec<(f64, f64)> {
    let inside: Vec<(f64, f64)> =
        line.iter().copied().filter(|(t, _)| (pictured.span.0..=pictured.span.1).contains(t)).collect();
    thinned(&inside, points)
}

fn range_of(lines: &[&[(f64, f64)]], least: f64) -> (f64, f64) {
    let values = lines.iter().flat_map(|line| line.iter().map(|(_, value)| *value));
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    let (low, high) = (low.min(-least), high.max(least));
    let room = 0.08 * (high - low).max(f64::MIN_POSITIVE);
    (low - room, high + room)
}

/// The located places, over the whole height.
fn shades(pictured: &Pictured, y: (f64, f64)) -> impl Iterator<Item = Rectangle<(f64, f64)>> {
    let inside = pictured.shaded.iter().map(|(from, to)| (from.max(pictured.span.0), to.min(pictured.span.1)));
    inside
        .filter(|(from, to)| from < to)
        .map(move |(from, to)| Rectangle::new([(from, y.0), (to, y.1)], SHADE.filled()))
}

fn curves(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    pictured: &Pictured,
    quantity: &str,
    scale: Scale,
) -> Result<(), Failure> {
    let observed = within(pictured, &pictured.observed, scale.points);
    let before = within(pictured, &pictured.before, scale.points);
    let after = within(pictured, &pictured.after, scale.points);
    let y = range_of(&[&observed, &before, &after], 0.0);
    let mut chart = ChartBuilder::on(area)
        .margin(6)
        .margin_right(14)
        .x_label_area_size(if scale.large { 24 } else { 18 })
        .y_label_area_size(62)
        .build_cartesian_2d(pictured.span.0..pictured.span.1, y.0..y.1)?;
    chart.draw_series(shades(pictured, y))?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(BLACK)
        .x_labels(if scale.large { 10 } else { 5 })
        .y_labels(if scale.large { 7 } else { 4 })
        .y_desc(quantity)
        .x_label_formatter(&|value| tick(*value, pictured.span.1 - pictured.span.0))
        .y_label_formatter(&|value| tick(*value, y.1 - y.0))
        .label_style((FONT, scale.font()))
        .axis_desc_style((FONT, scale.font() + 1))
        .draw()?;
    chart.draw_series(LineSeries::new(observed, OBSERVED.stroke_width(if scale.large { 6 } else { 5 })))?;
    chart.draw_series(DashedLineSeries::new(before, 7, 5, BLACK.stroke_width(if scale.large { 2 } else { 1 })))?;
    chart.draw_series(LineSeries::new(after, BLACK.stroke_width(1)))?;
    Ok(())
}

fn rests(area: &DrawingArea<SVGBackend<'_>, Shift>, pictured: &Pictured, scale: Scale) -> Result<(), Failure> {
    let before = within(pictured, &pictured.rest_before, scale.points);
    let after = within(pictured, &pictured.rest_after, scale.points);
    let y = range_of(&[&before, &after], 3.5);
    let mut chart = ChartBuilder::on(area)
        .margin(6)
        .margin_right(14)
        .margin_top(2)
        .x_label_area_size(if scale.large { 38 } else { 20 })
        .y_label_area_size(62)
        .build_cartesian_2d(pictured.span.0..pictured.span.1, y.0..y.1)?;
    chart.draw_series(shades(pictured, y))?;
    let x_tick = |value: &f64| tick(*value, pictured.span.1 - pictured.span.0);
    let y_tick = |value: &f64| tick(*value, y.1 - y.0);
    let mut mesh = chart.configure_mesh();
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(BLACK)
        .x_labels(if scale.large { 10 } else { 5 })
        .y_labels(if scale.large { 5 } else { 3 })
        .y_desc("rest ÷ noise")
        .x_label_formatter(&x_tick)
        .y_label_formatter(&y_tick)
        .label_style((FONT, scale.font()))
        .axis_desc_style((FONT, scale.font() + 1));
    if scale.large {
        mesh.x_desc("time since contact, ms");
    }
    mesh.draw()?;
    for level in [-2.0, 2.0] {
        let ends = [(pictured.span.0, level), (pictured.span.1, level)];
        chart.draw_series(DashedLineSeries::new(ends, 2, 4, BLACK.stroke_width(1)))?;
    }
    chart.draw_series(LineSeries::new(before, REST.stroke_width(if scale.large { 5 } else { 4 })))?;
    chart.draw_series(LineSeries::new(after, BLACK.stroke_width(if scale.large { 2 } else { 1 })))?;
    Ok(())
}

/// Words at a place of a figure, in pixels.
pub(super) fn caption(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    words: &str,
    at: (i32, i32),
    side: HPos,
) -> Result<(), Failure> {
    let style = (FONT, 14).into_font().color(&BLACK).pos(Pos::new(side, VPos::Top));
    area.draw(&Text::new(words.to_owned(), at, style))
}

/// Draws on an area.
type Draw<'a> = dyn Fn(&DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Failure> + 'a;

/// What the lines of these figures mean, as SVG swatches with words.
pub(super) fn legend() -> Vec<(String, &'static str)> {
    let swatch = |draw: &Draw<'_>| svg((44, 14), draw);
    let line = |style: ShapeStyle| swatch(&move |area| area.draw(&PathElement::new(vec![(0, 7), (44, 7)], style)));
    let dashes = |on: i32, off: i32, width: u32| {
        swatch(&move |area| {
            let mut x = 0;
            while x < 44 {
                area.draw(&PathElement::new(vec![(x, 7), ((x + on).min(44), 7)], BLACK.stroke_width(width)))?;
                x += on + off;
            }
            Ok(())
        })
    };
    vec![
        (line(OBSERVED.stroke_width(6)), "above: observed"),
        (dashes(7, 5, 2), "simulated before, re-tuned"),
        (line(BLACK.stroke_width(1)), "simulated after, with what was found"),
        (line(REST.stroke_width(5)), "below: what is left before"),
        (line(BLACK.stroke_width(2)), "what is left after"),
        (dashes(2, 4, 1), "±2 standard deviations of noise"),
        (swatch(&|area| area.draw(&Rectangle::new([(0, 0), (44, 14)], SHADE.filled()))), "located place"),
    ]
}

//! A recording as SVG: what was observed with the simulation before and after, and below it what each leaves, over the noise.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::pictured::Pictured;
use crate::report::curve::thinned;
use crate::report::plot::{Area, Axes, FONT, Failure, line_swatch, svg, swatch};

pub(super) const OBSERVED: RGBColor = RGBColor(178, 178, 178);
pub(super) const REST: RGBColor = RGBColor(150, 150, 150);
pub(super) const SHADE: RGBColor = RGBColor(236, 236, 232);
/// Points of a line in a figure of the full width.
const POINTS: usize = 900;

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

fn curves(area: &Area<'_>, pictured: &Pictured, quantity: &str, scale: Scale) -> Result<(), Failure> {
    let observed = within(pictured, &pictured.observed, scale.points);
    let before = within(pictured, &pictured.before, scale.points);
    let after = within(pictured, &pictured.after, scale.points);
    let y = range_of(&[&observed, &before, &after], 0.0);
    let axes = Axes {
        x: pictured.span,
        y,
        x_words: None,
        y_words: quantity,
        ticks: if scale.large { (10, 7) } else { (5, 4) },
        font: scale.font(),
        top: 6,
    };
    let mut chart = axes.empty(area)?;
    chart.draw_series(shades(pictured, y))?;
    axes.draw(&mut chart)?;
    chart.draw_series(LineSeries::new(observed, OBSERVED.stroke_width(if scale.large { 6 } else { 5 })))?;
    chart.draw_series(DashedLineSeries::new(before, 7, 5, BLACK.stroke_width(if scale.large { 2 } else { 1 })))?;
    chart.draw_series(LineSeries::new(after, BLACK.stroke_width(1)))?;
    Ok(())
}

fn rests(area: &Area<'_>, pictured: &Pictured, scale: Scale) -> Result<(), Failure> {
    let before = within(pictured, &pictured.rest_before, scale.points);
    let after = within(pictured, &pictured.rest_after, scale.points);
    let y = range_of(&[&before, &after], 3.5);
    let axes = Axes {
        x: pictured.span,
        y,
        x_words: scale.large.then_some("time since contact, ms"),
        y_words: "rest ÷ noise",
        ticks: if scale.large { (10, 5) } else { (5, 3) },
        font: scale.font(),
        top: 2,
    };
    let mut chart = axes.empty(area)?;
    chart.draw_series(shades(pictured, y))?;
    axes.draw(&mut chart)?;
    for level in [-2.0, 2.0] {
        let ends = [(pictured.span.0, level), (pictured.span.1, level)];
        chart.draw_series(DashedLineSeries::new(ends, 2, 4, BLACK.stroke_width(1)))?;
    }
    chart.draw_series(LineSeries::new(before, REST.stroke_width(if scale.large { 5 } else { 4 })))?;
    chart.draw_series(LineSeries::new(after, BLACK.stroke_width(if scale.large { 2 } else { 1 })))?;
    Ok(())
}

/// Words at a place of a figure, in pixels.
pub(super) fn caption(area: &Area<'_>, words: &str, at: (i32, i32), side: HPos) -> Result<(), Failure> {
    let style = (FONT, 14).into_font().color(&BLACK).pos(Pos::new(side, VPos::Top));
    area.draw(&Text::new(words.to_owned(), at, style))
}

/// What the lines of these figures mean, as SVG swatches with words.
pub(super) fn legend() -> Vec<(String, &'static str)> {
    vec![
        (line_swatch(OBSERVED.stroke_width(6), None), "above: observed"),
        (line_swatch(BLACK.stroke_width(2), Some((7, 5))), "simulated before, re-tuned"),
        (line_swatch(BLACK.stroke_width(1), None), "simulated after, with what was found"),
        (line_swatch(REST.stroke_width(5), None), "below: what is left before"),
        (line_swatch(BLACK.stroke_width(2), None), "what is left after"),
        (line_swatch(BLACK.stroke_width(1), Some((2, 4))), "±2 standard deviations of noise"),
        (swatch(|area| area.draw(&Rectangle::new([(0, 0), (44, 14)], SHADE.filled()))), "located place"),
    ]
}

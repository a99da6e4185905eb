//! Force over time as SVG: lines that differ in weight and dash, bands, and marks with words on them.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// How a line is drawn, and so what it means in every figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stroke {
    /// Thin and grey: the unfiltered force.
    Raw,
    /// Heavy and black: the judged force.
    Judged,
    /// Dotted: what was true.
    Truth,
    /// Dots: the samples themselves.
    Samples,
}

/// A line of points: time and force.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub(super) stroke: Stroke,
    pub(super) points: Vec<(f64, f64)>,
}

/// A level over the whole width or a part of it, with a word at its right end.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) value: f64,
    /// The guard band around it.
    pub(super) guard: Option<(f64, f64)>,
    pub(super) label: String,
}

/// An instant, with a word at the top.
#[derive(Clone, Debug)]
pub(super) struct Instant {
    pub(super) at: f64,
    pub(super) label: String,
    /// Dotted: an instant that was true rather than sensed.
    pub(super) truth: bool,
    /// In which row of words the label stands, from the top; so that near labels do not cover each other.
    pub(super) row: i32,
    /// A short stroke at the top instead of a line over the whole height, which could hide a short pulse.
    pub(super) tick: bool,
}

/// A point with a word beside it.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    pub(super) at: (f64, f64),
    pub(super) label: String,
}

/// A figure.
#[derive(Clone, Debug)]
pub(super) struct Figure {
    pub(super) size: (u32, u32),
    pub(super) x: (f64, f64),
    pub(super) y: (f64, f64),
    pub(super) x_label: &'static str,
    pub(super) y_label: &'static str,
    /// A shaded stretch of time with its name.
    pub(super) window: Option<(f64, f64, &'static str)>,
    pub(super) lines: Vec<Line>,
    pub(super) levels: Vec<Level>,
    pub(super) instants: Vec<Instant>,
    pub(super) spots: Vec<Spot>,
}

const GREY: RGBColor = RGBColor(125, 125, 125);
const WINDOW: RGBColor = RGBColor(244, 244, 241);
const GUARD: RGBColor = RGBColor(222, 222, 218);
const FONT: &str = "sans-serif";
const ROW: i32 = 15;

type Failure = DrawingAreaErrorKind<std::io::Error>;

impl Figure {
    /// The figure as an SVG element.
    pub(super) fn svg(&self) -> String {
        let mut text = String::new();
        {
            let area = SVGBackend::with_string(&mut text, self.size).into_drawing_area();
            // Drawing into a string does not fail; should it, the page says so instead of the tool stopping.
            if let Err(error) = self.draw(&area) {
                return format!("<p>This figure could not be drawn: {error}.</p>");
            }
        }
        text
    }

    fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Failure> {
        area.fill(&WHITE)?;
        let rows = self.instants.iter().map(|instant| instant.row + 1).max().unwrap_or(0);
        let mut chart = ChartBuilder::on(area)
            .margin(8)
            .margin_top(10 + rows * ROW)
            .margin_right(18)
            .x_label_area_size(40)
            .y_label_area_size(58)
            .build_cartesian_2d(self.x.0..self.x.1, self.y.0..self.y.1)?;
        let inside = |x: f64| x.clamp(self.x.0, self.x.1);
        if let Some((from, to, _)) = self.window {
            let shade = Rectangle::new([(inside(from), self.y.0), (inside(to), self.y.1)], WINDOW.filled());
            chart.draw_series(std::iter::once(shade))?;
        }
        for level in &self.levels {
            if let Some((low, high)) = level.guard {
                let corners = [(inside(level.from), low.max(self.y.0)), (inside(level.to), high.min(self.y.1))];
                if corners[0].1 < corners[1].1 {
                    chart.draw_series(std::iter::once(Rectangle::new(corners, GUARD.filled())))?;
                }
            }
        }
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(230, 230, 230))
            .axis_style(BLACK)
            .x_labels(9)
            .y_labels(8)
            .x_desc(self.x_label)
            .y_desc(self.y_label)
            .x_label_formatter(&|value| tick(*value, self.x.1 - self.x.0))
            .y_label_formatter(&|value| tick(*value, self.y.1 - self.y.0))
            .label_style((FONT, 13))
            .axis_desc_style((FONT, 14))
            .draw()?;
        for line in &self.lines {
            let points: Vec<(f64, f64)> =
                line.points.iter().copied().filter(|(x, _)| (self.x.0..=self.x.1).contains(x)).collect();
            match line.stroke {
                Stroke::Raw => {
                    chart.draw_series(LineSeries::new(points, GREY.stroke_width(1)))?;
                }
                Stroke::Judged => {
                    chart.draw_series(LineSeries::new(points, BLACK.stroke_width(3)))?;
                }
                Stroke::Truth => {
                    chart.draw_series(DashedLineSeries::new(points, 2, 4, BLACK.stroke_width(2)))?;
                }
                Stroke::Samples => {
                    // A dot on the frame would look like a value that is not.
                    let inside = points.into_iter().filter(|(_, y)| (self.y.0..=self.y.1).contains(y));
                    chart.draw_series(inside.map(|point| Circle::new(point, 2, BLACK.filled())))?;
                }
            }
        }
        for level in &self.levels {
            let ends = [(inside(level.from), level.value), (inside(level.to), level.value)];
            if !(self.y.0..=self.y.1).contains(&level.value) || ends[0].0 >= ends[1].0 {
                continue;
            }
            chart.draw_series(DashedLineSeries::new(ends, 9, 5, BLACK.stroke_width(2)))?;
            let style = (FONT, 13).into_font().color(&BLACK).pos(Pos::new(HPos::Right, VPos::Bottom));
            let place = EmptyElement::at(ends[1]) + Text::new(level.label.clone(), (-4, -3), style);
            chart.draw_series(std::iter::once(place))?;
        }
        if let Some((from, to, name)) = self.window
            && inside(to) > inside(from)
        {
            let style = (FONT, 13).into_font().color(&BLACK).pos(Pos::new(HPos::Right, VPos::Bottom));
            let place = EmptyElement::at((inside(to), self.y.0)) + Text::new(name, (-4, -4), style);
            chart.draw_series(std::iter::once(place))?;
        }
        for instant in &self.instants {
            if !(self.x.0..=self.x.1).contains(&instant.at) {
                continue;
            }
            let foot = if instant.tick { self.y.1 - 0.08 * (self.y.1 - self.y.0) } else { self.y.0 };
            let ends = [(instant.at, foot), (instant.at, self.y.1)];
            if instant.truth {
                chart.draw_series(DashedLineSeries::new(ends, 2, 4, BLACK.stroke_width(1)))?;
            } else {
                chart.draw_series(LineSeries::new(ends, BLACK.stroke_width(1)))?;
            }
            let (x, top) = chart.backend_coord(&(instant.at, self.y.1));
            let right = (instant.at - self.x.0) > 0.7 * (self.x.1 - self.x.0);
            let side = if right { HPos::Right } else { HPos::Left };
            let style = (FONT, 13).into_font().color(&BLACK).pos(Pos::new(side, VPos::Bottom));
            let shift = if right { -3 } else { 3 };
            area.draw(&Text::new(instant.label.clone(), (x + shift, top - 2 - (rows - 1 - instant.row) * ROW), style))?;
            // A stroke from the frame up to the word.
            let stem = vec![(x, top), (x, top - 2 - (rows - 1 - instant.row) * ROW - 8)];
            area.draw(&PathElement::new(stem, BLACK.stroke_width(1)))?;
        }
        for spot in &self.spots {
            let style = (FONT, 13).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
            let height = |at: (f64, f64)| chart.backend_coord(&at).1;
            let levels: Vec<i32> = self.levels.iter().map(|level| height((level.to, level.value))).collect();
            let place = EmptyElement::at(spot.at)
                + Circle::new((0, 0), 4, BLACK.stroke_width(2))
                + Text::new(spot.label.clone(), (9, clear(height(spot.at), &levels)), style);
            chart.draw_series(std::iter::once(place))?;
        }
        area.present()
    }
}

/// How far from a spot its word stands, downward in pixels like all heights here: where no level runs through it.
fn clear(spot: i32, levels: &[i32]) -> i32 {
    /// Half the height of a word, and a little.
    const HALF: i32 = 9;
    let free = |shift: &i32| levels.iter().all(|level| (spot + shift - level).abs() > HALF);
    [-9, 11, -28, 30].into_iter().find(free).unwrap_or(-9)
}

/// A tick's number with the digits that its axis needs.
pub(crate) fn tick(value: f64, span: f64) -> String {
    let decimals = (2.0 - span.abs().log10()).ceil().clamp(0.0, 7.0) as usize;
    let text = format!("{value:.decimals$}");
    // Ticks are round: trailing zeros say nothing.
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    if text == "-0" { "0".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_stands_where_no_level_runs_through_it() {
        assert_eq!(clear(100, &[]), -9);
        assert_eq!(clear(100, &[95]), 11, "the level just above the spot");
        assert_eq!(clear(100, &[91, 112]), -28, "one above and one below");
        assert_eq!(clear(100, &[300]), -9);
    }
}

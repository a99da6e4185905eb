//! Forecast against truth, and what is left, as SVG.

use plotters::prelude::*;

use crate::predict::task::Task;
use crate::predict::trial::Trial;
use crate::report::plot::{Area, Axes, Failure, line_swatch, svg, swatch};

const DOT: RGBColor = RGBColor(90, 90, 90);
const SIZE: (u32, u32) = (460, 620);
/// Dashes of the line of the paper's margin of safety: pixels on and off.
const MARGIN: (i32, i32) = (7, 5);
/// Most dots of a picture; of more rows, every so many-th.
const DOTS: usize = 1_500;

/// Above, the forecast over the truth, with the line of equality and the paper's line 10 % above it; below, forecast less truth.
pub(super) fn forecast(trial: &Trial) -> String {
    svg(SIZE, |area| draw(area, trial))
}

fn draw(area: &Area<'_>, trial: &Trial) -> Result<(), Failure> {
    let step = trial.forecast_n.len().div_ceil(DOTS).max(1);
    let points: Vec<(f64, f64)> =
        trial.rows.y.iter().copied().zip(trial.forecast_n.iter().copied()).step_by(step).collect();
    let all = points.iter().flat_map(|(truth, forecast)| [*truth, *forecast]);
    let low = all.clone().fold(0.0, f64::min);
    let high = 1.04 * all.fold(1.0, f64::max);
    let worst = points.iter().map(|(truth, forecast)| (forecast - truth).abs()).fold(1.0, f64::max) * 1.08;
    let (upper, lower) = area.split_vertically(410);

    let axes =
        Axes { x: (low, high), y: (low, high), x_words: None, y_words: "forecast, N", ticks: (6, 7), font: 13, top: 8 };
    let mut chart = axes.on(&upper)?;
    chart.draw_series(points.iter().map(|point| Circle::new(*point, 2, DOT.mix(0.55).filled())))?;
    chart.draw_series(LineSeries::new([(low, low), (high, high)], BLACK.stroke_width(1)))?;
    chart.draw_series(DashedLineSeries::new(
        [(0.0, 0.0), (high / 1.1, high)],
        MARGIN.0,
        MARGIN.1,
        BLACK.stroke_width(1),
    ))?;

    let axes = Axes {
        y: (-worst, worst),
        x_words: Some("true force, N"),
        y_words: "forecast less truth, N",
        ticks: (6, 5),
        ..axes
    };
    let mut chart = axes.on(&lower)?;
    chart.draw_series(
        points.iter().map(|(truth, forecast)| Circle::new((*truth, forecast - truth), 2, DOT.mix(0.55).filled())),
    )?;
    chart.draw_series(LineSeries::new([(low, 0.0), (high, 0.0)], BLACK.stroke_width(1)))?;
    Ok(())
}

/// What dots and lines of these pictures mean, as SVG swatches with words.
pub(super) fn legend(task: Task) -> Vec<(String, &'static str)> {
    let dots = swatch(|area| {
        for at in [(8, 9), (22, 5), (36, 8)] {
            area.draw(&Circle::new(at, 2, DOT.filled()))?;
        }
        Ok(())
    });
    let dots_are = match task {
        Task::Profile => "an instant of an impact",
        Task::Peak | Task::Online => "an impact",
    };
    vec![
        (dots, dots_are),
        (line_swatch(BLACK.stroke_width(1), None), "the forecast is the truth"),
        (
            line_swatch(BLACK.stroke_width(1), Some(MARGIN)),
            "above: the forecast is 10 % over the truth, the paper's margin of safety",
        ),
    ]
}

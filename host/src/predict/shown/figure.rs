//! Forecast against truth, and what is left, as SVG.

use plotters::prelude::*;

use crate::predict::trial::Trial;
use crate::report::figure::tick;

const DOT: RGBColor = RGBColor(90, 90, 90);
const GRID: RGBColor = RGBColor(230, 230, 230);
const FONT: &str = "sans-serif";
const SIZE: (u32, u32) = (460, 620);
/// Most dots of a picture; of more rows, every so many-th.
const DOTS: usize = 1_500;

type Failure = DrawingAreaErrorKind<std::io::Error>;

/// Above, the forecast over the truth, with the line of equality and the paper's line 10 % above it; below, forecast less truth.
pub(super) fn forecast(trial: &Trial) -> String {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        // Drawing into a string does not fail; should it, the page says so instead of the tool stopping.
        if let Err(error) = draw(&area, trial) {
            return format!("<p>This figure could not be drawn: {error}.</p>");
        }
    }
    text
}

fn draw(area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>, trial: &Trial) -> Result<(), Failure> {
    area.fill(&WHITE)?;
    let step = trial.forecast_n.len().div_ceil(DOTS).max(1);
    let points: Vec<(f64, f64)> =
        trial.rows.y.iter().copied().zip(trial.forecast_n.iter().copied()).step_by(step).collect();
    let all = points.iter().flat_map(|(truth, forecast)| [*truth, *forecast]);
    let low = all.clone().fold(0.0, f64::min);
    let high = 1.04 * all.fold(1.0, f64::max);
    let worst = points.iter().map(|(truth, forecast)| (forecast - truth).abs()).fold(1.0, f64::max) * 1.08;
    let (upper, lower) = area.split_vertically(410);

    let mut chart = ChartBuilder::on(&upper)
        .margin(8)
        .margin_right(16)
        .x_label_area_size(22)
        .y_label_area_size(58)
        .build_cartesian_2d(low..high, low..high)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(BLACK)
        .x_labels(6)
        .y_labels(7)
        .y_desc("forecast, N")
        .x_label_formatter(&|value| tick(*value, high - low))
        .y_label_formatter(&|value| tick(*value, high - low))
        .label_style((FONT, 13))
        .axis_desc_style((FONT, 14))
        .draw()?;
    chart.draw_series(points.iter().map(|point| Circle::new(*point, 2, DOT.mix(0.55).filled())))?;
    chart.draw_series(LineSeries::new([(low, low), (high, high)], BLACK.stroke_width(1)))?;
    chart.draw_series(DashedLineSeries::new([(0.0, 0.0), (high / 1.1, high)], 7, 5, BLACK.stroke_width(1)))?;

    let mut chart = ChartBuilder::on(&lower)
        .margin(8)
        .margin_right(16)
        .x_label_area_size(40)
        .y_label_area_size(58)
        .build_cartesian_2d(low..high, -worst..worst)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(BLACK)
        .x_labels(6)
        .y_labels(5)
        .x_desc("true force, N")
        .y_desc("forecast less truth, N")
        .x_label_formatter(&|value| tick(*value, high - low))
        .y_label_formatter(&|value| tick(*value, 2.0 * worst))
        .label_style((FONT, 13))
        .axis_desc_style((FONT, 13))
        .draw()?;
    chart.draw_series(
        points.iter().map(|(truth, forecast)| Circle::new((*truth, forecast - truth), 2, DOT.mix(0.55).filled())),
    )?;
    chart.draw_series(LineSeries::new([(low, 0.0), (high, 0.0)], BLACK.stroke_width(1)))?;
    area.present()
}

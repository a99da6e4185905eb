//! The spectrum of the whitened rest, before and after, over that of the noise before contact.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::figure::{REST, caption};
use crate::diagnosis::Diagnosis;
use crate::diagnosis::spectrum::periodogram;
use crate::report::plot::{FONT, GRID, svg, tick};

/// Points along the frequency, equally spaced in its logarithm.
const POINTS: usize = 130;
/// The lowest frequency shown, Hz: a recording of some tenths of a second holds a period of it.
const LOWEST_HZ: f64 = 4.0;

/// The figure; `None` where the recordings are too short for a spectrum.
pub(super) fn figure(diagnosis: &Diagnosis, shown: &[Vec<f64>]) -> Option<String> {
    let problem = &diagnosis.problem;
    let line = |residuals: &[Vec<f64>]| -> Vec<(f64, f64)> {
        let (frequencies, power) = periodogram(problem, residuals);
        let highest = frequencies.last().copied().unwrap_or(0.0);
        if highest <= LOWEST_HZ {
            return Vec::new();
        }
        let edge = |number: usize| LOWEST_HZ * (highest / LOWEST_HZ).powf(number as f64 / POINTS as f64);
        (0..POINTS)
            .filter_map(|number| {
                let from = frequencies.partition_point(|f| *f < edge(number));
                let to = frequencies.partition_point(|f| *f < edge(number + 1));
                let bins = &power[from..to];
                let mean = bins.iter().sum::<f64>() / bins.len() as f64;
                (!bins.is_empty() && mean > 0.0).then(|| ((edge(number) * edge(number + 1)).sqrt(), mean))
            })
            .collect()
    };
    let left: Vec<Vec<f64>> =
        problem.recordings.iter().zip(shown).map(|(recording, model)| recording.left_by(model)).collect();
    let (before, after) = (line(&diagnosis.selection.baseline.residuals), line(&left));
    let (first, last) = (before.first()?.0, before.last()?.0);
    let values = || before.iter().chain(&after).map(|(_, value)| *value);
    let low = values().fold(0.3, f64::min).max(0.02);
    let high = values().fold(10.0, f64::max) * 1.5;
    Some(svg((940, 330), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(8)
            .margin_right(18)
            .x_label_area_size(40)
            .y_label_area_size(62)
            .build_cartesian_2d((first..last).log_scale(), (low..high).log_scale())?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(BLACK)
            .x_labels(8)
            .y_labels(6)
            .x_desc("frequency, Hz")
            .y_desc("power ÷ that of the noise")
            .x_label_formatter(&|value| tick(*value, *value))
            .y_label_formatter(&|value| tick(*value, *value))
            .label_style((FONT, 13))
            .axis_desc_style((FONT, 14))
            .draw()?;
        chart.draw_series(DashedLineSeries::new([(first, 1.0), (last, 1.0)], 2, 4, BLACK.stroke_width(1)))?;
        chart.draw_series(LineSeries::new(before.clone(), REST.stroke_width(4)))?;
        chart.draw_series(LineSeries::new(after.clone(), BLACK.stroke_width(1)))?;
        let (_, y) = chart.backend_coord(&(first, 1.0));
        caption(area, "noise", (76, y - 18), HPos::Left)
    }))
}

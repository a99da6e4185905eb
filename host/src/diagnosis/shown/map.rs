//! The rest over stroke and rate of stroke while touching: where in the motion the simulation is wrong, whatever the time.
//!
//! A disc for each cell of the plane, its area the mean rest there; black where more was observed than simulated, hollow where less.
//! A loss shows as black on the way in (rate above 0) and hollow on the way out; a wrong stiffness has the same colour on both.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use thud_sim::rig::Quantity;

use super::figure::caption;
use crate::campaign::RigKind;
use crate::diagnosis::locate::Course;
use crate::diagnosis::{Diagnosis, predict};
use crate::report::plot::{Area, Axes, Failure, svg};

/// Cells along the stroke.
const COLUMNS: usize = 26;
/// Cells along the rate.
const ROWS: usize = 17;
/// Fewer samples in a cell say nothing.
const FEWEST: usize = 3;

/// Cells of the plane.
struct Cells {
    /// Largest stroke, m.
    stroke_m: f64,
    /// Largest rate either way, m/s.
    rate_m_per_s: f64,
    /// Mean rest over the noise, row by row; none where too few samples are.
    mean: Vec<Option<f64>>,
}

/// Places of all samples in contact: recording, sample, stroke and rate in the chosen model.
fn places(diagnosis: &Diagnosis) -> Vec<(usize, usize, f64, f64)> {
    let problem = &diagnosis.problem;
    let fit = &diagnosis.selection.best.fit;
    let mut all = Vec::new();
    for (number, recording) in problem.recordings.iter().enumerate() {
        let Ok(impact) = predict::strike(problem, &fit.layout, &fit.point, number) else { continue };
        let course = Course::of(problem, fit, number);
        let since: Vec<f64> = recording.times_s.iter().map(|time| time - course.contact_s).collect();
        let (position, velocity) =
            (impact.sample(Quantity::Position, &since), impact.sample(Quantity::Velocity, &since));
        let touching = |time: f64| (course.contact_s..course.separation_s).contains(&time);
        all.extend(
            (0..since.len())
                .filter(|place| touching(recording.times_s[*place]))
                .map(|place| (number, place, position[place], velocity[place])),
        );
    }
    all
}

fn cells(diagnosis: &Diagnosis, places: &[(usize, usize, f64, f64)], rest: &dyn Fn(usize, usize) -> f64) -> Cells {
    let stroke_m = places.iter().map(|(_, _, x, _)| *x).fold(1e-9, f64::max);
    let rate_m_per_s = places.iter().map(|(_, _, _, v)| v.abs()).fold(1e-9, f64::max);
    let mut sums = vec![(0.0, 0_usize); COLUMNS * ROWS];
    for (number, place, x, v) in places {
        let column = ((x / stroke_m).clamp(0.0, 1.0) * COLUMNS as f64) as usize;
        let row = ((0.5 + 0.5 * v / rate_m_per_s).clamp(0.0, 1.0) * ROWS as f64) as usize;
        let cell = &mut sums[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)];
        cell.0 += rest(*number, *place) / diagnosis.problem.recordings[*number].noise[0].rms().max(f64::MIN_POSITIVE);
        cell.1 += 1;
    }
    let mean = sums.iter().map(|(sum, count)| (*count >= FEWEST).then(|| sum / *count as f64)).collect();
    Cells { stroke_m, rate_m_per_s, mean }
}

/// The map before and after, side by side, on one scale. `None` where nothing touches.
pub(super) fn figure(diagnosis: &Diagnosis, shown: &[Vec<f64>]) -> Option<(String, f64)> {
    let places = places(diagnosis);
    if places.is_empty() {
        return None;
    }
    let observed = |number: usize, place: usize| diagnosis.problem.recordings[number].series[0][place];
    let of =
        |model: &[Vec<f64>]| cells(diagnosis, &places, &|number, place| observed(number, place) - model[number][place]);
    let (before, after) = (of(&diagnosis.selection.baseline.model), of(shown));
    let largest = before.mean.iter().chain(&after.mean).flatten().fold(1.0_f64, |most, mean| most.max(mean.abs()));
    let falls = diagnosis.problem.rig.kind == RigKind::Fall;
    let text = svg((940, 380), |area| {
        let (left, right) = area.split_horizontally(470);
        panel(&left, &before, largest, falls, "before")?;
        panel(&right, &after, largest, falls, "after")
    });
    Some((text, largest))
}

fn panel(area: &Area<'_>, cells: &Cells, largest: f64, falls: bool, title: &str) -> Result<(), Failure> {
    let stroke_mm = 1e3 * cells.stroke_m;
    let axes = Axes {
        x: (0.0, stroke_mm),
        y: (-cells.rate_m_per_s, cells.rate_m_per_s),
        x_words: Some(if falls { "fallen, mm" } else { "stroke, mm" }),
        y_words: "its rate, m/s",
        ticks: (6, 6),
        font: 13,
        top: 26,
    };
    let mut chart = axes.on(area)?;
    let (width, height) = chart.plotting_area().dim_in_pixel();
    let cell_px = (f64::from(width) / COLUMNS as f64).min(f64::from(height) / ROWS as f64);
    for (place, mean) in cells.mean.iter().enumerate() {
        let Some(mean) = mean else { continue };
        let x = stroke_mm * ((place % COLUMNS) as f64 + 0.5) / COLUMNS as f64;
        let y = cells.rate_m_per_s * (2.0 * ((place / COLUMNS) as f64 + 0.5) / ROWS as f64 - 1.0);
        // Its area is what counts to the eye.
        let radius = (0.56 * cell_px * (mean.abs() / largest).sqrt()).round() as i32;
        if radius < 1 {
            continue;
        }
        let style = if *mean > 0.0 { BLACK.filled() } else { BLACK.stroke_width(1) };
        chart.draw_series(std::iter::once(Circle::new((x, y), radius, style)))?;
    }
    caption(area, title, (60, 6), HPos::Left)
}

//! Loops of force over depth, rests over time, restitution over speed: SVG, readable in black and white.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::contact_law::depth::{Source, reconstructed};
use crate::contact_law::identification::{Identification, Identified};
use crate::contact_law::law::{Damping, Law};
use crate::report::curve::thinned;
use crate::report::plot::{Axes, FONT, line_swatch, svg, swatch};

const MEASURED: RGBColor = RGBColor(178, 178, 178);
/// Points of a line.
const POINTS: usize = 500;
/// Recordings that a picture shows, spread over the peaks.
const SHOWN: usize = 3;

type Line = Vec<(f64, f64)>;

/// What a law's line is drawn with, so that it is the same in every figure: dashes on and off in pixels, and width.
fn stroke(place: usize) -> (i32, i32, u32) {
    const STROKES: [(i32, i32, u32); 7] =
        [(1, 0, 3), (14, 5, 2), (2, 4, 2), (8, 3, 1), (1, 0, 1), (4, 4, 3), (20, 3, 1)];
    STROKES[place % STROKES.len()]
}

/// Places of the recordings that are shown: lowest, middle and highest peak.
pub(super) fn shown(found: &Identification) -> Vec<usize> {
    let mut order: Vec<usize> = (0..found.recordings.len()).collect();
    order.sort_by(|a, b| found.recordings[*a].peak_n.total_cmp(&found.recordings[*b].peak_n));
    let last = order.len() - 1;
    let mut places: Vec<usize> = (0..SHOWN).map(|step| order[last * step / (SHOWN - 1)]).collect();
    places.dedup();
    places
}

/// One recording with a law: depth and force measured, depth and force of the law, and what is left over time in ms.
struct Loop {
    measured: Line,
    fitted: Line,
    rest: Line,
}

fn loop_of(found: &Identification, law: &Identified, number: usize) -> Loop {
    let setting = found.setting();
    let (blow, point) = (&found.blows[number], &law.fit.point);
    let contact_s = setting.contact_s(point, number);
    let (mass, speed) = (setting.mass_kg(point, number), setting.speed_m_per_s(point, number));
    let times = &blow.full.times_s;
    let zero = point.own[number][1] * blow.noise_n;
    let predicted = setting.predicted(law.law, point, number, &blow.full).unwrap_or_default();
    let rest = times
        .iter()
        .zip(blow.full.force_n.iter().zip(&predicted))
        .map(|(time, (force, predicted))| (1e3 * (time - contact_s), force - predicted))
        .collect();
    let (measured, fitted) = match found.source {
        Source::Measured => {
            let shift = point.own[number][0] * setting.reference_m;
            let depths = blow.full.depth.iter().map(|(depth, _)| 1e3 * (depth - shift));
            (
                depths.clone().zip(blow.full.force_n.iter().map(|force| force - zero)).collect(),
                depths.zip(predicted.iter().map(|force| force - zero)).collect(),
            )
        }
        Source::Reconstructed => {
            let mut values = law.values;
            values.reference_n *= point.own[number][3].exp();
            let motion = law.law.motion(&values, mass, speed, found.gravity_m_per_s2);
            let way = reconstructed(blow, contact_s, mass, speed, found.gravity_m_per_s2);
            let touching = |time: f64| (contact_s..=contact_s + motion.end_s).contains(&time);
            (
                times
                    .iter()
                    .zip(way.iter().zip(&blow.full.force_n))
                    .filter(|(time, _)| touching(**time))
                    .map(|(_, ((depth, _), force))| (1e3 * depth, force - zero))
                    .collect(),
                motion.depth_m.iter().map(|depth| 1e3 * depth).zip(motion.force_n.iter().copied()).collect(),
            )
        }
    };
    Loop { measured, fitted, rest }
}

fn span(values: impl Iterator<Item = f64>, room: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if !low.is_finite() {
        return (0.0, 1.0);
    }
    let space = room * (high - low).max(1e-9);
    (low - space, high + space)
}

/// Loops of force over depth with a law, and below them what the law leaves over time.
pub(super) fn loops(found: &Identification, law: &Identified) -> String {
    let loops: Vec<Loop> = shown(found).into_iter().map(|number| loop_of(found, law, number)).collect();
    svg((420, 470), |area| {
        let (upper, lower) = area.split_vertically(310);
        let both = || loops.iter().flat_map(|one| one.measured.iter().chain(&one.fitted));
        let axes = Axes {
            x: span(both().map(|point| point.0), 0.04),
            y: span(both().map(|point| point.1), 0.05),
            x_words: Some("depth, mm"),
            y_words: "force, N",
            ticks: (6, 6),
            font: 14,
            top: 8,
        };
        let mut chart_above = axes.on(&upper)?;
        for one in &loops {
            chart_above.draw_series(LineSeries::new(every(&one.measured), MEASURED.stroke_width(6)))?;
        }
        for one in &loops {
            chart_above.draw_series(LineSeries::new(every(&one.fitted), BLACK.stroke_width(1)))?;
        }
        let rests = || loops.iter().flat_map(|one| one.rest.iter());
        let height = rests().map(|point| point.1.abs()).fold(3.0 * found.noise_n, f64::max) * 1.05;
        let axes = Axes {
            x: span(rests().map(|point| point.0), 0.0),
            y: (-height, height),
            x_words: Some("time since contact, ms"),
            y_words: "rest, N",
            ticks: (6, 6),
            font: 14,
            top: 8,
        };
        let mut chart_below = axes.on(&lower)?;
        // Lowest peak in grey, the highest in heavy black.
        let styles =
            [RGBColor(165, 165, 165).stroke_width(3), RGBColor(90, 90, 90).stroke_width(1), BLACK.stroke_width(2)];
        for (one, style) in loops.iter().zip(styles) {
            chart_below.draw_series(LineSeries::new(thinned(&one.rest, POINTS), style))?;
        }
        for level in [-2.0 * found.noise_n, 2.0 * found.noise_n] {
            let ends = [(axes.x.0, level), (axes.x.1, level)];
            chart_below.draw_series(DashedLineSeries::new(ends, 2, 4, BLACK.stroke_width(1)))?;
        }
        Ok(())
    })
}

/// A line with at most so many points, evenly taken: a loop goes back on itself, so that its extremes are no places to thin at.
fn every(line: &[(f64, f64)]) -> Line {
    let stride = line.len().div_ceil(POINTS).max(1);
    let mut kept: Line = line.iter().step_by(stride).copied().collect();
    kept.extend(line.last());
    kept
}

/// Restitution over speed: every law's own, and what each recording shows by its momentum.
pub(super) fn restitution(found: &Identification) -> String {
    svg((940, 430), |area| {
        let bars = || found.recordings.iter().map(|recording| (recording.speed_m_per_s, recording.restitution));
        let curves = || distinct(found).into_iter().flat_map(|place| found.laws[place].restitution.iter());
        let (least, most) = span(bars().map(|bar| bar.0).chain(curves().map(|point| point.0)), 0.06);
        let heights = bars().flat_map(|(_, (e, sd))| [e - 2.0 * sd, e + 2.0 * sd]);
        let (low, high) = span(heights.chain(curves().map(|point| point.1)).map(|e| e.clamp(0.0, 1.3)), 0.06);
        let axes = Axes {
            x: (least, most.max(least + 0.02)),
            y: (low, high.max(1.02)),
            x_words: Some("speed of approach, m/s"),
            y_words: "restitution",
            ticks: (6, 6),
            font: 13,
            top: 8,
        };
        let mut chart = axes.on(area)?;
        for (speed, (e, sd)) in bars() {
            let ends = [(speed, (e - 2.0 * sd).max(low)), (speed, (e + 2.0 * sd).min(high))];
            chart.draw_series(LineSeries::new(ends, MEASURED.stroke_width(3)))?;
            chart.draw_series(std::iter::once(Circle::new((speed, e), 4, BLACK.stroke_width(1))))?;
        }
        for (turn, place) in drawn(found).into_iter().enumerate() {
            let (on, off, width) = stroke(turn);
            let line = found.laws[place].restitution.clone();
            if line.len() == 1 {
                let half = 0.01 * (axes.x.1 - axes.x.0);
                let dash = [(line[0].0 - half, line[0].1), (line[0].0 + half, line[0].1)];
                chart.draw_series(LineSeries::new(dash, BLACK.stroke_width(width)))?;
            } else if off == 0 {
                chart.draw_series(LineSeries::new(line, BLACK.stroke_width(width)))?;
            } else {
                chart.draw_series(DashedLineSeries::new(line, on, off, BLACK.stroke_width(width)))?;
            }
        }
        Ok(())
    })
}

/// Laws of different forces, the named one before those of the same force.
pub(super) fn distinct(found: &Identification) -> Vec<usize> {
    let mut places: Vec<usize> = vec![found.chosen];
    for (place, law) in found.laws.iter().enumerate() {
        if places.iter().all(|&other| !found.laws[other].law.same_force(law.law)) {
            places.push(place);
        }
    }
    places
}

/// The names of all laws that give the force of this one.
pub(super) fn names(found: &Identification, law: &Law) -> String {
    let same = found.laws.iter().filter(|other| other.law.same_force(law));
    let others = same.filter(|other| other.law.id != law.id).map(|other| other.law.name);
    std::iter::once(law.name).chain(others).collect::<Vec<_>>().join(", ")
}

/// The laws whose restitution is drawn: without loss it is 1, and one line says so.
fn drawn(found: &Identification) -> Vec<usize> {
    let mut elastic = false;
    let mut places = distinct(found);
    places.retain(|&place| {
        let lossless = matches!(found.laws[place].law.damping, Damping::None);
        let again = lossless && elastic;
        elastic |= lossless;
        !again
    });
    places
}

/// What the lines of the restitution mean.
pub(super) fn legend(found: &Identification) -> Vec<(String, String)> {
    let lossless = |law: &Law| matches!(law.damping, Damping::None);
    let mut entries: Vec<(String, String)> = drawn(found)
        .into_iter()
        .enumerate()
        .map(|(turn, place)| {
            let law = found.laws[place].law;
            let (on, off, width) = stroke(turn);
            let names: Vec<&str> = found
                .laws
                .iter()
                .filter(|other| other.law.same_force(law) || (lossless(other.law) && lossless(law)))
                .map(|other| other.law.name)
                .collect();
            (line_swatch(BLACK.stroke_width(width), (off > 0).then_some((on, off))), names.join(", "))
        })
        .collect();
    let bar = swatch(|area| {
        area.draw(&PathElement::new(vec![(22, 0), (22, 14)], MEASURED.stroke_width(3)))?;
        area.draw(&Circle::new((22, 7), 4, BLACK.stroke_width(1)))
    });
    entries.push((bar, "a recording, by its momentum, ±2 sd of stated mass and speed".to_owned()));
    entries
}

/// What each law leaves of recordings that took no part, over the noise, as bars.
pub(super) fn held_out(found: &Identification) -> String {
    let rows = found.laws.len() as i32;
    svg((940, (34 * rows + 44) as u32), |area| {
        let most = found.laws.iter().map(|law| law.held_out_rmse_n() / found.noise_n).fold(1.0, f64::max);
        // Rests go from one to hundreds.
        let place = |ratio: f64| 230 + (560.0 * (1.0 + ratio).ln() / (1.0 + most).ln()) as i32;
        let words = |text: String, at: (i32, i32), side: HPos| {
            let style = (FONT, 14).into_font().color(&BLACK).pos(Pos::new(side, VPos::Center));
            area.draw(&Text::new(text, at, style))
        };
        for (row, law) in found.laws.iter().enumerate() {
            let y = 34 * row as i32 + 20;
            let ratio = law.held_out_rmse_n() / found.noise_n;
            let fill = if row == found.chosen { BLACK.filled() } else { RGBColor(165, 165, 165).filled() };
            words(law.law.name.to_owned(), (220, y), HPos::Right)?;
            area.draw(&Rectangle::new([(230, y - 9), (place(ratio), y + 9)], fill))?;
            words(format!("{ratio:.2}"), (place(ratio) + 8, y), HPos::Left)?;
        }
        let foot = 34 * rows + 8;
        area.draw(&PathElement::new(vec![(place(1.0), 4), (place(1.0), foot)], WHITE.stroke_width(3)))?;
        area.draw(&PathElement::new(vec![(place(1.0), 4), (place(1.0), foot)], BLACK.stroke_width(1)))?;
        words("the noise before contact".to_owned(), (place(1.0), foot + 12), HPos::Center)
    })
}

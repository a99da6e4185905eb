//! The recordings as the figures show them: observed, simulated before and after, and what is left of each in units of the noise.

use crate::diagnosis::answer::Answer;
use crate::diagnosis::layout::Role;
use crate::diagnosis::{Diagnosis, locate::Course};

/// One recording, times in ms from the contact of the chosen model.
#[derive(Clone, Debug)]
pub(super) struct Pictured {
    pub(super) name: String,
    /// Speed, mass and configuration, as believed.
    pub(super) conditions: String,
    /// What was observed, in the channel's unit.
    pub(super) observed: Vec<(f64, f64)>,
    /// The re-tuned baseline.
    pub(super) before: Vec<(f64, f64)>,
    /// The chosen model, with the map of what has no name where there is one.
    pub(super) after: Vec<(f64, f64)>,
    /// Observed minus re-tuned baseline, over the noise.
    pub(super) rest_before: Vec<(f64, f64)>,
    /// Observed minus chosen model, over the noise.
    pub(super) rest_after: Vec<(f64, f64)>,
    /// Located places that concern this recording, ms.
    pub(super) shaded: Vec<(f64, f64)>,
    /// What is worth showing, ms.
    pub(super) span: (f64, f64),
    /// Mean square of the rest before, over the span.
    pub(super) misfit: f64,
}

/// All recordings.
pub(super) fn pictured(diagnosis: &Diagnosis, answer: &Answer) -> Vec<Pictured> {
    let problem = &diagnosis.problem;
    let (baseline, best) = (&diagnosis.selection.baseline, &diagnosis.selection.best.fit);
    let noise = problem.channels[0].noise.rms().max(f64::MIN_POSITIVE);
    let contact = best.layout.locals.iter().position(|coordinate| coordinate.role == Role::Contact);
    problem
        .recordings
        .iter()
        .enumerate()
        .map(|(number, recording)| {
            let contact_s = contact.map_or(recording.contact_guess_s, |place| best.point.locals[number][place]);
            let ms: Vec<f64> = recording.times_s.iter().map(|time| 1e3 * (time - contact_s)).collect();
            let line = |values: &mut dyn Iterator<Item = f64>| -> Vec<(f64, f64)> { ms.iter().copied().zip(values).collect() };
            let observed = &recording.series[0];
            let before = &baseline.model[number];
            let added = |place: usize| diagnosis.map.as_ref().map_or(0.0, |map| map.added[number][place]);
            let after: Vec<f64> = (0..ms.len()).map(|place| best.model[number][place] + added(place)).collect();
            let course = Course::of(problem, best, number);
            let lasts = 1e3 * (course.separation_s - course.contact_s).clamp(1e-3, 2.0 * recording.contact_time_s + 1e-3);
            let shaded: Vec<(f64, f64)> = answer
                .places
                .iter()
                .filter(|place| place.recordings.contains(&recording.name))
                .map(|place| (1e3 * place.time_from_contact_s[0], 1e3 * place.time_from_contact_s[1]))
                .collect();
            let first = shaded.iter().map(|(from, _)| *from).fold(-0.2 * lasts, f64::min).max(-0.8 * lasts);
            let last = shaded.iter().map(|(_, to)| *to).fold(1.5 * lasts, f64::max).min(5.0 * lasts);
            let ends = (ms.first().copied().unwrap_or(0.0), ms.last().copied().unwrap_or(1.0));
            let span = (first.max(ends.0), last.min(ends.1));
            let rest_before = line(&mut observed.iter().zip(before).map(|(a, b)| (a - b) / noise));
            let within: Vec<f64> =
                rest_before.iter().filter(|(t, _)| (span.0..=span.1).contains(t)).map(|(_, r)| r * r).collect();
            let configuration = &problem.configurations[recording.configuration];
            Pictured {
                name: recording.name.clone(),
                conditions: format!(
                    "{} m/s, {} kg, configuration {configuration}",
                    crate::decimal::significant(recording.speed.value, 4),
                    crate::decimal::significant(recording.mass.value, 4)
                ),
                before: line(&mut before[..ms.len()].iter().copied()),
                rest_after: line(&mut observed.iter().zip(&after).map(|(a, b)| (a - b) / noise)),
                after: line(&mut after.iter().copied()),
                observed: line(&mut observed.iter().copied()),
                rest_before,
                shaded,
                span,
                misfit: within.iter().sum::<f64>() / within.len().max(1) as f64,
            }
        })
        .collect()
}

//! The recordings as the figures show them: observed, simulated before and after, and what is left of each in units of the noise.

use crate::diagnosis::Diagnosis;
use crate::diagnosis::answer::Answer;
use crate::diagnosis::fit::Fit;
use crate::diagnosis::layout::Point;
use crate::diagnosis::locate::Course;

/// One recording, times in ms from the contact of the chosen model.
#[derive(Clone, Debug)]
pub(super) struct Pictured {
    pub(super) name: String,
    /// Whether what is simulated after has the map of what has no name.
    pub(super) has_map: bool,
    /// Speed, mass and configuration, as believed.
    pub(super) conditions: String,
    /// What was observed, in the channel's unit.
    pub(super) observed: Vec<(f64, f64)>,
    /// The re-tuned baseline.
    pub(super) before: Vec<(f64, f64)>,
    /// The chosen model, with the map of what has no name where there is one.
    pub(super) after: Vec<(f64, f64)>,
    /// Observed minus re-tuned baseline: running means, in standard deviations that the noise gives them.
    pub(super) rest_before: Vec<(f64, f64)>,
    /// Observed minus chosen model, the same.
    pub(super) rest_after: Vec<(f64, f64)>,
    /// Located places that concern this recording, ms.
    pub(super) shaded: Vec<(f64, f64)>,
    /// What is worth showing, ms.
    pub(super) span: (f64, f64),
    /// Mean square of the rest before, over the span.
    pub(super) misfit: f64,
}

/// Running means are over this part of the time shown, so that a form shows through the noise.
const STRETCHES: f64 = 50.0;

/// Means over `width` neighbours, times its root: white noise of unit variance stays so.
fn running_mean(values: &[f64], width: usize) -> Vec<f64> {
    let (left, right) = ((width - 1) / 2, width / 2);
    (0..values.len())
        .map(|place| {
            let stretch = &values[place.saturating_sub(left)..(place + right + 1).min(values.len())];
            stretch.iter().sum::<f64>() / (stretch.len() as f64).sqrt()
        })
        .collect()
}

/// Steps in which the coordinates follow the map; each lowers what is left to do about tenfold.
const STEPS: usize = 4;
/// Parts of a step, of which the first that helps is taken: a tangent may lead astray.
const SHORTER: [f64; 4] = [1.0, 0.5, 0.25, 0.1];

/// What the chosen model shows in each recording, with the map of what has no name where that leaves less.
///
/// The map holds what the coordinates cannot do, and they move along with it: Gauss and Newton's steps with the tangent of the chosen
/// model, on what the map leaves.
pub(super) fn shown_after(diagnosis: &Diagnosis) -> Vec<Vec<f64>> {
    let fit = &diagnosis.selection.best.fit;
    with_map(diagnosis).unwrap_or_else(|| fit.model.clone())
}

fn with_map(diagnosis: &Diagnosis) -> Option<Vec<Vec<f64>>> {
    let map = diagnosis.map.as_ref()?;
    let (problem, selection) = (&diagnosis.problem, &diagnosis.selection);
    let fit = &selection.best.fit;
    let normal = selection.tangent.normal(0.0)?;
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let at = |point: Point| -> Option<Fit> {
        let Fit { layout, point, mut model, .. } = Fit::at(problem, fit.layout.clone(), point, &all)?;
        for (value, added) in model.iter_mut().flatten().zip(map.added.iter().flatten()) {
            *value += added;
        }
        Some(Fit::showing(problem, layout, point, model, &all))
    };
    let mut here = at(fit.point.clone())?;
    for _ in 0..STEPS {
        let (global, locals) = here.gradients(problem, &selection.tangent, &all);
        let step = normal.solve(&global, &locals);
        let mut shorter = SHORTER.into_iter().filter_map(|part| at(fit.layout.moved(&here.point, &step, part)));
        let Some(better) = shorter.find(|there| there.cost < here.cost) else { break };
        here = better;
    }
    (here.cost < fit.cost).then_some(here.model)
}

/// All recordings.
pub(super) fn pictured(diagnosis: &Diagnosis, answer: &Answer, shown: &[Vec<f64>]) -> Vec<Pictured> {
    let problem = &diagnosis.problem;
    let (baseline, best) = (&diagnosis.selection.baseline, &diagnosis.selection.best.fit);
    problem
        .recordings
        .iter()
        .enumerate()
        .map(|(number, recording)| {
            let contact_s = best.layout.contact_s(problem, &best.point, number);
            let ms: Vec<f64> = recording.times_s.iter().map(|time| 1e3 * (time - contact_s)).collect();
            let line =
                |values: &mut dyn Iterator<Item = f64>| -> Vec<(f64, f64)> { ms.iter().copied().zip(values).collect() };
            let observed = &recording.series[0];
            let before = &baseline.model[number];
            let after = &shown[number][..ms.len()];
            let course = Course::of(problem, best, number);
            let lasts =
                1e3 * (course.separation_s - course.contact_s).clamp(1e-3, 2.0 * problem.eventful_s(number) + 1e-3);
            let shaded: Vec<(f64, f64)> = answer
                .places
                .iter()
                .filter(|place| place.recordings.contains(&recording.name))
                .map(|place| (1e3 * place.time_from_contact_s[0], 1e3 * place.time_from_contact_s[1]))
                .collect();
            let first = shaded.iter().map(|(from, _)| *from).fold(-0.2 * lasts, f64::min).max(-0.8 * lasts);
            let last = shaded.iter().map(|(_, to)| *to).fold(1.5 * lasts, f64::max).min(3.0 * lasts);
            let ends = (ms.first().copied().unwrap_or(0.0), ms.last().copied().unwrap_or(1.0));
            let span = (first.max(ends.0), last.min(ends.1));
            let interval = (ends.1 - ends.0) / (ms.len() - 1).max(1) as f64;
            let width = ((span.1 - span.0) / STRETCHES / interval.max(1e-9)).round().max(1.0) as usize;
            let noise = recording.noise[0].rms().max(f64::MIN_POSITIVE);
            let rest = |model: &[f64]| {
                let rest: Vec<f64> = observed.iter().zip(model).map(|(a, b)| (a - b) / noise).collect();
                line(&mut running_mean(&rest, width).into_iter())
            };
            let rest_before = rest(before);
            let within: Vec<f64> =
                rest_before.iter().filter(|(t, _)| (span.0..=span.1).contains(t)).map(|(_, r)| r * r).collect();
            let configuration = &problem.configurations[recording.configuration];
            Pictured {
                name: recording.name.clone(),
                has_map: shown[number] != best.model[number],
                conditions: format!(
                    "{} m/s, {} kg, configuration {configuration}",
                    crate::decimal::significant(recording.speed.value, 4),
                    crate::decimal::significant(recording.mass.value, 4)
                ),
                before: line(&mut before[..ms.len()].iter().copied()),
                rest_after: rest(after),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_mean_keeps_the_noise_and_raises_a_form() {
        assert_eq!(running_mean(&[1.0; 9], 4)[4], 2.0);
        assert_eq!(running_mean(&[3.0, -1.0], 1), [3.0, -1.0]);
        // At the ends fewer neighbours are there, and count as what they are.
        assert!((running_mean(&[1.0; 9], 9)[0] - 5.0_f64.sqrt()).abs() < 1e-12);
    }
}

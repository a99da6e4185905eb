//! What re-tuning made of the experimenter's beliefs: the rig's stiffnesses and the configurations' masses as stated, in the re-tuned
//! baseline, and in the chosen model. The difference of the last two is what the baseline misread to hide what was left out.

use super::answer::Value;
use super::fit::{Fit, Tangent};
use super::layout::{Coordinate, Role};
use super::problem::Problem;
use super::select::Selection;
use super::{Diagnosis, Note, words};
use crate::campaign::Estimate;

/// Two-sided 95 % of a normal distribution.
const DEVIATIONS_95: f64 = 1.959_964;

/// A channel's delay is worth a word from so many samples on, and from so many of its deviations.
const LEAST_DELAY: f64 = 0.05;
const DELAYED: f64 = 5.0;

/// One belief.
#[derive(Clone, Debug, PartialEq)]
pub struct Retuned {
    /// What it is about.
    pub role: Role,
    /// Its name with the unit, as a campaign writes it; for a mass the ratio to the stated one.
    pub name: String,
    /// Its name for people.
    pub label: String,
    /// Unit's symbol.
    pub unit: &'static str,
    /// As stated.
    pub stated: Estimate,
    /// In the re-tuned baseline.
    pub baseline: Estimate,
    /// In the chosen model.
    pub model: Estimate,
}

impl Retuned {
    /// By how many of its own stated deviations the baseline moved it.
    #[must_use]
    pub fn moved(&self) -> f64 {
        if self.stated.sd > 0.0 { (self.baseline.value - self.stated.value) / self.stated.sd } else { 0.0 }
    }

    /// By how many of its stated deviations the chosen model is away from it, as factors go.
    #[must_use]
    pub fn strayed(&self) -> f64 {
        (self.model.value / self.stated.value).ln() * self.stated.value / self.stated.sd
    }

    /// By which part the baseline reads it higher than the chosen model.
    #[must_use]
    pub fn misread(&self) -> f64 {
        self.baseline.value / self.model.value - 1.0
    }

    /// In the re-tuned baseline, with its 95 % interval.
    #[must_use]
    pub fn baseline_value(&self) -> Value {
        let Estimate { value, sd } = self.baseline;
        let half = DEVIATIONS_95 * sd / value;
        Value {
            name: self.name.clone(),
            unit: self.unit.to_owned(),
            value,
            low: value * (-half).exp(),
            high: value * half.exp(),
        }
    }
}

/// All of them: body, pad, then the configurations.
#[must_use]
pub fn retuned(diagnosis: &Diagnosis) -> Vec<Retuned> {
    let selection = &diagnosis.selection;
    let problem = &diagnosis.problem;
    let in_baseline = globals(&selection.baseline, &selection.baseline_tangent);
    let in_model = globals(&selection.best.fit, &selection.tangent);
    in_baseline
        .iter()
        .filter_map(|(role, ratio)| {
            let (_, model) = in_model.iter().find(|(other, _)| other == role)?;
            let scaled = |by: f64, ratio: &Estimate| Estimate::new(by * ratio.value, by * ratio.sd);
            let (name, label, unit, stated) = match role {
                Role::Body => (
                    "body_stiffness_N_per_m".to_owned(),
                    "body springs' stiffness".to_owned(),
                    "N/m",
                    problem.rig.body_stiffness_n_per_m?,
                ),
                Role::Pad => (
                    "pad_stiffness_N_per_m".to_owned(),
                    "pad's stiffness".to_owned(),
                    "N/m",
                    problem.rig.pad_stiffness_n_per_m?,
                ),
                Role::Mass(number) => {
                    let configuration = &problem.configurations[*number];
                    (
                        format!("effective_mass_ratio[{configuration}]"),
                        format!("mass in configuration {configuration}"),
                        "1",
                        Estimate::new(1.0, problem.mass_sd[*number]),
                    )
                }
                _ => return None,
            };
            let by = stated.value;
            Some(Retuned {
                role: *role,
                name,
                label,
                unit,
                stated,
                baseline: scaled(by, ratio),
                model: scaled(by, model),
            })
        })
        .collect()
}

/// A note on each further channel that is read at other instants than the observed one, as far as the recordings tell.
#[must_use]
pub fn delays(problem: &Problem, selection: &Selection) -> Vec<Note> {
    let fit = &selection.best.fit;
    let told = |(place, coordinate): (usize, &Coordinate)| {
        let Role::Delay(channel) = coordinate.role else { return None };
        let (samples, sd) = (fit.point.globals[place], selection.deviations.as_ref()?[place]);
        let sample_ms = 1e3 * problem.recordings[0].sample_s;
        (samples.abs() > LEAST_DELAY.max(DELAYED * sd)).then(|| {
            Note::general(&format!(
                "`{}` is read {} ms {} than `{}` ({} samples): one of the two has come through a filter that the other has not, or through another \
                 instrument; the diagnosis has allowed for it",
                problem.channels[channel].column,
                words::short(samples.abs() * sample_ms),
                if samples > 0.0 { "later" } else { "sooner" },
                problem.channels[0].column,
                words::short(samples.abs()),
            ))
        })
    };
    fit.layout.globals.iter().enumerate().filter_map(told).collect()
}

/// Ratios of the rig's global coordinates to what is stated, with posterior deviations.
fn globals(fit: &Fit, tangent: &Tangent) -> Vec<(Role, Estimate)> {
    let deviations = tangent.deviations();
    fit.layout.globals[..fit.layout.of_rig]
        .iter()
        .enumerate()
        .map(|(place, coordinate)| {
            let ratio = fit.point.globals[place].exp();
            let sd = deviations.as_ref().map_or(f64::NAN, |deviations| deviations[place]);
            (coordinate.role, Estimate::new(ratio, ratio * sd))
        })
        .collect()
}

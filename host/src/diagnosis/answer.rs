//! The answer as the contract has it: `thud-diagnosis/1`.

use nalgebra::DVector;
use serde::Serialize;
use thud_sim::mechanism::{Effect, Parameter, Scale, Search};

use super::held_out::{pooled, rmse};
use super::layout::{Entrant, Role, Scope, coordinate_of, value_of};
use super::locate::locate;
use super::predict;
use super::retuned::{Retuned, retuned};
use super::select::Selection;
use super::verdict::{Verdict, is_of_another_rig, leaves_nothing, rest_share, twins};
use super::words;
use super::{Diagnosis, Note};

/// What the `format` key says.
pub const FORMAT: &str = "thud-diagnosis/1";
/// What the `format` key of an evaluation says.
pub const FORMAT_EVALUATION: &str = "thud-evaluation/1";
/// How far a parameter may be off because no rig is quite like an equation, relative: what the parameters of 50 cases of the concealing
/// simulator, whose equations are others, were off by beyond noise.
const EQUATIONS: f64 = 0.1;
/// A strength whose logarithm deviates by more is not told from none.
const UNTOLD: f64 = 1.0;
/// Two-sided 95 % of a normal distribution.
const DEVIATIONS_95: f64 = 1.959_964;

/// The whole answer.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys")]
pub struct Answer {
    pub format: &'static str,
    pub verdict: &'static str,
    pub baseline: Baseline,
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    pub mechanisms: Vec<Named>,
    pub model: ModelFit,
    pub rejected: Vec<Rejected>,
    pub unexplained: Unexplained,
    pub advice: Vec<String>,
}

/// A place where the re-tuned baseline and the recordings differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, non_snake_case, reason = "the contract's own keys")]
pub struct Place {
    pub phase: &'static str,
    pub time_from_contact_s: [f64; 2],
    pub frequency_Hz: [f64; 2],
    pub recordings: Vec<String>,
    pub depends_on: Vec<&'static str>,
    pub share: f64,
    pub p_value: f64,
}

/// What is left that no mechanism explains.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys")]
pub struct Unexplained {
    pub share: f64,
    pub depends_on: Vec<&'static str>,
    pub form: String,
    pub held_out_rmse: f64,
}

/// How the standard's own simulation does.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys")]
pub struct Baseline {
    pub nominal_rmse: f64,
    pub retuned_rmse: f64,
    pub held_out_rmse: f64,
    pub noise_rms: f64,
    pub parameters: Vec<Value>,
}

/// A number with its interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys")]
pub struct Value {
    pub name: String,
    pub unit: String,
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// A mechanism that was found.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys")]
pub struct Named {
    pub id: &'static str,
    pub parameters: Vec<Value>,
    pub held_out_gain: f64,
    pub indistinguishable_from: Vec<&'static str>,
    pub because: String,
}

/// How the final model does.
#[derive(Clone, Debug, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys")]
pub struct ModelFit {
    pub rmse: f64,
    pub held_out_rmse: f64,
    pub noise_ratio: f64,
    pub residual_is_white: bool,
}

/// A mechanism that was tried and not taken.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys")]
pub struct Rejected {
    pub id: String,
    pub because: String,
}

/// Everything said.
#[must_use]
pub fn answer(diagnosis: &Diagnosis) -> Answer {
    let problem = &diagnosis.problem;
    let selection = &diagnosis.selection;
    let raw_rmse = |fit: &super::fit::Fit| {
        let each: Vec<f64> = (0..problem.recordings.len())
            .map(|number| {
                predict::raw(problem, &fit.layout, &fit.point, number)
                    .map_or(f64::NAN, |model| rmse(&problem.recordings[number].raw.values, &model))
            })
            .collect();
        pooled(problem, &each)
    };
    let noise = problem.noise_rms();
    let model_rmse = raw_rmse(&selection.best.fit);
    let held_out = diagnosis.held_out.overall(problem);
    Answer {
        format: FORMAT,
        verdict: Verdict::of(selection).word(),
        baseline: Baseline {
            nominal_rmse: raw_rmse(&diagnosis.nominal),
            retuned_rmse: raw_rmse(&selection.baseline),
            held_out_rmse: diagnosis.baseline_held_out.overall(problem),
            noise_rms: noise,
            parameters: retuned(diagnosis).iter().map(Retuned::baseline_value).collect(),
        },
        places: locate(problem, &diagnosis.located),
        mechanisms: (0..selection.best.fit.layout.entrants.len())
            .map(|place| {
                let entrant = &selection.best.fit.layout.entrants[place];
                Named {
                    id: entrant.effect.mechanism().id,
                    parameters: parameters(diagnosis, place)
                        .into_iter()
                        .filter(|value| takes_part(value, entrant))
                        .collect(),
                    held_out_gain: diagnosis.baseline_held_out.overall(problem) - held_out,
                    indistinguishable_from: twins(selection, place).into_iter().map(|(id, _)| id).collect(),
                    because: words::because(diagnosis, place),
                }
            })
            .collect(),
        model: ModelFit {
            rmse: model_rmse,
            held_out_rmse: held_out,
            noise_ratio: model_rmse / noise,
            residual_is_white: leaves_nothing(selection),
        },
        rejected: words::rejected(diagnosis),
        unexplained: unexplained(diagnosis, held_out),
        advice: super::advice::advice(problem, selection),
    }
}

impl Answer {
    /// The same for whoever has neither page nor terminal: what was odd, with its remedy, is advice too.
    #[must_use]
    pub fn with_notes(&self, notes: &[Note]) -> Self {
        let advice = self.advice.iter().cloned().chain(notes.iter().map(Note::to_string)).collect();
        Self { advice, ..self.clone() }
    }
}

/// What is left beyond the chosen model. The map's gain on recordings left out is known at the thinned samples, where the noise is less; the
/// noise itself it cannot lower, so that the same mean square goes off at the full rate.
fn unexplained(diagnosis: &Diagnosis, held_out_rmse: f64) -> Unexplained {
    let Some(map) = &diagnosis.map else {
        return Unexplained { held_out_rmse, ..Unexplained::default() };
    };
    let selection = &diagnosis.selection;
    let places = locate(&diagnosis.problem, &selection.best.fit);
    let (without, with) = map.held_out_square;
    let lower = (held_out_rmse.powi(2) - (without - with)).max(0.0).sqrt();
    let mut depends_on: Vec<&'static str> = places.iter().flat_map(|place| place.depends_on.clone()).collect();
    depends_on.sort_unstable();
    depends_on.dedup();
    let hum = selection.hum;
    let hums = hum.is_there() && hum.excess > selection.rest.excess.max(selection.oddity.excess);
    Unexplained {
        share: rest_share(selection),
        depends_on,
        form: if hums {
            format!("a line at {} Hz that is there before contact, too", hum.hz)
        } else {
            another_rig(diagnosis).unwrap_or_else(|| map.form.clone())
        },
        held_out_rmse: lower.max(diagnosis.problem.noise_rms() * 0.9),
    }
}

/// What is stated of the rig that the chosen model contradicts most, where it cannot do without.
fn another_rig(diagnosis: &Diagnosis) -> Option<String> {
    let beliefs = is_of_another_rig(&diagnosis.selection).then(|| retuned(diagnosis))?;
    let layout = &diagnosis.selection.best.fit.layout;
    let held = beliefs.iter().filter(|belief| layout.holds_stated(belief.role));
    let farthest = held.max_by(|a, b| a.strayed().abs().total_cmp(&b.strayed().abs()))?;
    let off = farthest.model.value / farthest.stated.value - 1.0;
    Some(format!(
        "the model asks for the {} {:.0} % {}, {:.0} of its stated deviations",
        farthest.label,
        100.0 * off.abs(),
        if off > 0.0 { "higher than stated" } else { "lower than stated" },
        farthest.strayed().abs()
    ))
}

/// A mechanism's parameters in the chosen model: intervals from the curvature of χ² and from what the equations lack. What is likely of
/// any rig chooses among shapes that the recordings do not tell apart; an interval is to say that they do not.
#[must_use]
pub fn parameters(diagnosis: &Diagnosis, place: usize) -> Vec<Value> {
    let (problem, fit) = (&diagnosis.problem, &diagnosis.selection.best.fit);
    let told = |effect: &Effect, configuration| {
        within(diagnosis, place, effect, configuration, diagnosis.selection.told_deviations.as_ref(), EQUATIONS)
    };
    if let Scope::EachRecording(some) = fit.layout.entrants[place].scope {
        let own = some.iter().flat_map(|recording| of_recording(diagnosis, place, recording));
        let entrant = &fit.layout.entrants[place];
        let all = told(&fit.layout.effect(problem, place, &fit.point), 0).into_iter().enumerate();
        let shared = all.filter(|(number, _)| !entrant.is_own(*number)).map(|(_, value)| value);
        return own.chain(shared).collect();
    }
    if fit.layout.entrants[place].scope != Scope::EachConfiguration {
        return told(&fit.layout.effect(problem, place, &fit.point), 0);
    }
    let in_each: Vec<Vec<Value>> = (0..problem.configurations.len())
        .map(|number| told(&fit.layout.effect_in(problem, place, &fit.point, number), number))
        .collect();
    let entrant = &fit.layout.entrants[place];
    let of_parameter = |number: usize| -> Vec<Value> {
        if !entrant.is_by_configuration(number) {
            return in_each.first().map(|values| values[number].clone()).into_iter().collect();
        }
        let named = |(values, name): (&Vec<Value>, &String)| {
            let value = values[number].clone();
            Value { name: format!("{}[{name}]", value.name), ..value }
        };
        in_each.iter().zip(&problem.configurations).map(named).collect()
    };
    (0..entrant.effect.mechanism().parameters.len()).flat_map(of_parameter).collect()
}

/// Whether a value does anything: of what happens again there is an instant only where it does.
fn takes_part(value: &Value, entrant: &Entrant) -> bool {
    let known = entrant.effect.mechanism().parameter(&value.name);
    known.map_or(true, |(place, _)| entrant.effect.takes_part(place))
}

/// What a recording has of its own of a mechanism, with the interval that its noise and what is stated of it leave.
fn of_recording(diagnosis: &Diagnosis, place: usize, recording: usize) -> Vec<Value> {
    let (problem, Selection { best, tangent, .. }) = (&diagnosis.problem, &diagnosis.selection);
    let layout = &best.fit.layout;
    let entrant = &layout.entrants[place];
    let effect = layout.effect_at(problem, place, &best.fit.point, recording);
    let parameters = effect.mechanism().parameters.iter().enumerate();
    let own = parameters.filter(|(number, _)| entrant.is_by_recording(*number));
    own.map(|(number, parameter)| {
        let role = Role::Mechanism { entrant: place, place: number };
        let local = layout.locals.iter().position(|coordinate| coordinate.role == role);
        let deviation = local.and_then(|local| tangent.local_deviation(recording, local)).unwrap_or(0.0);
        let value = effect.value(number);
        let (low, high) = interval(parameter, value, deviation, EQUATIONS);
        let name = format!("{}[{}]", parameter.name, problem.recordings[recording].name);
        Value { name, unit: parameter.unit.to_owned(), value, low, high }
    })
    .collect()
}

/// The same in one configuration, with what noise alone leaves open: for recordings of the same rig, for which the equations are wrong in the
/// same way.
#[must_use]
pub fn parameters_by_noise(diagnosis: &Diagnosis, place: usize, effect: &Effect, configuration: usize) -> Vec<Value> {
    within(diagnosis, place, effect, configuration, diagnosis.selection.deviations.as_ref(), 0.0)
}

/// In one configuration; `equations`: relative deviation from what the equations lack.
fn within(
    diagnosis: &Diagnosis,
    place: usize,
    effect: &Effect,
    configuration: usize,
    deviations: Option<&DVector<f64>>,
    equations: f64,
) -> Vec<Value> {
    let fit = &diagnosis.selection.best.fit;
    effect
        .mechanism()
        .parameters
        .iter()
        .enumerate()
        .map(|(number, parameter)| {
            let value = effect.value(number);
            let role = fit.layout.role_in(place, number, configuration);
            let global = fit.layout.globals.iter().position(|coordinate| coordinate.role == role);
            let told = global.zip(deviations).map(|(global, deviations)| {
                // A line is counted, period by period, whatever the equation.
                let counted = parameter.search == Search::OfLines;
                interval(parameter, value, deviations[global], if counted { 0.0 } else { equations })
            });
            let (low, high) = told.unwrap_or((value, value));
            Value { name: parameter.name.to_owned(), unit: parameter.unit.to_owned(), value, low, high }
        })
        .collect()
}

/// The 95 % interval of a value, given the deviation of its coordinate and the relative one from what the equations lack. A strength that is not told from
/// none is as uncertain as what it does, not as its logarithm: a golf ball's drag is anything up to some value.
fn interval(parameter: &Parameter, value: f64, deviation: f64, equations: f64) -> (f64, f64) {
    let here = coordinate_of(parameter, value);
    let equations = match parameter.scale {
        Scale::Logarithmic => equations,
        Scale::Linear => equations * value.abs(),
    };
    let half = DEVIATIONS_95 * deviation.hypot(equations);
    if parameter.scale == Scale::Logarithmic && parameter.null == Some(0.0) && deviation > UNTOLD {
        return (0.0, (value * (1.0 + half)).min(parameter.range.1));
    }
    (value_of(parameter, here - half), value_of(parameter, here + half))
}

#[cfg(test)]
mod tests {
    use thud_sim::mechanism::Mechanism;

    use super::*;

    #[test]
    fn a_strength_that_is_not_told_from_none_has_an_interval_from_none() {
        let drag = &Mechanism::find("air-drag").unwrap().parameters[0];
        let (low, high) = interval(drag, 1e-3, 0.1, 0.0);
        assert!((low * high / 1e-6 - 1.0).abs() < 1e-9 && high > 1.2e-3, "{low} {high}");
        let (low, high) = interval(drag, 1e-7, 300.0, EQUATIONS);
        assert!(low == 0.0 && (high / 1e-7 - 589.0).abs() < 0.1, "{low} {high}");
    }
}

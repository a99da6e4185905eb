//! The page's tables: places, parameters, beliefs, recordings left out, and every mechanism with the evidence on it.

use maud::{Markup, html};
use thud_sim::mechanism::Parameter;

use crate::campaign::Estimate;
use crate::diagnosis::answer::{Answer, Named, Value};
use crate::diagnosis::evidence::{Evidence, Standing};
use crate::diagnosis::fit::Fit;
use crate::diagnosis::layout::Entrant;
use crate::diagnosis::retuned::retuned;
use crate::diagnosis::words::{self, listed, p_words, percent, short};
use crate::diagnosis::{Diagnosis, RigKind};

/// Where the re-tuned simulation fails.
pub(super) fn places(diagnosis: &Diagnosis, answer: &Answer) -> Markup {
    html! {
        table {
            thead { tr {
                th { "phase" }
                th.number { "ms from contact" }
                th.number { "Hz" }
                th { "recordings" }
                th { "goes with" }
                th.number { "share of the misfit" }
                th.number { "p" }
            } }
            tbody {
                @for place in &answer.places {
                    tr {
                        td { (words::phase(diagnosis, place.phase)) }
                        td.number { (format!("{:.1} to {:.1}", 1e3 * place.time_from_contact_s[0], 1e3 * place.time_from_contact_s[1])) }
                        td.number { (format!("{:.0} to {:.0}", place.frequency_Hz[0], place.frequency_Hz[1])) }
                        td { (words::which(diagnosis, &place.recordings)) }
                        td { (place.depends_on.join(", ")) }
                        td.number { (percent(place.share)) }
                        td.number { (p_words(place.p_value).replace("p = ", "").replace("p < ", "< ")) }
                    }
                }
            }
        }
    }
}

/// A mechanism that was found.
pub(super) fn named(diagnosis: &Diagnosis, place: usize, named: &Named) -> Markup {
    let entrant = &diagnosis.selection.best.fit.layout.entrants[place];
    let mechanism = entrant.effect.mechanism();
    let scope = crate::diagnosis::evidence::scope_words(diagnosis, entrant.scope);
    // A value of its own has the configuration or recording behind the name.
    let parameter_of = |value: &Value| {
        let name = value.name.split('[').next();
        mechanism.parameters.iter().find(|parameter| Some(parameter.name) == name)
    };
    let twins: Vec<String> = named.indistinguishable_from.iter().map(|id| (*id).to_owned()).collect();
    html! {
        h3 { (named.id) @if !scope.is_empty() { ", " (scope) } }
        p.equation { (mechanism.equation) }
        table {
            thead { tr { th { "parameter" } th { "meaning" } th.number { "value" } th.number { "95 % interval" } th { "unit" } th.number { "usual" } } }
            tbody {
                @for value in &named.parameters {
                    @let parameter = parameter_of(value);
                    tr {
                        td { (value.name) }
                        td { @if let Some(parameter) = parameter { (parameter.meaning) } }
                        @let (here, low, high) = words::with_interval(value.value, value.low, value.high);
                        td.number { (here) }
                        td.number {
                            @if parameter.is_some_and(Parameter::is_of_each_impact) { "each its own" }
                            @else if value.low == value.high { "held" }
                            @else { (low) " to " (high) }
                        }
                        td { (value.unit) }
                        td.number {
                            @if let Some(Parameter { plausible: (low, high), .. }) = parameter { (short(*low)) " to " (short(*high)) }
                        }
                    }
                }
            }
        }
        dl {
            @for (name, values) in of_each_impact(diagnosis, place) {
                dt { (name) } dd { (values) "." }
            }
            dt { "evidence" } dd { (named.because) "." }
            dt { "it shows as" } dd { (mechanism.signature) "." }
            @if !twins.is_empty() {
                dt { "not told from" }
                dd { strong { (listed(&twins, "or")) } ". What separates them: " (mechanism.separated_by) "." }
            }
            dt { "source" } dd { (mechanism.source) "." }
        }
    }
}

/// What a mechanism has for each impact alone: its name, and the value in each recording in which it acts.
fn of_each_impact(diagnosis: &Diagnosis, place: usize) -> Vec<(&'static str, String)> {
    let problem = &diagnosis.problem;
    let Fit { layout, point, .. } = &diagnosis.selection.best.fit;
    let Entrant { effect, scope, .. } = &layout.entrants[place];
    let parameters = effect.mechanism().parameters.iter().enumerate();
    let of = |number: usize, parameter: &Parameter| {
        let recordings = problem.recordings.iter().enumerate();
        let values = recordings.filter(|(index, recording)| scope.includes(*index, recording.configuration)).map(
            |(index, recording)| {
                let value = layout.effect_at(problem, place, point, index).value(number);
                let never = parameter.is_instant() && !recording.shows(value);
                let value = if never { "never".to_owned() } else { format!("{} {}", short(value), parameter.unit) };
                format!("{value} in {}", recording.name)
            },
        );
        (parameter.name, values.collect::<Vec<_>>().join(", "))
    };
    parameters.filter(|(number, _)| effect.is_own(*number)).map(|(number, parameter)| of(number, parameter)).collect()
}

/// How the fit improves.
pub(super) fn overall(diagnosis: &Diagnosis, answer: &Answer) -> Markup {
    let unit = words::unit(diagnosis);
    let noise = answer.baseline.noise_rms;
    let mut rows: Vec<(&str, f64, &str)> = vec![
        ("simulation as stated", answer.baseline.nominal_rmse, "only instants of contact and zeros fitted"),
        ("simulation, re-tuned", answer.baseline.retuned_rmse, "fitted to all recordings"),
        ("simulation, re-tuned, held out", answer.baseline.held_out_rmse, "on recordings that took no part"),
    ];
    if !answer.mechanisms.is_empty() {
        rows.push(("with what was found", answer.model.rmse, "fitted to all recordings"));
        rows.push(("with what was found, held out", answer.model.held_out_rmse, "on recordings that took no part"));
    }
    if answer.verdict == "unexplained" {
        rows.push((
            "and a map of what has no name, held out",
            answer.unexplained.held_out_rmse,
            "a smooth map over stroke, rate and time; it holds where the recordings have been, not beyond",
        ));
    }
    let most = rows.iter().map(|(_, rmse, _)| *rmse).fold(noise, f64::max);
    html! {
        table {
            thead { tr { th { "" } th.number { "rmse, " (unit) } th.number { "÷ noise" } th { "" } th { "" } } }
            tbody {
                @for (name, rmse, how) in &rows {
                    tr {
                        td { (name) }
                        td.number { (words::beside(*rmse, noise)) }
                        td.number { (format!("{:.2}", rmse / noise)) }
                        td.bars { (bar(rmse / most)) }
                        td { (how) }
                    }
                }
                tr {
                    td { "noise before contact" } td.number { (words::beside(noise, noise)) } td.number { "1.00" } td.bars { (bar(noise / most)) }
                    td { "as good as can be" }
                }
            }
        }
    }
}

/// Each recording, when it took no part.
pub(super) fn left_out(diagnosis: &Diagnosis) -> Markup {
    let problem = &diagnosis.problem;
    let noise = problem.noise_rms();
    let unit = words::unit(diagnosis);
    html! {
        table {
            thead { tr {
                th { "recording" } th.number { "speed, m/s" } th.number { "mass, kg" } th { "configuration" }
                th.number { "before, " (unit) } th.number { "÷ noise" } th.number { "after, " (unit) } th.number { "÷ noise" }
            } }
            tbody {
                @for (number, recording) in problem.recordings.iter().enumerate() {
                    @let (before, after) = (diagnosis.baseline_held_out.rmse[number], diagnosis.held_out.rmse[number]);
                    @let noise = recording.raw.quiet_rms.unwrap_or(noise);
                    tr {
                        td { (recording.name) }
                        td.number { (short(recording.speed.value)) }
                        td.number { (short(recording.mass.value)) }
                        td { (problem.configurations[recording.configuration]) }
                        td.number { (words::beside(before, noise)) }
                        td.number { (format!("{:.2}", before / noise)) }
                        td.number { (words::beside(after, noise)) }
                        td.number { (format!("{:.2}", after / noise)) }
                    }
                }
            }
        }
    }
}

/// What was believed, and what re-tuning made of it.
pub(super) fn beliefs(diagnosis: &Diagnosis) -> Markup {
    let entered = !diagnosis.selection.best.fit.layout.entrants.is_empty();
    let both = |estimate: Estimate| {
        let (value, _, high) =
            words::with_interval(estimate.value, estimate.value - estimate.sd, estimate.value + estimate.sd);
        let decimals = high.split_once('.').map_or(0, |(_, digits)| digits.len());
        format!("{value} ± {:.decimals$}", estimate.sd)
    };
    html! {
        table {
            thead { tr {
                th { "" } th.number { "stated" } th.number { "re-tuned" } th.number { "moved by, stated sd" }
                @if entered { th.number { "with what was found" } th.number { "the simulation reads it" } }
                th { "unit" }
            } }
            tbody {
                @for belief in retuned(diagnosis) {
                    tr {
                        td { (belief.label) @if belief.unit == "1" { " ÷ stated" } }
                        td.number { (both(belief.stated)) }
                        td.number { (both(belief.baseline)) }
                        td.number { (format!("{:+.1}", belief.moved())) }
                        @if entered {
                            td.number { (both(belief.model)) }
                            td.number {
                                (percent(belief.misread().abs())) @if belief.misread() >= 0.0 { " high" } @else { " low" }
                            }
                        }
                        td { (belief.unit) }
                    }
                }
            }
        }
        p { "± is one standard deviation." }
        @if let Some(sentence) = words::misread(diagnosis) { p { "That is to say: " (sentence) "." } }
    }
}

/// Every mechanism that was tried.
pub(super) fn ranking(diagnosis: &Diagnosis, all: &[Evidence]) -> Markup {
    let score = |evidence: &Evidence| evidence.score.unwrap_or(0.0).max(0.0);
    let most = all.iter().map(score).fold(5.5, f64::max);
    // Scores go from one to hundreds.
    let part = |value: f64| (1.0 + value).ln() / (1.0 + most).ln();
    let rank = |evidence: &Evidence| match evidence.standing {
        Standing::Named(_) => "found",
        Standing::Twin(_) => "not told apart",
        Standing::Rejected => "rejected",
    };
    html! {
        table.ranking {
            thead { tr {
                th { "mechanism" } th { "" } th.number { "score" } th { "" } th.number { "hidden" } th.number { "BIC behind" } th { "for or against it" }
            } }
            tbody {
                @for evidence in all {
                    tr class=(if evidence.standing == Standing::Rejected { "rejected" } else { "taken" }) {
                        td { (evidence.mechanism.id) }
                        td { (rank(evidence)) }
                        td.number { @match evidence.score { Some(score) => { (format!("{score:.1}")) } None => { "–" } } }
                        td.bars { (bar(part(score(evidence)))) }
                        td.number { @match evidence.absorbed { Some(absorbed) => { (percent(absorbed)) } None => { "–" } } }
                        td.number { @match evidence.contest { Some(contest) => { (format!("{:.0}", contest.bic)) } None => { "" } } }
                        td {
                            @match &evidence.standing {
                                Standing::Named(place) => { (words::because(diagnosis, *place)) }
                                Standing::Twin(id) => { "fits as well as " (id) " in these recordings" }
                                Standing::Rejected => { (words::against(evidence)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// What was looked at.
pub(super) fn facts(diagnosis: &Diagnosis) -> Vec<(&'static str, String)> {
    let problem = &diagnosis.problem;
    let span = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if (high - low).abs() < 1e-9 * high.abs() { short(low) } else { format!("{} to {}", short(low), short(high)) }
    };
    let kind = match problem.rig.kind {
        RigKind::Impact => "a robot runs into the rig",
        RigKind::Drop => "a mass falls on the rig",
        RigKind::Fall => "free fall",
    };
    let channels: Vec<String> = problem.channels.iter().map(|channel| channel.column.clone()).collect();
    let configurations = problem.configurations.len();
    vec![
        ("experiment", kind.to_owned()),
        (
            "recordings",
            format!(
                "{}, in {configurations} configuration{}",
                problem.recordings.len(),
                if configurations == 1 { "" } else { "s" }
            ),
        ),
        ("speeds", format!("{} m/s", span(&mut problem.recordings.iter().map(|r| r.speed.value)))),
        ("masses", format!("{} kg", span(&mut problem.recordings.iter().map(|r| r.mass.value)))),
        ("observed", channels.join(", ")),
        ("noise before contact", format!("{} {} rms", short(problem.noise_rms()), words::unit(diagnosis))),
        ("mechanisms tried", diagnosis.tried.len().to_string()),
    ]
}

/// A bar of this part of its column's width.
fn bar(part: f64) -> Markup {
    let width = format!("{:.1}%", 100.0 * part.clamp(0.0, 1.0));
    html! { div.bar style={ "width:" (width) } {} }
}

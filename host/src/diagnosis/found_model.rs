//! What was found, as a model file that `thud simulate --model` runs and `thud evaluate` judges.
//!
//! The rig has the stiffnesses of the chosen model with their posterior deviations, each mechanism its values with the 95 %
//! intervals that noise leaves: the next recordings of this rig are compared with them.
//! What belongs to single recordings (speeds, phases, instants) is not the rig's and is not in it; a comment says so where it matters.

use std::fmt::Write as _;

use super::Diagnosis;
use super::answer::parameters_by_noise;
use super::layout::Scope;
use super::retuned::retuned;
use crate::campaign::Estimate;
use crate::model::{Interval, Model, ModelMechanism};

/// The chosen model.
#[must_use]
pub fn found_model(diagnosis: &Diagnosis, name: &str) -> Model {
    let problem = &diagnosis.problem;
    let fit = &diagnosis.selection.best.fit;
    let mut rig = problem.rig.clone();
    for belief in retuned(diagnosis) {
        let found = Some(Estimate::new(belief.model.value, belief.model.sd));
        match belief.name.as_str() {
            "body_stiffness_N_per_m" => rig.body_stiffness_n_per_m = found,
            "pad_stiffness_N_per_m" => rig.pad_stiffness_n_per_m = found,
            _ => {}
        }
    }
    let mechanisms = fit
        .layout
        .entrants
        .iter()
        .enumerate()
        .flat_map(|(place, entrant)| {
            let configurations = match entrant.scope {
                Scope::EachConfiguration => (0..problem.configurations.len()).map(Some).collect(),
                _ => vec![None],
            };
            configurations.into_iter().map(move |configuration| (place, entrant, configuration))
        })
        .map(|(place, entrant, configuration)| {
            let effect = match configuration {
                Some(configuration) => fit.layout.effect_in(problem, place, &fit.point, configuration),
                None => fit.layout.effect(problem, place, &fit.point),
            };
            let number_of_it = configuration.unwrap_or(0);
            let intervals = parameters_by_noise(diagnosis, place, &effect, number_of_it)
                .iter()
                .zip(effect.mechanism().parameters)
                .enumerate()
                .map(|(number, (value, parameter))| {
                    let role = fit.layout.role_in(place, number, number_of_it);
                    let estimated = fit.layout.globals.iter().any(|coordinate| coordinate.role == role);
                    let (low, high) = (value.low.max(parameter.range.0), value.high.min(parameter.range.1));
                    let holds = low <= effect.value(number) && effect.value(number) <= high;
                    (estimated && holds).then_some(Interval { low, high })
                })
                .collect();
            let only_in = match entrant.scope {
                Scope::Everywhere => None,
                Scope::EachConfiguration => configuration.map(|number| problem.configurations[number].clone()),
                Scope::Configuration(number) => Some(problem.configurations[number].clone()),
                // A model has no recordings; its configuration is the nearest it can say.
                Scope::Recordings(some) | Scope::EachRecording(some) => {
                    let mut of = some.iter().map(|number| problem.recordings[number].configuration);
                    let first = of.next();
                    first.filter(|first| of.all(|other| other == *first)).map(|one| problem.configurations[one].clone())
                }
            };
            ModelMechanism { effect, intervals, only_in }
        })
        .collect();
    Model { name: format!("{name}, as diagnosed"), rig, mechanisms }
}

/// Its file, with what a reader has to know.
#[must_use]
pub fn to_toml(diagnosis: &Diagnosis, name: &str) -> String {
    let fit = &diagnosis.selection.best.fit;
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "# Found by `thud diagnose` in {} recordings. `thud simulate --model` runs it, `thud evaluate` asks whether it still holds.",
        diagnosis.problem.recordings.len()
    );
    for (place, entrant) in fit.layout.entrants.iter().enumerate() {
        let mechanism = entrant.effect.mechanism();
        let twins = super::verdict::twins(&diagnosis.selection, place);
        if !twins.is_empty() {
            let twins: Vec<String> = twins.iter().map(|(id, _)| (*id).to_owned()).collect();
            let _ = writeln!(
                text,
                "# {}: these recordings cannot tell it from {}.",
                mechanism.id,
                super::words::listed(&twins, "or")
            );
        }
        let parameters = mechanism.parameters.iter().enumerate();
        let own =
            parameters.filter(|(number, _)| entrant.is_own(*number)).map(|(_, parameter)| parameter.name.to_owned());
        let own: Vec<String> = own.collect();
        if !own.is_empty() {
            let _ = writeln!(
                text,
                "# {}: every impact has its own {}; what is here is that of the first recording that it acts in.",
                mechanism.id,
                super::words::listed(&own, "and")
            );
        }
        if let Scope::Recordings(_) | Scope::EachRecording(_) = entrant.scope {
            let _ = writeln!(
                text,
                "# {}: found {}; a model knows configurations only.",
                mechanism.id,
                super::evidence::scope_words(diagnosis, entrant.scope)
            );
        }
        if mechanism.id == "pose-dependent-mass"
            && let Ok(number) = fit.layout.effect(&diagnosis.problem, place, &fit.point).get("configuration")
            && number >= 0.0
            && let Some(configuration) = diagnosis.problem.configurations.get(number.round() as usize)
        {
            let _ = writeln!(
                text,
                "# pose-dependent-mass: the configuration's number is its place in the campaign; it is {configuration}."
            );
        }
    }
    if super::verdict::remains(&diagnosis.selection) {
        text.push_str(
            "# Something is left beyond this model that no mechanism of the list explains; it is not in this file.\n",
        );
    }
    text.push_str(&found_model(diagnosis, name).to_toml());
    text
}

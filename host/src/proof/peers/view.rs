//! What a peer gets of a campaign: the recordings beside the re-tuned baseline, whole recordings left out as the diagnosis leaves them
//! out, and for the lowest BIC every mechanism fitted alone, in full.
//!
//! So nobody is behind for want of a good simulation: all start from the same residual.

use std::path::Path;

use miette::miette;
use serde::Serialize;
use thud_sim::mechanism::Mechanism;
use thud_sim::rig::Quantity;

use crate::campaign;
use crate::diagnosis::fit::{Effort, Fit};
use crate::diagnosis::held_out::{folds, held_out};
use crate::diagnosis::layout::{Layout, Role};
use crate::diagnosis::problem::Problem;
use crate::diagnosis::select::{Trial, select};
use crate::diagnosis::{Options, predict};
use crate::model;

/// A campaign as peers get it.
#[derive(Debug, Serialize)]
#[expect(non_snake_case, reason = "units as they are written")]
pub struct View {
    /// `impact`, `drop` or `fall`.
    pub kind: String,
    /// Rms of the noise before contact, in the observed channel's unit.
    pub noise_rms: f64,
    /// Rmse of the re-tuned baseline on recordings left out.
    pub baseline_held_out_rmse: f64,
    /// Stiffness of body springs and pad in series, re-tuned; 0 in a fall.
    pub stiffness_N_per_m: f64,
    /// Gravity along the motion, m/s².
    pub gravity_m_per_s2: f64,
    /// Each recording.
    pub recordings: Vec<Seen>,
    /// Each mechanism alone, and the baseline; the lowest BIC first.
    pub candidates: Vec<Candidate>,
    /// Rmse of the candidate with the lowest BIC on recordings left out.
    pub lowest_bic_held_out_rmse: f64,
}

/// A recording beside the re-tuned baseline, at its own samples.
#[derive(Debug, Serialize)]
pub struct Seen {
    /// Its name.
    pub name: String,
    /// Number of the part in which it is left out.
    pub fold: usize,
    /// Number of its configuration.
    pub configuration: usize,
    /// Place in the campaign.
    pub order: u32,
    /// Speed at contact as re-tuned, m/s.
    pub speed_m_per_s: f64,
    /// Mass as re-tuned, kg.
    pub mass_kg: f64,
    /// Zero of the observed channel, as re-tuned.
    pub offset: f64,
    /// Instants, from the contact, s.
    pub time_s: Vec<f32>,
    /// As recorded.
    pub observed: Vec<f32>,
    /// The re-tuned baseline.
    pub baseline: Vec<f32>,
    /// The baseline re-tuned on the other recordings.
    pub held_out: Vec<f32>,
    /// Position of the robot's tip in the re-tuned baseline, m.
    pub position_m: Vec<f32>,
    /// Its velocity, m/s.
    pub velocity_m_per_s: Vec<f32>,
}

/// A model of at most one mechanism.
#[derive(Debug, Serialize)]
pub struct Candidate {
    /// The mechanism; none: the baseline.
    pub id: Option<&'static str>,
    /// χ² with what is believed as further observations.
    pub chi_squared: f64,
    /// χ² + p·ln N.
    pub bic: f64,
}

/// What peers get of a campaign.
///
/// # Errors
/// A campaign that cannot be used.
pub fn view(folder: &Path, without: &[String]) -> miette::Result<View> {
    let loaded = campaign::load(folder)?;
    let options = Options { without: without.to_vec(), only: Vec::new() };
    let mechanisms = options.mechanisms(&loaded.campaign)?;
    let problem = Problem::new(&loaded, &mut Vec::new())?;
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let impossible = || miette!("the baseline of {} cannot be simulated", folder.display());
    let layout = Layout::new(&problem, Vec::new());
    let start = layout.start(&problem);
    let nominal = Fit::run(&problem, layout.clone(), start, &all, Effort::NOMINAL).ok_or_else(impossible)?;
    let baseline = Fit::run(&problem, layout, nominal.point, &all, Effort::FULL).ok_or_else(impossible)?;
    let without_any = Trial { bic: baseline.cost, fit: baseline.clone(), coincidences: Vec::new() };
    let mut trials: Vec<(Option<&'static str>, Trial)> = mechanisms
        .iter()
        .filter_map(|mechanism| alone(&problem, &baseline, mechanism).map(|trial| (Some(mechanism.id), trial)))
        .chain([(None, without_any)])
        .collect();
    trials.sort_by(|a, b| a.1.bic.total_cmp(&b.1.bic));
    let lowest = trials.first().map_or(&baseline, |(_, trial)| &trial.fit);
    let left_out = held_out(&problem, &baseline, &baseline);
    let parts = folds(&problem);
    let recordings = all
        .iter()
        .map(|number| seen(&problem, &baseline, *number, parts[*number], &left_out.model[*number]))
        .collect::<Option<Vec<_>>>()
        .ok_or_else(impossible)?;
    let mut rig = model::simulated(&problem.rig);
    for (coordinate, value) in baseline.layout.globals.iter().zip(&baseline.point.globals) {
        match coordinate.role {
            Role::Body => rig.body_stiffness_n_per_m *= value.exp(),
            Role::Pad => rig.pad_stiffness_n_per_m = rig.pad_stiffness_n_per_m.map(|pad| pad * value.exp()),
            _ => {}
        }
    }
    Ok(View {
        kind: format!("{:?}", problem.rig.kind).to_lowercase(),
        noise_rms: problem.noise_rms(),
        baseline_held_out_rmse: left_out.overall(&problem),
        stiffness_N_per_m: if problem.has_springs() { rig.effective_stiffness_n_per_m() } else { 0.0 },
        gravity_m_per_s2: problem.rig.gravity_along_impact_m_per_s2,
        recordings,
        lowest_bic_held_out_rmse: held_out(&problem, &baseline, lowest).overall(&problem),
        candidates: trials
            .iter()
            .map(|(id, trial)| Candidate { id: *id, chi_squared: trial.fit.cost, bic: trial.bic })
            .collect(),
    })
}

/// The best model with this mechanism and no other. None where its signature is so weak that it was not refitted: it cannot pay for its
/// parameters.
fn alone(problem: &Problem, baseline: &Fit, mechanism: &'static Mechanism) -> Option<Trial> {
    let selection = select(problem, baseline.clone(), &[mechanism], &mut |_| ())?;
    let has = |trial: &Trial| !trial.fit.layout.entrants.is_empty();
    let rivals = selection.rivals.into_iter().map(|(_, trial)| trial);
    std::iter::once(selection.best).chain(rivals).filter(has).min_by(|a, b| a.bic.total_cmp(&b.bic))
}

/// One recording. None where its motion cannot be followed.
fn seen(problem: &Problem, baseline: &Fit, number: usize, fold: usize, held_out: &[f64]) -> Option<Seen> {
    let recording = &problem.recordings[number];
    let Fit { layout, point, .. } = baseline;
    let value = |wanted: Role| layout.global(point, wanted).or_else(|| layout.local(point, number, wanted));
    let contact_s = value(Role::Contact).unwrap_or(recording.contact_guess_s);
    let since_s: Vec<f64> = recording.raw.times_s.iter().map(|time| time - contact_s).collect();
    let impact = predict::strike(problem, &baseline.layout, &baseline.point, number).ok()?;
    let short = |values: &[f64]| -> Vec<f32> { values.iter().map(|value| *value as f32).collect() };
    Some(Seen {
        name: recording.name.clone(),
        fold,
        configuration: recording.configuration,
        order: recording.order,
        speed_m_per_s: recording.speed.value + value(Role::Speed).unwrap_or(0.0) * recording.speed_scale(),
        mass_kg: recording.mass.value * value(Role::Mass(recording.configuration)).unwrap_or(0.0).exp(),
        offset: value(Role::Offset(0)).unwrap_or(0.0),
        baseline: short(&predict::raw(problem, &baseline.layout, &baseline.point, number)?),
        position_m: short(&impact.sample(Quantity::Position, &since_s)),
        velocity_m_per_s: short(&impact.sample(Quantity::Velocity, &since_s)),
        time_s: short(&since_s),
        observed: short(&recording.raw.values),
        held_out: short(held_out),
    })
}

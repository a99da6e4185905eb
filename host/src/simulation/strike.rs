//! From a plan to recordings.

use thud_firmware::units::{Hertz, Newton, Second};
use thud_sim::chain::{ChainSettings, Drift, FrontEnd, Hum, MeasuringChain, Noise};
use thud_sim::rig::{Accuracy, Approach, Impact, Quantity, RigError};

use super::draw::Chance;
use super::{CampaignTruth, ContactTruth, Plan, RecordingTruth, Simulated, WRITTEN_RESOLUTION_N};
use crate::campaign::{Campaign, Chain, Entry, Estimate, Observed, RigKind};
use crate::model;
use crate::recording::{Channel, FORCE, Malformed, Recording};

/// The most samples of one recording.
const MOST_SAMPLES: f64 = 1e7;

/// Resolution of a written stroke, m.
const STROKE_RESOLUTION_M: f64 = 1e-9;

/// Resolution of a written height, m.
const HEIGHT_RESOLUTION_M: f64 = 1e-6;

/// What a height is measured within, m.
const HEIGHT_RANGE_M: f64 = 100.0;

/// Why a plan cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum SimulationError {
    /// A number of the plan that cannot be.
    #[error("{what} is {value}; {low} to {high} is possible")]
    #[diagnostic(help("`thud simulate --help` lists the options with their units"))]
    OutOfRange {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Smallest possible value.
        low: f64,
        /// Largest possible value.
        high: f64,
    },
    /// No speed or no mass.
    #[error("there is no {0}")]
    #[diagnostic(help("give at least one"))]
    Nothing(&'static str),
    /// The rig refused, or the motion could not be followed.
    #[error("recording {recording} ({speed_m_per_s} m/s, {mass_kg} kg): {error}")]
    Rig {
        /// Its number from 1.
        recording: usize,
        /// Speed at contact, m/s.
        speed_m_per_s: f64,
        /// Effective mass, kg.
        mass_kg: f64,
        /// What the rig says.
        error: RigError,
    },
    /// What came out is no recording, because nearly all of it was lost.
    #[error("recording {recording}: {error}")]
    Malformed {
        /// Its number from 1.
        recording: usize,
        /// Why.
        error: Malformed,
    },
    /// What falls freely meets no springs.
    #[error("a fall meets no springs, so there is no stroke to record")]
    #[diagnostic(help("leave the displacement out; the height is recorded"))]
    FallHasNoStroke,
}

/// Simulates a plan; `progress` is told each recording that is done.
///
/// # Errors
/// A number that cannot be, or a rig whose motion cannot be followed.
pub fn simulate(plan: &Plan, mut progress: impl FnMut()) -> Result<Simulated, SimulationError> {
    check(plan)?;
    let mut chance = Chance::new(plan.seed);
    let mut rig = model::simulated(&plan.rig);
    let believed_body = plan.rig.body_stiffness_n_per_m.unwrap_or(Estimate::new(rig.body_stiffness_n_per_m, 0.0));
    rig.body_stiffness_n_per_m = chance.truth_of(believed_body);
    rig.pad_stiffness_n_per_m = plan.rig.pad_stiffness_n_per_m.map(|pad| chance.truth_of(pad));
    let mass_factors: Vec<f64> = plan.masses_kg.iter().map(|_| chance.factor(plan.doubt.mass)).collect();

    let mut truth = CampaignTruth {
        name: plan.name.clone(),
        body_stiffness_N_per_m: rig.body_stiffness_n_per_m,
        pad_stiffness_N_per_m: rig.pad_stiffness_n_per_m,
        mechanisms: plan
            .effects
            .iter()
            .map(ToString::to_string)
            .chain(plan.limited.iter().map(|(effect, name)| format!("{effect} in configuration {name}")))
            .collect(),
        recordings: Vec::new(),
    };
    let mut entries = Vec::new();
    let mut recordings = Vec::new();
    for (configuration, (mass, factor)) in plan.masses_kg.iter().zip(mass_factors).enumerate() {
        let name = (configuration + 1).to_string();
        let limited = plan.limited.iter().filter(|(_, only_in)| *only_in == name).map(|(effect, _)| effect.clone());
        let effects: Vec<_> = plan.effects.iter().cloned().chain(limited).collect();
        for speed in &plan.speeds_m_per_s {
            for _ in 0..plan.repeats {
                let number = entries.len() + 1;
                let file = format!("recordings/{number:03}.csv");
                let believed_speed = Estimate::new(*speed, plan.doubt.speed * speed.abs());
                let approach = Approach {
                    speed_m_per_s: chance.truth_of(believed_speed),
                    effective_mass_kg: mass * factor,
                    configuration: configuration as u32,
                    order: (number - 1) as u32,
                };
                let mut this_rig = rig;
                // Drawn in a fall, too, which meets no spring, so that what follows does not depend on it.
                let factor = chance.factor(plan.rig.spring_repeatability);
                if plan.rig.kind != RigKind::Fall {
                    this_rig.body_stiffness_n_per_m *= factor;
                }
                let impact =
                    this_rig.strike(&approach, &effects, plan.after_s, Accuracy::default()).map_err(|error| {
                        SimulationError::Rig { recording: number, speed_m_per_s: *speed, mass_kg: *mass, error }
                    })?;
                let fraction = chance.fraction();
                // A fall is recorded from its release on.
                let fall = plan.rig.kind == RigKind::Fall;
                let contact_s = if fall { 0.0 } else { plan.before_s * (1.0 + 0.1 * fraction) };
                let recording = if fall {
                    record_fall(plan, &impact, &mut chance)
                } else {
                    record(plan, &impact, contact_s, &mut chance)
                };
                let recording = recording.map_err(|error| SimulationError::Malformed { recording: number, error })?;
                truth.recordings.push(RecordingTruth {
                    file: file.clone(),
                    contact_s,
                    impact_speed_m_per_s: impact.approach().speed_m_per_s,
                    effective_mass_kg: impact.approach().effective_mass_kg,
                    body_stiffness_N_per_m: this_rig.body_stiffness_n_per_m,
                    contacts: impact
                        .truth()
                        .contacts
                        .iter()
                        .map(|contact| ContactTruth::new(contact, contact_s))
                        .collect(),
                });
                entries.push(Entry {
                    file,
                    impact_speed_m_per_s: believed_speed,
                    effective_mass_kg: Estimate::new(*mass, plan.doubt.mass * mass),
                    configuration: Some(name.clone()),
                });
                recordings.push(recording);
                progress();
            }
        }
    }
    let chain = if plan.rig.kind == RigKind::Fall {
        Chain {
            sample_rate_hz: plan.sample_rate_hz,
            noise_rms: plan.height_noise_m,
            full_scale: Some(HEIGHT_RANGE_M),
            observed: Observed::Height,
        }
    } else {
        Chain {
            sample_rate_hz: plan.sample_rate_hz,
            noise_rms: plan.imperfection.noise_n,
            full_scale: Some(plan.full_scale_n),
            observed: Observed::Force,
        }
    };
    let campaign = Campaign { name: plan.name.clone(), rig: plan.rig.clone(), chain, recordings: entries };
    Ok(Simulated { campaign, recordings, truth })
}

fn check(plan: &Plan) -> Result<(), SimulationError> {
    let within = |what: &'static str, value: f64, low: f64, high: f64| {
        let fits = (low..=high).contains(&value);
        if fits { Ok(()) } else { Err(SimulationError::OutOfRange { what, value, low, high }) }
    };
    let fall = plan.rig.kind == RigKind::Fall;
    if fall && plan.displacement_noise_m.is_some() {
        return Err(SimulationError::FallHasNoStroke);
    }
    if plan.speeds_m_per_s.is_empty() {
        return Err(SimulationError::Nothing("speed"));
    }
    if plan.masses_kg.is_empty() {
        return Err(SimulationError::Nothing("mass"));
    }
    for speed in &plan.speeds_m_per_s {
        within("a speed (m/s)", *speed, if fall { -20.0 } else { 1e-4 }, 20.0)?;
    }
    for mass in &plan.masses_kg {
        within("a mass (kg)", *mass, 1e-3, 1e3)?;
    }
    within("the number of repeats", plan.repeats as f64, 1.0, 1e4)?;
    within("the speed's relative error", plan.doubt.speed, 0.0, 0.5)?;
    within("the mass's relative error", plan.doubt.mass, 0.0, 0.5)?;
    within("the sample rate (Hz)", plan.sample_rate_hz, 10.0, 1e6)?;
    within("the full scale (N)", plan.full_scale_n, 1.0, 1e6)?;
    within("the noise (N rms)", plan.imperfection.noise_n, 0.0, plan.full_scale_n / 2.0)?;
    within("the hum (N)", plan.imperfection.hum_n, 0.0, plan.full_scale_n / 2.0)?;
    within("the drift (N/s)", plan.imperfection.drift_n_per_s, -1e3, 1e3)?;
    within("the time before contact (s)", plan.before_s, 0.0, 100.0)?;
    within("the time after contact (s)", plan.after_s, 1e-3, 100.0)?;
    within("the number of samples", (plan.before_s + plan.after_s) * plan.sample_rate_hz, 2.0, MOST_SAMPLES)?;
    within("the noise of the height (m rms)", plan.height_noise_m, 0.0, 1.0)?;
    within("the noise of the displacement (m rms)", plan.displacement_noise_m.unwrap_or(0.0), 0.0, 1.0)
}

/// An impact as the chain records it; first contact at `contact_s` of the recording's time, which begins at 0.
fn record(plan: &Plan, impact: &Impact, contact_s: f64, chance: &mut Chance) -> Result<Recording, Malformed> {
    let count = ((contact_s + plan.after_s) * plan.sample_rate_hz).floor() as usize;
    let times_s: Vec<f64> = (0..count).map(|index| index as f64 / plan.sample_rate_hz).collect();
    let since_contact_s: Vec<f64> = times_s.iter().map(|time| time - contact_s).collect();

    let mut force_n = impact.measured_n(&since_contact_s);
    // Samples that a mechanism has lost are missing, not zero.
    let present: Vec<bool> = force_n.iter().map(|force| force.is_finite()).collect();
    force_n.iter_mut().zip(&present).for_each(|(force, present)| {
        if !present {
            *force = 0.0;
        }
    });
    let settings = chain_settings(plan, chance.fraction());
    let phase_samples = (chance.fraction() * plan.sample_rate_hz) as usize;
    let mut chain = MeasuringChain::new(&settings, chance.seed());
    // The chain has been on for up to a second: hum has any phase.
    let mut idle = vec![0.0; phase_samples];
    chain.convert(&mut idle, &mut vec![0; phase_samples]);
    let mut codes = vec![0; count];
    chain.convert(&mut force_n, &mut codes);
    let newton_per_code = settings.front_end.newton_per_code();
    let zero = f64::from(settings.front_end.zero_code);
    let force = codes.iter().map(|code| rounded((f64::from(*code) - zero) * newton_per_code, WRITTEN_RESOLUTION_N));

    let keep = |values: Vec<f64>| -> Vec<f64> {
        values.into_iter().zip(&present).filter(|(_, present)| **present).map(|(value, _)| value).collect()
    };
    let mut channels = vec![Channel { name: FORCE.to_owned(), values: keep(force.collect()) }];
    if let Some(noise_m) = plan.displacement_noise_m {
        let mut stroke = impact.sample(Quantity::Stroke, &since_contact_s);
        for value in &mut stroke {
            *value = rounded(*value + chance.noise(noise_m), STROKE_RESOLUTION_M);
        }
        channels.push(Channel { name: "displacement_m".to_owned(), values: keep(stroke) });
    }
    Recording::new(keep(times_s), channels)
}

/// The height of a falling body from its release on, above where it is at the end of the ideal fall.
///
/// Before the release nothing is recorded: what holds the body is not part of the fall, so that time 0 is the release.
fn record_fall(plan: &Plan, fall: &Impact, chance: &mut Chance) -> Result<Recording, Malformed> {
    let count = (plan.after_s * plan.sample_rate_hz).floor() as usize;
    let since_release_s: Vec<f64> = (0..count).map(|index| index as f64 / plan.sample_rate_hz).collect();
    let ideal_m = fall.approach().speed_m_per_s * plan.after_s
        + 0.5 * plan.rig.gravity_along_impact_m_per_s2 * plan.after_s.powi(2);
    let fallen_m = fall.sample(Quantity::Position, &since_release_s);
    let heights = fallen_m
        .iter()
        .map(|fallen| rounded(ideal_m - fallen + chance.noise(plan.height_noise_m), HEIGHT_RESOLUTION_M))
        .collect();
    Recording::new(since_release_s, vec![Channel { name: Observed::Height.column().to_owned(), values: heights }])
}

/// The chain without filters (those are mechanisms), with what the plan adds. `turn` in [0, 1) shifts the mains frequency within
/// what a grid does, 50 Hz ± 0.05 Hz.
fn chain_settings(plan: &Plan, turn: f64) -> ChainSettings {
    let reference = FrontEnd::REFERENCE;
    let full_scale_codes = f64::from(reference.upper_rail) - f64::from(reference.zero_code);
    // The gain that puts the full scale onto the upper rail.
    let gain = reference.gain * reference.newton_per_code() * full_scale_codes / plan.full_scale_n;
    ChainSettings {
        sample_rate: Hertz(plan.sample_rate_hz as f32),
        front_end: FrontEnd { gain, ..reference },
        noise: Noise { white: Newton(plan.imperfection.noise_n as f32), coloured: None },
        hum: (plan.imperfection.hum_n > 0.0).then(|| Hum {
            fundamental: Hertz((49.95 + 0.1 * turn) as f32),
            amplitude: Newton(plan.imperfection.hum_n as f32),
            // As in a workshop: a tenth of the second and three tenths of the third.
            harmonics: vec![0.1, 0.3],
        }),
        drift: Drift {
            rate_newton_per_second: plan.imperfection.drift_n_per_s as f32,
            thermal: Newton(0.0),
            thermal_time: Second(600.0),
        },
        ..ChainSettings::transparent()
    }
}

/// The nearest number that is written with few digits.
fn rounded(value: f64, resolution: f64) -> f64 {
    let inverse = (1.0 / resolution).round();
    (value * inverse).round() / inverse
}

//! The law as a model file that `thud simulate --model` runs.
//!
//! A model file has a rig and mechanisms, not laws. What it carries:
//!
//! | law | in the file |
//! |---|---|
//! | linear | the body spring, exactly |
//! | Kelvin–Voigt, separating | body spring and `viscous-damping`, exactly |
//! | Hunt–Crossley, n may be 1 | body spring and `hunt-crossley-damping`, exactly (n = 1 where its interval holds that) |
//! | n > 1 | body spring and `hardening`, k·δ/(1 − δ/δ_l)^p, laid through k·δⁿ over the depths that were recorded: near |
//! | n < 1 | the best straight line: near, because nothing in the list softens |
//! | λ = D/v₀ | `hunt-crossley-damping` with α = D/(1.5·v) at the middle speed: right there, too little loss below, too much above |
//!
//! The whole contact is one spring in the file, without a pad: force and mass tell what both together do, not which of the two does it.
//! How near a near one is, is measured: the file's model is simulated at every recording's speed and mass, and compared with the law.

use std::fmt::Write as _;

use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach};

use super::identification::{Identification, Identified};
use super::law::{Damping, Values};
use crate::campaign::{Estimate, Loaded, Rig};
use crate::model::{Interval, Model, ModelMechanism, simulated};

/// Points of an elastic curve that a mechanism is laid through.
const POINTS: usize = 60;

/// The nearest model to a law.
#[derive(Clone, Debug)]
pub struct NearestModel {
    /// The model.
    pub model: Model,
    /// Whether it is the law itself.
    pub exact: bool,
    /// What it cannot carry, and what stands for it; a sentence.
    pub because: String,
    /// Its force less the law's, N rms over the contacts of all recordings.
    pub error_rms_n: f64,
    /// Its largest deviation in a peak, relative.
    pub worst_peak_error: f64,
}

/// The elastic part of a model.
struct Elastic {
    stiffness_n_per_m: f64,
    /// The parameters of `hardening`.
    hardening: Option<[(&'static str, f64); 2]>,
}

/// The model nearest to the law that is named.
#[must_use]
pub fn nearest_model(found: &Identification, loaded: &Loaded) -> NearestModel {
    let law = found.law();
    let values = law.values;
    let deepest = deepest_m(found, law);
    let mut because = Vec::new();
    let exponent = law.parameters.iter().find(|parameter| parameter.name == "exponent");
    // An exponent that may as well be 1 is 1 in the file.
    let straight = exponent.is_none_or(|exponent| exponent.low <= 1.0 && 1.0 <= exponent.high);
    let elastic = elastic(&values, deepest, straight, &mut because);
    let mut mechanisms = Vec::new();
    let mut add = |id: &str, parameters: &[(&str, f64)], intervals: Vec<Option<Interval>>| {
        // Values out of a mechanism's range are left out, and the error that is measured says so.
        if let Ok(effect) = Effect::new(id, parameters) {
            mechanisms.push(ModelMechanism { effect, intervals, only_in: None });
        }
    };
    if let Some(parameters) = elastic.hardening {
        add("hardening", &parameters, vec![None, None]);
    }
    let interval = |name: &str| {
        let parameter = law.parameters.iter().find(|parameter| parameter.name == name)?;
        Some(Interval { low: parameter.low.max(0.0), high: parameter.high })
    };
    match law.law.damping {
        Damping::None => {}
        Damping::Material => {
            add("hunt-crossley-damping", &[("alpha_s_per_m", values.damping.max(0.0))], vec![interval("alpha")]);
        }
        Damping::Dashpot => {
            add("viscous-damping", &[("damping_Ns_per_m", values.damping.max(0.0))], vec![interval("damping")]);
        }
        Damping::OverSpeed { .. } => {
            let alpha = (values.damping / 1.5 / found.middle.2).max(0.0);
            because.push(format!(
                "a loss that is the same at every speed is in no mechanism: Hunt–Crossley damping with the same loss at {} m/s stands for it",
                found.middle.2
            ));
            add("hunt-crossley-damping", &[("alpha_s_per_m", alpha)], vec![None]);
        }
    }
    let stiffness = law.parameters.iter().find(|parameter| parameter.name == "stiffness");
    let relative_sd = stiffness.map_or(0.05, |stiffness| (stiffness.high / stiffness.low).ln() / (2.0 * 1.96));
    let relative_sd = if law.law.exponent { relative_of_force(law) } else { relative_sd };
    let rig = Rig {
        body_stiffness_n_per_m: Some(Estimate::new(elastic.stiffness_n_per_m, relative_sd * elastic.stiffness_n_per_m)),
        pad_stiffness_n_per_m: None,
        moving_mass_kg: None,
        ..loaded.campaign.rig.clone()
    };
    let model = Model { name: format!("{}, {}", loaded.campaign.name, law.law.name), rig, mechanisms };
    let (error_rms_n, worst_peak_error) = error(found, law, &model);
    NearestModel { exact: because.is_empty(), because: because.join("; "), model, error_rms_n, worst_peak_error }
}

fn relative_of_force(law: &Identified) -> f64 {
    let force = law.parameters.iter().find(|parameter| parameter.name == "force_at_middle_depth");
    force.map_or(0.05, |force| (force.high / force.low).ln() / (2.0 * 1.96))
}

/// How deep the deepest recording went, by the law.
fn deepest_m(found: &Identification, law: &Identified) -> f64 {
    found
        .recordings
        .iter()
        .map(|recording| {
            let motion =
                law.law.motion(&law.values, recording.mass_kg, recording.speed_m_per_s, found.gravity_m_per_s2);
            motion.depth_m.iter().copied().fold(0.0, f64::max)
        })
        .fold(1e-6, f64::max)
}

/// The nearest elastic curve that a rig can have.
fn elastic(values: &Values, deepest_m: f64, is_straight: bool, because: &mut Vec<String>) -> Elastic {
    let force = |depth: f64| values.reference_n * (depth / values.reference_m).powf(values.exponent);
    let depths: Vec<f64> = (1..=POINTS).map(|step| deepest_m * step as f64 / POINTS as f64).collect();
    // The best factor of a shape, and the squares that it leaves.
    let scaled = |shape: &dyn Fn(f64) -> f64| {
        let (mut product, mut square, mut all) = (0.0, 0.0, 0.0);
        for &depth in &depths {
            let (here, wanted) = (shape(depth), force(depth));
            product += here * wanted;
            square += here * here;
            all += wanted * wanted;
        }
        (product / square, all - product * product / square)
    };
    let (straight, left) = scaled(&|depth| depth);
    if is_straight {
        return Elastic { stiffness_n_per_m: straight, hardening: None };
    }
    let mut best = (left, Elastic { stiffness_n_per_m: straight, hardening: None });
    if values.exponent > 1.0 {
        for step in 0..60 {
            let lock_m = deepest_m * 1.06 * 1.05_f64.powi(step);
            for power in 1..=200 {
                let exponent = 0.025 * f64::from(power);
                let (stiffness, left) = scaled(&|depth| depth / (1.0 - depth / lock_m).powf(exponent));
                let parameters = [("growth_per_m", exponent / lock_m), ("exponent", exponent)];
                if left < best.0 && Effect::new("hardening", &parameters).is_ok() {
                    best = (left, Elastic { stiffness_n_per_m: stiffness, hardening: Some(parameters) });
                }
            }
        }
    }
    let left = (best.0.max(0.0) / POINTS as f64).sqrt();
    let what =
        if best.1.hardening.is_some() { "a hardening spring stands for it" } else { "a straight one stands for it" };
    because.push(format!(
        "a spring with the exponent {:.3} is in no mechanism: {what}, {:.2} N rms off up to {:.1} mm",
        values.exponent,
        left,
        1e3 * deepest_m
    ));
    best.1
}

/// How far the model's force is from the law's over all recordings: N rms, and relative in the peak.
fn error(found: &Identification, law: &Identified, model: &Model) -> (f64, f64) {
    const SAMPLES: usize = 400;
    let rig = simulated(&model.rig);
    let effects = model.effects();
    let (mut squares, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
    for recording in &found.recordings {
        let wanted = law.law.motion(&law.values, recording.mass_kg, recording.speed_m_per_s, found.gravity_m_per_s2);
        let approach = Approach::new(recording.speed_m_per_s, recording.mass_kg);
        let times: Vec<f64> = (0..SAMPLES).map(|step| wanted.end_s * (step as f64 + 0.5) / SAMPLES as f64).collect();
        let Ok(impact) = rig.strike(&approach, &effects, wanted.end_s, Accuracy::default()) else {
            return (f64::INFINITY, f64::INFINITY);
        };
        let mut peak = 0.0_f64;
        for time in times {
            let here = impact.force_n(time);
            peak = peak.max(here);
            squares += (here - wanted.force_at(time)).powi(2);
            count += 1.0;
        }
        worst = worst.max((peak / wanted.peak_n() - 1.0).abs());
    }
    ((squares / f64::max(count, 1.0)).sqrt(), worst)
}

/// The file, with what a reader has to know.
#[must_use]
pub fn to_toml(nearest: &NearestModel, found: &Identification) -> String {
    let law = found.law();
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "# Identified by `thud identify` in {} recordings: {}, {}.\n# `thud simulate --model` runs it, `thud evaluate` asks whether it holds.",
        found.recordings.len(),
        law.law.name,
        law.law.equation
    );
    for parameter in &law.parameters {
        let _ = writeln!(
            text,
            "#   {} = {:.6} {} ({:.6} to {:.6})",
            parameter.name, parameter.value, parameter.unit, parameter.low, parameter.high
        );
    }
    let _ =
        writeln!(text, "# The whole contact is one spring here; what of it is the pad's, force and mass do not tell.");
    if nearest.exact {
        text.push_str("# The model is the law.\n");
    } else {
        let _ = writeln!(
            text,
            "# NOT THE LAW ITSELF, the nearest model: {}.\n# Over these recordings its force is {:.2} N rms off the law's, its peaks up to {:.1} %.",
            nearest.because,
            nearest.error_rms_n,
            100.0 * nearest.worst_peak_error
        );
    }
    text.push_str(&nearest.model.to_toml());
    text
}

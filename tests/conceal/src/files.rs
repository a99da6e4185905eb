//! Writes a case: the campaign that anyone may see, and the answer that nobody may.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use serde::Serialize;

use crate::case::{self, Case, Way};
use crate::draw::Draw;
use crate::effect::{self, Parameter};
use crate::plan::{CELL_N_PER_M, Estimate};
use crate::world::Kind;

/// Format of the answers.
pub const FORMAT: &str = "thud-answers/1";

/// The answers of a run.
#[derive(Debug, Serialize)]
pub struct Answers {
    /// [`FORMAT`].
    pub format: &'static str,
    /// Composition of the run, where it has one.
    pub mix: Option<String>,
    /// Seed of the run.
    pub seed: u64,
    /// The cases in order.
    pub cases: Vec<Answer>,
}

/// Everything that is true about a case.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// Folder of the case.
    pub case: String,
    /// The way of concealing.
    pub way: String,
    /// Impact, drop or fall.
    pub kind: String,
    /// The seed that makes this case again.
    pub seed: u64,
    /// Mechanisms that the tool leaves out of its list, as `options.json` says beside the cases.
    pub without: Vec<&'static str>,
    /// The verdict that is right: `consistent`, `named` or `unexplained`.
    pub right_verdict: &'static str,
    /// Strength of all that is hidden together.
    pub d: f64,
    /// Strength of the benign traces.
    pub benign_d: f64,
    /// Whether every target was met within five per cent.
    pub on_target: bool,
    /// What is hidden.
    pub effects: Vec<HiddenAnswer>,
    /// Where the rest of the re-tuned baseline is.
    pub rest: Place,
    /// Where the effects act before anything is re-tuned.
    pub signature: Place,
    /// The stated baseline before diagnosis, aligned in time and offset: lowest R² of a recording.
    pub stated_r_squared: f64,
    /// The same: worst peak error over the noise rms.
    pub stated_peak_error_over_noise: f64,
    /// Rms of what was written less the noise-free truth, in the channel's unit: the rmse of the true model.
    pub true_model_rmse: f64,
    /// Rms of the noise that was stated.
    pub noise_rms: f64,
    /// Rmse of the best re-tuned baseline against the noise-free truth, in the channel's unit.
    pub baseline_rmse: f64,
    /// Autoregressive coefficients of the noise and the innovation's sd.
    pub noise_colour: (Vec<f64>, f64),
    /// Pulls of the best re-tuned baseline away from the truth: ln k, then ln m for each configuration.
    pub absorbed: Vec<f64>,
    /// True values.
    pub truth: Truth,
    /// Each recording.
    pub recordings: Vec<RecordingAnswer>,
}

/// An effect in an answer.
#[derive(Debug, Serialize)]
pub struct HiddenAnswer {
    /// Id.
    pub id: &'static str,
    /// Whether the contract's list has it.
    pub listed: bool,
    /// What of the list resembles it.
    pub resembles: Vec<&'static str>,
    /// Strength asked for.
    pub target_d: f64,
    /// Strength alone.
    pub d: f64,
    /// Strength alone, beside any amount of the others.
    pub d_beside_others: f64,
    /// True parameters.
    pub parameters: Vec<Parameter>,
    /// Recordings that it was allowed to touch.
    pub recordings: Vec<String>,
}

/// Where something is.
#[derive(Debug, Serialize)]
pub struct Place {
    /// The phase with the largest share of the energy.
    pub phase: &'static str,
    /// Shares before, rise, fall, after.
    pub shares: [f64; 4],
    /// Recordings that hold at least a twentieth of the energy.
    pub recordings: Vec<String>,
}

/// True values of the rig.
#[derive(Debug, Serialize)]
pub struct Truth {
    /// Body springs, N/m.
    pub body_stiffness_n_per_m: f64,
    /// Pad, N/m.
    pub pad_stiffness_n_per_m: f64,
    /// Springs, pad and cell in series, N/m.
    pub series_stiffness_n_per_m: f64,
    /// Cell, N/m.
    pub cell_stiffness_n_per_m: f64,
    /// The moving piece where nothing is hidden in it, kg.
    pub piece_kg: f64,
}

/// A recording in an answer.
#[derive(Debug, Serialize)]
pub struct RecordingAnswer {
    /// File in the campaign.
    pub file: String,
    /// True speed at contact or release, m/s.
    pub speed_m_per_s: f64,
    /// True mass, kg.
    pub mass_kg: f64,
    /// Springs, pad and cell in series in this recording, N/m.
    pub stiffness_n_per_m: f64,
    /// First touch (or release), s in the recording.
    pub contact_s: f64,
    /// The same after the delay of the anti-alias filter.
    pub seen_contact_s: f64,
    /// Zero offset in the channel's unit.
    pub offset: f64,
    /// Strength of the rest in this recording alone.
    pub rest_d: f64,
}

fn file_name(index: usize) -> String {
    format!("recordings/{:03}.csv", index + 1)
}

fn number(index: usize) -> String {
    format!("{:03}", index + 1)
}

/// Writes the campaign of `case` into `folder` under a neutral name, and gives the answer.
///
/// # Errors
/// When the folder or a file cannot be written.
pub fn write(case: &Case, folder: &Path, name: &str) -> io::Result<Answer> {
    let (files, answer) = render(case, name);
    put(files, folder)?;
    Ok(answer)
}

/// Writes the campaign alone: of a case that has gone on since its answer was given.
///
/// # Errors
/// When the folder or a file cannot be written.
pub fn write_campaign(case: &Case, folder: &Path, name: &str) -> io::Result<()> {
    put(shown(case, name).0, folder)
}

fn put(files: Vec<(String, String)>, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder.join("recordings"))?;
    files.into_iter().try_for_each(|(path, text)| fs::write(folder.join(path), text))
}

/// The campaign's files, path and text, and the answer.
#[must_use]
pub fn render(case: &Case, name: &str) -> (Vec<(String, String)>, Answer) {
    let (files, rmse) = shown(case, name);
    let answer = answer(case, name, rmse);
    (files, answer)
}

/// The campaign's files, and the rms of what is written less the noise-free truth.
fn shown(case: &Case, name: &str) -> (Vec<(String, String)>, f64) {
    let mut files = vec![("campaign.toml".to_owned(), campaign(case, name))];
    let plan = &case.plan;
    let mut draw = Draw::new(case.request.seed ^ 0x9e37_79b9_7f4a_7c15);
    let (mut squares, mut count) = (0.0, 0usize);
    for (index, trace) in case.traces.iter().enumerate() {
        let world = case.world(index);
        let noise = plan.colour.sample(&mut draw, trace.readings.len());
        let (step, level) = (world.chain.step_n, world.chain.clip_n);
        let observed = if plan.kind == Kind::Fall { "height_m" } else { "force_N" };
        let digits = if plan.kind == Kind::Fall { 6 } else { 4 };
        let mut text = format!("time_s,{observed}\n");
        for (i, (reading, noise)) in trace.readings.iter().zip(&noise).enumerate() {
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
            let t = i as f64 / plan.rate_hz;
            let code = ((reading + noise).clamp(-level, level) / step).round();
            let value = (code.clamp(-32768.0, 32767.0)) * step;
            squares += (value - reading).powi(2);
            count += 1;
            // Infallible: it goes into a String.
            let _ = writeln!(text, "{t:.7},{value:.digits$}");
        }
        files.push((file_name(index), text));
    }
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let rmse = (squares / count as f64).sqrt();
    (files, rmse)
}

fn estimate(e: &Estimate) -> String {
    // `{}` of a double is the shortest text that reads back the same; a TOML float needs its point.
    format!("{{ value = {}, sd = {} }}", float(e.value), float(e.sd))
}

fn float(value: f64) -> String {
    format!("{value:?}")
}

fn campaign(case: &Case, name: &str) -> String {
    let plan = &case.plan;
    let mut text =
        format!("format = \"thud-campaign/1\"\nname = \"{name}\"\n\n[rig]\nkind = \"{}\"\n", plan.kind.name());
    let mut line = |s: String| {
        text.push_str(&s);
        text.push('\n');
    };
    if plan.kind != Kind::Fall {
        line(format!("body_stiffness_N_per_m = {}", estimate(&plan.stated_body)));
        line(format!("pad_stiffness_N_per_m = {}", estimate(&plan.stated_pad)));
        if let Some(sd) = plan.states_piece {
            let mass = case.world(0).piece.mass_kg;
            let stated = Estimate { value: rounded(mass * (1.0 + 0.5 * sd)), sd: rounded(mass * sd) };
            line(format!("moving_mass_kg = {}", estimate(&stated)));
        }
        line(format!("spring_repeatability = {}", float(plan.repeatability)));
    }
    if plan.kind != Kind::Impact {
        line(format!("gravity_along_impact_m_per_s2 = {}", float(plan.gravity_m_per_s2)));
    }
    line(String::new());
    line("[chain]".to_owned());
    line(format!("sample_rate_Hz = {}", float(plan.rate_hz)));
    line(format!("noise_rms_N = {}", float(plan.noise_rms)));
    line(format!("full_scale_N = {}", float(plan.full_scale)));
    line(format!("observed = \"{}\"", if plan.kind == Kind::Fall { "height_m" } else { "force_N" }));
    for (index, r) in plan.recordings.iter().enumerate() {
        let configuration = &plan.configurations[r.configuration];
        line(String::new());
        line("[[recording]]".to_owned());
        line(format!("file = \"{}\"", file_name(index)));
        line(format!("impact_speed_m_per_s = {}", estimate(&r.stated_speed)));
        line(format!("effective_mass_kg = {}", estimate(&configuration.stated)));
        line(format!("configuration = \"{}\"", r.configuration + 1));
    }
    text
}

fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

const PHASES: [&str; 4] = ["before", "rise", "fall", "after"];

fn place(case: &Case, signals: &[Vec<f64>]) -> Place {
    let shares = case::phases(case, signals);
    let largest = (0..4).max_by(|a, b| shares[*a].total_cmp(&shares[*b])).unwrap_or(0);
    let energies: Vec<f64> = signals.iter().map(|s| s.iter().map(|v| v * v).sum()).collect();
    let total: f64 = energies.iter().sum();
    let recordings = (0..signals.len()).filter(|i| energies[*i] > 0.05 * total && total > 0.0).map(number).collect();
    Place { phase: PHASES[largest], shares, recordings }
}

fn answer(case: &Case, name: &str, true_model_rmse: f64) -> Answer {
    let plan = &case.plan;
    let effects: Vec<HiddenAnswer> = case
        .hidden
        .iter()
        .zip(&case.request.effects)
        .map(|(h, (_, target))| HiddenAnswer {
            id: h.effect.id,
            listed: h.effect.listed,
            resembles: if h.effect.listed { effect::alike(h.effect.id) } else { h.effect.resembles.to_vec() },
            target_d: *target,
            d: h.d,
            d_beside_others: h.d_beside_others,
            parameters: (h.shaped.parameters)(h.scale),
            recordings: (0..h.touched.len()).filter(|i| h.touched[*i]).map(number).collect(),
        })
        .collect();
    let right_verdict = if effects.is_empty() {
        "consistent"
    } else if effects.iter().all(|e| e.listed && !case.request.without.contains(&e.id)) {
        "named"
    } else {
        "unexplained"
    };
    let (coefficients, innovation) = plan.colour.parts();
    // The residual is whitened; unwhitened rms from a run of the re-tuned baseline against the truth.
    let (mut squares, mut count) = (0.0, 0usize);
    for (index, trace) in case.traces.iter().enumerate() {
        let [contact, offset, ..] = case.retuned.locals[index];
        let sampler = case::retuned_baseline(case, index).sampler();
        for (i, reading) in trace.readings.iter().enumerate() {
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
            let t = i as f64 / plan.rate_hz;
            squares += (reading - offset - sampler(t - contact).value).powi(2);
            count += 1;
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let baseline_rmse = (squares / count as f64).sqrt();
    let mut absorbed = vec![case.retuned.ln_k];
    absorbed.extend(&case.retuned.ln_m);
    Answer {
        case: name.to_owned(),
        way: case.request.way.name().to_owned(),
        kind: plan.kind.name().to_owned(),
        seed: case.request.seed,
        without: case.request.without.clone(),
        right_verdict,
        d: if case.request.way == Way::Absent { 0.0 } else { case.retuned.d },
        benign_d: case.benign_d,
        on_target: case.on_target,
        effects,
        rest: place(case, &case.retuned.residuals),
        signature: place(case, &case::signature(case)),
        stated_r_squared: case.stated.r_squared,
        stated_peak_error_over_noise: case.stated.peak_error_over_noise,
        true_model_rmse,
        noise_rms: plan.noise_rms,
        baseline_rmse,
        noise_colour: (coefficients.to_vec(), innovation),
        absorbed,
        truth: Truth {
            body_stiffness_n_per_m: plan.body_n_per_m,
            pad_stiffness_n_per_m: plan.pad_n_per_m,
            series_stiffness_n_per_m: 1.0 / (1.0 / plan.body_n_per_m + 1.0 / plan.pad_n_per_m + 1.0 / CELL_N_PER_M),
            cell_stiffness_n_per_m: CELL_N_PER_M,
            piece_kg: plan.traces.piece_kg,
        },
        recordings: plan
            .recordings
            .iter()
            .enumerate()
            .map(|(index, r)| {
                let world = case.world(index);
                RecordingAnswer {
                    file: file_name(index),
                    speed_m_per_s: world.speed_m_per_s,
                    mass_kg: world.mass_kg,
                    stiffness_n_per_m: plan.series_n_per_m(index),
                    contact_s: r.sampling.contact_s,
                    seen_contact_s: plan.seen_contact_s(index),
                    offset: r.offset,
                    rest_d: case.retuned.residuals[index].iter().map(|v| v * v).sum::<f64>().sqrt(),
                }
            })
            .collect(),
    }
}

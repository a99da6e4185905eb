//! Is a rig fit for use, as known masses that fell on it show, and if not, what is wrong with it?
//!
//! ```text
//! for every set of springs that the rig can hold (K = 3a + b):
//!     simulate every drop; align; gain = Σ F f / Σ f²;  rest = Σ (F − gain·f)²
//! the set with the least rest is in the rig; around it K is fitted freely, then friction of the guide is tried
//! ```
//!
//! Stiffness and gain part because a pulse's length depends on K alone, and its height on gain and √K. Mass and speed
//! are known in a drop, so nothing else bends the scale. The friction is the one with the least rest on a grid; a finer
//! question (which of thirty mechanisms?) is `thud diagnose`'s.

use serde::Serialize;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Kind, Rig, SpringSet};

use super::two_bodies::{NoMotion, piece};
use crate::campaign::{Loaded, Observed};

/// Relative deviation of K within which a set of springs counts as the one that is meant: springs are that good.
pub const SPRINGS_WITHIN: f64 = 0.05;
/// Relative deviation of the gain that calls for a new calibration.
pub const GAIN_WITHIN: f64 = 0.02;
/// Friction that spoils a reading of soft springs, N.
pub const FRICTION_WITHIN_N: f64 = 0.5;
/// A rest of more than this share of the peak is not explained.
const UNEXPLAINED: f64 = 0.05;
/// Frictions that are tried, N.
const FRICTIONS_N: [f64; 9] = [0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 4.0, 8.0];
/// Friction is believed where it takes this share of the rest away.
const BELIEVED: f64 = 0.2;
/// A rest of springs that fit this much worse than the best ones is no rival.
const RIVAL: f64 = 1.5;

/// Why a campaign cannot be judged.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum NotJudged {
    /// It is no drop test.
    #[error("the campaign is of the kind `{0}`, not of drops")]
    #[diagnostic(help(
        "only known masses that fall tell gain and stiffness apart; for anything else there is `thud diagnose`"
    ))]
    Kind(&'static str),
    /// There is no force.
    #[error("the campaign observes `{0}`, not the force")]
    #[diagnostic(help("record the load cell: observed = \"force_N\""))]
    NoForce(&'static str),
    /// Nothing hits.
    #[error("recording {0} has no blow: its force never rises above the noise")]
    #[diagnostic(help("leave the recording out, or check that it was triggered"))]
    NoBlow(String),
    /// The simulation refused.
    #[error("recording {recording} cannot be simulated: {error}")]
    Motion {
        /// The recording.
        recording: String,
        /// Why.
        error: NoMotion,
    },
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
pub struct Fitness {
    /// Nothing is wrong.
    pub fit_for_use: bool,
    /// What is wrong, one sentence each.
    pub findings: Vec<String>,
    /// The springs as stated.
    pub stated_stiffness_N_per_m: f64,
    /// As fitted freely.
    pub stiffness_N_per_m: f64,
    /// One standard error, from the scatter of the drops.
    pub stiffness_se_N_per_m: f64,
    /// The set of springs that fits best.
    pub springs: String,
    /// Reading over true force.
    pub gain: f64,
    /// One standard error, from the scatter of the drops.
    pub gain_se: f64,
    /// Friction of the guide.
    pub friction_N: f64,
    /// What is left over the largest force, root mean square.
    pub rest_share: f64,
    /// Each drop.
    pub drops: Vec<Drop>,
}

/// One drop.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
pub struct Drop {
    /// The recording.
    pub file: String,
    /// Falling mass.
    pub mass_kg: f64,
    /// Speed at contact.
    pub speed_m_per_s: f64,
    /// Highest force recorded.
    pub peak_N: f64,
    /// Highest force that the rig as stated would show.
    pub expected_N: f64,
    /// Δ %, expected against recorded: (23).
    pub deviation_percent: f64,
    /// K by this drop alone.
    pub stiffness_N_per_m: f64,
    /// Gain by this drop alone.
    pub gain: f64,
}

/// A recorded drop, cut to the blow.
struct Blow {
    file: String,
    mass_kg: f64,
    speed_m_per_s: f64,
    times_s: Vec<f64>,
    force_n: Vec<f64>,
    peak_n: f64,
    /// Half the peak is passed here.
    rise_s: f64,
}

/// Judges a campaign of drops.
///
/// # Errors
/// [`NotJudged`].
pub fn judge(loaded: &Loaded) -> Result<Fitness, NotJudged> {
    let campaign = &loaded.campaign;
    if campaign.rig.kind != Kind::Drop {
        return Err(NotJudged::Kind(campaign.rig.kind.name()));
    }
    if campaign.chain.observed != Observed::Force {
        return Err(NotJudged::NoForce(campaign.chain.observed.column()));
    }
    let stated = campaign.rig.body_stiffness_n_per_m.map_or(0.0, |stiffness| stiffness.value);
    let stand = Stand {
        pad: campaign.rig.pad_stiffness_n_per_m.map(|pad| pad.value),
        piece_kg: campaign.rig.moving_mass_kg.map(|mass| mass.value),
        gravity: campaign.rig.gravity_along_impact_m_per_s2,
    };
    let blows = blows(loaded)?;

    // Which springs are in the rig: all sets, and the stated stiffness where no set has it.
    let mut candidates: Vec<f64> = SpringSet::all().map(SpringSet::stiffness_n_per_m).chain([stated]).collect();
    candidates.sort_by(f64::total_cmp);
    candidates.dedup();
    let mut best = (f64::INFINITY, stated);
    for &stiffness in &candidates {
        let rest = stand.rest(&blows, stiffness, 0.0)?;
        // Where two cannot be told apart, what is stated is believed.
        let better = if stiffness == stated {
            rest <= best.0 * RIVAL
        } else {
            rest * RIVAL < best.0 || (best.1 != stated && rest < best.0)
        };
        if better {
            best = (rest, stiffness);
        }
    }
    let free = stand.refine(&blows, best.1, 0.0)?;
    let friction_n = stand.friction(&blows, free)?;
    let stiffness = stand.refine(&blows, free, friction_n)?;

    let mut drops = Vec::with_capacity(blows.len());
    let mut rest = 0.0;
    for blow in &blows {
        let own = stand.refine(std::slice::from_ref(blow), stiffness, friction_n)?;
        let (gain, _) = stand.fit(blow, own, friction_n)?;
        let (_, left) = stand.fit(blow, stiffness, friction_n)?;
        rest += left / (blow.force_n.len() as f64 * blow.peak_n * blow.peak_n);
        let expected = stand.simulate(blow, stated, 0.0)?;
        drops.push(Drop {
            file: blow.file.clone(),
            mass_kg: blow.mass_kg,
            speed_m_per_s: blow.speed_m_per_s,
            peak_N: blow.peak_n,
            expected_N: expected.peak_n,
            deviation_percent: super::closed_form::deviation_percent(expected.peak_n, blow.peak_n),
            stiffness_N_per_m: own,
            gain,
        });
    }
    let (_, stiffness_se) = mean(drops.iter().map(|drop| drop.stiffness_N_per_m));
    let (gain, gain_se) = mean(drops.iter().map(|drop| drop.gain));
    let mut fitness = Fitness {
        fit_for_use: true,
        findings: Vec::new(),
        stated_stiffness_N_per_m: stated,
        stiffness_N_per_m: stiffness,
        stiffness_se_N_per_m: stiffness_se,
        springs: set_words(stiffness),
        gain,
        gain_se,
        friction_N: friction_n,
        rest_share: (rest / blows.len() as f64).sqrt(),
        drops,
    };
    fitness.findings = findings(&fitness, campaign.rig.body_stiffness_n_per_m.map_or(0.0, |stiffness| stiffness.sd));
    fitness.fit_for_use = fitness.findings.is_empty();
    Ok(fitness)
}

/// The set of springs nearest to a stiffness, in words.
fn set_words(stiffness: f64) -> String {
    SpringSet::near(stiffness, SPRINGS_WITHIN).first().map_or_else(
        || "no set of the rig's springs".to_owned(),
        |set| format!("3·{} + {} N/mm", set.vertex_n_per_m / 1e3, set.centre_n_per_m / 1e3),
    )
}

fn findings(fitness: &Fitness, stated_sd: f64) -> Vec<String> {
    let mut findings = Vec::new();
    let (stated, found) = (fitness.stated_stiffness_N_per_m, fitness.stiffness_N_per_m);
    let within = (SPRINGS_WITHIN * stated).max(2.0 * stated_sd);
    if (found - stated).abs() > within {
        let swapped = SpringSet::near(stated, 1e-6)
            .into_iter()
            .find(|set| (set.swapped().stiffness_n_per_m() / found - 1.0).abs() < SPRINGS_WITHIN);
        findings.push(match swapped {
            Some(set) => format!(
                "the springs are in the wrong places: K is {:.1} N/mm, which is 3·{} + {}; for {:.1} N/mm the {} N/mm springs belong to \
                 the vertices and the {} N/mm one into the middle",
                found / 1e3,
                set.centre_n_per_m / 1e3,
                set.vertex_n_per_m / 1e3,
                stated / 1e3,
                set.vertex_n_per_m / 1e3,
                set.centre_n_per_m / 1e3
            ),
            None => format!(
                "K is {:.1} ± {:.1} N/mm ({}) instead of {:.1} N/mm: other springs, or one that is missing or bent",
                found / 1e3,
                fitness.stiffness_se_N_per_m / 1e3,
                set_words(found),
                stated / 1e3
            ),
        });
    }
    if (fitness.gain - 1.0).abs() > GAIN_WITHIN.max(2.0 * fitness.gain_se) {
        findings.push(format!(
            "the cell reads {:+.1} % (± {:.1} %): calibrate it, or correct the force per code",
            100.0 * (fitness.gain - 1.0),
            100.0 * fitness.gain_se
        ));
    }
    if fitness.friction_N > FRICTION_WITHIN_N {
        findings.push(format!(
            "the guide rubs with some {} N: clean or align it, or the piece is hit off its axis",
            fitness.friction_N
        ));
    }
    if fitness.rest_share > UNEXPLAINED {
        findings.push(format!(
            "{:.0} % of the peak are not explained by springs, gain and friction: `thud diagnose` tries thirty mechanisms",
            100.0 * fitness.rest_share
        ));
    }
    findings
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    // One drop says nothing about its scatter.
    (mean, if count > 1.0 { (squares / (count - 1.0) / count).sqrt() } else { 0.0 })
}

/// The blows in the recordings, each without its zero.
fn blows(loaded: &Loaded) -> Result<Vec<Blow>, NotJudged> {
    let column = Observed::Force.column();
    loaded
        .campaign
        .recordings
        .iter()
        .zip(&loaded.recordings)
        .map(|(entry, recording)| {
            let no_blow = || NotJudged::NoBlow(entry.file.clone());
            let force = recording.channel(column).ok_or_else(no_blow)?;
            let times = recording.times_s();
            let highest = force.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            // The first blow: a mass that bounces comes down again, as hard as before.
            let first = force.iter().position(|&value| value > highest / 2.0).filter(|&first| first > 0);
            let first = first.ok_or_else(no_blow)?;
            let half = first - 1;
            // What lies well before the blow is the zero.
            let quiet = half.saturating_sub(half / 5 + 1);
            let zero = if quiet > 10 { force[..quiet].iter().sum::<f64>() / quiet as f64 } else { 0.0 };
            let after = &force[first..];
            let over = first + after.iter().position(|&value| value - zero < highest / 20.0).unwrap_or(after.len());
            let peak_n = force[first..over].iter().copied().fold(f64::NEG_INFINITY, f64::max) - zero;
            if peak_n.is_nan() || peak_n < 8.0 * loaded.campaign.chain.noise_rms {
                return Err(no_blow());
            }
            let (a, b) = (force[half] - zero, force[half + 1] - zero);
            let share = ((peak_n / 2.0 - a) / (b - a)).clamp(0.0, 1.0);
            let rise_s = times[half] + share * (times[half + 1] - times[half]);
            // From a little before the contact until the blow is over.
            let length = times[over.min(times.len() - 1)] - rise_s;
            let window = |time: f64| time > rise_s - 0.7 * length && time < rise_s + 1.3 * length;
            let cut = times.iter().zip(force).filter(|(time, _)| window(**time));
            let (times_s, force_n) = cut.map(|(time, force)| (*time, force - zero)).unzip();
            Ok(Blow {
                file: entry.file.clone(),
                mass_kg: entry.effective_mass_kg.value,
                speed_m_per_s: entry.impact_speed_m_per_s.value,
                times_s,
                force_n,
                peak_n,
                rise_s,
            })
        })
        .collect()
}

/// What of the rig is not asked about.
struct Stand {
    pad: Option<f64>,
    piece_kg: Option<f64>,
    gravity: f64,
}

/// A simulated blow: force at even intervals from the contact on.
struct Simulated {
    step_s: f64,
    force_n: Vec<f64>,
    peak_n: f64,
    rise_s: f64,
}

impl Simulated {
    fn at(&self, time_s: f64) -> f64 {
        let place = time_s / self.step_s;
        if place < 0.0 {
            return 0.0;
        }
        let index = place as usize;
        match (self.force_n.get(index), self.force_n.get(index + 1)) {
            (Some(one), Some(next)) => one + (place - index as f64) * (next - one),
            _ => 0.0,
        }
    }
}

/// Instants of a simulated blow.
const INSTANTS: usize = 1500;
/// Shifts that are tried on both sides of the alignment at half the peak, in shares of the rise.
const SHIFTS: [f64; 9] = [-0.2, -0.1, -0.05, -0.02, 0.0, 0.02, 0.05, 0.1, 0.2];

impl Stand {
    fn simulate(&self, blow: &Blow, stiffness: f64, friction_n: f64) -> Result<Simulated, NotJudged> {
        self.try_simulate(blow, stiffness, friction_n)
            .map_err(|error| NotJudged::Motion { recording: blow.file.clone(), error })
    }

    fn try_simulate(&self, blow: &Blow, stiffness: f64, friction_n: f64) -> Result<Simulated, NoMotion> {
        let mut effects = Vec::new();
        if let Some(mass) = self.piece_kg {
            effects.push(piece(mass)?);
        }
        if friction_n > 0.0 {
            effects.push(Effect::new("guide-friction", &[("force_N", friction_n)])?);
        }
        let rig = Rig { pad_stiffness_n_per_m: self.pad, gravity_m_per_s2: self.gravity, ..Rig::drop(stiffness) };
        let moving = blow.mass_kg + self.piece_kg.unwrap_or(0.0);
        let until = 2.0 * std::f64::consts::PI * (moving / rig.effective_stiffness_n_per_m()).sqrt();
        let motion =
            rig.strike(&Approach::new(blow.speed_m_per_s, blow.mass_kg), &effects, until, Accuracy::default())?;
        let step_s = until / INSTANTS as f64;
        let force_n: Vec<f64> = (0..=INSTANTS).map(|instant| motion.force_n(step_s * instant as f64)).collect();
        let peak_n = force_n.iter().copied().fold(0.0, f64::max);
        let top = force_n.iter().position(|&force| force == peak_n).unwrap_or(0);
        let half = force_n[..=top].iter().rposition(|&force| force < peak_n / 2.0).unwrap_or(0);
        let next = (half + 1).min(INSTANTS);
        let share = ((peak_n / 2.0 - force_n[half]) / (force_n[next] - force_n[half])).clamp(0.0, 1.0);
        Ok(Simulated { step_s, peak_n, rise_s: step_s * (half as f64 + share), force_n })
    }

    /// The gain that fits best, and the sum of squares that is left.
    fn fit(&self, blow: &Blow, stiffness: f64, friction_n: f64) -> Result<(f64, f64), NotJudged> {
        let simulated = self.simulate(blow, stiffness, friction_n)?;
        let mut best = (1.0, f64::INFINITY);
        for shift in SHIFTS {
            let contact = blow.rise_s - simulated.rise_s * (1.0 + shift);
            let (mut product, mut square, mut own) = (0.0, 0.0, 0.0);
            for (time, force) in blow.times_s.iter().zip(&blow.force_n) {
                let model = simulated.at(time - contact);
                product += force * model;
                square += model * model;
                own += force * force;
            }
            if square > 0.0 {
                let rest = own - product * product / square;
                if rest < best.1 {
                    best = (product / square, rest);
                }
            }
        }
        Ok(best)
    }

    /// What all blows leave, each over its own peak.
    fn rest(&self, blows: &[Blow], stiffness: f64, friction_n: f64) -> Result<f64, NotJudged> {
        let mut sum = 0.0;
        for blow in blows {
            sum += self.fit(blow, stiffness, friction_n)?.1 / (blow.peak_n * blow.peak_n * blow.force_n.len() as f64);
        }
        Ok(sum / blows.len() as f64)
    }

    /// The stiffness near a first value with the least rest: golden section over ± 20 %.
    fn refine(&self, blows: &[Blow], stiffness: f64, friction_n: f64) -> Result<f64, NotJudged> {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let (mut low, mut high) = (stiffness / 1.2, stiffness * 1.2);
        let mut inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
        let mut rests = [self.rest(blows, inner[0], friction_n)?, self.rest(blows, inner[1], friction_n)?];
        while (high - low) > 1e-3 * stiffness {
            if rests[0] < rests[1] {
                high = inner[1];
                inner = [high - GOLDEN * (high - low), inner[0]];
                rests = [self.rest(blows, inner[0], friction_n)?, rests[0]];
            } else {
                low = inner[0];
                inner = [inner[1], low + GOLDEN * (high - low)];
                rests = [rests[1], self.rest(blows, inner[1], friction_n)?];
            }
        }
        Ok(0.5 * (low + high))
    }

    /// The friction with the least rest, where it takes enough of it away; each with the stiffness that fits it best.
    fn friction(&self, blows: &[Blow], stiffness: f64) -> Result<f64, NotJudged> {
        let without = self.rest(blows, stiffness, 0.0)?;
        let smallest = blows.iter().map(|blow| blow.peak_n).fold(f64::INFINITY, f64::min);
        let mut best = (without, 0.0);
        // Friction near the force itself would hold the piece: nothing to be fitted.
        for friction in FRICTIONS_N.into_iter().filter(|friction| *friction > 0.0 && *friction < 0.3 * smallest) {
            let refined = self.refine(blows, stiffness, friction)?;
            let rest = self.rest(blows, refined, friction)?;
            if rest < best.0 {
                best = (rest, friction);
            }
        }
        Ok(if best.0 < (1.0 - BELIEVED) * without { best.1 } else { 0.0 })
    }
}

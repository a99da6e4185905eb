//! A case: a plan, what is hidden in it, and how strongly.

use std::fmt;

use crate::draw::Draw;
use crate::effect::{Confined, Effect, Shaped};
use crate::motion::{self, Sampling, Trace};
use crate::plan::{Estimate, Plan, Planned, Wish};
use crate::strength::{self, Belief, Observation, Retuned};
use crate::world::{Kind, World};

/// A way of concealing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Way {
    /// One or two effects among ordinary imperfections.
    Unnamed,
    /// What is stated already absorbs the effect: peaks agree and R² exceeds 0.98.
    Absorbed,
    /// The effect acts in a few recordings only.
    Conditional,
    /// The effect is not in the contract's list.
    Unlisted,
    /// Nothing is hidden.
    Absent,
}

impl Way {
    /// The word in the answers.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unnamed => "unnamed",
            Self::Absorbed => "absorbed",
            Self::Conditional => "conditional",
            Self::Unlisted => "unlisted",
            Self::Absent => "absent",
        }
    }
}

/// What is to be made.
#[derive(Clone)]
pub struct Request {
    /// The way of concealing.
    pub way: Way,
    /// The effects, each with its own target strength.
    pub effects: Vec<(&'static Effect, f64)>,
    /// Ids that the tool is to leave out of its list: the hidden one, or a decoy.
    pub without: Vec<&'static str>,
    /// What kind of campaign.
    pub wish: Wish,
    /// Same seed, same case.
    pub seed: u64,
}

impl fmt::Debug for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let effects: Vec<_> = self.effects.iter().map(|(effect, d)| (effect.id, d)).collect();
        f.debug_struct("Request").field("way", &self.way).field("effects", &effects).field("seed", &self.seed).finish()
    }
}

/// An effect as it is hidden in a case.
pub struct Hidden {
    /// Which.
    pub effect: &'static Effect,
    /// Its shape.
    pub shaped: Shaped,
    /// How much of it.
    pub scale: f64,
    /// The recordings that it may touch.
    pub touched: Vec<bool>,
    /// Its strength alone.
    pub d: f64,
    /// Its strength where every amount of the other hidden effects is allowed to explain it (to first order).
    pub d_beside_others: f64,
    residuals: Vec<Vec<f64>>,
}

/// A finished case.
pub struct Case {
    /// What was asked for.
    pub request: Request,
    /// The plan, with the stated values as they are written.
    pub plan: Plan,
    /// What is hidden.
    pub hidden: Vec<Hidden>,
    /// Noise-free traces, saturated, with their zero offset.
    pub traces: Vec<Trace>,
    /// The same without what is hidden.
    pub clean: Vec<Trace>,
    /// The best re-tuned baseline of the noise-free recordings.
    pub retuned: Retuned,
    /// Strength of what is not hidden but benign.
    pub benign_d: f64,
    /// How often the draw was begun again.
    pub attempts: usize,
    /// Whether the target was met within five per cent.
    pub on_target: bool,
    /// Lowest R² and worst peak error over the noise rms of the stated baseline, aligned in time and offset only.
    pub stated: StatedFit,
}

impl Case {
    /// What recording `index` truly is, with all that is hidden.
    pub(crate) fn world(&self, index: usize) -> World {
        let mut world = self.plan.world(index);
        for hidden in &self.hidden {
            (hidden.shaped.apply)(hidden.scale, self.plan.recordings[index].like, &mut world);
        }
        world
    }
}

/// How well the baseline fits as it is stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedFit {
    /// Lowest R² of a recording.
    pub r_squared: f64,
    /// Worst peak error over the noise rms.
    pub peak_error_over_noise: f64,
}

/// Strength that benign imperfections may have.
const BENIGN_D: f64 = 1.6;
/// Highest noise of an ordinary chain, N.
const NOISIEST: f64 = 0.8;
/// Below this a piece is no piece, kg.
const LIGHTEST_PIECE_KG: f64 = 3e-5;
/// Highest corner of the anti-alias filter, Hz.
const HIGHEST_CORNER_HZ: f64 = 6e3;
/// How many plans are drawn before a noisier amplifier has to cover the imperfections.
const PLANS: usize = 12;
const TOLERANCE: f64 = 0.045;
const ATTEMPTS: usize = 24;

/// The noise-free traces of a plan with effects at scales.
pub(crate) fn traces(plan: &Plan, hidden: &[(&Shaped, f64)]) -> Vec<Trace> {
    (0..plan.recordings.len()).map(|index| trace(plan, hidden, index)).collect()
}

fn trace(plan: &Plan, hidden: &[(&Shaped, f64)], index: usize) -> Trace {
    let recording = &plan.recordings[index];
    let mut world = plan.world(index);
    for (shaped, scale) in hidden {
        if *scale > 0.0 {
            (shaped.apply)(*scale, recording.like, &mut world);
        }
    }
    let mut trace = motion::run(&world, &recording.sampling);
    saturate(&mut trace.readings, recording.offset, &world);
    trace
}

fn saturate(readings: &mut [f64], offset: f64, world: &World) {
    for reading in readings {
        *reading = (*reading + offset).clamp(-world.chain.clip_n, world.chain.clip_n);
    }
}

/// What the fit sees, with the priors centred on the truth, or on what is stated.
fn observations<'a>(plan: &Plan, traces: &'a [Trace], stated: bool) -> Vec<Observation<'a>> {
    traces
        .iter()
        .enumerate()
        .map(|(index, trace)| {
            let r = &plan.recordings[index];
            let configuration = &plan.configurations[r.configuration];
            let mut baseline = plan.true_baseline(index);
            if stated {
                baseline.speed_m_per_s = r.stated_speed.value;
                baseline.mass_kg = configuration.stated.value;
                baseline.stiffness_n_per_m = 1.0 / (1.0 / plan.stated_body.value + 1.0 / plan.stated_pad.value);
            }
            Observation {
                readings: &trace.readings,
                contact_s: plan.seen_contact_s(index),
                baseline,
                configuration: r.configuration,
                speed_sd: r.stated_speed.sd,
                mass_sd: configuration.stated.sd / configuration.stated.value,
            }
        })
        .collect()
}

fn retune(plan: &Plan, traces: &[Trace], stated: bool) -> Retuned {
    strength::retune(&observations(plan, traces, stated), &plan.belief(), &plan.colour)
}

/// Makes the traces of an ordinary rig as small as they must be to stay out of sight.
fn calm(plan: &mut Plan) -> Option<f64> {
    for round in 0..6 {
        let d = retune(plan, &traces(plan, &[]), false).d;
        if d < BENIGN_D {
            return Some(d);
        }
        // What lowering the traces cannot reach, a noisier amplifier covers.
        let covering = plan.noise_rms * d / (0.9 * BENIGN_D);
        if round >= 3 && covering < NOISIEST {
            plan.noise_rms = rounded(covering);
            plan.colour = plan.colour.at(plan.noise_rms);
            continue;
        }
        let t = &mut plan.traces;
        t.hum_n *= 0.7;
        t.drift_n_per_s *= 0.7;
        t.dashpot_n_s_per_m *= 0.6;
        t.friction_n *= 0.6;
        // The ring's amplitude goes with √m, and its length too.
        t.piece_kg = (t.piece_kg * (1.0 / d).clamp(0.05, 0.6)).max(LIGHTEST_PIECE_KG);
        t.anti_alias_hz = (t.anti_alias_hz * 1.25).min(HIGHEST_CORNER_HZ);
    }
    None
}

/// Draws plans until one keeps its own imperfections out of sight. Where so many do not (long recordings of a fast chain show the
/// smallest ring), the one that came nearest gets the noise that covers it: d goes with one over the noise.
fn quiet(draw: &mut Draw, wish: &Wish) -> (Plan, f64) {
    let mut nearest: Option<(Plan, f64)> = None;
    for _ in 0..PLANS {
        let mut plan = Plan::draw(draw, wish);
        if let Some(benign_d) = calm(&mut plan) {
            return (plan, benign_d);
        }
        let d = retune(&plan, &traces(&plan, &[]), false).d;
        if nearest.as_ref().is_none_or(|(near, near_d)| d * plan.noise_rms < near_d * near.noise_rms) {
            nearest = Some((plan, d));
        }
    }
    let (mut plan, mut d) = nearest.expect("there is at least one plan");
    while d >= BENIGN_D {
        plan.noise_rms = rounded(plan.noise_rms * d / (0.9 * BENIGN_D));
        plan.colour = plan.colour.at(plan.noise_rms);
        d = retune(&plan, &traces(&plan, &[]), false).d;
    }
    (plan, d)
}

/// The recordings that an effect may touch.
fn touched(draw: &mut Draw, plan: &Plan, effect: &Effect, way: Way) -> Vec<bool> {
    let n = plan.recordings.len();
    if way != Way::Conditional {
        return vec![true; n];
    }
    let few = 2 + draw.index(2.min(n.saturating_sub(3)).max(1));
    match effect.confined {
        Confined::Highest => {
            let mut touched = vec![false; n];
            for index in plan.by_peak().into_iter().take(few) {
                touched[index] = true;
            }
            touched
        }
        Confined::Configuration => {
            let odd = draw.index(plan.configurations.len());
            plan.recordings.iter().map(|r| r.configuration == odd).collect()
        }
        Confined::Late => (0..n).map(|i| i + few >= n).collect(),
        Confined::Scattered => {
            let mut order: Vec<usize> = (0..n).collect();
            draw.shuffle(&mut order);
            let mut touched = vec![false; n];
            for index in order.into_iter().take(few) {
                touched[index] = true;
            }
            touched
        }
        Confined::Never => vec![true; n],
    }
}

/// Finds the scale at which `strength` is `target`: false position in the logarithms, kept inside a bracket.
/// Gives the scale and strength that came nearest.
fn search(target: f64, typical: f64, largest: f64, mut strength: impl FnMut(f64) -> f64) -> (f64, f64) {
    let (mut low, mut high) = (None::<(f64, f64)>, None::<(f64, f64)>);
    let mut scale = typical.min(largest);
    let mut best = (scale, 0.0);
    for _ in 0..18 {
        let d = strength(scale);
        if (d / target).ln().abs() < f64::ln(best.1 / target).abs() {
            best = (scale, d);
        }
        if (d / target - 1.0).abs() < TOLERANCE {
            break;
        }
        if d < target {
            if scale >= largest {
                break;
            }
            low = Some((scale, d));
        } else {
            high = Some((scale, d));
        }
        scale = match (low, high) {
            (Some((a, da)), Some((b, db))) => {
                let share = ((target / da).ln() / (db / da).ln()).clamp(0.1, 0.9);
                (a.ln() + share * (b / a).ln()).exp()
            }
            // Strength grows at least about in proportion; further steps are bolder.
            _ => scale * (target / d.max(1e-3)).clamp(0.1, 10.0),
        }
        .min(largest);
    }
    best
}

/// States values that already absorb what is hidden: the re-tuned ones, and speeds that meet every peak.
fn absorb(plan: &Plan, traces: &[Trace]) -> Plan {
    let seen = observations(plan, traces, false);
    // The experimenter's numbers may lie a little further off than one would bet.
    let belief = plan.belief();
    let wide = Belief { stiffness_sd: 1.5 * belief.stiffness_sd, ..belief };
    let wide_seen: Vec<_> = seen
        .iter()
        .map(|o| Observation { speed_sd: 1.5 * o.speed_sd, mass_sd: 1.5 * o.mass_sd, ..o.clone() })
        .collect();
    let fit = strength::retune(&wide_seen, &wide, &plan.colour);
    let mut plan = plan.clone();
    let relative = |e: &Estimate| e.sd / e.value;
    let (body_sd, pad_sd) = (relative(&plan.stated_body), relative(&plan.stated_pad));
    plan.stated_body.value = rounded(plan.body_n_per_m * fit.ln_k.exp());
    plan.stated_pad.value = rounded(plan.pad_n_per_m * fit.ln_k.exp());
    plan.stated_body.sd = body_sd * plan.stated_body.value;
    plan.stated_pad.sd = pad_sd * plan.stated_pad.value;
    for (configuration, ln_m) in plan.configurations.iter_mut().zip(&fit.ln_m) {
        let sd = relative(&configuration.stated);
        configuration.stated.value = rounded(configuration.mass_kg * ln_m.exp());
        configuration.stated.sd = sd * configuration.stated.value;
    }
    let stated = observations(&plan, traces, true);
    let speeds: Vec<f64> = stated
        .iter()
        .enumerate()
        .map(|(index, o)| {
            let mut baseline = o.baseline;
            baseline.speed_m_per_s = plan.recordings[index].speed_m_per_s;
            let peak = o.readings.iter().copied().fold(f64::MIN, f64::max) - plan.recordings[index].offset;
            // The peak of the baseline is in proportion to the speed but for the weight of a falling mass.
            for _ in 0..4 {
                baseline.speed_m_per_s *= 1.0 + (peak - baseline.peak_n()) / peak;
            }
            rounded(baseline.speed_m_per_s)
        })
        .collect();
    for (r, speed) in plan.recordings.iter_mut().zip(speeds) {
        r.stated_speed.value = speed;
    }
    plan
}

/// Five digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// R² and peak error of the stated baseline, only time and offset aligned.
fn stated_fit(plan: &Plan, traces: &[Trace]) -> StatedFit {
    let mut seen = observations(plan, traces, true);
    let tight = Belief { stiffness_sd: 1e-6, repeatability: 1e-6, rate_hz: plan.rate_hz };
    for o in &mut seen {
        o.speed_sd = 1e-6;
        o.mass_sd = 1e-6;
    }
    let fit = strength::retune(&seen, &tight, &plan.colour);
    let (mut r_squared, mut peak_error) = (1.0f64, 0.0f64);
    for (index, o) in seen.iter().enumerate() {
        let [contact, offset, ..] = fit.locals[index];
        let sampler = o.baseline.sampler();
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let model = |i: usize| offset + sampler(i as f64 / plan.rate_hz - contact).value;
        let n = o.readings.len();
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let mean = o.readings.iter().sum::<f64>() / n as f64;
        let total: f64 = o.readings.iter().map(|y| (y - mean).powi(2)).sum();
        let rest: f64 = o.readings.iter().enumerate().map(|(i, y)| (y - model(i)).powi(2)).sum();
        r_squared = r_squared.min(1.0 - rest / total);
        let peak = o.readings.iter().copied().fold(f64::MIN, f64::max);
        let modelled = (0..n).map(model).fold(f64::MIN, f64::max);
        peak_error = peak_error.max((peak - modelled).abs() / plan.noise_rms);
    }
    StatedFit { r_squared, peak_error_over_noise: peak_error }
}

/// Makes a case. It is begun again until every target is met, at most a score of times; then the nearest is given.
#[must_use]
pub fn make(request: &Request) -> Case {
    let mut seeds = Draw::new(request.seed);
    let mut nearest: Option<Case> = None;
    for attempt in 0..ATTEMPTS {
        let mut draw = Draw::new(seeds.seed());
        let (plan, benign_d) = quiet(&mut draw, &request.wish);
        let case = conceal(request, plan, &mut draw, benign_d, attempt);
        let fine = case.on_target
            && (request.way != Way::Absorbed
                || (case.stated.r_squared > 0.98 && case.stated.peak_error_over_noise < 2.0));
        if fine {
            return case;
        }
        let miss = |case: &Case| {
            case.hidden.iter().zip(&request.effects).map(|(h, (_, d))| (h.d / d).ln().abs()).fold(0.0, f64::max)
        };
        if nearest.as_ref().is_none_or(|old| miss(&case) < miss(old)) {
            nearest = Some(case);
        }
    }
    nearest.expect("at least one attempt")
}

fn conceal(request: &Request, plan: Plan, draw: &mut Draw, benign_d: f64, attempt: usize) -> Case {
    let mut plan = plan;
    let absorbed = request.way == Way::Absorbed;
    let mut hidden: Vec<Hidden> = Vec::new();
    for (effect, target) in &request.effects {
        let touched = touched(draw, &plan, effect, request.way);
        let shaped = (effect.shape)(draw, &plan, &touched);
        if effect.id == "moving-piece-inertia" {
            plan.states_piece = draw.chance(0.5).then_some(0.1);
        }
        let fit_at = |scale: f64| {
            let with = traces(&plan, &[(&shaped, scale)]);
            if absorbed { retune(&absorb(&plan, &with), &with, true) } else { retune(&plan, &with, false) }
        };
        let (scale, d) = search(*target, shaped.typical, shaped.largest, |scale| fit_at(scale).d);
        let met = (d / target - 1.0).abs() < 0.05;
        hidden.push(Hidden { effect, shaped, scale, touched, d, d_beside_others: d, residuals: Vec::new() });
        if !met {
            break;
        }
    }
    if hidden.len() > 1 {
        together(&plan, request, &mut hidden);
    }
    let on_target = hidden.len() == request.effects.len()
        && hidden.iter().zip(&request.effects).all(|(h, (_, target))| (h.d / target - 1.0).abs() < 0.05);
    let all: Vec<(&Shaped, f64)> = hidden.iter().map(|h| (&h.shaped, h.scale)).collect();
    let with = traces(&plan, &all);
    let clean = traces(&plan, &[]);
    if absorbed {
        plan = absorb(&plan, &with);
    }
    let retuned = retune(&plan, &with, absorbed);
    let beside: Vec<f64> = (0..hidden.len()).map(|a| beside_others(&hidden, a)).collect();
    for (h, d) in hidden.iter_mut().zip(beside) {
        h.d_beside_others = d;
    }
    let stated = if plan.kind == Kind::Fall {
        StatedFit { r_squared: 1.0, peak_error_over_noise: 0.0 }
    } else {
        stated_fit(&plan, &with)
    };
    Case {
        request: request.clone(),
        plan,
        hidden,
        traces: with,
        clean,
        retuned,
        benign_d,
        attempts: attempt + 1,
        on_target,
        stated,
    }
}

/// Scales effects that act at once until each has its target beside the others: what one changes in the residual of the
/// re-tuned baseline when the others are there. (A stop comes earlier when a pad hardens; a saturation never when the arm
/// gives way before it.)
fn together(plan: &Plan, request: &Request, hidden: &mut [Hidden]) {
    const PASSES: usize = 3;
    let residuals = |hidden: &[Hidden], changed: usize, scale: f64| -> Vec<Vec<f64>> {
        let all: Vec<(&Shaped, f64)> =
            hidden.iter().enumerate().map(|(i, h)| (&h.shaped, if i == changed { scale } else { h.scale })).collect();
        retune(plan, &traces(plan, &all), false).residuals
    };
    let difference = |a: &[Vec<f64>], b: &[Vec<f64>]| -> Vec<Vec<f64>> {
        a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect()
    };
    let norm = |r: &[Vec<f64>]| r.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
    for pass in 0..PASSES {
        let mut settled = true;
        for index in 0..hidden.len() {
            let without = residuals(hidden, index, 0.0);
            let target = request.effects[index].1;
            let now = difference(&residuals(hidden, index, hidden[index].scale), &without);
            hidden[index].d = norm(&now);
            hidden[index].residuals = now;
            if pass + 1 == PASSES || (hidden[index].d / target - 1.0).abs() < TOLERANCE {
                continue;
            }
            settled = false;
            let (scale, d) = search(target, hidden[index].scale, hidden[index].shaped.largest, |scale| {
                norm(&difference(&residuals(hidden, index, scale), &without))
            });
            hidden[index].scale = scale;
            hidden[index].d = d;
        }
        if settled {
            break;
        }
    }
}

/// A recording that is made later, with the same rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Further {
    /// The speed that is set, m/s.
    pub speed_m_per_s: f64,
    /// Index of the configuration.
    pub configuration: usize,
    /// How long it goes on after contact, s.
    pub after_s: f64,
}

/// Appends further recordings to a case. Speeds, springs, zeros and phases vary as they did before; an effect acts as in the latest
/// recording of the same configuration. What was drawn before stays as it was.
pub fn go_on(case: &mut Case, further: &[Further]) {
    /// The middle of what a plan draws.
    const SPRING_SPREAD: f64 = 0.0015;
    let mut draw = Draw::new(case.request.seed ^ 0xd1b5_4a32_d192_ed03);
    let plan = &mut case.plan;
    let all: Vec<(&Shaped, f64)> = case.hidden.iter().map(|h| (&h.shaped, h.scale)).collect();
    for wanted in further {
        let mut of_same = plan.recordings.iter().rev().filter(|r| r.configuration == wanted.configuration);
        let Some(latest) = of_same.next().cloned() else { continue };
        let relative = latest.stated_speed.sd / latest.stated_speed.value;
        let contact_s = draw.uniform(0.03, 0.08);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "seconds times a rate")]
        let samples = ((contact_s + wanted.after_s) * plan.rate_hz) as usize;
        plan.recordings.push(Planned {
            speed_m_per_s: wanted.speed_m_per_s * (1.0 + relative * draw.bounded_normal(2.5)),
            stated_speed: Estimate { value: wanted.speed_m_per_s, sd: rounded(relative * wanted.speed_m_per_s) },
            spring_ln: SPRING_SPREAD * draw.normal(),
            sampling: Sampling { samples, contact_s, ..latest.sampling },
            hum_phase: draw.uniform(0.0, std::f64::consts::TAU),
            offset: draw.uniform(-1.0, 1.0),
            ..latest
        });
        case.traces.push(trace(plan, &all, plan.recordings.len() - 1));
    }
}

/// Norm of the part of one residual that the other one, at any amount, does not imitate.
fn beside_others(hidden: &[Hidden], index: usize) -> f64 {
    let own = &hidden[index];
    let mut d = own.d;
    for (other_index, other) in hidden.iter().enumerate() {
        if other_index == index || own.residuals.is_empty() || other.residuals.is_empty() {
            continue;
        }
        let product = |a: &Hidden, b: &Hidden| -> f64 {
            a.residuals.iter().flatten().zip(b.residuals.iter().flatten()).map(|(a, b)| a * b).sum()
        };
        let cosine = product(own, other) / (product(own, own) * product(other, other)).sqrt().max(1e-300);
        d = d.min(own.d * (1.0 - cosine * cosine).max(0.0).sqrt());
    }
    d
}

/// Share of the energy of whitened `signals` before contact, while rising, while falling and after separation.
#[must_use]
pub fn phases(case: &Case, signals: &[Vec<f64>]) -> [f64; 4] {
    let mut shares = [0.0; 4];
    for (index, signal) in signals.iter().enumerate() {
        let contact = case.plan.seen_contact_s(index);
        let delay = contact - case.plan.recordings[index].sampling.contact_s;
        let trace = &case.traces[index];
        for (i, value) in signal.iter().enumerate() {
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
            let t = i as f64 / case.plan.rate_hz;
            // One sample of margin: the filter rounds the corner.
            let phase = if t < contact - 1.5 / case.plan.rate_hz {
                0
            } else if t < trace.peak_s + delay {
                1
            } else if t < trace.separation_s + delay {
                2
            } else {
                3
            };
            shares[phase] += value * value;
        }
    }
    let total: f64 = shares.iter().sum();
    shares.map(|share| share / total.max(1e-300))
}

/// What the effects changed, before any re-tuning, whitened.
#[must_use]
pub fn signature(case: &Case) -> Vec<Vec<f64>> {
    case.traces
        .iter()
        .zip(&case.clean)
        .map(|(with, clean)| {
            let mut difference: Vec<f64> = with.readings.iter().zip(&clean.readings).map(|(a, b)| a - b).collect();
            case.plan.colour.whiten(&mut difference);
            difference
        })
        .collect()
}

/// The re-tuned baseline of recording `index`.
#[must_use]
pub fn retuned_baseline(case: &Case, index: usize) -> crate::baseline::Baseline {
    let seen = observations(&case.plan, &case.traces, case.request.way == Way::Absorbed);
    case.retuned.baseline(&seen[index], index)
}

#[cfg(test)]
mod tests;

//! Which mechanisms could explain the rest: score tests on what the fit's own coordinates cannot imitate.
//!
//! A mechanism's signature s is what it changes in the whitened recordings when it enters with a finite strength. Freed of all that
//! the coordinates can do, s̃ = P·s with P = 1 − J(JᵀJ)⁻¹Jᵀ, it is compared with the residual r of the fit:
//!
//! ```text
//!   z = s̃ᵀr/‖s̃‖     χ² falls by about z² when it enters, with strength a = z/‖s̃‖ times the one tried
//!   1 − ‖s̃‖²/‖s‖²   the part that re-tuning would absorb
//! ```
//!
//! That line is trusted a few times up and down from the strength that was tried; where a must stay within such bounds, χ² falls by
//! 2·a·z·‖s̃‖ − a²·‖s̃‖² only, and the score is the root of that. Of a mechanism that cannot be scaled (its first value is a place, not
//! a strength) a is at most 1.
//!
//! Source: score (Lagrange multiplier) test, C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50.

use nalgebra::DVector;
use rayon::prelude::*;
use thud_sim::mechanism::{Effect, Mechanism, Scale, Search};
use thud_sim::rig::Impact;

use super::candidate::Reach;
use super::fit::{Fit, Imitation, Normal, Tangent};
use super::layout::{Entrant, Point, Scope};
use super::predict;
use super::problem::Problem;
use super::repeats::Repeat;
use super::subset::Subset;

/// A part of a search's cost is its scores: so many times what the motions of a start cost are to be paid for.
const SCREENING: u64 = 2;
/// A signature of less than this whitened norm cannot be seen.
const INVISIBLE: f64 = 1e-3;
/// A signature of which more than this is imitated is taken again at a smaller strength.
const MOSTLY_ABSORBED: f64 = 0.98;
/// How much smaller.
const SMALL_STRENGTH: f64 = 0.05;
/// Instants that are tried over the longest contact.
const INSTANTS: usize = 40;
/// How often the way between two of them is halved around the best one.
const HALVINGS: i32 = 4;
/// Rounds in which the recordings that ask for a signature and its strength agree.
const SETTLING: usize = 6;
/// How many times the strength that was tried a signature is believed to grow in proportion.
const LONGEST_WAY: f64 = 10.0;
/// Of two phases a quarter of a turn apart that show themselves almost alike this part of their squares is none.
const LIKE: f64 = 0.01;

/// A mechanism at one start, compared with the rest.
#[derive(Clone, Debug)]
pub struct Screened {
    /// The mechanism with the strength that the score tells, as far as it is possible.
    pub entrant: Entrant,
    /// The score, in standard deviations; positive where the mechanism with its possible sign would help.
    pub z: f64,
    /// What part of its signature re-tuning absorbs.
    pub absorbed: f64,
    /// Norm of the projected signature, at the strength that was tried.
    pub visible: f64,
    /// The strength that was tried.
    pub tried: Effect,
    /// Where the coordinates of the fit go when it enters, to first order: they need no longer imitate it.
    pub beside: Point,
    /// Which start of its mechanism it is.
    pub start: usize,
}

/// Scores of all given mechanisms at all their starts, everywhere and in single configurations.
#[must_use]
pub fn screen(
    problem: &Problem,
    fit: &Fit,
    tangent: &Tangent,
    reach: &Reach,
    mechanisms: &[&'static Mechanism],
) -> Vec<Screened> {
    let Some(normal) = tangent.normal(0.0) else { return Vec::new() };
    let mut starts: Vec<(usize, Effect)> =
        mechanisms.iter().flat_map(|mechanism| reach.starts(mechanism).into_iter().enumerate()).collect();
    // Where the motions themselves are long to follow, a coarser grid: every second start of each mechanism, or every third.
    let paid = problem.work.purse().pays_for(starts.iter().map(|_| SCREENING * fit.motions_ns));
    let every = starts.len().div_ceil(paid.max(1));
    starts.retain(|(start, _)| start % every == 0);
    let configurations = problem.configurations.len();
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    // A fit is never quite where it goes to; what is left of its gradient would look like a score of whatever it can imitate.
    let gradients = fit.gradients(problem, tangent, &all);
    let motions: Option<Vec<Impact>> =
        all.par_iter().map(|number| predict::strike(problem, &fit.layout, &fit.point, *number).ok()).collect();
    let Some(motions) = motions else { return Vec::new() };
    let shown = Shown { problem, fit, tangent, gradients: &gradients.1, motions: &motions, repeats: &reach.repeats };
    let projection = Projection { problem, fit, tangent, normal: &normal, gradients: &gradients };
    starts
        .par_iter()
        .map(|(start, effect)| {
            let mut scopes = vec![Scope::Everywhere];
            let in_some = !either_sign(effect) || has_usual_form(effect);
            if configurations > 1 && in_some {
                scopes.extend((0..configurations).map(Scope::Configuration));
            }
            let Some((own, signature)) = turned(shown, effect) else { return Vec::new() };
            let Some(mut whole) = projection.score(&signature, Scope::Everywhere) else { return Vec::new() };
            let (mut tried, mut own, mut signature) = (effect.clone(), own, signature);
            let mut longest = LONGEST_WAY;
            // Of a signature that is nearly all imitated a finite strength shows its curvature, not its direction.
            if whole.absorbed > MOSTLY_ABSORBED
                && scale_strength(&mut tried, SMALL_STRENGTH).is_some()
                && let Some((smaller_own, smaller)) = turned(shown, &tried)
                && let Some(score) = projection.score(&smaller, Scope::Everywhere)
            {
                (own, signature, whole) = (smaller_own, smaller, score);
                longest = LONGEST_WAY / SMALL_STRENGTH;
            } else {
                tried = effect.clone();
            }
            if in_some {
                let signs: &[f64] = if either_sign(effect) { &[1.0, -1.0] } else { &[1.0] };
                let touched = signs.iter().filter_map(|sign| projection.touched(&signature, *sign));
                scopes.extend(touched.map(Scope::Recordings));
            }
            let each = projection.each(effect.mechanism(), &signature, &tried);
            scopes
                .into_iter()
                .filter_map(|scope| {
                    let score =
                        if scope == Scope::Everywhere { whole.clone() } else { projection.score(&signature, scope)? };
                    let mut scaled = tried.clone();
                    // A strength of either sign was tried with next to nothing of it, where it is in proportion.
                    let longest = if either_sign(effect) { f64::INFINITY } else { longest };
                    let wanted = (score.z / score.visible).clamp(-longest, longest);
                    let (z, times) = match scale_strength(&mut scaled, wanted) {
                        Some(times) => (score.gain(times).max(0.0).sqrt(), times),
                        None => (score.z.min(0.0), 0.0),
                    };
                    Some(Screened {
                        entrant: Entrant { effect: scaled, scope, own: own.clone() },
                        z,
                        absorbed: score.absorbed,
                        visible: score.visible,
                        tried: tried.clone(),
                        beside: fit.layout.moved(&fit.point, &score.imitation, -times),
                        start: *start,
                    })
                })
                .chain(each.map(|screened| Screened { start: *start, ..screened }))
                .collect()
        })
        .collect::<Vec<Vec<Screened>>>()
        .into_iter()
        .flatten()
        .collect()
}

struct Projection<'a> {
    problem: &'a Problem,
    fit: &'a Fit,
    tangent: &'a Tangent,
    normal: &'a Normal,
    gradients: &'a (DVector<f64>, Vec<DVector<f64>>),
}

#[derive(Clone)]
struct Score {
    z: f64,
    visible: f64,
    absorbed: f64,
    imitation: Imitation,
}

impl Score {
    /// By how much χ² falls when the signature enters so many times as strong as it was tried.
    fn gain(&self, times: f64) -> f64 {
        times * self.visible * (2.0 * self.z - times * self.visible)
    }
}

impl Projection<'_> {
    /// The recordings that ask for a signature of this sign by themselves, all with one strength: the one that asks loudest, and as many
    /// more as each takes off more than its choice costs. `None`: none, or more than half of them.
    fn touched(&self, signature: &[Vec<f64>], sign: f64) -> Option<Subset> {
        let count = signature.len();
        let asks: Vec<(f64, f64)> =
            self.asks(signature).into_iter().map(|(along, square)| (sign * along, square)).collect();
        let loudness = |(along, square): (f64, f64)| if square > 0.0 { along * along.abs() / square } else { 0.0 };
        let loudest = (0..count).max_by(|a, b| loudness(asks[*a]).total_cmp(&loudness(asks[*b])))?;
        let choice = 2.0 * (count as f64).ln();
        let mut some: Vec<usize> = vec![loudest];
        for _ in 0..SETTLING {
            let sum = some.iter().fold((0.0, 0.0), |sum, number| (sum.0 + asks[*number].0, sum.1 + asks[*number].1));
            if sum.0 <= 0.0 || sum.1 <= 0.0 {
                return None;
            }
            let strength = sum.0 / sum.1;
            let asking = |number: &usize| strength * (2.0 * asks[*number].0 - strength * asks[*number].1) > choice;
            let now: Vec<usize> = (0..count).filter(asking).collect();
            if now.is_empty() || now == some {
                break;
            }
            some = now;
        }
        (2 * some.len() <= count).then(|| some.into_iter().collect())
    }

    /// A mechanism of which each recording may have its own value, in those that ask for any of it by more than it costs, each with the
    /// strength that it asks for. `None`: the mechanism is none of these, or none asks.
    fn each(&self, mechanism: &Mechanism, signature: &[Vec<f64>], tried: &Effect) -> Option<Screened> {
        let strength = &mechanism.parameters[0];
        // Where a signature stands in each recording has been chosen for one strength: that is freed once it stands (`instants.rs`).
        if !mechanism.by_recording.contains(&strength.name) || tried.is_of_each_impact() || !has_usual_form(tried) {
            return None;
        }
        let count = signature.len() as f64;
        let price = 2.0 * count.ln() + (self.problem.rows() as f64 / count).ln();
        let strengths: Vec<f64> = self
            .asks(signature)
            .into_iter()
            .map(|(along, square)| if along.powi(2) > price * square { along / square } else { 0.0 })
            .collect();
        let some: Subset = (0..strengths.len()).filter(|number| strengths[*number] != 0.0).collect();
        if some.is_empty() {
            return None;
        }
        let scope = Scope::EachRecording(some);
        let all: Vec<Vec<f64>> = signature
            .iter()
            .zip(&strengths)
            .map(|(values, strength)| values.iter().map(|value| value * strength).collect())
            .collect();
        let score = self.score(&all, scope)?;
        let times = (score.z / score.visible).max(0.0);
        let own = strengths.iter().map(|strength| strength * times * tried.value(0)).collect();
        Some(Screened {
            entrant: Entrant { effect: tried.clone(), scope, own },
            z: score.gain(times).max(0.0).sqrt(),
            absorbed: score.absorbed,
            visible: score.visible,
            tried: tried.clone(),
            beside: self.fit.layout.moved(&self.fit.point, &score.imitation, -times),
            start: 0,
        })
    }

    /// How each recording goes along with a signature, and the signature's square there, both freed of what the recording's own coordinates
    /// can do.
    fn asks(&self, signature: &[Vec<f64>]) -> Vec<(f64, f64)> {
        let recordings = signature.iter().zip(&self.gradients.1).enumerate();
        recordings
            .map(|(number, (values, gradient))| {
                let (along, products) = self.tangent.local_scores(number, &[values], self.fit, gradient);
                (along[0], products[(0, 0)])
            })
            .collect()
    }

    /// `None`: nothing of it can be seen there.
    fn score(&self, signature: &[Vec<f64>], scope: Scope) -> Option<Score> {
        let recordings = self.problem.recordings.iter().enumerate();
        let parts: Vec<Vec<f64>> = signature
            .iter()
            .zip(recordings)
            .map(
                |(values, (number, recording))| {
                    if scope.includes(number, recording.configuration) { values.clone() } else { Vec::new() }
                },
            )
            .collect();
        let whole: f64 = parts.iter().flatten().map(|s| s * s).sum();
        if whole < INVISIBLE * INVISIBLE {
            return None;
        }
        let (global, locals) = self.tangent.transposed(&parts);
        let imitation = self.normal.solve(&global, &locals);
        let along = |of: &(DVector<f64>, Vec<DVector<f64>>)| {
            of.0.dot(&imitation.globals) + of.1.iter().zip(&imitation.locals).map(|(a, b)| a.dot(b)).sum::<f64>()
        };
        let imitated = along(&(global, locals));
        let visible = (whole - imitated).max(0.0).sqrt();
        if visible < INVISIBLE || visible < 1e-5 * whole.sqrt() {
            return None;
        }
        let score: f64 = parts
            .iter()
            .zip(&self.fit.residuals)
            .flat_map(|(values, residual)| values.iter().zip(residual))
            .map(|(s, r)| s * r)
            .sum();
        let z = (score - along(self.gradients)) / visible;
        Some(Score { z, visible, absorbed: imitated / whole, imitation })
    }
}

/// A mechanism's signature with each recording's own value, phase or instant, where it fits the residual best, and those values (none
/// where the mechanism has none).
fn turned(shown: Shown<'_>, effect: &Effect) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let fit = shown.fit;
    let parameters = effect.mechanism().parameters;
    let at = |place: usize, value: f64| {
        let mut effect = effect.clone();
        effect.set_value(place, value).ok()?;
        shown.signature(&Entrant::everywhere(effect))
    };
    let Some(place) = effect.first_own() else {
        let mut change = at(0, effect.value(0))?;
        if either_sign(effect) {
            // Half of the difference of both signs: its bend is not mistaken for what nothing imitates.
            let other = at(0, -effect.value(0))?;
            for (change, other) in change.iter_mut().flatten().zip(other.iter().flatten()) {
                *change = 0.5 * (*change - other);
            }
        }
        return Some((Vec::new(), change));
    };
    let own: Vec<f64> = if parameters[place].search == Search::EachInstant {
        instants(shown, effect)
    } else {
        let first = at(place, effect.value(place))?;
        let second = at(place, effect.value(place) + std::f64::consts::FRAC_PI_2)?;
        let both = first.iter().zip(&second).zip(shown.gradients).enumerate();
        both.map(|(number, ((first, second), gradient))| {
            let (along, mut products) = shown.tangent.local_scores(number, &[first, second], fit, gradient);
            // Of two that are nearly the same one, not the difference.
            let size = products.trace();
            (0..2).for_each(|place| products[(place, place)] += LIKE * size);
            let parts = products.cholesky().map_or(along.clone(), |factor| factor.solve(&along));
            effect.value(place) + parts[1].atan2(parts[0])
        })
        .collect()
    };
    let entrant = Entrant { own: own.clone(), ..Entrant::everywhere(effect.clone()) };
    Some((own, shown.signature(&entrant)?))
}

/// Whether what is held of it, a choice of form, is as usual. Of a mere factor few recordings do not say which form it has: what is wrong in three
/// of four is bent over the fourth.
fn has_usual_form(effect: &Effect) -> bool {
    let mut parameters = effect.mechanism().parameters.iter().enumerate();
    parameters.all(|(place, parameter)| !parameter.is_held() || effect.value(place) == parameter.typical)
}

/// Whether a mechanism's strength has either sign, with none of it at 0.
fn either_sign(effect: &Effect) -> bool {
    let strength = &effect.mechanism().parameters[0];
    strength.scale == Scale::Linear && strength.null == Some(0.0) && strength.range.0 < 0.0
}

/// For each recording the instant, s after contact, at which a signature of any strength takes most off its sum of squares: spread over the
/// contact or the fall, at what is repeated, and ever nearer to the best of these. Where even half of it would be too much it comes when all
/// is over.
fn instants(shown: Shown<'_>, effect: &Effect) -> Vec<f64> {
    let Shown { problem, fit, tangent, gradients, repeats, .. } = shown;
    let count = problem.recordings.len();
    let longest_s = (0..count).map(|number| problem.eventful_s(number)).fold(0.0, f64::max);
    let over_s = |number: usize| {
        let times_s = &problem.recordings[number].raw.times_s;
        times_s[times_s.len() - 1] - fit.layout.contact_s(problem, &fit.point, number)
    };
    let mut best: Vec<Placed> =
        (0..count).map(|_| Placed { z: 0.0, instant_s: 0.5 * longest_s, is_too_much: true }).collect();
    let attempt = |best: &mut Vec<Placed>, tried: Vec<f64>| {
        let entrant = Entrant { own: tried.clone(), ..Entrant::everywhere(effect.clone()) };
        let Some(signature) = shown.signature(&entrant) else { return };
        for (number, (values, gradient)) in signature.iter().zip(gradients).enumerate() {
            let (along, products) = tangent.local_scores(number, &[values], fit, gradient);
            let z = along[0] / products[(0, 0)].sqrt();
            if z > best[number].z {
                let is_too_much = along[0] < 0.25 * products[(0, 0)];
                best[number] = Placed { z, instant_s: tried[number], is_too_much };
            }
        }
    };
    let apart_s = longest_s / INSTANTS as f64;
    for place in 0..INSTANTS {
        attempt(&mut best, vec![apart_s * (place as f64 + 0.5); count]);
    }
    for rank in 0..repeats.iter().map(Vec::len).max().unwrap_or(0) {
        let since_contact_s =
            |number: usize, run: &Repeat| run.from_s - fit.layout.contact_s(problem, &fit.point, number);
        let runs = repeats.iter().zip(&best).enumerate();
        let tried = runs
            .map(|(number, (runs, best))| runs.get(rank).map_or(best.instant_s, |run| since_contact_s(number, run)));
        let tried = tried.collect();
        attempt(&mut best, tried);
    }
    for halving in 1..=HALVINGS {
        for step_s in [-apart_s, apart_s].map(|apart_s| apart_s * 0.5_f64.powi(halving)) {
            let tried = best.iter().map(|placed| placed.instant_s + step_s).collect();
            attempt(&mut best, tried);
        }
    }
    let chosen = best.into_iter().enumerate();
    chosen.map(|(number, placed)| if placed.is_too_much { over_s(number) } else { placed.instant_s }).collect()
}

/// A signature at an instant of a recording.
#[derive(Clone, Copy, Debug)]
struct Placed {
    /// How loudly the recording asks for it there, in standard deviations.
    z: f64,
    instant_s: f64,
    /// Whether half of it would make the recording worse.
    is_too_much: bool,
}

/// What the fit shows, with its derivatives and its motions.
#[derive(Clone, Copy)]
struct Shown<'a> {
    problem: &'a Problem,
    fit: &'a Fit,
    tangent: &'a Tangent,
    /// Of what each recording has for itself.
    gradients: &'a [DVector<f64>],
    motions: &'a [Impact],
    /// Runs of equal values in each recording.
    repeats: &'a [Vec<Repeat>],
}

impl Shown<'_> {
    /// Whitened change of every recording when the mechanism enters, everything else as fitted.
    fn signature(self, entrant: &Entrant) -> Option<Vec<Vec<f64>>> {
        let Self { problem, fit, motions, .. } = self;
        let layout = fit.layout.with(problem, entrant.clone());
        let point = layout.start_from(problem, &fit.layout, &fit.point);
        let seen_only = entrant.effect.mechanism().is_seen_only();
        motions
            .iter()
            .enumerate()
            .map(|(recording, motion)| {
                let impact = if seen_only {
                    predict::through(problem, &layout, &point, recording, motion)
                } else {
                    predict::strike(problem, &layout, &point, recording)
                };
                let with = predict::read(problem, &layout, &point, recording, &impact.ok()?, 0.0);
                let mut change: Vec<f64> =
                    with.iter().zip(&fit.model[recording]).map(|(with, without)| with - without).collect();
                if change.iter().any(|value| !value.is_finite()) {
                    return None;
                }
                problem.recordings[recording].whiten(&mut change);
                Some(change)
            })
            .collect()
    }
}

/// Multiplies the effect's distance from its absence, as far as it is possible and not beyond anything likely, and says how many
/// times it became. `None` where that is not possible (the wrong sign).
pub fn scale_strength(effect: &mut Effect, times: f64) -> Option<f64> {
    let parameter = &effect.mechanism().parameters[0];
    if parameter.search != Search::Strength {
        // Its values are another shape each. A refit will find the one with less of it, but not much more.
        return (times > 0.0).then_some(times.min(1.0));
    }
    let value = effect.value(0);
    let (low, high) = parameter.plausible;
    let (low, high) = (
        parameter.range.0.max(if low > 0.0 { 0.03 * low } else { f64::NEG_INFINITY }),
        parameter.range.1.min(if high > 0.0 { 10.0 * high } else { f64::INFINITY }),
    );
    if parameter.range.0 >= 0.0 && times <= 0.0 {
        return None;
    }
    let (scaled, became): (f64, fn(f64, f64, f64) -> f64) = match parameter.null {
        // A time constant: half of it is twice the effect.
        Some(null) if null.is_infinite() => (value / times, |before, after, _| before / after),
        Some(null) => (null + (value - null) * times, |before, after, null| (after - null) / (before - null)),
        None => return Some(times.min(1.0)),
    };
    let scaled = scaled.clamp(low, high);
    effect.set_value(0, scaled).ok()?;
    Some(became(value, scaled, parameter.null.unwrap_or(0.0)))
}

//! The begin of a force that a moving piece passes on: the arc, and the piece's ring about it.
//!
//! Robot m_R, pad k_p, piece m, springs k_b; the cell sees k_b·x_p (and the springs' damping):
//!
//! ```text
//! m_R·ẍ = −k_p·(x − x_p),   m·ẍ_p = k_p·(x − x_p) − k_b·x_p,   ẋ(0) = v, all else 0
//! ```
//!
//! has two modes, both sines since neither displacement nor acceleration is there at first, and x_p begins without speed:
//!
//! ```text
//! F = A·( sin ωu − (ω/Ω)·sin Ωu ),   Ω² ≈ (k_p + k_b)/m,   A·ω = s ≈ v·k_p·k_b/(k_p + k_b)
//! ```
//!
//! So height and phase of the ring are tied to the slope and the contact. With damping (c_p of the pad, c_b of the springs,
//! K = k_p + k_b) the arc leads by τ = c_p/k_p + c_b/k_b − (c_p + c_b)/K and fades with e^(−ω²τu/2); the ring decays, and the
//! force begins at zero with a slope of s·4ζ_pζ_b·K²/(k_p·k_b), which is (τΩ)²·s where pad and springs share the lead. Fitted is
//!
//! ```text
//! F(u) = s·{ arc(u + τ)·e^(−(qτ/2 + γ)(u + τ)) − e^(−δu)·[ τ·cos Ωu + ((1 + δτ)/Ω − τ²Ω)·sin Ωu ] },   u = t − t₀ ≥ 0
//! ```
//!
//! with the unknowns s, q (the arc's curvature, ω²), t₀, τ, Ω, δ and γ, by Levenberg–Marquardt from some frequencies between
//! 40 Hz and 1 kHz. The ring's phase fixes the arc's own start t₀ − τ; what parts t₀ from it is the expected lead, the ring's
//! height and the fading, each weak. γ is what the arc loses otherwise (a pad after Hunt and Crossley): at first it is held at
//! none, and only where no ring is found so is it let go. The lead is expected between none and twice the angle 0.12 of the
//! ring: a ring in another phase, or of another height, is not that of a struck piece.
//!
//! A hard pad cannot pull: where m·Ω is large against the springs, the piece flies off after half a period and rattles between
//! robot and springs. Then only that half is fitted.
//!
//! The search evaluates some four to twenty-five thousand points (a hundred thousand at worst), each some thousand cycles of a
//! Cortex-M4F by estimate: 25 to 150 ms at low priority, after the impact is over. Not yet measured on the chip.
//!
//! It is believed only where the arc over the same stretch does not fit and this does.

use super::arc::Shape;
use super::flank::{Arc, Flank};
use super::force::{Force, PIECE};
use super::least_squares::Normal;
use crate::capture::Curve;

/// Lowest and highest frequency of a ring that is looked for, Hz.
const LOWEST: f32 = 40.0;
const HIGHEST: f32 = 1000.0;
/// Ratio of the frequencies that the fits begin with.
const STEP: f32 = 1.3;
/// Periods of the first stretch.
const FIRST_PERIODS: f32 = 0.6;
/// A hard pad lets go of the piece after some half a period, and what comes then is no ring: either the fit ends before that,
/// or it goes on so long that nobody has let go. Periods.
const SHORT_PERIODS: (f32, f32) = (0.45, 0.8);
const LONG_PERIODS: f32 = 1.5;
/// As the misfit that ends the growing, but for the stretch that is believed: 1.4 deviations of χ².
const CLEAN_MISFIT: f32 = 2.0;
/// Shortest period that can be followed, samples.
const SHORTEST_PERIOD: f32 = 8.0;
/// Points for each period.
const POINTS_PER_PERIOD: f32 = 16.0;
/// A long stretch has no more points than this: they get coarser, down to so many for each period, and what comes after the last
/// one is not looked at.
const MOST_POINTS: usize = 128;
const FEWEST_PER_PERIOD: f32 = 8.0;
/// The deviation at which growing stops, s.
const ENOUGH: f32 = 15e-6;
/// How far before the begin a stretch begins, as angle of the ring.
const LEAD_IN: f32 = 1.0;
/// Gauss–Newton steps for each stretch.
const STEPS: usize = 14;
/// Expected lead, as angle of the ring over its damping ratio: so much, give or take the same.
const LEAD: f32 = 4.0;
/// Expected damping ratio and its deviation.
const DAMPING: (f32, f32) = (0.03, 0.1);
/// Expected γ: none, give or take this share of the arc's own pulsation; held first, then free.
const FADING: [f32; 2] = [1e-3, 0.3];
/// By how much the ring must lower χ², in units of Schwarz's ln n: one for each unknown that the arc has not.
const WORTH: f32 = 4.0;

/// Unknowns, in this order.
const CURVATURE: usize = 1;
const BEGIN: usize = 2;
const LEAD_PLACE: usize = 3;
const DECAY: usize = 5;
const FADING_PLACE: usize = 6;
const UNKNOWNS: usize = 7;

/// Arc and ring. Lengths in samples.
#[derive(Clone, Copy, Debug)]
pub struct Ringing {
    /// The arc; its begin is the contact's.
    pub arc: Arc,
    /// By how much the arc starts before the contact.
    lead: f32,
    /// γ: what the arc loses besides the fading that comes with the lead, 1/sample.
    fading: f32,
    /// Ω, radians per sample.
    pulsation: f32,
    /// δ, 1/sample.
    decay: f32,
}

/// A fitted stretch.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// What was fitted.
    pub ringing: Ringing,
    /// Predicted deviation of the begin, samples.
    pub deviation: f32,
    /// χ² of the points.
    squares: f32,
    points: usize,
    /// Samples from the begin.
    length: f32,
    stretch: Stretch,
}

impl Fitted {
    fn misfit(&self) -> f32 {
        self.squares / self.points.max(1) as f32
    }

    /// Nothing is left to look for.
    fn explains(&self, whole: f32) -> bool {
        self.length >= 0.98 * whole
    }

    /// Longer, or as long and nearer.
    fn is_better_than(&self, other: &Self) -> bool {
        let ratio = self.length / other.length;
        ratio > 1.02 || (ratio > 0.98 && self.misfit() < other.misfit())
    }

    fn fits(&self) -> bool {
        self.misfit() <= Flank::allowed_misfit(self.points)
    }
}

impl Ringing {
    /// Force and its gradient at a point that is the mean of `width` samples.
    #[cfg(test)]
    fn at(&self, position: f32, width: f32) -> (f32, [f32; UNKNOWNS]) {
        Walk::new(self, width).at(position)
    }

    /// The next guess, within what the linearisation can mean and what is possible.
    fn moved_by(&self, step: [f32; UNKNOWNS], flank: &Flank) -> Self {
        let [by_slope, by_curvature, by_begin, by_lead, by_pulsation, by_decay, by_fading] = step;
        let (slope, pulsation) = (self.arc.slope, self.pulsation);
        let quarter = flank.prior_curvature();
        let far = 0.5 / pulsation;
        let begin = self.arc.begin + by_begin.max(-far).min(far);
        let arc = Arc {
            slope: slope + by_slope.max(-0.5 * slope).min(0.5 * slope),
            curvature: (self.arc.curvature + by_curvature).max(-4.0 * quarter).min(6.0 * quarter),
            begin: begin.max(-(flank.reach as f32)).min(flank.to_peak.max(1.0)),
        };
        let pulsation = pulsation + by_pulsation.max(-0.15 * pulsation).min(0.15 * pulsation);
        Self {
            arc,
            lead: (self.lead + by_lead.max(-far).min(far)).max(-1.0 / pulsation).min(1.0 / pulsation),
            fading: self.fading + by_fading,
            pulsation,
            decay: (self.decay + by_decay).max(0.0).min(0.5 * pulsation),
        }
    }
}

/// Force and gradient at one point after the other, equally far apart: sine, cosine and both fadings go on by one
/// multiplication each, instead of being computed anew. Over 128 steps that strays by some 128·2⁻²⁴ = 8e-6, below what
/// [`Flank::variance_of_mean`] allows the model.
struct Walk {
    ringing: Ringing,
    /// Where the last point was, samples after the begin; none before it.
    last: Option<f32>,
    /// Distance of the points, and the mean of a sine over it.
    width: f32,
    smoothing: f32,
    rate: f32,
    turn: (f32, f32),
    decay: f32,
    fade: f32,
    /// At the last point: e^(−δu)·(sin Ωu, cos Ωu), and the arc's fading.
    sine: f32,
    cosine: f32,
    fading: f32,
}

impl Walk {
    fn new(ringing: &Ringing, width: f32) -> Self {
        let half = 0.5 * ringing.pulsation * width;
        let rate = 0.5 * ringing.arc.curvature * ringing.lead + ringing.fading;
        let angle = ringing.pulsation * width;
        Self {
            ringing: *ringing,
            last: None,
            width,
            smoothing: (1.0 - half * half / 6.0).max(0.0),
            rate,
            turn: (libm::sinf(angle), libm::cosf(angle)),
            decay: libm::expf(-ringing.decay * width),
            fade: libm::expf(-rate * width),
            sine: 0.0,
            cosine: 0.0,
            fading: 0.0,
        }
    }

    fn step_to(&mut self, u: f32) {
        if self.last.is_some() {
            let (turn_sine, turn_cosine) = self.turn;
            let (sine, cosine) = (self.sine, self.cosine);
            self.sine = self.decay * (sine * turn_cosine + cosine * turn_sine);
            self.cosine = self.decay * (cosine * turn_cosine - sine * turn_sine);
            self.fading *= self.fade;
        } else {
            let angle = self.ringing.pulsation * u;
            let envelope = libm::expf(-self.ringing.decay * u) * self.smoothing;
            (self.sine, self.cosine) = (envelope * libm::sinf(angle), envelope * libm::cosf(angle));
            self.fading = libm::expf(-self.rate * (u + self.ringing.lead));
        }
        self.last = Some(u);
    }

    /// At `position`, one width after the point before.
    fn at(&mut self, position: f32) -> (f32, [f32; UNKNOWNS]) {
        let Ringing { arc: Arc { begin, slope, curvature }, lead, pulsation, decay, .. } = self.ringing;
        let u = position - begin;
        if u <= 0.0 {
            return (0.0, [0.0; UNKNOWNS]);
        }
        debug_assert!(self.last.is_none_or(|last| (u - last - self.width).abs() < 0.1));
        self.step_to(u);
        let (sine, cosine, fading) = (self.sine, self.cosine, self.fading);
        let y = u + lead;
        let most = 1.0 / (y * y).max(1.0);
        let arc = Shape::at(y, curvature.max(-4.0 * most).min(11.0 * most));
        let height = (1.0 + decay * lead) / pulsation - lead * lead * pulsation;
        let ring = lead * cosine + height * sine;
        let along = height * cosine - lead * sine;
        let ring_slope = pulsation * along - decay * ring;
        let by_pulsation = u * along - ((1.0 + decay * lead) / (pulsation * pulsation) + lead * lead) * sine;
        let (value, rise) = (fading * arc.value, fading * (arc.by_x - self.rate * arc.value));
        let shape = value - ring;
        let gradient = [
            shape,
            slope * (fading * arc.by_curvature - 0.5 * lead * y * value),
            -slope * (rise - ring_slope),
            slope
                * (rise - 0.5 * curvature * y * value - (cosine + (decay / pulsation - 2.0 * lead * pulsation) * sine)),
            -slope * by_pulsation,
            slope * (u * ring - lead / pulsation * sine),
            -slope * y * value,
        ];
        (slope * shape, gradient)
    }
}

/// Looks for a ring on a flank whose arc begins about at `start`; `None` where there is none that explains the force.
pub fn find<C: Curve>(flank: &Flank, force: &Force<'_, C>, start: Arc) -> Option<Fitted> {
    let whole = flank.to_end as f32 - start.begin;
    let mut best: Option<Fitted> = None;
    for loss in FADING {
        let mut hertz = LOWEST;
        while hertz <= HIGHEST && !best.is_some_and(|best| best.explains(whole)) {
            let period = flank.rate / hertz;
            if period >= SHORTEST_PERIOD
                && FIRST_PERIODS * period <= whole
                && let Some(found) = from_frequency(flank, force, start, core::f32::consts::TAU / period, whole, loss)
                && best.is_none_or(|best| found.is_better_than(&best))
            {
                best = Some(found);
            }
            hertz *= STEP;
        }
        if best.is_some_and(|best| best.deviation <= ENOUGH * flank.rate || best.explains(whole)) {
            break;
        }
    }
    let best = best?;
    let arc = arc_alone(flank, force, &best)?;
    let worth = WORTH * libm::logf(best.points as f32);
    (arc > best.squares + worth).then_some(best)
}

fn from_frequency<C: Curve>(
    flank: &Flank,
    force: &Force<'_, C>,
    start: Arc,
    pulsation: f32,
    whole: f32,
    loss: f32,
) -> Option<Fitted> {
    let mut length = FIRST_PERIODS * core::f32::consts::TAU / pulsation;
    let arc = flank.arc_over(force, start, length).unwrap_or(start);
    let mut ringing = Ringing { arc, lead: 0.0, fading: 0.0, pulsation, decay: DAMPING.0 * pulsation };
    let mut best: Option<Fitted> = None;
    loop {
        let Some(fitted) = fit(flank, force, ringing, length, loss) else { return best };
        ringing = fitted.ringing;
        if !fitted.fits() {
            return best;
        }
        let period = core::f32::consts::TAU / ringing.pulsation;
        let range = flank.rate / HIGHEST..=flank.rate / LOWEST;
        let periods = length / period;
        let short = (SHORT_PERIODS.0..=SHORT_PERIODS.1).contains(&periods) && loss < FADING[1];
        let clean = fitted.misfit() <= 1.0 + CLEAN_MISFIT / libm::sqrtf(fitted.points as f32);
        if range.contains(&period) && clean && (short || periods >= LONG_PERIODS) {
            best = Some(fitted);
        }
        if length >= whole || best.is_some_and(|best| best.deviation <= ENOUGH * flank.rate) {
            return best;
        }
        length = (length * 1.3).min(whole);
    }
}

/// Levenberg–Marquardt on a stretch of `length` samples from t₀ on.
fn fit<C: Curve>(flank: &Flank, force: &Force<'_, C>, start: Ringing, length: f32, loss: f32) -> Option<Fitted> {
    let stretch = Stretch::of(flank, &start, length);
    let points = stretch.points(flank, force);
    let mut ringing = start;
    let mut normal = linearise(flank, &points, &ringing, loss)?;
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let Some(step) = normal.damped(damping) else { break };
        let next = ringing.moved_by(step, flank);
        let Some(there) = linearise(flank, &points, &next, loss) else { break };
        if there.cost < normal.cost {
            let gain = normal.cost - there.cost;
            (ringing, normal) = (next, there);
            damping *= 0.1;
            if gain < 1e-3 * normal.cost.min(10.0) {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e3 {
                break;
            }
        }
    }
    let deviation = libm::sqrtf(normal.variance(BEGIN)?);
    Some(Fitted { ringing, deviation, squares: normal.squares, points: normal.points, length, stretch })
}

/// The samples that are fitted: they stay the same while the unknowns move.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: isize,
    to: isize,
    /// Samples in a point.
    width: usize,
}

impl Stretch {
    /// From a little before the begin, where there is no force yet, to `length` after it.
    fn of(flank: &Flank, ringing: &Ringing, length: f32) -> Self {
        let before = (LEAD_IN / ringing.pulsation).min(ringing.arc.begin + flank.reach as f32).max(0.0);
        let period = core::f32::consts::TAU / ringing.pulsation;
        let from = libm::ceilf(ringing.arc.begin - before) as isize;
        let to = libm::floorf(ringing.arc.begin + length) as isize;
        let fine = ((period / POINTS_PER_PERIOD) as usize).clamp(1, PIECE);
        let coarse = ((period / FEWEST_PER_PERIOD) as usize).clamp(1, PIECE);
        let samples = usize::try_from(to - from + 1).unwrap_or(0);
        Self { from, to, width: fine.max(samples.div_ceil(MOST_POINTS).min(coarse)) }
    }

    /// Reads the points once: every step of the fit sees the same ones.
    fn points<C: Curve>(&self, flank: &Flank, force: &Force<'_, C>) -> Points {
        let width = self.width;
        let first = self.from as f32 + (width - 1) as f32 / 2.0;
        let mut points = Points { means: [0.0; MOST_POINTS], count: 0, first, width: width as f32 };
        let chunk = PIECE / width * width;
        let share = 1.0 / width as f32;
        let mut piece = [0.0; PIECE];
        let mut at = self.from;
        while at + width as isize <= self.to + 1 && points.count < MOST_POINTS {
            let wanted = chunk.min((self.to + 1 - at) as usize / width * width);
            let count = flank.read(force, at, &mut piece[..wanted]);
            for (mean, values) in points.means[points.count..].iter_mut().zip(piece[..count].chunks_exact(width)) {
                *mean = values.iter().sum::<f32>() * share;
            }
            points.count = (points.count + count / width).min(MOST_POINTS);
            if count < wanted {
                break;
            }
            at += wanted as isize;
        }
        points
    }
}

/// The means of equally many samples each, one after the other.
struct Points {
    means: [f32; MOST_POINTS],
    count: usize,
    /// Centre of the first one, and distance of the next. Samples.
    first: f32,
    width: f32,
}

impl Points {
    /// Centre and mean of each.
    fn each(&self) -> impl Iterator<Item = (f32, f32)> {
        let means = self.means[..self.count].iter();
        means.enumerate().map(|(index, mean)| (self.first + self.width * index as f32, *mean))
    }
}

fn linearise(flank: &Flank, points: &Points, ringing: &Ringing, loss: f32) -> Option<Normal<UNKNOWNS>> {
    let mut normal = Normal::new();
    let prior = flank.prior_curvature();
    let pulsation = ringing.pulsation;
    normal.expect(CURVATURE, prior - ringing.arc.curvature, prior);
    let lead = LEAD * DAMPING.0 / pulsation;
    normal.expect(LEAD_PLACE, lead - ringing.lead, lead);
    normal.expect(DECAY, DAMPING.0 * pulsation - ringing.decay, DAMPING.1 * pulsation);
    normal.expect(FADING_PLACE, -ringing.fading, loss * libm::sqrtf(prior));
    let variance = flank.variance_of_mean(points.width as usize);
    let mut walk = Walk::new(ringing, points.width);
    for (centre, mean) in points.each() {
        let (value, gradient) = walk.at(centre);
        normal.add(gradient, mean - value, variance);
    }
    (normal.points >= 8).then_some(normal)
}

/// χ² of the arc alone over the points of a fitted stretch.
fn arc_alone<C: Curve>(flank: &Flank, force: &Force<'_, C>, fitted: &Fitted) -> Option<f32> {
    let ringing = &fitted.ringing;
    let start = Arc { begin: ringing.arc.begin - ringing.lead, ..ringing.arc };
    let arc = flank.arc_over(force, start, fitted.length)?;
    let variance = flank.variance_of_mean(fitted.stretch.width);
    let mut squares = 0.0;
    for (centre, mean) in fitted.stretch.points(flank, force).each() {
        let y = (centre - arc.begin).max(0.0);
        let rest = mean - arc.slope * Shape::at(y, arc.curvature).value;
        squares += rest * rest / variance;
    }
    Some(squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RINGING: Ringing = Ringing {
        arc: Arc { begin: 2.3, slope: 0.6, curvature: 8e-6 },
        lead: 1.2,
        fading: 1e-4,
        pulsation: 0.07,
        decay: 0.003,
    };

    #[test]
    fn the_gradient_is_that_of_the_force() {
        let change = |unknown: usize, by: f32| {
            let mut changed = RINGING;
            match unknown {
                0 => changed.arc.slope += by,
                1 => changed.arc.curvature += by,
                2 => changed.arc.begin += by,
                3 => changed.lead += by,
                4 => changed.pulsation += by,
                5 => changed.decay += by,
                _ => changed.fading += by,
            }
            changed
        };
        let steps = [1e-2, 2e-7, 2e-2, 2e-2, 2e-4, 2e-4, 2e-5];
        for position in [10.0f32, 60.0, 200.0] {
            let (_, gradient) = RINGING.at(position, 1.0);
            for (unknown, step) in steps.into_iter().enumerate() {
                let rise = change(unknown, step).at(position, 1.0).0 - change(unknown, -step).at(position, 1.0).0;
                let numeric = rise / (2.0 * step);
                let near = 0.02 * numeric.abs() + 1e-4 / step;
                assert!(
                    (gradient[unknown] - numeric).abs() < near,
                    "{unknown} at {position}: {} {numeric}",
                    gradient[unknown]
                );
            }
        }
    }

    /// A robot, a piece and two springs without loss: two modes, found in closed form from the 2×2 eigenvalue problem.
    #[test]
    fn without_loss_it_is_the_motion_of_two_bodies() {
        let (robot, piece, pad, body, speed, rate) = (6.0f64, 0.12, 80e3, 35e3, 0.25, 20_000.0);
        let (a, b) = (pad / robot, (pad + body) / piece);
        let root = libm::sqrt((a - b) * (a - b) + 4.0 * pad * pad / (robot * piece));
        let (slow, fast) = (libm::sqrt(0.5 * (a + b - root)), libm::sqrt(0.5 * (a + b + root)));
        // x_p⃛(0) = k_p·v/m and ẋ_p(0) = 0 fix both heights.
        let height = body * pad * speed / piece / (slow * (fast * fast - slow * slow));
        let ringing = Ringing {
            arc: Arc {
                begin: 0.0,
                slope: (height * slow / rate) as f32,
                curvature: (slow * slow / rate / rate) as f32,
            },
            lead: 0.0,
            fading: 0.0,
            pulsation: (fast / rate) as f32,
            decay: 0.0,
        };
        for n in 1..400 {
            let t = f64::from(n) / rate;
            let force = height * (libm::sin(slow * t) - slow / fast * libm::sin(fast * t));
            let found = f64::from(ringing.at(n as f32, 0.0).0);
            assert!((found - force).abs() < 2e-5 * height, "{n}: {found} {force}");
        }
        assert_eq!(ringing.at(-3.0, 1.0), (0.0, [0.0; UNKNOWNS]));
    }
}

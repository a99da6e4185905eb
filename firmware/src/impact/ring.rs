//! The begin of a force that a moving piece passes on.

use super::arc::Shape;
use super::flank::{Arc, Flank};
use super::force::{Force, PIECE};
use super::least_squares::Normal;
use super::two_bodies::{Bodies, Walk};
use crate::capture::Curve;

/// Lowest and highest frequency of a ring that is looked for, Hz.
const LOWEST: f32 = 40.0;
const HIGHEST: f32 = 1000.0;
/// Ratio of the frequencies that the fits begin with.
const STEP: f32 = 1.3;
/// Stiffness of the pad over that of the springs that the fits begin with.
const RATIOS: [f32; 2] = [3.0, 25.0];
/// Periods of the first stretch.
const FIRST_PERIODS: f32 = 0.6;
/// As the misfit that ends the growing, but for the stretch that is believed: 1.4 deviations of χ².
const CLEAN_MISFIT: f32 = 2.0;
/// Shortest period that can be followed, samples.
const SHORTEST_PERIOD: f32 = 8.0;
/// Points for each period.
const POINTS_PER_PERIOD: f32 = 16.0;
/// A long stretch has no more points than this: they get coarser, down to so many for each period, and what comes after the last
/// one is not looked at.
const MOST_POINTS: usize = 128;
const FINE_POINTS: usize = 64;
const FEWEST_PER_PERIOD: f32 = 8.0;
/// The deviation at which growing stops, s.
const ENOUGH: f32 = 15e-6;
/// How far before the begin a stretch begins, as angle of the ring.
const LEAD_IN: f32 = 1.0;
/// Steps for each stretch.
const STEPS: usize = 14;
/// Expected damping ratios and their deviations.
const PAD_DAMPING: (f32, f32) = (0.032, 1.0);
const SPRING_DAMPING: (f32, f32) = (0.01, 1.0);
/// Expected logarithm of the ratio of stiffnesses.
const LN_RATIO: (f32, f32) = (1.6, 1.6);
/// By how much the ring must lower χ², in units of Schwarz's ln n: one for each unknown that the arc has not.
const WORTH: f32 = 4.0;

/// Unknowns, in this order.
const SLOPE: usize = 0;
const CURVATURE: usize = 1;
const BEGIN: usize = 2;
const PULSATION: usize = 3;
const RATIO: usize = 4;
const PAD: usize = 5;
const SPRING: usize = 6;
const LOSS: usize = 7;
const UNKNOWNS: usize = 8;
/// Those whose derivatives are differences, with their steps: relative, but for the damping ratios.
const VARIED: [(usize, f32); 6] = [(LOSS, 1e-2), (CURVATURE, 5e-3), (PULSATION, 2e-3), (RATIO, 1e-2), (PAD, 0.05), (SPRING, 0.1)];

/// Bodies and begin. Lengths in samples.
#[derive(Clone, Copy, Debug)]
pub struct Ringing {
    /// The contact.
    pub begin: f32,
    pub bodies: Bodies,
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
    /// The next guess, within what the linearisation can mean and what is possible.
    fn moved_by(&self, step: [f32; UNKNOWNS], flank: &Flank) -> Self {
        let bodies = self.bodies;
        let quarter = flank.prior_curvature();
        let far = 0.5 / bodies.pulsation;
        let held = |by: f32, most: f32| by.max(-most).min(most);
        let begin = self.begin + held(step[BEGIN], far);
        Self {
            begin: begin.max(-(flank.reach as f32)).min(flank.to_peak.max(1.0)),
            bodies: Bodies {
                slope: bodies.slope * (1.0 + held(step[SLOPE], 0.4)),
                curvature: (bodies.curvature + held(step[CURVATURE], 2.0 * quarter)).max(-1.0 * quarter).min(6.0 * quarter),
                pulsation: bodies.pulsation * (1.0 + held(step[PULSATION], 0.15)),
                ratio: (bodies.ratio * (1.0 + held(step[RATIO], 0.5))).max(0.3).min(1000.0),
                pad_damping: (bodies.pad_damping * (1.0 + held(step[PAD], 0.6))).max(1e-4).min(0.5),
                spring_damping: (bodies.spring_damping * (1.0 + held(step[SPRING], 0.6))).max(1e-4).min(0.3),
                loss: (bodies.loss + held(step[LOSS], 0.1)).max(-0.1).min(0.5),
            },
        }
    }
}

/// Looks for a ring on a flank whose arc begins about at `start`; `None` where there is none that explains the force.
pub fn find<C: Curve>(flank: &Flank, force: &Force<'_, C>, start: Arc) -> Option<Fitted> {
    let whole = flank.to_end as f32 - start.begin;
    let mut best: Option<Fitted> = None;
    'search: for ratio in RATIOS {
        let mut hertz = LOWEST;
        while hertz <= HIGHEST {
            let period = flank.rate / hertz;
            hertz *= STEP;
            if period < SHORTEST_PERIOD || FIRST_PERIODS * period > whole { continue; }
            let Some(mut found) = from_frequency(flank, force, start, core::f32::consts::TAU / period, whole, ratio) else { continue };
            if let Some(lossy) = grow(flank, force, found.ringing, found.length, whole, 0.2) && (lossy.length > 1.02 * found.length || (lossy.length > 0.98 * found.length && lossy.squares + libm::logf(lossy.points as f32) < found.squares)) { found = lossy; }
            if best.is_none_or(|best| found.is_better_than(&best)) {
                best = Some(found);
            }
            if found.explains(whole) { break 'search; }
        }
    }
    let best = best?;
    if std::env::var("DBG").is_ok() { std::println!("BEST {best:?}");
    }
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
    ratio: f32,
) -> Option<Fitted> {
    let length = FIRST_PERIODS * core::f32::consts::TAU / pulsation;
    let arc = flank.arc_over(force, start, length).unwrap_or(start);
    let ringing = Ringing {
        begin: arc.begin,
        bodies: Bodies {
            slope: arc.slope,
            curvature: arc.curvature.max(-flank.prior_curvature()),
            pulsation,
            ratio,
            pad_damping: PAD_DAMPING.0,
            spring_damping: SPRING_DAMPING.0,
            loss: 0.0,
        },
    };
    grow(flank, force, ringing, length, whole, 1e-3)
}

fn grow<C: Curve>(flank: &Flank, force: &Force<'_, C>, mut ringing: Ringing, mut length: f32, whole: f32, loss: f32) -> Option<Fitted> {
    let mut best: Option<Fitted> = None;
    loop {
        let Some(fitted) = fit(flank, force, ringing, length, loss) else { return best };
        ringing = fitted.ringing;
        if std::env::var("DBG").is_ok() { let b = ringing.bodies; std::println!("   {loss}: len {:.0}/{:.0} width {:?} points {} misfit {:.2} dev {:.1} us begin {:.2} f {:.0} r {:.1} zp {:.3} zb {:.3} q/q0 {:.2} s {:.2} loss {:.3}", fitted.length, whole, fitted.stretch.widths, fitted.points, fitted.misfit(), fitted.deviation*50.0, ringing.begin, b.pulsation*flank.rate/6.2832, b.ratio, b.pad_damping, b.spring_damping, b.curvature/flank.prior_curvature(), b.slope, b.loss); }
        if !fitted.fits() {
            return best;
        }
        let period = core::f32::consts::TAU / ringing.bodies.pulsation;
        let range = flank.rate / HIGHEST..=flank.rate / LOWEST;
        let clean = fitted.misfit() <= 1.0 + CLEAN_MISFIT / libm::sqrtf(fitted.points as f32);
        if range.contains(&period) && clean {
            best = Some(fitted);
        }
        if length >= whole {
            return best;
        }
        length = (length * if length < 1.5 * period { 1.3 } else { 1.7 }).min(whole);
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
            if gain < 0.05 {
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

/// The samples that are fitted: they stay the same while the unknowns move. First fine points, where the force begins, then
/// coarse ones.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: isize,
    to: isize,
    /// Samples in a fine and in a coarse point.
    widths: (usize, usize),
}

impl Stretch {
    /// From a little before the begin, where there is no force yet, to `length` after it.
    fn of(flank: &Flank, ringing: &Ringing, length: f32) -> Self {
        let pulsation = ringing.bodies.pulsation;
        let before = (LEAD_IN / pulsation).min(ringing.begin + flank.reach as f32).max(0.0);
        let period = core::f32::consts::TAU / pulsation;
        let from = libm::ceilf(ringing.begin - before) as isize;
        let to = libm::floorf(ringing.begin + length) as isize;
        let fine = ((period / POINTS_PER_PERIOD) as usize).clamp(1, PIECE);
        let samples = usize::try_from(to - from + 1).unwrap_or(0);
        let coarse = if samples <= MOST_POINTS * fine {
            fine
        } else {
            let most = ((period / FEWEST_PER_PERIOD) as usize).clamp(fine, PIECE);
            (samples - FINE_POINTS * fine).div_ceil(MOST_POINTS - FINE_POINTS).min(most)
        };
        Self { from, to, widths: (fine, coarse) }
    }

    /// Reads the points once: every step of the fit sees the same ones.
    fn points<C: Curve>(&self, flank: &Flank, force: &Force<'_, C>) -> Points {
        let (fine, coarse) = self.widths;
        let mut points = Points { means: [0.0; MOST_POINTS], count: 0, from: self.from, widths: self.widths };
        let middle = self.from + (FINE_POINTS * fine) as isize;
        if coarse == fine {
            self.read(flank, force, (self.from, self.to + 1), fine, &mut points);
        } else if self.read(flank, force, (self.from, middle), fine, &mut points) {
            self.read(flank, force, (middle, self.to + 1), coarse, &mut points);
        }
        points
    }

    /// Whether all of it could be read.
    fn read<C: Curve>(
        &self,
        flank: &Flank,
        force: &Force<'_, C>,
        (from, to): (isize, isize),
        width: usize,
        points: &mut Points,
    ) -> bool {
        let chunk = PIECE / width * width;
        let share = 1.0 / width as f32;
        let mut piece = [0.0; PIECE];
        let mut at = from;
        while at + width as isize <= to && points.count < MOST_POINTS {
            let wanted = chunk.min((to - at) as usize / width * width);
            let count = flank.read(force, at, &mut piece[..wanted]);
            for (mean, values) in points.means[points.count..].iter_mut().zip(piece[..count].chunks_exact(width)) {
                *mean = values.iter().sum::<f32>() * share;
            }
            points.count = (points.count + count / width).min(MOST_POINTS);
            if count < wanted {
                return false;
            }
            at += wanted as isize;
        }
        true
    }
}

/// The means of some samples each, one after the other.
struct Points {
    means: [f32; MOST_POINTS],
    count: usize,
    from: isize,
    widths: (usize, usize),
}

/// A mean, where it is and of how many samples.
struct Point {
    centre: f32,
    width: usize,
    mean: f32,
}

const SC: f32 = 3.0;
impl Points {
    fn samples(&self) -> usize {
        let fines = self.count.min(FINE_POINTS);
        fines * self.widths.0 + (self.count - fines) * self.widths.1
    }

    fn each(&self) -> impl Iterator<Item = Point> {
        let (fine, coarse) = self.widths;
        self.means[..self.count].iter().enumerate().map(move |(index, mean)| {
            let fines = index.min(FINE_POINTS);
            let (before, width) =
                if index < FINE_POINTS { (index * fine, fine) } else { (fines * fine + (index - fines) * coarse, coarse) };
            let centre = (self.from + before as isize) as f32 + (width - 1) as f32 / 2.0;
            Point { centre, width, mean: *mean }
        })
    }
}

fn linearise(flank: &Flank, points: &Points, ringing: &Ringing, loss: f32) -> Option<Normal<UNKNOWNS>> {
    let mut normal = Normal::new();
    let prior = flank.prior_curvature();
    let Bodies { curvature, ratio, pad_damping, spring_damping, .. } = ringing.bodies;
    normal.expect(CURVATURE, prior - curvature, prior);
    normal.expect(LOSS, -ringing.bodies.loss, loss);
    normal.expect(RATIO, LN_RATIO.0 - libm::logf(ratio), LN_RATIO.1);
    normal.expect(PAD, libm::logf(PAD_DAMPING.0 / pad_damping), PAD_DAMPING.1);
    normal.expect(SPRING, libm::logf(SPRING_DAMPING.0 / spring_damping), SPRING_DAMPING.1);
    let variances = (flank.variance_of_mean(points.widths.0), flank.variance_of_mean(points.widths.1));
    let mut walk = Walk::new(&ringing.bodies);
    let phase = ringing.bodies.pulsation * points.samples() as f32;
    let fine = SC / phase.max(SC);
    let mut varied = VARIED.map(|(unknown, step)| {
        let mut bodies = ringing.bodies;
        let step = step * fine;
        let step = match unknown {
            CURVATURE => {
                bodies.curvature += step * prior;
                step * prior
            }
            PULSATION => {
                bodies.pulsation *= 1.0 + step;
                step
            }
            RATIO => {
                bodies.ratio *= 1.0 + step;
                step
            }
            LOSS => {
                bodies.loss += step;
                step
            }
            PAD => {
                bodies.pad_damping *= 1.0 + step;
                step
            }
            _ => {
                bodies.spring_damping *= 1.0 + step;
                step
            }
        };
        (unknown, 1.0 / step, Walk::new(&bodies))
    });
    crate::impact::WORK.fetch_add(points.count as u64, core::sync::atomic::Ordering::Relaxed);
    crate::impact::EVALS.fetch_add(1, core::sync::atomic::Ordering::Relaxed);
    let from = usize::from(loss < 0.01);
    for Point { centre, width, mean } in points.each() {
        let u = centre - ringing.begin;
        let mut gradient = [0.0; UNKNOWNS];
        let mut value = 0.0;
        if u > 0.0 {
            let (there, rate) = walk.to(u, width);
            value = there;
            gradient[SLOPE] = there;
            gradient[BEGIN] = -rate;
            for (unknown, per_step, walk) in &mut varied[from..] {
                gradient[*unknown] = (walk.to(u, width).0 - value) * *per_step;
            }
        }
        normal.add(gradient, mean - value, if width == points.widths.0 { variances.0 } else { variances.1 });

    }
    (normal.points >= 8).then_some(normal)
}

/// χ² of the arc alone over the points of a fitted stretch.
fn arc_alone<C: Curve>(flank: &Flank, force: &Force<'_, C>, fitted: &Fitted) -> Option<f32> {
    let Ringing { begin, bodies } = fitted.ringing;
    let start = Arc { begin, slope: bodies.slope, curvature: bodies.curvature };
    let arc = flank.arc_over(force, start, fitted.length)?;
    let mut squares = 0.0;
    for Point { centre, width, mean } in fitted.stretch.points(flank, force).each() {
        let y = (centre - arc.begin).max(0.0);
        let rest = mean - arc.slope * Shape::at(y, arc.curvature).value;
        squares += rest * rest / flank.variance_of_mean(width);
    }
    Some(squares)
}

//! The begin of a force that a moving piece passes on: robot and piece, fitted to the force as two [bodies](super::two_bodies).
//!
//! The unknowns are the instant t₀ and what the force can tell of the rig:
//!
//! ```text
//! ln s, q, t₀, ln Ω, ln r, ln ζ_pad, ln ζ_springs, and η where it is let go
//! ```
//!
//! F is proportional to s, so that ∂F/∂ln s = F, and ∂F/∂t₀ = −Ḟ; the others come from a second, slightly different motion
//! each, side by side with the first. The steps are as small as the stretch is long, for a piece that rattles soon forgets where
//! it came from. What the force tells little of is expected where rigs are: the springs' damping above all, which leads the force by
//! c_b/k_b, as long behind a hard pad as the instant is to be found.
//!
//! The search begins at frequencies from 40 Hz to 1 kHz, with a stretch of half a period, by Levenberg and Marquardt. As
//! long as the residual looks like the tracked noise, the stretch grows, at last over the whole contact; where a large step leads
//! into another valley (the piece has come back meanwhile), a small one is tried. Where the motion
//! without loss stops fitting, or a loss in the pad (η, after Hunt and Crossley) fits better by more than Schwarz's ln n, it is
//! let go. The first that explains the whole contact is taken, else the one that explains most of it; and it is believed only where
//! an arc over the same stretch does not fit as well, and where that stretch is long: a ring that rises with the contact, of a
//! mount say, begins like no struck piece, but eight unknowns bend to its first swing. Nor is a piece believed that is as heavy as
//! a robot.
//!
//! **Work.** A step evaluates every point of its stretch once. All contacts of an impact together have [`WORK`] such evaluations
//! and no more; a hit on a linear rig takes some two to ten thousand. Each is six or seven motions by a point, and takes the
//! emulated chip 25 to 30 µs: 0.05 to 0.3 s, 0.6 s at most, at low priority, after the impact is over. The board's watchdog waits for a
//! second: with 32,000 evaluations for each contact it bit, at one of a thousand impacts.

use super::arc::Shape;
use super::flank::{Arc, Flank};
use super::force::Force;
use super::least_squares::Normal;
use super::stretch::{Points, Stretch};
use super::two_bodies::{Bodies, Walk};
use crate::capture::Curve;

/// Most evaluations of a point for one impact.
const WORK: usize = 20_000;
/// Lowest and highest frequency that a search begins with, Hz, and the ratio from one to the next.
const LOWEST: f32 = 40.0;
const HIGHEST: f32 = 1000.0;
const STEP: f32 = 1.3;
/// Stiffness of the pad over that of the springs that it begins with: the standard's pads, then a hard pad or none.
const RATIOS: [f32; 2] = [3.0, 25.0];
/// Frequencies that are believed, Hz, as far as the sample rate lets them be followed.
const BELIEVED: (f32, f32) = (30.0, 2000.0);
/// Shortest period that can be followed, samples.
const SHORTEST_PERIOD: f32 = 8.0;
/// Periods of the first stretch.
const FIRST_PERIODS: f32 = 0.6;
/// From stretch to stretch: until so many periods in small steps, then in large ones.
const SURE_PERIODS: f32 = 1.5;
const GROWTH: (f32, f32) = (1.3, 1.7);
/// A stretch of fewer periods cannot tell loss from the rest.
const FEWEST_PERIODS: f32 = 1.2;
/// Steps for each stretch, and the gain in χ² below which there is no further one: a twentieth moves no unknown by more than a
/// fifth of its deviation.
const STEPS: usize = 14;
const NO_GAIN: f32 = 0.05;
/// A stretch is believed up to 1 + this/√points of misfit, 1.4 deviations of χ²; the whole contact up to what ends the growing, and
/// below the other, 1.8 deviations, it ends the search.
const CLEAN_MISFIT: f32 = 2.0;
const DONE_MISFIT: f32 = 2.5;
/// A motion must explain this share of the contact, and so many periods: so many unknowns bend to any wiggle that is seen no
/// longer. A struck piece explains all of the contact, with a guide that rubs at least three tenths and 2.5 periods; a ring
/// that rises with the contact, as no struck piece does, up to three tenths or one period.
const SEEN_SHARE: f32 = 0.25;
const SEEN_PERIODS: f32 = 2.0;
/// The piece's mass as a share of the robot's. What is fitted to the simulated rigs (0.04 to 0.3 kg, 3 to 15 kg) is below 0.08;
/// a force that only breaks loose late, where a guide holds the piece at first, asks for 0.6 and more.
const HEAVIEST_PIECE: f32 = 0.25;
/// By how much a motion must lower χ² against the arc, in units of Schwarz's ln n: it has four unknowns more.
const WORTH: f32 = 4.0;

/// Expected damping ratios and ratio of stiffnesses; their logarithms may be off by so much. The damping of rubber is 0.005 to
/// 0.2, that of steel springs in their seats 0.001 to 0.1 (the plausible range of the simulated rig); a pad is as stiff as the
/// springs or up to 25 times, a bare contact 100 times.
const PAD_DAMPING: (f32, f32) = (0.032, 1.0);
const SPRING_DAMPING: (f32, f32) = (0.01, 1.0);
const STIFFNESSES: (f32, f32) = (5.0, 1.6);
/// Expected loss: none, give or take this; held, and let go.
const HELD: f32 = 1e-3;
const LET_GO: f32 = 0.2;

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

/// Unknowns whose derivatives are differences, and their steps while the ring turns by less than [`SHORT_TURN`] radians; the
/// curvature's in units of the expected one. Beyond, they shrink as the stretch grows.
const VARIED: [(usize, f32); 6] =
    [(LOSS, 1e-2), (CURVATURE, 5e-3), (PULSATION, 2e-3), (RATIO, 1e-2), (PAD, 0.05), (SPRING, 0.1)];
const SHORT_TURN: f32 = 3.0;

/// The touch, and what moves from then on. Lengths in samples.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// t₀.
    pub begin: f32,
    /// What the force is made of.
    pub bodies: Bodies,
}

impl Touch {
    /// Period of the ring, samples.
    fn period(&self) -> f32 {
        core::f32::consts::TAU / self.bodies.pulsation
    }

    /// The next guess, within what the linearisation can mean and what is possible.
    fn moved_by(&self, step: [f32; UNKNOWNS], flank: &Flank) -> Self {
        let within = |value: f32, low: f32, high: f32| value.max(low).min(high);
        let by = |unknown: usize, most: f32| within(step[unknown], -most, most);
        let Bodies { slope, curvature, pulsation, ratio, pad_damping, spring_damping, loss } = self.bodies;
        let prior = flank.prior_curvature();
        let begin = self.begin + by(BEGIN, 0.5 / pulsation);
        Self {
            begin: within(begin, -(flank.reach as f32), flank.to_peak.max(1.0)),
            bodies: Bodies {
                slope: slope * (1.0 + by(SLOPE, 0.4)),
                curvature: within(curvature + by(CURVATURE, 2.0 * prior), -prior, 6.0 * prior),
                pulsation: within(pulsation * (1.0 + by(PULSATION, 0.15)), 1e-3, 2.0),
                ratio: within(ratio * (1.0 + by(RATIO, 0.5)), 0.3, 1000.0),
                pad_damping: within(pad_damping * (1.0 + by(PAD, 0.6)), 1e-4, 0.5),
                spring_damping: within(spring_damping * (1.0 + by(SPRING, 0.6)), 1e-4, 0.3),
                loss: within(loss + by(LOSS, 0.1), -0.1, 0.5),
            },
        }
    }

    /// Other bodies, a step of one unknown away.
    fn varied(&self, unknown: usize, step: f32) -> Bodies {
        let mut bodies = self.bodies;
        match unknown {
            CURVATURE => bodies.curvature += step,
            PULSATION => bodies.pulsation *= 1.0 + step,
            RATIO => bodies.ratio *= 1.0 + step,
            PAD => bodies.pad_damping *= 1.0 + step,
            SPRING => bodies.spring_damping *= 1.0 + step,
            _ => bodies.loss += step,
        }
        bodies
    }
}

/// A fitted stretch.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// What was fitted.
    pub touch: Touch,
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

    /// Whether the residual looks like noise (of the whole contact: nearly so), and ring and instant are known.
    fn is_believed(&self, flank: &Flank, whole: bool) -> bool {
        let period = self.touch.period();
        (BELIEVED.0..=BELIEVED.1).contains(&(flank.rate / period))
            && period >= SHORTEST_PERIOD
            && self.deviation < period / core::f32::consts::TAU
            && (whole || self.misfit() <= 1.0 + CLEAN_MISFIT / libm::sqrtf(self.points as f32))
    }

    /// Whether the stretch is long enough for a coincidence to be unlikely.
    fn is_seen_long_enough(&self, whole: f32) -> bool {
        self.length >= (SEEN_SHARE * whole).max(SEEN_PERIODS * self.touch.period())
    }

    /// Nothing is left to look for.
    fn explains(&self, whole: f32) -> bool {
        self.length >= 0.98 * whole && self.misfit() <= 1.0 + DONE_MISFIT / libm::sqrtf(self.points as f32)
    }

    fn is_longer_than(&self, other: &Self) -> bool {
        self.length > 1.02 * other.length
    }

    /// Longer, or as long and χ² lower by more than `worth`.
    fn is_better_than(&self, other: &Self, worth: f32) -> bool {
        self.is_longer_than(other) || (!other.is_longer_than(self) && self.squares + worth < other.squares)
    }
}

/// Looks for the touch on a flank whose arc begins about at `start`; `None` where no moving piece explains the force better.
pub fn find<C: Curve>(flank: &Flank, force: &Force<'_, C>, start: Arc) -> Option<Fitted> {
    let mut search = Search::new(flank, force, start);
    let best = search
        .run()
        .filter(|best| best.is_seen_long_enough(search.whole) && best.touch.bodies.mass_ratio() <= HEAVIEST_PIECE)?;
    let arc = arc_alone(flank, force, &best)?;
    let worth = WORTH * libm::logf(best.points as f32);
    (arc > best.squares + worth).then_some(best)
}

struct Search<'a, C> {
    flank: &'a Flank,
    force: &'a Force<'a, C>,
    start: Arc,
    /// Samples of the whole contact.
    whole: f32,
}

impl<'a, C: Curve> Search<'a, C> {
    fn new(flank: &'a Flank, force: &'a Force<'a, C>, start: Arc) -> Self {
        Self { flank, force, start, whole: flank.to_end as f32 - start.begin }
    }

    fn run(&mut self) -> Option<Fitted> {
        let mut best: Option<Fitted> = None;
        for ratio in RATIOS {
            let mut hertz = LOWEST;
            while hertz <= HIGHEST {
                if let Some(found) = self.grown_from(hertz, ratio) {
                    if best.is_none_or(|best| found.is_better_than(&best, 0.0)) {
                        best = Some(found);
                    }
                    if found.explains(self.whole) {
                        return best;
                    }
                }
                hertz *= STEP;
            }
        }
        best
    }

    fn grown_from(&mut self, hertz: f32, ratio: f32) -> Option<Fitted> {
        let period = self.flank.rate / hertz;
        let length = FIRST_PERIODS * period;
        if period < SHORTEST_PERIOD || length > self.whole {
            return None;
        }
        let arc = self.flank.arc_over(self.force, self.start, length).unwrap_or(self.start);
        let bodies = Bodies {
            slope: arc.slope,
            curvature: arc.curvature.max(-self.flank.prior_curvature()),
            pulsation: core::f32::consts::TAU / period,
            ratio,
            pad_damping: PAD_DAMPING.0,
            spring_damping: SPRING_DAMPING.0,
            loss: 0.0,
        };
        let without = self.grow(Touch { begin: arc.begin, bodies }, length, HELD)?;
        if without.length < FEWEST_PERIODS * without.touch.period() {
            return Some(without);
        }
        let lossy = self.grow(without.touch, without.length, LET_GO);
        Some(lossy.filter(|lossy| lossy.is_better_than(&without, libm::logf(lossy.points as f32))).unwrap_or(without))
    }

    /// Fits longer and longer stretches; the longest that is believed. Where a large step leads astray, a small one is tried.
    fn grow(&mut self, mut touch: Touch, mut length: f32, loss: f32) -> Option<Fitted> {
        let mut best = None;
        let mut sure = 0.0;
        while let Some(fitted) = self.fit(touch, length, loss) {
            let growth = if fitted.misfit() <= Flank::allowed_misfit(fitted.points) {
                touch = fitted.touch;
                let whole = length >= self.whole;
                if fitted.is_believed(self.flank, whole) {
                    best = Some(fitted);
                }
                if whole || touch.begin + length < 0.0 {
                    break;
                }
                sure = length;
                if length < SURE_PERIODS * touch.period() { GROWTH.0 } else { GROWTH.1 }
            } else if length > 1.05 * GROWTH.0 * sure && sure > 0.0 {
                GROWTH.0
            } else {
                break;
            };
            length = (sure * growth).min(self.whole);
        }
        best
    }

    /// Levenberg–Marquardt on a stretch of `length` samples from t₀ on.
    fn fit(&mut self, start: Touch, length: f32, loss: f32) -> Option<Fitted> {
        let flank = self.flank;
        let stretch = Stretch::of(flank, start.begin, start.bodies.pulsation, length);
        let points = stretch.points(flank, self.force);
        let mut touch = start;
        let mut normal = self.linearise(&points, &touch, loss)?;
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let Some(step) = normal.damped(damping) else { break };
            let next = touch.moved_by(step, flank);
            let Some(there) = self.linearise(&points, &next, loss) else { break };
            if there.cost < normal.cost {
                let gain = normal.cost - there.cost;
                (touch, normal) = (next, there);
                damping *= 0.1;
                if gain < NO_GAIN {
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
        Some(Fitted { touch, deviation, squares: normal.squares, points: normal.points, length, stretch })
    }

    /// The normal equations about a touch; `None` where there are too few points, or no more work is allowed.
    fn linearise(&mut self, points: &Points, touch: &Touch, loss: f32) -> Option<Normal<UNKNOWNS>> {
        let work = self.force.work.get() + points.count;
        if points.count < UNKNOWNS || work > WORK {
            return None;
        }
        self.force.work.set(work);
        Some(linearise(points, touch, loss, self.flank.prior_curvature()))
    }
}

fn linearise(points: &Points, touch: &Touch, loss: f32, prior: f32) -> Normal<UNKNOWNS> {
    let mut normal = Normal::new();
    let bodies = &touch.bodies;
    let mut expect = |unknown, (expected, deviation): (f32, f32), value: f32| {
        normal.expect(unknown, libm::logf(expected / value), deviation);
    };
    expect(RATIO, STIFFNESSES, bodies.ratio);
    expect(PAD, PAD_DAMPING, bodies.pad_damping);
    expect(SPRING, SPRING_DAMPING, bodies.spring_damping);
    normal.expect(CURVATURE, prior - bodies.curvature, prior);
    normal.expect(LOSS, -bodies.loss, loss);

    let mut walk = Walk::new(bodies);
    let turn = bodies.pulsation * points.samples() as f32;
    let shrink = SHORT_TURN / turn.max(SHORT_TURN);
    let mut varied = VARIED.map(|(unknown, step)| {
        let step = step * shrink * if unknown == CURVATURE { prior } else { 1.0 };
        (unknown, 1.0 / step, Walk::new(&touch.varied(unknown, step)))
    });
    // A loss that is held needs no derivative.
    let varied = &mut varied[usize::from(loss <= HELD)..];
    for (centre, mean) in points.each() {
        let u = centre - touch.begin;
        let mut gradient = [0.0; UNKNOWNS];
        let mut force = 0.0;
        if u > 0.0 {
            let rate;
            (force, rate) = walk.to(u, points.width);
            gradient[SLOPE] = force;
            gradient[BEGIN] = -rate;
            for (unknown, per_step, walk) in &mut *varied {
                gradient[*unknown] = (walk.to(u, points.width).0 - force) * *per_step;
            }
        }
        normal.add(gradient, mean - force, points.variance);
    }
    normal
}

/// χ² of the arc alone over the points of a fitted stretch.
fn arc_alone<C: Curve>(flank: &Flank, force: &Force<'_, C>, fitted: &Fitted) -> Option<f32> {
    let Touch { begin, bodies } = fitted.touch;
    let start = Arc { begin, slope: bodies.slope, curvature: bodies.curvature };
    let arc = flank.arc_over(force, start, fitted.length)?;
    let points = fitted.stretch.points(flank, force);
    let rest = |(centre, mean): (f32, f32)| {
        let rest = mean - arc.slope * Shape::at((centre - arc.begin).max(0.0), arc.curvature).value;
        rest * rest / points.variance
    };
    Some(points.each().map(rest).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::AdcCode;
    use crate::configuration::Configuration;
    use crate::idle::Baseline;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;
    use std::vec::Vec;

    const NOISE: f32 = 0.3;

    /// The codes of a force under evenly spread noise of 0.3 N rms.
    fn codes(samples: usize, mut force: impl FnMut(usize) -> f32) -> Vec<AdcCode> {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let chain = Configuration::DEFAULT.chain;
        let code = |n| {
            let noise = NOISE * libm::sqrtf(3.0) * random.random_range(-1.0f32..1.0);
            let code = libm::roundf((force(n) + noise) / chain.newton_per_code) as i32;
            (code + i32::from(chain.zero_code)) as AdcCode
        };
        (0..samples).map(code).collect()
    }

    fn flank(inside: usize, to_end: usize, peak: f32) -> Flank {
        Flank {
            direction: super::super::flank::Direction::Begin,
            inside,
            to_peak: to_end as f32 / 2.0,
            to_end,
            reach: 100,
            peak,
            noise: NOISE,
            rate: 20_000.0,
        }
    }

    /// Behind a hard pad the piece rattles, behind a soft one it rings.
    #[test]
    fn a_struck_piece_tells_the_touch() {
        for (ratio, hertz) in [(20.0, 470.0), (2.0, 160.0)] {
            let bodies = Bodies {
                slope: 0.5,
                curvature: 1.2e-5,
                pulsation: core::f32::consts::TAU * hertz / 20_000.0,
                ratio,
                pad_damping: 0.04,
                spring_damping: 0.01,
                loss: 0.0,
            };
            let begin = 200.3;
            let mut walk = Walk::new(&bodies);
            let curve = codes(1000, |n| if n as f32 > begin { walk.to(n as f32 - begin, 1).0 } else { 0.0 });
            let baseline = Baseline::default();
            let force = Force::bare(&curve, &baseline);
            let flank = flank(215, 700, 145.0);
            let start = Arc { begin: -8.0, slope: 0.5, curvature: 1.2e-5 };
            let found = find(&flank, &force, start).expect("a ring");
            let error = 215.0 + found.touch.begin - begin;
            assert!(error.abs() < 0.7, "{hertz} Hz: {error} samples");
            assert!(error.abs() < 4.0 * found.deviation, "{hertz} Hz: {error} ± {} samples", found.deviation);
        }
    }

    /// A ring that has not waited for the lag of a piece: the cell's mount, say.
    #[test]
    fn a_ring_that_rises_with_the_contact_is_no_piece() {
        let begin = 200.3;
        for hertz in [170.0, 300.0, 600.0] {
            let ring =
                |u: f32| 2.9 * libm::expf(-u / 200.0) * libm::sinf(core::f32::consts::TAU * hertz / 20_000.0 * u);
            let arc = |u: f32| 58.0 * libm::sinf(u / 310.0);
            let curve = codes(1500, |n| {
                let u = n as f32 - begin;
                if (0.0..970.0).contains(&u) { arc(u) + ring(u) } else { 0.0 }
            });
            let baseline = Baseline::default();
            let force = Force::bare(&curve, &baseline);
            let flank = flank(206, 960, 58.0);
            let start = Arc { begin: -6.0, slope: 0.19, curvature: 1e-5 };
            let found = find(&flank, &force, start);
            assert!(found.is_none(), "{hertz} Hz: {found:?}");
        }
    }

    /// A force that no two bodies make: the search ends all the same.
    #[test]
    fn what_cannot_be_explained_costs_no_more_than_is_allowed() {
        let saw = |n: usize| if n > 200 { 30.0 + ((n * 7919) % 97) as f32 } else { 0.0 };
        let curve = codes(1500, saw);
        let baseline = Baseline::default();
        let force = Force::bare(&curve, &baseline);
        let flank = flank(201, 1200, 127.0);
        let mut search = Search::new(&flank, &force, Arc { begin: -1.0, slope: 10.0, curvature: 1e-6 });
        let found = search.run();
        let work = force.work.get();
        assert!(work > 0 && work <= WORK, "{work}");
        assert!(found.is_none_or(|found| found.length < 600.0), "{found:?}");
    }
}

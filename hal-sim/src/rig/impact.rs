//! What one impact did: the force at the cell and the motion at any instant, and the truth about it.

use std::borrow::Cow;
use std::mem;
use std::sync::{Arc, OnceLock};

use super::assembly::{Stage, Sway, ahead_s};
use super::integrate::Effort;
use super::motion::{Instant, MOST_STATES, System};
use super::trajectory::{Reading, Stretch, Trajectory};
use super::{Approach, Assembly, Kind, Rig, RigError};
use crate::mechanism::Effect;

/// A simulated impact. Time is in seconds after first contact (kind `fall`: after release).
#[derive(Debug)]
pub struct Impact {
    motion: Arc<Motion>,
    chain: Vec<Box<dyn Stage>>,
    log: Vec<Box<dyn Stage>>,
}

/// What moved, whoever looks at it.
#[derive(Debug)]
struct Motion {
    system: System,
    trajectory: Trajectory,
    intervals: Vec<(f64, Option<f64>)>,
    pulls: Vec<Pull>,
    /// Found when they are asked for: mostly the force is all that is read, and it shows few of them.
    returns: OnceLock<Vec<Return>>,
    until_s: f64,
    effort: Effort,
}

/// When a neck pulls after a separation, until the pad is touched again at the latest.
#[derive(Clone, Copy, Debug)]
struct Pull {
    from_s: f64,
    until_s: f64,
    /// At which the robot leaves.
    speed_m_per_s: f64,
}

/// How springs that oil or air slows come back after a separation, without the robot, until they are touched again.
#[derive(Clone, Debug)]
struct Return {
    from_s: f64,
    until_s: f64,
    /// Of the stroke that is left less and less: when, s after the separation, its logarithm (m) and what the cell bears, N.
    course: Vec<(f64, f64, f64)>,
}

/// What can be read at any instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Force at the cell, N, before the measuring chain.
    CellForce,
    /// Force between robot and rig, N.
    ContactForce,
    /// Stroke of the body springs, m.
    Stroke,
    /// How far pad and body springs together are pressed in, m: the way of the tip while it touches, else what the piece keeps.
    Depth,
    /// Position of the robot's tip, or of the falling mass, m: from the frame where that bears the gauge, of the link where that does.
    Position,
    /// Its velocity, m/s.
    Velocity,
    /// Its acceleration, m/s².
    Acceleration,
    /// Friction of the guide on the piece, N.
    Friction,
}

/// Where a quantity jumps or bends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kink {
    /// When, s.
    pub at_s: f64,
    /// By how much it jumps, in its unit.
    pub jump: f64,
    /// By how much its slope jumps, in its unit per second.
    pub slope: f64,
}

/// One touch of robot and rig, from contact to separation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// The instant of contact, s.
    pub start_s: f64,
    /// The instant of separation, s; `None`: still touching at the end.
    pub end_s: Option<f64>,
    /// Highest force at the cell, N.
    pub peak_n: f64,
    /// When, s.
    pub peak_s: f64,
    /// Time integral of the force at the cell, N·s.
    pub impulse_ns: f64,
    /// Largest stroke of the body springs, m.
    pub stroke_m: f64,
    /// Work of the robot's tip on the rig that it did not get back, J.
    pub loss_j: f64,
    /// Velocity of the tip at contact, m/s.
    pub speed_before_m_per_s: f64,
    /// Velocity of the tip at separation (or at the end), m/s; negative: it moves away.
    pub speed_after_m_per_s: f64,
}

/// The truth about an impact: its contacts in order, as many as there were.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Each touch.
    pub contacts: Vec<Contact>,
    /// Highest force at the cell of all, N.
    pub peak_n: f64,
    /// When, s.
    pub peak_s: f64,
}

impl Motion {
    /// When robot and rig part, and when they touch again (infinity: not any more), s.
    fn separations(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let touched_again_s = self.intervals.iter().skip(1).map(|(from_s, _)| *from_s).chain([f64::INFINITY]);
        self.intervals.iter().zip(touched_again_s).filter_map(|((_, end_s), until_s)| Some(((*end_s)?, until_s)))
    }

    /// One for each separation of a pad that sticks: the tension falls as the robot goes away, or holds until it tears.
    fn pulls(&self) -> Vec<Pull> {
        let touched = self.system.assembly.touched();
        if touched.neck.highest_n == 0.0 || touched.neck.length_m == 0.0 {
            return Vec::new();
        }
        let neck = |(from_s, until_s): (f64, f64)| {
            let mut state = [0.0; MOST_STATES];
            self.trajectory.state(self.trajectory.find(from_s), from_s, &mut state);
            Pull { from_s, speed_m_per_s: state[1].abs().max(SLOWEST_M_PER_S), until_s }
        };
        self.separations().map(neck).collect()
    }

    /// What pulls at an instant, N: from the piece to the robot, and on the cell.
    fn neck_n(&self, time_s: f64) -> f64 {
        let neck = self.system.assembly.touched().neck;
        let pull_n = |pull: &Pull| {
            let lasts = (pull.from_s..pull.until_s).contains(&time_s);
            let way_m = pull.speed_m_per_s * (time_s - pull.from_s);
            if lasts { neck.tension_n(way_m, self.system.series_n_per_m) } else { 0.0 }
        };
        self.pulls.iter().map(pull_n).sum()
    }

    /// One for each separation from springs that are still pressed then: contact ends where they give no force, and what takes it from
    /// them, a dashpot or air, holds them up. The logarithm of the stroke falls steadily behind a dashpot.
    fn find_returns(&self) -> Vec<Return> {
        let assembly = &self.system.assembly;
        let slowed = assembly.spring.damping_ns_per_m > 0.0
            || assembly.across.damping_ns_per_m > 0.0
            || assembly.guide.air_ns2_per_m2 > 0.0
            || assembly.spring.laws.iter().any(|law| law.depends_on_rate());
        if !slowed || assembly.kind == Kind::Fall {
            return Vec::new();
        }
        let course = |from_s: f64, until_s: f64| {
            let after = self.trajectory.find(from_s);
            let last = &self.trajectory.stretches()[after.checked_sub(1)?];
            let mut state = [0.0; MOST_STATES];
            self.trajectory.state(after - 1, from_s, &mut state);
            let mode = &self.trajectory.stretches()[after].mode;
            let rest_m = self.system.free_stroke_m(&state, mode);
            let stroke_m = self.system.instant(from_s, &state, &last.mode).piece_m - rest_m;
            if stroke_m < SMALLEST_M {
                return None;
            }
            let (mut time_s, mut left_m, mut before_s) = (0.0, stroke_m, None);
            let mut course = Vec::new();
            while left_m > SMALLEST_M && from_s + time_s < until_s {
                let (velocity_m_per_s, cell_n) = self.system.returning(rest_m + left_m, &state, mode)?;
                // How long it would take at this rate to fall by a factor of e.
                let falls_s = -left_m / velocity_m_per_s;
                time_s += before_s.map_or(0.0, |before_s: f64| -RETURN_STEP.ln() * 0.5 * (before_s + falls_s));
                course.push((time_s, left_m.ln(), cell_n));
                before_s = Some(falls_s);
                left_m *= RETURN_STEP;
            }
            Some(course)
        };
        self.separations()
            .filter_map(|(from_s, until_s)| Some(Return { from_s, until_s, course: course(from_s, until_s)? }))
            .collect()
    }

    /// Reads a quantity that is kept, without the forces there, at instants of a stretch. `false`: it is not.
    fn read(&self, quantity: Quantity, stretch: usize, times_s: &[f64], values: &mut [f64]) -> bool {
        let Stretch { mode, .. } = &self.trajectory.stretches()[stretch];
        let reading = match quantity {
            Quantity::CellForce => Some(Reading::Cell),
            Quantity::Acceleration => Some(Reading::Acceleration),
            Quantity::Stroke => Some(Reading::Stroke),
            Quantity::Depth if !mode.touching => Some(Reading::Stroke),
            _ => None,
        };
        if let Some(reading) = reading {
            self.trajectory.reading(stretch, reading, times_s, values);
        } else if let Some((state, less)) = self.system.state_of(quantity) {
            self.trajectory.column(stretch, state, times_s, values);
            if let Some(less) = less {
                let mut lesser = vec![0.0; times_s.len()];
                self.trajectory.column(stretch, less, times_s, &mut lesser);
                values.iter_mut().zip(lesser).for_each(|(value, less)| *value -= less);
            }
        } else {
            return false;
        }
        let beside: fn(&Self, f64) -> f64 = match reading {
            Some(Reading::Cell) if self.lingers() => Self::lingering_n,
            Some(Reading::Stroke) => |motion, time_s| motion.returning(time_s).0,
            _ => return true,
        };
        values.iter_mut().zip(times_s).for_each(|(value, time_s)| *value += beside(self, *time_s));
        true
    }

    /// What stroke is left at an instant of springs that come back by themselves, m, and what the cell bears of it, N.
    fn returning(&self, time_s: f64) -> (f64, f64) {
        let of = |way: &Return| {
            let after_s = time_s - way.from_s;
            let next = way.course.partition_point(|(at_s, ..)| *at_s <= after_s);
            let (&(to_s, to, to_n), &(at_s, at, at_n)) = (way.course.get(next)?, way.course.get(next.checked_sub(1)?)?);
            let part = (after_s - at_s) / (to_s - at_s);
            (time_s < way.until_s).then(|| ((at + part * (to - at)).exp(), at_n + part * (to_n - at_n)))
        };
        self.returns
            .get_or_init(|| self.find_returns())
            .iter()
            .filter_map(of)
            .fold((0.0, 0.0), |sum, (stroke_m, cell_n)| (sum.0 + stroke_m, sum.1 + cell_n))
    }

    /// Whether the cell bears anything besides what the motion's states say.
    fn lingers(&self) -> bool {
        !self.pulls.is_empty() || self.shows_returns()
    }

    /// Whether the cell feels springs come back: all that slows them stands on it, but for air beside it.
    fn shows_returns(&self) -> bool {
        let guide = &self.system.assembly.guide;
        guide.air_ns2_per_m2 > 0.0 && guide.air_cell_share < 1.0
    }

    /// What the cell bears at an instant besides what the motion's states say, N.
    fn lingering_n(&self, time_s: f64) -> f64 {
        let returning_n = if self.shows_returns() { self.returning(time_s).1 } else { 0.0 };
        returning_n - self.neck_n(time_s)
    }
}

impl Impact {
    pub(super) fn new(
        mut system: System,
        trajectory: Trajectory,
        intervals: Vec<(f64, Option<f64>)>,
        until_s: f64,
        effort: Effort,
    ) -> Self {
        let chain = mem::take(&mut system.assembly.chain);
        let log = mem::take(&mut system.assembly.log);
        let mut motion =
            Motion { system, trajectory, intervals, pulls: Vec::new(), returns: OnceLock::new(), until_s, effort };
        motion.pulls = motion.pulls();
        Self { motion: Arc::new(motion), chain, log }
    }

    /// The same motion through another measuring chain: that of a rig which differs in mechanisms of the chain only.
    ///
    /// # Errors
    /// A quantity that is no physical value.
    pub fn through(&self, rig: &Rig, approach: &Approach, effects: &[Effect]) -> Result<Self, RigError> {
        let Assembly { chain, log, .. } = Assembly::new(rig, approach, effects)?;
        Ok(Self { motion: self.motion.clone(), chain, log })
    }

    /// The end of the simulation, s.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.motion.until_s
    }

    /// The approach as it really was, after mechanisms had changed it.
    #[must_use]
    pub fn approach(&self) -> &Approach {
        &self.motion.system.assembly.approach
    }

    /// What the solver had to do.
    #[must_use]
    pub fn effort(&self) -> Effort {
        self.motion.effort
    }

    /// Begin and end (`None`: still touching) of each contact, s.
    #[must_use]
    pub fn contact_intervals(&self) -> &[(f64, Option<f64>)] {
        &self.motion.intervals
    }

    /// Where a quantity jumps or bends, in order: at first contact, wherever the equations change their form, and where a neck tears. Extrapolated from
    /// `reach_s` (s) on each side, or less where the stretch is shorter.
    #[must_use]
    pub fn kinks(&self, quantity: Quantity, reach_s: f64) -> Vec<Kink> {
        let Motion { trajectory, pulls, system, until_s, .. } = &*self.motion;
        let changes = trajectory.stretches().windows(2).filter(|two| two[0].mode != two[1].mode);
        let tears = pulls.iter().map(|pull| pull.from_s + system.assembly.touched().neck.length_m / pull.speed_m_per_s);
        let mut at_s: Vec<f64> = [0.0].into_iter().chain(changes.map(|two| two[1].start_s)).chain(tears).collect();
        at_s.retain(|at_s| at_s < until_s);
        at_s.sort_by(f64::total_cmp);
        at_s.dedup_by(|later_s, sooner_s| *later_s - *sooner_s < CLOSEST_S);
        let bounds = |place: usize| {
            let before_s = place.checked_sub(1).map_or(f64::NEG_INFINITY, |before| at_s[before]);
            (before_s, at_s.get(place + 1).map_or(*until_s, |after_s| *after_s))
        };
        let side = |at_s: f64, reach_s: f64| {
            let (near, far) = (self.value(quantity, at_s + reach_s), self.value(quantity, at_s + 2.0 * reach_s));
            (2.0 * near - far, (far - near) / reach_s)
        };
        let kink = |(place, &at_s): (usize, &f64)| {
            let (from_s, until_s) = bounds(place);
            let before = side(at_s, -reach_s.min(0.25 * (at_s - from_s)));
            let after = side(at_s, reach_s.min(0.25 * (until_s - at_s)));
            Kink { at_s, jump: after.0 - before.0, slope: after.1 - before.1 }
        };
        at_s.iter().enumerate().map(kink).collect()
    }

    /// Force at the cell, N. Zero before first contact; after the end, its last value.
    #[must_use]
    pub fn force_n(&self, time_s: f64) -> f64 {
        self.value(Quantity::CellForce, time_s)
    }

    /// A quantity at an instant. Before first contact the robot comes at its speed; after the end, the last value.
    #[must_use]
    pub fn value(&self, quantity: Quantity, time_s: f64) -> f64 {
        if time_s < 0.0 {
            return self.before(quantity, time_s);
        }
        self.inside(quantity, self.motion.trajectory.find(time_s), time_s)
    }

    /// A quantity at rising instants.
    #[must_use]
    pub fn sample(&self, quantity: Quantity, times_s: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; times_s.len()];
        self.sample_into(quantity, times_s, &mut values);
        values
    }

    /// As [`Impact::sample`], into a buffer of the same length.
    pub fn sample_into(&self, quantity: Quantity, times_s: &[f64], values: &mut [f64]) {
        let before = times_s.partition_point(|time_s| *time_s < 0.0);
        let within = times_s.partition_point(|time_s| *time_s <= self.motion.until_s);
        for (time_s, value) in times_s[..before].iter().zip(&mut *values) {
            *value = self.before(quantity, *time_s);
        }
        values[within.max(before)..].fill(self.inside(
            quantity,
            self.motion.trajectory.stretches().len() - 1,
            self.motion.until_s,
        ));
        let (mut times_s, mut values) = (&times_s[before..within.max(before)], &mut values[before..within.max(before)]);
        let mut stretch = 0;
        while let Some(first_s) = times_s.first() {
            let stretches = self.motion.trajectory.stretches();
            while stretch + 1 < stretches.len() && stretches[stretch].end_s <= *first_s {
                stretch += 1;
            }
            let last = stretch + 1 == stretches.len();
            let end_s = stretches[stretch].end_s;
            let inside = if last { times_s.len() } else { times_s.partition_point(|time_s| *time_s < end_s) };
            let (here_s, here) = (&times_s[..inside], &mut values[..inside]);
            if !self.motion.read(quantity, stretch, here_s, here) {
                here.iter_mut()
                    .zip(here_s)
                    .for_each(|(value, time_s)| *value = self.inside(quantity, stretch, *time_s));
            }
            (times_s, values) = (&times_s[inside..], &mut values[inside..]);
        }
    }

    /// Force, N, as the measuring chain with its mechanisms delivers it, sampled at rising instants.
    ///
    /// A chain has a memory: the first instant should be before contact, and the chain is at rest there.
    #[must_use]
    pub fn measured_n(&self, times_s: &[f64]) -> Vec<f64> {
        let shown_s = self.shown_s(times_s);
        let mut signal = self.sample(Quantity::CellForce, &shown_s);
        self.apply_chain(&shown_s, 0.0, &mut signal);
        self.apply_log(&shown_s, &mut signal);
        signal.truncate(times_s.len());
        signal
    }

    /// These instants (s), and those after them, spaced as the last two, that a log which has lost samples shows in their place.
    #[must_use]
    pub fn shown_s<'a>(&self, times_s: &'a [f64]) -> Cow<'a, [f64]> {
        let ahead_s = ahead_s(&self.log);
        let &[.., before_s, last_s] = times_s else { return times_s.into() };
        if ahead_s <= 0.0 {
            return times_s.into();
        }
        let step_s = last_s - before_s;
        let more = (1..=(ahead_s / step_s).ceil() as usize).map(|number| last_s + number as f64 * step_s);
        times_s.iter().copied().chain(more).collect()
    }

    /// Whether mechanisms act in the measuring chain.
    #[must_use]
    pub fn has_chain(&self) -> bool {
        !self.chain.is_empty()
    }

    /// Whether mechanisms of the measuring chain remember what they were given.
    #[must_use]
    pub fn is_late(&self) -> bool {
        self.chain.iter().any(|stage| stage.delay_s() > 0.0)
    }

    /// Sends a signal (N), sampled at rising instants (s), through the measuring chain's mechanisms. What reads the chain's zero (N) as well
    /// is told it; it is not in the signal, before or after.
    pub fn apply_chain(&self, times_s: &[f64], zero_n: f64, signal_n: &mut [f64]) {
        for stage in &self.chain {
            if stage.reads_zero() {
                signal_n.iter_mut().for_each(|force| *force += zero_n);
                stage.apply(times_s, signal_n);
                signal_n.iter_mut().for_each(|force| *force -= zero_n);
            } else {
                stage.apply(times_s, signal_n);
            }
        }
    }

    /// Does to samples (N) at rising instants (s) what the log does to them. A mean over samples is to be what it is before: here it jumps.
    pub fn apply_log(&self, times_s: &[f64], signal_n: &mut [f64]) {
        self.log.iter().for_each(|stage| stage.apply(times_s, signal_n));
    }

    /// Peaks, impulses and instants, from the dense output.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let contacts: Vec<Contact> = self.motion.intervals.iter().map(|interval| self.contact(*interval)).collect();
        let (peak_n, peak_s) = contacts.iter().fold((0.0, 0.0), |best, contact| {
            if contact.peak_n > best.0 { (contact.peak_n, contact.peak_s) } else { best }
        });
        Truth { contacts, peak_n, peak_s }
    }

    fn contact(&self, (start_s, end_s): (f64, Option<f64>)) -> Contact {
        let last_s = end_s.unwrap_or(self.motion.until_s);
        let tip_m_per_s = |time_s: f64| self.instant(self.motion.trajectory.find(time_s), time_s).tip_m_per_s;
        let mut contact = Contact {
            start_s,
            end_s,
            peak_n: 0.0,
            peak_s: start_s,
            impulse_ns: 0.0,
            stroke_m: 0.0,
            loss_j: 0.0,
            speed_before_m_per_s: tip_m_per_s(start_s),
            speed_after_m_per_s: tip_m_per_s(last_s),
        };
        let first = self.motion.trajectory.find(start_s);
        for (number, stretch) in self.motion.trajectory.stretches().iter().enumerate().skip(first) {
            if stretch.start_s >= last_s {
                break;
            }
            let (from_s, to_s) = (stretch.start_s, stretch.end_s.min(last_s));
            let half_s = (to_s - from_s) / 2.0;
            for (place, weight) in GAUSS_LEGENDRE_8.into_iter().flat_map(|(x, w)| [(-x, w), (x, w)]) {
                let instant = self.instant(number, from_s + half_s * (1.0 + place));
                contact.impulse_ns += weight * half_s * self.motion.system.cell_n(&instant);
                contact.loss_j += weight * half_s * instant.contact_n * instant.tip_m_per_s;
            }
            for quantity in [Quantity::CellForce, Quantity::Stroke] {
                let (time_s, value) = self.highest(quantity, number, from_s, to_s);
                if quantity == Quantity::Stroke {
                    contact.stroke_m = contact.stroke_m.max(value);
                } else if value > contact.peak_n {
                    (contact.peak_s, contact.peak_n) = (time_s, value);
                }
            }
        }
        contact
    }

    /// The highest value within a stretch: the best of sixteen parts, narrowed by golden section.
    fn highest(&self, quantity: Quantity, stretch: usize, from_s: f64, to_s: f64) -> (f64, f64) {
        const PARTS: usize = 16;
        let at = |part: usize| from_s + (to_s - from_s) * part as f64 / PARTS as f64;
        let value = |time_s: f64| self.inside(quantity, stretch, time_s);
        let best = (0..=PARTS).max_by(|a, b| value(at(*a)).total_cmp(&value(at(*b)))).unwrap_or(0);
        let (mut low, mut high) = (at(best.saturating_sub(1)), at((best + 1).min(PARTS)));
        let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
        for _ in 0..40 {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            if value(left) < value(right) { low = left } else { high = right }
        }
        let middle = (low + high) / 2.0;
        let candidates = [middle, at(best)];
        let time_s = if value(candidates[1]) > value(candidates[0]) { candidates[1] } else { candidates[0] };
        (time_s, value(time_s))
    }

    /// When what is dropped is let go, s after contact: it falls from rest, v/g before. It never was, where nothing falls on the rig.
    #[must_use]
    pub fn released_s(&self) -> f64 {
        let Assembly { kind, approach, gravity_m_per_s2, .. } = &self.motion.system.assembly;
        match kind {
            Kind::Drop if *gravity_m_per_s2 > 0.0 => -approach.speed_m_per_s / gravity_m_per_s2,
            _ => f64::NEG_INFINITY,
        }
    }

    fn before(&self, quantity: Quantity, time_s: f64) -> f64 {
        let assembly = &self.motion.system.assembly;
        let sway = |of: fn(Sway, f64) -> f64, time_s: f64| assembly.sway.map_or(0.0, |sway| of(sway, time_s));
        let mean = || assembly.approach.speed_m_per_s - sway(Sway::velocity_m_per_s, 0.0);
        // Until it is let go it hangs.
        let falling_s = time_s.max(self.released_s());
        let gravity = assembly.gravity_m_per_s2;
        match (assembly.kind, quantity) {
            (Kind::Fall, _) => 0.0,
            (_, Quantity::Position) => {
                mean() * falling_s + 0.5 * gravity * falling_s * falling_s + sway(Sway::position_m, time_s)
            }
            (_, Quantity::Velocity) => mean() + gravity * falling_s + sway(Sway::velocity_m_per_s, time_s),
            (_, Quantity::Acceleration) => {
                let falls = if falling_s > time_s { 0.0 } else { gravity };
                falls + sway(Sway::acceleration_m_per_s2, time_s)
            }
            _ => 0.0,
        }
    }

    fn instant(&self, stretch: usize, time_s: f64) -> Instant {
        let mut state = [0.0; MOST_STATES];
        let time_s = time_s.min(self.motion.until_s);
        self.motion.trajectory.state(stretch, time_s, &mut state);
        self.motion.system.instant(time_s, &state, &self.motion.trajectory.stretches()[stretch].mode)
    }

    fn inside(&self, quantity: Quantity, stretch: usize, time_s: f64) -> f64 {
        let mut read = [0.0];
        if self.motion.read(quantity, stretch, &[time_s.min(self.motion.until_s)], &mut read) {
            return read[0];
        }
        let instant = self.instant(stretch, time_s);
        match quantity {
            Quantity::ContactForce => instant.contact_n - self.motion.neck_n(time_s),
            Quantity::Friction => instant.friction_n,
            _ => unreachable!("read above"),
        }
    }
}

/// What happens within this, s, happens at once: at 100 kS/s a ten-thousandth of a sample.
const CLOSEST_S: f64 = 1e-9;

/// Springs that are pressed by less than this, m, are back: a hundredth of what a gauge tells.
const SMALLEST_M: f64 = 1e-8;

/// From one place of a return to the next the stroke falls to this part: interpolation of a stroke behind a drag errs by 10⁻³ of it.
const RETURN_STEP: f64 = 0.85;

/// A robot that hardly moves away tears no faster than this, m/s.
const SLOWEST_M_PER_S: f64 = 1e-3;

/// Positive nodes and their weights of the 8-point Gauss–Legendre rule on [−1, 1] (Abramowitz and Stegun, 25.4.30).
const GAUSS_LEGENDRE_8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

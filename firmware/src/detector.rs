//! The per-sample path: calibrate, track, detect, capture.
//!
//! ```text
//!            ┌──────────── onset ───────────┐         ┌─ longest time ─┐
//!   idle ────┘   open: nothing is learned   └─ ended ─┤                ├─▶ waiting for the contact to end ─▶ idle
//!    ▲           0.5 s transient, then held           │                │   (or to stand still for 30 s)
//!    └──────────────────── over ◀─────────────────────┘                └─ over, truncated
//! ```
//!
//! A contact has ended when the force has gone, or when what is left of it is a rest that friction holds ([`crate::rest`]).
//! Then the detector idles on that rest: an onset is what rises from it, or from the true zero where the rest pulls. Forces
//! count from the true zero all the same, because what the body feels is all of it; the rest is remembered until it leaves
//! ([`crate::idle`]).
//!
//! Runs at interrupt priority on the board. It says that something began, and later that it is over; what it
//! was is [`crate::impact::evaluate`]'s work, on the captured curve, when there is time.
//!
//! Whether something still touches is judged by the force through the verdict filter (causal here), because a blow
//! leaves the cell ringing long after it has left. While an impact is open nothing is learned: zero and hum are
//! extrapolated as they were known at its onset.

use heapless::Vec;

use crate::board::{AdcCode, BLOCK, BlockInfo, Overrun};
use crate::calibration::{self, Calibration, Change, Lasting};
use crate::capture::{Captures, SlotId, pre_trigger};
use crate::configuration::{Configuration, ContactKind, Setting};
use crate::event::{Flags, Onset};
use crate::forecast::Known;
use crate::idle::{Baseline, Idle};
use crate::onset::{OnsetDetector, limited};
use crate::rest::{End, Touch};
use crate::units::{Hertz, Kilogram, Newton, NewtonSecond, Second};

use self::phase::{OpenImpact, Phase, Spans, causal_filter};

mod phase;

/// The transient window, from the instant of contact, ISO/PAS 5672.
pub const TRANSIENT_WINDOW: Second = Second(0.5);
/// Longest impact that is followed. A clamping test holds for a few seconds; what lasts longer is a thing that leans
/// on the sensor.
pub const LONGEST_IMPACT: Second = Second(10.0);
/// The force has gone when its filtered value has stayed below half the threshold for this long: four times the delay
/// of the causal verdict filter at 100 Hz.
pub const RELEASE: Second = Second(0.02);
/// A force that has outlasted the longest impact and has not moved by more than half the threshold for this long is taken
/// for a new zero (a cable that was moved, a tool that was left on the pad).
pub const NEW_ZERO_AFTER: Second = Second(30.0);
/// The quasi-static maximum begins this long after the transient window: the delay of the causal verdict filter at 100 Hz, within
/// which it still shows the transient.
const FILTER_DELAY: Second = Second(0.005);

/// What the detector has to say after a block.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "no allocation, and a block rarely says more than one thing")]
pub enum Signal {
    /// A contact began: raise the alarm now.
    Onset(Onset),
    /// The impact is over and its curve stands in a slot: evaluate it.
    Over(ImpactContext),
    /// A fault of the chain appeared.
    FaultRaised(ChainFault),
    /// A fault of the chain has gone.
    FaultCleared(ChainFault),
    /// Samples were lost.
    Lost(u32),
}

/// Faults of the measuring chain that last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChainFault {
    /// The IEPE bias left its range: cable broken or shorted.
    Bias,
    /// The signal sits at the end of its range while nothing touches.
    Clipped,
}

/// Signals of one block, in the order of time.
pub type Signals = Vec<Signal, 6>;

/// What the detector knew about an impact that the curve does not show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactContext {
    /// Number of the impact since power-up.
    pub impact: u32,
    /// Where its curve stands.
    pub slot: SlotId,
    /// The onset that opened it.
    pub onset: Onset,
    /// Configuration it began under, with its stamp.
    pub configuration: Stamped,
    /// Flags that the detector already knows (clipping, loss, bias, settling, held, truncated).
    pub flags: Flags,
    /// Noise of the idle signal before it, root mean square.
    pub noise: Newton,
    /// Effective mass latched at onset, with its age in ms where it was received.
    pub effective_mass: Option<(Kilogram, Option<u32>)>,
    /// Largest filtered force after the transient window, if the contact lasted that long.
    pub quasi_static: Option<Newton>,
    /// True zero, drift and hum as known at the onset, to be removed from the curve.
    pub baseline: Baseline,
    /// The rest from which the force rose, above the true zero; zero where there was none.
    pub rest_before: Newton,
    /// The rest that stayed after it; zero where there is none.
    pub rest_after: Newton,
    /// The sample after the last one that belongs to the impact.
    pub end: u64,
    /// The last sample at which the filtered force was above half the threshold and was not yet the rest.
    pub last_touch: u64,
    /// The first sample after the end of the captured curve.
    pub curve_end: u64,
    /// Impulse from the end of the captured curve on, for a contact that outlasts it.
    pub impulse_after_curve: NewtonSecond,
}

/// A configuration with the stamp that every event carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamped {
    /// The configuration.
    pub configuration: Configuration,
    /// Counts the changes since the device was made.
    pub revision: u32,
    /// CRC-32 of its stored form.
    pub hash: u32,
}

/// The per-sample state machine.
pub struct Detector<const N: usize> {
    active: Stamped,
    pending: Option<Stamped>,
    calibration: Calibration,
    spans: Spans,
    idle: Idle,
    onset: OnsetDetector,
    phase: Phase,
    slot: SlotId,
    /// Number of the sample that comes next.
    next_index: u64,
    impacts: u32,
    mass: Option<ReceivedMass>,
    bias: Lasting,
    clipped: Lasting,
    /// First sample after the latest loss.
    after_loss: Option<u64>,
}

#[derive(Clone, Copy)]
struct ReceivedMass {
    mass: Kilogram,
    at: u64,
}

impl<const N: usize> Detector<N> {
    /// A detector that settles first and is armed then.
    #[must_use]
    pub const fn new(configuration: Stamped) -> Self {
        Self {
            active: configuration,
            pending: None,
            calibration: Calibration::new(&configuration.configuration.chain),
            spans: Spans { transient: 0, longest: 0, release: 0, still: 0, new_zero: 0, filter_delay: 0, healthy: 0 },
            idle: Idle::new(),
            onset: OnsetDetector::new(),
            phase: Phase::Start,
            slot: SlotId(0),
            next_index: 0,
            impacts: 0,
            mass: None,
            bias: Lasting::new(),
            clipped: Lasting::new(),
            after_loss: None,
        }
    }

    /// Sets the configuration that takes effect as soon as no impact is open.
    pub fn configure(&mut self, configuration: Stamped) {
        self.pending = Some(configuration);
        if !self.impact_open() {
            self.adopt();
        }
    }

    /// A robot controller said how heavy the robot is now. A mass outside the permitted range is not taken.
    pub fn receive_effective_mass(&mut self, mass: Kilogram) {
        let permitted = Setting::EffectiveMass.range().is_none_or(|(low, high)| mass.0 >= low && mass.0 <= high);
        if permitted {
            self.mass = Some(ReceivedMass { mass, at: self.next_index });
        }
    }

    /// Whether an impact is open; nothing is written to flash meanwhile.
    #[must_use]
    pub fn impact_open(&self) -> bool {
        matches!(self.phase, Phase::Open(_))
    }

    /// What a forecast of the open impact can be from; `None` where none is open, or its force, mass or signal is not to be trusted.
    #[must_use]
    pub fn known(&self) -> Option<Known> {
        let Phase::Open(open) = &self.phase else { return None };
        let (mass, _) = open.effective_mass.filter(|_| !open.flags.intersects(Flags::VOID))?;
        Some(Known { mass, stiffness: self.active.configuration.body_stiffness })
    }

    /// Whether zero, hum and noise are known well enough to judge by.
    #[must_use]
    pub fn settled(&self) -> bool {
        matches!(self.phase, Phase::Idle | Phase::Open(_)) && self.idle.settled()
    }

    /// Noise of the idle signal, root mean square.
    #[must_use]
    pub fn noise(&self) -> Newton {
        Newton(self.idle.noise())
    }

    /// True zero, drift and hum as tracked now.
    #[must_use]
    pub fn baseline(&self) -> Baseline {
        self.idle.baseline(self.next_index)
    }

    /// The threshold at which a force becomes an onset; infinite until one block of 0.1 s has been seen.
    #[must_use]
    pub fn threshold(&self) -> Newton {
        Newton(self.onset.threshold())
    }

    /// Takes a block. Longer slices than a block are taken too, up to 0.1 s, within which no more can happen than
    /// [`Signals`] can hold.
    pub fn push(&mut self, codes: &[AdcCode], info: &BlockInfo, captures: &Captures<N>) -> Signals {
        let mut signals = Signals::new();
        self.push_into(codes, info, captures, &mut signals);
        signals
    }

    /// The same without moving the list, which has room for some kilobytes and mostly holds nothing: moving it took more
    /// instructions than the samples.
    pub fn push_into(&mut self, codes: &[AdcCode], info: &BlockInfo, captures: &Captures<N>, signals: &mut Signals) {
        if info.first_index < self.next_index {
            // The board has lost count; nobody knows how many samples are gone, and nothing before fits what follows.
            self.lose(0, signals);
            if let Some(context) = self.close(None, captures) {
                say(signals, Signal::Over(context));
            }
            self.phase = Phase::Start;
            self.mass = None;
            self.next_index = info.first_index;
            self.after_loss = Some(info.first_index);
            self.adopt();
        } else if info.first_index > self.next_index {
            self.lose(info.first_index - self.next_index, signals);
        }
        if self.after_loss == Some(self.next_index) {
            captures.gap(self.slot, self.next_index);
        }
        self.watch_bias(codes.len() as u32, info, signals);
        for chunk in codes.chunks(BLOCK) {
            self.push_chunk(chunk, captures, signals);
        }
    }

    /// Samples were lost before the next block.
    pub fn overrun(&mut self, overrun: Overrun) -> Signals {
        let mut signals = Signals::new();
        self.lose(u64::from(overrun.lost), &mut signals);
        signals
    }

    fn lose(&mut self, lost: u64, signals: &mut Signals) {
        self.next_index = self.next_index.saturating_add(lost);
        self.after_loss = Some(self.next_index);
        self.idle.skip(lost);
        self.onset.clear();
        if let Phase::Open(open) = &mut self.phase {
            open.flags |= Flags::LOST_SAMPLES;
        }
        say(signals, Signal::Lost(u32::try_from(lost).unwrap_or(u32::MAX)));
    }

    fn watch_bias(&mut self, samples: u32, info: &BlockInfo, signals: &mut Signals) {
        let healthy = calibration::bias_healthy(info.bias, &self.active.configuration.chain);
        match self.bias.observe(!healthy, samples, 1, self.spans.healthy) {
            Some(Change::Raised) => say(signals, Signal::FaultRaised(ChainFault::Bias)),
            Some(Change::Cleared) => {
                say(signals, Signal::FaultCleared(ChainFault::Bias));
                // What was learned while the cell was dead is worth nothing.
                if matches!(self.phase, Phase::Idle) {
                    self.phase = Phase::Start;
                }
            }
            None => {}
        }
        if self.bias.raised()
            && let Phase::Open(open) = &mut self.phase
        {
            open.flags |= Flags::BIAS_FAULT;
        }
    }

    fn push_chunk(&mut self, codes: &[AdcCode], captures: &Captures<N>, signals: &mut Signals) {
        let clips = codes.iter().any(|code| self.calibration.clipped(*code));
        if !self.impact_open() {
            self.watch_clipping(clips, codes.len() as u32, signals);
        }
        if matches!(self.phase, Phase::Start) && !clips {
            self.start(codes);
        }
        let mut began = None;
        let mut touched = codes;
        if matches!(self.phase, Phase::Idle) {
            touched = &[];
            if let Some((place, force)) = self.take_idle(codes) {
                let open = self.begin(force + self.idle.rest());
                began = Some(open.onset);
                self.phase = Phase::Open(open);
                self.next_index += 1;
                touched = &codes[place + 1..];
            }
        }
        self.take_touched(touched);
        captures.append(self.slot, codes);
        if let Phase::Open(open) = &mut self.phase {
            if clips {
                open.flags |= Flags::CLIPPED;
            }
            if let Some(onset) = began {
                open.curve_end = captures.open(self.slot, onset.noticed_at) + N as u64;
                say(signals, Signal::Onset(onset));
            }
        }
        self.end_chunk(captures, signals);
    }

    fn watch_clipping(&mut self, clips: bool, samples: u32, signals: &mut Signals) {
        // Only what lasts is a fault: a blow that clips is an impact with a flag.
        match self.clipped.observe(clips, samples, self.spans.healthy, self.spans.healthy) {
            Some(Change::Raised) => {
                self.phase = Phase::Start;
                say(signals, Signal::FaultRaised(ChainFault::Clipped));
            }
            Some(Change::Cleared) => say(signals, Signal::FaultCleared(ChainFault::Clipped)),
            None => {}
        }
    }

    /// Begins to learn the idle signal from these codes on.
    fn start(&mut self, codes: &[AdcCode]) {
        let chain = &self.active.configuration.chain;
        self.calibration = Calibration::new(chain);
        self.spans = Spans::new(chain.sample_rate);
        // The median of the first codes: one spike among them does not matter.
        let mut sorted: Vec<AdcCode, BLOCK> = codes.iter().copied().take(BLOCK).collect();
        sorted.sort_unstable();
        let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(chain.zero_code);
        let first = self.calibration.force(middle);
        self.idle.start(chain.sample_rate, self.calibration.quantisation_noise(), first);
        self.onset = OnsetDetector::new();
        self.phase = Phase::Idle;
    }

    /// Takes samples while nothing touches, up to an onset: its place among them and its force. The onset's sample is not yet
    /// counted.
    ///
    /// A run of samples up to the end of a group at a time, so that what changes from sample to sample stays in registers.
    fn take_idle(&mut self, codes: &[AdcCode]) -> Option<(usize, f32)> {
        let mut taken = 0;
        while taken < codes.len() {
            let run = &codes[taken..];
            let run = &run[..run.len().min(self.idle.until_group_ends())];
            let limit = self.onset.limit_below(self.idle.first_limit_until_armed());
            // On a rest that pulls, the force that counts still begins at the true zero.
            let pull = self.idle.rest().min(0.0);
            let mut gathering = self.idle.gathering();
            let mut found = None;
            for (place, code) in run.iter().enumerate() {
                let rest = gathering.remove(self.calibration.force(*code));
                let known = limited(rest, limit);
                gathering.learn(known);
                let counts = if pull < 0.0 { limited(rest + pull, limit) } else { known };
                if self.onset.push(counts) {
                    found = Some((place, rest));
                    break;
                }
            }
            if let Some((place, force)) = found {
                self.idle.gather(&gathering, place + 1, self.onset.threshold());
                self.next_index += place as u64;
                return Some((taken + place, force));
            }
            if self.idle.gather(&gathering, run.len(), self.onset.threshold()) {
                self.set_threshold();
                if !self.idle.settled() {
                    // The zero may just have jumped, and the window stands on the old one.
                    self.onset.clear();
                }
            }
            taken += run.len();
            self.next_index += run.len() as u64;
        }
        None
    }

    /// Takes samples while something touches, or may: nothing is learned from them. By runs, as [`Self::take_idle`].
    fn take_touched(&mut self, codes: &[AdcCode]) {
        let mut taken = 0;
        while taken < codes.len() {
            let until = self.idle.until_group_ends();
            let run = &codes[taken..codes.len().min(taken + until)];
            let release = self.onset.release_level();
            let below = self.idle.rest();
            let mut passing = self.idle.gathering();
            let calibration = &self.calibration;
            let forces = run.iter().map(|code| passing.remove(calibration.force(*code)) + below);
            match &mut self.phase {
                Phase::Start | Phase::Idle => forces.for_each(drop),
                Phase::Open(open) => {
                    open.take(forces, self.next_index, run.len() == until, release, &self.spans);
                }
                Phase::Waiting(touch) => {
                    for (index, force) in (self.next_index..).zip(forces) {
                        touch.take(force, index, release, self.spans.still);
                    }
                }
            }
            self.idle.hold(&passing, run.len());
            taken += run.len();
            self.next_index += run.len() as u64;
        }
    }

    fn set_threshold(&mut self) {
        let configuration = &self.active.configuration;
        let minimum = configuration.onset_minimum.0;
        self.onset.set_noise(self.idle.noise(), self.idle.noise_of_mean(), configuration.onset_multiple, minimum);
    }

    /// An impact begins with the sample that is being taken.
    fn begin(&mut self, force: f32) -> OpenImpact {
        let configuration = &self.active.configuration;
        let chain = &configuration.chain;
        self.impacts = self.impacts.wrapping_add(1);
        let onset = Onset {
            impact: self.impacts,
            noticed_at: self.next_index,
            threshold: Newton(self.onset.threshold()),
            force: Newton(force),
        };
        let effective_mass = match self.mass {
            Some(received) => {
                Some((received.mass, Some(milliseconds(self.next_index - received.at, chain.sample_rate))))
            }
            None => configuration.effective_mass.map(|mass| (mass, None)),
        };
        let mut flags = Flags::empty();
        if configuration.contact == ContactKind::Free {
            match effective_mass {
                None => flags |= Flags::NO_MASS,
                Some((_, Some(age))) if age > configuration.effective_mass_max_age_ms => flags |= Flags::STALE_MASS,
                Some(_) => {}
            }
        }
        flags.set(Flags::UNSETTLED, !self.idle.settled());
        flags.set(Flags::BIAS_FAULT, self.bias.raised());
        let pre_trigger = pre_trigger(N) as u64;
        flags.set(Flags::LOST_SAMPLES, self.after_loss.is_some_and(|after| after + pre_trigger > self.next_index));
        let open = OpenImpact {
            onset,
            flags,
            noise: self.idle.noise(),
            baseline: self.idle.baseline(self.next_index + 1),
            rest_before: self.idle.rest(),
            effective_mass,
            touch: Touch::new(causal_filter(configuration), self.idle.rest(), self.next_index),
            quasi_static: None,
            quasi_static_from: self.next_index + self.spans.transient + self.spans.filter_delay,
            curve_end: self.next_index,
            group_sum: 0.0,
            sum_after_curve: 0.0,
        };
        self.idle.freeze();
        open
    }

    fn end_chunk(&mut self, captures: &Captures<N>, signals: &mut Signals) {
        let now = self.next_index;
        let spans = self.spans;
        let release = self.onset.release_level();
        match &mut self.phase {
            Phase::Open(open) => {
                let began = open.onset.noticed_at;
                if now < began + spans.transient {
                    return;
                }
                let end = open.touch.end(now, release, spans.release);
                if end.is_none() && now < began + spans.longest {
                    return;
                }
                open.flags.set(Flags::HELD, open.touch.last(release) >= began + spans.transient);
                open.flags.set(Flags::TRUNCATED, end.is_none());
                let touch = open.touch;
                if let Some(context) = self.close(end, captures) {
                    say(signals, Signal::Over(context));
                }
                match end {
                    Some(end) => self.re_arm(end),
                    None => self.phase = Phase::Waiting(touch),
                }
                self.adopt();
            }
            Phase::Waiting(touch) => {
                let touch = *touch;
                let (standing, level) = touch.standing(now);
                if let Some(end) = touch.end(now, release, spans.release) {
                    self.re_arm(end);
                } else if standing > spans.new_zero {
                    self.idle.take_for_zero(level);
                    self.onset.clear();
                    self.phase = Phase::Idle;
                }
            }
            Phase::Start | Phase::Idle => {}
        }
    }

    /// Nothing touches any more: idles on what is left of the force.
    fn re_arm(&mut self, end: End) {
        match end {
            End::Still(level) => self.idle.stand(level, self.onset.release_level()),
            End::Gone => self.idle.resume(),
        }
        self.onset.clear();
        self.phase = Phase::Idle;
    }

    /// Finishes the curve of the open impact and sums it up. `end`: how its last contact ended, if it has.
    fn close(&mut self, end: Option<End>, captures: &Captures<N>) -> Option<ImpactContext> {
        let Phase::Open(open) = &self.phase else { return None };
        let release = self.onset.release_level();
        let last_touch = open.touch.last(release);
        let curve_end = open.curve_end.min(self.next_index);
        let mut after_curve = open.sum_after_curve + open.group_sum;
        let rest_after = match end {
            Some(End::Still(level)) if level.abs() > release => level,
            _ => 0.0,
        };
        // What rests is no longer the contact's.
        let resting = self.next_index - last_touch.max(curve_end);
        after_curve -= rest_after * resting as f32;
        let finished = self.slot;
        self.slot = captures.finish(finished, self.next_index);
        let period = 1.0 / self.active.configuration.chain.sample_rate.0;
        Some(ImpactContext {
            impact: open.onset.impact,
            slot: finished,
            onset: open.onset,
            configuration: self.active,
            flags: open.flags,
            noise: Newton(open.noise),
            effective_mass: open.effective_mass,
            quasi_static: open.quasi_static.map(Newton),
            baseline: open.baseline,
            rest_before: Newton(open.rest_before),
            rest_after: Newton(rest_after),
            end: self.next_index,
            last_touch,
            curve_end,
            impulse_after_curve: NewtonSecond(after_curve * period),
        })
    }

    /// Puts the pending configuration into effect.
    fn adopt(&mut self) {
        let Some(next) = self.pending.take() else { return };
        let chain_changed = next.configuration.chain != self.active.configuration.chain;
        self.active = next;
        if chain_changed {
            self.calibration = Calibration::new(&next.configuration.chain);
            self.phase = Phase::Start;
        } else if self.idle.armed() {
            self.set_threshold();
        }
    }
}

fn milliseconds(samples: u64, sample_rate: Hertz) -> u32 {
    let milliseconds = samples as f64 * 1000.0 / f64::from(sample_rate.0);
    milliseconds as u32
}

/// Within a block no more can happen than the list holds: a loss, both faults, the end of one impact and an onset.
fn say(signals: &mut Signals, signal: Signal) {
    let _ = signals.push(signal);
}

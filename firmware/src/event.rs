//! What the sensor says about a contact, and how sure it is.

use serde::{Deserialize, Serialize};

use crate::units::{Joule, Kilogram, Metre, Newton, NewtonSecond, SampleInstant, Second};

bitflags::bitflags! {
    /// What a reader of the event must know besides its numbers.
    ///
    /// Flags in [`Flags::VOID`] say that the force curve itself is not to be trusted: the verdict is then never
    /// `pass`. The others describe.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub struct Flags: u16 {
        /// The signal reached the end of the ADC's or the amplifier's range.
        const CLIPPED = 1 << 0;
        /// Samples were lost between the pre-trigger and the end of the contact.
        const LOST_SAMPLES = 1 << 1;
        /// The IEPE bias voltage left its range.
        const BIAS_FAULT = 1 << 2;
        /// The received effective mass was older than permitted when the contact began.
        const STALE_MASS = 1 << 3;
        /// No effective mass is known: the force is not scaled (S = 1, the safe side).
        const NO_MASS = 1 << 4;
        /// A second or later contact of the same impact.
        const REBOUND = 1 << 5;
        /// The contact was still held when the transient window ended.
        const HELD = 1 << 6;
        /// The contact outlasted the longest impact that is followed, or the impact had more contacts than events. A held
        /// contact that merely outlasts the captured curve is not truncated: its force and impulse are followed live.
        const TRUNCATED = 1 << 7;
        /// No quasi-static verdict: the chain's time constant is too short to hold a static force.
        const NO_QUASI_STATIC = 1 << 8;
        /// Transient contact with the configured region is not permitted at any force.
        const NOT_PERMITTED = 1 << 9;
        /// The sensor had not yet settled after power-up or after the previous impact.
        const UNSETTLED = 1 << 10;
        /// The verdict filter took more than 10 % off the raw peak: the pulse is shorter than the filter can follow.
        const SHORT_PULSE = 1 << 11;
        /// Friction held a rest of the force, before or after the contact. The contact begins and ends where the force leaves the
        /// rest and comes back to it; peaks and impulse count from the true zero.
        const REST = 1 << 12;
    }
}

impl Flags {
    /// The force curve or its interpretation is touched: such an event never passes.
    pub const VOID: Self = Self::CLIPPED
        .union(Self::LOST_SAMPLES)
        .union(Self::BIAS_FAULT)
        .union(Self::STALE_MASS)
        .union(Self::NO_MASS)
        .union(Self::TRUNCATED)
        .union(Self::UNSETTLED);

    /// The names that files and the command line use, in bit order.
    pub const NAMES: [(Self, &'static str); 13] = [
        (Self::CLIPPED, "clipped"),
        (Self::LOST_SAMPLES, "lost-samples"),
        (Self::BIAS_FAULT, "bias-fault"),
        (Self::STALE_MASS, "stale-mass"),
        (Self::NO_MASS, "no-mass"),
        (Self::REBOUND, "rebound"),
        (Self::HELD, "held"),
        (Self::TRUNCATED, "truncated"),
        (Self::NO_QUASI_STATIC, "no-quasi-static"),
        (Self::NOT_PERMITTED, "not-permitted"),
        (Self::UNSETTLED, "unsettled"),
        (Self::SHORT_PULSE, "short-pulse"),
        (Self::REST, "rest"),
    ];

    /// The names of the flags that are set.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES.into_iter().filter(move |(flag, _)| self.contains(*flag)).map(|(_, name)| name)
    }
}

/// The judgement of a contact against the configured limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum Verdict {
    /// No region is configured, so there is nothing to judge by.
    #[default]
    None = 0,
    /// Below every limit by more than the guard band, and the curve is trustworthy.
    Pass = 1,
    /// Within the guard band of a limit, or the curve is not to be trusted.
    Inconclusive = 2,
    /// Above a limit by more than the guard band, or contact is not permitted at all.
    Fail = 3,
}

impl Verdict {
    /// The word that files and the command line use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Pass => "pass",
            Self::Inconclusive => "inconclusive",
            Self::Fail => "fail",
        }
    }

    /// The verdict with this number on the wire, if there is one.
    #[must_use]
    pub const fn from_number(number: u8) -> Option<Self> {
        match number {
            0 => Some(Self::None),
            1 => Some(Self::Pass),
            2 => Some(Self::Inconclusive),
            3 => Some(Self::Fail),
            _ => None,
        }
    }
}

/// The moment a contact was noticed: what the alarm frame carries, before anything is known about its height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onset {
    /// Number of the impact, counted since power-up.
    pub impact: u32,
    /// The sample at which the force was seen to have passed the threshold.
    pub noticed_at: u64,
    /// The threshold that was passed.
    pub threshold: Newton,
    /// The force at that sample.
    pub force: Newton,
}

/// One contact, measured and judged.
///
/// An *impact* begins with an onset, contains the contacts of its transient window (the blow and its rebounds)
/// and ends when the force has gone. Each contact is one event, so that a rebound can be told from the blow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Consecutive number since power-up; a gap in what a reader has seen is a lost event.
    pub number: u32,
    /// The impact it belongs to.
    pub impact: u32,
    /// 0 for the blow, n for its n-th rebound.
    pub contact: u8,
    /// What else a reader must know.
    pub flags: Flags,
    /// Instant of contact, extrapolated back below the threshold.
    pub contact_instant: SampleInstant,
    /// Instant of the raw peak.
    pub peak_instant: SampleInstant,
    /// Peak of the unfiltered force, interpolated between samples.
    pub raw_peak: Newton,
    /// Peak of the force through the configured filter: what is judged.
    pub peak: Newton,
    /// Integral of the force over the contact.
    pub impulse: NewtonSecond,
    /// From contact to separation.
    pub duration: Second,
    /// Noise of the idle signal before the contact, root mean square.
    pub noise: Newton,
    /// The judgement.
    pub severity: Severity,
    /// Revision of the configuration it was judged by.
    pub configuration_revision: u32,
    /// Hash of that configuration, so that the verdict can be checked years later.
    pub configuration_hash: u32,
}

impl Event {
    /// From contact to the raw peak at this sample rate.
    #[must_use]
    pub fn time_to_peak(&self, sample_rate: crate::units::Hertz) -> Second {
        self.peak_instant.since(self.contact_instant, sample_rate)
    }
}

/// Forces beside their limits, scaled and unscaled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Severity {
    /// The verdict.
    pub verdict: Verdict,
    /// Largest filtered force in the transient window, unscaled. For a rebound, that of its own contact.
    pub transient: Newton,
    /// Scaling factor S = √(m_H / (m_H + m_R)) for a free contact, 1 where it does not apply.
    pub scaling: f32,
    /// S times the transient force.
    pub scaled: Newton,
    /// Largest force after the transient window; `None` where the contact ended before, or the chain cannot hold it.
    pub quasi_static: Option<Newton>,
    /// Transient limit; `None` without a region or where contact is not permitted.
    pub transient_limit: Option<Newton>,
    /// Quasi-static limit; `None` without a region.
    pub quasi_static_limit: Option<Newton>,
    /// Effective mass of the robot, latched at onset; `None` if none is known.
    pub effective_mass: Option<Kilogram>,
    /// Age of that mass at onset, ms; `None` for a configured constant.
    pub effective_mass_age_ms: Option<u32>,
    /// Expanded uncertainty (k = 2) of the force that was compared.
    pub expanded_uncertainty: Newton,
    /// Compression of the body spring at the filtered peak, F/K.
    pub stroke: Metre,
    /// Energy in the body spring at the filtered peak, F²/2K.
    pub energy: Joule,
}

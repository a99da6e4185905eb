//! What the detector is in the middle of: nothing yet, idling, an impact, or waiting for a force to go.

use super::{FILTER_DELAY, LONGEST_IMPACT, NEW_ZERO_AFTER, RELEASE, TRANSIENT_WINDOW};
use crate::calibration::HEALTHY;
use crate::configuration::{Configuration, FilterProfile};
use crate::event::{Flags, Onset};
use crate::filter::Causal;
use crate::idle::Baseline;
use crate::rest::{STILL, Touch};
use crate::units::{Hertz, Kilogram, Second};

/// Durations in samples.
#[derive(Clone, Copy)]
pub struct Spans {
    /// See [`TRANSIENT_WINDOW`].
    pub transient: u64,
    /// See [`LONGEST_IMPACT`].
    pub longest: u64,
    /// See [`RELEASE`].
    pub release: u64,
    /// See [`STILL`].
    pub still: u32,
    /// See [`NEW_ZERO_AFTER`].
    pub new_zero: u64,
    /// See [`FILTER_DELAY`].
    pub filter_delay: u64,
    /// See [`HEALTHY`].
    pub healthy: u32,
}

impl Spans {
    /// At this sample rate.
    pub fn new(sample_rate: Hertz) -> Self {
        let samples = |span: Second| (f64::from(span.0) * f64::from(sample_rate.0)) as u64;
        Self {
            transient: samples(TRANSIENT_WINDOW),
            longest: samples(LONGEST_IMPACT),
            release: samples(RELEASE),
            still: samples(STILL) as u32,
            new_zero: samples(NEW_ZERO_AFTER),
            filter_delay: samples(FILTER_DELAY),
            healthy: samples(HEALTHY) as u32,
        }
    }
}

/// The state.
pub enum Phase {
    /// No sample has come yet under this chain.
    Start,
    /// Nothing touches.
    Idle,
    /// An impact is open.
    Open(OpenImpact),
    /// An impact has outlasted the longest time, and something touches still.
    Waiting(Touch),
}

/// An impact that is open. Forces in N, instants in samples since power-up.
pub struct OpenImpact {
    /// What opened it.
    pub onset: Onset,
    /// What has gone wrong so far.
    pub flags: Flags,
    /// Noise at onset, rms.
    pub noise: f32,
    /// True zero, drift and hum at onset.
    pub baseline: Baseline,
    /// The rest on which it began.
    pub rest_before: f32,
    /// The robot's mass, latched.
    pub effective_mass: Option<(Kilogram, Option<u32>)>,
    /// Whether something still touches.
    pub touch: Touch,
    /// Largest filtered force after the transient window, and the first sample that counts for it.
    pub quasi_static: Option<f32>,
    /// See `quasi_static`.
    pub quasi_static_from: u64,
    /// First sample that the slot has no room for.
    pub curve_end: u64,
    /// Sum of the forces after the curve's end, N; whole groups are added to keep the rounding small.
    pub group_sum: f32,
    /// The groups so far.
    pub sum_after_curve: f32,
}

impl OpenImpact {
    /// Takes a force above the true zero; `group_ends` with every group of the idle tracker.
    #[inline]
    pub fn take(&mut self, force: f32, index: u64, group_ends: bool, release_level: f32, spans: &Spans) {
        let filtered = self.touch.take(force, index, release_level, spans.still);
        if index >= self.quasi_static_from {
            self.quasi_static = Some(self.quasi_static.unwrap_or(filtered).max(filtered));
        }
        if index >= self.curve_end {
            self.group_sum += force;
            if group_ends {
                self.sum_after_curve += self.group_sum;
                self.group_sum = 0.0;
            }
        }
    }
}

/// The filter of the quasi-static force: the configured one, or 100 Hz where none is.
pub fn causal_filter(configuration: &Configuration) -> Causal {
    let corner = configuration.filter.corner().or(FilterProfile::IsoPas5672.corner()).unwrap_or(Hertz(100.0));
    Causal::new(corner, configuration.chain.sample_rate)
}

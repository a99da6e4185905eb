//! The blocks of a prepared recording into the firmware, and what comes out.

use thud_firmware::board::{BLOCK, BlockInfo, Overrun};
use thud_firmware::capture::Curve as _;
use thud_firmware::configuration::{Chain, Configuration};
use thud_firmware::detector::{ChainFault, ImpactContext, Signal, Signals, Stamped};
use thud_firmware::event::{Event, Flags, Onset, Verdict};
use thud_firmware::sensor::Sensor;
use thud_firmware::units::{Hertz, SampleInstant};
use thud_sim::chain::{ChainSettings, FrontEnd, MeasuringChain};

use super::prepare::QUIET_AFTER_S;
use super::{Prepared, ReplayError, prepare};
use crate::recording::Recording;
use crate::report::ForceCurve;

/// A separation this close to the end of a recording that ends under load is that end, s.
const CUT_WITHIN_S: f64 = 0.02;

/// One finished impact.
#[derive(Clone, Debug)]
pub struct Sensed {
    /// What the detector knew of it.
    pub context: ImpactContext,
    /// Its contacts, judged.
    pub events: Vec<Event>,
    /// The captured curve.
    pub curve: ForceCurve,
}

/// What the firmware said about a recording.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// The force that it was given.
    pub prepared: Prepared,
    /// The configuration that it judged by; the sample rate is the replay's.
    pub configuration: Configuration,
    /// Onsets, as the alarm reports them.
    pub onsets: Vec<Onset>,
    /// Finished impacts.
    pub impacts: Vec<Sensed>,
    /// Faults of the chain that were raised, with the sample before which they were.
    pub faults: Vec<(u64, ChainFault)>,
}

impl Replayed {
    /// All events in the order of time.
    pub fn events(&self) -> impl Iterator<Item = &Event> {
        self.impacts.iter().flat_map(|impact| &impact.events)
    }
}

impl Replayed {
    /// Marks the contact that the beginning of the recording cuts: what came before is not known, so it never passes.
    fn mark_begun(&mut self) {
        // The step at the beginning is spread by the front end's own delay, and no more.
        let close = self.prepared.begin + (CUT_WITHIN_S * self.prepared.rate_hz) as u64;
        let begin = self.prepared.begin;
        if let Some(event) = self.impacts.iter_mut().flat_map(|impact| &mut impact.events).next()
            && event.contact_instant.index <= close
        {
            // The force cannot be followed back beyond the first sample that there is.
            if event.contact_instant.index < begin {
                event.contact_instant = SampleInstant { index: begin, fraction: 0.0 };
            }
            truncate(event);
        }
    }

    /// Marks the contact that the end of the recording cuts: its rest is not known, so it never passes.
    ///
    /// The firmware cannot know, as it sees the force end there.
    fn mark_cut(&mut self) {
        let rate = self.prepared.rate_hz;
        // The filter rounds the end off; a separation this close to it is the cut.
        let close = (CUT_WITHIN_S * rate) as u64;
        let last = self.impacts.iter_mut().flat_map(|impact| &mut impact.events).next_back();
        let Some(event) = last else { return };
        let separation = event.contact_instant.index + (f64::from(event.duration.0) * rate) as u64;
        if separation + close >= self.prepared.end {
            truncate(event);
        }
    }
}

/// A part of the contact is not known.
fn truncate(event: &mut Event) {
    event.flags |= Flags::TRUNCATED;
    if event.severity.verdict == Verdict::Pass {
        event.severity.verdict = Verdict::Inconclusive;
    }
}

/// Replays a recording; `file` is the name that errors give it. `rate_hz` overrides the choice of [`prepare`].
///
/// # Errors
/// The recording has no force, too little or too much of it; or the configuration does not validate, the rate with it.
pub fn replay(
    file: &str,
    recording: &Recording,
    configuration: &Configuration,
    rate_hz: Option<f64>,
) -> Result<Replayed, ReplayError> {
    let prepared = prepare(file, recording, rate_hz, f64::from(configuration.chain.newton_per_code))?;
    let mut configuration = *configuration;
    if let Some(plateau) = prepared.plateau_n
        && configuration.chain.newton_per_code == Configuration::DEFAULT.chain.newton_per_code
    {
        let codes = configuration.chain.clip_high - configuration.chain.zero_code;
        configuration.chain.newton_per_code = plateau as f32 / f32::from(codes);
    }
    // A recording has passed its own front end; no filter of ours delays it.
    configuration.chain = Chain { sample_rate: Hertz(prepared.rate_hz as f32), ..configuration.chain.undelayed() };
    configuration
        .validate()
        .map_err(|invalid| ReplayError::Configuration(crate::settings::explain_invalid(invalid)))?;

    // A recording brings its own noise and filters: this chain only quantises and saturates, so it needs no seed.
    let mut chain = MeasuringChain::new(&chain_settings(&configuration.chain), 0);
    let stamped = Stamped { configuration, revision: 0, hash: 0 };
    let mut feed = Feed {
        // Two captured curves are too large for a thread's stack to be relied upon.
        sensor: Box::new(Sensor::new(stamped)),
        replayed: Replayed {
            prepared: prepared.clone(),
            configuration,
            onsets: Vec::new(),
            impacts: Vec::new(),
            faults: Vec::new(),
        },
    };
    // The quiet after the recording is as long as the last impact needs to close.
    let enough = prepared.end + (QUIET_AFTER_S * prepared.rate_hz) as u64;
    let mut next = 0;
    for (index, stretch) in prepared.stretches.iter().enumerate() {
        if stretch.first > next {
            let lost = u32::try_from(stretch.first - next).unwrap_or(u32::MAX);
            let signals = feed.sensor.overrun(Overrun { lost });
            feed.take(signals, next);
        }
        next = stretch.first;
        let after = if index + 1 == prepared.stretches.len() { usize::MAX } else { 0 };
        let mut values = stretch.values.iter().copied().chain(prepared.after_end().take(after));
        while next <= enough || feed.sensor.impact_open() {
            let (mut newtons, mut count) = ([0.0; BLOCK], 0);
            for (newton, value) in newtons.iter_mut().zip(&mut values) {
                *newton = value;
                count += 1;
            }
            if count == 0 {
                break;
            }
            let mut codes = [0; BLOCK];
            chain.convert(&mut newtons[..count], &mut codes[..count]);
            let info = BlockInfo { first_index: next, bias: chain.bias() };
            let signals = feed.sensor.push(&codes[..count], &info);
            feed.take(signals, next);
            next += count as u64;
        }
    }
    let mut replayed = feed.replayed;
    if prepared.begins_cut {
        replayed.mark_begun();
    }
    if prepared.cut {
        replayed.mark_cut();
    }
    Ok(replayed)
}

struct Feed {
    sensor: Box<Sensor>,
    replayed: Replayed,
}

impl Feed {
    fn take(&mut self, signals: Signals, at: u64) {
        for signal in signals {
            match signal {
                Signal::Onset(onset) => self.replayed.onsets.push(onset),
                Signal::Over(context) => {
                    let curve = self.curve(&context);
                    let events = self.sensor.evaluate(&context).into_iter().collect();
                    self.replayed.impacts.push(Sensed { context, events, curve });
                }
                Signal::FaultRaised(fault) => self.replayed.faults.push((at, fault)),
                // Losses are the recording's own and counted there.
                Signal::FaultCleared(_) | Signal::Lost(_) => {}
            }
        }
    }
}

impl Feed {
    fn curve(&self, context: &ImpactContext) -> ForceCurve {
        let curve = self.sensor.curve(context);
        let mut codes = vec![0; curve.len()];
        let read = curve.read(0, &mut codes);
        codes.truncate(read);
        let configuration = &context.configuration.configuration;
        ForceCurve::from_codes(
            curve.first_index(),
            &codes,
            &configuration.chain,
            &context.baseline,
            configuration.filter,
        )
    }
}

/// The simulated chain that this configuration is calibrated for: sensitivity, rails, 16 bits, and nothing else.
fn chain_settings(chain: &Chain) -> ChainSettings {
    let reference = FrontEnd::REFERENCE;
    let gain = reference.gain * reference.newton_per_code() / f64::from(chain.newton_per_code);
    let front_end = FrontEnd {
        gain,
        zero_code: chain.zero_code,
        lower_rail: chain.clip_low,
        upper_rail: chain.clip_high,
        ..reference
    };
    ChainSettings { sample_rate: chain.sample_rate, front_end, ..ChainSettings::transparent() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_beyond_full_scale_saturates_and_a_smaller_one_is_rounded() {
        for newton_per_code in [Chain::REFERENCE.newton_per_code, 0.001] {
            let configured = Chain { newton_per_code, ..Chain::REFERENCE };
            let mut chain = MeasuringChain::new(&chain_settings(&configured), 0);
            let mut newtons = [0.0, 1e9, -1e9, 20.0];
            let mut codes = [0; 4];
            chain.convert(&mut newtons, &mut codes);
            assert_eq!(codes[..3], [configured.zero_code, configured.clip_high, configured.clip_low]);
            let back = f32::from(codes[3] - configured.zero_code) * newton_per_code;
            assert!((back - 20.0).abs() <= 0.51 * newton_per_code, "{back}");
        }
    }
}

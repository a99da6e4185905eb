//! The blocks of a prepared recording into the firmware, and what comes out.

use thud_firmware::board::{AdcCode, BLOCK, BlockInfo, Overrun};
use thud_firmware::configuration::{Chain, Configuration};
use thud_firmware::detector::{ChainFault, ImpactContext, Signal, Signals, Stamped};
use thud_firmware::event::{Event, Onset};
use thud_firmware::sensor::Sensor;
use thud_firmware::units::{Hertz, Volt};

use super::{Prepared, ReplayError, prepare};
use crate::recording::Recording;

/// One finished impact.
#[derive(Clone, Debug)]
pub struct Sensed {
    /// What the detector knew of it.
    pub context: ImpactContext,
    /// Its contacts, judged.
    pub events: Vec<Event>,
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
    configuration.chain.sample_rate = Hertz(prepared.rate_hz as f32);
    configuration
        .validate()
        .map_err(|invalid| ReplayError::Configuration(crate::settings::explain_invalid(invalid)))?;

    let chain = configuration.chain;
    let healthy = Volt(f32::midpoint(chain.bias_low.0, chain.bias_high.0));
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
    let mut next = 0;
    for stretch in &prepared.stretches {
        if stretch.first > next {
            let lost = u32::try_from(stretch.first - next).unwrap_or(u32::MAX);
            let signals = feed.sensor.overrun(Overrun { lost });
            feed.take(signals, next);
        }
        next = stretch.first;
        for values in stretch.values.chunks(BLOCK) {
            let mut codes = [0; BLOCK];
            for (code, value) in codes.iter_mut().zip(values) {
                *code = code_of(*value, &chain);
            }
            let signals = feed.sensor.push(&codes[..values.len()], &BlockInfo { first_index: next, bias: healthy });
            feed.take(signals, next);
            next += values.len() as u64;
        }
    }
    Ok(feed.replayed)
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
                    let events = self.sensor.evaluate(&context).into_iter().collect();
                    self.replayed.impacts.push(Sensed { context, events });
                }
                Signal::FaultRaised(fault) => self.replayed.faults.push((at, fault)),
                // Losses are the recording's own and counted there.
                Signal::FaultCleared(_) | Signal::Lost(_) => {}
            }
        }
    }
}

/// What the ADC makes of a force: rounded to a code, and no further than its ends.
fn code_of(force_n: f64, chain: &Chain) -> AdcCode {
    let code = f64::from(chain.zero_code) + force_n / f64::from(chain.newton_per_code);
    code.round().clamp(0.0, f64::from(AdcCode::MAX)) as AdcCode
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_beyond_full_scale_saturates() {
        let chain = Chain::REFERENCE;
        assert_eq!(code_of(0.0, &chain), chain.zero_code);
        assert_eq!(code_of(1e9, &chain), AdcCode::MAX);
        assert_eq!(code_of(-1e9, &chain), 0);
        let code = code_of(100.0, &chain);
        assert!(
            (f32::from(code - chain.zero_code) * chain.newton_per_code - 100.0).abs() <= chain.newton_per_code / 2.0
        );
    }
}

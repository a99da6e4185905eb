//! Blocks of samples into the detector; never waits for anything else.

use crate::board::{AdcCode, BLOCK, Samples};
use crate::detector::{Detector, Signal, Signals};
use crate::emergency::Fault;
use crate::forecast::{TABLE, Watch};
use crate::shared::{DetectorStatus, Report, Shared, Task};
use crate::stream::{Scale, Stream};

/// Zero and hum are worked out for the diagnostics once in so many blocks, 50 ms at 20 kS/s.
const STATUS_BLOCKS: u32 = 125;

/// Runs for ever.
pub async fn run<const N: usize>(mut samples: impl Samples, shared: &Shared<N>) -> ! {
    let mut detector = Detector::<N>::new(shared.active());
    let mut block = [0; BLOCK];
    let mut status = DetectorStatus::default();
    let mut stream = Stream::new();
    let mut rising: Option<Watch> = None;
    let mut blocks = 0;
    loop {
        let next = samples.next_block(&mut block).await;
        // What came meanwhile holds for this block: the detector waits for the end of an impact by itself.
        if let Some(configuration) = shared.configure.try_take() {
            detector.configure(configuration);
        }
        if let Some(mass) = shared.mass.try_take() {
            detector.receive_effective_mass(mass);
        }
        let mut signals = Signals::new();
        match next {
            Ok(info) => {
                status.next_index = info.first_index + BLOCK as u64;
                detector.push_into(&block, &info, shared.captures, &mut signals);
                if let Some(watch) = &mut rising {
                    foretell(watch, &block, info.first_index, &detector, shared);
                }
                // Nobody listens most of the time.
                let decimation = shared.decimation();
                if decimation > 0 {
                    let scale = Scale {
                        zero: status.zero,
                        newton_per_code: shared.active().configuration.chain.newton_per_code,
                    };
                    stream.push(&block, info.first_index, decimation, scale, |data| shared.send_samples(data));
                }
            }
            Err(overrun) => {
                shared.count(|counters| counters.overruns = counters.overruns.saturating_add(1));
                signals = detector.overrun(overrun);
                rising = None;
            }
        }
        for signal in &signals {
            match signal {
                Signal::Onset(onset) => {
                    let chain = shared.active().configuration.chain;
                    rising = Some(Watch::new(onset, chain.sample_rate, chain.newton_per_code, status.zero));
                }
                Signal::Over(_) => rising = None,
                _ => {}
            }
            handle(*signal, shared);
        }
        let was_open = core::mem::replace(&mut status.impact_open, detector.impact_open());
        if blocks % STATUS_BLOCKS == 0 {
            let chain = shared.active().configuration.chain;
            let baseline = detector.baseline();
            status.zero = f32::from(chain.zero_code) + baseline.zero / chain.newton_per_code;
            status.hum.0 = baseline.tones.iter().map(|tone| libm::hypotf(tone.in_phase, tone.quadrature)).sum();
            status.noise = detector.noise();
            status.threshold = detector.threshold();
            status.settled = detector.settled();
        }
        shared.detector.lock(|cell| cell.set(status));
        if was_open && (!status.impact_open || blocks % STATUS_BLOCKS == 0) {
            shared.impact_over.wake();
        }
        blocks = (blocks + 1) % STATUS_BLOCKS;
        shared.lives(Task::Sampler);
    }
}

/// The forecast, in the one block that completes the rise: some hundred comparisons.
#[inline(never)]
fn foretell<const N: usize>(
    watch: &mut Watch,
    block: &[AdcCode],
    first_index: u64,
    detector: &Detector<N>,
    shared: &Shared<N>,
) {
    let Some(rise) = watch.push(block, first_index) else { return };
    let Some(forecast) = detector.known().and_then(|known| TABLE.forecast(&rise, &known)) else { return };
    let samples = (first_index + block.len() as u64 - 1).saturating_sub(watch.noticed_at()) as u16;
    shared.tell_forecast(watch.impact(), &forecast, samples);
}

fn handle<const N: usize>(signal: Signal, shared: &Shared<N>) {
    match signal {
        Signal::Onset(onset) => shared.raise_alarm(&onset),
        Signal::Over(context) => {
            let impact = context.impact;
            if shared.finished.try_send(context).is_err() {
                shared.count(|counters| counters.not_evaluated = counters.not_evaluated.saturating_add(1));
                shared.report(Report::Raised(Fault::NotEvaluated, impact));
            }
        }
        Signal::FaultRaised(fault) => shared.report(Report::Raised(fault.into(), 0)),
        Signal::FaultCleared(fault) => shared.report(Report::Cleared(fault.into())),
        Signal::Lost(lost) => {
            shared.count(|counters| counters.lost_samples = counters.lost_samples.saturating_add(lost));
            shared.report(Report::Raised(Fault::SamplesLost, lost));
        }
    }
}

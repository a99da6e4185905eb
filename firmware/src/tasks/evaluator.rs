//! Finished impacts into events and recordings.

use embassy_time::with_timeout;

use super::PULSE;
use crate::capture::Curve;
use crate::detector::ImpactContext;
use crate::impact;
use crate::shared::{Recording, Shared, Task};

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Runs for ever.
pub async fn run<const N: usize>(shared: &Shared<N>) -> ! {
    loop {
        let finished = with_timeout(PULSE, shared.finished.receive()).await;
        shared.lives(Task::Evaluator);
        let Ok(context) = finished else { continue };
        let curve = shared.captures.curve(context.slot);
        let first_number = shared.log.lock(|log| log.borrow().next_number());
        let events = impact::evaluate(&curve, &context, first_number);
        // The recording is there before the event that makes a host ask for it.
        if let Some(recording) = recording(&curve, &context) {
            shared.set_recording(context.slot, recording);
        }
        shared.captures.mark_evaluated(context.slot);
        for event in events {
            shared.log.lock(|log| log.borrow_mut().push(event));
        }
        shared.node_wake.signal(());
    }
}

/// What is to be known about the curve; `None` if it was overwritten meanwhile.
fn recording(curve: &impl Curve, context: &ImpactContext) -> Option<Recording> {
    let mut digest = CRC.digest();
    let mut codes = [0; 64];
    let mut offset = 0;
    while offset < curve.len() {
        let count = curve.read(offset, &mut codes);
        if count == 0 {
            return None;
        }
        for code in &codes[..count] {
            digest.update(&code.to_le_bytes());
        }
        offset += count;
    }
    let chain = &context.configuration.configuration.chain;
    (offset > 0).then(|| Recording {
        impact: context.impact,
        first_index: curve.first_index(),
        length: offset as u32,
        crc: digest.finalize(),
        sample_rate: chain.sample_rate,
        newton_per_code: chain.newton_per_code,
        zero: f32::from(chain.zero_code) + context.baseline.zero / chain.newton_per_code,
        onset_index: context.onset.noticed_at,
        revision: context.configuration.revision,
        hash: context.configuration.hash,
    })
}

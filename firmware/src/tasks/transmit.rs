//! The outbox into the controller's mailboxes.

use embassy_futures::select::select;
use embassy_time::with_timeout;

use super::PULSE;
use crate::board::CanTransmit;
use crate::shared::{Shared, Task};

/// Runs for ever.
pub async fn run<const N: usize>(mut can: impl CanTransmit, shared: &Shared<N>) -> ! {
    loop {
        if shared.with_outbox(|outbox| outbox.load(&mut can)) > 0 {
            // There is room again for what the node holds back: events and segments.
            shared.node_wake.signal(());
        }
        let _ = with_timeout(PULSE, select(shared.outbox_filled.wait(), can.freed())).await;
        shared.lives(Task::Transmit);
    }
}

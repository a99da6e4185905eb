//! Frames, time and the sensor's news into the CANopen node.

use embassy_futures::select::{Either3, select3};
use embassy_time::{Instant, Timer};

use super::PULSE;
use crate::board::{CanReceive, Received};
use crate::emergency::Fault;
use crate::node::CanOpenNode;
use crate::shared::{Report, Shared, Task};

/// Runs for ever.
pub async fn run<const N: usize>(mut can: impl CanReceive, shared: &'static Shared<N>) -> ! {
    let mut node = CanOpenNode::new(shared);
    let mut heard = None;
    loop {
        // Before the boot-up message of a new node id has crossed the bus, so that no answer to it is missed.
        let wanted = node.listens_to();
        if heard.replace(wanted) != Some(wanted) {
            can.listen_to(&wanted);
        }
        let now = Instant::now();
        node.poll(now.as_millis());
        let due = Instant::from_millis(node.due_ms(now.as_millis())).min(now + PULSE);
        let woken = select3(can.receive(), shared.node_wake.wait(), Timer::at(due)).await;
        shared.lives(Task::Node);
        match woken {
            Either3::First(Received::Frame(frame)) => node.receive(&frame, Instant::now().as_millis()),
            Either3::First(Received::Lost(lost)) => {
                shared.count(|counters| counters.not_received = counters.not_received.saturating_add(lost));
                shared.report(Report::Raised(Fault::ReceiveOverrun, lost));
            }
            Either3::Second(()) | Either3::Third(()) => {}
        }
    }
}

//! Everything that waits: thin shells around the state machines, generic over the board.
//!
//! | task | waits for | does | may be delayed by |
//! |---|---|---|---|
//! | [`sampler`] | the next block of samples | detector, alarm into the outbox | nothing: own interrupt priority |
//! | [`transmit`] | a frame, a free mailbox | outbox into mailboxes | nothing: the sampler's priority |
//! | [`node`] | a frame, an event, time | CANopen | evaluation |
//! | [`evaluator`] | a finished impact | measures and judges it, 0.1 s, at most 0.6 s | – |
//! | [`storage`] | an applied configuration | flash, each word and page never while an impact is open | evaluation |
//! | [`supervisor`] | time | watchdog, bus-off | evaluation |
//!
//! On the board the first two run on an interrupt executor and the others in thread mode; in a simulation [`run`] joins
//! them all. Every wait ends after [`PULSE`] at the latest, so that the supervisor sees each task live.
//!
//! Cancelling: `CanReceive::receive`, `CanTransmit::freed` and the waits of `embassy-sync` are dropped when something else
//! happens first, so they must not have taken anything by then. The futures of flash are never dropped.

use embassy_futures::join::{join, join5};
use embassy_time::Duration;

use crate::board::{AskedFlash, CanReceive, CanSupervise, CanTransmit, Samples, Watchdog};
use crate::shared::Shared;
use crate::storage::Store;

pub mod evaluator;
pub mod node;
pub mod sampler;
pub mod storage;
pub mod supervisor;
pub mod transmit;

/// Longest silence of a task that lives; the watchdog must not bite before twice this and a flash erase (22 ms).
pub const PULSE: Duration = Duration::from_millis(50);

/// The board's parts as the tasks want them.
#[expect(missing_docs, reason = "each is named after its trait")]
pub struct Board<S, R, T, C, W, F: AskedFlash> {
    pub samples: S,
    pub receive: R,
    pub transmit: T,
    pub supervise: C,
    pub watchdog: W,
    pub store: Store<F>,
}

/// All tasks of one sensor on one executor, as a simulation runs them.
pub async fn run<S, R, T, C, W, F, const N: usize>(board: Board<S, R, T, C, W, F>, shared: &'static Shared<N>) -> !
where
    S: Samples,
    R: CanReceive,
    T: CanTransmit,
    C: CanSupervise,
    W: Watchdog,
    F: AskedFlash,
{
    let ((never, ..), _) = join(
        join5(
            sampler::run(board.samples, shared),
            transmit::run(board.transmit, shared),
            node::run(board.receive, shared),
            evaluator::run(shared),
            storage::run(board.store, shared),
        ),
        supervisor::run(board.supervise, board.watchdog, shared),
    )
    .await;
    never
}

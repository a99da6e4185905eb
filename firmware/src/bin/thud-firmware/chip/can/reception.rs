//! The receiving half.
//!
//! ```text
//! filters ─▶ FIFO of 3 frames ──interrupt──▶ `reception`, urgent ──▶ queue of 64 ──▶ `Mailbox`, read by the node when it has time
//! ```
//!
//! A filter for each service that the node listens to: others' frames, however many, take neither time nor room here.
//!
//! The controller holds three frames, as little as 141 µs of a busy bus, while the node may be kept waiting by an evaluation
//! for tenths of a second. What does not fit here or there is counted and told.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::can::CanRx;
use embassy_stm32::can::frame::Envelope;
use embassy_stm32::pac::{FDCAN1, FDCANRAM1};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{TimeoutError, Timer, with_timeout};
use embedded_can::Id;
use thud_firmware::board::{CanReceive, Frame, Listened, Received};
use thud_firmware::shared::{Shared, Task};
use thud_firmware::tasks::PULSE;

/// What reads the controller.
pub type Driver = CanRx<'static>;

/// Frames between the controller and the node.
const DEPTH: usize = 64;
/// Static because a task of one executor fills it and one of the other empties it.
static FRAMES: Channel<CriticalSectionRawMutex, Frame, DEPTH> = Channel::new();
/// Frames that found no room since this was last told.
static LOST: AtomicU32 = AtomicU32::new(0);

/// Empties the controller, for ever.
pub async fn reception<const N: usize>(mut driver: Driver, shared: &Shared<N>) -> ! {
    shared.watch(Task::Reception);
    loop {
        let read = with_timeout(PULSE, driver.read()).await;
        shared.lives(Task::Reception);
        match read {
            Ok(Ok(envelope)) => {
                if let Some(frame) = frame(&envelope)
                    && FRAMES.try_send(frame).is_err()
                {
                    LOST.fetch_add(1, Ordering::Relaxed);
                }
            }
            // The driver tells every error on the wire here, and a wire that is shorted has no end of them; the error
            // counters say it better. The pause keeps them from taking all the time that there is.
            Ok(Err(_)) => Timer::after_micros(20).await,
            // Nobody has sent anything.
            Err(TimeoutError) => {}
        }
        // The driver leaves this interrupt off, and it is not needed: a frame is lost only while three others wait here.
        if FDCAN1.ir().read().rfl(0) {
            FDCAN1.ir().write(|clear| clear.set_rfl(0, true));
            LOST.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn frame(envelope: &Envelope) -> Option<Frame> {
    // The filters let nothing else in.
    let Id::Standard(id) = envelope.frame.id() else { return None };
    Frame::new(id.as_raw(), envelope.frame.data())
}

/// The frames that have come.
pub struct Mailbox;

/// A filter element that hears one identifier and puts its frames into FIFO 0, or none. RM0440, 44.3.11: type 1, two
/// identifiers (twice the same), bits 31 and 30; type 3 is off.
const fn filter(identifier: Option<u16>) -> u32 {
    match identifier {
        Some(id) => 1 << 30 | 1 << 27 | (id as u32) << 16 | id as u32,
        None => 3 << 30,
    }
}

impl CanReceive for Mailbox {
    /// An element is one word, so that the controller sees the old filter or the new one, and the others hear on.
    fn listen_to(&mut self, identifiers: &Listened) {
        for (element, identifier) in identifiers.iter().enumerate() {
            FDCANRAM1.flssa(element).write_value(filter(*identifier));
        }
    }

    async fn receive(&mut self) -> Received {
        match LOST.swap(0, Ordering::Relaxed) {
            0 => Received::Frame(FRAMES.receive().await),
            lost => Received::Lost(lost),
        }
    }
}

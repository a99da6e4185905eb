//! The sending half.

use embassy_stm32::can::CanTx;
use embassy_stm32::interrupt::typelevel::Handler;
use embassy_stm32::pac::{FDCAN1, FDCANRAM1};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use thud_firmware::board::{CanTransmit, Frame, MailboxesFull};

use super::TransmitInterrupt;
use crate::transmit_buffers::{BUFFERS, TransmitBuffers};

/// Words of a transmit buffer in the message RAM: two of header, sixteen of data.
const BUFFER_WORDS: usize = 18;

/// A buffer has been sent since somebody last looked. Static because an interrupt sets it.
static FREED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Notices that a buffer has been sent.
pub struct Freed;

#[expect(unsafe_code, reason = "an interrupt handler of embassy-stm32")]
impl Handler<TransmitInterrupt> for Freed {
    unsafe fn on_interrupt() {
        if FDCAN1.ir().read().tc() {
            FREED.signal(());
        }
    }
}

/// The three transmit buffers.
pub struct Transmission {
    buffers: TransmitBuffers,
    /// Dropping it would switch the controller off.
    _driver: CanTx<'static>,
}

impl Transmission {
    pub(super) fn new(driver: CanTx<'static>) -> Self {
        Self { buffers: TransmitBuffers::default(), _driver: driver }
    }
}

fn pending() -> u32 {
    FDCAN1.txbrp().read().0
}

impl CanTransmit for Transmission {
    fn free(&mut self) -> usize {
        BUFFERS - (pending() & ((1 << BUFFERS) - 1)).count_ones() as usize
    }

    fn load(&mut self, frame: &Frame) -> Result<(), MailboxesFull> {
        let buffer = self.buffers.place(frame, pending()).ok_or(MailboxesFull)?;
        let (low, high) = frame.data.split_at(4);
        let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
        // RM0440, 44.3.6: T0 with the 11-bit identifier in bits 28 to 18, T1 with the length in bits 19 to 16.
        let words = [u32::from(frame.id) << 18, u32::from(frame.len) << 16, word(low), word(high)];
        for (place, word) in (buffer * BUFFER_WORDS..).zip(words) {
            FDCANRAM1.txbuf(place).write_value(word);
        }
        FDCAN1.txbar().write(|request| request.set_ar(buffer, true));
        Ok(())
    }

    async fn freed(&mut self) {
        FREED.wait().await;
    }
}

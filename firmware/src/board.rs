//! How the sensor perceives and inhabits its board.
//!
//! A handful of traits in the sensor's own words. The STM32G474 binary, the simulated board and the tests'
//! toys implement them; the logic sees nothing else. No chip type appears in a signature, and nothing here
//! waits for wall time: time is `embassy-time`, whose driver the board (or the simulation) brings.
//!
//! Flash is [`NorFlash`], because every storage crate speaks it, and [`AskedFlash`], because an impact does not wait for it.

use core::future::Future;

use embedded_storage_async::nor_flash::NorFlash;
use serde::{Deserialize, Serialize};

use crate::units::Volt;

/// A raw sample as the ADC delivers it: 16 bits, the middle of the scale is no force.
pub type AdcCode = u16;

/// Samples in one block, the half of the DMA ring that is handed over at once.
///
/// 8 samples are 0.4 ms at 20 kS/s: with one CAN frame of 0.13 ms at 1 Mbit/s and a confirmation of three
/// samples, the alarm is on the bus well within 1 ms of the force passing the threshold.
pub const BLOCK: usize = 8;

/// What comes with a block of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockInfo {
    /// Number of the block's first sample since power-up. A gap to the previous block is lost samples.
    pub first_index: u64,
    /// Bias voltage of the IEPE supply during the block; a broken cable or a short shows here.
    pub bias: Volt,
}

/// The ring was overwritten before it was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overrun {
    /// How many samples are gone.
    pub lost: u32,
}

/// The stream of samples.
pub trait Samples {
    /// Waits for the next block.
    ///
    /// # Errors
    /// [`Overrun`] when samples were lost; the next call goes on with the first block after the gap.
    fn next_block(&mut self, block: &mut [AdcCode; BLOCK]) -> impl Future<Output = Result<BlockInfo, Overrun>>;
}

/// A classic CAN data frame with an 11-bit identifier. CANopen uses no other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Frame {
    /// Identifier, 0 to 0x7FF. The smaller, the more urgent.
    pub id: u16,
    /// Number of data bytes, 0 to 8.
    pub len: u8,
    /// Data; bytes from `len` on are zero.
    pub data: [u8; 8],
}

impl Frame {
    /// A frame with these data bytes; `None` if the identifier or the length is impossible.
    #[must_use]
    pub fn new(id: u16, bytes: &[u8]) -> Option<Self> {
        if id > 0x7FF || bytes.len() > 8 {
            return None;
        }
        let mut data = [0; 8];
        data[..bytes.len()].copy_from_slice(bytes);
        Some(Self { id, len: bytes.len() as u8, data })
    }

    /// The data bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.data[..usize::from(self.len.min(8))]
    }
}

/// All mailboxes of the controller hold frames that still wait for the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MailboxesFull;

/// The sending half of the CAN controller: a few mailboxes, of which the most urgent frame goes first.
///
/// The queue in front of them (`outbox::Outbox`) is ours; a mailbox is kept free for the alarm, so that
/// it never waits behind a frame of lower priority.
pub trait CanTransmit {
    /// Mailboxes that are free now.
    fn free(&mut self) -> usize;

    /// Puts a frame into a free mailbox.
    ///
    /// # Errors
    /// [`MailboxesFull`] when there is none; nothing is evicted.
    fn load(&mut self, frame: &Frame) -> Result<(), MailboxesFull>;

    /// Waits until at least one mailbox has been emptied since the last call.
    fn freed(&mut self) -> impl Future<Output = ()>;
}

/// What the receiving half of the controller hands over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// A frame.
    Frame(Frame),
    /// The receive buffer was full and this many frames are gone.
    Lost(u32),
}

/// The identifiers of the services that a node listens to. Each service keeps its place, `None` while it has no identifier, so
/// that a controller with a filter for each changes one and the others hear on.
pub type Listened = [Option<u16>; 5];

/// The receiving half of the CAN controller.
pub trait CanReceive {
    /// Says which frames are wanted from now on. A controller without filters hears everything, which the node can bear: it
    /// looks at no others.
    fn listen_to(&mut self, _identifiers: &Listened) {}

    /// Waits for the next frame, or for the news that some were lost.
    fn receive(&mut self) -> impl Future<Output = Received>;
}

/// Error state of a CAN controller, ISO 11898-1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BusState {
    /// Takes full part in the traffic.
    #[default]
    ErrorActive,
    /// 128 or more errors on a counter: may no longer destroy other nodes' frames.
    ErrorPassive,
    /// More than 255 transmit errors: silent until [`CanSupervise::recover`].
    BusOff,
}

/// What the controller says about the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusStatus {
    /// Error state.
    pub state: BusState,
    /// Transmit error counter.
    pub transmit_errors: u16,
    /// Receive error counter.
    pub receive_errors: u16,
}

/// Watching over the CAN controller; bus-off does not end by itself.
pub trait CanSupervise {
    /// Error state and counters now.
    fn status(&mut self) -> BusStatus;
    /// Starts recovery from bus-off: 128 times 11 recessive bits later the controller takes part again.
    fn recover(&mut self);
}

/// Flash that asks at the very instant of beginning an operation whether it may.
///
/// ```text
/// ask ─ begin ─ busy …                   with nothing between the two
/// ask ─ interrupt: an impact opens, its alarm goes out ─ begin ─ busy …      what it must not come to
/// ```
///
/// The methods given here are right where nobody can come between two lines of a task, as in a simulation. A board with interrupts keeps
/// them out from before `may` is asked until the operation is under way, and no longer: it lasts up to 22 ms.
pub trait AskedFlash: NorFlash {
    /// Programs one word ([`NorFlash::WRITE_SIZE`] bytes) if it may begin; whether it did.
    ///
    /// # Errors
    /// What [`NorFlash::write`] says.
    fn write_if(
        &mut self,
        offset: u32,
        word: &[u8],
        may: impl Fn() -> bool,
    ) -> impl Future<Output = Result<bool, Self::Error>> {
        async move { if may() { self.write(offset, word).await.map(|()| true) } else { Ok(false) } }
    }

    /// Erases the page ([`NorFlash::ERASE_SIZE`] bytes) that begins at an offset if it may begin; whether it did.
    ///
    /// # Errors
    /// What [`NorFlash::erase`] says.
    fn erase_if(&mut self, page: u32, may: impl Fn() -> bool) -> impl Future<Output = Result<bool, Self::Error>> {
        async move { if may() { self.erase(page, page + Self::ERASE_SIZE as u32).await.map(|()| true) } else { Ok(false) } }
    }
}

/// The independent watchdog.
pub trait Watchdog {
    /// Says that the sensor lives. Only the supervisor calls this, and only when every task has lived.
    fn pet(&mut self);
}

/// Why the board started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
#[repr(u8)]
pub enum ResetCause {
    /// Power came.
    #[default]
    PowerOn = 0,
    /// The reset pin.
    Pin = 1,
    /// The watchdog bit.
    Watchdog = 2,
    /// The software asked for it, over NMT for instance.
    Software = 3,
    /// Power sagged.
    BrownOut = 4,
    /// The logic panicked.
    Panic = 5,
}

/// What a board knows about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Unique serial number; CANopen object 0x1018:4.
    pub serial: u32,
    /// Hardware revision.
    pub hardware_revision: u32,
    /// First eight bytes of the program's build id, most significant first, which its ELF file has too; 0 for none.
    pub build: u64,
    /// Why it started this time.
    pub reset_cause: ResetCause,
    /// Address in the program where a panic or fault ended it before; 0 for none or unknown.
    pub ended_at: u32,
}

//! What lives for ever, and where. `memory.x` asserts that it does.

use core::mem::MaybeUninit;

use static_cell::StaticCell;
use thud_firmware::board::{AdcCode, BLOCK};
use thud_firmware::capture::{CAPTURE, Captures};
use thud_firmware::node::NodeMemory;
use thud_firmware::shared::Shared;

use crate::panic_record::PanicRecord;

/// The force curves: static because they are more than half of all memory, and because sampler, evaluator and node share them.
#[expect(unsafe_code, reason = "a section of its own, whose size memory.x asserts; zero at reset like any other .bss")]
#[unsafe(link_section = ".bss.capture")]
pub static CAPTURES: Captures<CAPTURE> = Captures::new();

/// What the tasks share: static because the CANopen stack wants it for ever.
pub static SHARED: StaticCell<Shared<CAPTURE>> = StaticCell::new();
/// Memory of the CANopen stack.
pub static NODE: NodeMemory = NodeMemory::new();
/// The ring that the DMA fills: two halves of one block.
pub static RING: StaticCell<[AdcCode; 2 * BLOCK]> = StaticCell::new();

#[expect(unsafe_code, reason = "a section that nothing initialises, so that it survives a reset")]
#[unsafe(link_section = ".panic_record")]
static mut KEPT: MaybeUninit<PanicRecord> = MaybeUninit::uninit();

/// The memory that survives a reset. Called from `main` before anything else runs, and by whatever ends all else.
#[expect(unsafe_code, reason = "any bytes are a record; the callers are never two at a time, see above")]
pub fn kept() -> &'static mut PanicRecord {
    unsafe { &mut *(&raw mut KEPT).cast::<PanicRecord>() }
}

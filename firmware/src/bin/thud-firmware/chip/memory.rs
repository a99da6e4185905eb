//! What lives for ever, and where. `memory.x` asserts that it does.

use core::mem::MaybeUninit;

use static_cell::StaticCell;
use thud_firmware::board::{AdcCode, BLOCK};
use thud_firmware::capture::{CAPTURE, Captures};
use thud_firmware::shared::Shared;

use crate::call_chain::CallChain;
use crate::panic_record::PanicRecord;

/// The force curves: static because they are more than half of all memory, and because sampler, evaluator and node share them.
#[expect(unsafe_code, reason = "a section of its own, whose size memory.x asserts; zero at reset like any other .bss")]
#[unsafe(link_section = ".bss.capture")]
pub static CAPTURES: Captures<CAPTURE> = Captures::new();

/// What the tasks share: static because every task borrows it for ever.
pub static SHARED: StaticCell<Shared<CAPTURE>> = StaticCell::new();
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

/// First eight bytes of the build id, as `cargo xtask size` and `readelf -n` show it: the linker's hash of the whole program.
#[expect(unsafe_code, reason = "a note that the linker has written into flash")]
pub fn build() -> u64 {
    unsafe extern "C" {
        // Three words of lengths and type, "GNU\0", then the hash: memory.x.
        static _build_note: [u8; 24];
    }
    let [.., a, b, c, d, e, f, g, h] = unsafe { *(&raw const _build_note) };
    u64::from_be_bytes([a, b, c, d, e, f, g, h])
}

/// The addresses to which the calls in progress would return, the innermost first, without the machinery of panics; see
/// [`crate::call_chain`].
#[expect(unsafe_code, reason = "the stack as the linker placed it is readable memory; a register is only read")]
#[inline(always)]
pub fn call_chain() -> CallChain<impl Fn(u32) -> u32> {
    unsafe extern "C" {
        static _stack_start: u32;
        static _stack_end: u32;
        static __stext: u32;
        static __etext: u32;
    }
    let address = |symbol: *const u32| symbol as u32;
    let frame: u32;
    unsafe { core::arch::asm!("mov {}, r7", out(reg) frame, options(nomem, nostack, preserves_flags)) };
    CallChain {
        frame,
        stack: address(&raw const _stack_end)..address(&raw const _stack_start),
        program: address(&raw const __stext)..address(&raw const __etext),
        word: |at| unsafe { (at as *const u32).read_volatile() },
    }
}

//! What ends everything: panics and faults leave a record and reset; a torn word of flash does not end anything.

use core::panic::PanicInfo;

use cortex_m::peripheral::{DCB, SCB};
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac::FLASH;

use super::memory;
use crate::panic_record::End;

/// What the panic says is not looked at: see [`crate::panic_record`].
#[panic_handler]
fn panicked(_: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    end(End::Panic, 0, None)
}

/// Also an overflow of the stack, if the processor can still get here; if not, it locks up and the watchdog bites.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    end(End::HardFault, status, Some(frame))
}

/// An interrupt that nobody expects.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    end(End::Interrupt, number as u32, None)
}

/// Flash that lost its power while a word was written cannot be corrected, and the G4 says so by an NMI when it is read
/// (RM0440, 3.3.3). Whoever reads gets some bytes, which the store's checksums refuse; so it goes on. Without this a
/// power cut at the wrong moment would be a board that never starts again.
#[exception]
unsafe fn NonMaskableInt() {
    let status = FLASH.eccr().read();
    if !status.eccd() && !status.eccd2() {
        end(End::NonMaskable, 0, None);
    }
    // Both are cleared by writing ones.
    FLASH.eccr().write_value(status);
}

/// Keeps where it happened and who had called, and resets. The first address is where: of a fault the instruction, of a panic the
/// call into its machinery, which `memory.x` keeps apart.
fn end(end: End, detail: u32, frame: Option<&ExceptionFrame>) -> ! {
    let here = frame.map(|frame| [frame.pc(), frame.lr()]);
    memory::kept().keep(end, detail, here.into_iter().flatten().chain(memory::call_chain()));
    // Not logged here, where it may be the log that has failed, but after the reset.
    if DCB::is_debugger_attached() {
        cortex_m::asm::bkpt();
    }
    SCB::sys_reset()
}

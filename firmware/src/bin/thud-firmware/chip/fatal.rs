//! What ends everything: panics and faults leave a record and reset; a torn word of flash does not end anything.

use core::fmt;
use core::panic::PanicInfo;

use cortex_m::peripheral::{DCB, SCB};
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac::FLASH;

use super::memory;

#[panic_handler]
fn panicked(information: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    match information.location() {
        Some(at) => end(format_args!("{}:{}: {}", at.file(), at.line(), information.message())),
        None => end(format_args!("{}", information.message())),
    }
}

/// Also an overflow of the stack, if the processor can still get here; if not, it locks up and the watchdog bites.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    end(format_args!("hard fault at 0x{:08X}, called from 0x{:08X}, CFSR 0x{status:08X}", frame.pc(), frame.lr()))
}

/// An interrupt that nobody expects.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    end(format_args!("interrupt {number} has no handler"))
}

/// Flash that lost its power while a word was written cannot be corrected, and the G4 says so by an NMI when it is read
/// (RM0440, 3.3.3). Whoever reads gets some bytes, which the store's checksums refuse; so it goes on. Without this a
/// power cut at the wrong moment would be a board that never starts again.
#[exception]
unsafe fn NonMaskableInt() {
    let status = FLASH.eccr().read();
    if !status.eccd() && !status.eccd2() {
        end(format_args!("NMI, but not from flash"));
    }
    // Both are cleared by writing ones.
    FLASH.eccr().write_value(status);
}

fn end(words: fmt::Arguments<'_>) -> ! {
    memory::kept().keep(words);
    defmt::error!("{}", defmt::Display2Format(&words));
    if DCB::is_debugger_attached() {
        cortex_m::asm::bkpt();
    }
    SCB::sys_reset()
}

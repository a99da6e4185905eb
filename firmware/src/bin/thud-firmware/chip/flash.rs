//! The storage: a few pages of the second flash bank.
//!
//! ```text
//! unlock ─▶ PG,  two words of 32 bits ┐ interrupts kept out: whether it may, and that it has begun, are one
//!        ─▶ PER, page, STRT           ┘      ─▶ busy, 22 ms for an erase, 0.1 ms for a word ─▶ errors ─▶ lock
//! ```
//!
//! Operations block the thread executor. That is meant: sampling, alarm and reception run above it from the first bank, which the
//! second does not stall, and no impact is open when one is begun. The drivers of `embassy-stm32` 0.6.0 will not do: neither can be
//! asked to look once more as it begins, and the asynchronous one clears the error flags in its interrupt before it looks at them,
//! so that it never reports a failure.

use core::ops::Range;

use embassy_stm32::flash::{Blocking, Flash, MAX_ERASE_SIZE, WRITE_SIZE};
use embassy_stm32::pac::FLASH;
use embassy_stm32::pac::flash::regs::Sr;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use thud_firmware::board::AskedFlash;

/// Where the first bank appears to the processor.
const FIRST_BANK: u32 = 0x0800_0000;
/// Where the second begins, as an offset: half of 512 KiB.
const SECOND_BANK: u32 = 0x4_0000;
/// Bytes of a page (RM0440, 3.3.1, two banks).
const PAGE: u32 = MAX_ERASE_SIZE as u32;
/// FLASH_SR: PROGERR, WRPERR, PGAERR, SIZERR and PGSERR (RM0440, 3.7.5); cleared by ones.
const ERRORS: u32 = 0b1111_1000;

/// The flash, confined to the storage's range.
pub struct BankTwo {
    flash: Flash<'static, Blocking>,
    range: Range<u32>,
}

/// What went wrong.
#[derive(Clone, Copy, Debug)]
pub enum FlashError {
    /// Not within the storage, or not a whole word or page.
    OutOfBounds,
    /// Said by the flash: the word was not erased, the page is protected, or the order of registers was wrong.
    Flash,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::Flash => NorFlashErrorKind::Other,
        }
    }
}

impl BankTwo {
    /// The storage as `memory.x` places it.
    #[expect(unsafe_code, reason = "the linker's symbols are addresses of nothing; only the address is taken")]
    pub fn new(flash: Flash<'static, Blocking>) -> Self {
        unsafe extern "C" {
            static _storage_start: u8;
            static _storage_end: u8;
        }
        let offset = |symbol: *const u8| symbol as u32;
        Self { flash, range: offset(&raw const _storage_start)..offset(&raw const _storage_end) }
    }

    /// Offsets of the whole storage, from 0.
    pub fn whole(&self) -> Range<u32> {
        0..self.range.end - self.range.start
    }

    /// The place in the flash of an offset in the storage.
    fn place(&self, offset: u32, length: usize) -> Result<u32, FlashError> {
        let length = u32::try_from(length).map_err(|_| FlashError::OutOfBounds)?;
        match offset.checked_add(length) {
            Some(end) if end <= self.whole().end => Ok(self.range.start + offset),
            _ => Err(FlashError::OutOfBounds),
        }
    }
}

/// Begins an operation if it may, waits until it has ended, and says whether it was begun.
fn operate(may: impl Fn() -> bool, begin: impl FnOnce()) -> Result<bool, FlashError> {
    if FLASH.cr().read().lock() {
        FLASH.keyr().write_value(0x4567_0123);
        FLASH.keyr().write_value(0xCDEF_89AB);
    }
    FLASH.sr().write_value(Sr(ERRORS));
    // ES0430: what the data cache holds may be wrong when one bank is read while the other is written.
    FLASH.acr().modify(|access| access.set_dcen(false));
    let begun = critical_section::with(|_| {
        let may = may();
        if may {
            begin();
        }
        may
    });
    let status = loop {
        let status = FLASH.sr().read();
        if !status.bsy() {
            break status;
        }
    };
    // Neither programming nor erasing any more.
    FLASH.cr().write(|control| control.set_lock(true));
    FLASH.acr().modify(|access| access.set_dcrst(true));
    FLASH.acr().modify(|access| access.set_dcrst(false));
    FLASH.acr().modify(|access| access.set_dcen(true));
    if status.0 & ERRORS == 0 { Ok(begun) } else { Err(FlashError::Flash) }
}

impl ErrorType for BankTwo {
    type Error = FlashError;
}

impl ReadNorFlash for BankTwo {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let place = self.place(offset, bytes.len())?;
        // It checks bounds again, and knows no other error.
        self.flash.blocking_read(place, bytes).map_err(|_| FlashError::OutOfBounds)
    }

    fn capacity(&self) -> usize {
        self.whole().end as usize
    }
}

impl NorFlash for BankTwo {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = MAX_ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        for page in (from..to).step_by(Self::ERASE_SIZE) {
            self.erase_if(page, || true).await?;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        for (place, word) in (offset..).step_by(Self::WRITE_SIZE).zip(bytes.chunks(Self::WRITE_SIZE)) {
            self.write_if(place, word, || true).await?;
        }
        Ok(())
    }
}

impl AskedFlash for BankTwo {
    #[expect(unsafe_code, reason = "a store to flash that is within the storage and aligned, as has just been checked")]
    async fn write_if(&mut self, offset: u32, word: &[u8], may: impl Fn() -> bool) -> Result<bool, FlashError> {
        let address = FIRST_BANK + self.place(offset, word.len())?;
        let [a, b, c, d, e, f, g, h] = *word else { return Err(FlashError::OutOfBounds) };
        if !offset.is_multiple_of(WRITE_SIZE as u32) {
            return Err(FlashError::OutOfBounds);
        }
        operate(may, || {
            FLASH.cr().write(|control| control.set_pg(true));
            let place = address as *mut u32;
            // The flash begins with the second half (RM0440, 3.3.7).
            unsafe {
                place.write_volatile(u32::from_le_bytes([a, b, c, d]));
                place.add(1).write_volatile(u32::from_le_bytes([e, f, g, h]));
            }
        })
    }

    async fn erase_if(&mut self, page: u32, may: impl Fn() -> bool) -> Result<bool, FlashError> {
        let place = self.place(page, MAX_ERASE_SIZE)?;
        let number = place.checked_sub(SECOND_BANK).filter(|offset| offset.is_multiple_of(PAGE));
        let number = number.ok_or(FlashError::OutOfBounds)? / PAGE;
        operate(may, || {
            FLASH.cr().write(|control| {
                control.set_per(true);
                control.set_bker(true);
                control.set_pnb(number as u8);
            });
            FLASH.cr().modify(|control| control.set_strt(true));
        })
    }
}

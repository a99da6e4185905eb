//! The storage: a few pages of the second flash bank.
//!
//! Operations block the thread executor: 22 ms for an erase, 0.1 ms for a word. That is meant. Sampling, alarm and reception run
//! above it from the first bank, which the second does not stall; no impact is open when one is begun, because the store waits for
//! that; and the asynchronous driver of `embassy-stm32` 0.6.0 clears the error flags in its interrupt before it looks at them, so that
//! it never reports a failure.

use core::ops::Range;

use embassy_stm32::flash::{Blocking, Error, Flash, MAX_ERASE_SIZE, WRITE_SIZE};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// The flash driver, confined to the storage's range.
pub struct BankTwo {
    flash: Flash<'static, Blocking>,
    range: Range<u32>,
}

/// What went wrong.
#[derive(Clone, Copy, Debug)]
pub enum FlashError {
    /// Not within the storage.
    OutOfBounds,
    /// Said by the flash.
    Flash(Error),
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::Flash(Error::Unaligned) => NorFlashErrorKind::NotAligned,
            Self::Flash(_) => NorFlashErrorKind::Other,
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

impl ErrorType for BankTwo {
    type Error = FlashError;
}

impl ReadNorFlash for BankTwo {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let place = self.place(offset, bytes.len())?;
        self.flash.blocking_read(place, bytes).map_err(FlashError::Flash)
    }

    fn capacity(&self) -> usize {
        self.whole().end as usize
    }
}

impl NorFlash for BankTwo {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = MAX_ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let length = to.checked_sub(from).ok_or(FlashError::OutOfBounds)?;
        let place = self.place(from, length as usize)?;
        self.flash.blocking_erase(place, place + length).map_err(FlashError::Flash)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let place = self.place(offset, bytes.len())?;
        self.flash.blocking_write(place, bytes).map_err(FlashError::Flash)
    }
}

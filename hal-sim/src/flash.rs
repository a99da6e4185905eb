//! Flash memory of an STM32G474: slow, erased by pages, written by double words, and able to die at any byte.
//!
//! ```text
//! erase: 2 KiB page → all ones, 22 ms          write: 8 bytes, only into an erased double word, 82 µs
//! ```
//!
//! A double word has its own error-correcting code, so it cannot be written twice, not even from ones to zeros
//! (RM0440, 3.3.7); only zeros may be written over anything. An operation that does not reach its end, because the power
//! goes, the board is reset or its future is dropped, leaves a mixture of old, new and random bits where it worked.
//! On the chip a double word left so may raise a non-maskable interrupt when it is read; here it reads as garbage.

use std::cell::RefCell;
use std::rc::Rc;

use embassy_time::{Duration, Timer};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use rand::{Rng as _, RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud_firmware::board::AskedFlash;

/// Bytes of a page, the unit of erasing (dual-bank mode).
pub const PAGE: usize = 2048;
/// Bytes of a double word, the unit of writing.
pub const DOUBLE_WORD: usize = 8;
/// Typical time to erase a page (data sheet DS12288).
pub const ERASE_TIME: Duration = Duration::from_millis(22);
/// Typical time to write a double word (data sheet DS12288).
pub const WRITE_TIME: Duration = Duration::from_micros(82);

/// What the flash refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FlashError {
    /// Not at a multiple of the unit.
    #[error("flash: {operation} from {from:#x} to {to:#x} is not aligned to {unit} bytes")]
    NotAligned {
        /// What was asked for.
        operation: &'static str,
        /// First byte.
        from: u32,
        /// Byte after the last.
        to: u32,
        /// Alignment it must have.
        unit: usize,
    },
    /// Beyond the end.
    #[error("flash: {operation} from {from:#x} to {to:#x} leaves the {capacity:#x} bytes there are")]
    OutOfBounds {
        /// What was asked for.
        operation: &'static str,
        /// First byte.
        from: u32,
        /// Byte after the last.
        to: u32,
        /// Size.
        capacity: usize,
    },
    /// The double word has been written since it was erased.
    #[error("flash: the double word at {address:#x} is not erased (PROGERR)")]
    NotErased {
        /// Its address.
        address: u32,
    },
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::NotAligned { .. } => NorFlashErrorKind::NotAligned,
            Self::OutOfBounds { .. } => NorFlashErrorKind::OutOfBounds,
            Self::NotErased { .. } => NorFlashErrorKind::Other,
        }
    }
}

/// What was done to a flash since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Operations {
    /// Pages erased.
    pub erased_pages: u64,
    /// Double words written.
    pub written_double_words: u64,
    /// Bytes erased or written, by which [`Flash::cut_power_after`] counts.
    pub worn_bytes: u64,
    /// Operations that did not reach their end.
    pub torn: u64,
}

struct Memory {
    bytes: Vec<u8>,
    operations: Operations,
    cut_at: Option<u64>,
    dead: bool,
    random: ChaCha8Rng,
}

/// A flash; clones are the same memory, which outlives resets and power cuts.
#[derive(Clone)]
pub struct Flash {
    memory: Rc<RefCell<Memory>>,
}

impl Flash {
    /// An erased flash of this many bytes, a multiple of [`PAGE`]. The seed is for what torn operations leave.
    ///
    /// # Panics
    /// If it is no multiple.
    #[must_use]
    pub fn new(capacity: usize, seed: u64) -> Self {
        assert!(capacity.is_multiple_of(PAGE), "{capacity} bytes are not whole pages of {PAGE}");
        let memory = Memory {
            bytes: vec![0xFF; capacity],
            operations: Operations::default(),
            cut_at: None,
            dead: false,
            random: ChaCha8Rng::seed_from_u64(seed),
        };
        Self { memory: Rc::new(RefCell::new(memory)) }
    }

    /// Cuts the power when this many more bytes have been erased or written; an operation that would pass this is torn
    /// there and never returns.
    pub fn cut_power_after(&self, bytes: u64) {
        let memory = &mut *self.memory.borrow_mut();
        memory.cut_at = Some(memory.operations.worn_bytes + bytes);
    }

    /// Whether the power was cut as ordered and has not come back.
    #[must_use]
    pub fn is_dead(&self) -> bool {
        self.memory.borrow().dead
    }

    /// The power is back, if it was cut as ordered; a cut that is still to come stays ordered.
    pub fn revive(&self) {
        let memory = &mut *self.memory.borrow_mut();
        if std::mem::take(&mut memory.dead) {
            memory.cut_at = None;
        }
    }

    /// What was done to it.
    #[must_use]
    pub fn operations(&self) -> Operations {
        self.memory.borrow().operations
    }

    /// A copy of all bytes.
    #[must_use]
    pub fn contents(&self) -> Vec<u8> {
        self.memory.borrow().bytes.clone()
    }

    /// Puts these bytes in from the first on, at once, as a programming adapter does: to go on with what another world
    /// left.
    ///
    /// # Panics
    /// If there are more than the flash holds.
    pub fn program(&self, contents: &[u8]) {
        self.memory.borrow_mut().bytes[..contents.len()].copy_from_slice(contents);
    }

    fn check(&self, operation: &'static str, from: u32, to: u32, unit: usize) -> Result<(), FlashError> {
        let capacity = self.memory.borrow().bytes.len();
        if to < from || to as usize > capacity {
            return Err(FlashError::OutOfBounds { operation, from, to, capacity });
        }
        if !(from as usize).is_multiple_of(unit) || !(to as usize).is_multiple_of(unit) {
            return Err(FlashError::NotAligned { operation, from, to, unit });
        }
        Ok(())
    }

    /// Works on bytes for some time; at the end they are `after`.
    async fn work(&self, address: usize, after: &[u8], time: Duration) {
        let mut working = Working { flash: self, address, after, done: false };
        let left = {
            let memory = self.memory.borrow();
            memory.cut_at.map_or(u64::MAX, |cut| cut - memory.operations.worn_bytes)
        };
        if left >= after.len() as u64 {
            Timer::after(time).await;
            working.finish();
        } else {
            Timer::after(Duration::from_micros(time.as_micros() * left / after.len() as u64)).await;
            working.tear(left as usize);
            self.memory.borrow_mut().dead = true;
            std::future::pending().await
        }
    }
}

/// An operation under way. Dropped before its end it is torn somewhere.
struct Working<'a> {
    flash: &'a Flash,
    address: usize,
    after: &'a [u8],
    done: bool,
}

impl Working<'_> {
    fn finish(&mut self) {
        self.done = true;
        let memory = &mut *self.flash.memory.borrow_mut();
        memory.bytes[self.address..self.address + self.after.len()].copy_from_slice(self.after);
        memory.operations.worn_bytes += self.after.len() as u64;
    }

    /// `progress` bytes have their new value, and the rest is anything between old and new; where nothing has been done
    /// yet, nothing has changed.
    fn tear(&mut self, progress: usize) {
        self.done = true;
        let memory = &mut *self.flash.memory.borrow_mut();
        memory.operations.torn += 1;
        memory.operations.worn_bytes += progress as u64;
        if progress == 0 {
            return;
        }
        let old = &mut memory.bytes[self.address..self.address + self.after.len()];
        old[..progress].copy_from_slice(&self.after[..progress]);
        for (old, new) in old[progress..].iter_mut().zip(&self.after[progress..]) {
            let chosen = memory.random.next_u32() as u8;
            *old = *old & chosen | *new & !chosen;
        }
    }
}

impl Drop for Working<'_> {
    fn drop(&mut self) {
        if !self.done {
            let progress = self.flash.memory.borrow_mut().random.random_range(0..self.after.len());
            self.tear(progress);
        }
    }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.check("reading", offset, offset.saturating_add(bytes.len() as u32), 1)?;
        let offset = offset as usize;
        bytes.copy_from_slice(&self.memory.borrow().bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.memory.borrow().bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = DOUBLE_WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.check("erasing", from, to, PAGE)?;
        for page in (from..to).step_by(PAGE) {
            self.work(page as usize, &[0xFF; PAGE], ERASE_TIME).await;
            self.memory.borrow_mut().operations.erased_pages += 1;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.check("writing", offset, offset.saturating_add(bytes.len() as u32), DOUBLE_WORD)?;
        for (index, new) in bytes.chunks_exact(DOUBLE_WORD).enumerate() {
            let address = offset as usize + index * DOUBLE_WORD;
            let erased = self.memory.borrow().bytes[address..address + DOUBLE_WORD].iter().all(|byte| *byte == 0xFF);
            if !erased && new.iter().any(|byte| *byte != 0) {
                return Err(FlashError::NotErased { address: address as u32 });
            }
            self.work(address, new, WRITE_TIME).await;
            self.memory.borrow_mut().operations.written_double_words += 1;
        }
        Ok(())
    }
}

/// A task of the simulation is interrupted by nobody before its first wait, which comes after an operation has begun.
impl AskedFlash for Flash {}

#[cfg(test)]
mod tests {
    use embassy_futures::select::select;
    use embassy_time::Instant;

    use super::*;
    use crate::time::Scheduler;

    /// Runs until nothing is left to wait for; gives the instant, µs.
    fn run(flash: &Flash, work: impl AsyncFnOnce(Flash) + 'static) -> u64 {
        let mut scheduler = Scheduler::new();
        let slot = scheduler.add("flash user");
        let flash = flash.clone();
        scheduler.start(slot, async move { work(flash).await });
        while let Some(next) = scheduler.settle().unwrap() {
            scheduler.clock().jump_to(next);
        }
        scheduler.clock().now().as_micros()
    }

    #[test]
    fn writing_and_erasing_take_their_time() {
        let flash = Flash::new(2 * PAGE, 0);
        let took_us = run(&flash, async |mut flash| {
            flash.write(16, &[7; 24]).await.unwrap();
            assert_eq!(Instant::now().as_micros(), 3 * 82);
            let mut read = [0; 26];
            flash.read(15, &mut read).await.unwrap();
            assert_eq!((read[0], read[1], read[24], read[25]), (0xFF, 7, 7, 0xFF));
            flash.erase(0, 2 * PAGE as u32).await.unwrap();
        });
        assert_eq!(took_us, 3 * 82 + 2 * 22_000);
        assert!(flash.contents().iter().all(|byte| *byte == 0xFF));
        let expected =
            Operations { erased_pages: 2, written_double_words: 3, worn_bytes: 2 * PAGE as u64 + 24, torn: 0 };
        assert_eq!(flash.operations(), expected);
    }

    #[test]
    fn what_the_chip_refuses_is_refused() {
        let flash = Flash::new(PAGE, 0);
        run(&flash, async |mut flash| {
            flash.write(8, &[0xF0; 8]).await.unwrap();
            // Even towards zeros: the error-correcting code has been written.
            assert_eq!(
                flash.write(8, &[0x00, 0xF0, 0, 0, 0, 0, 0, 0]).await,
                Err(FlashError::NotErased { address: 8 })
            );
            flash.write(8, &[0; 8]).await.unwrap();
            assert_eq!(flash.write(4, &[0; 8]).await.unwrap_err().kind(), NorFlashErrorKind::NotAligned);
            assert_eq!(flash.write(0, &[0; 4]).await.unwrap_err().kind(), NorFlashErrorKind::NotAligned);
            assert_eq!(flash.erase(0, 2 * PAGE as u32).await.unwrap_err().kind(), NorFlashErrorKind::OutOfBounds);
            assert_eq!(flash.read(PAGE as u32, &mut [0]).await.unwrap_err().kind(), NorFlashErrorKind::OutOfBounds);
        });
    }

    #[test]
    fn power_that_goes_in_a_write_leaves_what_was_written_before_and_garbage_in_one_double_word() {
        for cut in 0..=24 {
            let flash = Flash::new(PAGE, cut);
            flash.cut_power_after(cut);
            run(&flash, async |mut flash| {
                let written = flash.write(0, &[0x55; 24]).await;
                assert!(flash.operations().worn_bytes == 24, "{written:?}: it never returns from the dead");
            });
            assert_eq!(flash.is_dead(), cut < 24);
            let contents = flash.contents();
            let whole = cut as usize / DOUBLE_WORD * DOUBLE_WORD;
            assert!(contents[..cut as usize].iter().all(|byte| *byte == 0x55), "cut after {cut}");
            let torn_until = if cut as usize == whole { whole } else { whole + DOUBLE_WORD };
            assert!(contents[torn_until..].iter().all(|byte| *byte == 0xFF), "cut after {cut}");
            // No bit is set that was set neither before nor after.
            assert!(contents[..torn_until].iter().all(|byte| byte & 0x55 == 0x55));
        }
    }

    #[test]
    fn power_that_goes_in_an_erase_leaves_a_page_that_is_neither() {
        let flash = Flash::new(2 * PAGE, 3);
        run(&flash, async |mut flash| flash.write(0, &[0; PAGE]).await.unwrap());
        flash.cut_power_after(PAGE as u64 / 2);
        run(&flash, async |mut flash| {
            let _ = flash.erase(0, PAGE as u32).await;
            unreachable!("it never returns from the dead");
        });
        let page = &flash.contents()[..PAGE];
        assert!(page[..PAGE / 2].iter().all(|byte| *byte == 0xFF));
        assert!(page[PAGE / 2..].iter().any(|byte| *byte != 0xFF && *byte != 0));
        flash.revive();
        run(&flash, async |mut flash| flash.erase(0, PAGE as u32).await.unwrap());
        assert!(flash.contents().iter().all(|byte| *byte == 0xFF));
    }

    #[test]
    fn an_operation_that_is_dropped_is_torn() {
        let flash = Flash::new(PAGE, 5);
        run(&flash, async |mut flash| flash.write(0, &[0; PAGE]).await.unwrap());
        run(&flash, async |mut flash| {
            select(flash.erase(0, PAGE as u32), Timer::after(ERASE_TIME / 2)).await;
        });
        assert_eq!(flash.operations().torn, 1);
        assert!(!flash.is_dead());
        assert!(flash.contents().iter().any(|byte| *byte != 0xFF && *byte != 0));
    }
}

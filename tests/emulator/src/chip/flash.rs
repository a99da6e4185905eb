//! Flash: its registers, and bank 2 with what becomes of a word or a page when the power goes. RM0440 chapter 3.
//!
//! ```text
//! unlock ─▶ PG, two words of 32 bits ─▶ 85 µs busy ─▶ a double word of 64 bits with its own check bits
//!        ─▶ PER, page, STRT          ─▶ 22 ms busy ─▶ 2 KiB of ones
//! power goes meanwhile ─▶ some bits of it, check bits that do not fit ─▶ an NMI when it is read
//! ```
//!
//! Bank 1 runs the program and is not written: an attempt is a violation. A read of bank 2 while it is busy waits.

use std::collections::BTreeSet;

use rand::{Rng as _, RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::map::{BANK, BANK_2, PAGE};
use crate::moment::{MICROSECOND, Picoseconds};

/// DS12288: programming of 64 bits, typically 81.7 µs, at most 90.8; page erase typically 22.0 ms, at most 24.5.
pub const PROGRAM: Picoseconds = 85 * MICROSECOND;
/// See [`PROGRAM`].
pub const ERASE: Picoseconds = 22_000 * MICROSECOND;

const SR_EOP: u32 = 1;
const SR_PROGERR: u32 = 1 << 3;
const SR_PGAERR: u32 = 1 << 5;
const SR_SIZERR: u32 = 1 << 6;
const SR_PGSERR: u32 = 1 << 7;
const SR_BSY: u32 = 1 << 16;
const SR_ERRORS: u32 = 0xC3FA;

const CR_PG: u32 = 1;
const CR_PER: u32 = 1 << 1;
const CR_BKER: u32 = 1 << 11;
const CR_STRT: u32 = 1 << 16;
const CR_EOPIE: u32 = 1 << 24;
const CR_ERRIE: u32 = 1 << 25;
const CR_OPTLOCK: u32 = 1 << 30;
const CR_LOCK: u32 = 1 << 31;

const ECCD: u32 = 1 << 31;
const BK_ECC: u32 = 1 << 21;

/// Bytes of a double word, the least that can be programmed.
const WORD: u32 = 8;

/// What bank 2 holds; it outlives resets and power.
pub struct Bank2 {
    bytes: Vec<u8>,
    /// Double words whose check bits do not fit.
    torn: BTreeSet<u32>,
    random: ChaCha8Rng,
}

impl Bank2 {
    /// As it leaves the factory; the seed is for what torn operations leave.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { bytes: vec![0xFF; BANK as usize], torn: BTreeSet::new(), random: ChaCha8Rng::seed_from_u64(seed) }
    }

    /// Bytes of it.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Double words that cannot be read without an NMI.
    #[must_use]
    pub fn torn(&self) -> usize {
        self.torn.len()
    }

    fn is_erased(&self, word: u32) -> bool {
        let start = (word * WORD) as usize;
        self.bytes[start..start + WORD as usize].iter().all(|byte| *byte == 0xFF) && !self.torn.contains(&word)
    }

    fn program(&mut self, word: u32, value: u64) {
        let start = (word * WORD) as usize;
        for (byte, new) in self.bytes[start..].iter_mut().zip(value.to_le_bytes()) {
            *byte &= new;
        }
    }

    fn erase(&mut self, page: u32) {
        let start = page * PAGE;
        self.bytes[start as usize..(start + PAGE) as usize].fill(0xFF);
        self.torn.retain(|word| !(start..start + PAGE).contains(&(word * WORD)));
    }

    /// The power goes in the middle of it.
    fn tear(&mut self, operation: Operation) {
        match operation {
            Operation::Program { word, value } => {
                let some: u64 = self.random.next_u64();
                self.program(word, value | some);
                self.torn.insert(word);
            }
            Operation::Erase { page } => {
                for word in page * PAGE / WORD..(page + 1) * PAGE / WORD {
                    let start = (word * WORD) as usize;
                    if self.random.random_bool(0.5) {
                        self.bytes[start..start + WORD as usize].fill(0xFF);
                    } else {
                        self.torn.insert(word);
                    }
                }
            }
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Operation {
    Program { word: u32, value: u64 },
    Erase { page: u32 },
}

/// How often it was written since it exists.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wear {
    /// Double words programmed.
    pub programmed: u64,
    /// Pages erased.
    pub erased: u64,
}

/// The interface.
pub struct Flash {
    /// What it writes to.
    pub bank_2: Bank2,
    acr: u32,
    sr: u32,
    cr: u32,
    eccr: u32,
    keys: u8,
    /// The first half of a double word, and where.
    latched: Option<(u32, u32)>,
    under_way: Option<(Operation, Picoseconds)>,
    wear: Wear,
    last_begun: Option<Picoseconds>,
    interruptible: u64,
    /// The power goes in the middle of the operation after this many.
    cut_after: Option<u32>,
    cut_at: Option<Picoseconds>,
}

impl Flash {
    pub(super) fn new(bank_2: Bank2) -> Self {
        Self {
            bank_2,
            acr: 0x0004_0600,
            sr: 0,
            cr: CR_LOCK | CR_OPTLOCK,
            eccr: 0,
            keys: 0,
            latched: None,
            under_way: None,
            wear: Wear::default(),
            last_begun: None,
            interruptible: 0,
            cut_after: None,
            cut_at: None,
        }
    }

    /// A reset: registers begin anew, an operation under way is finished by the interface itself.
    pub(super) fn reset(&mut self) {
        let operation = self.under_way.take();
        if let Some((operation, _)) = operation {
            self.complete(operation);
        }
        self.acr = 0x0004_0600;
        (self.sr, self.cr, self.eccr, self.keys, self.latched) = (0, CR_LOCK | CR_OPTLOCK, 0, 0, None);
    }

    /// The power goes.
    pub(super) fn lose_power(&mut self) {
        if let Some((operation, _)) = self.under_way.take() {
            self.bank_2.tear(operation);
        }
        self.cut_at = None;
        self.reset();
    }

    /// Orders a loss of power in the middle of an operation, after this many more have been completed.
    pub fn cut_power_after(&mut self, operations: u32) {
        self.cut_after = Some(operations);
    }

    /// When the ordered loss of power takes place.
    #[must_use]
    pub fn power_goes_at(&self) -> Option<Picoseconds> {
        self.cut_at
    }

    /// How often it was written.
    #[must_use]
    pub fn wear(&self) -> Wear {
        self.wear
    }

    /// When the latest operation was begun.
    #[must_use]
    pub fn last_begun(&self) -> Option<Picoseconds> {
        self.last_begun
    }

    /// Operations that were begun while interrupts were let in: whatever the program had asked before, an interrupt may have changed
    /// since.
    #[must_use]
    pub fn interruptible(&self) -> u64 {
        self.interruptible
    }

    pub(crate) fn count_interruptible(&mut self) {
        self.interruptible += 1;
    }

    /// Wait states.
    pub(super) fn latency(&self) -> u32 {
        self.acr & 0xF
    }

    /// When the operation under way ends.
    #[must_use]
    pub fn busy_until(&self) -> Option<Picoseconds> {
        self.under_way.map(|(_, ends)| ends)
    }

    pub(super) fn advance(&mut self, now: Picoseconds) {
        if let Some((operation, ends)) = self.under_way
            && ends <= now
        {
            self.under_way = None;
            self.complete(operation);
            self.cr &= !CR_STRT;
            if self.cr & CR_EOPIE != 0 {
                self.sr |= SR_EOP;
            }
        }
    }

    fn complete(&mut self, operation: Operation) {
        match operation {
            Operation::Program { word, value } => {
                self.wear.programmed += 1;
                self.bank_2.program(word, value);
            }
            Operation::Erase { page } => {
                self.wear.erased += 1;
                self.bank_2.erase(page);
            }
        }
    }

    fn begin(&mut self, operation: Operation, now: Picoseconds) {
        let lasts = match operation {
            Operation::Program { .. } => PROGRAM,
            Operation::Erase { .. } => ERASE,
        };
        self.under_way = Some((operation, now + lasts));
        self.last_begun = Some(now);
        self.cut_after = match self.cut_after {
            Some(0) => {
                self.cut_at = Some(now + lasts / 2);
                None
            }
            Some(left) => Some(left - 1),
            None => None,
        };
    }

    pub(super) fn interrupts(&self) -> bool {
        self.sr & SR_EOP != 0 && self.cr & CR_EOPIE != 0 || self.sr & SR_ERRORS != 0 && self.cr & CR_ERRIE != 0
    }

    pub(super) fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.acr,
            0x08 | 0x0C => 0,
            0x10 => self.sr | if self.under_way.is_some() { SR_BSY } else { 0 },
            0x14 => self.cr,
            0x18 => self.eccr,
            // Factory value: dual bank, no protection.
            0x20 => 0xFFEF_F8AA,
            _ => return None,
        })
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, now: Picoseconds) -> Result<(), String> {
        match offset {
            0x00 => self.acr = value,
            0x08 => {
                self.keys = match (self.keys, value) {
                    (0, 0x4567_0123) => 1,
                    (1, 0xCDEF_89AB) => {
                        self.cr &= !CR_LOCK;
                        0
                    }
                    _ => return Err(format!("FLASH_KEYR is given 0x{value:08X}, which locks the flash until a reset")),
                }
            }
            0x10 => self.sr &= !(value & (SR_ERRORS | SR_EOP)),
            0x14 => return self.control(value, now),
            // ECCC and ECCD are cleared by ones.
            0x18 => self.eccr &= !(value & 0xF000_0000),
            _ => return Err(format!("FLASH at offset 0x{offset:X} is not modelled")),
        }
        Ok(())
    }

    fn control(&mut self, value: u32, now: Picoseconds) -> Result<(), String> {
        if self.cr & CR_LOCK != 0 {
            return if value & CR_LOCK != 0 { Ok(()) } else { Err("FLASH_CR is written while locked".into()) };
        }
        if self.under_way.is_some() {
            return Err("FLASH_CR is written while the flash is busy".into());
        }
        self.cr = value | self.cr & CR_OPTLOCK;
        if value & CR_STRT != 0 {
            if value & CR_PER == 0 {
                return Err("a flash operation other than a page erase is started".into());
            }
            if value & CR_BKER == 0 {
                return Err("a page of bank 1, which holds the program, is erased".into());
            }
            self.begin(Operation::Erase { page: value >> 3 & 0x7F }, now);
        }
        Ok(())
    }

    /// The program writes to bank 2.
    pub(super) fn store(&mut self, address: u32, size: usize, value: u32, now: Picoseconds) {
        let offset = address - BANK_2;
        if self.cr & CR_PG == 0 || self.cr & CR_LOCK != 0 || self.under_way.is_some() {
            self.sr |= SR_PGSERR;
            return;
        }
        if size != 4 {
            self.sr |= SR_SIZERR;
            return;
        }
        match self.latched.take() {
            None if offset.is_multiple_of(WORD) => self.latched = Some((offset, value)),
            Some((first, low)) if offset == first + 4 => {
                let word = first / WORD;
                let value = u64::from(value) << 32 | u64::from(low);
                // Zeros may be written over anything.
                if self.bank_2.is_erased(word) || value == 0 {
                    self.begin(Operation::Program { word, value }, now);
                } else {
                    self.sr |= SR_PROGERR;
                }
            }
            _ => self.sr |= SR_PGAERR,
        }
    }

    /// The program reads bank 2; whether that is an NMI.
    pub(super) fn load(&mut self, address: u32, size: usize) -> (u64, bool) {
        let offset = (address - BANK_2) as usize;
        let mut value = 0;
        for (place, byte) in self.bank_2.bytes[offset..offset + size].iter().enumerate() {
            value |= u64::from(*byte) << (8 * place);
        }
        let torn = self.bank_2.torn.contains(&(offset as u32 / WORD));
        if torn {
            self.eccr = self.eccr & 0xF000_0000 | ECCD | BK_ECC | (offset as u32 / WORD * WORD);
        }
        (value, torn)
    }
}

//! What memory keeps across a reset: the last words of a panic, and a mark that tells a sag of the supply from its end.
//!
//! | offset | type | meaning |
//! |---|---|---|
//! | 0 | u32 | [`MARK`] once the firmware has run since power came |
//! | 4 | u32 | what ended it, see [`End`] |
//! | 8 | u32 | detail, see [`End`] |
//! | 12 | u32 | number of addresses |
//! | 16 | u32 | CRC-32 (ISO-HDLC) of end, detail, number and addresses; anything else: no record |
//! | 20 | u32 × 59 | addresses in the program: where it ended, which EMCY tells too, and who had called, the innermost first |
//!
//! Uninitialised memory is any 256 bytes; the CRC decides whether they are a record.
//!
//! Addresses and not words: what a panic has to say, with file and line, takes 23 KiB of the flash (the places 20, the formatting
//! 3). The ELF file knows both, and who had called besides: `cargo xtask where ADDRESS...` reads it there.

/// Addresses that a record holds.
pub const ADDRESSES: usize = 59;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
/// "thud", once more.
const MARK: u32 = u32::from_be_bytes(*b"thud");

/// What ended the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
#[repr(u32)]
pub enum End {
    /// The program gave up by itself. Detail: 0.
    Panic = 1,
    /// A hard fault. Detail: the register CFSR.
    HardFault = 2,
    /// An interrupt that has no handler. Detail: its number.
    Interrupt = 3,
    /// A non-maskable interrupt that was not the flash. Detail: 0.
    NonMaskable = 4,
}

impl End {
    const ALL: [Self; 4] = [Self::Panic, Self::HardFault, Self::Interrupt, Self::NonMaskable];
}

/// The record; any bit pattern is one.
#[repr(C)]
pub struct PanicRecord {
    mark: u32,
    end: u32,
    detail: u32,
    count: u32,
    crc: u32,
    addresses: [u32; ADDRESSES],
}

const _: () = assert!(size_of::<PanicRecord>() == 256, "memory.x gives it 256 bytes");

impl PanicRecord {
    /// Nothing kept, as after a long time without power.
    #[cfg(test)]
    const BLANK: Self = Self { mark: 0, end: 0, detail: 0, count: 0, crc: 0, addresses: [0; ADDRESSES] };

    /// Whether memory kept its mark; sets it.
    pub fn memory_kept(&mut self) -> bool {
        core::mem::replace(&mut self.mark, MARK) == MARK
    }

    /// Keeps an end for after the reset, with as many of the addresses as find room.
    pub fn keep(&mut self, end: End, detail: u32, addresses: impl Iterator<Item = u32>) {
        self.end = end as u32;
        self.detail = detail;
        self.count = 0;
        for (place, address) in self.addresses.iter_mut().zip(addresses) {
            *place = address;
            self.count += 1;
        }
        self.crc = self.checksum();
    }

    /// The end that was kept, its detail and the addresses, if there is one.
    pub fn kept(&self) -> Option<(End, u32, &[u32])> {
        let addresses = self.addresses.get(..self.count as usize)?;
        let end = End::ALL.into_iter().find(|end| *end as u32 == self.end)?;
        (self.crc == self.checksum()).then_some((end, self.detail, addresses))
    }

    /// Forgets the end.
    pub fn forget(&mut self) {
        self.count = 0;
        self.crc = !self.checksum();
    }

    fn checksum(&self) -> u32 {
        let mut digest = CRC.digest();
        for word in [self.end, self.detail, self.count] {
            digest.update(&word.to_le_bytes());
        }
        for address in self.addresses.iter().take(self.count as usize) {
            digest.update(&address.to_le_bytes());
        }
        digest.finalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_is_kept_until_it_is_forgotten() {
        let mut record = PanicRecord::BLANK;
        assert_eq!(record.kept(), None, "zeros are no record");
        record.keep(End::HardFault, 0x8200, [0x0800_1235, 0x0800_4321].into_iter());
        assert_eq!(record.kept(), Some((End::HardFault, 0x8200, &[0x0800_1235, 0x0800_4321][..])));
        record.forget();
        assert_eq!(record.kept(), None);
        record.keep(End::Panic, 0, core::iter::empty());
        assert_eq!(record.kept(), Some((End::Panic, 0, &[][..])), "a stack that says nothing is still an end");
    }

    #[test]
    fn a_deep_stack_keeps_its_innermost_calls() {
        let mut record = PanicRecord::BLANK;
        record.keep(End::Panic, 0, 0..1000);
        let (_, _, addresses) = record.kept().unwrap();
        assert!(addresses.iter().copied().eq(0..ADDRESSES as u32));
    }

    #[test]
    fn any_flipped_bit_voids_it() {
        let mut record = PanicRecord::BLANK;
        record.keep(End::Interrupt, 7, [0x0800_0101, 0x0800_0203].into_iter());
        for bit in 0..32 {
            let fields: [fn(&mut PanicRecord) -> &mut u32; 6] = [
                |record| &mut record.end,
                |record| &mut record.detail,
                |record| &mut record.count,
                |record| &mut record.crc,
                |record| &mut record.addresses[0],
                |record| &mut record.addresses[1],
            ];
            for field in fields {
                *field(&mut record) ^= 1 << bit;
                assert_eq!(record.kept(), None);
                *field(&mut record) ^= 1 << bit;
            }
        }
        assert!(record.kept().is_some());
    }

    #[test]
    fn the_mark_tells_whether_memory_was_kept() {
        let mut record = PanicRecord::BLANK;
        assert!(!record.memory_kept());
        assert!(record.memory_kept());
    }
}

//! What memory keeps across a reset: the last words of a panic, and a mark that tells a sag of the supply from its end.
//!
//! | offset | type | meaning |
//! |---|---|---|
//! | 0 | u32 | [`MARK`] once the firmware has run since power came |
//! | 4 | u32 | length of the text |
//! | 8 | u32 | CRC-32 (ISO-HDLC) of length and text; anything else: no record |
//! | 12 | 240 bytes | text, UTF-8, cut off where it is longer |
//!
//! Uninitialised memory is any 256 bytes; the CRC decides whether they are a record.

use core::fmt::{self, Write};

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
/// Bytes of text.
pub const TEXT: usize = 240;
/// "thud", once more.
const MARK: u32 = u32::from_be_bytes(*b"thud");

/// The record; any bit pattern is one.
#[repr(C)]
pub struct PanicRecord {
    mark: u32,
    length: u32,
    crc: u32,
    text: [u8; TEXT],
}

const _: () = assert!(size_of::<PanicRecord>() <= 256, "memory.x gives it 256 bytes");

impl PanicRecord {
    /// Nothing kept, as after a long time without power.
    #[cfg(test)]
    const BLANK: Self = Self { mark: 0, length: 0, crc: 0, text: [0; TEXT] };

    /// Whether memory kept its mark; sets it.
    pub fn memory_kept(&mut self) -> bool {
        core::mem::replace(&mut self.mark, MARK) == MARK
    }

    /// Keeps a text for after the reset.
    pub fn keep(&mut self, words: fmt::Arguments<'_>) {
        let mut text = Text { bytes: &mut self.text, length: 0 };
        // Cut off where it is too long; it never fails otherwise.
        let _ = text.write_fmt(words);
        self.length = text.length as u32;
        self.crc = self.checksum();
    }

    /// The text that was kept, if there is one.
    pub fn text(&self) -> Option<&str> {
        let kept = self.text.get(..self.length as usize)?;
        if self.crc != self.checksum() {
            return None;
        }
        core::str::from_utf8(kept).ok()
    }

    /// Forgets the text.
    pub fn forget(&mut self) {
        self.length = 0;
        self.crc = !self.checksum();
    }

    fn checksum(&self) -> u32 {
        let mut digest = CRC.digest();
        digest.update(&self.length.to_le_bytes());
        digest.update(self.text.get(..self.length as usize).unwrap_or_default());
        digest.finalize()
    }
}

struct Text<'a> {
    bytes: &'a mut [u8; TEXT],
    length: usize,
}

impl Write for Text<'_> {
    fn write_str(&mut self, words: &str) -> fmt::Result {
        let room = TEXT - self.length;
        let mut end = words.len().min(room);
        while !words.is_char_boundary(end) {
            end -= 1;
        }
        self.bytes[self.length..self.length + end].copy_from_slice(&words.as_bytes()[..end]);
        self.length += end;
        if end == words.len() { Ok(()) } else { Err(fmt::Error) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_kept_until_it_is_forgotten() {
        let mut record = PanicRecord::BLANK;
        assert_eq!(record.text(), None, "zeros are no record");
        record.keep(format_args!("panicked at {}:{}", "sensor.rs", 7));
        assert_eq!(record.text(), Some("panicked at sensor.rs:7"));
        record.forget();
        assert_eq!(record.text(), None);
    }

    #[test]
    fn a_long_text_is_cut_at_a_character() {
        let mut record = PanicRecord::BLANK;
        record.keep(format_args!("{}{}", "x".repeat(TEXT - 1), "é and more"));
        assert_eq!(record.text(), Some(&*"x".repeat(TEXT - 1)));
    }

    #[test]
    fn any_flipped_bit_voids_it() {
        let mut record = PanicRecord::BLANK;
        record.keep(format_args!("the stack is gone"));
        for byte in 0..17 {
            for bit in 0..8 {
                record.text[byte] ^= 1 << bit;
                assert_eq!(record.text(), None);
                record.text[byte] ^= 1 << bit;
            }
        }
        for bit in 0..32 {
            record.length ^= 1 << bit;
            assert_eq!(record.text(), None);
            record.length ^= 1 << bit;
        }
        assert!(record.text().is_some());
    }

    #[test]
    fn the_mark_tells_whether_memory_was_kept() {
        let mut record = PanicRecord::BLANK;
        assert!(!record.memory_kept());
        assert!(record.memory_kept());
    }
}

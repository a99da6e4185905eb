//! A frame as the bits that are really on the wire, ISO 11898-1 classical base format.
//!
//! ```text
//! SOF │ id 11 │ RTR IDE r0 │ DLC 4 │ data 0–64 │ CRC 15 ║ CRC delimiter │ ACK slot │ ACK delimiter │ EOF 7
//!  └──────────────── stuffed: after five equal bits ────┘   └──────────── not stuffed, 10 bits ──────────┘
//!                     comes one of the other value
//! ```
//!
//! How long a frame takes depends on its data through the stuff bits, by up to a fifth; so they are made, not
//! estimated.

use thud_firmware::board::Frame;

/// Bits after the CRC sequence: its delimiter, the slot and delimiter of the acknowledgement, and end of frame.
pub const TAIL: u32 = 10;
/// Recessive bits at the end of a good frame: delimiter of the acknowledgement and end of frame.
pub const RECESSIVE_TAIL: u32 = 8;
/// Bits between two frames.
pub const INTERMISSION: u32 = 3;

/// CRC-15 of CAN: x¹⁵+x¹⁴+x¹⁰+x⁸+x⁷+x⁴+x³+1, without the leading term.
const CRC_POLYNOMIAL: u16 = 0x4599;

/// The stuffed part of a frame. Recessive is 1, dominant 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitStream {
    /// The first bit on the wire is the highest one of `len`. At most 98 + 24 stuff bits.
    bits: u128,
    len: u32,
}

impl BitStream {
    /// The bits of a frame.
    #[must_use]
    pub fn of(frame: &Frame) -> Self {
        let bytes = frame.bytes();
        // SOF, then the identifier, then RTR, IDE and r0, all three dominant for a base data frame.
        let mut plain = u128::from(frame.id & 0x7FF) << 3;
        plain = plain << 4 | bytes.len() as u128;
        for byte in bytes {
            plain = plain << 8 | u128::from(*byte);
        }
        let plain_len = 19 + 8 * bytes.len() as u32;
        plain = plain << 15 | u128::from(crc15(plain, plain_len));
        Self::stuff(plain, plain_len + 15)
    }

    fn stuff(plain: u128, plain_len: u32) -> Self {
        let mut stream = Self { bits: 0, len: 0 };
        let (mut last, mut run) = (2, 0);
        for position in (0..plain_len).rev() {
            let bit = plain >> position & 1;
            stream.push(bit);
            run = if bit == last { run + 1 } else { 1 };
            last = bit;
            if run == 5 {
                last = 1 - bit;
                stream.push(last);
                run = 1;
            }
        }
        stream
    }

    fn push(&mut self, bit: u128) {
        self.bits = self.bits << 1 | bit;
        self.len += 1;
    }

    /// Bits from start of frame to the end of the CRC sequence, stuff bits counted.
    #[must_use]
    pub const fn stuffed_len(&self) -> u32 {
        self.len
    }

    /// Bits of the whole frame on the wire, from start of frame to end of frame.
    #[must_use]
    pub const fn wire_len(&self) -> u32 {
        self.len + TAIL
    }

    /// Bit number `index` of the frame, with an acknowledgement in its slot.
    #[must_use]
    pub const fn bit(&self, index: u32) -> bool {
        if index < self.len { self.bits >> (self.len - 1 - index) & 1 == 1 } else { index != self.len + 1 }
    }

    /// Equal bits that end with bit number `index`, five at most.
    #[must_use]
    pub const fn run_ending_at(&self, index: u32) -> u32 {
        let mut run = 1;
        while run < 5 && run <= index && self.bit(index - run) == self.bit(index) {
            run += 1;
        }
        run
    }

    /// The first bit in which two frames differ.
    #[must_use]
    pub const fn first_difference(&self, other: &Self) -> Option<u32> {
        let difference = self.bits << (128 - self.len) ^ other.bits << (128 - other.len);
        if difference == 0 { None } else { Some(difference.leading_zeros()) }
    }
}

/// Bits that a frame takes on the wire, without the intermission after it.
#[must_use]
pub fn wire_bits(frame: &Frame) -> u32 {
    BitStream::of(frame).wire_len()
}

const fn crc15(bits: u128, len: u32) -> u16 {
    let mut crc = 0_u16;
    let mut position = len;
    while position > 0 {
        position -= 1;
        let carry = (crc >> 14 & 1) ^ (bits >> position & 1) as u16;
        crc = crc << 1 & 0x7FFF;
        if carry == 1 {
            crc ^= CRC_POLYNOMIAL;
        }
    }
    crc
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frame(id: u16, bytes: &[u8]) -> Frame {
        Frame::new(id, bytes).unwrap()
    }

    fn text(stream: &BitStream) -> String {
        (0..stream.stuffed_len()).map(|index| if stream.bit(index) { '1' } else { '0' }).collect()
    }

    /// The check value of CRC-15/CAN in the catalogue of parametrised CRC algorithms: 0x059E for "123456789".
    #[test]
    fn the_crc_is_that_of_the_catalogue() {
        let message = b"123456789".iter().fold(0_u128, |bits, byte| bits << 8 | u128::from(*byte));
        assert_eq!(crc15(message, 72), 0x059E);
    }

    /// By hand. Identifier 0 without data is 19 zeros, whose CRC is 0 as well: 34 zeros, and a 1 after the 5th, and
    /// since that 1 breaks the run, after each 5 zeros again: 5·6 = 30 zeros give 6 stuff bits, 4 zeros remain.
    #[test]
    fn all_zeros_are_stuffed_as_by_hand() {
        let stream = BitStream::of(&frame(0, &[]));
        assert_eq!(text(&stream), "0000010000010000010000010000010000010000");
        assert_eq!(stream.wire_len(), 34 + 6 + 10);
    }

    /// By hand. 0x555 alternates and the DLC is 0: SOF 0, 10101010101, 000 0000 is seven zeros after a 1, one
    /// stuff bit after the fifth, so `00000 1 00`. The CRC follows.
    #[test]
    fn the_control_field_is_stuffed_as_by_hand() {
        let stream = BitStream::of(&frame(0x555, &[]));
        assert!(text(&stream).starts_with("0101010101010000010"), "{}", text(&stream));
    }

    /// A stuff bit takes part in the next run: 0x78 = 000 0111 1000 begins, with SOF, `00001111`…; five ones
    /// directly before zeros give the longest chain, one stuff bit for each further 4 bits.
    #[test]
    fn a_stuff_bit_counts_in_the_next_run() {
        // 00000 1111 0000 1111 …: the stuff bit 1 after five zeros begins the run of ones.
        let stuffed = BitStream::stuff(0b0_0000_1111_0000_1111, 17);
        assert_eq!(text(&stuffed), "000001111100000111110");
        assert_eq!(stuffed.stuffed_len(), 17 + 4);
    }

    fn any_frame() -> impl Strategy<Value = Frame> {
        (0_u16..=0x7FF, prop::collection::vec(any::<u8>(), 0..=8)).prop_map(|(id, bytes)| frame(id, &bytes))
    }

    proptest! {
        #[test]
        fn never_six_equal_bits_and_never_longer_than_the_bound(frame in any_frame()) {
            let stream = BitStream::of(&frame);
            let bits = text(&stream);
            prop_assert!(!bits.contains("000000") && !bits.contains("111111"), "{}", bits);
            let plain = 34 + 8 * u32::from(frame.len);
            prop_assert!((plain..=plain + (plain - 1) / 4).contains(&stream.stuffed_len()));
        }

        /// What a receiver does: take out the stuff bits and read the fields back.
        #[test]
        fn unstuffed_it_is_the_frame_again(frame in any_frame()) {
            let mut plain = Vec::new();
            let (mut run, mut last, mut skip) = (0, None, false);
            for bit in text(&BitStream::of(&frame)).chars() {
                run = if last == Some(bit) { run + 1 } else { 1 };
                last = Some(bit);
                if !skip { plain.push(u8::from(bit == '1')); }
                skip = run == 5;
            }
            let number = |bits: &[u8]| bits.iter().fold(0_u64, |n, bit| n << 1 | u64::from(*bit));
            prop_assert_eq!(number(&plain[1..12]), u64::from(frame.id));
            prop_assert_eq!(number(&plain[15..19]), u64::from(frame.len));
            for (index, byte) in frame.bytes().iter().enumerate() {
                prop_assert_eq!(number(&plain[19 + 8 * index..27 + 8 * index]), u64::from(*byte));
            }
        }

        #[test]
        fn two_frames_differ_where_their_bits_do(one in any_frame(), other in any_frame()) {
            let (one, other) = (BitStream::of(&one), BitStream::of(&other));
            let by_eye = (0..one.stuffed_len().min(other.stuffed_len())).find(|index| one.bit(*index) != other.bit(*index));
            prop_assert_eq!(one.first_difference(&other), by_eye);
        }
    }
}

//! The log format of can-utils (`candump -l`), which python-can reads and writes too: one frame a line.
//!
//! ```text
//! (1795262400.012345) can0 1A0#0102030405060708        data frame
//! (1795262400.012345) can0 1A0#R4                      remote request
//! (1795262400.012345) can0 12345678#AA                 29-bit identifier: 8 digits
//! (1795262400.012345) can0 1A0##1AABB                  CAN FD
//! (1795262400.012345) can0 20000040#0000000000000000   error frame
//! (1795262400.012345) can0 1A0#AA R                    R received, T sent by whoever wrote the log
//! ```
//!
//! Format: can-utils `lib.c` (`sprint_canframe`, `parse_canframe`) and python-can's `CanutilsLogReader`. Read byte by byte,
//! without allocation, because logs have millions of lines.

use std::time::Duration;

use thud_firmware::board::Frame;

use super::Heard;

/// The longest line that means something: time, a name of 15 bytes, a CAN FD frame of 64 bytes.
pub const LONGEST: usize = 256;

/// A line of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry<'a> {
    /// When, since 1970 or whatever the writer's clock counts from.
    pub at: Duration,
    /// The interface's name.
    pub interface: &'a [u8],
    /// What was on the bus.
    pub heard: Heard,
    /// Whether the writer of the log sent it itself; `false` where the log does not say.
    pub sent: bool,
}

/// What is wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// The time.
    #[error("no time `(seconds.microseconds)` at its beginning")]
    Time,
    /// The interface's name.
    #[error("no interface name after the time")]
    Interface,
    /// No `#`, or digits in front of it that are no identifier.
    #[error("no identifier `123#` or `12345678#` after the interface")]
    Identifier,
    /// The data.
    #[error("data that are not 0 to 8 bytes of two hexadecimal digits each")]
    Data,
    /// Something after the frame.
    #[error("something after the frame that is neither `R` nor `T`")]
    Trailing,
    /// It goes on and on.
    #[error("more than {LONGEST} bytes")]
    TooLong,
}

/// Writes a line, its end included; `sent` says whether the writer sent it.
pub fn write(line: &mut Vec<u8>, at: Duration, interface: &str, frame: &Frame, sent: bool) {
    const DIGITS: &[u8; 16] = b"0123456789ABCDEF";
    let time = format!("({}.{:06}) {interface} ", at.as_secs(), at.subsec_micros());
    line.extend_from_slice(time.as_bytes());
    let digit = |value: u16| DIGITS[usize::from(value & 0xF)];
    line.extend([digit(frame.id >> 8), digit(frame.id >> 4), digit(frame.id), b'#']);
    line.extend(frame.bytes().iter().flat_map(|byte| [digit(u16::from(*byte) >> 4), digit(u16::from(*byte))]));
    line.extend_from_slice(if sent { b" T\n" } else { b" R\n" });
}

/// Reads a line without its end.
///
/// # Errors
/// [`Malformed`]; no bytes make it panic.
pub fn read(line: &[u8]) -> Result<Entry<'_>, Malformed> {
    if line.len() > LONGEST {
        return Err(Malformed::TooLong);
    }
    let (at, rest) = time(line).ok_or(Malformed::Time)?;
    let (interface, rest) = word(rest).ok_or(Malformed::Interface)?;
    let (frame, rest) = word(rest).ok_or(Malformed::Identifier)?;
    let sent = match word(rest) {
        None => false,
        Some((b"R", after)) if word(after).is_none() => false,
        Some((b"T", after)) if word(after).is_none() => true,
        Some(_) => return Err(Malformed::Trailing),
    };
    Ok(Entry { at, interface, heard: heard(frame)?, sent })
}

/// The next word and what comes after it.
fn word(text: &[u8]) -> Option<(&[u8], &[u8])> {
    let blank = |byte: &u8| matches!(byte, b' ' | b'\t' | b'\r');
    let begin = text.iter().position(|byte| !blank(byte))?;
    let text = &text[begin..];
    let end = text.iter().position(blank).unwrap_or(text.len());
    Some(text.split_at(end))
}

/// `(seconds.fraction)`, of which nine digits of fraction count.
fn time(line: &[u8]) -> Option<(Duration, &[u8])> {
    let mut rest = line.strip_prefix(b"(")?;
    let mut seconds = 0_u64;
    let mut digits = 0;
    while let [digit @ b'0'..=b'9', after @ ..] = rest {
        seconds = seconds.checked_mul(10)?.checked_add(u64::from(digit - b'0'))?;
        digits += 1;
        rest = after;
    }
    rest = rest.strip_prefix(b".").filter(|_| digits > 0)?;
    let (mut nanoseconds, mut unit) = (0_u32, 100_000_000_u32);
    while let [digit @ b'0'..=b'9', after @ ..] = rest {
        nanoseconds += unit * u32::from(digit - b'0');
        unit /= 10;
        rest = after;
    }
    Some((Duration::new(seconds, nanoseconds), rest.strip_prefix(b")")?))
}

/// Value of each byte as a hexadecimal digit; 0xFF for what is none.
const VALUE: [u8; 256] = {
    let mut table = [0xFF; 256];
    let mut byte = 0;
    while byte < 256 {
        table[byte] = match byte as u8 {
            digit @ b'0'..=b'9' => digit - b'0',
            digit @ b'a'..=b'f' => digit - b'a' + 10,
            digit @ b'A'..=b'F' => digit - b'A' + 10,
            _ => 0xFF,
        };
        byte += 1;
    }
    table
};

fn number(digits: &[u8]) -> Option<u32> {
    let mut number = 0_u32;
    for byte in digits {
        let value = VALUE[usize::from(*byte)];
        if value == 0xFF {
            return None;
        }
        number = number << 4 | u32::from(value);
    }
    Some(number)
}

/// `ERR_FLAG` of linux/can.h, which logs write into the identifier.
const ERROR: u32 = 0x2000_0000;

fn heard(text: &[u8]) -> Result<Heard, Malformed> {
    let hash = text.iter().take(9).position(|byte| *byte == b'#').ok_or(Malformed::Identifier)?;
    let id = number(&text[..hash]).ok_or(Malformed::Identifier)?;
    let data = &text[hash + 1..];
    match (hash, data) {
        (8, _) if id & ERROR != 0 => Ok(Heard::Foreign("error frame")),
        (3 | 8, [b'R'] | [b'R', b'0'..=b'8']) => Ok(Heard::Foreign("remote request")),
        (3 | 8, [b'#', flags, rest @ ..]) => {
            let sound = rest.len() % 2 == 0 && rest.len() <= 128 && rest.iter().all(u8::is_ascii_hexdigit);
            if flags.is_ascii_hexdigit() && sound { Ok(Heard::Foreign("CAN FD")) } else { Err(Malformed::Data) }
        }
        (3, _) if id > 0x7FF => Err(Malformed::Identifier),
        (3, data) => bytes(data)
            .and_then(|(bytes, length)| Frame::new(id as u16, &bytes[..length]))
            .map(Heard::Frame)
            .ok_or(Malformed::Data),
        (8, data) => bytes(data).map(|_| Heard::Foreign("29-bit identifier")).ok_or(Malformed::Data),
        _ => Err(Malformed::Identifier),
    }
}

fn bytes(digits: &[u8]) -> Option<([u8; 8], usize)> {
    if digits.len() > 16 || !digits.len().is_multiple_of(2) {
        return None;
    }
    let mut bytes = [0; 8];
    for (byte, pair) in bytes.iter_mut().zip(digits.chunks_exact(2)) {
        let (high, low) = (VALUE[usize::from(pair[0])], VALUE[usize::from(pair[1])]);
        if (high | low) > 0xF {
            return None;
        }
        *byte = high << 4 | low;
    }
    Some((bytes, digits.len() / 2))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn kind(line: &str) -> Result<Heard, Malformed> {
        read(line.as_bytes()).map(|entry| entry.heard)
    }

    #[test]
    fn every_kind_of_line_of_can_utils_is_read() {
        let entry = read(b"(1436509052.249713) vcan0 044#2A366C2BBA").unwrap();
        assert_eq!(entry.at, Duration::new(1_436_509_052, 249_713_000));
        assert_eq!((entry.interface, entry.sent), (&b"vcan0"[..], false));
        assert_eq!(entry.heard, Heard::Frame(Frame::new(0x044, &[0x2A, 0x36, 0x6C, 0x2B, 0xBA]).unwrap()));
        assert!(read(b"(0.0) can0 7FF# T\r").unwrap().sent);
        assert_eq!(kind("(0.000001) can0 7FF# R"), Ok(Heard::Frame(Frame::new(0x7FF, &[]).unwrap())));
        assert_eq!(kind("(1.5) can0 12345678#AA"), Ok(Heard::Foreign("29-bit identifier")));
        for remote in ["(1.5) can0 1A0#R", "(1.5) can0 1A0#R4 R", "(1.5) can0 12345678#R8"] {
            assert_eq!(kind(remote), Ok(Heard::Foreign("remote request")), "{remote}");
        }
        assert_eq!(kind("(1.5) can0 1A0##1AABB"), Ok(Heard::Foreign("CAN FD")));
        assert_eq!(kind("(1.5) can0 20000080#"), Ok(Heard::Foreign("error frame")));
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (line, wrong) in [
            ("", Malformed::Time),
            ("1.5 can0 123#", Malformed::Time),
            ("(99999999999999999999.0) can0 123#", Malformed::Time),
            ("(1.5", Malformed::Time),
            ("(1.5)", Malformed::Interface),
            ("(1.5) can0", Malformed::Identifier),
            ("(1.5) can0 12#", Malformed::Identifier),
            ("(1.5) can0 800#", Malformed::Identifier),
            ("(1.5) can0 1234567890", Malformed::Identifier),
            ("(1.5) can0 123#1", Malformed::Data),
            ("(1.5) can0 123#112233445566778899", Malformed::Data),
            ("(1.5) can0 123#1G", Malformed::Data),
            ("(1.5) can0 123#11 X", Malformed::Trailing),
            ("(1.5) can0 123#11 R R", Malformed::Trailing),
        ] {
            assert_eq!(kind(line), Err(wrong), "{line}");
        }
        assert_eq!(read(&[b' '; 300]), Err(Malformed::TooLong));
    }

    proptest! {
        #[test]
        fn a_frame_comes_back(id in 0u16..0x800, bytes in prop::collection::vec(any::<u8>(), 0..9), us in 0u64..1 << 52, sent in any::<bool>()) {
            let (frame, at) = (Frame::new(id, &bytes).unwrap(), Duration::from_micros(us));
            let mut line = Vec::new();
            write(&mut line, at, "can0", &frame, sent);
            let entry = read(line.strip_suffix(b"\n").unwrap()).unwrap();
            prop_assert_eq!(entry, Entry { at, interface: b"can0", heard: Heard::Frame(frame), sent });
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..80), cut in 0usize..60) {
            let _ = read(&bytes);
            let mut line = b"(1436509052.249713) vcan0 12345678#2A366C2BBA R".to_vec();
            line.splice(cut.min(line.len()).., bytes);
            let _ = read(&line);
        }
    }
}

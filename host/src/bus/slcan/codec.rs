//! The lines of SLCAN, as LAWICEL's CANUSB manual gives them, without the port.
//!
//! | line | meaning |
//! |---|---|
//! | `tIIILDD…` | data frame: 3 hexadecimal digits of identifier, length 0 to 8, data; 4 digits of time may follow |
//! | `TIIIIIIIILDD…` | the same with a 29-bit identifier |
//! | `rIIIL`, `RIIIIIIIIL` | remote request |
//! | `d`, `D`, `b`, `B` | CAN FD, as some adapters add it |
//! | `z`, `Z`, empty | done |
//! | `Fxx` | status flags |
//! | `V…`, `v…`, `N…` | version and serial number |
//!
//! Lines end with CR; BEL (7) stands for a refused command.

use thud_firmware::board::Frame;

use crate::bus::Heard;

/// The longest line that means something: a CAN FD frame with 64 bytes, a 29-bit identifier and a time.
pub const LONGEST: usize = 1 + 8 + 1 + 128 + 4;

const CR: u8 = b'\r';
const BEL: u8 = 7;

/// What an adapter says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// A frame from the bus.
    Heard(Heard),
    /// A command was done, or a frame taken.
    Done,
    /// A command was refused.
    Refused,
    /// Its status flags; reading them clears them.
    Status(u8),
    /// Something else that it may say: version, serial number, a command of another program.
    Other,
}

/// A line that means nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// It goes on and on.
    #[error("a line has more than {LONGEST} bytes")]
    TooLong,
    /// The first letter is no command of the protocol.
    #[error("no line begins with 0x{0:02X}")]
    Letter(u8),
    /// It ends too early, goes on too long, or has something else than hexadecimal digits.
    #[error("the line `{0}` is no frame")]
    Frame(String),
}

/// The line that sends a frame.
#[must_use]
pub fn encode(frame: &Frame) -> Vec<u8> {
    const DIGITS: &[u8; 16] = b"0123456789ABCDEF";
    let digit = |value: u16| DIGITS[usize::from(value & 0xF)];
    let bytes = frame.bytes();
    let mut line = Vec::with_capacity(6 + 2 * bytes.len());
    line.extend([b't', digit(frame.id >> 8), digit(frame.id >> 4), digit(frame.id), digit(bytes.len() as u16)]);
    line.extend(bytes.iter().flat_map(|byte| [digit(u16::from(*byte) >> 4), digit(u16::from(*byte))]));
    line.push(CR);
    line
}

/// Puts lines together from the bytes of a serial port.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    line: Vec<u8>,
    /// The line is too long; it is skipped up to its end.
    skipping: bool,
}

impl Decoder {
    /// Nothing read yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a byte; what the line says that it ends.
    ///
    /// # Errors
    /// [`Malformed`]; the next line is read all the same. Holds at most [`LONGEST`] bytes.
    pub fn push(&mut self, byte: u8) -> Option<Result<Line, Malformed>> {
        match byte {
            BEL => {
                self.line.clear();
                self.skipping = false;
                Some(Ok(Line::Refused))
            }
            CR if std::mem::take(&mut self.skipping) => None,
            CR => {
                let line = decode(&self.line);
                self.line.clear();
                Some(line)
            }
            // Some adapters end their lines with CR and LF.
            b'\n' if self.line.is_empty() => None,
            _ if self.skipping => None,
            _ if self.line.len() == LONGEST => {
                self.line.clear();
                self.skipping = true;
                Some(Err(Malformed::TooLong))
            }
            _ => {
                self.line.push(byte);
                None
            }
        }
    }
}

/// Reads a line without its end.
///
/// # Errors
/// [`Malformed`].
pub fn decode(line: &[u8]) -> Result<Line, Malformed> {
    let no_frame = || Malformed::Frame(String::from_utf8_lossy(line).into_owned());
    let Some((&letter, rest)) = line.split_first() else { return Ok(Line::Done) };
    match letter {
        b't' => data_frame(rest).map(|frame| Line::Heard(Heard::Frame(frame))).ok_or_else(no_frame),
        b'T' | b'x' => sound(rest, 8, true).map(|()| foreign("29-bit identifier")).ok_or_else(no_frame),
        b'r' => sound(rest, 3, false).map(|()| foreign("remote request")).ok_or_else(no_frame),
        b'R' => sound(rest, 8, false).map(|()| foreign("remote request")).ok_or_else(no_frame),
        b'd' | b'D' | b'b' | b'B' => Ok(foreign("CAN FD")),
        b'z' | b'Z' if rest.is_empty() => Ok(Line::Done),
        b'F' if rest.len() == 2 => number(rest).map(|flags| Line::Status(flags as u8)).ok_or_else(no_frame),
        // Version, serial number, and what another program on a shared line tells its adapter.
        b'V' | b'v' | b'N' | b'F' | b'C' | b'O' | b'L' | b'S' | b's' | b'A' | b'P' | b'X' | b'Y' | b'z' | b'Z'
        | b'M' | b'm' | b'W' | b'Q' => Ok(Line::Other),
        other => Err(Malformed::Letter(other)),
    }
}

fn foreign(why: &'static str) -> Line {
    Line::Heard(Heard::Foreign(why))
}

fn digit(byte: u8) -> Option<u32> {
    char::from(byte).to_digit(16)
}

fn number(digits: &[u8]) -> Option<u32> {
    digits.iter().try_fold(0u32, |number, byte| Some(number << 4 | digit(*byte)?))
}

/// Identifier, length, data, perhaps a time; the length of everything must fit.
fn data_frame(rest: &[u8]) -> Option<Frame> {
    let id = number(rest.get(..3)?)? as u16;
    let length = digit(*rest.get(3)?)? as usize;
    let data = rest.get(4..4 + 2 * length)?;
    let time = rest.get(4 + 2 * length..)?;
    if !(time.is_empty() || time.len() == 4 && number(time).is_some()) {
        return None;
    }
    let mut bytes = [0; 8];
    let bytes = bytes.get_mut(..length)?;
    for (byte, pair) in bytes.iter_mut().zip(data.chunks_exact(2)) {
        *byte = number(pair)? as u8;
    }
    Frame::new(id, bytes)
}

fn sound(rest: &[u8], id: usize, data: bool) -> Option<()> {
    number(rest.get(..id)?)?;
    let length = digit(*rest.get(id)?).filter(|length| *length <= 8)? as usize;
    let after = &rest[id + 1..];
    let data = if data { 2 * length } else { 0 };
    let sound = (after.len() == data || after.len() == data + 4) && after.iter().all(u8::is_ascii_hexdigit);
    sound.then_some(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn all(bytes: &[u8]) -> Vec<Result<Line, Malformed>> {
        let mut decoder = Decoder::new();
        bytes.iter().filter_map(|byte| decoder.push(*byte)).collect()
    }

    #[test]
    fn what_is_no_frame_is_said() {
        for line in ["t", "t12", "t1239", "t1232AA", "t1231AABBC", "t8001AA", "tx231AA", "T123", "r12", "F0G"] {
            let found = decode(line.as_bytes());
            let said = found.as_ref().is_err_and(|malformed| malformed.to_string().contains(line));
            assert!(said || line == "F0G" && found.is_err(), "{line}: {found:?}");
        }
        assert_eq!(decode(b"?"), Err(Malformed::Letter(b'?')));
    }

    #[test]
    fn an_endless_line_is_skipped_and_takes_no_memory() {
        let mut decoder = Decoder::new();
        let mut told = 0;
        for _ in 0..1_000_000 {
            told += usize::from(decoder.push(b't').is_some());
            assert!(decoder.line.len() <= LONGEST);
        }
        assert_eq!(told, 1);
        assert_eq!(decoder.push(CR), None);
        let frame = Frame::new(5, &[]).unwrap();
        let next: Vec<_> = encode(&frame).into_iter().filter_map(|byte| decoder.push(byte)).collect();
        assert_eq!(next, [Ok(Line::Heard(Heard::Frame(frame)))]);
    }

    proptest! {
        #[test]
        fn a_frame_comes_back(id in 0u16..0x800, bytes in prop::collection::vec(any::<u8>(), 0..9), time in any::<bool>()) {
            let frame = Frame::new(id, &bytes).unwrap();
            let mut line = encode(&frame);
            if time {
                line.splice(line.len() - 1..line.len() - 1, *b"EA5F");
            }
            prop_assert_eq!(all(&line), [Ok(Line::Heard(Heard::Frame(frame)))]);
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            all(&bytes);
            let _ = decode(&bytes);
        }
    }
}

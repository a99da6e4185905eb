//! One CAN frame as python-can's `udp_multicast` puts it into a UDP packet: a msgpack map with eleven keys.
//!
//! Format read from python-can 4.6, `can/interfaces/udp_multicast/utils.py`. Its decoder refuses unknown keys, so the
//! encoder writes exactly these, in its order, with the types that `can.Message` has; our decoder asks for each of
//! them exactly once.

use rmp::Marker;
use rmp::decode::{self, RmpRead as _};
use rmp::encode;
use thud_firmware::board::Frame;

use super::Heard;

/// The keys, in python-can's order.
const KEYS: [&str; 11] = [
    "timestamp",
    "arbitration_id",
    "is_extended_id",
    "is_remote_frame",
    "is_error_frame",
    "channel",
    "dlc",
    "data",
    "is_fd",
    "bitrate_switch",
    "error_state_indicator",
];

/// The longest packet that can carry a frame: the keys (124 bytes), their values for 64 bytes of CAN FD data, and
/// room for a channel name. python-can reads 4096.
pub const LONGEST: usize = 4096;

/// What is wrong with a packet.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// Not a msgpack map.
    #[error("not a msgpack map")]
    NotAMap,
    /// It ends too early, or a value has another type than python-can writes.
    #[error("the value of `{0}` is missing or has the wrong type")]
    Value(&'static str),
    /// A key that python-can does not know.
    #[error("unknown key `{0}`")]
    UnknownKey(String),
    /// A key is not a string, or damaged.
    #[error("a key is not a string")]
    Key,
    /// The same key twice.
    #[error("key `{0}` appears twice")]
    Twice(&'static str),
    /// A key is not there.
    #[error("key `{0}` is missing")]
    Missing(&'static str),
    /// The identifier does not exist.
    #[error("identifier {0:#X} is beyond {1:#X}")]
    Identifier(u32, u32),
    /// The length is impossible or contradicts the data.
    #[error("dlc {dlc} with {data} bytes of data")]
    Length {
        /// Announced length.
        dlc: u32,
        /// Bytes that came.
        data: usize,
    },
    /// Bytes after the map.
    #[error("{0} bytes after the frame")]
    Trailing(usize),
}

/// Writes a frame; `timestamp_s` is the sender's clock in seconds since 1970 (receivers use their own).
#[must_use]
pub fn encode(frame: &Frame, timestamp_s: f64) -> Vec<u8> {
    let mut packet = Vec::with_capacity(192);
    // Writing to a Vec cannot fail; should it ever, the receiver refuses the torn packet and counts it.
    let _ = write(&mut packet, frame, timestamp_s);
    packet
}

fn write(packet: &mut Vec<u8>, frame: &Frame, timestamp_s: f64) -> Result<(), encode::ValueWriteError> {
    encode::write_map_len(packet, KEYS.len() as u32)?;
    for key in KEYS {
        encode::write_str(packet, key)?;
        match key {
            "timestamp" => encode::write_f64(packet, timestamp_s)?,
            "arbitration_id" => drop(encode::write_uint(packet, u64::from(frame.id))?),
            "channel" => encode::write_nil(packet).map_err(encode::ValueWriteError::InvalidMarkerWrite)?,
            "dlc" => drop(encode::write_uint(packet, frame.bytes().len() as u64)?),
            "data" => encode::write_bin(packet, frame.bytes())?,
            _ => encode::write_bool(packet, false).map_err(encode::ValueWriteError::InvalidMarkerWrite)?,
        }
    }
    Ok(())
}

/// Reads a packet.
///
/// # Errors
/// [`Malformed`] says what was wrong; no input makes it panic or allocate more than the packet is long.
pub fn decode(packet: &[u8]) -> Result<Heard, Malformed> {
    let mut rest = packet;
    let pairs = decode::read_map_len(&mut rest).map_err(|_| Malformed::NotAMap)?;

    let mut seen = [false; KEYS.len()];
    let (mut identifier, mut dlc) = (0_u32, 0_u32);
    let mut data: &[u8] = &[];
    let (mut extended, mut remote, mut error, mut fd) = (false, false, false, false);
    for _ in 0..pairs {
        let (key, tail) = decode::read_str_from_slice(rest).map_err(|_| Malformed::Key)?;
        rest = tail;
        let place = KEYS.iter().position(|known| *known == key).ok_or_else(|| Malformed::UnknownKey(key.to_owned()))?;
        let key = KEYS[place];
        if std::mem::replace(&mut seen[place], true) {
            return Err(Malformed::Twice(key));
        }
        match key {
            "arbitration_id" => identifier = unsigned(&mut rest, key)?,
            "dlc" => dlc = unsigned(&mut rest, key)?,
            "data" => data = bytes(&mut rest)?,
            "timestamp" | "channel" => skip_scalar(&mut rest, key)?,
            _ => {
                let flag = decode::read_bool(&mut rest).map_err(|_| Malformed::Value(key))?;
                match key {
                    "is_extended_id" => extended = flag,
                    "is_remote_frame" => remote = flag,
                    "is_error_frame" => error = flag,
                    "is_fd" => fd = flag,
                    // The two remaining describe CAN FD frames, which are foreign anyway.
                    _ => {}
                }
            }
        }
    }
    if let Some(place) = seen.iter().position(|seen| !seen) {
        return Err(Malformed::Missing(KEYS[place]));
    }
    if !rest.is_empty() {
        return Err(Malformed::Trailing(rest.len()));
    }

    let highest = if extended { 0x1FFF_FFFF } else { 0x7FF };
    if identifier > highest {
        return Err(Malformed::Identifier(identifier, highest));
    }
    let longest = if fd { 64 } else { 8 };
    // A remote request announces a length and carries nothing.
    if dlc > longest || (data.len() != dlc as usize && !(remote && data.is_empty())) {
        return Err(Malformed::Length { dlc, data: data.len() });
    }
    if error {
        return Ok(Heard::Foreign("error frame"));
    } else if fd {
        return Ok(Heard::Foreign("CAN FD frame"));
    } else if remote {
        return Ok(Heard::Foreign("remote request"));
    } else if extended {
        return Ok(Heard::Foreign("29-bit identifier"));
    }
    Frame::new(identifier as u16, data).map(Heard::Frame).ok_or(Malformed::Length { dlc, data: data.len() })
}

fn unsigned(rest: &mut &[u8], key: &'static str) -> Result<u32, Malformed> {
    decode::read_int(rest).map_err(|_| Malformed::Value(key))
}

/// The bytes of `data`: bin, as python-can writes, whatever the width of its length.
fn bytes<'a>(rest: &mut &'a [u8]) -> Result<&'a [u8], Malformed> {
    let length = decode::read_bin_len(rest).map_err(|_| Malformed::Value("data"))? as usize;
    let (data, tail) = rest.split_at_checked(length).ok_or(Malformed::Value("data"))?;
    *rest = tail;
    Ok(data)
}

/// A number, a string or nil: what `timestamp` and `channel` can be.
fn skip_scalar(rest: &mut &[u8], key: &'static str) -> Result<(), Malformed> {
    let wrong = || Malformed::Value(key);
    let before = *rest;
    let marker = decode::read_marker(rest).map_err(|_| wrong())?;
    let width = match marker {
        Marker::Null | Marker::FixPos(_) | Marker::FixNeg(_) => 0,
        Marker::U8 | Marker::I8 => 1,
        Marker::U16 | Marker::I16 => 2,
        Marker::U32 | Marker::I32 | Marker::F32 => 4,
        Marker::U64 | Marker::I64 | Marker::F64 => 8,
        Marker::FixStr(_) | Marker::Str8 | Marker::Str16 | Marker::Str32 => {
            let (_, tail) = decode::read_str_from_slice(before).map_err(|_| wrong())?;
            *rest = tail;
            return Ok(());
        }
        _ => return Err(wrong()),
    };
    for _ in 0..width {
        rest.read_u8().map_err(|_| wrong())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `can.interfaces.udp_multicast.utils.pack_message(can.Message(timestamp=1.5, arbitration_id=0x123,
    /// is_extended_id=False, data=[1, 2, 3]))`, python-can 4.6.1.
    const PYTHON: &[u8] = b"\x8b\xa9timestamp\xcb\x3f\xf8\x00\x00\x00\x00\x00\x00\xaearbitration_id\xcd\x01\x23\
        \xaeis_extended_id\xc2\xafis_remote_frame\xc2\xaeis_error_frame\xc2\xa7channel\xc0\xa3dlc\x03\
        \xa4data\xc4\x03\x01\x02\x03\xa5is_fd\xc2\xaebitrate_switch\xc2\xb5error_state_indicator\xc2";

    #[test]
    fn the_bytes_are_python_cans() {
        let frame = Frame::new(0x123, &[1, 2, 3]).unwrap();
        assert_eq!(encode(&frame, 1.5), PYTHON);
        assert_eq!(decode(PYTHON), Ok(Heard::Frame(frame)));
    }

    fn with(key: &str, old: &[u8], new: &[u8]) -> Vec<u8> {
        let old = [key.as_bytes(), old].concat();
        let new = [key.as_bytes(), new].concat();
        let at = PYTHON.windows(old.len()).position(|window| window == old).expect("in the packet");
        [&PYTHON[..at], &new, &PYTHON[at + old.len()..]].concat()
    }

    #[test]
    fn frames_that_canopen_does_not_use_are_foreign_not_malformed() {
        assert_eq!(decode(&with("is_extended_id", b"\xc2", b"\xc3")), Ok(Heard::Foreign("29-bit identifier")));
        assert_eq!(decode(&with("is_remote_frame", b"\xc2", b"\xc3")), Ok(Heard::Foreign("remote request")));
        assert_eq!(decode(&with("is_error_frame", b"\xc2", b"\xc3")), Ok(Heard::Foreign("error frame")));
        assert_eq!(decode(&with("is_fd", b"\xc2", b"\xc3")), Ok(Heard::Foreign("CAN FD frame")));
    }

    #[test]
    fn a_channel_may_be_a_name_or_a_number() {
        for channel in [&b"\xa4can0"[..], b"\x05", b"\xcd\x01\x00", b"\xd9\x04can0"] {
            assert!(decode(&with("channel", b"\xc0", channel)).is_ok(), "{channel:?}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert_eq!(decode(b""), Err(Malformed::NotAMap));
        assert_eq!(decode(b"hello"), Err(Malformed::NotAMap));
        assert_eq!(decode(&with("dlc", b"\x03", b"\x04")), Err(Malformed::Length { dlc: 4, data: 3 }));
        assert_eq!(
            decode(&with("arbitration_id", b"\xcd\x01\x23", b"\xcd\x08\x00")),
            Err(Malformed::Identifier(0x800, 0x7FF))
        );
        assert_eq!(decode(&with("arbitration_id", b"\xcd\x01\x23", b"\xff")), Err(Malformed::Value("arbitration_id")));
        assert_eq!(decode(&with("data", b"\xc4\x03", b"\xc4\xff")), Err(Malformed::Value("data")));
        assert_eq!(decode(&[PYTHON, b"\xc0"].concat()), Err(Malformed::Trailing(1)));
        assert_eq!(decode(b"\x81\xa5extra\x00"), Err(Malformed::UnknownKey("extra".into())));
        assert_eq!(decode(b"\x82\xa3dlc\x00\xa3dlc\x00"), Err(Malformed::Twice("dlc")));
        assert_eq!(decode(b"\x81\xa3dlc\x00"), Err(Malformed::Missing("timestamp")));
        assert_eq!(decode(b"\x81\xc0\xc0"), Err(Malformed::Key));
    }

    #[test]
    fn a_packet_cut_anywhere_is_refused() {
        for end in 0..PYTHON.len() {
            assert!(decode(&PYTHON[..end]).is_err(), "cut to {end} bytes");
        }
    }

    proptest! {
        #[test]
        fn every_frame_survives(id in 0_u16..0x800, data in prop::collection::vec(any::<u8>(), 0..=8), at: f64) {
            let frame = Frame::new(id, &data).unwrap();
            prop_assert_eq!(decode(&encode(&frame, at)), Ok(Heard::Frame(frame)));
        }

        #[test]
        fn no_bytes_make_it_panic(packet in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = decode(&packet);
        }

        #[test]
        fn no_damage_makes_it_panic(at in 0..PYTHON.len(), byte: u8) {
            let mut packet = PYTHON.to_vec();
            packet[at] = byte;
            let _ = decode(&packet);
        }
    }
}

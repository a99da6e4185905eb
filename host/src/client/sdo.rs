//! SDO client, CiA 301: reading and writing the objects of a node.
//!
//! ```text
//! expedited   request ─▶  ◀─ up to 4 bytes
//! segmented   request ─▶  ◀─ length    (segment? ─▶  ◀─ 7 bytes)…
//! block       request ─▶  ◀─ length    start ─▶  (◀─ up to 127 × 7 bytes  acknowledge ─▶)…  ◀─ CRC  end ─▶
//! ```
//!
//! Every transfer is complete or an error. An answer for another object, a wrong toggle bit, a missing
//! segment or a length other than announced is noticed; a block whose segments are missing is asked for again from the
//! first missing one, and the CRC is checked over the whole. Time is the bus's own clock, so that the same code reads a
//! real sensor and a simulated one in virtual time.

use std::time::Duration;

use zencan_common::sdo::{AbortCode, BlockSegment, SdoRequest, SdoResponse};

use super::line::Line;
use crate::bus::BusError;

/// How long an answer may take. CiA 301 leaves it open; a sensor answers within milliseconds, a busy desktop that
/// simulates one takes longer.
const ANSWER: Duration = Duration::from_millis(500);

/// How long another master's transfer is waited for.
const PATIENCE: Duration = Duration::from_secs(1);

/// A request without an answer is repeated this often; reading and writing a value twice does no harm.
const TRIES: u32 = 3;

/// Segments per block: the most that the protocol knows.
const BLOCK: u8 = 127;

/// More than any object of the sensor holds; a damaged length must not ask for 4 GB.
const LONGEST: usize = 16 << 20;

/// CRC of a block transfer, CiA 301 7.2.4.3.16: x¹⁶ + x¹² + x⁵ + 1, started at 0.
const CRC: crc::Crc<u16> = crc::Crc::<u16>::new(&crc::CRC_16_XMODEM);

/// Why an object could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum SdoError {
    /// Nothing came back.
    #[error("node {node} does not answer (object 0x{index:04X}:{sub} was asked {TRIES} times)")]
    NoAnswer {
        /// The node asked.
        node: u8,
        /// Object.
        index: u16,
        /// Sub-index.
        sub: u8,
    },
    /// The node refused.
    #[error("node {node} refuses object 0x{index:04X}:{sub}: {} (abort code 0x{code:08X})", abort_words(*code))]
    Aborted {
        /// The node.
        node: u8,
        /// Object.
        index: u16,
        /// Sub-index.
        sub: u8,
        /// Abort code of CiA 301.
        code: u32,
    },
    /// The transfer broke off or was damaged; it can be tried again.
    #[error("the transfer of object 0x{index:04X}:{sub} from node {node} is damaged: {what}")]
    Torn {
        /// The node.
        node: u8,
        /// Object.
        index: u16,
        /// Sub-index.
        sub: u8,
        /// What was wrong.
        what: String,
    },
    /// The value has another length than its type.
    #[error("object 0x{index:04X}:{sub} of node {node} has {found} bytes instead of {expected}")]
    Size {
        /// The node.
        node: u8,
        /// Object.
        index: u16,
        /// Sub-index.
        sub: u8,
        /// Bytes of its type.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
    /// The transport failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl SdoError {
    /// The abort code, if the node refused.
    #[must_use]
    pub fn abort_code(&self) -> Option<u32> {
        match self {
            Self::Aborted { code, .. } => Some(*code),
            _ => None,
        }
    }
}

/// A value as an object holds it: little-endian.
pub trait Value: Sized {
    /// Bytes of the value.
    type Bytes: for<'a> TryFrom<&'a [u8]> + AsRef<[u8]>;
    /// From its bytes.
    fn from_bytes(bytes: Self::Bytes) -> Self;
    /// Its bytes.
    fn to_bytes(self) -> Self::Bytes;
}

macro_rules! values {
    ($($type:ty),+) => {$(
        impl Value for $type {
            type Bytes = [u8; size_of::<$type>()];
            fn from_bytes(bytes: Self::Bytes) -> Self {
                Self::from_le_bytes(bytes)
            }
            fn to_bytes(self) -> Self::Bytes {
                self.to_le_bytes()
            }
        }
    )+};
}

values!(u8, u16, u32, u64, i16, f32);

/// The SDO channel to one node.
pub struct Sdo<'a> {
    line: &'a mut Line,
    node: u8,
    index: u16,
    sub: u8,
}

impl<'a> Sdo<'a> {
    /// The default channel to this node.
    #[must_use]
    pub fn new(line: &'a mut Line, node: u8) -> Self {
        Self { line, node, index: 0, sub: 0 }
    }

    /// Reads a number.
    ///
    /// # Errors
    /// [`SdoError`], also where the object's length is not that of the type.
    pub fn read<T: Value>(&mut self, index: u16, sub: u8) -> Result<T, SdoError> {
        let bytes = self.upload(index, sub)?;
        let found = bytes.len();
        let bytes = T::Bytes::try_from(&bytes).map_err(|_| SdoError::Size {
            node: self.node,
            index,
            sub,
            expected: size_of::<T::Bytes>(),
            found,
        })?;
        Ok(T::from_bytes(bytes))
    }

    /// Reads a visible string.
    ///
    /// # Errors
    /// [`SdoError`].
    pub fn read_text(&mut self, index: u16, sub: u8) -> Result<String, SdoError> {
        let bytes = self.upload(index, sub)?;
        Ok(String::from_utf8_lossy(&bytes).trim_end_matches('\0').to_owned())
    }

    /// Writes a number.
    ///
    /// # Errors
    /// [`SdoError`].
    pub fn write<T: Value>(&mut self, index: u16, sub: u8, value: T) -> Result<(), SdoError> {
        self.download(index, sub, value.to_bytes().as_ref())
    }

    /// Reads an object, expedited or in segments as the node chooses.
    ///
    /// # Errors
    /// [`SdoError`].
    pub fn upload(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, SdoError> {
        self.retry(index, sub, |sdo| sdo.upload_once())
    }

    /// Writes an object of up to four bytes at once, a longer one in segments.
    ///
    /// # Errors
    /// [`SdoError`].
    pub fn download(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), SdoError> {
        self.retry(index, sub, |sdo| sdo.download_once(bytes))
    }

    /// Reads a long object in blocks; `progress` hears how many bytes have come, up to six of padding included.
    ///
    /// One attempt: whoever reads a recording decides what else must be asked anew.
    ///
    /// # Errors
    /// [`SdoError`]; the transfer is then closed on the node's side too.
    pub fn upload_blocks(&mut self, index: u16, sub: u8, progress: &mut dyn FnMut(usize)) -> Result<Vec<u8>, SdoError> {
        (self.index, self.sub) = (index, sub);
        self.line.quiet(self.node, PATIENCE)?;
        let result = self.blocks(progress);
        self.close_if_open(&result);
        result
    }

    /// Several attempts at a short transfer. What the node refuses is not asked again.
    fn retry<T>(
        &mut self,
        index: u16,
        sub: u8,
        mut once: impl FnMut(&mut Self) -> Result<T, SdoError>,
    ) -> Result<T, SdoError> {
        (self.index, self.sub) = (index, sub);
        let mut left = TRIES;
        loop {
            self.line.quiet(self.node, PATIENCE)?;
            let result = once(self);
            left -= 1;
            match &result {
                Err(SdoError::NoAnswer { .. } | SdoError::Torn { .. }) if left > 0 => {}
                // Another master's request can break ours off; after a quiet moment it works.
                Err(SdoError::Aborted { .. }) if left > 0 && self.line.shared(self.node, ANSWER) => {}
                _ => return result,
            }
            self.close_if_open(&result);
        }
    }

    /// After a failure that the node may not know of: abort its side, so that the next transfer begins afresh.
    fn close_if_open<T>(&mut self, result: &Result<T, SdoError>) {
        if matches!(result, Err(SdoError::NoAnswer { .. } | SdoError::Torn { .. })) {
            // If even this cannot be sent, the next request says why.
            let _ = self.send(SdoRequest::abort(self.index, self.sub, AbortCode::SdoTimeout));
        }
    }

    fn upload_once(&mut self) -> Result<Vec<u8>, SdoError> {
        self.send(SdoRequest::initiate_upload(self.index, self.sub))?;
        let (expedited, sized, unused, data) = loop {
            match self.response()? {
                SdoResponse::ConfirmUpload { n, e, s, index, sub, data } if self.is(index, sub) => {
                    break (e, s, n, data);
                }
                other => self.not_ours(&other)?,
            }
        };
        if expedited {
            let used = if sized { 4 - usize::from(unused) } else { 4 };
            return Ok(data[..used].to_vec());
        }
        let announced = sized.then(|| u32::from_le_bytes(data) as usize);
        if announced.is_some_and(|length| length > LONGEST) {
            return Err(self.torn(format!("{announced:?} bytes are announced")));
        }
        let mut bytes = Vec::with_capacity(announced.unwrap_or(0));
        let mut toggle = false;
        loop {
            self.send(SdoRequest::upload_segment_request(toggle))?;
            let last = loop {
                match self.response()? {
                    SdoResponse::UploadSegment { t, n, c, data } if t == toggle => {
                        bytes.extend_from_slice(&data[..7 - usize::from(n)]);
                        break c;
                    }
                    SdoResponse::UploadSegment { .. } => return Err(self.torn("a segment came twice or is missing")),
                    other => self.not_ours(&other)?,
                }
            };
            if last {
                break;
            }
            if bytes.len() > announced.unwrap_or(LONGEST) {
                return Err(self.torn("more bytes came than were announced"));
            }
            toggle = !toggle;
        }
        match announced {
            Some(length) if length != bytes.len() => {
                Err(self.torn(format!("{} bytes came, {length} were announced", bytes.len())))
            }
            _ => Ok(bytes),
        }
    }

    fn download_once(&mut self, bytes: &[u8]) -> Result<(), SdoError> {
        let expedited = (1..=4).contains(&bytes.len());
        self.send(if expedited {
            SdoRequest::expedited_download(self.index, self.sub, bytes)
        } else {
            SdoRequest::initiate_download(self.index, self.sub, Some(bytes.len() as u32))
        })?;
        loop {
            match self.response()? {
                SdoResponse::ConfirmDownload { index, sub } if self.is(index, sub) => break,
                other => self.not_ours(&other)?,
            }
        }
        if expedited {
            return Ok(());
        }
        let segments = bytes.chunks(7).count().max(1);
        for number in 0..segments {
            let toggle = number % 2 == 1;
            let segment = bytes.chunks(7).nth(number).unwrap_or(&[]);
            self.send(SdoRequest::download_segment(toggle, number + 1 == segments, segment))?;
            loop {
                match self.response()? {
                    SdoResponse::ConfirmDownloadSegment { t } if t == toggle => break,
                    SdoResponse::ConfirmDownloadSegment { .. } => {
                        return Err(self.torn("a segment was confirmed twice or got lost"));
                    }
                    other => self.not_ours(&other)?,
                }
            }
        }
        Ok(())
    }

    fn blocks(&mut self, progress: &mut dyn FnMut(usize)) -> Result<Vec<u8>, SdoError> {
        self.send(SdoRequest::initiate_block_upload(self.index, self.sub, true, BLOCK, 0))?;
        let (with_crc, announced) = loop {
            match self.response()? {
                SdoResponse::ConfirmBlockUpload { sc, s, index, sub, size } if self.is(index, sub) => {
                    break (sc, s.then_some(size as usize));
                }
                other => self.not_ours(&other)?,
            }
        };
        if announced.is_some_and(|length| length > LONGEST) {
            return Err(self.torn(format!("{announced:?} bytes are announced")));
        }
        let mut bytes = Vec::with_capacity(announced.unwrap_or(0) + 7);
        let most = announced.unwrap_or(LONGEST) + 7;

        self.send(SdoRequest::StartBlockUpload)?;
        loop {
            let (good, complete) = self.block(&mut bytes)?;
            progress(bytes.len());
            self.send(SdoRequest::ConfirmBlock { ackseq: good, blksize: BLOCK })?;
            if complete {
                break;
            }
            if bytes.len() > most {
                return Err(self.torn("more bytes came than were announced"));
            }
        }

        let (unused, crc) = loop {
            match self.response()? {
                SdoResponse::BlockUploadEnd { n, crc } => break (usize::from(n), crc),
                other => self.not_ours(&other)?,
            }
        };
        bytes.truncate(bytes.len().saturating_sub(unused));
        if let Some(length) = announced
            && length != bytes.len()
        {
            return Err(self.torn(format!("{} bytes came, {length} were announced", bytes.len())));
        }
        if with_crc && CRC.checksum(&bytes) != crc {
            return Err(self.torn("its CRC does not fit"));
        }
        self.send(SdoRequest::EndBlockUpload)?;
        Ok(bytes)
    }

    /// One block: the segments in order up to the first missing one are appended. Returns the last good number and
    /// whether the transfer is complete.
    fn block(&mut self, bytes: &mut Vec<u8>) -> Result<(u8, bool), SdoError> {
        let mut good = 0;
        loop {
            let Some(data) = self.line.answer(self.node, ANSWER)? else {
                // The end of the block got lost; what came in order is acknowledged, the rest comes again.
                if good > 0 {
                    return Ok((good, false));
                }
                return Err(self.no_answer());
            };
            let Ok(segment) = BlockSegment::try_from(data.as_slice()) else { continue };
            if segment.seqnum == 0 {
                // 0x80 with number 0 is no segment but an abort.
                match decode(data) {
                    Some(response) => self.not_ours(&response)?,
                    None => return Err(self.torn("a segment has number 0")),
                }
                continue;
            }
            let in_order = segment.seqnum == good + 1;
            if in_order {
                bytes.extend_from_slice(&segment.data);
                good = segment.seqnum;
            }
            if segment.c || segment.seqnum == BLOCK {
                return Ok((good, in_order && segment.c));
            }
        }
    }

    fn is(&self, index: u16, sub: u8) -> bool {
        (index, sub) == (self.index, self.sub)
    }

    /// An answer that does not belong to this step: an abort ends it, anything else was not for us.
    fn not_ours(&mut self, response: &SdoResponse) -> Result<(), SdoError> {
        match *response {
            // Index 0 comes from servers that do not know which transfer failed.
            SdoResponse::Abort { index, sub, abort_code } if self.is(index, sub) || (index, sub) == (0, 0) => {
                Err(SdoError::Aborted { node: self.node, index: self.index, sub: self.sub, code: abort_code })
            }
            _ => {
                self.line.unasked(self.node);
                Ok(())
            }
        }
    }

    fn send(&mut self, request: SdoRequest) -> Result<(), SdoError> {
        Ok(self.line.ask(self.node, request.to_bytes())?)
    }

    fn response(&mut self) -> Result<SdoResponse, SdoError> {
        let Some(data) = self.line.answer(self.node, ANSWER)? else { return Err(self.no_answer()) };
        decode(data).ok_or_else(|| self.torn(format!("0x{:02X} begins no answer", data[0])))
    }

    fn no_answer(&mut self) -> SdoError {
        self.line.give_up(self.node);
        SdoError::NoAnswer { node: self.node, index: self.index, sub: self.sub }
    }

    fn torn(&self, what: impl Into<String>) -> SdoError {
        SdoError::Torn { node: self.node, index: self.index, sub: self.sub, what: what.into() }
    }
}

/// An answer's meaning.
///
/// zencan-common 0.0.5 decodes all but one: in the answer to a block upload it takes the bit "size indicated" for a part of
/// the subcommand (CiA 301, figure 44: only bit 0 is).
fn decode(data: [u8; 8]) -> Option<SdoResponse> {
    const BLOCK_UPLOAD_BEGINS: u8 = 0xC0;
    if data[0] & 0xE1 == BLOCK_UPLOAD_BEGINS {
        return Some(SdoResponse::ConfirmBlockUpload {
            sc: data[0] & 4 != 0,
            s: data[0] & 2 != 0,
            index: u16::from_le_bytes([data[1], data[2]]),
            sub: data[3],
            size: u32::from_le_bytes([data[4], data[5], data[6], data[7]]),
        });
    }
    SdoResponse::try_from(data).ok()
}

/// An abort code in words, CiA 301 table 22.
fn abort_words(code: u32) -> &'static str {
    let Ok(code) = AbortCode::try_from(code) else { return "for a reason that CiA 301 does not list" };
    match code {
        AbortCode::ToggleNotAlternated => "the toggle bit did not alternate",
        AbortCode::SdoTimeout => "the transfer took too long",
        AbortCode::InvalidCommandSpecifier => "the request is not understood here",
        AbortCode::InvalidBlockSize => "the block size is invalid",
        AbortCode::InvalidSequenceNumber => "a sequence number is invalid",
        AbortCode::CrcError => "the CRC does not fit",
        AbortCode::OutOfMemory => "out of memory",
        AbortCode::UnsupportedAccess => "this access is not supported",
        AbortCode::WriteOnly => "it can only be written",
        AbortCode::ReadOnly => "it can only be read",
        AbortCode::NoSuchObject => "there is no such object",
        AbortCode::UnnallowedPdo => "it cannot be mapped into a PDO",
        AbortCode::PdoTooLong => "the PDO would become too long",
        AbortCode::IncompatibleParameter => "it does not go together with the other settings",
        AbortCode::HardwareError => "the hardware failed",
        AbortCode::DataTypeMismatch => "the length does not fit its type",
        AbortCode::DataTypeMismatchLengthHigh => "the value is too long",
        AbortCode::DataTypeMismatchLengthLow => "the value is too short",
        AbortCode::NoSuchSubIndex => "there is no such sub-index",
        AbortCode::InvalidValue => "the value is invalid",
        AbortCode::ValueTooHigh => "the value is too high",
        AbortCode::ValueTooLow => "the value is too low",
        AbortCode::ResourceNotAvailable => "what it needs is in use",
        AbortCode::GeneralError => "general error",
        AbortCode::CantStore => "it cannot be stored",
        AbortCode::CantStoreLocalControl => "it cannot be stored, the device is under local control",
        AbortCode::CantStoreDeviceState => "not in the present state of the device",
        AbortCode::NoObjectDict => "there is no object dictionary",
        AbortCode::NoData => "there is no data",
    }
}

//! The SDO server, CiA 301: expedited, segmented and block transfers, both ways, one at a time.
//!
//! ```text
//!            initiate             segment, confirm, …                end
//! Idle ──────────────▶ Upload / Download / BlockUpload / BlockDownload ──▶ Idle
//!   ▲                                   │ silence of TIMEOUT_MS, abort, wrong toggle, torn data
//!   └───────────────────────────────────┘
//! ```
//!
//! Messages are those of `zencan-common`; its server in `zencan-node` 0.0.5 is not used, because reading a curve of 28 KiB
//! is what this one is for, and that one
//! - gives up after 25 ms of silence, less than a master on a busy PC needs between two segments;
//! - panics when an object refuses a later piece (`read(..).unwrap()`), when a master aborts in the middle of a block
//!   (`todo!()`) and when it offers a block of 0 segments;
//! - repeats a block that was not confirmed from the wrong place, with a CRC counted twice;
//! - cuts seven bytes off every transfer whose length is a multiple of seven, and never ends one that is a multiple of 889.
//!
//! A master that vanishes blocks nobody: a new initiate request replaces an unfinished transfer at once, and after
//! [`TIMEOUT_MS`] the transfer is aborted anyway. A transfer whose data changed under it is aborted, never patched.

use heapless::Vec;
use zencan_common::sdo::{AbortCode, BlockSegment, SdoRequest, SdoResponse};

/// Silence after which a transfer is given up, ms.
pub const TIMEOUT_MS: u64 = 5_000;
/// Longest value that is copied at once when its upload begins, so that it cannot change meanwhile.
pub const VALUE: usize = 128;
/// Segments in a block that this server takes: a signed change of every setting and the key fits into it.
const DOWNLOAD_BLOCK: u8 = 26;
/// Longest value that can be written.
const LONGEST_WRITE: usize = DOWNLOAD_BLOCK as usize * SEGMENT;
/// Bytes in a segment.
const SEGMENT: usize = 7;

const CRC: crc::Crc<u16> = crc::Crc::<u16>::new(&crc::CRC_16_XMODEM);

/// What the server answers from.
pub trait Entries {
    /// Begins to read: copies a value, or tells the length of something longer that is then read in pieces.
    ///
    /// # Errors
    /// The abort code that the master gets.
    fn open(&mut self, index: u16, sub: u8, value: &mut [u8; VALUE]) -> Result<Opened, AbortCode>;

    /// Reads a piece of what [`Opened::Stream`] announced; fills `into`.
    ///
    /// # Errors
    /// The abort code that the master gets, [`AbortCode::CantStoreDeviceState`] when it is no longer what was opened.
    fn read(&mut self, stream: Stream, offset: u32, into: &mut [u8]) -> Result<(), AbortCode>;

    /// Writes a value whole.
    ///
    /// # Errors
    /// The abort code that the master gets.
    fn write(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), AbortCode>;

    /// Whether such a sub-object exists and may be written.
    ///
    /// # Errors
    /// The abort code that the master gets.
    fn writable(&self, index: u16, sub: u8) -> Result<(), AbortCode>;
}

/// An object that is being read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opened {
    /// The value was copied and has this length.
    Value(usize),
    /// It is read in pieces.
    Stream(Stream),
}

/// Something long that is read in pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stream {
    /// Which of its kind.
    pub slot: u8,
    /// Which content of it: another one means that it was overwritten.
    pub generation: u32,
    /// Bytes.
    pub length: u32,
}

#[derive(Debug)]
enum State {
    Idle,
    Upload {
        toggle: bool,
        offset: u32,
    },
    Download {
        toggle: bool,
    },
    BlockUpload(BlockUpload),
    BlockDownload {
        last: u8,
        crc: bool,
    },
    /// Everything came; the length of the last segment and the CRC are outstanding.
    BlockDownloadEnd {
        crc: bool,
    },
}

#[derive(Clone, Copy, Debug)]
struct BlockUpload {
    phase: Phase,
    /// First byte of the block that is being sent.
    base: u32,
    /// Segments of the block that have been sent.
    sent: u8,
    /// Segments in a block, as the master wishes.
    size: u8,
    /// CRC of the bytes before `crc_at`; repeated segments do not count twice.
    crc: u16,
    crc_at: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The length was announced; the master has to say start.
    Announced,
    /// Segments go out.
    Sending,
    /// A block is out; the master has to confirm.
    Sent,
    /// The end was said; the master has to confirm.
    Ending,
}

/// The server.
#[derive(Debug)]
pub struct SdoServer {
    state: State,
    index: u16,
    sub: u8,
    source: Opened,
    buffer: Vec<u8, LONGEST_WRITE>,
    heard_ms: u64,
}

impl Default for SdoServer {
    fn default() -> Self {
        Self::new()
    }
}

impl SdoServer {
    /// A server without a transfer.
    #[must_use]
    pub const fn new() -> Self {
        Self { state: State::Idle, index: 0, sub: 0, source: Opened::Value(0), buffer: Vec::new(), heard_ms: 0 }
    }

    /// Forgets the transfer, as a reset of communication does.
    pub fn reset(&mut self) {
        self.state = State::Idle;
    }

    /// Whether a transfer is under way.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        matches!(self.state, State::Idle)
    }

    /// What is being uploaded in pieces.
    #[must_use]
    pub fn stream(&self) -> Option<Stream> {
        match (&self.state, self.source) {
            (State::Upload { .. } | State::BlockUpload(_), Opened::Stream(stream)) => Some(stream),
            _ => None,
        }
    }

    /// Takes a request; the answer, if there is one.
    pub fn receive(&mut self, data: &[u8], now_ms: u64, entries: &mut impl Entries) -> Option<[u8; 8]> {
        // CiA 301: an SDO has eight bytes; others are ignored.
        let data: &[u8; 8] = data.try_into().ok()?;
        self.heard_ms = now_ms;
        let answer = match self.state {
            State::BlockDownload { last, crc } if data[0] != ABORT => self.block_segment(data, last, crc),
            _ => match SdoRequest::try_from(&data[..]) {
                Ok(request) => self.request(request, entries),
                // Answers to a vanished server's transfer may still be on their way; only a request deserves an abort.
                Err(code) => Err(code),
            },
        };
        match answer {
            Ok(response) => response.map(|response| response.to_bytes()),
            Err(code) => Some(self.abort(code)),
        }
    }

    /// Gives up a transfer whose master has fallen silent; the abort to be sent.
    pub fn expire(&mut self, now_ms: u64) -> Option<[u8; 8]> {
        let silent = now_ms.saturating_sub(self.heard_ms) >= TIMEOUT_MS;
        (silent && !self.is_idle()).then(|| self.abort(AbortCode::SdoTimeout))
    }

    /// Whether [`Self::segment`] has something to send.
    #[must_use]
    pub fn is_sending(&self) -> bool {
        matches!(self.state, State::BlockUpload(BlockUpload { phase: Phase::Sending, .. }))
    }

    /// The next segment of a block upload; called while there is room for frames.
    pub fn segment(&mut self, entries: &mut impl Entries) -> Option<[u8; 8]> {
        let State::BlockUpload(mut upload) = self.state else { return None };
        if upload.phase != Phase::Sending {
            return None;
        }
        let total = self.total();
        let offset = upload.base + u32::from(upload.sent) * SEGMENT as u32;
        let mut data = [0; SEGMENT];
        let length = (total - offset).min(SEGMENT as u32);
        let piece = &mut data[..length as usize];
        if let Err(code) = self.fill(offset, piece, entries) {
            return Some(self.abort(code));
        }
        if offset == upload.crc_at {
            upload.crc = crc_of(upload.crc, piece);
            upload.crc_at += length;
        }
        upload.sent += 1;
        let last = offset + length == total;
        if last || upload.sent == upload.size {
            upload.phase = Phase::Sent;
        }
        let seqnum = upload.sent;
        self.state = State::BlockUpload(upload);
        Some(BlockSegment { c: last, seqnum, data }.to_bytes())
    }

    fn abort(&mut self, code: AbortCode) -> [u8; 8] {
        self.state = State::Idle;
        SdoResponse::abort(self.index, self.sub, code).to_bytes()
    }

    fn total(&self) -> u32 {
        match self.source {
            Opened::Value(length) => length as u32,
            Opened::Stream(stream) => stream.length,
        }
    }

    fn fill(&self, offset: u32, into: &mut [u8], entries: &mut impl Entries) -> Result<(), AbortCode> {
        match self.source {
            Opened::Value(_) => {
                let offset = offset as usize;
                let piece = self.buffer.get(offset..offset + into.len()).ok_or(AbortCode::GeneralError)?;
                into.copy_from_slice(piece);
                Ok(())
            }
            Opened::Stream(stream) => entries.read(stream, offset, into),
        }
    }

    fn open(&mut self, index: u16, sub: u8, entries: &mut impl Entries) -> Result<u32, AbortCode> {
        let mut value = [0; VALUE];
        self.source = entries.open(index, sub, &mut value)?;
        if let Opened::Value(length) = self.source {
            self.buffer.clear();
            self.buffer.extend_from_slice(&value[..length]).map_err(|_| AbortCode::OutOfMemory)?;
        }
        Ok(self.total())
    }

    fn request(&mut self, request: SdoRequest, entries: &mut impl Entries) -> Result<Option<SdoResponse>, AbortCode> {
        match request {
            SdoRequest::InitiateUpload { index, sub } => {
                self.begin(index, sub);
                let total = self.open(index, sub, entries)?;
                if total <= 4 && total > 0 {
                    let mut data = [0; 4];
                    let piece = &mut data[..total as usize];
                    self.fill(0, piece, entries)?;
                    return Ok(Some(SdoResponse::expedited_upload(index, sub, piece)));
                }
                self.state = State::Upload { toggle: false, offset: 0 };
                Ok(Some(SdoResponse::upload_acknowledge(index, sub, Some(total))))
            }
            SdoRequest::InitiateDownload { n, e, s, index, sub, data } => {
                self.begin(index, sub);
                entries.writable(index, sub)?;
                if e {
                    // Without a size the master leaves the length to the object: four bytes is the most there can be.
                    let length = if s { 4 - usize::from(n) } else { 4 };
                    entries.write(index, sub, &data[..length])?;
                } else {
                    if s && u32::from_le_bytes(data) as usize > LONGEST_WRITE {
                        return Err(AbortCode::DataTypeMismatchLengthHigh);
                    }
                    self.buffer.clear();
                    self.state = State::Download { toggle: false };
                }
                Ok(Some(SdoResponse::download_acknowledge(index, sub)))
            }
            SdoRequest::InitiateBlockUpload { cc: _, index, sub, blksize, pst: _ } => {
                self.begin(index, sub);
                if blksize == 0 || blksize > 127 {
                    return Err(AbortCode::InvalidBlockSize);
                }
                let total = self.open(index, sub, entries)?;
                if total == 0 {
                    return Err(AbortCode::NoData);
                }
                self.state = State::BlockUpload(BlockUpload {
                    phase: Phase::Announced,
                    base: 0,
                    sent: 0,
                    size: blksize,
                    crc: 0,
                    crc_at: 0,
                });
                // Without the length, which CiA 301 leaves open: zencan-common 0.0.5 reads an answer with it as malformed, and
                // so do the masters that are built on it.
                Ok(Some(SdoResponse::block_upload_acknowledge(index, true, sub, None)))
            }
            SdoRequest::InitiateBlockDownload { cc, s, index, sub, size } => {
                self.begin(index, sub);
                entries.writable(index, sub)?;
                if s && size as usize > LONGEST_WRITE {
                    return Err(AbortCode::DataTypeMismatchLengthHigh);
                }
                self.buffer.clear();
                self.state = State::BlockDownload { last: 0, crc: cc };
                Ok(Some(SdoResponse::block_download_acknowledge(true, index, sub, DOWNLOAD_BLOCK)))
            }
            // An abort is never answered, least of all with an abort.
            SdoRequest::Abort { .. } => {
                self.state = State::Idle;
                Ok(None)
            }
            request => self.proceed(request, entries),
        }
    }

    fn begin(&mut self, index: u16, sub: u8) {
        self.state = State::Idle;
        (self.index, self.sub) = (index, sub);
    }

    fn proceed(&mut self, request: SdoRequest, entries: &mut impl Entries) -> Result<Option<SdoResponse>, AbortCode> {
        match (&mut self.state, request) {
            (State::Upload { toggle, offset }, SdoRequest::ReqUploadSegment { t }) => {
                if t != *toggle {
                    return Err(AbortCode::ToggleNotAlternated);
                }
                let from = *offset;
                let mut data = [0; SEGMENT];
                let total = self.total();
                let length = (total - from).min(SEGMENT as u32);
                self.fill(from, &mut data[..length as usize], entries)?;
                let last = from + length == total;
                self.state = if last { State::Idle } else { State::Upload { toggle: !t, offset: from + length } };
                Ok(Some(SdoResponse::upload_segment(t, last, &data[..length as usize])))
            }
            (State::Download { toggle }, SdoRequest::DownloadSegment { t, n, c, data }) => {
                if t != *toggle {
                    return Err(AbortCode::ToggleNotAlternated);
                }
                *toggle = !t;
                let piece = &data[..SEGMENT - usize::from(n.min(7))];
                self.buffer.extend_from_slice(piece).map_err(|_| AbortCode::DataTypeMismatchLengthHigh)?;
                if c {
                    self.state = State::Idle;
                    entries.write(self.index, self.sub, &self.buffer)?;
                }
                Ok(Some(SdoResponse::download_segment_acknowledge(t)))
            }
            (State::BlockDownloadEnd { crc }, SdoRequest::EndBlockDownload { n, crc: sent }) => {
                let length = self.buffer.len().saturating_sub(usize::from(n));
                self.buffer.truncate(length);
                if *crc && crc_of(0, &self.buffer) != sent {
                    return Err(AbortCode::CrcError);
                }
                self.state = State::Idle;
                entries.write(self.index, self.sub, &self.buffer)?;
                Ok(Some(SdoResponse::ConfirmBlockDownloadEnd))
            }
            (State::BlockUpload(upload), request) => {
                let mut upload = *upload;
                let response = self.block_upload(&mut upload, request)?;
                if !self.is_idle() {
                    self.state = State::BlockUpload(upload);
                }
                Ok(response)
            }
            // Nothing is open: what comes belongs to a transfer that was given up.
            _ => Err(AbortCode::InvalidCommandSpecifier),
        }
    }

    fn block_upload(
        &mut self,
        upload: &mut BlockUpload,
        request: SdoRequest,
    ) -> Result<Option<SdoResponse>, AbortCode> {
        match (upload.phase, request) {
            (Phase::Announced, SdoRequest::StartBlockUpload) => {
                upload.phase = Phase::Sending;
                Ok(None)
            }
            // A master may confirm early when it has seen a gap; the rest of the block is then not sent.
            (Phase::Sent | Phase::Sending, SdoRequest::ConfirmBlock { ackseq, blksize }) => {
                if blksize == 0 || blksize > 127 {
                    return Err(AbortCode::InvalidBlockSize);
                }
                if ackseq > upload.sent {
                    return Err(AbortCode::InvalidSequenceNumber);
                }
                upload.base = (upload.base + u32::from(ackseq) * SEGMENT as u32).min(self.total());
                upload.sent = 0;
                upload.size = blksize;
                if upload.base < self.total() {
                    upload.phase = Phase::Sending;
                    return Ok(None);
                }
                upload.phase = Phase::Ending;
                // Bytes of the last segment that carry nothing.
                let n = (SEGMENT as u32 - self.total() % SEGMENT as u32) % SEGMENT as u32;
                Ok(Some(SdoResponse::BlockUploadEnd { n: n as u8, crc: upload.crc }))
            }
            (Phase::Ending, SdoRequest::EndBlockUpload) => {
                self.state = State::Idle;
                Ok(None)
            }
            _ => Err(AbortCode::InvalidCommandSpecifier),
        }
    }

    fn block_segment(&mut self, data: &[u8; 8], last: u8, crc: bool) -> Result<Option<SdoResponse>, AbortCode> {
        let (complete, sequence) = (data[0] & 0x80 != 0, data[0] & 0x7F);
        if sequence == 0 || sequence > DOWNLOAD_BLOCK {
            return Err(AbortCode::InvalidSequenceNumber);
        }
        let mut in_order = last;
        if sequence == last + 1 {
            self.buffer.extend_from_slice(&data[1..]).map_err(|_| AbortCode::DataTypeMismatchLengthHigh)?;
            in_order = sequence;
        }
        let finished = complete && in_order == sequence;
        self.state = if finished {
            State::BlockDownloadEnd { crc }
        } else if sequence == DOWNLOAD_BLOCK && in_order == sequence {
            // A full block and no end: longer than anything that can be written.
            return Err(AbortCode::DataTypeMismatchLengthHigh);
        } else {
            State::BlockDownload { last: in_order, crc }
        };
        if !complete && sequence != DOWNLOAD_BLOCK {
            return Ok(None);
        }
        // After a gap the master begins the next block, counted from 1 again, with the segment after the last good one.
        if !finished {
            self.state = State::BlockDownload { last: 0, crc };
        }
        Ok(Some(SdoResponse::ConfirmBlock { ackseq: in_order, blksize: DOWNLOAD_BLOCK }))
    }
}

/// First byte of an abort; no segment begins with it, since none has the number 0.
const ABORT: u8 = 0x80;

fn crc_of(crc: u16, bytes: &[u8]) -> u16 {
    let mut digest = CRC.digest_with_initial(crc);
    digest.update(bytes);
    digest.finalize()
}

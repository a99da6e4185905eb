//! Captured force curves, downloaded whole or not at all.
//!
//! ```text
//! header (impact, length, CRC …) ─▶ curve in blocks ─▶ length and CRC fit? ─▶ still the same impact? ─▶ Curve
//!     ▲                                  │ torn             │ no                   │ overwritten
//!     └──────────────────────────────────┴──────────────────┴──── fetched again, a few times
//! ```
//!
//! What arrives damaged is thrown away and fetched again; nothing is patched.

use thud_firmware::dictionary::index;
use thud_firmware::units::{Hertz, Newton};

use super::sdo::SdoError;
use super::{Client, ClientError};

/// Slots of the sensor: 0x2300 and 0x2301.
pub const SLOTS: u16 = 2;
/// A curve is fetched so often before it is given up.
pub const TRIES: u32 = 5;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// A captured force curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The impact it shows.
    pub impact: u32,
    /// Number of its first sample since power-up.
    pub first_index: u64,
    /// Number of the sample at which the onset was seen.
    pub onset_index: u64,
    /// Samples per second.
    pub sample_rate: Hertz,
    /// Force of one ADC code.
    pub newton_per_code: f32,
    /// Code at no force when the impact began.
    pub zero_code: f32,
    /// Configuration it was captured with.
    pub configuration_revision: u32,
    /// Its hash.
    pub configuration_hash: u32,
    /// ADC codes.
    pub codes: Vec<u16>,
    /// How often it had to be fetched again because it came damaged.
    pub refetched: u32,
}

impl Curve {
    /// The force of each sample.
    pub fn forces(&self) -> impl Iterator<Item = Newton> + '_ {
        self.codes.iter().map(|code| Newton((f32::from(*code) - self.zero_code) * self.newton_per_code))
    }

    /// Time of each sample on the sensor's own axis, seconds since power-up.
    pub fn times_s(&self) -> impl Iterator<Item = f64> + '_ {
        let rate = f64::from(self.sample_rate.0);
        (0..self.codes.len() as u64).map(move |offset| (self.first_index + offset) as f64 / rate)
    }
}

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Header {
    impact: u32,
    length: u32,
    crc: u32,
}

impl Client {
    /// The impacts whose curves a node holds now, oldest first, with their slots.
    ///
    /// # Errors
    /// [`ClientError::Sdo`].
    pub fn stored_curves(&mut self, node: u8) -> Result<Vec<(u32, u16)>, ClientError> {
        let mut stored = Vec::new();
        for slot in 0..SLOTS {
            if let Some(header) = self.header(node, slot)? {
                stored.push((header.impact, slot));
            }
        }
        stored.sort_unstable();
        Ok(stored)
    }

    /// Downloads the curve of an impact; `progress` hears bytes that came and bytes there are. `None` when the slot
    /// holds another impact by now: it was overwritten.
    ///
    /// # Errors
    /// [`ClientError::Recording`] when it came damaged [`TRIES`] times.
    pub fn download_curve(
        &mut self,
        node: u8,
        slot: u16,
        impact: u32,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Option<Curve>, ClientError> {
        let mut last = String::new();
        for attempt in 0..TRIES {
            let Some(header) = self.header(node, slot)?.filter(|header| header.impact == impact) else {
                return Ok(None);
            };
            match self.fetch(node, slot, header, progress) {
                // What was overwritten meanwhile carries another impact's number now.
                Ok(_) if self.header(node, slot)?.map(|header| header.impact) != Some(impact) => return Ok(None),
                Ok(curve) => return Ok(Some(Curve { refetched: attempt, ..curve })),
                Err(ClientError::Sdo(error @ (SdoError::Torn { .. } | SdoError::NoAnswer { .. }))) => {
                    last = error.to_string();
                }
                // Overwritten, or another master came in between: the header tells at the next attempt.
                Err(ClientError::Sdo(error @ SdoError::Aborted { .. })) => last = error.to_string(),
                Err(error) => return Err(error),
            }
        }
        Err(ClientError::Recording { node, impact, tries: TRIES, last })
    }

    fn header(&mut self, node: u8, slot: u16) -> Result<Option<Header>, ClientError> {
        let object = index::RECORDING + slot;
        let mut sdo = self.sdo(node);
        if sdo.read::<u8>(object, 1)? == 0 {
            return Ok(None);
        }
        Ok(Some(Header { impact: sdo.read(object, 2)?, length: sdo.read(object, 4)?, crc: sdo.read(object, 5)? }))
    }

    fn fetch(
        &mut self,
        node: u8,
        slot: u16,
        header: Header,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Curve, ClientError> {
        let object = index::RECORDING + slot;
        let mut sdo = self.sdo(node);
        let curve = Curve {
            impact: header.impact,
            first_index: sdo.read(object, 3)?,
            sample_rate: Hertz(sdo.read(object, 6)?),
            newton_per_code: sdo.read(object, 7)?,
            zero_code: sdo.read(object, 8)?,
            onset_index: sdo.read(object, 9)?,
            configuration_revision: sdo.read(object, 10)?,
            configuration_hash: sdo.read(object, 11)?,
            codes: Vec::new(),
            refetched: 0,
        };
        let length = header.length as usize * 2;
        let bytes = sdo.upload_blocks(object, 12, &mut |come| progress(come.min(length), length))?;
        let torn = |what: String| SdoError::Torn { node, index: object, sub: 12, what };
        if bytes.len() != length {
            return Err(torn(format!("{} bytes came for {} samples", bytes.len(), header.length)).into());
        }
        if CRC.checksum(&bytes) != header.crc {
            return Err(torn("its CRC-32 does not fit".to_owned()).into());
        }
        let codes = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        Ok(Curve { codes, ..curve })
    }
}

//! A value of the dictionary as bytes, and back.

use zencan_common::sdo::AbortCode;

/// A value with its type on the wire.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "named after the type they hold")]
pub enum Value {
    U8(u8),
    U16(u16),
    U32(u32),
    U64(u64),
    F32(f32),
    Text(&'static str),
    /// These bytes of an array, as many as said.
    Bytes([u8; 8], u8),
}

impl Value {
    /// Copies the bytes and returns how many.
    pub fn write_to(self, into: &mut [u8]) -> usize {
        match self {
            Self::U8(value) => put(into, &[value]),
            Self::U16(value) => put(into, &value.to_le_bytes()),
            Self::U32(value) => put(into, &value.to_le_bytes()),
            Self::U64(value) => put(into, &value.to_le_bytes()),
            Self::F32(value) => put(into, &value.to_le_bytes()),
            Self::Text(text) => put(into, text.as_bytes()),
            Self::Bytes(bytes, length) => put(into, &bytes[..usize::from(length.min(8))]),
        }
    }
}

fn put(into: &mut [u8], bytes: &[u8]) -> usize {
    let length = bytes.len().min(into.len());
    into[..length].copy_from_slice(&bytes[..length]);
    length
}

/// The bytes of a value of fixed length.
///
/// # Errors
/// The abort code that says whether there were too few or too many.
pub fn exactly<const N: usize>(data: &[u8]) -> Result<[u8; N], AbortCode> {
    data.try_into().map_err(|_| {
        if data.len() < N { AbortCode::DataTypeMismatchLengthLow } else { AbortCode::DataTypeMismatchLengthHigh }
    })
}

/// See [`exactly`].
///
/// # Errors
/// See [`exactly`].
pub fn u8_from(data: &[u8]) -> Result<u8, AbortCode> {
    exactly(data).map(u8::from_le_bytes)
}

/// See [`exactly`].
///
/// # Errors
/// See [`exactly`].
pub fn u16_from(data: &[u8]) -> Result<u16, AbortCode> {
    exactly(data).map(u16::from_le_bytes)
}

/// See [`exactly`].
///
/// # Errors
/// See [`exactly`].
pub fn u32_from(data: &[u8]) -> Result<u32, AbortCode> {
    exactly(data).map(u32::from_le_bytes)
}

/// See [`exactly`].
///
/// # Errors
/// See [`exactly`].
pub fn f32_from(data: &[u8]) -> Result<f32, AbortCode> {
    exactly(data).map(f32::from_le_bytes)
}

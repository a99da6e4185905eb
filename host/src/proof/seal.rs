//! Answers under lock and key until everything is said.
//!
//! ChaCha20-Poly1305 (RFC 8439) under a key from the operating system's randomness, used for one text only, so that its nonce may
//! be zero. The key lives in this process and nowhere else; a run that is interrupted loses it, and draws its answers anew.

use chacha20poly1305::aead::Aead as _;
use chacha20poly1305::{ChaCha20Poly1305, Key, KeyInit as _, Nonce};
use rand::TryRng as _;
use sha2::{Digest as _, Sha256};

/// A key that nobody else has.
pub struct Seal(ChaCha20Poly1305);

/// What is wrong with a sealed text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, miette::Diagnostic)]
pub enum SealError {
    /// There was no key to be had.
    #[error("the operating system gives no random numbers, so that nothing can be sealed")]
    NoRandomness,
    /// It is not what was sealed.
    #[error("what was sealed has been changed since: nothing of this run counts; begin anew in another folder")]
    Broken,
}

impl Seal {
    /// Draws a key.
    ///
    /// # Errors
    /// [`SealError::NoRandomness`].
    pub fn draw() -> Result<Self, SealError> {
        let mut key = [0; 32];
        rand::rngs::SysRng.try_fill_bytes(&mut key).map_err(|_| SealError::NoRandomness)?;
        Ok(Self(ChaCha20Poly1305::new(&Key::from(key))))
    }

    /// `text` sealed.
    ///
    /// # Errors
    /// [`SealError::Broken`] for a text of 256 GiB or more, which this cipher does not take.
    pub fn close(&self, text: &[u8]) -> Result<Vec<u8>, SealError> {
        self.0.encrypt(&Nonce::default(), text).map_err(|_| SealError::Broken)
    }

    /// What was sealed.
    ///
    /// # Errors
    /// [`SealError::Broken`].
    pub fn open(&self, sealed: &[u8]) -> Result<Vec<u8>, SealError> {
        self.0.decrypt(&Nonce::default(), sealed).map_err(|_| SealError::Broken)
    }
}

/// SHA-256 in hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A seed that nobody chose.
///
/// # Errors
/// [`SealError::NoRandomness`].
pub fn seed() -> Result<u64, SealError> {
    rand::rngs::SysRng.try_next_u64().map_err(|_| SealError::NoRandomness)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sealed_cannot_be_read_or_changed() {
        let seal = Seal::draw().unwrap();
        let text = b"case 7 hides guide-friction";
        let mut sealed = seal.close(text).unwrap();
        assert!(!sealed.windows(5).any(|w| text.windows(5).any(|t| t == w)));
        assert_eq!(seal.open(&sealed).unwrap(), text);
        assert_eq!(Seal::draw().unwrap().open(&sealed), Err(SealError::Broken));
        sealed[3] ^= 1;
        assert_eq!(seal.open(&sealed), Err(SealError::Broken));
    }

    #[test]
    fn the_hash_is_that_of_the_standard() {
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}

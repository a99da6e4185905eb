//! A key of the configuration lock in a file: 32 hexadecimal digits, as `openssl rand -hex 16` writes them.

use std::io::{ErrorKind, Write as _};
use std::path::Path;

use rand::TryRng as _;
use thud_firmware::configuration_lock::{KEY, Key};

use crate::input::InputError;

const REMEDY: &str = "a key is 32 hexadecimal digits that are not all zero, as `thud configure --lock FILE` or `openssl rand -hex 16` make it";

/// Reads a key.
///
/// # Errors
/// The file, and what a key looks like. The words never show what was in it.
pub fn read(path: &Path) -> Result<Key, InputError> {
    let text = std::fs::read_to_string(path).map_err(|error| InputError::unreadable(path, &error))?;
    parse(&text).ok_or_else(|| InputError::whole(&path.display().to_string(), "is no key", REMEDY))
}

/// Reads a key, or draws one from the operating system's randomness and writes it, for its owner only, where there is no such file.
///
/// # Errors
/// As [`read`]; or the file cannot be written.
pub fn read_or_draw(path: &Path) -> Result<Key, InputError> {
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let unwritable = |error: std::io::Error| {
        InputError::whole(&path.display().to_string(), format!("cannot be written: {error}"), "choose another place")
    };
    let mut file = match options.open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::AlreadyExists => return read(path),
        Err(error) => return Err(unwritable(error)),
    };
    let mut key = [0; KEY];
    rand::rngs::SysRng.try_fill_bytes(&mut key).map_err(|error| unwritable(std::io::Error::other(error)))?;
    let digits: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
    writeln!(file, "{digits}").map_err(unwritable)?;
    Ok(key)
}

fn parse(text: &str) -> Option<Key> {
    let digits = text.trim();
    let sound = digits.len() == 2 * KEY && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let mut key = [0; KEY];
    for (byte, at) in key.iter_mut().zip((0..).step_by(2)) {
        *byte = u8::from_str_radix(digits.get(at..at + 2).filter(|_| sound)?, 16).ok()?;
    }
    // Zeros stand for no key.
    (key != [0; KEY]).then_some(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_key_is_a_key() {
        assert_eq!(
            parse(" 000102030405060708090A0b0c0d0e0f\n"),
            Some([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
        );
        for wrong in [
            "",
            "00",
            "000102030405060708090A0b0c0d0e0",
            "+00102030405060708090A0b0c0d0e0f",
            &"0".repeat(32),
            "ÄÄÄÄÄÄÄÄÄÄÄÄÄÄÄÄ",
        ] {
            assert_eq!(parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_key_is_drawn_once_and_then_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lab.key");
        let drawn = read_or_draw(&path).unwrap();
        assert_eq!(read_or_draw(&path).unwrap(), drawn);
        assert_eq!(read(&path).unwrap(), drawn);
        std::fs::remove_file(&path).unwrap();
        let error = read(&path).unwrap_err();
        assert!(error.file().ends_with("lab.key"));
    }
}

//! Standard output, which may end before the program does: `thud monitor | head -3`.
//!
//! That nobody reads any more is a wish to end, like Ctrl-C: a command that waits ends, and what it gathered is still written
//! to its files. It is no fault, so the exit status is that of a command that ran.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write as _};

use crate::interrupt;

/// Writes bytes; what cannot be written because nobody reads is dropped.
///
/// # Errors
/// Any other reason, such as a full disk.
pub fn write(bytes: &[u8]) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {
            interrupt::ask();
            Ok(())
        }
        result => result,
    }
}

/// Writes the text of `say!`.
///
/// # Panics
/// When standard output cannot be written, other than because nobody reads it: `println!` would, too.
pub fn say(text: Arguments<'_>) {
    write(text.to_string().as_bytes()).unwrap_or_else(|error| panic!("standard output cannot be written: {error}"));
}

/// `println!`, but for a reader who has gone.
#[macro_export]
macro_rules! say {
    () => { $crate::standard_output::say(format_args!("\n")) };
    ($($part:tt)*) => { $crate::standard_output::say(format_args!("{}\n", format_args!($($part)*))) };
}

//! `thud`, the command line.
//!
//! This file only chooses the command, each of which is one file in [`thud::command`], and turns what became of it into
//! an exit status:
//!
//! | status | |
//! |---|---|
//! | 0 | it ran, whatever the verdict |
//! | 1 | a fault of the program itself |
//! | 2 | the input is unusable, something refused, or nothing answers |

use std::process::ExitCode;

/// A fault of the program itself.
const INTERNAL: u8 = 1;
/// Unusable input, a refusal, no answer; also what clap exits with.
const REFUSED: u8 = 2;

fn main() -> ExitCode {
    // The panic's own message is on standard error by then.
    match std::panic::catch_unwind(|| thud::command::Thud::from_arguments().run()) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(report)) => {
            // As `fn main() -> miette::Result<()>` would.
            eprintln!("Error: {report:?}");
            ExitCode::from(REFUSED)
        }
        Err(_) => {
            eprintln!("This is a fault of thud itself, not of what it was given.");
            ExitCode::from(INTERNAL)
        }
    }
}

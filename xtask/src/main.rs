//! The project's chores, as `cargo xtask CHORE`.
//!
//! `cargo xtask test` is the one command that passes all tests on a fresh machine; it installs what it lacks.

mod addresses;
mod dictionary;
mod emulator;
mod flashing;
mod mechanisms;
mod packages;
mod peers;
mod python;
mod qemu;
mod rigs;
mod size;
mod step;
mod stories;
mod target;
mod test;
mod vcan;

use std::process::ExitCode;

const HELP: &str = "\
Usage: cargo xtask CHORE

Chores:
  test                 format, lints, documentation and all tests; installs what they need into target/
  target               find a compiler for the board's processor, or install it
  size                 build the firmware for the board; its flash and memory beside the budget
  flashing             check that `cargo flash` calls probe-rs as it should; neither a board nor probe-rs is needed
  emulator             run the firmware's ELF file on an emulated board, with all its tests
  qemu                 the logic on a Cortex-M4F in QEMU: the desktop's events bit for bit, instructions a sample
  vcan                 SocketCAN and can-utils on virtual buses; brings a kernel along where this one has no CAN
  where ADDRESS...     the places in the source that the addresses of a panic record mean
  dictionary           write docs/can/ (EDS, DBC, object table) from the firmware's object dictionary
  dictionary NODE...   print a DBC file for sensors with these node ids (1 to 127, or 0x01 to 0x7F)
  mechanisms           write docs/mechanisms.md from the list of mechanisms
  peers DIR            other people's methods on the cases of a run of `thud prove`, in their own Python environment
  rigs DIR ...         campaigns of another simulator, diagnosed and scored; --seed, --cases, --kind and --effect are its options
  stories              make the telling cases of docs/proof/ anew
  tables               remake the tables of the README (accuracy, speed, board); takes an hour and more
";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let outcome = match arguments.next().as_deref() {
        Some("test") => test::run(),
        Some("target") => target::toolchain().map(|found| {
            if let Some(toolchain) = found {
                println!("compiler for the board: {toolchain:?}");
            }
        }),
        Some("size") => target::toolchain().and_then(|found| found.map_or(Ok(()), size::run)),
        Some("flashing") => target::toolchain().and_then(|found| found.map_or(Ok(()), flashing::check)),
        Some("emulator") => target::toolchain().and_then(|found| found.map_or(Ok(()), emulator::run)),
        Some("qemu") => target::toolchain().and_then(|found| found.map_or(Ok(()), qemu::run)),
        Some("vcan") => vcan::run(),
        Some("where") => addresses::run(&arguments.collect::<Vec<_>>()),
        Some("tables") => test::tables(),
        Some("dictionary") => dictionary::run(&arguments.collect::<Vec<_>>()),
        Some("peers") => peers::run(&arguments.collect::<Vec<_>>()),
        Some("rigs") => rigs::run(&arguments.collect::<Vec<_>>()),
        Some("stories") => stories::run(),
        Some("mechanisms") => mechanisms::run(),
        Some("help" | "--help" | "-h") | None => {
            print!("{HELP}");
            return ExitCode::SUCCESS;
        }
        Some(unknown) => Err(format!("there is no chore `{unknown}`\n\n{HELP}")),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

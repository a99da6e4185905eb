//! `cargo xtask qemu`: the sensor's logic on a Cortex-M4F in QEMU, beside the desktop, with its instructions counted.

use std::path::PathBuf;
use std::process::Command;

use crate::target::{TARGET, Toolchain, built};
use crate::{packages, step};

/// What Debian calls what is needed, and the commands that tell whether it is there.
const NEEDED: [(&str, &str); 2] = [("qemu-system-arm", "qemu-system-arm"), ("gcc-arm-none-eabi", "arm-none-eabi-gcc")];

/// Installs what is missing if it may, and builds the program; its place. `None`: it may not, and has said so.
///
/// # Errors
/// When installing or building fails, or when nothing may be left out (`CI=true`).
pub fn program(toolchain: Toolchain) -> Result<Option<PathBuf>, String> {
    let missing: Vec<&str> = NEEDED
        .into_iter()
        .filter(|(_, command)| !step::works(Command::new(command).arg("--version")))
        .map(|(package, _)| package)
        .collect();
    if !missing.is_empty() {
        if !packages::may_install() {
            packages::left_out(&format!(
                "the logic is not run on a Cortex-M4F; missing: {}. As root on Debian, `cargo xtask qemu` installs it.",
                missing.join(", ")
            ))?;
            return Ok(None);
        }
        packages::install("QEMU", &missing)?;
    }
    let mut build = toolchain.cargo("build");
    step::run("program for QEMU", build.args(["--profile", "board", "--package", "thud-cortex-m4", "--quiet"]))?;
    Ok(Some(built("thud-cortex-m4")))
}

/// Builds the program, runs it, compares and shows the table.
///
/// # Errors
/// When the events differ or a sample takes too many instructions.
pub fn run(toolchain: Toolchain) -> Result<(), String> {
    let Some(program) = program(toolchain)? else { return Ok(()) };
    let mut test =
        step::cargo(&["test", "--quiet", "--package", "thud-cortex-m4", "--test", "qemu", "--", "--nocapture"]);
    step::run(&format!("QEMU ({TARGET})"), test.env("THUD_CORTEX_M4", program))
}

//! `cargo xtask emulator`: the firmware's ELF file on an emulated board, all its tests.
//!
//! ```text
//! cmake, libclang ─▶ firmware ─▶ host tool ─▶ lints and tests of tests/emulator
//!   missing       ──▶ installed where that is permitted; else left out and said, which with CI=true is a failure
//! ```

use std::env;

use crate::target::Toolchain;
use crate::{packages, size, step};

/// What the emulated processor, a C library, is built with. `libclang-dev` is the distribution's usual version.
const PACKAGES: [&str; 3] = ["cmake", "pkg-config", "libclang-dev"];
const PACKAGE: [&str; 4] = ["--package", "thud-emulator", "--features", "unicorn"];

/// Builds what is needed and runs the tests.
///
/// # Errors
/// The first step that fails, or what is missing when nothing may be left out (`CI=true`).
pub fn run(toolchain: Toolchain) -> Result<(), String> {
    if !has_tools()? {
        return Ok(());
    }
    size::build(toolchain)?;
    let with = |chore: &[&str]| step::cargo(&[chore, &PACKAGE].concat());
    step::run("emulator: lints", with(&["clippy", "--all-targets", "--quiet"]).args(["--", "-D", "warnings"]))?;
    step::run("emulator: host tool", &mut step::cargo(&["build", "--package", "thud", "--quiet"]))?;
    let mut tests = if step::works(&mut step::cargo(&["nextest", "--version"])) {
        with(&["nextest", "run", "--no-fail-fast"])
    } else {
        with(&["test", "--lib", "--tests", "--no-fail-fast"])
    };
    step::run("emulator: tests", &mut tests)?;
    // The tests have seen how deep the stack gets.
    size::run(toolchain)
}

/// The latency of the alarm over a thousand impacts.
///
/// # Errors
/// As [`run`].
pub fn table(toolchain: Toolchain) -> Result<(), String> {
    if !has_tools()? {
        return Ok(());
    }
    size::build(toolchain)?;
    let mut bench = step::cargo(&[&["bench"], &PACKAGE[..], &["--bench", "alarm_latency"]].concat());
    step::run("tables: alarm latency", &mut bench)
}

/// Whether cmake and libclang are there; installs them if it may.
fn has_tools() -> Result<bool, String> {
    if missing().is_empty() {
        return Ok(true);
    }
    if packages::may_install() {
        packages::install("emulator", &PACKAGES)?;
    }
    let missing = missing();
    if missing.is_empty() {
        return Ok(true);
    }
    packages::left_out(&format!(
        "the firmware is not run in the emulator; missing: {}.\n\
         As root on Debian, `cargo xtask emulator` installs it. Elsewhere: cmake, pkg-config and LLVM with libclang.",
        missing.join(", ")
    ))?;
    Ok(false)
}

fn missing() -> Vec<&'static str> {
    let mut missing = Vec::new();
    if !step::works(&mut step::command("cmake", &["--version"])) {
        missing.push("cmake");
    }
    if !has_libclang() {
        missing.push("libclang");
    }
    missing
}

/// Where bindgen finds it: named by hand, or a library of the system.
fn has_libclang() -> bool {
    if env::var_os("LIBCLANG_PATH").is_some() || step::works(&mut step::command("llvm-config", &["--version"])) {
        return true;
    }
    let system = step::command("ldconfig", &["-p"]).output();
    system.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains("libclang"))
}

//! `cargo xtask emulator`: the firmware's ELF file on an emulated board, all its tests.
//!
//! ```text
//! compiler for the board? cmake and libclang? ─▶ firmware ─▶ host tool ─▶ lints and tests of tests/emulator
//!   missing, and we are root ──▶ installed
//!   missing, and we are not  ──▶ left out, said; with CI=true that is a failure
//! ```

use std::env;

use crate::target::{self, Toolchain};
use crate::{size, step};

/// What the emulated processor, a C library, is built with. `libclang-dev` is the distribution's usual version.
const PACKAGES: [&str; 3] = ["cmake", "pkg-config", "libclang-dev"];
const PACKAGE: [&str; 4] = ["--package", "thud-emulator", "--features", "unicorn"];

/// Builds what is needed and runs the tests.
///
/// # Errors
/// The first step that fails, or what is missing when nothing may be left out (`CI=true`).
pub fn run() -> Result<(), String> {
    let Some(toolchain) = target::toolchain()? else { return Ok(()) };
    if !has_tools()? {
        return Ok(());
    }
    test(toolchain)
}

fn test(toolchain: Toolchain) -> Result<(), String> {
    size::build(toolchain)?;
    let with = |chore: &[&str]| step::cargo(&[chore, &PACKAGE].concat());
    step::run("emulator: lints", with(&["clippy", "--all-targets", "--quiet"]).args(["--", "-D", "warnings"]))?;
    step::run("emulator: host tool", &mut step::cargo(&["build", "--package", "thud", "--quiet"]))?;
    let mut tests = if step::works(&mut step::cargo(&["nextest", "--version"])) {
        with(&["nextest", "run", "--no-fail-fast"])
    } else {
        with(&["test", "--lib", "--tests", "--no-fail-fast"])
    };
    step::run("emulator: tests", &mut tests)
}

/// Whether cmake and libclang are there; installs them if it may.
fn has_tools() -> Result<bool, String> {
    if missing().is_empty() {
        return Ok(true);
    }
    if target::may_install() {
        let mut arguments = vec!["install", "-y", "-qq", "--no-install-recommends"];
        arguments.extend(PACKAGES);
        let mut install = step::command("apt-get", &arguments);
        install.env("DEBIAN_FRONTEND", "noninteractive");
        if step::run("emulator: packages", &mut install).is_err() {
            step::run("emulator: lists of packages", &mut step::command("apt-get", &["update", "-qq"]))?;
            step::run("emulator: packages", &mut install)?;
        }
    }
    let missing = missing();
    if missing.is_empty() {
        return Ok(true);
    }
    let left_out = format!(
        "the firmware is not run in the emulator: {} is missing.\n\
         On Debian: apt-get install {}. Elsewhere: cmake, pkg-config and LLVM with libclang.",
        missing.join(" and "),
        PACKAGES.join(" ")
    );
    if env::var("CI").as_deref() == Ok("true") {
        return Err(format!("{left_out}\nCI=true: nothing may be left out"));
    }
    eprintln!("note: {left_out}");
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

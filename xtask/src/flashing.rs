//! Flashing without a board: whether `cargo flash` builds the firmware and hands it to probe-rs.
//!
//! ```text
//! cargo flash ─▶ .cargo/config.toml: alias, runner ─▶ `probe-rs run --chip … PROGRAM`    here a script that notes how it was called
//! ```

use std::env;
use std::fs;

use crate::step;
use crate::target::{Toolchain, built};

/// What probe-rs calls the chip.
const CHIP: &str = "STM32G474RETx";

/// Calls `cargo flash` with a stand-in for probe-rs.
///
/// # Errors
/// When it does not build, or calls something else or otherwise.
#[cfg(unix)]
pub fn check(toolchain: Toolchain) -> Result<(), String> {
    use std::os::unix::fs::PermissionsExt as _;

    let folder = step::root().join("target/stand-in");
    let (script, noted) = (folder.join("probe-rs"), folder.join("called"));
    let told = |error: std::io::Error| format!("{}: {error}", folder.display());
    fs::create_dir_all(&folder).map_err(told)?;
    fs::write(&script, format!("#!/bin/sh\nprintf '%s\\n' \"$@\" > '{}'\n", noted.display())).map_err(told)?;
    fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).map_err(told)?;
    fs::write(&noted, "").map_err(told)?;
    let path = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths([folder.clone()].into_iter().chain(env::split_paths(&path)))
        .map_err(|error| error.to_string())?;
    let mut flash = toolchain.command("flash");
    step::run("cargo flash, with a stand-in for probe-rs", flash.arg("--quiet").env("PATH", path))?;
    let called = fs::read_to_string(&noted).map_err(told)?;
    let words: Vec<&str> = called.lines().collect();
    match words[..] {
        ["run", "--chip", CHIP, program] if step::root().join(program) == step::root().join(built("thud-firmware")) => {
            Ok(())
        }
        _ => Err(format!("`cargo flash` was to call `probe-rs run --chip {CHIP} PROGRAM`, it called: {words:?}")),
    }
}

/// Where there is no shell to stand in.
#[cfg(not(unix))]
pub fn check(_: Toolchain) -> Result<(), String> {
    Ok(())
}

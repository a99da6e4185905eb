//! A compiler for the board's processor: found, or installed where that is permitted.
//!
//! ```text
//! rustup's toolchain has `core` for the target ──▶ use it
//!   no, and RUSTUP_AUTO_INSTALL is not 0      ──▶ rustup target add (rust-toolchain.toml has asked for it already)
//!   no, and RUSTUP_AUTO_INSTALL=0             ──▶ Debian's second compiler: packages, its own `core`, lld as linker
//!   and we are not root                       ──▶ left out, said; with CI=true that is a failure
//! ```

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use crate::{packages, step};

/// The processor of the board: Cortex-M4 with a single precision floating-point unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";

const PACKAGES: [&str; 5] = ["rustc-web", "cargo-web", "rust-web-src", "rust-web-clippy", "lld-19"];
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_CARGO: &str = "/usr/bin/cargo";
/// The oldest compiler that the firmware builds with.
const OLDEST: &str = env!("CARGO_PKG_RUST_VERSION");
/// What `rustup` calls Debian's compiler.
const DEBIAN_TOOLCHAIN: &str = "debian-web";
const DEBIAN_LINKER: &str = "ld.lld-19";

/// A compiler that can build for the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Toolchain {
    /// That of `rust-toolchain.toml`.
    Rustup,
    /// Debian's, beside it.
    Debian,
}

impl Toolchain {
    /// A cargo that builds for the board; add what to do.
    pub fn cargo(self, chore: &str) -> Command {
        let mut cargo = self.command(chore);
        cargo.args(["--target", TARGET]);
        cargo
    }

    /// The same for a chore that names the target by itself, as an alias does.
    pub fn command(self, chore: &str) -> Command {
        match self {
            Self::Rustup => step::cargo(&[chore]),
            Self::Debian => {
                // Rustup's proxy, not the cargo that runs this, for only the proxy knows other toolchains.
                let mut cargo = step::command("cargo", &[&format!("+{DEBIAN_TOOLCHAIN}"), chore]);
                for set_by_cargo in ["CARGO", "RUSTC", "RUSTUP_TOOLCHAIN", "RUSTDOC"] {
                    cargo.env_remove(set_by_cargo);
                }
                cargo.env(linker_variable(), DEBIAN_LINKER);
                cargo
            }
        }
    }
}

/// Where a program built for the board lies.
pub fn built(name: &str) -> PathBuf {
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| step::root().join("target"), PathBuf::from);
    target.join(TARGET).join("board").join(name)
}

/// The toolchain for the board; installs what is missing if it may. `None`: it may not, and has said so.
///
/// # Errors
/// When installing fails, or when nothing may be left out (`CI=true`).
pub fn toolchain() -> Result<Option<Toolchain>, String> {
    if has_core(Path::new("rustc")) {
        return Ok(Some(Toolchain::Rustup));
    }
    if env::var("RUSTUP_AUTO_INSTALL").as_deref() != Ok("0") {
        step::run("compiler for the board", &mut step::command("rustup", &["target", "add", TARGET]))?;
        return Ok(Some(Toolchain::Rustup));
    }
    let missing = missing();
    if missing.is_empty() {
        return Ok(Some(Toolchain::Debian));
    }
    if !packages::may_install() {
        packages::left_out(&format!(
            "the firmware is not built for the board. Left out: its size, its logic in QEMU, its ELF file in the emulator.\n\
             RUSTUP_AUTO_INSTALL=0 forbids `rustup target add {TARGET}`; missing for Debian's compiler instead: {}.\n\
             As root on Debian, `cargo xtask target` installs it; without, unset RUSTUP_AUTO_INSTALL.",
            missing.join(", ")
        ))?;
        return Ok(None);
    }
    install()?;
    Ok(Some(Toolchain::Debian))
}

/// What Debian's compiler lacks.
fn missing() -> Vec<String> {
    let mut missing = Vec::new();
    if !packages_installed() {
        missing.push(format!("packages {} of at least {OLDEST}", PACKAGES.join(" ")));
    }
    if !linked() {
        missing.push(format!("toolchain `{DEBIAN_TOOLCHAIN}` of rustup"));
    }
    if !has_core(Path::new(DEBIAN_RUSTC)) {
        missing.push(format!("`core` for {TARGET}"));
    }
    missing
}

fn install() -> Result<(), String> {
    let is_new = !packages_installed();
    if is_new {
        packages::install("compiler for the board", &PACKAGES)?;
    }
    if !linked() {
        let link = ["toolchain", "link", DEBIAN_TOOLCHAIN, "/usr"];
        step::run("compiler for the board: rustup", &mut step::command("rustup", &link))?;
    }
    if is_new || !has_core(Path::new(DEBIAN_RUSTC)) {
        build_core()?;
    }
    match missing().as_slice() {
        [] => Ok(()),
        still => Err(format!("compiler for the board: still missing after installing: {}", still.join(", "))),
    }
}

/// Builds `core` and `alloc` from Debian's sources with an empty crate, and lays them where the compiler looks for them.
fn build_core() -> Result<(), String> {
    let folder = step::root().join("target/core-for-the-board");
    let source = folder.join("src");
    let told = |error: std::io::Error| format!("{}: {error}", folder.display());
    fs::create_dir_all(&source).map_err(told)?;
    fs::write(folder.join("Cargo.toml"), "[package]\nname = \"empty\"\nedition = \"2024\"\n\n[workspace]\n")
        .map_err(told)?;
    fs::write(source.join("lib.rs"), "#![no_std]\n").map_err(told)?;
    let mut build = Command::new(DEBIAN_CARGO);
    build
        .args(["build", "--quiet", "--release", "--target", TARGET, "-Zbuild-std=core,alloc"])
        .current_dir(&folder)
        .env("RUSTC", DEBIAN_RUSTC)
        // Lets a stable compiler take `-Z`, for this one build; and what it makes can be optimised together with the firmware.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("RUSTFLAGS", "-Cembed-bitcode=yes")
        .env("CARGO_TARGET_DIR", folder.join("target"));
    step::run("compiler for the board: core", &mut build)?;
    let built = folder.join("target").join(TARGET).join("release/deps");
    let library = library(Path::new(DEBIAN_RUSTC)).ok_or("rustc does not say where its libraries are")?;
    let told_there = |error: std::io::Error| format!("{}: {error}", library.display());
    fs::create_dir_all(&library).map_err(told_there)?;
    let crates = ["core", "alloc", "compiler_builtins"];
    // Those of an older compiler may lie there.
    for old in fs::read_dir(&library).map_err(told_there)?.flatten() {
        if is_rlib_of(&old.file_name(), &crates) {
            fs::remove_file(old.path()).map_err(told_there)?;
        }
    }
    for entry in fs::read_dir(&built).map_err(told)?.flatten() {
        let name = entry.file_name();
        if is_rlib_of(&name, &crates) {
            let to = library.join(&name);
            fs::copy(entry.path(), &to).map_err(|error| format!("{}: {error}", to.display()))?;
        }
    }
    Ok(())
}

fn is_rlib_of(name: &OsString, crates: &[&str]) -> bool {
    name.to_str().is_some_and(|name| {
        name.ends_with(".rlib") && crates.iter().any(|library| name.starts_with(&format!("lib{library}-")))
    })
}

/// Where a compiler keeps the libraries of the target.
fn library(rustc: &Path) -> Option<PathBuf> {
    let output = Command::new(rustc)
        .args(["--print", "target-libdir", "--target", TARGET])
        .current_dir(step::root())
        .output()
        .ok()
        .filter(|output| output.status.success())?;
    Some(PathBuf::from(String::from_utf8(output.stdout).ok()?.trim()))
}

fn has_core(rustc: &Path) -> bool {
    library(rustc)
        .and_then(|folder| fs::read_dir(folder).ok())
        .is_some_and(|entries| entries.flatten().any(|entry| is_rlib_of(&entry.file_name(), &["core"])))
}

/// All of them, and a compiler that is new enough: a second source of packages may have a newer one than the first.
fn packages_installed() -> bool {
    step::works(step::command("dpkg", &["--status"]).args(PACKAGES))
        && version().is_some_and(|version| is_enough(&version))
}

/// What Debian's compiler says of itself: `rustc 1.96.0 (…)`.
fn version() -> Option<String> {
    let output = Command::new(DEBIAN_RUSTC).arg("--version").output().ok()?;
    String::from_utf8(output.stdout).ok()?.split_whitespace().nth(1).map(str::to_owned)
}

fn is_enough(version: &str) -> bool {
    let numbers = |version: &str| -> Vec<u32> { version.split('.').filter_map(|number| number.parse().ok()).collect() };
    numbers(version) >= numbers(OLDEST)
}

fn linked() -> bool {
    step::works(&mut step::command("rustup", &["which", "--toolchain", DEBIAN_TOOLCHAIN, "rustc"]))
}

fn linker_variable() -> String {
    format!("CARGO_TARGET_{}_LINKER", TARGET.to_uppercase().replace('-', "_"))
}

#[cfg(test)]
mod tests {
    use super::is_enough;

    #[test]
    fn an_older_compiler_is_not_enough() {
        assert!(is_enough("1.96.0") && is_enough("2.0.0") && is_enough(&format!("{}.0", super::OLDEST)));
        assert!(!is_enough("1.85.0") && !is_enough("1.9.0"));
    }
}

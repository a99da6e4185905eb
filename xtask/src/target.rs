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
        missing.push(format!("packages {}", PACKAGES.join(" ")));
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
    if !packages_installed() {
        packages::install("compiler for the board", &PACKAGES)?;
    }
    if !linked() {
        let link = ["toolchain", "link", DEBIAN_TOOLCHAIN, "/usr"];
        step::run("compiler for the board: rustup", &mut step::command("rustup", &link))?;
    }
    if !has_core(Path::new(DEBIAN_RUSTC)) {
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
    fs::create_dir_all(&library).map_err(|error| format!("{}: {error}", library.display()))?;
    for entry in fs::read_dir(&built).map_err(told)?.flatten() {
        let name = entry.file_name();
        if is_rlib_of(&name, &["core", "alloc", "compiler_builtins"]) {
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

fn packages_installed() -> bool {
    step::works(step::command("dpkg", &["--status"]).args(PACKAGES))
}

fn linked() -> bool {
    step::works(&mut step::command("rustup", &["which", "--toolchain", DEBIAN_TOOLCHAIN, "rustc"]))
}

fn linker_variable() -> String {
    format!("CARGO_TARGET_{}_LINKER", TARGET.to_uppercase().replace('-', "_"))
}

//! For the board: puts `memory.x` on the linker's path and the build's id into the binary.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!("cargo::rustc-env=THUD_BUILD={}", build_id());
        let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let out = env::var("OUT_DIR").expect("cargo gives every build script a folder");
        let memory = top.join("memory.x");
        fs::copy(&memory, Path::new(&out).join("memory.x")).unwrap_or_else(|error| {
            panic!("{}: {error}; the memory map of the board belongs to the top of the tree", memory.display())
        });
        // For the binary alone: whoever uses the library links for another chip.
        for argument in ["--nmagic", "--build-id=sha1", &format!("-L{out}"), "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo::rustc-link-arg-bins={argument}");
        }
        println!("cargo::rerun-if-changed={}", memory.display());
    }
}

/// The commit, with a `+` when something was changed since; `unknown` outside a repository.
fn build_id() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    if let Some(folder) = git(&["rev-parse", "--absolute-git-dir"]) {
        println!("cargo::rerun-if-changed={folder}/HEAD");
        println!("cargo::rerun-if-changed={folder}/index");
    }
    git(&["describe", "--always", "--dirty=+", "--abbrev=12"]).unwrap_or_else(|| "unknown".into())
}

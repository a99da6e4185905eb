//! For QEMU: its memory map, and the filter in C as the compiler makes it.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

const COMPILER: &str = "arm-none-eabi-gcc";
const FLAGS: [&str; 5] = ["-O3", "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"];

fn main() {
    for input in ["build.rs", "qemu.x", "cascade.c"] {
        println!("cargo::rerun-if-changed={input}");
    }
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo gives every build script a folder"));
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    println!("cargo::rustc-link-arg-bins=--nmagic");
    println!("cargo::rustc-link-arg-bins=-T{}", here.join("qemu.x").display());

    let object = out.join("cascade.o");
    let mut compile = Command::new(COMPILER);
    compile.args(FLAGS).arg("-c").arg(here.join("cascade.c")).arg("-o").arg(&object);
    match compile.status() {
        Ok(status) if status.success() => println!("cargo::rustc-link-arg-bins={}", object.display()),
        Ok(status) => panic!("{COMPILER}: {status}"),
        Err(error) => {
            panic!("{COMPILER}: {error}; Debian's package is gcc-arm-none-eabi, `cargo xtask test` installs it")
        }
    }
}

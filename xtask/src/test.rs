//! `cargo xtask test` and `cargo xtask tables`.

use crate::{emulator, flashing, python, qemu, rigs, size, step, target, vcan};

/// Format, lints, documentation, tests: in the order in which a mistake is cheapest to find.
///
/// # Errors
/// The first step that fails.
pub fn run() -> Result<(), String> {
    let python = python::of_tests()?;
    step::run("format", &mut step::cargo(&["fmt", "--all", "--check"]))?;
    step::run(
        "lints",
        &mut step::cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]),
    )?;
    step::run(
        "documentation",
        step::cargo(&["doc", "--workspace", "--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "-D warnings"),
    )?;
    step::run("documentation tests", &mut step::cargo(&["test", "--workspace", "--doc", "--quiet"]))?;
    // The board's program first: its size is a test, and it is run in QEMU by one.
    let mut program = None;
    let toolchain = target::toolchain()?;
    if let Some(toolchain) = toolchain {
        size::run(toolchain)?;
        flashing::check(toolchain)?;
        program = qemu::program(toolchain)?;
    }
    let mut tests = if step::works(&mut step::cargo(&["nextest", "--version"])) {
        step::cargo(&["nextest", "run", "--workspace", "--no-fail-fast"])
    } else {
        step::cargo(&["test", "--workspace", "--lib", "--bins", "--tests", "--no-fail-fast"])
    };
    if let Some(program) = program {
        tests.env("THUD_CORTEX_M4", program);
    }
    step::run("tests", tests.env("THUD_PYTHON", python))?;
    rigs::check()?;
    vcan::run_where_possible()?;
    toolchain.map_or(Ok(()), emulator::run)
}

/// The README's tables, the board's last.
///
/// # Errors
/// The first bench that fails.
pub fn tables() -> Result<(), String> {
    step::run("tables", &mut step::cargo(&["bench", "--workspace", "--benches"]))?;
    let Some(toolchain) = target::toolchain()? else { return Ok(()) };
    qemu::run(toolchain)?;
    emulator::table(toolchain)?;
    // After the emulator, which has noted how deep the stack got.
    size::run(toolchain)
}

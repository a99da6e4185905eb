//! `cargo xtask rigs DIR …`: campaigns of another simulator, diagnosed and scored.
//!
//! `tests/python/other_rigs/` shares no code with the tool: it was written from the contract and the table of mechanisms alone.
//! Its Python is a virtual environment of its own (`target/rigs-venv`), and what it compiles stays there.

use std::path::Path;
use std::process::Command;

use crate::{python, step};

const PACKAGE: &str = "tests/python/other_rigs";
const VENV: &str = "rigs-venv";
const USAGE: &str = "Usage: cargo xtask rigs DIR [--seed S] [--cases N] [--kind KIND] [--effect ID]";

/// Draws, diagnoses and scores; what follows the folder goes to the simulator.
///
/// # Errors
/// No folder, or the step that failed.
pub fn run(arguments: &[String]) -> Result<(), String> {
    let [folder, rest @ ..] = arguments else {
        return Err(format!("where to?\n{USAGE}"));
    };
    if folder.starts_with('-') {
        return Err(format!("`{folder}` is no folder; it comes first\n{USAGE}"));
    }
    let folder = std::path::absolute(folder).map_err(|error| format!("{folder}: {error}"))?;
    let mut rigs = simulator("")?;
    step::run("the tool", &mut step::cargo(&["build", "--release", "-p", "thud", "--bin", "thud"]))?;
    step::run("rigs", rigs.arg(folder).arg("--thud").arg(step::root().join("target/release/thud")).args(rest))
}

/// Whether it still does what it should: its own checks, closed forms among them.
///
/// # Errors
/// A check that fails.
pub fn check() -> Result<(), String> {
    step::run("another simulator", &mut simulator("test_other_rigs.py")?)
}

/// One of its scripts; without a name the simulator itself.
fn simulator(script: &str) -> Result<Command, String> {
    let package = Path::new(PACKAGE);
    let python = python::environment(VENV, &package.join("requirements.txt"))?;
    let mut command = step::command(python, &["-B"]);
    command.arg(package.join(script)).env("NUMBA_CACHE_DIR", step::root().join("target").join(VENV).join("compiled"));
    Ok(command)
}

//! `cargo xtask rigs DIR …`: campaigns of another simulator, diagnosed and scored.
//!
//! `tests/python/other_rigs/` shares neither code nor authors with the tool: it was written after the contract and the table of mechanisms.
//! Its Python is a virtual environment of its own (`target/rigs-venv`).

use std::path::{Path, PathBuf};

use crate::{python, step};

const PACKAGE: &str = "tests/python/other_rigs";

/// Draws, diagnoses and scores; what follows the folder goes to the simulator.
///
/// # Errors
/// No folder, or the step that failed.
pub fn run(arguments: &[String]) -> Result<(), String> {
    let [folder, rest @ ..] = arguments else {
        return Err("where to? `cargo xtask rigs DIR [--seed S] [--cases N] [--kind KIND] [--effect ID]`".to_owned());
    };
    let folder = std::path::absolute(folder).map_err(|error| format!("{folder}: {error}"))?;
    let python = environment()?;
    step::run("the tool", &mut step::cargo(&["build", "--release", "-p", "thud", "--bin", "thud"]))?;
    let mut rigs = step::command(python, &[PACKAGE]);
    step::run("rigs", rigs.arg(folder).arg("--thud").arg(step::root().join("target/release/thud")).args(rest))
}

/// Whether it still does what it should: its own checks, closed forms among them.
///
/// # Errors
/// A check that fails.
pub fn check() -> Result<(), String> {
    let script = Path::new(PACKAGE).join("test_other_rigs.py");
    step::run("another simulator", step::command(environment()?, &["-B"]).arg(script))
}

fn environment() -> Result<PathBuf, String> {
    python::environment("rigs-venv", &Path::new(PACKAGE).join("requirements.txt"))
}

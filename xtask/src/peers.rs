//! `cargo xtask peers DIR`: other people's methods on the cases of a finished run of `thud prove`, judged as the diagnosis is.
//!
//! Their Python is a virtual environment of its own (`target/peers-venv`); no test needs it.

use std::path::{Path, PathBuf};

use crate::{python, step};

/// Runs the peers on the run in a folder, then scores everything.
///
/// # Errors
/// No folder of a finished run, or the step that failed.
pub fn run(arguments: &[String]) -> Result<(), String> {
    let [folder] = arguments else {
        return Err("which run? `cargo xtask peers DIR`, DIR being the --out of a finished `thud prove`".to_owned());
    };
    let root = std::path::absolute(folder).map_err(|error| format!("{folder}: {error}"))?;
    if !root.join("answers.json").is_file() {
        return Err(format!("{folder} holds no finished run of `thud prove`: there is no answers.json"));
    }
    let python = python::environment("peers-venv", Path::new("tests/python/peers/requirements.txt"))?;
    let build = ["build", "--release", "-p", "thud", "--bins", "--example", "peers_view"];
    step::run("what the peers get", &mut step::cargo(&build))?;
    let built = step::root().join("target/release");
    let mut peers = step::command(python, &["tests/python/peers/peers.py"]);
    step::run("peers", peers.arg(built.join("examples/peers_view")).arg(&root))?;
    let report: PathBuf = root.join("report.html");
    let mut prove = step::command(built.join("thud"), &["prove", "--opened", "--out"]);
    step::run("scores", prove.arg(&root).arg("--report").arg(&report))?;
    eprintln!("the table is in {}, the page in {}", root.join("peers/table.md").display(), report.display());
    Ok(())
}

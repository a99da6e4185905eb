//! Python with other people's tools, in virtual environments under `target/`: `venv` is the tests' own.

use std::path::{Path, PathBuf};

use crate::step;

/// The tests' own environment.
///
/// # Errors
/// Says what could not be installed and what a person can do about it.
pub fn of_tests() -> Result<PathBuf, String> {
    environment("venv", Path::new("tests/python/requirements.txt"))
}

/// Makes the environment `target/NAME`, or renews it when its requirements (a file below the top of the tree) have changed, and returns its
/// interpreter.
///
/// # Errors
/// Says what could not be installed and what a person can do about it.
pub fn environment(name: &str, requirements: &Path) -> Result<PathBuf, String> {
    let folder = step::root().join("target").join(name);
    let python = folder.join("bin/python");
    let requirements = step::root().join(requirements);
    let wanted =
        std::fs::read_to_string(&requirements).map_err(|error| format!("{}: {error}", requirements.display()))?;
    let stamp = folder.join("requirements.installed");
    if std::fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
        return Ok(python);
    }
    let mut create = step::command("python3", &["-m", "venv", "--clear"]);
    step::run("Python environment", create.arg(&folder)).map_err(|error| {
        format!(
            "{error}\nPython 3.11 or newer with its `venv` module is needed (on Debian: apt-get install python3-venv)"
        )
    })?;
    let mut install = step::command(&python, &["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"]);
    step::run("Python packages", install.arg(&requirements))?;
    std::fs::write(&stamp, wanted).map_err(|error| format!("{}: {error}", stamp.display()))?;
    Ok(python)
}

//! The Python with other people's CAN tools.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A Python that can import `modules` (as written after `import`), to prove us against other people's tools.
///
/// `THUD_PYTHON`, or the virtual environment in `target/venv` that the test command makes. `None` means that the test
/// is to be skipped; why is printed.
///
/// # Panics
/// Where there is none and `CI=true`: leaving out a test is failing there.
#[must_use]
pub fn python(modules: &str) -> Option<PathBuf> {
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/venv/bin/python");
    let python = std::env::var_os("THUD_PYTHON").map_or(venv, PathBuf::from);
    let works = Command::new(&python)
        .args(["-c", &format!("import {modules}")])
        .stderr(std::process::Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if works {
        return Some(python);
    }
    let missing =
        format!("no Python with {modules} at {} (set THUD_PYTHON, or run the test command)", python.display());
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{missing}");
    println!("skipped: {missing}");
    None
}

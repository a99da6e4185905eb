//! One step of a chore: a command that is announced, run at the top of the tree, and must succeed.

use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

/// The top of the tree.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies one folder below the top")
}

/// A command to run at the top of the tree.
pub fn command(program: impl AsRef<OsStr>, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    command
}

/// The cargo that runs this. With `CI=true` nothing is built a second time: what would make that faster takes gigabytes and is left out.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut cargo = command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()), arguments);
    if is_ci() {
        cargo.env("CARGO_INCREMENTAL", "0");
    }
    cargo
}

/// Whether nothing may be left out and nothing is built twice: `CI=true`.
pub fn is_ci() -> bool {
    std::env::var("CI").as_deref() == Ok("true")
}

/// Announces and runs a command.
///
/// # Errors
/// Says which step failed and with what status.
pub fn run(name: &str, command: &mut Command) -> Result<(), String> {
    eprintln!("── {name}");
    let status =
        command.status().map_err(|error| format!("{name}: cannot start {:?}: {error}", command.get_program()))?;
    if status.success() { Ok(()) } else { Err(format!("{name}: {status}")) }
}

/// Whether a command can be run and succeeds, without showing what it says.
pub fn works(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

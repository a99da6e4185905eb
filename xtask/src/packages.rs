//! The distribution's packages: installed where that is permitted, and what happens where it is not.

use std::process::Command;

use crate::step;

/// Whether packages may be installed: as root, on Debian or its kin.
pub fn may_install() -> bool {
    let root = Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0");
    root && step::works(&mut step::command("apt-get", &["--version"]))
}

/// Installs packages.
///
/// # Errors
/// When `apt-get` fails.
pub fn install(what: &str, packages: &[&str]) -> Result<(), String> {
    let apt = |arguments: &[&str]| {
        let mut apt = step::command("apt-get", &["-o", "DPkg::Lock::Timeout=300"]);
        apt.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
        apt
    };
    let mut arguments = vec!["install", "-y", "-qq", "--no-install-recommends"];
    arguments.extend(packages);
    // Lists of packages may be missing or old, or those of one source only; without a network what is at hand may do.
    let update = format!("{what}: lists of packages");
    if let Err(error) = step::run(&update, &mut apt(&["update", "-qq"])) {
        eprintln!("note: {error}");
    }
    step::run(&format!("{what}: packages"), &mut apt(&arguments))
}

/// Whether the distribution has these packages, as far as its lists tell; they are fetched where they are missing.
pub fn known(packages: &[&str]) -> bool {
    let shown = || step::works(step::command("apt-cache", &["show", "--no-all-versions"]).args(packages));
    shown() || (step::works(&mut step::command("apt-get", &["update", "-qq"])) && shown())
}

/// Says what is left out.
///
/// # Errors
/// With `CI=true` nothing may be.
pub fn left_out(what: &str) -> Result<(), String> {
    if step::is_ci() {
        return Err(format!("{what}\nCI=true: nothing may be left out"));
    }
    eprintln!("note: {what}");
    Ok(())
}

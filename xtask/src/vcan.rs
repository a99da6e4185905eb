//! `cargo xtask vcan`: SocketCAN and can-utils on virtual buses, on machines whose kernel has no CAN, too.
//!
//! ```text
//! vcan0 is there ──▶ the tests
//! it is not      ──▶ User-Mode Linux, a kernel that is a program: modules ─▶ vcan0 to vcan4 ─▶ the very same test binary ─▶ its status
//! ```
//!
//! The guest's file system is this machine's; it writes nothing but the tests' own files and the two in `target/vcan`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::{packages, python, step};

/// What Debian calls what is needed, and the command that tells whether it is there.
const NEEDED: [(&str, &str); 4] =
    [("user-mode-linux", "linux.uml"), ("can-utils", "candump"), ("kmod", "insmod"), ("iproute2", "ip")];

/// The modules of a virtual bus, in the order in which they are loaded, below those of the kernel.
const MODULES: [&str; 4] =
    ["net/can/can.ko", "net/can/can-raw.ko", "drivers/net/can/dev/can-dev.ko", "drivers/net/can/vcan.ko"];

/// Runs the tests, where the kernel has the buses or can be brought along.
///
/// # Errors
/// When they fail, or what is missing when nothing may be left out (`CI=true`).
pub fn run() -> Result<(), String> {
    let python = python::of_tests()?;
    if Path::new("/sys/class/net/vcan0").exists() {
        let mut tests = step::cargo(&["test", "--quiet", "--package", "thud", "--test", "socket_can"]);
        return step::run("virtual CAN", tests.env("THUD_PYTHON", python).env("THUD_VCAN", "1"));
    }
    let missing: Vec<&str> =
        NEEDED.into_iter().filter(|(_, command)| found(command).is_none()).map(|(package, _)| package).collect();
    if !missing.is_empty() {
        if !packages::may_install() {
            return packages::left_out(&format!(
                "SocketCAN is not tested: there is no `vcan0`, and to bring one along these are missing: {}. As root on Debian, \
                 `cargo xtask vcan` installs them.",
                missing.join(", ")
            ));
        }
        packages::install("virtual CAN", &missing)?;
    }
    step::run("virtual CAN: tool", &mut step::cargo(&["build", "--package", "thud", "--quiet"]))?;
    let tests = binary()?;
    let folder = step::root().join("target/vcan");
    let said = |error: std::io::Error| format!("{}: {error}", folder.display());
    fs::create_dir_all(&folder).map_err(said)?;
    let status = folder.join("status");
    let _ = fs::remove_file(&status);
    let script = folder.join("init.sh");
    fs::write(&script, init(&tests, &python, &status)?).map_err(said)?;
    // Its own words go to standard error; those of the kernel are few.
    let mut kernel = step::command("timeout", &["900", "linux.uml", "mem=1G", "quiet", "rootfstype=hostfs", "rw"]);
    kernel.args(["con=null", "con0=null,fd:2", "init=/bin/sh", "--", script_path(&script)?]);
    step::run("virtual CAN: tests in User-Mode Linux", &mut kernel)?;
    match fs::read_to_string(&status).ok().as_deref().map(str::trim) {
        Some("0") => Ok(()),
        Some(status) => Err(format!("virtual CAN: the tests ended with {status}")),
        None => Err("virtual CAN: User-Mode Linux ended before the tests did".to_owned()),
    }
}

fn script_path(script: &Path) -> Result<&str, String> {
    script.to_str().ok_or_else(|| format!("{} is not UTF-8", script.display()))
}

/// Where a command is; system commands are not on everybody's path.
fn found(command: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let system = ["/usr/sbin", "/sbin", "/usr/bin"].map(PathBuf::from);
    std::env::split_paths(&path).chain(system).map(|folder| folder.join(command)).find(|file| file.is_file())
}

/// Builds the tests; where they are.
fn binary() -> Result<PathBuf, String> {
    let mut build = step::cargo(&[
        "test",
        "--no-run",
        "--package",
        "thud",
        "--test",
        "socket_can",
        "--message-format",
        "json",
        "--quiet",
    ]);
    let output = build.output().map_err(|error| format!("virtual CAN: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let executable = text.lines().rev().find_map(|line| {
        let (_, path) = line.split_once("\"executable\":\"")?;
        Some(PathBuf::from(path.split('"').next()?))
    });
    executable.ok_or_else(|| format!("virtual CAN: {}", String::from_utf8_lossy(&output.stderr)))
}

/// What the guest does, as its first and only process.
fn init(tests: &Path, python: &Path, status: &Path) -> Result<String, String> {
    let kernels = Path::new("/usr/lib/uml/modules");
    let mut versions: Vec<PathBuf> = fs::read_dir(kernels)
        .map_err(|error| format!("{}: {error}", kernels.display()))?
        .filter_map(|entry| Some(entry.ok()?.path().join("kernel")))
        .collect();
    versions.sort();
    let modules = versions.pop().ok_or_else(|| format!("{} is empty", kernels.display()))?;
    let load: String = MODULES.iter().map(|module| format!("insmod {}\n", modules.join(module).display())).collect();
    Ok(format!(
        "export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin THUD_VCAN=1 THUD_PYTHON={python}\n\
         mount -t proc proc /proc; mount -t sysfs sysfs /sys\n\
         {load}ip link set lo up\n\
         for bus in vcan0 vcan1 vcan2 vcan3 vcan4; do ip link add $bus type vcan && ip link set $bus up; done\n\
         cd {root}/host && {tests} >&2; echo $? > {status}\n\
         sync; {python} -c 'import ctypes; ctypes.CDLL(None).reboot(0x4321fedc)'\n",
        python = python.display(),
        root = step::root().display(),
        tests = tests.display(),
        status = status.display(),
    ))
}

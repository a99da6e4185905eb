//! `cargo xtask vcan`: SocketCAN and can-utils on virtual buses, and multicast over IPv4 and IPv6, on machines whose kernel has neither, too.
//!
//! ```text
//! vcan0 is there ──▶ the tests of SocketCAN
//! it is not      ──▶ User-Mode Linux, a kernel that is a program: modules ─▶ vcan0 to vcan4, a network of its own ─▶ the very same test
//!                    binaries ─▶ their status
//! ```
//!
//! The guest's file system is this machine's; it writes nothing but the tests' own files and the two in `target/vcan`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use crate::{packages, python, step};

/// What Debian calls what is needed, and the command that tells whether it is there.
const NEEDED: [(&str, &str); 4] =
    [("user-mode-linux", "linux.uml"), ("can-utils", "candump"), ("kmod", "insmod"), ("iproute2", "ip")];

/// The modules of virtual buses and of a network, in the order in which they are loaded, below those of the kernel.
const MODULES: [&str; 7] = [
    "net/can/can.ko",
    "net/can/can-raw.ko",
    "drivers/net/can/dev/can-dev.ko",
    "drivers/net/can/vcan.ko",
    "lib/crc-ccitt.ko",
    "net/ipv6/ipv6.ko",
    "drivers/net/dummy.ko",
];

/// The tests that run there.
const TESTS: [&str; 2] = ["socket_can", "python_can"];

/// What `/proc/cpuinfo` calls the tiles of AMX.
const TOO_MANY_REGISTERS: &str = "amx_tile";

/// A kernel that hangs is ended after so long, s; the tests take a minute and a half on a busy desktop.
const PATIENCE_S: &str = "600";

/// Runs the tests.
///
/// # Errors
/// When they fail, and where there are no buses and no kernel can be brought along: what is missing.
pub fn run() -> Result<(), String> {
    missing()?.map_or_else(tests, Err)
}

/// Runs the tests where the kernel has the buses or one can be brought along; elsewhere it is said what is left out.
///
/// # Errors
/// When they fail.
pub fn run_where_possible() -> Result<(), String> {
    let Some(missing) = missing()? else { return tests() };
    eprintln!("note: SocketCAN is not tested, and multicast over IPv6 only if this kernel has it: {missing}");
    Ok(())
}

/// What is missing and cannot be installed, or cannot run here; what can be installed, is.
fn missing() -> Result<Option<String>, String> {
    if Path::new("/sys/class/net/vcan0").exists() {
        return Ok(None);
    }
    if fs::read_to_string("/proc/cpuinfo").is_ok_and(|processor| processor.contains(TOO_MANY_REGISTERS)) {
        return Ok(Some(
            "there is no `vcan0`, and on a processor with AMX the packaged User-Mode Linux (6.1) ends before its first command: it has no room \
             for the registers (`ptrace set fp regs failed`)"
                .to_owned(),
        ));
    }
    let missing: Vec<&str> =
        NEEDED.into_iter().filter(|(_, command)| found(command).is_none()).map(|(package, _)| package).collect();
    if missing.is_empty() {
        return Ok(None);
    }
    let said = format!(
        "there is no `vcan0`, and to bring one along these packages are missing: {}. As root on Debian, `cargo xtask vcan` installs them.",
        missing.join(", ")
    );
    if !packages::may_install() || !packages::known(&missing) {
        return Ok(Some(said));
    }
    packages::install("virtual CAN", &missing).map(|()| None)
}

fn tests() -> Result<(), String> {
    let python = python::of_tests()?;
    if Path::new("/sys/class/net/vcan0").exists() {
        let mut tests = step::cargo(&["test", "--quiet", "--package", "thud", "--test", "socket_can"]);
        return step::run("virtual CAN", tests.env("THUD_PYTHON", python).env("THUD_VCAN", "1"));
    }
    let tests = binaries()?;
    let folder = step::root().join("target/vcan");
    let said = |error: std::io::Error| format!("{}: {error}", folder.display());
    fs::create_dir_all(&folder).map_err(said)?;
    let status = folder.join("status");
    let _ = fs::remove_file(&status);
    let script = folder.join("init.sh");
    fs::write(&script, init(&tests, &python, &status)?).map_err(said)?;
    // Its own words go to standard error; those of the kernel are few.
    let mut kernel = step::command("timeout", &["--kill-after=10", PATIENCE_S, "linux.uml", "mem=1G", "quiet"]);
    kernel.args(["rootfstype=hostfs", "rw", "con=null", "con0=null,fd:2", "init=/bin/sh", "--", script_path(&script)?]);
    // With an inherited input that is no terminal it has been seen to hang before it boots.
    kernel.stdin(Stdio::null());
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
fn binaries() -> Result<Vec<PathBuf>, String> {
    let mut build = step::cargo(&["test", "--no-run", "--package", "thud", "--message-format", "json", "--quiet"]);
    build.args(TESTS.iter().flat_map(|test| ["--test", test]));
    let output = build.output().map_err(|error| format!("virtual CAN: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    TESTS
        .iter()
        .map(|test| {
            // `…/deps/socket_can-0123456789abcdef`
            let built = text.lines().find_map(|line| {
                let (_, path) = line.split_once("\"executable\":\"")?;
                let path = Path::new(path.split('"').next()?);
                path.file_name()?.to_str()?.starts_with(&format!("{test}-")).then(|| path.to_owned())
            });
            built.ok_or_else(|| format!("virtual CAN: {test}: {}", String::from_utf8_lossy(&output.stderr)))
        })
        .collect()
}

/// What the guest does, as its first and only process.
fn init(tests: &[PathBuf], python: &Path, status: &Path) -> Result<String, String> {
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
         ip link add ether type dummy; ip link set ether multicast on up; ip addr add 10.0.0.1/24 dev ether\n\
         ip addr add fd00::1/64 dev ether nodad; ip route add 224.0.0.0/4 dev ether\n\
         for bus in vcan0 vcan1 vcan2 vcan3 vcan4; do ip link add $bus type vcan && ip link set $bus up; done\n\
         cd {root}/host; ({tests}) >&2; echo $? > {status}\n\
         sync; {python} -c 'import ctypes; ctypes.CDLL(None).reboot(0x4321fedc)'\n",
        python = python.display(),
        root = step::root().display(),
        tests = tests.iter().map(|test| test.display().to_string()).collect::<Vec<_>>().join(" && "),
        status = status.display(),
    ))
}

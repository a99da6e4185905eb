//! The host tool in one process, the firmware's ELF on an emulated board in another, python-can's `udp_multicast` between them.
//!
//! The tool's binary is looked for beside this test's; `cargo xtask emulator` builds it.

use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

const PORT: u16 = 43_581;

struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A multicast group of this process's own: the same test may run in another folder at the same time.
fn bus() -> String {
    let [_, _, high, low] = std::process::id().to_be_bytes();
    format!("udp:239.76.{high}.{low}:{PORT}")
}

fn tool() -> PathBuf {
    let beside = std::env::current_exe().expect("this test is a file");
    let tool = beside.ancestors().nth(2).expect("target/debug/deps").join("thud");
    assert!(tool.exists(), "{} is not there: cargo build -p thud", tool.display());
    tool
}

fn json(arguments: &[&str]) -> Option<Value> {
    let output = Command::new(tool()).args(arguments).args(["--bus", &bus(), "--json", "-"]).output().expect("it runs");
    if !output.status.success() {
        eprintln!("{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        return None;
    }
    serde_json::from_slice(&output.stdout).ok()
}

fn until(what: &str, mut done: impl FnMut() -> bool) {
    // A machine that is busy with other tests runs the guest slower than life.
    let began = Instant::now();
    while !done() {
        assert!(began.elapsed() < Duration::from_secs(120), "{what} did not happen within two minutes");
    }
}

#[test]
fn status_configure_hit_and_monitor_work_as_with_a_sensor() {
    let mut board = Command::new(env!("CARGO_BIN_EXE_thud-emulator"))
        .args(["--bus", &bus(), "--quiet"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut lines = BufReader::new(board.stdout.take().expect("it is piped")).lines();
    let _board = Running(board);
    assert!(lines.by_ref().map_while(Result::ok).any(|line| line.contains("runs on an emulated board")));
    std::thread::spawn(move || lines.for_each(drop));

    until("settling", || json(&["status"]).is_some_and(|status| status["sensors"][0]["settled"] == true));
    let status = json(&["status"]).expect("it answers");
    let sensor = &status["sensors"][0];
    assert_eq!((&sensor["node"], &sensor["reset_cause"]), (&32.into(), &"power".into()), "{sensor}");
    assert!(sensor["hardware"].as_str().is_some_and(|hardware| hardware.contains("NUCLEO-G474RE")), "{sensor}");

    let configured = json(&["configure", "--region", "chest", "--mass", "6"]).expect("it takes the configuration");
    assert_eq!(configured["stored"], true, "{configured}");

    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("emulated-events.json");
    let monitor = Command::new(tool())
        .args(["monitor", "--count", "1", "--bus", &bus(), "--json"])
        .arg(&file)
        .stdout(Stdio::piped())
        .spawn();
    let mut monitor = Running(monitor.expect("it starts"));
    let mut lines = BufReader::new(monitor.0.stdout.take().expect("it is piped")).lines();
    assert!(lines.by_ref().map_while(Result::ok).any(|line| line.contains("Following node 32")));
    std::thread::spawn(move || lines.for_each(drop));
    let hit = json(&["hit", "--speed", "0.3"]).expect("the rig obeys");
    let truth = hit["hits"][0]["peak_N"].as_f64().expect("a force");
    assert!(monitor.0.wait().expect("it ends after one event").success());

    let seen: Value = serde_json::from_slice(&std::fs::read(&file).expect("it is written")).expect("JSON");
    let events = seen["events"].as_array().expect("events");
    assert_eq!((events.len(), &seen["lost"]), (1, &0.into()), "{seen}");
    let peak = events[0]["peak_N"].as_f64().expect("a force");
    assert!((peak - truth).abs() < 0.005 * truth + 0.5, "{peak} N was sensed, {truth} N reached the cell");
    assert_ne!(events[0]["verdict"], "none", "{seen}");
}

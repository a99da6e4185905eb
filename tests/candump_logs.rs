//! Logs that other people's tools read and write: `thud log` against python-can's reader, python-can's writer against
//! `thud monitor`, and a log against what was shown live.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use multicast::group;
use serde_json::Value;
use tool::{THUD, json, run, told};

mod multicast;
mod python;
mod tool;

/// A process that ends with the test.
struct Running(Child);

impl Running {
    fn start(arguments: &[&str], ready: &str) -> Self {
        let mut child = Command::new(THUD).args(arguments).stdout(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let heard = lines.by_ref().map_while(Result::ok).any(|line| line.contains(ready));
        assert!(heard, "{arguments:?} never said `{ready}`");
        std::thread::spawn(move || lines.for_each(drop));
        Self(child)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Two sensors that are hit, followed live and logged at the same time; the events as live, and the log.
fn logged(port: u16, name: &str) -> (Value, String) {
    let bus = format!("udp:{}:{port}", group());
    let folder = tool::folder(&format!("logs-{name}"));
    let log = folder.join("bus.log").display().to_string();
    let live = folder.join("live.json").display().to_string();
    let sensor = |node: &str, serial: &str, more: &[&str]| {
        let arguments = ["sensor", "--bus", &bus, "--node-id", node, "--serial", serial, "--hit-every", "0.8"];
        Running::start(&[&arguments, more].concat(), "lives as node")
    };
    let _one = sensor("32", "7", &["--region", "chest", "--mass", "6.1"]);
    let _two = sensor("33", "8", &["--speed", "0.4"]);
    while json(&["status", "--bus", &bus])["sensors"]
        .as_array()
        .is_none_or(|sensors| sensors.len() < 2 || sensors.iter().any(|sensor| sensor["settled"] != true))
    {}
    let mut logging = Command::new(THUD)
        .args(["log", "--bus", &bus, "--out", &log, "--interface", "vcan7", "--duration", "9"])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    // It has asked who is there, and listens.
    while std::fs::read_to_string(&log).map_or(0, |text| text.lines().count()) < 20 {}
    told(run(&["monitor", "--bus", &bus, "--count", "4", "--json", &live]));
    assert!(logging.wait().unwrap().success());
    (serde_json::from_str(&std::fs::read_to_string(live).unwrap()).unwrap(), log)
}

#[test]
fn a_log_tells_the_same_events_as_the_live_bus_did() {
    let (live, log) = logged(43_601, "again");
    let again = json(&["monitor", "--bus", &format!("log:{log}")]);
    assert_eq!(again["lost"], 0, "{again}");
    assert_eq!(again["sensors"].as_array().unwrap().len(), 2);
    let events = again["events"].as_array().unwrap();
    let live = live["events"].as_array().unwrap();
    assert!(live.len() >= 4);
    for event in live {
        let same = |other: &&Value| other["node"] == event["node"] && other["number"] == event["number"];
        let found = events.iter().find(same).unwrap_or_else(|| panic!("missing: {event}"));
        // Everything, to the last bit: the same frames, and what was asked when the log began.
        assert_eq!(found, event);
    }
    // Cut in half in the middle of a line, it tells what it still holds.
    let text = std::fs::read_to_string(&log).unwrap();
    let cut = format!("{log}.cut");
    std::fs::write(&cut, &text[..text.len() / 2]).unwrap();
    let half = json(&["monitor", "--bus", &format!("log:{cut}")]);
    assert!(half["events"].as_array().unwrap().len() < events.len());
}

/// Reads a log with python-can's reader, and decodes what the DBC file knows of node 32.
const READ: &str = r#"
import json, sys
import can, cantools
database = cantools.database.load_file(sys.argv[2])
frames, peaks = 0, []
for message in can.CanutilsLogReader(sys.argv[1]):
    assert message.channel == "vcan7" and not message.is_extended_id and message.timestamp > 1.7e9, message
    frames += 1
    try:
        known = database.get_message_by_frame_id(message.arbitration_id)
    except KeyError:
        continue
    values = known.decode(bytes(message.data))
    if known.name == "EventForce":
        peaks.append(values["Peak"])
print(json.dumps({"frames": frames, "peaks": peaks}))
"#;

/// Reads with python-can's reader and writes with its writer, with kinds of frames among it that CANopen does not use.
const REWRITE: &str = r#"
import sys
import can
writer = can.CanutilsLogWriter(sys.argv[2])
strange = [
    can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=[1, 2]),
    can.Message(arbitration_id=5, is_extended_id=False, is_remote_frame=True, dlc=4),
    can.Message(arbitration_id=6, is_extended_id=False, is_fd=True, dlc=12, data=bytes(12), bitrate_switch=True),
    can.Message(is_error_frame=True),
]
for number, message in enumerate(can.CanutilsLogReader(sys.argv[1])):
    writer.on_message_received(message)
    if number == 10:
        for other in strange:
            other.timestamp = message.timestamp
            writer.on_message_received(other)
writer.stop()
"#;

#[test]
fn python_can_reads_our_logs_and_we_read_python_cans() {
    let Some(python) = python::python("can, cantools") else { return };
    let (_, log) = logged(43_602, "python");
    let dbc = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/can/thud.dbc");
    let script = |code: &str, arguments: &[&str]| {
        let output = Command::new(&python).args(["-c", code]).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    let read: Value = serde_json::from_slice(&script(READ, &[&log, &dbc.display().to_string()])).unwrap();
    let lines = std::fs::read_to_string(&log).unwrap().lines().count();
    assert_eq!(read["frames"], lines);
    let ours = json(&["monitor", "--bus", &format!("log:{log}")]);
    let peaks: Vec<f64> = ours["events"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|event| event["node"] == 32)
        .map(|event| event["peak_N"].as_f64().unwrap())
        .collect();
    let theirs: Vec<f64> = read["peaks"].as_array().unwrap().iter().map(|peak| peak.as_f64().unwrap()).collect();
    assert!(!peaks.is_empty() && peaks.len() == theirs.len(), "{peaks:?} {theirs:?}");
    assert!(peaks.iter().zip(&theirs).all(|(ours, theirs)| (ours - theirs).abs() < 1e-3), "{peaks:?} {theirs:?}");

    let rewritten = format!("{log}.rewritten");
    script(REWRITE, &[&log, &rewritten]);
    let again = json(&["monitor", "--bus", &format!("log:{rewritten}")]);
    assert_eq!(again["events"], ours["events"]);
    assert_eq!(again["frames"]["foreign"], 4);
    assert_eq!(again["frames"]["malformed"], 0);
}

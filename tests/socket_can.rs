//! SocketCAN on the kernel's own virtual buses: frames, kinds and losses, python-can and can-utils at the other end.
//!
//! Needs the interfaces `vcan0` to `vcan4` and can-utils. `cargo xtask vcan` runs this in a User-Mode Linux that has them, with
//! `THUD_VCAN` set; without that and without them it says so and is skipped.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;
use thud::bus::Bus;
use thud::bus::socket_can::SocketCanBus;
use thud_firmware::board::Frame;

mod python;

/// Whether what the tests need is there; otherwise it is said.
fn there() -> bool {
    let missing: Vec<String> = (0..5)
        .map(|number| format!("vcan{number}"))
        .filter(|name| !Path::new("/sys/class/net").join(name).exists())
        .chain((!runs("candump")).then(|| "can-utils".to_owned()))
        .collect();
    if missing.is_empty() {
        return true;
    }
    let said = format!("{} missing (`cargo xtask vcan` brings them along)", missing.join(", "));
    assert!(std::env::var_os("THUD_VCAN").is_none(), "{said}");
    println!("skipped: {said}");
    false
}

fn runs(program: &str) -> bool {
    Command::new(program).stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok()
}

fn open(interface: &str) -> SocketCanBus {
    SocketCanBus::open(interface).unwrap()
}

fn frame(id: u16, bytes: &[u8]) -> Frame {
    Frame::new(id, bytes).unwrap()
}

fn next(bus: &mut SocketCanBus) -> Frame {
    bus.receive(Duration::from_secs(20)).unwrap().expect("a frame").frame
}

/// A process that ends with the test.
struct Running(Child);

impl Running {
    fn start(command: &mut Command) -> Self {
        Self(command.stdout(Stdio::piped()).spawn().unwrap())
    }

    /// The lines that it says.
    fn lines(&mut self) -> impl Iterator<Item = String> + use<> {
        BufReader::new(self.0.stdout.take().unwrap()).lines().map_while(Result::ok)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn thud(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_thud"));
    command.args(arguments);
    command
}

fn succeeds(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_slice(&succeeds(&mut thud(&[arguments, &["--json", "-"]].concat())).stdout).unwrap()
}

#[test]
fn a_frame_reaches_the_others_and_not_its_sender() {
    if !there() {
        return;
    }
    let (mut one, mut other) = (open("vcan0"), open("vcan0"));
    for length in 0..=8 {
        let sent = frame(0x7FF, &[0xA5; 8][..length]);
        one.send(&sent).unwrap();
        assert_eq!(next(&mut other), sent);
    }
    assert_eq!(one.receive(Duration::from_millis(20)).unwrap(), None);
    assert_eq!((one.counters().sent, other.counters().received, other.counters().lost), (9, 9, 0));

    // Nobody reads for a while: what the kernel has no room for is counted, and nothing is counted twice.
    let flood = 50_000;
    for number in 0..flood {
        one.send(&frame(0x100, &u32::to_le_bytes(number))).unwrap();
    }
    let mut heard = 0;
    while other.receive(Duration::from_millis(100)).unwrap().is_some() {
        heard += 1;
    }
    // The count comes with the next frame that fits.
    one.send(&frame(0x101, &[])).unwrap();
    assert_eq!(next(&mut other).id, 0x101);
    let lost = other.counters().lost;
    assert!(lost > 0 && u64::from(flood) == heard + lost, "{heard} heard, {lost} lost");
}

/// Returns every frame with its data reversed under the next identifier; after 0x7FE kinds that CANopen does not use, and ends.
const ECHO: &str = r#"
import sys, can
bus = can.Bus(interface="socketcan", channel=sys.argv[1], fd=False)
print("ready", flush=True)
while True:
    message = bus.recv(30)
    if message is None:
        sys.exit("nothing was heard for 30 s")
    assert not message.is_extended_id and not message.is_fd and message.dlc == len(message.data), message
    bus.send(can.Message(arbitration_id=(message.arbitration_id + 1) % 0x7FE, is_extended_id=False,
                         data=bytes(reversed(message.data))))
    if message.arbitration_id == 0x7FE:
        break
bus.send(can.Message(arbitration_id=0x12345678, is_extended_id=True, data=[1]))
bus.send(can.Message(arbitration_id=5, is_extended_id=False, is_remote_frame=True, dlc=4))
bus.shutdown()
"#;

#[test]
fn python_can_and_thud_exchange_frames() {
    if !there() {
        return;
    }
    let Some(python) = python::python("can") else { return };
    let mut bus = open("vcan1");
    let mut echo = Running::start(Command::new(python).args(["-c", ECHO, "vcan1"]));
    assert_eq!(echo.lines().next().as_deref(), Some("ready"));
    let data = [0xFF, 0, 1, 0x80, 4, 5, 6, 7];
    let lengths = (0..=8_u8).map(|length| frame(0x100 + u16::from(length), &data[..length.into()]));
    for sent in lengths.chain([frame(0, &[1, 0x20]), frame(0x7FD, &[0; 8]), frame(0x7FE, &[9])]) {
        bus.send(&sent).unwrap();
        let answer = next(&mut bus);
        assert_eq!(answer.id, (sent.id + 1) % 0x7FE);
        assert!(answer.bytes().iter().rev().eq(sent.bytes()), "{sent:?} came back as {answer:?}");
    }
    assert!(echo.0.wait().unwrap().success());
    assert_eq!(bus.receive(Duration::from_millis(100)).unwrap(), None);
    let counters = bus.counters();
    assert_eq!((counters.foreign, counters.malformed, counters.lost), (2, 0, 0), "{counters:?}");
}

/// The frames of a candump log, without times and interface.
fn frames(log: &str) -> Vec<&str> {
    log.lines().map(|line| line.split_whitespace().nth(2).unwrap_or_else(|| panic!("{line}"))).collect()
}

#[test]
fn can_utils_see_what_thud_sends_and_send_what_it_sees() {
    if !there() {
        return;
    }
    let mut bus = open("vcan2");
    let mut dump = Running::start(Command::new("candump").args(["-L", "-n", "3", "vcan2"]));
    let lines = dump.lines();
    // candump says nothing when it is ready: frames are sent until it sees one.
    let (ready, seen) = std::sync::mpsc::channel();
    std::thread::spawn(move || lines.for_each(|line| ready.send(line).unwrap_or(())));
    let mut heard = Vec::new();
    while heard.len() < 3 {
        bus.send(&frame(0x1A0, &[0xDE, 0xAD, heard.len() as u8])).unwrap();
        heard.extend(seen.recv_timeout(Duration::from_millis(200)));
    }
    for (number, line) in heard.iter().enumerate() {
        assert!(line.contains(" vcan2 1A0#DEAD0"), "{number}: {line}");
    }
    succeeds(Command::new("cansend").args(["vcan2", "123#DEADBEEF"]));
    assert_eq!(next(&mut bus), frame(0x123, &[0xDE, 0xAD, 0xBE, 0xEF]));
    succeeds(Command::new("cansend").args(["vcan2", "7FF#"]));
    assert_eq!(next(&mut bus), frame(0x7FF, &[]));
    succeeds(Command::new("cansend").args(["vcan2", "12345678#01"]));
    succeeds(Command::new("cansend").args(["vcan2", "123#R"]));
    assert_eq!(bus.receive(Duration::from_millis(100)).unwrap(), None);
    assert_eq!(bus.counters().foreign, 2);
}

/// `1A0#DEAD`.
fn frame_text(frame: &Frame) -> String {
    frame.bytes().iter().fold(format!("{:03X}#", frame.id), |text, byte| format!("{text}{byte:02X}"))
}

/// How many sockets hear every frame of an interface.
fn listeners(interface: &str) -> usize {
    let all = std::fs::read_to_string("/proc/net/can/rcvlist_all").unwrap_or_default();
    all.lines().filter(|line| line.split_whitespace().next() == Some(interface)).count()
}

/// The whole tool over SocketCAN, logged by `thud log` and by candump at the same time: both logs hold the events that were shown live;
/// canplayer and log2asc read ours.
#[test]
fn a_sensor_lives_on_it_and_its_log_is_can_utils_log() {
    if !there() {
        return;
    }
    let folder = tempfile::TempDir::new().unwrap();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let on_bus = |arguments: &[&str]| thud(&[arguments, &["--bus", "vcan3"]].concat());
    let mut sensor = Running::start(&mut on_bus(&["sensor", "--serial", "77", "--region", "chest", "--mass", "6.1"]));
    let mut said = sensor.lines();
    assert!(said.any(|line| line.contains("lives as node")));
    std::thread::spawn(move || said.for_each(drop));
    while json(&["status", "--bus", "vcan3"])["sensors"][0]["settled"] != true {}

    let dumped = std::fs::File::create(file("candump.log")).unwrap();
    let before = listeners("vcan3");
    let mut dump = Running(Command::new("candump").args(["-L", "vcan3"]).stdout(dumped).spawn().unwrap());
    // It says nothing when it is ready; the kernel does.
    let begun = std::time::Instant::now();
    while listeners("vcan3") <= before && begun.elapsed() < Duration::from_secs(10) {}
    let mut logging = Running::start(&mut on_bus(&["log", "--out", &file("thud.log"), "--duration", "12"]));
    // It has asked who is there, and listens.
    while std::fs::read_to_string(file("thud.log")).map_or(0, |text| text.lines().count()) < 20 {}
    let mut monitor = Running::start(&mut on_bus(&["monitor", "--count", "1", "--json", &file("live.json")]));
    let mut shown = monitor.lines();
    assert!(shown.any(|line| line.contains("Following node 32")));
    // Whoever is not read from any more ends early.
    std::thread::spawn(move || shown.for_each(drop));
    succeeds(&mut on_bus(&["hit"]));
    assert!(monitor.0.wait().unwrap().success());
    assert!(logging.0.wait().unwrap().success());
    dump.0.kill().unwrap();
    dump.0.wait().unwrap();

    let live: Value = serde_json::from_str(&std::fs::read_to_string(file("live.json")).unwrap()).unwrap();
    let ours = json(&["monitor", "--bus", &format!("log:{}", file("thud.log"))]);
    assert_eq!((ours["events"].as_array().unwrap().len(), &ours["events"]), (1, &live["events"]));
    let theirs = json(&["monitor", "--bus", &format!("log:{}", file("candump.log"))]);
    assert_eq!(theirs["events"], live["events"]);
    let (our_text, their_text) =
        (std::fs::read_to_string(file("thud.log")).unwrap(), std::fs::read_to_string(file("candump.log")).unwrap());
    // candump began before and ended after: it has all of ours.
    let our_frames = frames(&our_text);
    let mut left = BTreeMap::<&str, usize>::new();
    frames(&their_text).into_iter().for_each(|frame| *left.entry(frame).or_default() += 1);
    for frame in &our_frames {
        let count = left.get_mut(frame).unwrap_or_else(|| panic!("candump has no {frame}"));
        *count = count.checked_sub(1).unwrap_or_else(|| panic!("{frame} stands once too often in ours"));
    }

    // In its own time: faster than it is read the kernel would have to drop some.
    let mut bus = open("vcan4");
    let _player = Running::start(Command::new("canplayer").args(["-I", &file("thud.log"), "vcan4=vcan3"]));
    let played: Vec<String> = our_frames.iter().map(|_| frame_text(&next(&mut bus))).collect();
    assert_eq!(played, our_frames);
    let ascii = succeeds(Command::new("log2asc").args(["-I", &file("thud.log"), "vcan3"])).stdout;
    assert_eq!(String::from_utf8(ascii).unwrap().lines().filter(|line| line.contains(" d ")).count(), our_frames.len());
}

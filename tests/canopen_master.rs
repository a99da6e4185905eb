//! An independent CANopen master (python `canopen`, with the shipped EDS and DBC files) and a living sensor: the examples of
//! `examples/python`, one by one, as a person would run them.
//!
//! Needs a Python with `canopen` and `cantools`, see `python.rs`.

use std::io::{BufRead as _, BufReader, Lines};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;
use thud::bus::Bus;
use thud::bus::address::BusAddress;
use thud_firmware::board::Frame;

mod multicast;
mod python;

/// The folder with the examples.
fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/python")
}

/// A sensor on a bus of its own, and the Python that talks to it.
struct Lab {
    python: PathBuf,
    group: String,
    port: u16,
    sensor: Child,
}

impl Lab {
    /// A settled sensor; `None` where there is no Python.
    fn new(port: u16) -> Option<Self> {
        let python = python::python("can, msgpack, canopen, cantools")?;
        let group = multicast::group();
        let mut sensor = Command::new(env!("CARGO_BIN_EXE_thud"))
            .args(["sensor", "--serial", "77", "--region", "chest", "--mass", "6.1"])
            .args(["--bus", &format!("udp:{group}:{port}")])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(sensor.stdout.take().unwrap()).lines();
        assert!(lines.by_ref().map_while(Result::ok).any(|line| line.contains("lives as node")));
        // Somebody has to read on, or it would stop when the pipe is full.
        std::thread::spawn(move || lines.for_each(drop));
        let lab = Self { python, group, port, sensor };
        while lab.json("identity.py", &[])["settled"] != true {}
        Some(lab)
    }

    fn command(&self, script: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.python);
        command
            .arg(examples().join(script))
            .args(["--channel", &self.group, "--port", &self.port.to_string(), "--json"])
            .args(arguments);
        command
    }

    fn output(&self, script: &str, arguments: &[&str]) -> Output {
        self.command(script, arguments).output().unwrap()
    }

    /// Runs an example that must succeed, and gives the last thing that it said.
    fn json(&self, script: &str, arguments: &[&str]) -> Value {
        let output = self.output(script, arguments);
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{script}: {said}{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_str(said.lines().last().unwrap()).unwrap()
    }

    /// Runs an example that must fail, and gives what it said.
    fn failure(&self, script: &str, arguments: &[&str]) -> String {
        let output = self.output(script, arguments);
        assert!(!output.status.success(), "{script} succeeded");
        String::from_utf8_lossy(&output.stderr).into_owned()
    }

    /// Starts an example that says one line when it is ready, and then what happens.
    fn listener(&self, script: &str, arguments: &[&str]) -> Listener {
        let mut listener = self.started(script, arguments);
        listener.next();
        listener
    }

    fn started(&self, script: &str, arguments: &[&str]) -> Listener {
        let mut child = self.command(script, arguments).stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        Listener { child, lines }
    }

    fn bus(&self) -> Box<dyn Bus> {
        format!("udp:{}:{}", self.group, self.port).parse::<BusAddress>().unwrap().open().unwrap()
    }

    /// Lets the simulated robot hit the sensor.
    fn hit(&self) {
        let output = Command::new(env!("CARGO_BIN_EXE_thud"))
            .args(["hit", "--bus", &format!("udp:{}:{}", self.group, self.port)])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

impl Drop for Lab {
    fn drop(&mut self) {
        let _ = self.sensor.kill();
        let _ = self.sensor.wait();
    }
}

struct Listener {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Listener {
    fn next(&mut self) -> Value {
        let line = self.lines.next().expect("it says more").unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{line}: {error}"))
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn the_sensor_is_found_and_says_who_it_is() {
    let Some(lab) = Lab::new(43_701) else { return };
    let found = lab.json("find.py", &[]);
    assert_eq!(found["sensors"], serde_json::json!([{"node": 32, "serial": 77}]));
    let identity = lab.json("identity.py", &[]);
    assert_eq!(identity["device"], "thud impact sensor");
    assert_eq!((&identity["product"], &identity["serial"]), (&0x7468_7564.into(), &77.into()));
    assert!((0.2..0.4).contains(&number(&identity["noise_N"])), "0.3 N rms are simulated: {identity}");
}

#[test]
fn settings_take_effect_together_or_not_at_all() {
    let Some(lab) = Lab::new(43_702) else { return };
    let set = lab.json("configure.py", &["--region", "10", "--stiffness", "75000", "--mass", "5.5"]);
    assert_eq!(
        (&set["Region"], &set["Body stiffness"], &set["Effective mass"]),
        (&10.into(), &75e3.into(), &5.5.into())
    );
    assert_eq!(number(&set["revision"]), number(&set["revision_before"]) + 1.0);
    let said = lab.failure("configure.py", &["--region", "5", "--stiffness", "5"]);
    assert!(said.contains("Body stiffness 5 is too low; 1000 to 1e+06 is permitted; nothing was changed"), "{said}");
    let now = lab.json("configure.py", &[]);
    assert_eq!((&now["Region"], &now["hash"], &now["revision"]), (&10.into(), &set["hash"], &set["revision"]));
}

#[test]
fn an_armed_sensor_is_disarmed_for_a_change_and_armed_again() {
    let Some(lab) = Lab::new(43_711) else { return };
    let mut bus = lab.bus();
    bus.send(&Frame::new(0, &[1, 32]).unwrap()).unwrap();
    let set = lab.json("configure.py", &["--region", "10", "--mass", "5.5"]);
    assert_eq!((&set["Region"], &set["disarmed"]), (&10.into(), &true.into()));
    let said = lab.failure("configure.py", &["--stiffness", "5"]);
    assert!(said.contains("Body stiffness 5 is too low"), "{said}");
    // It is armed: its heartbeat says Operational.
    while bus.receive(Duration::from_millis(1)).unwrap().is_some() {}
    let beat = std::iter::from_fn(|| bus.receive(Duration::from_secs(5)).unwrap())
        .find(|stamped| stamped.frame.id == 0x720)
        .unwrap();
    assert_eq!(beat.frame.bytes(), [5]);
}

#[test]
fn alarm_and_event_arrive_by_pdo_and_the_curve_by_both_transfers() {
    let Some(lab) = Lab::new(43_703) else { return };
    assert!(lab.failure("download.py", &[]).contains("hit the sensor first"));
    let mut watch = lab.listener("watch.py", &["--events", "1"]);
    lab.hit();
    let alarm = watch.next();
    let event = watch.next()["event"].clone();
    assert_eq!((&alarm["alarm"]["Impact"], &event["Impact"]), (&1.into(), &1.into()), "{alarm} {event}");
    let noticed = number(&alarm["alarm"]["Index"]) - number(&event["Contact index"]);
    assert!((0.0..200.0).contains(&noticed), "noticed within 10 ms of contact: {alarm} {event}");
    assert_eq!(event["Effective mass"], 6.1);
    assert_eq!(event["Quasi-static force"], Value::Null);

    let segmented = lab.json("download.py", &[]);
    let csv = Path::new(env!("CARGO_TARGET_TMPDIR")).join("canopen-master.csv");
    let block = lab.json("download.py", &["--block", "--out", csv.to_str().unwrap()]);
    for key in ["impact", "samples", "crc32", "peak_N"] {
        assert_eq!(segmented[key], block[key]);
    }
    // The curve's highest sample is above the interpolated, noise-free peak by no more than the noise.
    let above = number(&block["peak_N"]) - number(&event["Raw peak"]);
    assert!((-2.0..2.0).contains(&above), "{block} {event}");
    let lines = std::fs::read_to_string(csv).unwrap().lines().count();
    assert_eq!(lines as f64, number(&block["samples"]) + 1.0);
}

#[test]
fn a_fault_arrives_as_emcy_and_stays_in_the_history() {
    let Some(lab) = Lab::new(43_704) else { return };
    let mut faults = lab.listener("faults.py", &[]);
    // An effective mass of three bytes, once the node is Operational.
    let mut bus = lab.bus();
    std::thread::sleep(Duration::from_millis(200));
    bus.send(&Frame::new(0x220, &[1, 2, 3]).unwrap()).unwrap();
    let told = faults.next();
    assert_eq!((&told["fault"]["code"], &told["fault"]["detail"]), (&0x8210.into(), &3.into()));
    assert_eq!(told["fault"]["register"], 0x11);
    assert_eq!(faults.next()["history"], serde_json::json!([0x8210]));
}

#[test]
fn the_time_is_set() {
    let Some(lab) = Lab::new(43_705) else { return };
    let set = lab.json("set_time.py", &["--at", "1795257510.368"]);
    assert!((number(&set["taken_s"]) - 1_795_257_510.368).abs() < 0.002, "{set}");
    assert!(number(&set["sample"]) > 0.0);
}

#[test]
fn a_node_id_is_assigned_by_lss_and_an_impossible_one_changes_nothing() {
    let Some(lab) = Lab::new(43_706) else { return };
    let said = lab.failure("assign_id.py", &["--serial", "78", "--to", "0x21"]);
    assert!(said.contains("no sensor with serial number 78 answered"), "{said}");
    let said = lab.failure("assign_id.py", &["--serial", "77", "--to", "0xA1"]);
    assert!(said.contains("node id 161 was refused"), "{said}");
    assert_eq!(lab.json("find.py", &[])["sensors"][0]["node"], 32);
    let assigned = lab.json("assign_id.py", &["--serial", "77", "--to", "0x21"]);
    assert_eq!((&assigned["before"], &assigned["node"]), (&32.into(), &33.into()));
    assert_eq!(lab.json("find.py", &[])["sensors"], serde_json::json!([{"node": 33, "serial": 77}]));
}

/// The mass that a controller streams with the DBC file is the mass that judges the next blow.
#[test]
fn a_mass_that_is_streamed_with_the_dbc_file_judges_the_blow() {
    let Some(lab) = Lab::new(43_707) else { return };
    let mut watch = lab.listener("watch.py", &["--events", "1"]);
    let mut stream = lab.started("stream_mass.py", &["--mass", "4.2", "--seconds", "6"]);
    // Once the first mass has come; an interpreter may take its time to begin.
    let mut bus = lab.bus();
    while bus.receive(Duration::from_secs(30)).unwrap().expect("masses come").frame.id != 0x220 {}
    lab.hit();
    watch.next();
    let event = watch.next()["event"].clone();
    assert_eq!(event["Effective mass"], 4.2, "{event}");
    assert!(number(&event["Age of the mass"]) < 100.0, "{event}");
    assert_eq!(stream.next()["sent"], 300);
}

/// Everything that an Operational sensor sends by PDO while it streams and is hit, with cantools and the DBC file alone.
#[test]
fn alarm_event_and_samples_are_decoded_with_the_dbc_file() {
    let Some(lab) = Lab::new(43_712) else { return };
    let mut bus = lab.bus();
    // Pre-operational yet: every value of the stream is to be the mean of 20 samples; then start.
    bus.send(&Frame::new(0x620, &[0x2B, 0x20, 0x20, 1, 20, 0, 0, 0]).unwrap()).unwrap();
    bus.send(&Frame::new(0, &[1, 32]).unwrap()).unwrap();
    let mut decoding = lab.listener("decode.py", &["--seconds", "6"]);
    lab.hit();
    let (mut last, mut highest) = (Value::Null, 0.0_f64);
    let mut event = serde_json::Map::new();
    while last["counts"].is_null() {
        last = decoding.next();
        for (name, values) in last.as_object().unwrap() {
            match name.as_str() {
                "Samples" => {
                    let forces = ["Force1", "Force2", "Force3"].map(|force| number(&values[force]));
                    highest = forces.into_iter().fold(highest, f64::max);
                }
                name if name.starts_with("Event") => event.extend(values.as_object().unwrap().clone()),
                _ => {}
            }
        }
    }
    let counts = &last["counts"];
    for name in ["Alarm", "EventJudgement", "EventForce", "EventInstant", "EventCourse", "EventMass"] {
        assert_eq!(counts[name], 1, "{name}: {counts}");
    }
    assert!(number(&counts["Samples"]) > 1_000.0, "a thousand values a second, three to a frame: {counts}");
    // A mean of 1 ms at the top of a blow of some 50 ms is the peak, but for the noise.
    let peak = number(&event["Peak"]);
    assert!((highest - peak).abs() < 0.01 * peak + 1.0, "{highest} N streamed, {event:?}");
    assert!((number(&event["EffectiveMass"]) - 6.1).abs() < 1e-9, "{event:?}");
}

/// Every object reads as the EDS file says: type, access, and abort codes where it cannot.
#[test]
fn every_object_is_as_the_eds_file_says() {
    let Some(lab) = Lab::new(43_708) else { return };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/every_object.py");
    let output = Command::new(&lab.python)
        .arg(script)
        .env("PYTHONPATH", examples())
        .args(["--channel", &lab.group, "--port", &lab.port.to_string()])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("objects are as described"), "{said}");
}

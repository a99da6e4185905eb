//! How many frames a second the host understands on one core: a log as `thud log` writes it, through the very code of `thud monitor`,
//! beside python-can and cantools on the same log.
//!
//! `cargo bench -p thud --bench decoding [-- FRAMES]`, two million if not said otherwise. Python (target/venv, or THUD_PYTHON) reads the
//! first 200 000 of them; without it its rows are missing.

use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud::bus::log::{Lines, LogBus};
use thud::bus::{Heard, candump};
use thud::client::Client;
use thud::client::watch::{Happening, Watch};
use thud_firmware::board::Frame;
use thud_firmware::dictionary::frame::{Part, Saturated};
use thud_firmware::stream::{STREAM_BASE, Samples};
use thud_firmware::units::Hertz;

/// Frames that Python reads.
const PYTHON_FRAMES: usize = 200_000;

/// Reads with python-can, and then decodes with cantools what it read.
const PYTHON: &str = r#"
import sys, time
import can, cantools
database = cantools.database.load_file(sys.argv[2])
known = {message.frame_id: message for message in database.messages}
begin = time.perf_counter()
messages = list(can.CanutilsLogReader(sys.argv[1]))
read = time.perf_counter()
decoded = 0
for message in messages:
    meaning = known.get(message.arbitration_id)
    if meaning is not None:
        meaning.decode(message.data)
        decoded += 1
done = time.perf_counter()
print(len(messages) / (read - begin), len(messages) / (done - begin), decoded)
"#;

fn main() {
    let frames = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(2_000_000);
    let log = write_log("decoding.log", frames);
    let short = write_log("decoding-short.log", PYTHON_FRAMES.min(frames));
    println!("A log of {frames} frames of ten sensors: streams, events, alarms, heartbeats, SDO. One core.\n");
    println!("| | frames/s |\n|---|---|");
    let (lines, seconds) = parsed(&log);
    println!("| thud: lines into frames | {:.2e} |", lines as f64 / seconds);
    let (events, seconds) = monitored(&log);
    println!("| thud: as `monitor --bus log:` reads it, {events} events | {:.2e} |", frames as f64 / seconds);
    if let Some((read, decoded)) = python(&short) {
        println!("| python-can: lines into messages | {read:.2e} |");
        println!("| python-can and cantools | {decoded:.2e} |");
    }
}

/// What ten sensors put on a bus: mostly streams, now and then a blow.
fn write_log(name: &str, frames: usize) -> PathBuf {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut text = Vec::with_capacity(frames * 48);
    let mut numbers = [0_u16; 10];
    let mut values = [0_u16; 10];
    let mut written = 0;
    let mut put = |frame: Frame| {
        let at = Duration::from_secs(1_795_262_400) + Duration::from_micros(140 * written as u64);
        candump::write(&mut text, at, "can0", &frame, false);
        written += 1;
        written < frames
    };
    let frame = |id: u16, data: [u8; 8]| Frame { id, len: 8, data };
    'full: loop {
        let sensor: usize = random.random_range(0..10);
        let node = 0x20 + sensor as u16;
        match random.random_range(0..100) {
            0..2 => {
                numbers[sensor] = numbers[sensor].wrapping_add(1);
                let [low, high] = numbers[sensor].to_le_bytes();
                for part in Part::ALL {
                    let mut data: [u8; 8] = random.random();
                    (data[0], data[1]) = (low, high);
                    if part == Part::Judgement {
                        (data[2], data[3], data[5]) = (data[2] % 4, Saturated::empty().bits(), data[5] & 0x0F);
                    }
                    if !put(frame(part.base() + node, data)) {
                        break 'full;
                    }
                }
                continue;
            }
            2..4 => {
                let mut data: [u8; 8] = random.random();
                data[1] &= 1;
                if !put(frame(node, data)) {
                    break;
                }
            }
            4..8 => {
                if !put(Frame::new(0x700 + node, &[5]).expect("a heartbeat")) {
                    break;
                }
            }
            8..30 => {
                if !put(frame(0x580 + node, random.random())) {
                    break;
                }
            }
            _ => {
                let forces = [(); 3].map(|()| random.random_range(-50.0..400.0));
                let data = Samples::encode(values[sensor], &forces);
                values[sensor] = values[sensor].wrapping_add(3);
                if !put(frame(STREAM_BASE + node, data)) {
                    break;
                }
            }
        }
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).expect("the log can be written");
    path
}

fn parsed(log: &Path) -> (u64, f64) {
    let began = Instant::now();
    let mut lines = Lines::new(BufReader::with_capacity(1 << 20, std::fs::File::open(log).expect("the log is there")));
    let mut frames = 0;
    while let Some(line) = lines.read().expect("the log can be read") {
        frames += u64::from(matches!(line.expect("a sound line").heard, Heard::Frame(_)));
    }
    (frames, began.elapsed().as_secs_f64())
}

fn monitored(log: &Path) -> (usize, f64) {
    let began = Instant::now();
    let mut client = Client::new(Box::new(LogBus::open(log, None).expect("the log is there")));
    let mut watch = Watch::listening(Hertz(20_000.0));
    let mut events = 0;
    while !client.line().ended() {
        let happened = watch.next(&mut client, Duration::from_millis(50)).expect("a log does not fail");
        events += happened.iter().filter(|happening| matches!(happening, Happening::Event(_))).count();
    }
    (events, began.elapsed().as_secs_f64())
}

/// Frames a second of python-can alone and with cantools.
fn python(log: &Path) -> Option<(f64, f64)> {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let python = std::env::var_os("THUD_PYTHON").map_or_else(|| top.join("target/venv/bin/python"), PathBuf::from);
    let output = Command::new(python).args(["-c", PYTHON]).arg(log).arg(top.join("docs/can/thud.dbc")).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let mut words = text.split_whitespace().map(str::parse::<f64>);
    Some((words.next()?.ok()?, words.next()?.ok()?))
}

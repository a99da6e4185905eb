//! The real python-can at the other end of a serial line: SLCAN over a pair of pseudo terminals, both ways.
//!
//! Needs a Python with `python-can` and `pyserial`, see `python.rs`.
#![cfg(target_os = "linux")]

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use thud::bus::address::BusAddress;
use thud::bus::{Bus, Stamped};
use thud_firmware::board::Frame;

mod python;

/// Two pseudo terminals wired to each other. python-can opens one; the name of the other is printed. Every frame comes back with
/// its data reversed under the next identifier. After 0x7FE: kinds that CANopen does not use, a refusal, noise, a frame.
const ECHO: &str = r#"
import os, pty, sys, threading, time, tty
import can
ends = []
for _ in range(2):
    master, slave = pty.openpty()
    tty.setraw(slave)
    ends.append((master, slave, os.ttyname(slave)))
told = bytearray()
def wire(source, sink, keep):
    while True:
        try:
            data = os.read(source, 4096)
        except OSError:
            return
        if keep:
            told.extend(data)
        os.write(sink, data)
for (one, other, keep) in ((ends[0][0], ends[1][0], True), (ends[1][0], ends[0][0], False)):
    threading.Thread(target=wire, args=(one, other, keep), daemon=True).start()
bus = can.Bus(interface="slcan", channel=ends[1][2], bitrate=500000, sleep_after_open=0)
print(ends[0][2], flush=True)
while True:
    message = bus.recv(30)
    if message is None:
        sys.exit("nothing was heard for 30 s")
    assert not message.is_extended_id and message.dlc == len(message.data), message
    bus.send(can.Message(arbitration_id=(message.arbitration_id + 1) % 0x7FE, is_extended_id=False,
                         data=bytes(reversed(message.data))))
    if message.arbitration_id == 0x7FE:
        break
assert bytes(told).startswith(b"\rC\rS6\rO\r"), bytes(told[:40])
bus.send(can.Message(arbitration_id=0x12345678, is_extended_id=True, data=[1]))
bus.send(can.Message(arbitration_id=5, is_extended_id=False, is_remote_frame=True, dlc=4))
bus.serialPortOrig.write(b"\x07noise\r")
bus.send(can.Message(arbitration_id=7, is_extended_id=False, data=[7]))
time.sleep(30)
"#;

struct Echo(Child, String);

impl Echo {
    fn start(python: &std::path::Path) -> Self {
        let mut child = Command::new(python).args(["-c", ECHO]).stdout(Stdio::piped()).spawn().expect("python starts");
        let mut port = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut port).unwrap();
        assert!(port.starts_with("/dev/"), "python-can opened the line: {port}");
        Self(child, port.trim().to_owned())
    }
}

impl Drop for Echo {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn next(bus: &mut dyn Bus) -> Stamped {
    bus.receive(Duration::from_secs(20))
        .unwrap()
        .unwrap_or_else(|| panic!("python-can fell silent: {:?}", bus.counters()))
}

#[test]
fn python_can_and_thud_exchange_frames_over_a_serial_line() {
    let Some(python) = python::python("can, serial") else { return };
    let echo = Echo::start(&python);
    let address: BusAddress = format!("slcan:{},bitrate=500000", echo.1).parse().unwrap();
    let mut bus = address.open().unwrap();

    let lengths = (0..=8_u8)
        .map(|length| Frame::new(0x100 + u16::from(length), &[0xFF, 0, 1, 0x80, 4, 5, 6, 7][..length.into()]).unwrap());
    let frames: Vec<Frame> = lengths
        .chain([0x000, 0x001, 0x7FD].map(|id| Frame::new(id, &[0x55]).unwrap()))
        .chain([Frame::new(0x7FE, &[1, 2]).unwrap()])
        .collect();
    for frame in &frames {
        bus.send(frame).unwrap();
        let answer = next(bus.as_mut()).frame;
        let mut reversed = frame.bytes().to_vec();
        reversed.reverse();
        assert_eq!((answer.id, answer.bytes()), ((frame.id + 1) % 0x7FE, &reversed[..]));
    }
    assert_eq!(next(bus.as_mut()).frame, Frame::new(7, &[7]).unwrap());
    let counters = bus.counters();
    assert_eq!((counters.sent, counters.received), (frames.len() as u64, frames.len() as u64 + 1));
    assert_eq!((counters.foreign, counters.refused, counters.malformed), (2, 1, 1), "{counters:?}");
}

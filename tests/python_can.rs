//! The real python-can on the other side of our `udp_multicast`, both ways, over IPv4 and IPv6.
//!
//! Needs a Python with `python-can` and `msgpack`: `THUD_PYTHON`, or the virtual environment that the test command
//! makes in `target/venv`. Without one, and without `CI=true`, it says so and is skipped.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use multicast::group;
use python::python;
use thud::bus::address::BusAddress;
use thud::bus::{Bus, Stamped};
use thud_firmware::board::Frame;

mod multicast;
mod python;

/// Says when it is ready, and returns every frame with its data reversed under the next identifier. After 0x7FE it
/// sends the kinds of frames that CANopen does not use, a packet that is no frame, and ends.
const ECHO: &str = r#"
import sys, can
from can.interfaces.udp_multicast.utils import pack_message
group, port = sys.argv[1], int(sys.argv[2])
bus = can.Bus(interface="udp_multicast", channel=group, port=port)
print("ready", flush=True)
own = set()
while True:
    message = bus.recv(30)
    if message is None:
        sys.exit("nothing was heard for 30 s")
    key = (message.arbitration_id, bytes(message.data))
    if key in own:  # python-can hears its own frames
        own.discard(key)
        continue
    assert not message.is_extended_id and not message.is_fd and message.dlc == len(message.data), message
    answer = can.Message(arbitration_id=(message.arbitration_id + 1) % 0x7FE, is_extended_id=False,
                         data=bytes(reversed(message.data)))
    own.add((answer.arbitration_id, bytes(answer.data)))
    bus.send(answer)
    if message.arbitration_id == 0x7FE:
        break
bus.send(can.Message(arbitration_id=0x12345678, is_extended_id=True, data=[1]))
bus.send(can.Message(arbitration_id=5, is_extended_id=False, is_remote_frame=True, dlc=4))
bus.send(can.Message(arbitration_id=6, is_extended_id=False, is_fd=True, dlc=64, data=bytes(64)))
bus.send(can.Message(arbitration_id=7, is_extended_id=False, is_error_frame=True))
bus._multicast.send(b"no frame")
"#;

struct Echo(Child);

impl Echo {
    fn start(python: &std::path::Path, group: &str, port: u16) -> Self {
        let mut child = Command::new(python)
            .args(["-c", ECHO, group, &port.to_string()])
            .stdout(Stdio::piped())
            .spawn()
            .expect("python starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        assert_eq!(line.trim(), "ready", "python-can opened the bus");
        Self(child)
    }
}

impl Drop for Echo {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn exchange(group: &str, written: &str, port: u16) {
    let Some(python) = python("can, msgpack") else { return };
    let address: BusAddress = written.parse().unwrap();
    let mut bus = match address.open() {
        Ok(bus) => bus,
        Err(error) => {
            // `cargo xtask vcan` brings a kernel with both along.
            let wanted = std::env::var_os("THUD_VCAN").is_some();
            assert!(group.contains(':') && !wanted, "multicast must work: {error}");
            println!("skipped, no IPv6 multicast here: {error}");
            return;
        }
    };
    let mut echo = Echo::start(&python, group, port);

    let mut frames: Vec<Frame> = (0..=8_u8)
        .map(|length| Frame::new(0x100 + u16::from(length), &[0xFF, 0, 1, 0x80, 4, 5, 6, 7][..length.into()]).unwrap())
        .collect();
    frames.push(Frame::new(0, &[1, 0x20]).unwrap());
    frames.push(Frame::new(0x7FD, &[0; 8]).unwrap());
    for frame in frames {
        bus.send(&frame).unwrap();
        let Stamped { frame: answer, .. } = next(bus.as_mut());
        assert_eq!(answer.id, (frame.id + 1) % 0x7FE);
        assert!(answer.bytes().iter().rev().eq(frame.bytes()), "{frame:?} came back as {answer:?}");
    }

    // Foreign and malformed packets are counted. A packet of ours that python-can refuses would have ended it
    // with an error.
    bus.send(&Frame::new(0x7FE, &[9]).unwrap()).unwrap();
    assert_eq!(next(bus.as_mut()).frame.bytes(), [9]);
    assert!(echo.0.wait().unwrap().success());
    assert_eq!(bus.receive(Duration::from_millis(100)).unwrap(), None);
    let counters = bus.counters();
    assert_eq!((counters.foreign, counters.malformed, counters.lost), (4, 1, 0), "{counters:?}");
}

fn next(bus: &mut dyn Bus) -> Stamped {
    bus.receive(Duration::from_secs(10)).unwrap().expect("python-can answers")
}

#[test]
fn python_can_and_thud_exchange_frames_over_ipv4() {
    let group = group();
    exchange(&group, &format!("udp:{group}:43301"), 43_301);
}

#[test]
fn python_can_and_thud_exchange_frames_over_ipv6() {
    // Site-local as python-can's default group is.
    let group = format!("ff15::{:x}", std::process::id() & 0xFFFF);
    exchange(&group, &format!("udp:[{group}]:43302"), 43_302);
}

/// What a person gets who types nothing: both sides' defaults meet.
#[test]
fn the_defaults_are_python_cans() {
    let Some(python) = python("can, msgpack") else { return };
    let script = "from can.interfaces.udp_multicast import UdpMulticastBus as B; \
                  print(B.DEFAULT_GROUP_IPv4, B.DEFAULT_GROUP_IPv6, __import__('inspect').signature(B).parameters['port'].default)";
    let output = Command::new(python).args(["-c", script]).output().unwrap();
    let [v4, v6, port] = String::from_utf8(output.stdout)
        .unwrap()
        .split_whitespace()
        .map(str::to_owned)
        .collect::<Vec<_>>()
        .try_into()
        .unwrap();
    assert_eq!(BusAddress::default().to_string(), format!("udp:{v4}:{port}"));
    assert_eq!("udp6".parse::<BusAddress>().unwrap().to_string(), format!("udp:[{v6}]:{port}"));
}

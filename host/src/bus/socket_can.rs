//! SocketCAN: Linux's own CAN interfaces, real (`can0`) or virtual (`vcan0`).
//!
//! What the kernel drops because this program reads too slowly is counted (`SO_RXQ_OVFL` comes with each frame), and error frames
//! of the driver (bus-off, lost arbitration, overruns of the controller) are asked for and counted. A full send queue
//! (`ENOBUFS`) is waited for, and then an error: nothing is dropped in silence. Bit rate and up/down belong to the
//! system: `ip link set can0 up type can bitrate 1000000 restart-ms 100`.

use std::io::{self, IoSliceMut};
use std::os::fd::AsRawFd as _;
use std::time::{Duration, Instant};

use nix::sys::socket::{ControlMessageOwned, MsgFlags, SockaddrStorage, recvmsg, setsockopt, sockopt};
use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame as _, Socket as _, SocketOptions as _, StandardId};
use thud_firmware::board::Frame;

use super::{Bus, BusError, Counters, Heard, Stamped};

/// A full send queue is retried for this long; a bus on which nobody acknowledges never empties it.
const SEND_PATIENCE: Duration = Duration::from_millis(200);

/// `struct can_frame` of linux/can.h: identifier with flags, length, three bytes of padding, data.
const CAN_FRAME: usize = 16;
const EXTENDED: u32 = 1 << 31;
const REMOTE: u32 = 1 << 30;
const ERROR: u32 = 1 << 29;
/// Error classes of linux/can/error.h that mean that frames were lost: transmit timeout, controller problem (overrun), bus-off.
const LOSING: u32 = 0x0001 | 0x0004 | 0x0040;
const CONTROLLER: u32 = 0x0004;
/// `data[1]` of a controller problem: receive or transmit buffer overrun.
const OVERRUN: u8 = 0x01 | 0x02;

/// A bus on a CAN interface of this computer.
pub struct SocketCanBus {
    socket: CanSocket,
    interface: String,
    opened: Instant,
    counters: Counters,
    /// The kernel's count of what it dropped in front of this socket.
    dropped: u32,
}

impl SocketCanBus {
    /// Opens an interface.
    ///
    /// # Errors
    /// [`BusError::Open`], with the commands that bring an interface up.
    pub fn open(interface: &str) -> Result<Self, BusError> {
        let failed = |step: &'static str| {
            move |source: io::Error| BusError::Open {
                bus: describe(interface),
                step,
                help: interface_help(&source, interface),
                source,
            }
        };
        let socket = CanSocket::open(interface).map_err(failed("opening the CAN interface"))?;
        socket.set_error_filter_accept_all().map_err(failed("asking for error frames"))?;
        setsockopt(&socket, sockopt::RxqOvfl, &1)
            .map_err(|error| failed("asking for the count of dropped frames")(error.into()))?;
        Ok(Self {
            socket,
            interface: interface.to_owned(),
            opened: Instant::now(),
            counters: Counters::default(),
            dropped: 0,
        })
    }

    /// One frame as the kernel gives it.
    fn read(&mut self) -> io::Result<[u8; CAN_FRAME]> {
        let mut bytes = [0; CAN_FRAME];
        let mut room = nix::cmsg_space!(u32);
        let mut pieces = [IoSliceMut::new(&mut bytes)];
        let message =
            recvmsg::<SockaddrStorage>(self.socket.as_raw_fd(), &mut pieces, Some(&mut room), MsgFlags::empty())?;
        let length = message.bytes;
        for control in message.cmsgs()? {
            if let ControlMessageOwned::RxqOvfl(dropped) = control {
                // The kernel's counter wraps.
                self.counters.lost += u64::from(dropped.wrapping_sub(self.dropped));
                self.dropped = dropped;
            }
        }
        if length == CAN_FRAME {
            Ok(bytes)
        } else {
            Err(io::Error::new(io::ErrorKind::InvalidData, format!("a CAN frame of {length} bytes")))
        }
    }

    fn sort(&mut self, bytes: &[u8; CAN_FRAME]) -> Option<Frame> {
        match decode(bytes) {
            Some((Heard::Frame(frame), _)) => {
                self.counters.received += 1;
                Some(frame)
            }
            Some((Heard::Foreign(_), lost)) => {
                self.counters.foreign += 1;
                self.counters.lost += u64::from(lost);
                None
            }
            None => {
                self.counters.malformed += 1;
                self.counters.last_malformed = Some(format!("a CAN frame with length {}", bytes[4]));
                None
            }
        }
    }
}

/// Reads `struct can_frame`; with an error frame, whether frames were lost. `None` for an impossible length.
fn decode(bytes: &[u8; CAN_FRAME]) -> Option<(Heard, bool)> {
    let id = u32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let data = bytes[8..].get(..usize::from(bytes[4]))?;
    let heard = if id & ERROR != 0 {
        let overrun = id & CONTROLLER == 0 || bytes[9] & OVERRUN != 0;
        return Some((Heard::Foreign("error frame"), id & LOSING != 0 && overrun));
    } else if id & REMOTE != 0 {
        Heard::Foreign("remote request")
    } else if id & EXTENDED != 0 {
        Heard::Foreign("29-bit identifier")
    } else {
        Heard::Frame(Frame::new((id & 0x7FF) as u16, data)?)
    };
    Some((heard, false))
}

impl Bus for SocketCanBus {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        const ENOBUFS: i32 = 105;
        let bus = describe(&self.interface);
        let message = StandardId::new(frame.id).and_then(|id| CanDataFrame::new(id, frame.bytes()));
        let Some(message) = message else {
            let source = io::Error::new(io::ErrorKind::InvalidInput, format!("identifier 0x{:X}", frame.id));
            return Err(BusError::Send { bus, source, help: None });
        };
        let began = Instant::now();
        loop {
            match self.socket.write_frame(&message) {
                Ok(()) => {
                    self.counters.sent += 1;
                    return Ok(());
                }
                Err(error)
                    if (error.kind() == io::ErrorKind::WouldBlock || error.raw_os_error() == Some(ENOBUFS))
                        && began.elapsed() < SEND_PATIENCE =>
                {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Err(source) => {
                    let help = match source.raw_os_error() {
                        Some(ENOBUFS) => Some(
                            "the send queue stays full: nobody acknowledges. Is another node on the bus, at the same bit \
                             rate, with both terminations?"
                                .to_owned(),
                        ),
                        _ => interface_help(&source, &self.interface),
                    };
                    return Err(BusError::Send { bus, source, help });
                }
            }
        }
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let deadline = Instant::now() + timeout;
        let failed = |bus: &Self, source| BusError::Receive { bus: describe(&bus.interface), source };
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let ready = if left.is_zero() {
                self.socket.set_nonblocking(true)
            } else {
                self.socket.set_nonblocking(false).and_then(|()| self.socket.set_read_timeout(left))
            };
            ready.map_err(|source| failed(self, source))?;
            match self.read() {
                Ok(bytes) => {
                    let at = self.opened.elapsed();
                    if let Some(frame) = self.sort(&bytes) {
                        return Ok(Some(Stamped { frame, at }));
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(None),
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    if Instant::now() >= deadline {
                        return Ok(None);
                    }
                }
                Err(source) => return Err(failed(self, source)),
            }
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn describe(&self) -> String {
        describe(&self.interface)
    }

    fn counters(&self) -> Counters {
        self.counters.clone()
    }
}

fn describe(interface: &str) -> String {
    format!("SocketCAN {interface}")
}

fn interface_help(error: &io::Error, interface: &str) -> Option<String> {
    const ENODEV: i32 = 19;
    const EAFNOSUPPORT: i32 = 97;
    const ENETDOWN: i32 = 100;
    let virtual_one = interface.starts_with("vcan");
    match error.raw_os_error() {
        Some(ENODEV) if virtual_one => Some(format!(
            "there is no such interface. As root: `modprobe vcan`, `ip link add {interface} type vcan`, `ip link set \
             {interface} up`"
        )),
        Some(ENODEV) => Some("there is no such interface; `ip -details link show type can` lists those there are".to_owned()),
        Some(ENETDOWN) => Some(format!(
            "the interface is down. As root: `ip link set {interface} up type can bitrate 1000000 restart-ms 100`"
        )),
        Some(EAFNOSUPPORT) => Some(
            "this kernel has no CAN (`modprobe can_raw`, or another kernel). `--bus slcan:PORT` and `--bus udp` work without"
                .to_owned(),
        ),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(id: u32, length: u8, data: &[u8]) -> [u8; CAN_FRAME] {
        let mut bytes = [0; CAN_FRAME];
        bytes[..4].copy_from_slice(&id.to_ne_bytes());
        bytes[4] = length;
        bytes[8..8 + data.len()].copy_from_slice(data);
        bytes
    }

    #[test]
    fn kernel_frames_are_told_apart() {
        let frame = Frame::new(0x1A0, &[1, 2, 3]).unwrap();
        assert_eq!(decode(&raw(0x1A0, 3, &[1, 2, 3])), Some((Heard::Frame(frame), false)));
        assert_eq!(decode(&raw(0x1A0, 9, &[])), None);
        assert_eq!(decode(&raw(0x1A0 | REMOTE, 3, &[])), Some((Heard::Foreign("remote request"), false)));
        assert_eq!(decode(&raw(0x1A0 | EXTENDED, 0, &[])), Some((Heard::Foreign("29-bit identifier"), false)));
        let error = Heard::Foreign("error frame");
        assert_eq!(decode(&raw(ERROR | 0x40, 8, &[])), Some((error, true)), "bus-off");
        assert_eq!(decode(&raw(ERROR | 0x04, 8, &[0, 0x01])), Some((error, true)), "overrun");
        assert_eq!(decode(&raw(ERROR | 0x04, 8, &[0, 0x10])), Some((error, false)), "error passive loses nothing yet");
    }

    #[test]
    fn an_interface_that_cannot_be_opened_comes_with_the_remedy() {
        // Whether the kernel has no CAN, or no such interface: either is said with what to do.
        let Err(BusError::Open { help, .. }) = SocketCanBus::open("vcan93") else { panic!("who has a vcan93?") };
        let help = help.expect("a remedy");
        assert!(help.contains("ip link add vcan93") || help.contains("slcan"), "{help}");
    }
}

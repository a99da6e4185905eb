//! SLCAN: an adapter that speaks LAWICEL's ASCII on a serial port (CANable, CANUSB, USBtin, …).
//!
//! ```text
//! open    C ⏎ (close)   S8 ⏎ (1 Mbit/s)   O ⏎ (open)
//! frame   t 1A0 8 0102030405060708 ⏎   both ways
//! answer  ⏎ done    z ⏎ frame taken    BEL refused    F04 ⏎ status
//! ```
//!
//! The protocol has no end-to-end acknowledgement and no numbers. What can be noticed is counted: lines that are no
//! frame, commands that the adapter refused, and what its status flags say it has lost.

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use thud_firmware::board::Frame;

use self::codec::{Decoder, Line};
use super::{Bus, BusError, Counters, Heard, Stamped};

pub mod codec;

/// Serial speed where none is given; USB adapters ignore it. At 115 200 baud a line carries about 460 frames a second,
/// a tenth of what a bus at 1 Mbit/s can.
pub const BAUD: u32 = 115_200;

/// CAN bit rates that the protocol has a command for, `S0` to `S8`.
pub const BIT_RATES: [u32; 9] = [10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

/// How long an adapter may take to take a line.
const WRITE_PATIENCE: Duration = Duration::from_millis(500);
/// Pause between the commands that open the channel: adapters drop what comes while they close.
const SETTLE: Duration = Duration::from_millis(20);
/// Status is asked for this often; its flags are the only news of frames that the adapter lost.
const STATUS: Duration = Duration::from_secs(2);
/// Bits of the status byte that mean lost frames: receive FIFO full, transmit FIFO full, data overrun (LAWICEL manual,
/// "F[CR]").
const LOST: u8 = 1 << 0 | 1 << 1 | 1 << 3;

/// The line that a port is: a serial port, or the end of a pipe in a test.
pub trait Port: Read + Write {
    /// The longest that a read waits.
    ///
    /// # Errors
    /// The system's.
    fn wait_at_most(&mut self, timeout: Duration) -> io::Result<()>;
}

impl Port for Box<dyn serialport::SerialPort> {
    fn wait_at_most(&mut self, timeout: Duration) -> io::Result<()> {
        self.set_timeout(timeout).map_err(io::Error::from)
    }
}

/// A bus behind an SLCAN adapter.
pub struct SlcanBus {
    port: Box<dyn Port>,
    name: String,
    decoder: Decoder,
    /// Bytes read and not yet decoded.
    read: Vec<u8>,
    at: usize,
    opened: Instant,
    asked: Duration,
    counters: Counters,
}

impl SlcanBus {
    /// Opens the serial port, and the adapter's channel at this CAN bit rate.
    ///
    /// # Errors
    /// [`BusError::Open`].
    pub fn open(port: &str, bit_rate: u32, baud: u32) -> Result<Self, BusError> {
        let name = format!("slcan {port}");
        let serial = serialport::new(port, baud).timeout(WRITE_PATIENCE).open().map_err(|error| BusError::Open {
            bus: name.clone(),
            step: "opening the serial port",
            help: port_help(&error, port),
            source: error.into(),
        })?;
        Self::over(Box::new(serial), name, bit_rate)
    }

    /// Opens the channel of an adapter at the other end of `port`.
    ///
    /// # Errors
    /// [`BusError::Open`].
    pub fn over(port: Box<dyn Port>, name: String, bit_rate: u32) -> Result<Self, BusError> {
        let mut bus = Self {
            port,
            name,
            decoder: Decoder::new(),
            read: Vec::new(),
            at: 0,
            opened: Instant::now(),
            asked: Duration::ZERO,
            counters: Counters::default(),
        };
        let failed = |bus: &Self, step, source| BusError::Open { bus: bus.name.clone(), step, source, help: None };
        let Some(number) = BIT_RATES.iter().position(|known| *known == bit_rate) else {
            let source = io::Error::new(io::ErrorKind::InvalidInput, format!("{bit_rate} bit/s is no SLCAN bit rate"));
            return Err(failed(&bus, "setting the bit rate", source));
        };
        // An empty line ends whatever an earlier program left half written.
        for command in ["\r", "C\r", &format!("S{number}\r"), "O\r"] {
            bus.write(command.as_bytes()).map_err(|source| failed(&bus, "opening the channel", source))?;
            std::thread::sleep(SETTLE);
        }
        Ok(bus)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.wait_at_most(WRITE_PATIENCE)?;
        self.port.write_all(bytes)
    }

    /// Sorts the bytes that were read; the first frame among them.
    fn sort(&mut self) -> Option<Frame> {
        while let Some(&byte) = self.read.get(self.at) {
            self.at += 1;
            match self.decoder.push(byte) {
                None | Some(Ok(Line::Done | Line::Other)) => {}
                Some(Ok(Line::Heard(Heard::Frame(frame)))) => {
                    self.counters.received += 1;
                    return Some(frame);
                }
                Some(Ok(Line::Heard(Heard::Foreign(_)))) => self.counters.foreign += 1,
                Some(Ok(Line::Refused)) => {
                    self.counters.refused += 1;
                }
                Some(Ok(Line::Status(flags))) => self.counters.lost += u64::from(flags & LOST != 0),
                Some(Err(malformed)) => {
                    self.counters.malformed += 1;
                    self.counters.last_malformed = Some(malformed.to_string());
                }
            }
        }
        self.read.clear();
        self.at = 0;
        None
    }
}

impl Bus for SlcanBus {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let line = codec::encode(frame);
        self.write(&line).map_err(|source| {
            let help = (source.kind() == io::ErrorKind::TimedOut).then(|| {
                "the adapter takes no more: is it plugged in, and does anybody acknowledge on its bus?".to_owned()
            });
            BusError::Send { bus: self.name.clone(), source, help }
        })?;
        self.counters.sent += 1;
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let deadline = self.now() + timeout;
        loop {
            if let Some(frame) = self.sort() {
                return Ok(Some(Stamped { frame, at: self.now() }));
            }
            let now = self.now();
            if now >= self.asked + STATUS {
                self.asked = now;
                self.write(b"F\r").map_err(|source| BusError::Receive { bus: self.name.clone(), source })?;
            }
            let left = deadline.saturating_sub(now);
            let mut bytes = [0; 4096];
            // A timeout of zero would wait for ever on some systems.
            let read =
                self.port.wait_at_most(left.max(Duration::from_millis(1))).and_then(|()| self.port.read(&mut bytes));
            match read {
                Ok(0) => {
                    let source = io::Error::new(io::ErrorKind::UnexpectedEof, "the adapter is gone");
                    return Err(BusError::Receive { bus: self.name.clone(), source });
                }
                Ok(count) => self.read.extend_from_slice(&bytes[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(None),
                Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock) => {
                    if self.now() >= deadline {
                        return Ok(None);
                    }
                }
                Err(source) => return Err(BusError::Receive { bus: self.name.clone(), source }),
            }
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn describe(&self) -> String {
        self.name.clone()
    }

    fn counters(&self) -> Counters {
        self.counters.clone()
    }
}

impl Drop for SlcanBus {
    fn drop(&mut self) {
        // Nobody is left who could be told that it did not close.
        let _ = self.write(b"C\r");
    }
}

fn port_help(error: &serialport::Error, port: &str) -> Option<String> {
    match error.kind() {
        serialport::ErrorKind::NoDevice | serialport::ErrorKind::Io(io::ErrorKind::NotFound) => Some(format!(
            "is the adapter plugged in? `ls /dev/ttyACM* /dev/ttyUSB*` shows what is there; {port} is not"
        )),
        serialport::ErrorKind::Io(io::ErrorKind::PermissionDenied) => Some(
            "on Debian and its relatives serial ports belong to the group `dialout`: `adduser NAME dialout`".to_owned(),
        ),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::*;

    /// An adapter: what it was told, and what it will say.
    #[derive(Clone, Default)]
    struct Adapter {
        told: Rc<RefCell<Vec<u8>>>,
        says: Rc<RefCell<Vec<u8>>>,
    }

    impl Read for Adapter {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let mut says = self.says.borrow_mut();
            if says.is_empty() {
                return Err(io::ErrorKind::TimedOut.into());
            }
            // In pieces, as a serial line delivers.
            let count = says.len().min(into.len()).min(3);
            into[..count].copy_from_slice(&says[..count]);
            says.drain(..count);
            Ok(count)
        }
    }

    impl Write for Adapter {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.told.borrow_mut().extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Port for Adapter {
        fn wait_at_most(&mut self, _: Duration) -> io::Result<()> {
            Ok(())
        }
    }

    const NOW: Duration = Duration::ZERO;

    #[test]
    fn the_channel_is_opened_at_its_bit_rate_and_closed() {
        let adapter = Adapter::default();
        let mut bus = SlcanBus::over(Box::new(adapter.clone()), "test".to_owned(), 500_000).unwrap();
        bus.send(&Frame::new(0x1A0, &[1, 0xAB]).unwrap()).unwrap();
        drop(bus);
        assert_eq!(String::from_utf8(adapter.told.borrow().clone()).unwrap(), "\rC\rS6\rO\rt1A0201AB\rC\r");
        assert!(SlcanBus::over(Box::new(adapter), "test".to_owned(), 300_000).is_err());
    }

    #[test]
    fn frames_come_in_order_and_all_else_is_counted() {
        let adapter = Adapter::default();
        let mut bus = SlcanBus::over(Box::new(adapter.clone()), "test".to_owned(), 1_000_000).unwrap();
        adapter.says.borrow_mut().extend_from_slice(
            b"\r\r\rz\rt0202AABB\rF08\r\x07T12345678101\rr1234\rt1zz0\rt7FF0\rtoo long to be anything that an adapter says, by far too long for it to be so, and it goes on still\rt00181122334455667788BEEF\r",
        );
        let frames: Vec<Frame> =
            std::iter::from_fn(|| bus.receive(NOW).unwrap().map(|stamped| stamped.frame)).collect();
        assert_eq!(
            frames,
            [
                Frame::new(0x020, &[0xAA, 0xBB]).unwrap(),
                Frame::new(0x7FF, &[]).unwrap(),
                Frame::new(0x001, &[0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88]).unwrap(),
            ]
        );
        let counters = bus.counters();
        assert_eq!((counters.received, counters.foreign, counters.malformed), (3, 2, 2));
        assert_eq!((counters.lost, counters.refused), (1, 1));
    }
}

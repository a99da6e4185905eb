//! `--bus`: which bus, in one word.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::path::PathBuf;
use std::str::FromStr;

use super::log::LogBus;
use super::slcan::{self, SlcanBus};
use super::udp::UdpBus;
use super::{Bus, BusError};

/// python-can's default group over IPv4 (`UdpMulticastBus.DEFAULT_GROUP_IPv4`).
pub const GROUP_V4: Ipv4Addr = Ipv4Addr::new(239, 74, 163, 2);

/// python-can's default group over IPv6 (`UdpMulticastBus.DEFAULT_GROUP_IPv6`, "python" and "democast" in ASCII).
pub const GROUP_V6: Ipv6Addr = Ipv6Addr::new(0xff15, 0x7079, 0x7468, 0x6f6e, 0x6465, 0x6d6f, 0x6d63, 0x6173);

/// python-can's default port.
pub const PORT: u16 = 43_113;

/// The address of a bus as a person types it.
#[derive(Clone, Debug, PartialEq)]
pub enum BusAddress {
    /// A CAN interface of Linux.
    SocketCan {
        /// Its name: `can0`.
        interface: String,
    },
    /// An adapter on a serial port.
    Slcan {
        /// The port: `/dev/ttyACM0`, `COM3`.
        port: String,
        /// Bits per second on the CAN bus.
        bit_rate: u32,
        /// Bits per second on the serial line.
        baud: u32,
    },
    /// A candump log that is played back.
    Log {
        /// The file.
        path: PathBuf,
        /// How much faster than life; `None` as fast as it can be read.
        pace: Option<f64>,
    },
    /// python-can's `udp_multicast`.
    Udp {
        /// Multicast group.
        group: IpAddr,
        /// UDP port.
        port: u16,
    },
}

impl Default for BusAddress {
    fn default() -> Self {
        Self::Udp { group: GROUP_V4.into(), port: PORT }
    }
}

impl BusAddress {
    /// Opens the bus.
    ///
    /// # Errors
    /// [`BusError::Open`] with what would be right, where that is known.
    pub fn open(&self) -> Result<Box<dyn Bus>, BusError> {
        match self {
            Self::Udp { group, port } => Ok(Box::new(UdpBus::open(*group, *port)?)),
            Self::Slcan { port, bit_rate, baud } => Ok(Box::new(SlcanBus::open(port, *bit_rate, *baud)?)),
            Self::Log { path, pace } => Ok(Box::new(LogBus::open(path, *pace)?)),
            Self::SocketCan { interface } => socket_can(interface),
        }
    }

    /// What the interface is called in a log.
    #[must_use]
    pub fn interface(&self) -> &str {
        match self {
            Self::SocketCan { interface } => interface,
            _ => "can0",
        }
    }
}

#[cfg(target_os = "linux")]
fn socket_can(interface: &str) -> Result<Box<dyn Bus>, BusError> {
    Ok(Box::new(super::socket_can::SocketCanBus::open(interface)?))
}

#[cfg(not(target_os = "linux"))]
fn socket_can(interface: &str) -> Result<Box<dyn Bus>, BusError> {
    Err(BusError::Open {
        bus: format!("SocketCAN {interface}"),
        step: "opening the CAN interface",
        source: std::io::ErrorKind::Unsupported.into(),
        help: Some("SocketCAN exists on Linux only; elsewhere an adapter speaks SLCAN: `--bus slcan:PORT`".to_owned()),
    })
}

impl std::fmt::Display for BusAddress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Udp { group: IpAddr::V4(group), port } => write!(f, "udp:{group}:{port}"),
            Self::Udp { group: IpAddr::V6(group), port } => write!(f, "udp:[{group}]:{port}"),
            Self::SocketCan { interface } => write!(f, "socketcan:{interface}"),
            Self::Slcan { port, bit_rate, baud } => write!(f, "slcan:{port},bitrate={bit_rate},baud={baud}"),
            Self::Log { path, pace: None } => write!(f, "log:{}", path.display()),
            Self::Log { path, pace: Some(pace) } => write!(f, "log:{},pace={pace}", path.display()),
        }
    }
}

/// Why a word is not a bus.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AddressError {
    /// The group is not an address.
    #[error("`{0}` is not an IP address; a multicast group is written `udp:239.74.163.2` or `udp:[ff15::1]:43113`")]
    Group(String),
    /// The group is an address, but of one host.
    #[error("{0} is not a multicast group (IPv4: 224.0.0.0 to 239.255.255.255; IPv6: beginning with ff)")]
    NotMulticast(IpAddr),
    /// The port is not a port.
    #[error("`{0}` is not a UDP port (1 to 65535)")]
    Port(String),
    /// A port or file is missing.
    #[error("`{0}:` needs what to open: `slcan:/dev/ttyACM0`, `log:FILE`, `socketcan:can0`")]
    Nothing(String),
    /// An option that the transport does not have, or an impossible value.
    #[error("`{option}` is no option of {transport}: {right}")]
    Option {
        /// The transport.
        transport: &'static str,
        /// What was written.
        option: String,
        /// What would be right.
        right: &'static str,
    },
    /// Nothing that is known.
    #[error(
        "`{0}` is no bus; known are `can0` (or another interface, `socketcan:NAME`), `slcan:PORT`, `udp`, `udp6`, \
         `udp:GROUP`, `udp:GROUP:PORT` and `log:FILE`"
    )]
    Unknown(String),
}

impl FromStr for BusAddress {
    type Err = AddressError;

    fn from_str(word: &str) -> Result<Self, AddressError> {
        let (transport, rest) = match word.split_once(':') {
            Some((transport, rest)) => (transport, Some(rest)),
            None => (word, None),
        };
        match (transport, rest) {
            ("udp", None) => Ok(Self::default()),
            ("udp6", None) => Ok(Self::Udp { group: GROUP_V6.into(), port: PORT }),
            ("udp" | "udp6", Some(rest)) => udp(rest),
            ("slcan", Some(rest)) if !rest.is_empty() => slcan(rest),
            ("log", Some(rest)) if !rest.is_empty() => log(rest),
            ("socketcan", Some(name)) if !name.is_empty() => Ok(Self::SocketCan { interface: name.to_owned() }),
            ("slcan" | "log" | "socketcan", _) => Err(AddressError::Nothing(transport.to_owned())),
            (name, None) if is_can_interface(name) => Ok(Self::SocketCan { interface: name.to_owned() }),
            _ => Err(AddressError::Unknown(word.to_owned())),
        }
    }
}

/// `can0`, `vcan1`, `slcan0`: how Linux names CAN interfaces.
fn is_can_interface(name: &str) -> bool {
    let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
    letters.len() < name.len() && matches!(letters, "can" | "vcan" | "slcan" | "vxcan")
}

/// What to open, and options after commas; a comma that begins none belongs to the name.
fn options(rest: &str) -> (&str, Vec<(&str, &str)>) {
    let mut name = rest;
    let mut options = Vec::new();
    while let Some((before, (key, value))) =
        name.rsplit_once(',').and_then(|(before, option)| Some((before, option.split_once('=')?)))
    {
        options.push((key, value));
        name = before;
    }
    (name, options)
}

fn slcan(rest: &str) -> Result<BusAddress, AddressError> {
    let (port, options) = options(rest);
    let (mut bit_rate, mut baud) = (1_000_000, slcan::BAUD);
    for (key, value) in options {
        match (key, value.parse::<u32>()) {
            ("bitrate", Ok(bits)) if slcan::BIT_RATES.contains(&bits) => bit_rate = bits,
            ("baud", Ok(bits @ 300..)) => baud = bits,
            _ => {
                return Err(AddressError::Option {
                    transport: "SLCAN",
                    option: format!("{key}={value}"),
                    right: "`bitrate=` takes 10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000 or 1000000, \
                            `baud=` 300 and more",
                });
            }
        }
    }
    Ok(BusAddress::Slcan { port: port.to_owned(), bit_rate, baud })
}

fn log(rest: &str) -> Result<BusAddress, AddressError> {
    let (path, options) = options(rest);
    let mut pace = None;
    for (key, value) in options {
        match (key, value.parse::<f64>()) {
            ("pace", Ok(times)) if times.is_finite() && times > 0.0 => pace = Some(times),
            _ => {
                return Err(AddressError::Option {
                    transport: "a log",
                    option: format!("{key}={value}"),
                    right: "`pace=1` plays it in its own time, `pace=2` twice as fast",
                });
            }
        }
    }
    Ok(BusAddress::Log { path: path.into(), pace })
}

/// `GROUP` or `GROUP:PORT`, with an IPv6 group in brackets where a port follows.
fn udp(rest: &str) -> Result<BusAddress, AddressError> {
    let (group, port) = if let Ok(group) = rest.parse::<IpAddr>() {
        (group, None)
    } else if let Some(bracketed) = rest.strip_prefix('[') {
        let (group, tail) = bracketed.split_once(']').ok_or_else(|| AddressError::Group(rest.to_owned()))?;
        let group = group.parse().map_err(|_| AddressError::Group(group.to_owned()))?;
        match tail.strip_prefix(':') {
            Some(port) => (group, Some(port)),
            None if tail.is_empty() => (group, None),
            None => return Err(AddressError::Port(tail.to_owned())),
        }
    } else {
        let (group, port) = rest.rsplit_once(':').ok_or_else(|| AddressError::Group(rest.to_owned()))?;
        (group.parse().map_err(|_| AddressError::Group(group.to_owned()))?, Some(port))
    };
    if !group.is_multicast() {
        return Err(AddressError::NotMulticast(group));
    }
    let port = match port {
        None => PORT,
        Some(text) => match text.parse::<u16>() {
            Ok(port) if port > 0 => port,
            _ => return Err(AddressError::Port(text.to_owned())),
        },
    };
    Ok(BusAddress::Udp { group, port })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(word: &str) -> Result<BusAddress, String> {
        word.parse().map_err(|error: AddressError| error.to_string())
    }

    #[test]
    fn every_written_form_is_read_back() {
        for (word, full) in [
            ("udp", "udp:239.74.163.2:43113"),
            ("udp6", "udp:[ff15:7079:7468:6f6e:6465:6d6f:6d63:6173]:43113"),
            ("udp:239.1.2.3", "udp:239.1.2.3:43113"),
            ("udp:239.1.2.3:5000", "udp:239.1.2.3:5000"),
            ("udp:ff15::1", "udp:[ff15::1]:43113"),
            ("udp:[ff15::1]:5000", "udp:[ff15::1]:5000"),
            ("can0", "socketcan:can0"),
            ("vcan1", "socketcan:vcan1"),
            ("socketcan:lab", "socketcan:lab"),
            ("slcan:/dev/ttyACM0", "slcan:/dev/ttyACM0,bitrate=1000000,baud=115200"),
            ("slcan:COM3,baud=3000000,bitrate=250000", "slcan:COM3,bitrate=250000,baud=3000000"),
            ("log:a,b.log", "log:a,b.log"),
            ("log:a.log,pace=0.5", "log:a.log,pace=0.5"),
        ] {
            let parsed = address(word).expect(word);
            assert_eq!(parsed.to_string(), full);
            assert_eq!(address(full), Ok(parsed));
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (word, said) in [
            ("udp:192.168.1.1", "192.168.1.1 is not a multicast group"),
            ("udp:somewhere", "`somewhere` is not an IP address"),
            ("udp:239.1.2.3:0", "`0` is not a UDP port"),
            ("udp:239.1.2.3:99999", "`99999` is not a UDP port"),
            ("udp:[ff15::1]5000", "`5000` is not a UDP port"),
            ("slcan", "`slcan:` needs what to open"),
            ("log:", "`log:` needs what to open"),
            ("slcan:COM3,bitrate=3", "`bitrate=3` is no option of SLCAN: `bitrate=` takes 10000"),
            ("slcan:COM3,speed=3", "`speed=3` is no option of SLCAN"),
            ("log:a,pace=-1", "`pace=-1` is no option of a log"),
            ("tcp:1", "`tcp:1` is no bus"),
            ("can", "`can` is no bus"),
            ("", "`` is no bus"),
        ] {
            let error = address(word).unwrap_err();
            assert!(error.contains(said), "{word}: {error}");
        }
    }
}

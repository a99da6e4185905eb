//! `--bus`: which bus, in one word.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::str::FromStr;

use super::udp::UdpBus;
use super::{Bus, BusError};

/// python-can's default group over IPv4 (`UdpMulticastBus.DEFAULT_GROUP_IPv4`).
pub const GROUP_V4: Ipv4Addr = Ipv4Addr::new(239, 74, 163, 2);

/// python-can's default group over IPv6 (`UdpMulticastBus.DEFAULT_GROUP_IPv6`, "python" and "democast" in ASCII).
pub const GROUP_V6: Ipv6Addr = Ipv6Addr::new(0xff15, 0x7079, 0x7468, 0x6f6e, 0x6465, 0x6d6f, 0x6d63, 0x6173);

/// python-can's default port.
pub const PORT: u16 = 43_113;

/// The address of a bus as a person types it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusAddress {
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
        match *self {
            Self::Udp { group, port } => Ok(Box::new(UdpBus::open(group, port)?)),
        }
    }
}

impl std::fmt::Display for BusAddress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Udp { group: IpAddr::V4(group), port } => write!(f, "udp:{group}:{port}"),
            Self::Udp { group: IpAddr::V6(group), port } => write!(f, "udp:[{group}]:{port}"),
        }
    }
}

/// Why a word is not a bus.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// A transport that exists, but not in this version.
    #[error("{what} is not supported yet; this version speaks `udp` (python-can's udp_multicast) only")]
    NotYet {
        /// The transport's name and the word.
        what: String,
    },
    /// The group is not an address.
    #[error("`{0}` is not an IP address; a multicast group is written `udp:239.74.163.2` or `udp:[ff15::1]:43113`")]
    Group(String),
    /// The group is an address, but of one host.
    #[error("{0} is not a multicast group (IPv4: 224.0.0.0 to 239.255.255.255; IPv6: beginning with ff)")]
    NotMulticast(IpAddr),
    /// The port is not a port.
    #[error("`{0}` is not a UDP port (1 to 65535)")]
    Port(String),
    /// Nothing that is known.
    #[error("`{0}` is no bus; known are `udp`, `udp6`, `udp:GROUP` and `udp:GROUP:PORT`")]
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
            ("slcan", _) => Err(AddressError::NotYet { what: format!("SLCAN on a serial port (`{word}`)") }),
            (name, None) if is_can_interface(name) => {
                Err(AddressError::NotYet { what: format!("SocketCAN (`{word}`)") })
            }
            _ => Err(AddressError::Unknown(word.to_owned())),
        }
    }
}

/// `can0`, `vcan1`, `slcan0`: how Linux names CAN interfaces.
fn is_can_interface(name: &str) -> bool {
    let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
    matches!(letters, "can" | "vcan" | "slcan" | "vxcan" | "socketcan")
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
        ] {
            let parsed = address(word).expect(word);
            assert_eq!(parsed.to_string(), full);
            assert_eq!(address(full), Ok(parsed));
        }
    }

    #[test]
    fn transports_to_come_are_named() {
        for (word, name) in [("can0", "SocketCAN"), ("vcan1", "SocketCAN"), ("slcan:/dev/ttyACM0", "SLCAN")] {
            let error = address(word).unwrap_err();
            assert!(error.contains(name) && error.contains("not supported yet"), "{error}");
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
            ("tcp:1", "`tcp:1` is no bus"),
            ("", "`` is no bus"),
        ] {
            let error = address(word).unwrap_err();
            assert!(error.contains(said), "{word}: {error}");
        }
    }
}

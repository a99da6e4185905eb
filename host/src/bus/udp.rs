//! python-can's `udp_multicast`: every packet to a multicast group is one CAN frame.
//!
//! Two programs on one machine are enough for a bus. There is no arbitration, no order between senders, and no
//! guarantee of delivery; what the kernel drops because this program reads too slowly is counted where the kernel
//! tells (Linux, `/proc/net/udp`).
//!
//! Two sockets: one bound to the group's port, which any number of programs share, and one on a port of its own
//! to send from. The sender's address then tells this program's frames from all others, so that it does not hear
//! itself, as on a real bus.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use socket2::{Domain, Protocol, Socket, Type};
use thud_firmware::board::Frame;

use super::{Bus, BusError, Counters, Heard, Stamped, packet};

/// Packets do not leave the local network; python-can's default.
const HOPS: u32 = 1;

/// Asked of the kernel for waiting packets; it grants what `net.core.rmem_max` allows.
const RECEIVE_BUFFER: usize = 4 << 20;

/// A full send queue (`ENOBUFS`) is retried for this long.
const SEND_PATIENCE: Duration = Duration::from_millis(200);

/// A bus over UDP multicast.
pub struct UdpBus {
    receiver: UdpSocket,
    sender: UdpSocket,
    own: SocketAddr,
    group: SocketAddr,
    opened: Instant,
    counters: Counters,
    buffer: Box<[u8; packet::LONGEST]>,
}

impl UdpBus {
    /// Joins the group.
    ///
    /// # Errors
    /// [`BusError::Open`]; where the network carries no multicast, with the commands that change it.
    pub fn open(group: IpAddr, port: u16) -> Result<Self, BusError> {
        let group = SocketAddr::new(group, port);
        let failed = |step: &'static str| {
            move |source: io::Error| BusError::Open {
                bus: describe(group),
                step,
                help: multicast_help(&source, group.ip()),
                source,
            }
        };
        let receiver = receiving_socket(group).map_err(failed("joining the multicast group"))?;
        let sender = sending_socket(group).map_err(failed("finding a way to the multicast group"))?;
        let own = sender.local_addr().map_err(failed("asking for the own address"))?;
        Ok(Self {
            receiver,
            sender,
            own,
            group,
            opened: Instant::now(),
            counters: Counters::default(),
            buffer: Box::new([0; packet::LONGEST]),
        })
    }

    /// Sorts one packet; `None` if it is not a frame for us.
    fn sort(&mut self, length: usize, from: SocketAddr) -> Option<Frame> {
        if from.ip() == self.own.ip() && from.port() == self.own.port() {
            return None;
        }
        match packet::decode(&self.buffer[..length]) {
            Ok(Heard::Frame(frame)) => {
                self.counters.received += 1;
                Some(frame)
            }
            Ok(Heard::Foreign(_)) => {
                self.counters.foreign += 1;
                None
            }
            Err(malformed) => {
                self.counters.malformed += 1;
                self.counters.last_malformed = Some(format!("{malformed} (from {from})"));
                None
            }
        }
    }
}

impl Bus for UdpBus {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
        let packet = packet::encode(frame, now_s);
        let began = Instant::now();
        loop {
            match self.sender.send(&packet) {
                Ok(_) => {
                    self.counters.sent += 1;
                    return Ok(());
                }
                Err(error) if is_full(&error) && began.elapsed() < SEND_PATIENCE => {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Err(source) => {
                    let help = multicast_help(&source, self.group.ip());
                    return Err(BusError::Send { bus: self.describe(), source, help });
                }
            }
        }
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let deadline = Instant::now() + timeout;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            // No wait must be no wait: the kernel rounds a short timeout up to its tick.
            let ready = if left.is_zero() {
                self.receiver.set_nonblocking(true)
            } else {
                self.receiver.set_nonblocking(false).and_then(|()| self.receiver.set_read_timeout(Some(left)))
            };
            let received = ready.and_then(|()| self.receiver.recv_from(self.buffer.as_mut_slice()));
            match received {
                Ok((length, from)) => {
                    let at = self.opened.elapsed();
                    if let Some(frame) = self.sort(length, from) {
                        return Ok(Some(Stamped { frame, at }));
                    }
                }
                // A signal (Ctrl-C) ends the wait: the caller looks at its flag and comes back if it wants more.
                Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(None),
                // Only an empty socket ends the wait: what this program sent itself comes back too, and stopping at
                // such a packet would leave the others' waiting behind it.
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    if Instant::now() >= deadline {
                        return Ok(None);
                    }
                }
                Err(source) => return Err(BusError::Receive { bus: self.describe(), source }),
            }
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn describe(&self) -> String {
        describe(self.group)
    }

    fn counters(&self) -> Counters {
        Counters { lost: kernel_drops(&self.receiver, self.group).unwrap_or(0), ..self.counters.clone() }
    }
}

fn describe(group: SocketAddr) -> String {
    format!("udp_multicast {group}")
}

fn new_socket(group: SocketAddr) -> io::Result<Socket> {
    let socket = Socket::new(Domain::for_address(group), Type::DGRAM, Some(Protocol::UDP))?;
    if group.is_ipv6() {
        socket.set_multicast_hops_v6(HOPS)?;
    } else {
        socket.set_multicast_ttl_v4(HOPS)?;
    }
    Ok(socket)
}

fn receiving_socket(group: SocketAddr) -> io::Result<UdpSocket> {
    let socket = new_socket(group)?;
    // Both, as python-can sets them: sockets on one port only go together if they agree.
    socket.set_reuse_address(true)?;
    #[cfg(all(unix, not(target_os = "solaris"), not(target_os = "illumos")))]
    socket.set_reuse_port(true)?;
    // The kernel may grant less; what then gets lost is counted.
    let _ = socket.set_recv_buffer_size(RECEIVE_BUFFER);
    // Bound to the group itself where that is possible: another group on the same port is another bus.
    let bound_to = if cfg!(unix) { group } else { SocketAddr::new(unspecified(group), group.port()) };
    socket.bind(&bound_to.into())?;
    match group.ip() {
        IpAddr::V4(group) => socket.join_multicast_v4(&group, &Ipv4Addr::UNSPECIFIED)?,
        IpAddr::V6(group) => socket.join_multicast_v6(&group, 0)?,
    }
    Ok(socket.into())
}

fn sending_socket(group: SocketAddr) -> io::Result<UdpSocket> {
    let socket = new_socket(group)?;
    // Connecting sends nothing: it chooses the route, and with it the address that our packets will come from.
    socket.connect(&group.into())?;
    Ok(socket.into())
}

fn unspecified(group: SocketAddr) -> IpAddr {
    match group {
        SocketAddr::V4(_) => Ipv4Addr::UNSPECIFIED.into(),
        SocketAddr::V6(_) => std::net::Ipv6Addr::UNSPECIFIED.into(),
    }
}

/// `ENOBUFS`, or a send buffer that is full.
fn is_full(error: &io::Error) -> bool {
    const ENOBUFS_LINUX: i32 = 105;
    const ENOBUFS_BSD: i32 = 55;
    error.kind() == io::ErrorKind::WouldBlock || matches!(error.raw_os_error(), Some(ENOBUFS_LINUX | ENOBUFS_BSD))
}

/// What to do where the network carries no multicast: a container or a network namespace that has only loopback.
fn multicast_help(error: &io::Error, group: IpAddr) -> Option<String> {
    const ENODEV: i32 = 19;
    let no_way = matches!(
        error.kind(),
        io::ErrorKind::NetworkUnreachable | io::ErrorKind::HostUnreachable | io::ErrorKind::AddrNotAvailable
    ) || error.raw_os_error() == Some(ENODEV);
    no_way.then(|| {
        let instead = if group.is_ipv4() { "" } else { "; IPv6 does not go over loopback alone: use `--bus udp`" };
        format!(
            "no network interface carries multicast here. Where there is only loopback (a container, a network \
             namespace), allow it as root: `ip link set lo up`, `ip link set lo multicast on`, \
             `ip route add 224.0.0.0/4 dev lo`{instead}"
        )
    })
}

/// Packets that the kernel dropped because this socket's buffer was full; Linux tells, others do not.
#[cfg(target_os = "linux")]
fn kernel_drops(socket: &UdpSocket, group: SocketAddr) -> Option<u64> {
    use std::os::fd::AsRawFd as _;
    let link = std::fs::read_link(format!("/proc/self/fd/{}", socket.as_raw_fd())).ok()?;
    let inode = link.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned();
    let table = std::fs::read_to_string(if group.is_ipv4() { "/proc/net/udp" } else { "/proc/net/udp6" }).ok()?;
    // proc(5): sl local rem st queues timer retrnsmt uid timeout inode ref pointer drops
    table.lines().skip(1).find_map(|line| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        (fields.get(9) == Some(&inode.as_str())).then(|| fields.last()?.parse().ok()).flatten()
    })
}

#[cfg(not(target_os = "linux"))]
fn kernel_drops(_: &UdpSocket, _: SocketAddr) -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::super::address::GROUP_V6;
    use super::*;

    /// A port of its own for each test, so that they can run at once, and groups of this process's own, so that the
    /// same tests can run in another folder at the same time.
    fn group(test: u8) -> [(IpAddr, u16); 2] {
        let [_, _, high, low] = std::process::id().to_be_bytes();
        let v6 = std::net::Ipv6Addr::new(0xff15, 0, 0, 0, 0, 0, high.into(), low.into());
        let port = 43_200 + u16::from(test);
        [(Ipv4Addr::new(239, 77, high, low).into(), port), (v6.into(), port)]
    }

    /// `None`, with the reason printed, where the machine has no multicast for this family.
    fn pair(test: u8, family: usize) -> Option<(UdpBus, UdpBus)> {
        let (group, port) = group(test)[family];
        match (UdpBus::open(group, port), UdpBus::open(group, port)) {
            (Ok(one), Ok(other)) => Some((one, other)),
            (Err(error), _) | (_, Err(error)) => {
                assert!(family == 1, "IPv4 multicast must work: {error}");
                println!("skipped, no IPv6 multicast here: {error}");
                None
            }
        }
    }

    const SOON: Duration = Duration::from_secs(5);
    const SHORT: Duration = Duration::from_millis(50);

    #[test]
    fn a_frame_reaches_the_others_and_not_its_sender() {
        for family in [0, 1] {
            let Some((mut one, mut other)) = pair(0, family) else { continue };
            let frame = Frame::new(0x181, &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
            one.send(&frame).unwrap();
            assert_eq!(other.receive(SOON).unwrap().map(|stamped| stamped.frame), Some(frame));
            assert_eq!(one.receive(SHORT).unwrap(), None);
            assert_eq!((one.counters().sent, other.counters().received), (1, 1));
        }
    }

    #[test]
    fn what_it_sent_itself_does_not_hide_what_others_sent() {
        let (mut one, mut other) = pair(4, 0).unwrap();
        let frame = Frame::new(0x181, &[1]).unwrap();
        for _ in 0..100 {
            one.send(&frame).unwrap();
        }
        other.send(&frame).unwrap();
        // Loopback delivers before `send` returns.
        assert_eq!(one.receive(Duration::ZERO).unwrap().map(|stamped| stamped.frame), Some(frame));
    }

    #[test]
    fn rubbish_is_counted_and_the_next_frame_still_comes() {
        let (mut one, mut other) = pair(1, 0).unwrap();
        one.sender.send(b"rubbish").unwrap();
        let frame = Frame::new(0x0, &[]).unwrap();
        one.send(&frame).unwrap();
        assert_eq!(other.receive(SOON).unwrap().map(|stamped| stamped.frame), Some(frame));
        let counters = other.counters();
        assert_eq!((counters.malformed, counters.received), (1, 1));
        assert!(counters.last_malformed.unwrap().starts_with("not a msgpack map"));
    }

    #[test]
    fn another_group_on_the_same_port_is_another_bus() {
        let [_, _, high, low] = std::process::id().to_be_bytes();
        let mut one = UdpBus::open(Ipv4Addr::new(239, 78, high, low).into(), 43_202).unwrap();
        let mut other = UdpBus::open(Ipv4Addr::new(239, 79, high, low).into(), 43_202).unwrap();
        one.send(&Frame::new(1, &[]).unwrap()).unwrap();
        assert_eq!(other.receive(SHORT).unwrap(), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_the_kernel_drops_is_counted() {
        let (mut one, mut other) = pair(3, 0).unwrap();
        let sent = 50_000;
        for number in 0..sent {
            one.send(&Frame::new((number % 0x800) as u16, &[]).unwrap()).unwrap();
        }
        let mut received = 0;
        while other.receive(SHORT).unwrap().is_some() {
            received += 1;
        }
        let counters = other.counters();
        assert_eq!(counters.received, received);
        assert!(counters.lost > 0, "the buffer held {sent} packets; send more");
        assert_eq!(received + counters.lost, sent);
    }

    #[test]
    fn a_machine_without_multicast_is_told_what_to_do() {
        for code in [19, 101] {
            let error = io::Error::from_raw_os_error(code);
            let help = multicast_help(&error, Ipv4Addr::new(239, 74, 163, 2).into()).expect("a hint");
            assert!(help.contains("ip route add 224.0.0.0/4 dev lo") && help.contains("multicast on"), "{help}");
        }
        assert_eq!(multicast_help(&io::Error::from(io::ErrorKind::PermissionDenied), GROUP_V6.into()), None);
    }
}

//! The option that every command on a bus takes.

use super::address::BusAddress;

/// `--bus`.
#[derive(clap::Args, Debug, Clone, Default)]
pub struct BusOption {
    /// The bus: `can0` (SocketCAN), `slcan:/dev/ttyACM0` (an adapter on a serial port; `,bitrate=` and `,baud=` may follow),
    /// `udp` (python-can's udp_multicast on this machine and its network), `udp6`, `udp:GROUP` or `udp:GROUP:PORT`
    #[arg(long, value_name = "BUS", default_value_t)]
    pub bus: BusAddress,
}

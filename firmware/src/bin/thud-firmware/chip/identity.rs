//! Who this board is and why it started.

use embassy_stm32::pac::RCC;
use thud_firmware::board::Identity;

use super::memory;
use crate::reset_flags::Traces;

/// Place of the NUCLEO-G474RE in the list of object 0x1009; 0 is the simulation.
const HARDWARE_REVISION: u32 = 1;

/// Reads it. Once, because reading the traces of the reset removes them (not the panic's record).
pub fn read() -> Identity {
    let flags = RCC.csr().read();
    RCC.csr().modify(|csr| csr.set_rmvf(true));
    let kept = memory::kept();
    let traces = Traces {
        watchdog: flags.iwdgrstf() || flags.wwdgrstf(),
        software: flags.sftrstf(),
        brown_out: flags.borrstf(),
        pin: flags.pinrstf(),
        panicked: kept.kept().is_some(),
        memory_kept: kept.memory_kept(),
    };
    Identity {
        serial: serial(),
        hardware_revision: HARDWARE_REVISION,
        build: memory::build(),
        reset_cause: traces.cause(),
        ended_at: kept.kept().and_then(|(_, _, addresses)| addresses.first().copied()).unwrap_or(0),
    }
}

/// CRC-32 of the chip's 96-bit unique id: 32 bits as object 0x1018:4 wants them, from all of the id, of which the wafer's
/// coordinates alone would repeat from lot to lot.
fn serial() -> u32 {
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&embassy_stm32::uid::uid())
}

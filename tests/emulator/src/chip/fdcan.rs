//! FDCAN1: registers, message RAM, filters, FIFOs, transmit buffers, error state. RM0440 chapter 44.
//!
//! ```text
//! TXBAR ─▶ requests ─▶ bus (by the emulator, at the next microsecond) ─▶ TXBTO, IR.TC
//! bus ─▶ filters ─▶ FIFO 0 or 1, three frames each ─▶ IR.RFxN, or IR.RFxL
//! bus ─▶ PSR, ECR; bus-off sets CCCR.INIT, and clearing that begins the recovery
//! ```
//!
//! Classic frames at the nominal bit rate. The wire itself, arbitration and the counting of errors are the simulated bus's.

use thud_firmware::board::{BusState, BusStatus, Frame};
use thud_sim::bus::SeenError;

use crate::moment::{MICROSECOND, Picoseconds, microseconds_up};

const INIT: u32 = 1;
const CCE: u32 = 1 << 1;
const CSA: u32 = 1 << 3;
const CSR: u32 = 1 << 4;
/// Restricted operation, bus monitoring, no retransmission, test: not modelled.
const UNUSUAL: u32 = 1 << 2 | 1 << 5 | 1 << 6 | 1 << 7;

const BUFFERS: u32 = 3;
const FIFO_DEPTH: u32 = 3;
/// Bytes of an element of a FIFO or of a transmit buffer.
const ELEMENT: u32 = 72;
/// Offsets in the message RAM, RM0440 figure 671.
const STANDARD_FILTERS: u32 = 0;
const FIFOS: [u32; 2] = [0xB0, 0x188];
const TRANSMIT_BUFFERS: u32 = 0x278;
const RAM_WORDS: usize = super::map::MESSAGE_RAM_SIZE as usize / 4;

mod ir {
    pub const RFN: [u32; 2] = [1, 1 << 3];
    pub const RFF: [u32; 2] = [1 << 1, 1 << 4];
    pub const RFL: [u32; 2] = [1 << 2, 1 << 5];
    pub const TC: u32 = 1 << 7;
    pub const TFE: u32 = 1 << 9;
    pub const EP: u32 = 1 << 17;
    pub const EW: u32 = 1 << 18;
    pub const BO: u32 = 1 << 19;
    /// Groups of ILS, bit by bit: which interrupts go with which line.
    pub const GROUPS: [u32; 7] =
        [0b111, 0b111 << 3, 0b11 << 6 | 1 << 8, 0b1111 << 9, 0b111 << 13, 0b11 << 16, 0b11_1111 << 18];
}

/// What the controller wants from the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Take part, after eleven recessive bits.
    Join,
    /// Take part no more.
    Leave,
    /// Send a frame from a buffer.
    Send {
        /// Number of the buffer.
        buffer: u8,
        /// What.
        frame: Frame,
    },
    /// Come back from bus-off.
    Recover,
}

#[derive(Clone, Copy, Debug, Default)]
struct Fifo {
    fill: u32,
    get: u32,
    lost: bool,
}

/// The controller.
#[derive(Clone, Debug)]
pub struct FdCan {
    message_ram: [u32; RAM_WORDS],
    cccr: u32,
    nbtp: u32,
    registers: [u32; 0x40],
    ir: u32,
    fifos: [Fifo; 2],
    pending: u32,
    transmitted: u32,
    status: BusStatus,
    last_error: u32,
    bus_off: bool,
    requests: Vec<(Picoseconds, Request)>,
    was_bus_off: bool,
    lost: u64,
    accepted: u64,
    filtered: u64,
}

impl Default for FdCan {
    fn default() -> Self {
        Self {
            message_ram: [0; RAM_WORDS],
            cccr: INIT,
            nbtp: 0x0600_0A03,
            registers: [0; 0x40],
            ir: 0,
            fifos: [Fifo::default(); 2],
            pending: 0,
            transmitted: 0,
            status: BusStatus::default(),
            last_error: 7,
            bus_off: false,
            requests: Vec::new(),
            was_bus_off: false,
            lost: 0,
            accepted: 0,
            filtered: 0,
        }
    }
}

impl FdCan {
    /// What it wants from the bus, oldest first, and since when.
    pub(crate) fn take_requests(&mut self) -> Vec<(Picoseconds, Request)> {
        std::mem::take(&mut self.requests)
    }

    /// When the bus notices the oldest request.
    pub(crate) fn wanted_at(&self) -> Option<Picoseconds> {
        self.requests.first().map(|(at, _)| microseconds_up(*at) * MICROSECOND)
    }

    /// Its error state.
    #[must_use]
    pub fn state(&self) -> BusState {
        self.status.state
    }

    /// Whether it has been bus-off since the reset.
    #[must_use]
    pub fn was_bus_off(&self) -> bool {
        self.was_bus_off
    }

    /// Frames that found their FIFO full since the reset.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Frames that passed the filters since the reset, the lost ones included.
    #[must_use]
    pub fn accepted(&self) -> u64 {
        self.accepted
    }

    /// Frames that the filters kept out since the reset.
    #[must_use]
    pub fn filtered(&self) -> u64 {
        self.filtered
    }

    /// Bit rate that it is set to, bit/s, with this kernel clock.
    #[must_use]
    pub fn bit_rate(&self, kernel_hz: u64) -> u64 {
        let prescaler = u64::from(self.nbtp >> 16 & 0x1FF) + 1;
        let quanta = 1 + u64::from(self.nbtp >> 8 & 0xFF) + 1 + u64::from(self.nbtp & 0x7F) + 1;
        kernel_hz / (prescaler * quanta)
    }

    /// Level of an interrupt line.
    pub(super) fn interrupts(&self, line: u32) -> bool {
        let enabled = self.register(0x54);
        let select = self.register(0x58);
        let on = self.register(0x5C) & 1 << line != 0;
        let of_line = ir::GROUPS
            .iter()
            .enumerate()
            .filter(|(group, _)| select >> group & 1 == line)
            .fold(0, |bits, (_, group)| bits | group);
        on && self.ir & enabled & of_line != 0
    }

    fn register(&self, offset: u32) -> u32 {
        self.registers[offset as usize / 4]
    }

    fn ram(&self, offset: u32) -> u32 {
        self.message_ram[offset as usize / 4]
    }

    /// Which FIFO takes a standard data frame.
    fn filter(&self, id: u16) -> Option<(usize, u32)> {
        let rxgfc = self.register(0x80);
        let id = u32::from(id);
        for index in 0..rxgfc >> 16 & 0x1F {
            let element = self.ram(STANDARD_FILTERS + 4 * index);
            let (first, second) = (element >> 16 & 0x7FF, element & 0x7FF);
            let matches = match element >> 30 {
                0 => (first..=second).contains(&id),
                1 => id == first || id == second,
                2 => id & second == first & second,
                _ => false,
            };
            let action = element >> 27 & 7;
            if action == 0 || !matches {
                continue;
            }
            // With 4 a match only sets a flag and the search goes on; here no firmware does that.
            return match action {
                1 | 5 => Some((0, index)),
                2 | 6 => Some((1, index)),
                _ => None,
            };
        }
        const NO_FILTER: u32 = 1 << 31;
        match rxgfc >> 4 & 3 {
            0 => Some((0, NO_FILTER)),
            1 => Some((1, NO_FILTER)),
            _ => None,
        }
    }

    /// A frame has come.
    pub(crate) fn receive(&mut self, frame: &Frame) {
        if self.cccr & INIT != 0 {
            return;
        }
        let Some((number, filter)) = self.filter(frame.id) else {
            self.filtered += 1;
            self.last_error = 0;
            return;
        };
        self.accepted += 1;
        let overwrite = self.register(0x80) & if number == 0 { 1 << 9 } else { 1 << 8 } != 0;
        let fifo = &mut self.fifos[number];
        if fifo.fill == FIFO_DEPTH {
            self.lost += 1;
            fifo.lost = true;
            self.ir |= ir::RFL[number];
            if !overwrite {
                return;
            }
            fifo.get = (fifo.get + 1) % FIFO_DEPTH;
            fifo.fill -= 1;
        }
        let place = FIFOS[number] + ELEMENT * ((fifo.get + fifo.fill) % FIFO_DEPTH);
        fifo.fill += 1;
        self.ir |= ir::RFN[number];
        if fifo.fill == FIFO_DEPTH {
            self.ir |= ir::RFF[number];
        }
        let filter = if filter >> 31 != 0 { filter } else { filter << 24 };
        let words = [
            u32::from(frame.id) << 18,
            filter | u32::from(frame.len) << 16,
            u32::from_le_bytes([frame.data[0], frame.data[1], frame.data[2], frame.data[3]]),
            u32::from_le_bytes([frame.data[4], frame.data[5], frame.data[6], frame.data[7]]),
        ];
        self.message_ram[place as usize / 4..][..4].copy_from_slice(&words);
        self.last_error = 0;
    }

    /// These buffers still wait; the others that were requested have been sent.
    pub(crate) fn sent(&mut self, waiting: u32) {
        let gone = self.pending & !waiting;
        if gone == 0 {
            return;
        }
        self.pending &= waiting;
        self.transmitted |= gone;
        self.last_error = 0;
        // TXBTIE: which of them say so.
        if gone & self.register(0xDC) != 0 {
            self.ir |= ir::TC;
        }
        if self.pending == 0 {
            self.ir |= ir::TFE;
        }
    }

    /// The state of the errors as the bus has it now.
    pub(crate) fn set_status(&mut self, status: BusStatus, error: Option<SeenError>) {
        if self.cccr & INIT != 0 && !self.bus_off {
            return;
        }
        if let Some(error) = error {
            self.last_error = match error {
                SeenError::Stuff => 1,
                SeenError::Acknowledge => 3,
                SeenError::Bit => 5,
                SeenError::Crc => 6,
            };
        }
        let before = (self.psr_state(), self.bus_off);
        self.status = status;
        let off = status.state == BusState::BusOff;
        if off && !self.bus_off {
            // The controller stops by itself.
            self.cccr |= INIT;
        }
        self.bus_off = off;
        self.was_bus_off |= off;
        let changed = before.0 ^ self.psr_state();
        if changed & 1 << 5 != 0 {
            self.ir |= ir::EP;
        }
        if changed & 1 << 6 != 0 {
            self.ir |= ir::EW;
        }
        if before.1 != off {
            self.ir |= ir::BO;
        }
    }

    /// EP, EW and BO.
    fn psr_state(&self) -> u32 {
        let most = self.status.transmit_errors.max(self.status.receive_errors);
        let bit = |condition: bool, bit: u32| u32::from(condition) << bit;
        bit(self.status.state != BusState::ErrorActive, 5)
            | bit(most >= 96 || self.status.state == BusState::BusOff, 6)
            | bit(self.status.state == BusState::BusOff, 7)
    }

    pub(super) fn read_ram(&self, offset: u32) -> u32 {
        self.ram(offset)
    }

    pub(super) fn write_ram(&mut self, offset: u32, value: u32) {
        self.message_ram[offset as usize / 4] = value;
    }

    pub(super) fn read(&mut self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => 0x3214_1218,
            0x04 => 0x8765_4321,
            0x18 => self.cccr & !CSA | if self.cccr & CSR != 0 { CSA } else { 0 },
            0x1C => self.nbtp,
            0x40 => {
                let receive = u32::from(self.status.receive_errors.min(127));
                let passive = u32::from(self.status.receive_errors > 127) << 15;
                u32::from(self.status.transmit_errors.min(255)) | receive << 8 | passive
            }
            0x44 => {
                let activity = if self.cccr & INIT != 0 { 0 } else { 1 << 3 };
                let value = self.last_error | activity | 7 << 8 | self.psr_state();
                self.last_error = 7;
                value
            }
            0x50 => self.ir,
            0x90 | 0x98 => {
                let fifo = &self.fifos[usize::from(offset == 0x98)];
                let put = (fifo.get + fifo.fill) % FIFO_DEPTH;
                fifo.fill
                    | fifo.get << 8
                    | put << 16
                    | u32::from(fifo.fill == FIFO_DEPTH) << 24
                    | u32::from(fifo.lost) << 25
            }
            0xC4 => {
                let queue = self.register(0xC0) & 1 << 24 != 0;
                let free = BUFFERS - self.pending.count_ones();
                let put = (!self.pending).trailing_zeros().min(BUFFERS - 1);
                let full = u32::from(free == 0) << 21;
                if queue { put << 16 | full } else { free | put << 16 | full }
            }
            0xC8 => self.pending,
            0xD4 => self.transmitted,
            0xD8 => 0,
            _ => *self.registers.get(offset as usize / 4)?,
        })
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, now: Picoseconds) -> Result<(), String> {
        match offset {
            0x18 => return self.control(value, now),
            0x50 => {
                self.ir &= !value;
                for (number, lost) in ir::RFL.into_iter().enumerate() {
                    if value & lost != 0 {
                        self.fifos[number].lost = false;
                    }
                }
            }
            0x94 | 0x9C => {
                let fifo = &mut self.fifos[usize::from(offset == 0x9C)];
                let index = value & 7;
                let done = (index + FIFO_DEPTH - fifo.get) % FIFO_DEPTH + 1;
                if index >= FIFO_DEPTH || done > fifo.fill {
                    return Err(format!("element {index} of a receive FIFO is given back, which holds no frame"));
                }
                fifo.get = (index + 1) % FIFO_DEPTH;
                fifo.fill -= done;
            }
            0xCC => self.request(value, now)?,
            0xD0 if value != 0 => return Err("cancelling transmissions is not modelled".into()),
            0x0C | 0x10 | 0x1C | 0x80 | 0xC0 if self.cccr & (INIT | CCE) != INIT | CCE => {
                // TEST is also written outside, with the same value.
                if offset != 0x10 || value & !0x10 != 0 {
                    return Err(format!("FDCAN at offset 0x{offset:X} is written without CCE"));
                }
            }
            0x1C => self.nbtp = value,
            _ => match self.registers.get_mut(offset as usize / 4) {
                Some(register) => *register = value,
                None => return Err(format!("FDCAN has no register at offset 0x{offset:X}")),
            },
        }
        Ok(())
    }

    fn control(&mut self, value: u32, now: Picoseconds) -> Result<(), String> {
        if value & UNUSUAL != 0 {
            return Err(format!("a mode of the FDCAN is not modelled: CCCR 0x{value:X}"));
        }
        let before = self.cccr;
        // CCE can be set only while INIT is, and goes with it.
        let cce = if before & INIT != 0 && value & INIT != 0 { value & CCE } else { 0 };
        self.cccr = value & !CCE | cce;
        if cce & !before != 0 {
            // Requests, FIFOs and the error log begin anew.
            self.pending = 0;
            self.transmitted = 0;
            self.fifos = Default::default();
        }
        if before & INIT != 0 && value & INIT == 0 {
            self.requests.push((now, if self.bus_off { Request::Recover } else { Request::Join }));
        }
        if before & INIT == 0 && value & INIT != 0 {
            self.pending = 0;
            self.requests.push((now, Request::Leave));
        }
        Ok(())
    }

    fn request(&mut self, value: u32, now: Picoseconds) -> Result<(), String> {
        if self.register(0xC0) & 1 << 24 == 0 && value.count_ones() + self.pending.count_ones() > 1 {
            return Err("more than one frame in FIFO mode is not modelled".into());
        }
        for buffer in (0..BUFFERS).filter(|buffer| value & 1 << buffer != 0) {
            if self.pending & 1 << buffer != 0 {
                return Err(format!("transmit buffer {buffer} is requested while it waits for the bus"));
            }
            let place = TRANSMIT_BUFFERS + ELEMENT * buffer;
            let (head, second) = (self.ram(place), self.ram(place + 4));
            if head >> 29 & 3 != 0 || second >> 20 & 3 != 0 {
                return Err("only classic data frames with 11 bits of identifier are modelled".into());
            }
            let length = (second >> 16 & 0xF).min(8) as usize;
            let mut data = [0; 8];
            data[..4].copy_from_slice(&self.ram(place + 8).to_le_bytes());
            data[4..].copy_from_slice(&self.ram(place + 12).to_le_bytes());
            let frame = Frame::new((head >> 18 & 0x7FF) as u16, &data[..length]).expect("both are in range");
            self.pending |= 1 << buffer;
            self.transmitted &= !(1 << buffer);
            self.requests.push((now, Request::Send { buffer: buffer as u8, frame }));
        }
        Ok(())
    }
}

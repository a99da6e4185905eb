//! What unicorn calls while instructions run: before each block, and at each access to what is not memory.

use unicorn_engine::{RegisterARM as Reg, Unicorn};

use crate::chip::Chip;
use crate::chip::map::{BANK_1, MESSAGE_RAM, MESSAGE_RAM_SIZE};
use crate::chip::nvic::Masks;
use crate::moment::Picoseconds;

/// What the hooks share.
pub(super) struct State {
    pub(super) chip: Chip,
    pub(super) clock: Picoseconds,
    pub(super) stop_at: Picoseconds,
    /// A block has been run since the last stop: there is progress.
    pub(super) progressed: bool,
    /// A wait for an event or interrupt was reached.
    pub(super) waits: bool,
    /// The event register.
    pub(super) event: bool,
    /// Something is pending that only the masks hold back.
    pub(super) watch_masks: bool,
    pub(super) instructions: u64,
    /// For each half-word of bank 1: size of the block that begins there (upper 16 bits), and its instructions.
    pub(super) blocks: Vec<u32>,
    pub(super) program: Vec<u8>,
}

pub(super) fn block(cpu: &mut Unicorn<'_, State>, address: u64, size: u32) {
    let state = cpu.get_data_mut();
    if state.progressed {
        let mut stops = state.chip.now >= state.stop_at;
        if !stops && state.watch_masks {
            let masks = Masks {
                primask: cpu.reg_read(Reg::PRIMASK).unwrap_or(0) & 1 != 0,
                faultmask: cpu.reg_read(Reg::FAULTMASK).unwrap_or(0) & 1 != 0,
                basepri: cpu.reg_read(Reg::BASEPRI).unwrap_or(0) as u8,
            };
            let nvic = &cpu.get_data().chip.nvic;
            stops = nvic.preempting().is_some_and(|exception| !nvic.masked(exception, masks));
        }
        if stops {
            let _ = cpu.emu_stop();
            return;
        }
    }
    let state = cpu.get_data_mut();
    state.progressed = true;
    let count = u64::from(state.instructions_of(address as u32, size));
    state.instructions += count;
    state.chip.now += count * state.clock;
}

impl State {
    fn instructions_of(&mut self, address: u32, size: u32) -> u32 {
        let Some(place) = address.checked_sub(BANK_1).map(|offset| offset as usize) else { return 1 };
        let Some(known) = self.blocks.get_mut(place / 2) else { return 1 };
        if *known >> 16 == size {
            return *known & 0xFFFF;
        }
        let mut count = 0;
        let mut at = place;
        while at < place + size as usize && at + 1 < self.program.len() {
            // Thumb-2: five highest bits 0b11101 and above begin a long instruction.
            at += if self.program[at + 1] >> 3 >= 0b11101 { 4 } else { 2 };
            count += 1;
        }
        *known = size << 16 | count;
        count
    }
}

pub(super) fn read(state: &mut State, address: u32, size: usize) -> u64 {
    const FLASH_SR: u32 = 0x4002_2010;
    if address == FLASH_SR
        && let Some(ends) = state.chip.flash.busy_until()
    {
        // The program polls: what it does until something happens is known.
        state.chip.now = state.chip.now.max(ends.min(state.stop_at));
    }
    u64::from(state.chip.read(address, size))
}

pub(super) fn write(cpu: &mut Unicorn<'_, State>, address: u32, size: usize, value: u32) {
    let state = cpu.get_data_mut();
    let idle = state.chip.flash.busy_until().is_none();
    state.chip.write(address, size, value);
    if idle && state.chip.flash.busy_until().is_some() && cpu.reg_read(Reg::PRIMASK).unwrap_or(0) & 1 == 0 {
        cpu.get_data_mut().chip.flash.count_interruptible();
    }
    let state = cpu.get_data_mut();
    let harmless = (MESSAGE_RAM..MESSAGE_RAM + MESSAGE_RAM_SIZE).contains(&address);
    if !harmless {
        state.stop_at = 0;
    }
}

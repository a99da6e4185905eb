//! Exceptions: taken, returned from, and made of faults. ARMv7-M B1.5.
//!
//! ```text
//! stack before ─┤ (padding to 8 bytes) │ FPSCR, S15 … S0 if used │ xPSR │ PC │ LR │ R12 │ R3 … R0 ├─ stack of the handler
//! ```

use unicorn_engine::{RegisterARM as Reg, uc_error};

use super::Machine;
use crate::chip::nvic::{Exception, HARD_FAULT, Masks};

/// Clocks from the interrupt to the first instruction of its handler, and back (Cortex-M4 TRM, 3.9.1).
const EXCEPTION_CLOCKS: u64 = 12;

/// Bits of CONTROL and xPSR.
const FPCA: u64 = 1 << 2;
pub(super) const XPSR_THUMB: u32 = 1 << 24;
const XPSR_IT: u32 = 0x0600_FC00;
const XPSR_ALIGNED: u32 = 1 << 9;

/// Words of a frame on the stack: without and with the registers of the floating-point unit.
const FRAME: u32 = 8;
const FRAME_WITH_FLOATS: u32 = 26;

/// CFSR: a bus fault with precise address; an undefined instruction.
const PRECISE: u32 = 1 << 9;
const UNDEFINED: u32 = 1 << 16;

impl Machine {
    fn masks(&self) -> Masks {
        Masks {
            primask: self.get(Reg::PRIMASK) & 1 != 0,
            faultmask: self.get(Reg::FAULTMASK) & 1 != 0,
            basepri: self.get(Reg::BASEPRI) as u8,
        }
    }

    /// Takes the most urgent exception, if one is to be taken now.
    pub(super) fn take_exception(&mut self) -> bool {
        let Some(exception) = self.chip().nvic.preempting() else {
            self.cpu.get_data_mut().watch_masks = false;
            return false;
        };
        // A wait for an interrupt ends even where masks hold it back.
        if self.chip().nvic.masked(exception, self.masks()) {
            self.cpu.get_data_mut().watch_masks = true;
            return false;
        }
        self.cpu.get_data_mut().watch_masks = false;
        if self.get(Reg::XPSR) as u32 & XPSR_IT != 0 {
            // In the middle of an IT block: one block of instructions later it is over.
            let now = self.chip().now;
            self.execute(now);
            return true;
        }
        self.enter(exception);
        true
    }

    fn enter(&mut self, exception: Exception) {
        let floats = self.get(Reg::CONTROL) & FPCA != 0;
        let before = self.get(Reg::SP) as u32;
        let aligned = before & 4 != 0;
        let words = if floats { FRAME_WITH_FLOATS } else { FRAME };
        let stack = (before & !7).wrapping_sub(4 * words);
        let current = self.chip().nvic.current();
        let mut frame: Vec<u32> = [Reg::R0, Reg::R1, Reg::R2, Reg::R3, Reg::R12, Reg::LR]
            .into_iter()
            .map(|reg| self.get(reg) as u32)
            .collect();
        let xpsr = self.get(Reg::XPSR) as u32 & !0x1FF & !XPSR_ALIGNED;
        frame.push(self.pc);
        frame.push(xpsr | XPSR_THUMB | current as u32 | if aligned { XPSR_ALIGNED } else { 0 });
        if floats {
            for index in 0..8 {
                let double = self.cpu.reg_read(Reg::D0 as i32 + index).expect("a register of the FPU");
                frame.extend([double as u32, (double >> 32) as u32]);
            }
            frame.extend([self.get(Reg::FPSCR) as u32, 0]);
        }
        let bytes: Vec<u8> = frame.iter().flat_map(|word| word.to_le_bytes()).collect();
        // Where there is no memory the frame is lost, and the handler's first push is the next fault.
        let _ = self.cpu.mem_write(u64::from(stack), &bytes);
        self.set(Reg::SP, u64::from(stack));
        let return_code: u32 = if self.chip().nvic.depth() == 0 { 0xFFFF_FFF9 } else { 0xFFFF_FFF1 };
        self.set(Reg::LR, u64::from(if floats { return_code & !0x10 } else { return_code }));
        if floats {
            let control = self.get(Reg::CONTROL);
            self.set(Reg::CONTROL, control & !FPCA);
        }
        let vector = self.chip().nvic.vector_table() + 4 * exception as u32;
        self.pc = self.word(vector) & !1;
        self.asleep = false;
        let state = self.cpu.get_data_mut();
        state.event = true;
        let spent = EXCEPTION_CLOCKS * state.chip.rcc.core_period();
        state.chip.now += spent;
        state.chip.nvic.enter(exception);
        self.busy += spent;
        self.deepest_nesting = self.deepest_nesting.max(self.chip().nvic.depth());
    }

    pub(super) fn return_from_exception(&mut self) {
        let floats = self.pc & 0x10 == 0;
        let stack = self.get(Reg::SP) as u32;
        let words = if floats { FRAME_WITH_FLOATS } else { FRAME };
        let Ok(bytes) = self.cpu.mem_read_as_vec(u64::from(stack), 4 * words as usize) else {
            self.locked_up = true;
            return;
        };
        let frame: Vec<u32> =
            bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
        for (register, value) in
            [Reg::R0, Reg::R1, Reg::R2, Reg::R3, Reg::R12, Reg::LR].into_iter().zip(frame.iter().copied())
        {
            self.set(register, u64::from(value));
        }
        let xpsr = frame[7];
        if floats {
            for index in 0..8 {
                let double = u64::from(frame[8 + 2 * index]) | u64::from(frame[9 + 2 * index]) << 32;
                self.cpu.reg_write(Reg::D0 as i32 + index as i32, double).expect("a register of the FPU");
            }
            self.set(Reg::FPSCR, u64::from(frame[24]));
        }
        let control = self.get(Reg::CONTROL);
        self.set(Reg::CONTROL, if floats { control | FPCA } else { control & !FPCA });
        self.set(Reg::XPSR_NZCVQG, u64::from(xpsr & !0x1FF & !XPSR_ALIGNED));
        self.set(Reg::SP, u64::from(stack + 4 * words + if xpsr & XPSR_ALIGNED != 0 { 4 } else { 0 }));
        self.pc = frame[6] & !1;
        let state = self.cpu.get_data_mut();
        state.event = true;
        let spent = EXCEPTION_CLOCKS * state.chip.rcc.core_period();
        state.chip.now += spent;
        state.chip.nvic.leave();
        state.chip.update_lines();
        self.busy += spent;
    }

    pub(super) fn fault(&mut self, error: uc_error) {
        let what = format!("{error:?} at 0x{:08X}, called from 0x{:08X}", self.pc, self.get(Reg::LR));
        if self.faults.len() < 20 {
            self.faults.push(what);
        }
        if !self.chip().nvic.can_fault() {
            self.locked_up = true;
            return;
        }
        let cfsr = match error {
            uc_error::INSN_INVALID | uc_error::EXCEPTION => UNDEFINED,
            _ => PRECISE,
        };
        self.chip_mut().nvic.note_fault(cfsr);
        self.enter(HARD_FAULT);
    }
}

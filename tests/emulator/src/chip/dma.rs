//! Channel 1 of DMA1 with its request multiplexer: from a peripheral to memory, half-words, in a circle. RM0440 chapters 12, 13.

use super::map::{ADC1, RAM, RAM_SIZE};

const EN: u32 = 1;
const TCIE: u32 = 1 << 1;
const HTIE: u32 = 1 << 2;
const TEIE: u32 = 1 << 3;
const CIRC: u32 = 1 << 5;
/// Memory increments, both sides are half-words.
const FORM: u32 = 0x0580 | CIRC;
const FORM_MASK: u32 = 0x7FF0;

const GIF: u32 = 1;
const TCIF: u32 = 2;
const HTIF: u32 = 4;
const TEIF: u32 = 8;

/// Requests of the ADCs, RM0440 table 91.
const REQUEST_ADC1: u32 = 5;

/// A half-word for the memory.
#[derive(Clone, Copy, Debug)]
pub struct Store {
    /// Where.
    pub address: u32,
    /// What.
    pub value: u16,
}

/// The channel.
#[derive(Clone, Debug, Default)]
pub struct Dma {
    flags: u32,
    ccr: u32,
    length: u32,
    left: u32,
    peripheral: u32,
    memory: u32,
    request: u32,
}

impl Dma {
    /// A request of ADC1: where to store the value. `None`: the channel is off or not for this request.
    pub(super) fn transfer(&mut self, value: u16) -> Result<Option<Store>, String> {
        if self.ccr & EN == 0 || self.request & 0x7F != REQUEST_ADC1 || self.left == 0 {
            return Ok(None);
        }
        // The priority level, bits 12 and 13, is nobody's matter with one channel.
        if self.ccr & FORM_MASK & !0x3000 != FORM {
            return Err(format!("DMA1 channel 1: mode 0x{:X} is not modelled", self.ccr));
        }
        if self.peripheral != ADC1 + 0x40 {
            return Err(format!("DMA1 channel 1 reads 0x{:08X}, which is not ADC1_DR", self.peripheral));
        }
        let address = self.memory + 2 * (self.length - self.left);
        if !(RAM..RAM + RAM_SIZE).contains(&address) {
            return Err(format!("DMA1 channel 1 writes 0x{address:08X}, which is not in SRAM"));
        }
        self.left -= 1;
        if self.left == self.length / 2 {
            self.flags |= HTIF | GIF;
        }
        if self.left == 0 {
            self.flags |= TCIF | GIF;
            self.left = self.length;
        }
        Ok(Some(Store { address, value }))
    }

    /// A transfer ends in a bus error: the channel switches itself off.
    pub(super) fn fail(&mut self) {
        self.flags |= TEIF | GIF;
        self.ccr &= !EN;
    }

    pub(super) fn interrupts(&self) -> bool {
        self.flags & TEIF != 0 && self.ccr & TEIE != 0
            || self.flags & TCIF != 0 && self.ccr & TCIE != 0
            || self.flags & HTIF != 0 && self.ccr & HTIE != 0
    }

    pub(super) fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.flags,
            0x04 => 0,
            0x08 => self.ccr,
            0x0C => self.left,
            0x10 => self.peripheral,
            0x14 => self.memory,
            // The other channels, which are off.
            0x18..0xA8 => 0,
            _ => return None,
        })
    }

    pub(super) fn write(&mut self, offset: u32, value: u32) -> Result<(), String> {
        let on = self.ccr & EN != 0;
        match offset {
            0x04 => {
                let cleared = if value & GIF != 0 { 0xF } else { value & 0xE };
                self.flags &= !cleared;
                if self.flags & 0xE == 0 {
                    self.flags &= !GIF;
                }
            }
            0x08 => self.ccr = value,
            0x0C | 0x10 | 0x14 if on => return Err("DMA1 channel 1 is changed while it runs".into()),
            0x0C => {
                self.length = value & 0xFFFF;
                self.left = self.length;
            }
            0x10 => self.peripheral = value,
            0x14 => self.memory = value,
            0x18..0xA8 if value == 0 => {}
            _ => return Err(format!("DMA1 at offset 0x{offset:X} is not modelled")),
        }
        Ok(())
    }

    pub(super) fn read_multiplexer(&self, offset: u32) -> Option<u32> {
        Some(if offset == 0 { self.request } else { 0 })
    }

    pub(super) fn write_multiplexer(&mut self, offset: u32, value: u32) -> Result<(), String> {
        match offset {
            0 => self.request = value,
            0x84 => {}
            _ => return Err(format!("DMAMUX at offset 0x{offset:X} is not modelled")),
        }
        Ok(())
    }
}

//! The processor: instructions by unicorn, exceptions by hand.
//!
//! ```text
//!           ┌─▶ events that are due ─▶ an exception to take? ─yes─▶ stack, vector ─┐
//!  run_until│            │ no                                                      │
//!           │            ▼                                                         │
//!           │  asleep? ─yes─▶ jump to the next event                               │
//!           │            │ no                                                      │
//!           └── blocks of instructions, until the next event or a write to a register ◀─┘
//! ```
//!
//! Unicorn translates blocks of guest instructions; before each the time moves by what its instructions take. Unicorn has no
//! NVIC: a return from an exception is a jump to 0xFFFFFFxx, which it cannot fetch and which is caught here.

use unicorn_engine::{Arch, ArmCpuModel, Mode, Prot, RegisterARM as Reg, Unicorn};

use crate::chip::Chip;
use crate::chip::map::{BANK, BANK_1, BANK_2, CCM, CCM_SIZE, INFORMATION, INFORMATION_SIZE, RAM, RAM_SIZE, UNIQUE_ID};
use crate::image::Image;
use crate::moment::Picoseconds;

mod exceptions;
mod hooks;

use exceptions::XPSR_THUMB;
use hooks::{State, block, read, write};

/// Clocks that an instruction takes, in hundredths. An assumption: most take one, loads and stores two, taken branches two to
/// four, divisions and square roots up to fourteen, and the flash has four wait states behind its cache. Programs of this kind
/// take 1.3 to 1.7 on a Cortex-M4; what a real board takes, only a real board shows.
pub const CLOCKS_PER_INSTRUCTION: u64 = 150;
/// What an untouched stack is filled with.
const PAINT: u8 = 0xA5;

/// Why the processor stopped before its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halt {
    /// The time has come.
    Due,
    /// The software asks for a reset.
    ResetRequested,
    /// The watchdog bites.
    Watchdog,
    /// The power goes, as was ordered.
    PowerLost,
}
/// A processor with its chip.
pub struct Machine {
    cpu: Unicorn<'static, State>,
    pc: u32,
    asleep: bool,
    locked_up: bool,
    /// The core stands still until then, as when a debugger halts it.
    halted_until: Picoseconds,
    busy: Picoseconds,
    deepest_nesting: usize,
    faults: Vec<String>,
}

impl Machine {
    /// A processor with this program in its flash, before its first instruction.
    ///
    /// # Panics
    /// When unicorn does not give a processor.
    #[must_use]
    pub fn new(image: &Image, chip: Chip, unique_id: [u8; 12]) -> Self {
        let state = State {
            chip,
            clock: 1,
            stop_at: 0,
            progressed: false,
            waits: false,
            event: false,
            watch_masks: false,
            instructions: 0,
            blocks: vec![0; BANK as usize / 2],
            program: image.bank_1.clone(),
        };
        let mut cpu = Unicorn::new_with_data(Arch::ARM, Mode::THUMB | Mode::MCLASS, state).expect("a processor");
        cpu.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32).expect("a Cortex-M4");
        let mapped = "memory maps do not overlap";
        cpu.mem_map(u64::from(BANK_1), u64::from(BANK), Prot::READ | Prot::EXEC).expect(mapped);
        cpu.mem_map(u64::from(RAM), u64::from(RAM_SIZE), Prot::READ | Prot::WRITE).expect(mapped);
        cpu.mem_map(u64::from(CCM), u64::from(CCM_SIZE), Prot::READ | Prot::WRITE).expect(mapped);
        cpu.mem_map(u64::from(INFORMATION), u64::from(INFORMATION_SIZE), Prot::READ).expect(mapped);
        for (base, length) in [(BANK_2, BANK), (0x4000_0000, 0x2000_0000), (0xE000_0000, 0x10_0000)] {
            cpu.mmio_map(
                u64::from(base),
                u64::from(length),
                Some(move |cpu: &mut Unicorn<'_, State>, offset: u64, size: usize| {
                    read(cpu.get_data_mut(), base + offset as u32, size)
                }),
                Some(move |cpu: &mut Unicorn<'_, State>, offset: u64, size: usize, value: u64| {
                    write(cpu, base + offset as u32, size, value as u32);
                }),
            )
            .expect(mapped);
        }
        cpu.mem_write(u64::from(BANK_1), &image.bank_1).expect("it fits");
        cpu.mem_write(u64::from(UNIQUE_ID), &unique_id).expect("it fits");
        // 512 KiB.
        cpu.mem_write(u64::from(INFORMATION) + 0x75E0, &512_u16.to_le_bytes()).expect("it fits");

        cpu.add_block_hook(1, 0, block).expect("a hook");
        let (waits, sends) = image.hints();
        for address in waits {
            cpu.add_code_hook(u64::from(address), u64::from(address), |cpu, _, _| {
                cpu.get_data_mut().waits = true;
                let _ = cpu.emu_stop();
            })
            .expect("a hook");
        }
        for address in sends {
            cpu.add_code_hook(u64::from(address), u64::from(address), |cpu, _, _| cpu.get_data_mut().event = true)
                .expect("a hook");
        }

        let mut machine = Self {
            cpu,
            pc: 0,
            asleep: false,
            locked_up: false,
            halted_until: 0,
            busy: 0,
            deepest_nesting: 0,
            faults: Vec::new(),
        };
        machine.lose_memory();
        machine.restart();
        machine
    }

    /// The chip around it.
    #[must_use]
    pub fn chip(&self) -> &Chip {
        &self.cpu.get_data().chip
    }

    /// The same, to act on it.
    pub fn chip_mut(&mut self) -> &mut Chip {
        &mut self.cpu.get_data_mut().chip
    }

    /// Instructions since it was made.
    #[must_use]
    pub fn instructions(&self) -> u64 {
        self.cpu.get_data().instructions
    }

    /// Time during which it was not asleep.
    #[must_use]
    pub fn busy(&self) -> Picoseconds {
        self.busy
    }

    /// Address of the next instruction.
    #[must_use]
    pub fn pc(&self) -> u32 {
        self.pc
    }

    /// Whether it waits for an event.
    #[must_use]
    pub fn is_asleep(&self) -> bool {
        self.asleep
    }

    /// Most handlers that were under way at once.
    #[must_use]
    pub fn deepest_nesting(&self) -> usize {
        self.deepest_nesting
    }

    /// Faults of the program since it was made: where and what.
    #[must_use]
    pub fn faults(&self) -> &[String] {
        &self.faults
    }

    /// Bytes of the stack that have been used since the power came.
    #[must_use]
    pub fn stack_used(&self) -> u32 {
        let stack = self.memory(CCM, CCM_SIZE as usize);
        let untouched = stack.iter().take_while(|byte| **byte == PAINT).count();
        CCM_SIZE - untouched as u32
    }

    /// Bytes of memory.
    ///
    /// # Panics
    /// When there is no memory.
    #[must_use]
    pub fn memory(&self, address: u32, length: usize) -> Vec<u8> {
        self.cpu.mem_read_as_vec(u64::from(address), length).expect("memory of the chip")
    }

    /// Writes memory behind the program's back.
    ///
    /// # Panics
    /// When there is no memory.
    pub fn poke(&mut self, address: u32, bytes: &[u8]) {
        self.cpu.mem_write(u64::from(address), bytes).expect("memory of the chip");
    }

    /// A little-endian word of memory.
    #[must_use]
    pub fn word(&self, address: u32) -> u32 {
        let bytes = self.memory(address, 4);
        u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
    }

    /// Stops the core, but nothing around it, for this long.
    pub fn halt_core(&mut self, duration: Picoseconds) {
        self.halted_until = self.chip().now + duration;
    }

    /// Lets the program jump somewhere.
    pub fn jump_to(&mut self, address: u32) {
        self.pc = address;
        self.asleep = false;
    }

    /// Leaves only this many bytes of the stack.
    pub fn exhaust_stack(&mut self, left: u32) {
        self.set(Reg::SP, u64::from(CCM + left));
    }

    /// Makes the program spin in a place that no interrupt leaves, as a deadlock with interrupts off would.
    pub fn hang(&mut self) {
        self.locked_up = true;
    }

    /// What is left in memory that had no power: anything but what the stack is painted with.
    pub fn lose_memory(&mut self) {
        let noise: Vec<u8> = (0..RAM_SIZE).map(|index| (index.wrapping_mul(0x9E37_79B1) >> 24) as u8 ^ 0x5C).collect();
        self.poke(RAM, &noise);
        self.poke(CCM, &vec![PAINT; CCM_SIZE as usize]);
    }

    /// After a reset of the chip: the processor begins with its vector table.
    pub fn restart(&mut self) {
        let stack = self.word(BANK_1);
        for register in [Reg::R0, Reg::R1, Reg::R2, Reg::R3, Reg::R4, Reg::R5, Reg::R6, Reg::R7] {
            self.set(register, 0);
        }
        for register in [Reg::R8, Reg::R9, Reg::R10, Reg::R11, Reg::R12] {
            self.set(register, 0);
        }
        self.set(Reg::PRIMASK, 0);
        self.set(Reg::FAULTMASK, 0);
        self.set(Reg::BASEPRI, 0);
        self.set(Reg::CONTROL, 0);
        self.set(Reg::XPSR_NZCVQG, u64::from(XPSR_THUMB));
        self.set(Reg::SP, u64::from(stack));
        self.set(Reg::LR, 0xFFFF_FFFF);
        self.pc = self.word(BANK_1 + 4) & !1;
        self.asleep = false;
        self.locked_up = false;
        self.halted_until = 0;
        let state = self.cpu.get_data_mut();
        state.event = false;
        state.waits = false;
    }

    fn get(&self, register: Reg) -> u64 {
        self.cpu.reg_read(register).expect("a register of the Cortex-M4")
    }

    fn set(&mut self, register: Reg, value: u64) {
        self.cpu.reg_write(register, value).expect("a register of the Cortex-M4");
    }

    /// Runs until `limit`, until the controller wants something from the bus, or until something happens that the processor cannot go
    /// on after.
    pub fn run_until(&mut self, limit: Picoseconds) -> Halt {
        loop {
            let chip = self.chip_mut();
            chip.advance();
            let now = chip.now;
            if chip.has_stores() {
                for store in self.chip_mut().take_stores() {
                    self.poke(store.address, &store.value.to_le_bytes());
                }
            }
            let chip = self.chip();
            // The program must not run ahead of the bus that it has just given something to.
            let limit = chip.can.wanted_at().map_or(limit, |at| limit.min(at));
            if chip.nvic.reset_requested() {
                return Halt::ResetRequested;
            }
            if chip.flash.power_goes_at().is_some_and(|at| at <= now) {
                return Halt::PowerLost;
            }
            if chip.watchdog.bites_at().is_some_and(|at| at <= now) {
                return Halt::Watchdog;
            }
            if now >= limit {
                return Halt::Due;
            }
            let next = chip.next_event().min(limit);
            let standstill = self.locked_up || now < self.halted_until;
            if standstill {
                let until = if self.locked_up { next } else { next.min(self.halted_until) };
                self.busy += until - now;
                self.chip_mut().now = until;
                continue;
            }
            if self.take_exception() {
                continue;
            }
            if self.asleep {
                self.chip_mut().now = next;
                continue;
            }
            self.execute(next);
        }
    }

    fn execute(&mut self, next: Picoseconds) {
        let state = self.cpu.get_data_mut();
        let began = state.chip.now;
        state.clock = state.chip.rcc.core_period() * CLOCKS_PER_INSTRUCTION / 100;
        state.stop_at = next;
        state.progressed = false;
        state.waits = false;
        let outcome = self.cpu.emu_start(u64::from(self.pc | 1), 0xFFFF_FFFE, 0, 0);
        self.pc = self.get(Reg::PC) as u32 & !1;
        let state = self.cpu.get_data_mut();
        self.busy += state.chip.now - began;
        if state.waits {
            self.pc += 2;
            self.asleep = !std::mem::take(&mut state.event);
            return;
        }
        if self.pc >= 0xFFFF_FF00 {
            self.return_from_exception();
        } else if let Err(error) = outcome {
            self.fault(error);
        }
    }

    /// Priority of an interrupt, 0 to 15, as the program has set it.
    #[must_use]
    pub fn priority(&self, interrupt: usize) -> u8 {
        self.chip().nvic.priority(interrupt)
    }
}

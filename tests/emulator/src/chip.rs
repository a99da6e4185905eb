//! Everything of the STM32G474 around the processor that the firmware touches.
//!
//! Time moves in `advance`, to instants that [`Chip::next_event`] names. Registers are read and written at the
//! processor's present; a write may bring an event nearer, so after each the processor looks again.

pub mod adc;
pub mod dma;
pub mod fdcan;
pub mod flash;
pub mod map;
pub mod nvic;
pub mod rcc;
pub mod timer;
pub mod watchdog;

use std::collections::BTreeMap;

use crate::analog::FrontEnd;
use crate::moment::Picoseconds;
use adc::{Adc, Finished};
use dma::{Dma, Store};
use fdcan::FdCan;
use flash::{Bank2, Flash};
use map::interrupt;
use nvic::Nvic;
use rcc::{Peripheral, Rcc};
use timer::Timer;
use watchdog::Watchdog;

/// The chip without its processor and without the memories that the processor reaches directly.
pub struct Chip {
    /// The present.
    pub now: Picoseconds,
    /// Interrupts.
    pub nvic: Nvic,
    /// Clocks.
    pub rcc: Rcc,
    /// Flash and what it holds.
    pub flash: Flash,
    /// The CAN controller.
    pub can: FdCan,
    /// The watchdog.
    pub watchdog: Watchdog,
    /// What the pins see.
    pub front_end: FrontEnd,
    sample_timer: Timer,
    time_timer: Timer,
    force_adc: Adc,
    bias_adc: Adc,
    adc_common: u32,
    dma: Dma,
    pwr: BTreeMap<u32, u32>,
    plain: BTreeMap<u32, u32>,
    stores: Vec<Store>,
    adc_clock: Picoseconds,
    crystal_works: bool,
    violations: Vec<String>,
    samples: u64,
    lost_samples: u64,
    first_sample: Option<Picoseconds>,
}

impl Chip {
    /// After power has come.
    #[must_use]
    pub fn new(front_end: FrontEnd, bank_2: Bank2) -> Self {
        let crystal_works = true;
        Self {
            now: 0,
            nvic: Nvic::default(),
            rcc: Rcc::new(rcc::flag::BROWN_OUT | rcc::flag::PIN, crystal_works),
            flash: Flash::new(bank_2),
            can: FdCan::default(),
            watchdog: Watchdog::default(),
            front_end,
            sample_timer: Timer::default(),
            time_timer: Timer::default(),
            force_adc: Adc::default(),
            bias_adc: Adc::default(),
            adc_common: 0,
            dma: Dma::default(),
            pwr: BTreeMap::new(),
            plain: BTreeMap::new(),
            stores: Vec::new(),
            adc_clock: 1,
            crystal_works,
            violations: Vec::new(),
            samples: 0,
            lost_samples: 0,
            first_sample: None,
        }
    }

    /// A reset for this reason; flags of earlier ones stay until software removes them.
    pub(crate) fn reset(&mut self, flag: u32) {
        let flags = self.rcc.flags() | flag | rcc::flag::PIN;
        self.restart(flags);
        self.flash.reset();
    }

    /// The power goes and comes back.
    pub(crate) fn power_cycle(&mut self) {
        self.flash.lose_power();
        self.restart(rcc::flag::BROWN_OUT | rcc::flag::PIN);
    }

    fn restart(&mut self, flags: u32) {
        self.nvic = Nvic::default();
        self.rcc = Rcc::new(flags, self.crystal_works);
        self.can = FdCan::default();
        self.watchdog = Watchdog::default();
        self.sample_timer = Timer::default();
        self.time_timer = Timer::default();
        self.force_adc = Adc::default();
        self.bias_adc = Adc::default();
        self.adc_common = 0;
        self.dma = Dma::default();
        self.pwr.clear();
        self.plain.clear();
        self.stores.clear();
        self.first_sample = None;
    }

    /// Whether the crystal starts; holds from the next reset on.
    pub fn set_crystal(&mut self, works: bool) {
        self.crystal_works = works;
    }

    /// What the firmware did that the chip does not permit, or that is not modelled; each once.
    #[must_use]
    pub fn violations(&self) -> &[String] {
        &self.violations
    }

    pub(crate) fn violate(&mut self, what: String) {
        let what = format!("{what} (at {} µs)", self.now / crate::moment::MICROSECOND);
        // A loop would repeat it for ever.
        if self.violations.len() < 20 {
            self.violations.push(what);
        }
    }

    /// Samples that have been converted since the emulator was made.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Samples of these that no DMA fetched, and triggers that came during a conversion.
    #[must_use]
    pub fn lost_samples(&self) -> u64 {
        self.lost_samples + self.force_adc.missed_triggers
    }

    /// Time between two samples, as the firmware has set the timer.
    #[must_use]
    pub fn sample_period(&self) -> Picoseconds {
        self.sample_timer.update_period()
    }

    /// Middle of the first sample since the reset.
    #[must_use]
    pub fn first_sample(&self) -> Option<Picoseconds> {
        self.first_sample
    }

    /// Ends the DMA's next transfer in a bus error, which no driver expects.
    pub fn fail_dma(&mut self) {
        self.dma.fail();
        self.update_lines();
    }

    /// Stops the timer that triggers the samples, as if its clock had failed.
    pub fn stop_samples(&mut self) {
        self.sample_timer = Timer::default();
    }

    pub(crate) fn take_stores(&mut self) -> Vec<Store> {
        std::mem::take(&mut self.stores)
    }

    pub(crate) fn has_stores(&self) -> bool {
        !self.stores.is_empty()
    }

    /// When something happens by itself.
    #[must_use]
    pub fn next_event(&self) -> Picoseconds {
        [
            self.sample_timer.next_event(),
            self.time_timer.next_event(),
            self.force_adc.next_event(),
            self.bias_adc.next_event(),
            self.flash.busy_until(),
            self.flash.power_goes_at(),
            self.watchdog.bites_at(),
        ]
        .into_iter()
        .flatten()
        .min()
        .unwrap_or(Picoseconds::MAX)
    }

    /// Lets happen what is due at the present.
    pub(crate) fn advance(&mut self) {
        let now = self.now;
        if let Some(at) = self.sample_timer.advance(now) {
            self.trigger(at);
        }
        self.time_timer.advance(now);
        self.flash.advance(now);
        while let Some(finished) = self.force_adc.finished(now) {
            if let Finished::Regular(conversion) = finished {
                self.sampled(conversion.middle);
            }
        }
        while self.bias_adc.finished(now).is_some() {
            let code = self.front_end.bias_code();
            self.bias_adc.convert_injected(code);
        }
        self.update_lines();
    }

    fn trigger(&mut self, at: Picoseconds) {
        if self.sample_timer.update_period() != self.front_end.period() {
            self.violate(format!(
                "samples are {} ps apart; the simulated chain is made for {} ps",
                self.sample_timer.update_period(),
                self.front_end.period()
            ));
        }
        self.force_adc.trigger(at, self.adc_clock);
        self.bias_adc.trigger(at, self.adc_clock);
    }

    fn sampled(&mut self, middle: Picoseconds) {
        // The chain gives the sum of 16 conversions.
        let sum = u32::from(self.front_end.force_code(middle));
        let code = (sum * self.force_adc.ratio() / 16) >> self.force_adc.shift();
        self.samples += 1;
        self.first_sample.get_or_insert(middle);
        let store = if self.force_adc.uses_dma() && !self.force_adc.overrun() {
            self.dma.transfer(code as u16).unwrap_or_else(|violation| {
                self.violate(violation);
                None
            })
        } else {
            None
        };
        self.lost_samples += u64::from(store.is_none());
        self.force_adc.convert(code as u16, store.is_some());
        self.stores.extend(store);
    }

    /// Sets the interrupt lines to what the peripherals say.
    pub(crate) fn update_lines(&mut self) {
        let lines = [
            (interrupt::FLASH, self.flash.interrupts()),
            (interrupt::DMA1_CHANNEL1, self.dma.interrupts()),
            (interrupt::ADC1_2, self.force_adc.interrupts() || self.bias_adc.interrupts()),
            (interrupt::FDCAN1_IT0, self.can.interrupts(0)),
            (interrupt::FDCAN1_IT1, self.can.interrupts(1)),
            (interrupt::TIM15, self.time_timer.interrupts()),
            (interrupt::TIM6, self.sample_timer.interrupts()),
        ];
        for (line, high) in lines {
            self.nvic.set_line(line, high);
        }
    }

    fn clocks_changed(&mut self) {
        let period = self.rcc.core_period();
        self.sample_timer.set_clock(self.now, period);
        self.time_timer.set_clock(self.now, period);
        self.adc_clock = self.rcc.adc_hz().map_or(1, |hertz| adc::clock(hertz, self.adc_common));
    }

    /// Whether the clock of the peripheral at an address is on; `None` if it needs none.
    fn clock_of(address: u32) -> Option<Peripheral> {
        match address & !0x3FF {
            map::TIM6 => Some(Peripheral::Tim6),
            map::FDCAN1 => Some(Peripheral::Fdcan),
            map::PWR => Some(Peripheral::Pwr),
            map::SYSCFG => Some(Peripheral::Syscfg),
            map::TIM15 => Some(Peripheral::Tim15),
            map::DMA1 => Some(Peripheral::Dma1),
            map::DMA2 => Some(Peripheral::Dma2),
            map::DMAMUX => Some(Peripheral::DmaMux),
            map::FLASH => Some(Peripheral::Flash),
            map::ADC1 => Some(Peripheral::Adc12),
            port @ map::GPIOA..map::GPIO_END => Some(Peripheral::Gpio(((port - map::GPIOA) / 0x400) as u8)),
            _ if (map::MESSAGE_RAM..map::MESSAGE_RAM + map::MESSAGE_RAM_SIZE).contains(&address) => {
                Some(Peripheral::Fdcan)
            }
            _ => None,
        }
    }

    fn is_clocked(&mut self, address: u32, verb: &str) -> bool {
        match Self::clock_of(address) {
            Some(peripheral) if !self.rcc.is_on(peripheral) => {
                self.violate(format!("0x{address:08X} is {verb}, but the clock of {peripheral:?} is off"));
                false
            }
            _ => true,
        }
    }

    /// The processor reads.
    pub fn read(&mut self, address: u32, size: usize) -> u32 {
        if (map::BANK_2..map::BANK_2 + map::BANK).contains(&address) {
            return self.read_bank_2(address, size);
        }
        if !self.is_clocked(address, "read") {
            return 0;
        }
        let word = self.read_word(address & !3).unwrap_or_else(|| {
            self.violate(format!("0x{address:08X} is read, which is not modelled"));
            0
        });
        let shifted = word >> (8 * (address & 3));
        if size == 4 { shifted } else { shifted & ((1 << (8 * size)) - 1) }
    }

    fn read_bank_2(&mut self, address: u32, size: usize) -> u32 {
        if let Some(ends) = self.flash.busy_until() {
            // The bank is busy: the processor waits.
            self.now = self.now.max(ends);
            self.flash.advance(self.now);
        }
        let (value, torn) = self.flash.load(address, size);
        if torn {
            self.nvic.pend_nmi();
        }
        value as u32
    }

    fn read_word(&mut self, address: u32) -> Option<u32> {
        let now = self.now;
        let offset = address & 0x3FF;
        match address & !0x3FF {
            map::TIM6 => self.sample_timer.read(offset, now),
            map::TIM15 => self.time_timer.read(offset, now),
            map::IWDG => self.watchdog.read(offset),
            map::FDCAN1 => self.can.read(offset),
            map::RCC => self.rcc.read(offset, now),
            map::FLASH => {
                self.flash.advance(now);
                self.flash.read(offset)
            }
            map::DMA1 => self.dma.read(offset),
            map::DMAMUX => self.dma.read_multiplexer(offset),
            map::PWR => Some(self.read_pwr(offset)),
            map::ADC1 => match address & !0xFF {
                map::ADC1 => self.force_adc.read(offset, now),
                map::ADC2 => self.bias_adc.read(offset - 0x100, now),
                map::ADC12_COMMON if offset == 0x308 => Some(self.adc_common),
                _ => None,
            },
            map::SYSTEM_CONTROL..=0xE000_EFFF => self.nvic.read(address - map::SYSTEM_CONTROL),
            _ if (map::MESSAGE_RAM..map::MESSAGE_RAM + map::MESSAGE_RAM_SIZE).contains(&address) => {
                Some(self.can.read_ram(address - map::MESSAGE_RAM))
            }
            _ if Self::is_plain(address) => Some(self.plain.get(&address).copied().unwrap_or(0)),
            _ => None,
        }
    }

    /// Registers whose effect does not matter here: pins, debugging, external interrupts, a DMA that is not used.
    fn is_plain(address: u32) -> bool {
        matches!(address & !0x3FF, map::SYSCFG | map::EXTI | map::DBGMCU | map::DMA2)
            || (map::GPIOA..map::GPIO_END).contains(&address)
    }

    fn read_pwr(&self, offset: u32) -> u32 {
        let reset = match offset {
            0x00 => 0x200,
            0x80 => 0x100,
            _ => 0,
        };
        self.pwr.get(&offset).copied().unwrap_or(reset)
    }

    /// The processor writes.
    pub fn write(&mut self, address: u32, size: usize, value: u32) {
        if (map::BANK_2..map::BANK_2 + map::BANK).contains(&address) {
            self.flash.store(address, size, value, self.now);
            return;
        }
        if !self.is_clocked(address, "written") {
            return;
        }
        let word = address & !3;
        let value = if size == 4 {
            value
        } else if (map::SYSTEM_CONTROL + 0x400..map::SYSTEM_CONTROL + 0x500).contains(&word) || Self::is_plain(word) {
            // Priorities are bytes.
            let mask = ((1 << (8 * size)) - 1) << (8 * (address & 3));
            self.read_word(word).unwrap_or(0) & !mask | value << (8 * (address & 3)) & mask
        } else if size == 2 && address == word && matches!(word & !0x3FF, map::TIM6 | map::TIM15) {
            // Some registers of timers are half-words, and the rest of their words is reserved.
            value
        } else {
            self.violate(format!("{size} bytes are written to the register at 0x{address:08X}"));
            return;
        };
        if let Err(violation) = self.write_word(word, value) {
            self.violate(violation);
        }
        self.update_lines();
    }

    fn write_word(&mut self, address: u32, value: u32) -> Result<(), String> {
        let now = self.now;
        let offset = address & 0x3FF;
        let known = |known: bool| {
            if known { Ok(()) } else { Err(format!("0x{address:08X} is written, which is not modelled")) }
        };
        match address & !0x3FF {
            map::TIM6 => known(self.sample_timer.write(offset, value, now)),
            map::TIM15 => known(self.time_timer.write(offset, value, now)),
            map::IWDG => self.watchdog.write(offset, value, now),
            map::FDCAN1 => self.can.write(offset, value, now),
            map::FLASH => {
                self.flash.advance(now);
                self.flash.write(offset, value, now)
            }
            map::DMA1 => self.dma.write(offset, value),
            map::DMAMUX => self.dma.write_multiplexer(offset, value),
            map::PWR => {
                self.pwr.insert(offset, value);
                self.rcc.set_boost(self.read_pwr(0x80) & 0x100 == 0);
                Ok(())
            }
            map::RCC => {
                for peripheral in Peripheral::reset_by(offset, value) {
                    self.reset_peripheral(peripheral);
                }
                let outcome = self.rcc.write(offset, value, now, self.flash.latency());
                self.clocks_changed();
                outcome
            }
            map::ADC1 => {
                let clock = self.adc_clock;
                let outcome = match address & !0xFF {
                    map::ADC1 => self.force_adc.write(offset, value, now, clock),
                    map::ADC2 => self.bias_adc.write(offset - 0x100, value, now, clock),
                    map::ADC12_COMMON if offset == 0x308 => {
                        self.adc_common = value;
                        Ok(())
                    }
                    _ => known(false),
                };
                self.clocks_changed();
                outcome
            }
            map::SYSTEM_CONTROL..=0xE000_EFFF => known(self.nvic.write(address - map::SYSTEM_CONTROL, value)),
            _ if (map::MESSAGE_RAM..map::MESSAGE_RAM + map::MESSAGE_RAM_SIZE).contains(&address) => {
                self.can.write_ram(address - map::MESSAGE_RAM, value);
                Ok(())
            }
            _ if Self::is_plain(address) => {
                self.plain.insert(address, value);
                Ok(())
            }
            _ => known(false),
        }
    }

    fn reset_peripheral(&mut self, peripheral: Peripheral) {
        match peripheral {
            Peripheral::Tim6 => self.sample_timer = Timer::default(),
            Peripheral::Tim15 => self.time_timer = Timer::default(),
            Peripheral::Adc12 => {
                self.force_adc = Adc::default();
                self.bias_adc = Adc::default();
            }
            Peripheral::Dma1 => self.dma = Dma::default(),
            Peripheral::Fdcan => self.can = FdCan::default(),
            _ => {}
        }
        self.clocks_changed();
    }
}

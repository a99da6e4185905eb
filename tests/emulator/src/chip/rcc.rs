//! Reset and clock control, and the supply's part in it. RM0440 chapters 6 and 7.
//!
//! ```text
//! HSI 16 MHz ─┬──────────────────────────────────────▶ SYSCLK ÷ HPRE ▶ core, buses, timers (APB prescalers must be 1)
//! crystal ────┴▶ ÷ M ─▶ × N ─┬▶ ÷ R ──────────────────┘
//!                            └▶ ÷ Q ─▶ FDCAN
//! ```

use crate::moment::{MICROSECOND, Picoseconds, period};

/// Starting times from the data sheet DS12288: crystal typically 2 ms, PLL at most 40 µs, HSI48 6 µs, voltage scaling 20 µs.
const CRYSTAL_STARTS: Picoseconds = 2_000 * MICROSECOND;
const PLL_LOCKS: Picoseconds = 40 * MICROSECOND;

const HSI_HZ: u64 = 16_000_000;
/// The crystal of the Nucleo.
pub const CRYSTAL_HZ: u64 = 24_000_000;

const HSION: u32 = 1 << 8;
const HSIRDY: u32 = 1 << 10;
const HSEON: u32 = 1 << 16;
const HSERDY: u32 = 1 << 17;
const PLLON: u32 = 1 << 24;
const PLLRDY: u32 = 1 << 25;

/// Reset flags, RCC_CSR.
pub mod flag {
    /// The reset pin, which every reset pulls.
    pub const PIN: u32 = 1 << 26;
    /// Brown-out or power-on.
    pub const BROWN_OUT: u32 = 1 << 27;
    /// SYSRESETREQ.
    pub const SOFTWARE: u32 = 1 << 28;
    /// The independent watchdog.
    pub const WATCHDOG: u32 = 1 << 29;
}
const RMVF: u32 = 1 << 23;

/// What can be switched and reset; the bit in its enable register, whose number is the first field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Peripheral {
    Dma1,
    Dma2,
    DmaMux,
    Flash,
    Gpio(u8),
    Adc12,
    Tim6,
    Fdcan,
    Pwr,
    Syscfg,
    Tim15,
}

impl Peripheral {
    /// Offsets of its enable and reset registers, and its bit in both.
    const fn place(self) -> (u32, u32, u32) {
        match self {
            Self::Dma1 => (0x48, 0x28, 0),
            Self::Dma2 => (0x48, 0x28, 1),
            Self::DmaMux => (0x48, 0x28, 2),
            Self::Flash => (0x48, 0x28, 8),
            Self::Gpio(port) => (0x4C, 0x2C, port as u32),
            Self::Adc12 => (0x4C, 0x2C, 13),
            Self::Tim6 => (0x58, 0x38, 4),
            Self::Fdcan => (0x58, 0x38, 25),
            Self::Pwr => (0x58, 0x38, 28),
            Self::Syscfg => (0x60, 0x40, 0),
            Self::Tim15 => (0x60, 0x40, 16),
        }
    }

    /// Those that are reset by writing this to that reset register.
    pub(super) fn reset_by(offset: u32, value: u32) -> impl Iterator<Item = Self> {
        [Self::Dma1, Self::Dma2, Self::DmaMux, Self::Adc12, Self::Tim6, Self::Fdcan, Self::Tim15].into_iter().filter(
            move |peripheral| {
                let (_, reset, bit) = peripheral.place();
                reset == offset && value & 1 << bit != 0
            },
        )
    }
}

/// The registers, word by word.
#[derive(Clone, Debug)]
pub struct Rcc {
    registers: [u32; 0x28],
    crystal_works: bool,
    crystal_ready: Picoseconds,
    pll_ready: Picoseconds,
    boost: bool,
}

const CR: usize = 0;
const CFGR: usize = 0x08 / 4;
const PLLCFGR: usize = 0x0C / 4;
const CCIPR: usize = 0x88 / 4;
const BDCR: usize = 0x90 / 4;
const CSR: usize = 0x94 / 4;
const CRRCR: usize = 0x98 / 4;

impl Rcc {
    /// After a reset, with these flags.
    pub(super) fn new(flags: u32, crystal_works: bool) -> Self {
        let mut registers = [0; 0x28];
        registers[CR] = 0x63 | HSION;
        registers[CFGR] = 0x5;
        registers[PLLCFGR] = 0x1000;
        registers[0x48 / 4] = 0x100;
        registers[CSR] = flags;
        Self { registers, crystal_works, crystal_ready: 0, pll_ready: 0, boost: false }
    }

    pub(super) fn flags(&self) -> u32 {
        self.registers[CSR] & 0xFE00_0000
    }

    pub(super) fn set_boost(&mut self, boost: bool) {
        self.boost = boost;
    }

    pub(super) fn is_on(&self, peripheral: Peripheral) -> bool {
        let (enable, _, bit) = peripheral.place();
        self.registers[enable as usize / 4] & 1 << bit != 0
    }

    fn crystal(&self, now: Picoseconds) -> bool {
        self.registers[CR] & HSEON != 0 && self.crystal_works && now >= self.crystal_ready
    }

    fn pll(&self, now: Picoseconds) -> bool {
        self.registers[CR] & PLLON != 0 && now >= self.pll_ready && self.pll_input().is_some()
    }

    fn pll_input(&self) -> Option<u64> {
        match self.registers[PLLCFGR] & 3 {
            2 => Some(HSI_HZ),
            3 => Some(CRYSTAL_HZ),
            _ => None,
        }
    }

    fn vco_hz(&self) -> Option<u64> {
        let register = self.registers[PLLCFGR];
        let divider = u64::from(register >> 4 & 0xF) + 1;
        Some(self.pll_input()? / divider * u64::from(register >> 8 & 0x7F))
    }

    fn pll_q_hz(&self) -> Option<u64> {
        let register = self.registers[PLLCFGR];
        (register & 1 << 20 != 0).then_some(())?;
        Some(self.vco_hz()? / (2 * (u64::from(register >> 21 & 3) + 1)))
    }

    fn pll_r_hz(&self) -> Option<u64> {
        let register = self.registers[PLLCFGR];
        (register & 1 << 24 != 0).then_some(())?;
        Some(self.vco_hz()? / (2 * (u64::from(register >> 25 & 3) + 1)))
    }

    /// SYSCLK, Hz.
    #[must_use]
    pub fn system_hz(&self) -> u64 {
        match self.registers[CFGR] & 3 {
            2 => CRYSTAL_HZ,
            3 => self.pll_r_hz().unwrap_or(HSI_HZ),
            _ => HSI_HZ,
        }
    }

    /// Clock of core and buses, Hz.
    #[must_use]
    pub fn core_hz(&self) -> u64 {
        let divider = match self.registers[CFGR] >> 4 & 0xF {
            prescaler @ 8..=11 => 1 << (prescaler - 7),
            prescaler @ 12..=15 => 1 << (prescaler - 6),
            _ => 1,
        };
        self.system_hz() / divider
    }

    /// Period of the core's clock.
    #[must_use]
    pub fn core_period(&self) -> Picoseconds {
        period(self.core_hz())
    }

    /// Kernel clock of the FDCAN, Hz; `None` when its source is off.
    #[must_use]
    pub fn fdcan_hz(&self) -> Option<u64> {
        match self.registers[CCIPR] >> 24 & 3 {
            0 => (self.registers[CR] & HSEON != 0).then_some(CRYSTAL_HZ),
            1 => self.pll_q_hz(),
            2 => Some(self.core_hz()),
            _ => None,
        }
    }

    /// Clock of ADC1 and ADC2 before their own prescaler, Hz; `None` when it is off.
    #[must_use]
    pub fn adc_hz(&self) -> Option<u64> {
        (self.registers[CCIPR] >> 28 & 3 == 2).then(|| self.system_hz())
    }

    pub(super) fn read(&self, offset: u32, now: Picoseconds) -> Option<u32> {
        let value = *self.registers.get(offset as usize / 4)?;
        let with = |condition: bool, bit: u32| if condition { bit } else { 0 };
        Some(match offset as usize / 4 {
            CR => {
                value | with(value & HSION != 0, HSIRDY) | with(self.crystal(now), HSERDY) | with(self.pll(now), PLLRDY)
            }
            CFGR => value & !0xC | (value & 3) << 2,
            BDCR | CSR | CRRCR => value & !2 | with(value & 1 != 0, 2),
            _ => value,
        })
    }

    /// Writes; what the write makes wrong, if anything.
    pub(super) fn write(&mut self, offset: u32, value: u32, now: Picoseconds, latency: u32) -> Result<(), String> {
        let index = offset as usize / 4;
        let Some(register) = self.registers.get_mut(index) else {
            return Err(format!("RCC has no register at offset 0x{offset:X}"));
        };
        let before = std::mem::replace(register, value);
        let pll_runs = self.registers[CR] & PLLON != 0;
        match index {
            CR => {
                if value & !before & HSEON != 0 {
                    self.crystal_ready = now + CRYSTAL_STARTS;
                }
                if value & !before & PLLON != 0 {
                    self.pll_ready = now + PLL_LOCKS;
                    if self.pll_input() == Some(CRYSTAL_HZ) && !self.crystal(now) {
                        return Err("the PLL is started on a crystal that is not ready".into());
                    }
                }
            }
            PLLCFGR if pll_runs && (before ^ value) & 0x7FFF != 0 => {
                return Err("the PLL is changed while it runs".into());
            }
            CSR => {
                let flags = if value & RMVF != 0 { 0 } else { before & 0xFE00_0000 };
                self.registers[CSR] = value & 1 | flags;
            }
            CFGR => {
                if value & 3 == 3 && !self.pll(now) {
                    return Err("SYSCLK is switched to a PLL that has not locked".into());
                }
                if value & 0x3F00 != 0 && value >> 8 & 4 | value >> 11 & 4 != 0 {
                    return Err("the prescalers of the APBs are not modelled".into());
                }
                // RM0440 table 29: in range 1 with boost a wait state for every 34 MHz, without for every 30 or less.
                let step = if self.boost { 34_000_000 } else { 30_000_000 };
                let needed = (self.core_hz() - 1) / step;
                if needed > u64::from(latency) {
                    return Err(format!("{} Hz with a flash latency of {latency}, needed {needed}", self.core_hz()));
                }
                if self.core_hz() > 150_000_000 && !self.boost {
                    return Err(format!("{} Hz without the boost of range 1", self.core_hz()));
                }
            }
            _ => {}
        }
        Ok(())
    }
}

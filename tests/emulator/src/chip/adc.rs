//! A converter: regulator, calibration, a regular and an injected conversion by trigger, oversampling. RM0440 chapter 21.
//!
//! ```text
//! trigger ─▶ OVSR × (sampling + 12.5 clocks) ─▶ DR ─▶ DMA, or OVR if nobody takes it
//! ```
//!
//! One channel in each sequence; the clock is the kernel clock divided in ADC12_CCR.

use crate::moment::{MICROSECOND, Picoseconds, period};

const ADRDY: u32 = 1;
const EOSMP: u32 = 1 << 1;
const EOC: u32 = 1 << 2;
const EOS: u32 = 1 << 3;
const OVR: u32 = 1 << 4;
const JEOC: u32 = 1 << 5;
const JEOS: u32 = 1 << 6;

const ADEN: u32 = 1;
const ADDIS: u32 = 1 << 1;
const ADSTART: u32 = 1 << 2;
const JADSTART: u32 = 1 << 3;
const ADSTP: u32 = 1 << 4;
const JADSTP: u32 = 1 << 5;
const ADVREGEN: u32 = 1 << 28;
const ADCAL: u32 = 1 << 31;

const DMAEN: u32 = 1;
const DMACFG: u32 = 2;
const JQDIS: u32 = 1 << 31;

/// TIM6_TRGO as trigger of regular and injected conversions of ADC1 and ADC2, RM0440 tables 166 and 167.
const EXTSEL_TIM6: u32 = 13;
const JEXTSEL_TIM6: u32 = 14;

/// Start of the regulator, DS12288.
const REGULATOR_STARTS: Picoseconds = 20 * MICROSECOND;
/// Clocks of a calibration, DS12288: 116.
const CALIBRATION_CLOCKS: u64 = 116;
/// Clocks of sampling times two, by the code in SMPR.
const SAMPLING_HALF_CLOCKS: [u64; 8] = [5, 13, 25, 49, 95, 185, 495, 1281];
/// Half clocks of the approximation of 12 bits.
const APPROXIMATION_HALF_CLOCKS: u64 = 25;

/// A conversion under way.
#[derive(Clone, Copy, Debug)]
pub struct Conversion {
    /// Middle of the time over which it averages.
    pub middle: Picoseconds,
    ends: Picoseconds,
}

/// What a converter has finished.
#[derive(Clone, Copy, Debug)]
pub enum Finished {
    /// A regular conversion.
    Regular(Conversion),
    /// An injected conversion.
    Injected,
}

/// A converter.
#[derive(Clone, Debug, Default)]
pub struct Adc {
    isr: u32,
    ier: u32,
    cr: u32,
    cfgr: u32,
    cfgr2: u32,
    smpr: [u32; 2],
    sqr: [u32; 4],
    jsqr: u32,
    data: u32,
    injected_data: u32,
    difsel: u32,
    regulator_since: Picoseconds,
    calibrated_at: Option<Picoseconds>,
    calibrated: bool,
    regular: Option<Conversion>,
    injected: Option<Picoseconds>,
    /// Triggers that came while a conversion was still under way.
    pub(super) missed_triggers: u64,
}

impl Adc {
    fn half_clocks(&self, channel: u32) -> u64 {
        let code = if channel < 10 { self.smpr[0] >> (3 * channel) } else { self.smpr[1] >> (3 * (channel - 10)) };
        SAMPLING_HALF_CLOCKS[code as usize & 7] + APPROXIMATION_HALF_CLOCKS
    }

    /// Conversions that are summed into one.
    #[must_use]
    pub fn ratio(&self) -> u32 {
        if self.cfgr2 & 1 != 0 { 2 << (self.cfgr2 >> 2 & 7) } else { 1 }
    }

    /// By how many bits the sum is shifted.
    #[must_use]
    pub fn shift(&self) -> u32 {
        if self.cfgr2 & 1 != 0 { self.cfgr2 >> 5 & 0xF } else { 0 }
    }

    pub(super) fn uses_dma(&self) -> bool {
        self.cfgr & (DMAEN | DMACFG) == DMAEN | DMACFG
    }

    /// TIM6 has triggered; `clock` is the converter's.
    pub(super) fn trigger(&mut self, at: Picoseconds, clock: Picoseconds) {
        if self.cr & ADEN == 0 {
            return;
        }
        if self.cr & ADSTART != 0 && self.cfgr >> 10 & 3 == 1 && self.cfgr >> 5 & 0x1F == EXTSEL_TIM6 {
            let lasts = u64::from(self.ratio()) * self.half_clocks(self.sqr[0] >> 6 & 0x1F) * clock / 2;
            if self.regular.is_some() {
                self.missed_triggers += 1;
            } else {
                self.regular = Some(Conversion { middle: at + lasts / 2, ends: at + lasts });
            }
        }
        if self.cr & JADSTART != 0 && self.jsqr >> 7 & 3 == 1 && self.jsqr >> 2 & 0x1F == JEXTSEL_TIM6 {
            let lasts = self.half_clocks(self.jsqr >> 9 & 0x1F) * clock / 2;
            if self.injected.is_some() {
                self.missed_triggers += 1;
            } else {
                self.injected = Some(at + lasts);
            }
        }
    }

    pub(super) fn next_event(&self) -> Option<Picoseconds> {
        [self.regular.map(|conversion| conversion.ends), self.injected].into_iter().flatten().min()
    }

    pub(super) fn finished(&mut self, now: Picoseconds) -> Option<Finished> {
        if let Some(conversion) = self.regular.filter(|conversion| conversion.ends <= now) {
            self.regular = None;
            return Some(Finished::Regular(conversion));
        }
        self.injected.filter(|ends| *ends <= now)?;
        self.injected = None;
        Some(Finished::Injected)
    }

    /// A regular conversion has this result; `taken`: the DMA has fetched it.
    pub(super) fn convert(&mut self, value: u16, taken: bool) {
        if !taken && self.isr & EOC != 0 {
            self.isr |= OVR;
        }
        self.data = u32::from(value);
        self.isr |= EOSMP | EOS;
        if !taken {
            self.isr |= EOC;
        }
    }

    /// Whether it still asks the DMA: after an overrun it does not.
    pub(super) fn overrun(&self) -> bool {
        self.isr & OVR != 0
    }

    pub(super) fn convert_injected(&mut self, value: u16) {
        self.injected_data = u32::from(value);
        self.isr |= JEOC | JEOS;
    }

    pub(super) fn interrupts(&self) -> bool {
        self.isr & self.ier != 0
    }

    pub(super) fn read(&mut self, offset: u32, now: Picoseconds) -> Option<u32> {
        if self.calibrated_at.is_some_and(|at| at <= now) {
            self.calibrated_at = None;
            self.calibrated = true;
            self.cr &= !ADCAL;
        }
        Some(match offset {
            0x00 => self.isr,
            0x04 => self.ier,
            0x08 => self.cr,
            0x0C => self.cfgr,
            0x10 => self.cfgr2,
            0x14 => self.smpr[0],
            0x18 => self.smpr[1],
            0x30..=0x3C => self.sqr[(offset - 0x30) as usize / 4],
            0x40 => {
                self.isr &= !EOC;
                self.data
            }
            0x4C => self.jsqr,
            0x80 => {
                self.isr &= !JEOC;
                self.injected_data
            }
            0xB0 => self.difsel,
            _ => return None,
        })
    }

    pub(super) fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: Picoseconds,
        clock: Picoseconds,
    ) -> Result<(), String> {
        let converting = self.cr & ADSTART != 0;
        match offset {
            0x00 => self.isr &= !value,
            0x04 => self.ier = value,
            0x08 => return self.control(value, now, clock),
            0x0C if converting => return Err("ADC_CFGR is written during conversions".into()),
            0x0C => self.cfgr = value,
            0x10 if converting => return Err("ADC_CFGR2 is written during conversions".into()),
            0x10 => self.cfgr2 = value,
            0x14 => self.smpr[0] = value,
            0x18 => self.smpr[1] = value,
            0x30..=0x3C => self.sqr[(offset - 0x30) as usize / 4] = value,
            0x4C => {
                // With the queue of contexts every write is a context of its own.
                if self.cfgr & JQDIS == 0 && self.jsqr != 0 {
                    return Err("a second context in the queue of injected conversions".into());
                }
                self.jsqr = value;
            }
            // Without effect while the converter is on.
            0xB0 if self.cr & ADEN != 0 => {}
            0xB0 => self.difsel = value,
            _ => return Err(format!("ADC at offset 0x{offset:X} is not modelled")),
        }
        Ok(())
    }

    fn control(&mut self, value: u32, now: Picoseconds, clock: Picoseconds) -> Result<(), String> {
        if value & !self.cr & ADVREGEN != 0 {
            self.regulator_since = now;
        }
        // ADVREGEN, DEEPPWD and ADCALDIF are written; the others are only set.
        self.cr = self.cr & !0x7000_0000 | value & 0x7000_0000;
        let ready = self.cr & ADVREGEN != 0 && now >= self.regulator_since + REGULATOR_STARTS;
        if value & ADCAL != 0 {
            if !ready || self.cr & ADEN != 0 {
                return Err("an ADC is calibrated before its regulator has started, or while it is on".into());
            }
            self.cr |= ADCAL;
            self.calibrated_at = Some(now + CALIBRATION_CLOCKS * clock);
        }
        if value & ADEN != 0 && self.cr & ADEN == 0 {
            if !ready || !self.calibrated || self.calibrated_at.is_some() {
                return Err("an ADC is switched on without regulator or calibration".into());
            }
            self.cr |= ADEN;
            self.isr |= ADRDY;
        }
        if value & ADDIS != 0 {
            self.cr &= !(ADEN | ADSTART | JADSTART);
        }
        if value & ADSTP != 0 {
            self.cr &= !ADSTART;
            self.regular = None;
        }
        if value & JADSTP != 0 {
            self.cr &= !JADSTART;
            self.injected = None;
        }
        if value & (ADSTART | JADSTART) != 0 && self.cr & ADEN == 0 {
            return Err("conversions are started on an ADC that is off".into());
        }
        self.cr |= value & (ADSTART | JADSTART);
        Ok(())
    }
}

/// Divider of the kernel clock, ADC12_CCR.PRESC.
#[must_use]
pub fn prescaler(ccr: u32) -> u64 {
    [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256][(ccr >> 18 & 0xF).min(11) as usize]
}

/// Period of the converters' clock.
#[must_use]
pub fn clock(kernel_hz: u64, ccr: u32) -> Picoseconds {
    period(kernel_hz) * prescaler(ccr)
}

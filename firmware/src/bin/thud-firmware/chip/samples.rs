//! The samples: a timer triggers, the ADC averages, the DMA collects.
//!
//! ```text
//! TIM6 20 kHz ─┬▶ ADC1, PA0, 16 conversions each ─▶ DMA1 channel 1 ─▶ [ block A | block B ] ─▶ half and full wake the sampler
//!              └▶ ADC2, PA1, bias of the cell   ─▶ injected data register, read once in a block
//! ```
//!
//! The bias has a converter of its own: in ADC1's sequence it would cost half the time for averaging the force.
//!
//! An ADC that stops (its own overrun, a hung bus) gives no more blocks; the sampler then lives no more and the watchdog bites.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, Exten, InjectedAdc, RingBufferedAdc, Rovsm, SampleTime, Trovs};
use embassy_stm32::pac;
use embassy_stm32::peripherals::{ADC1, ADC2, DMA1_CH1, PA0, PA1, TIM6};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{MasterMode, RoundTo, Timer};
use embassy_stm32::triggers::TIM6_TRGO;
use embassy_stm32::{bind_interrupts, dma};
use embassy_time::Instant;
use thud_firmware::board::{AdcCode, BLOCK, BlockInfo, Overrun, Samples};
use thud_firmware::units::Volt;

use super::memory;
use crate::conversion::{OVERSAMPLING, SAMPLE_RATE_HZ, bias_volt, block_completed_at};

bind_interrupts!(struct Interrupts {
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
});

/// ADC_CFGR2.OVSR for a ratio of 2ⁿ⁺¹.
const RATIO: u8 = OVERSAMPLING.trailing_zeros() as u8 - 1;
const _: () = assert!(OVERSAMPLING == 2 << RATIO);

/// What the stream of samples is made of.
pub struct Wiring {
    pub timer: Peri<'static, TIM6>,
    pub force_adc: Peri<'static, ADC1>,
    pub force: Peri<'static, PA0>,
    pub dma: Peri<'static, DMA1_CH1>,
    pub bias_adc: Peri<'static, ADC2>,
    pub bias: Peri<'static, PA1>,
}

/// The stream of samples, running.
pub struct AdcSamples {
    ring: RingBufferedAdc<'static, ADC1>,
    bias: InjectedAdc<'static, ADC2, 1>,
    /// Dropping it would stop it.
    _timer: Timer<'static, TIM6>,
    started: Instant,
    next_index: u64,
    /// The block after a gap, by whose time the gap was measured.
    after_gap: Option<[AdcCode; BLOCK]>,
}

impl AdcSamples {
    /// Starts it; sample 0 is triggered 50 µs later.
    pub fn start(wiring: Wiring) -> Self {
        let bias = Adc::new(wiring.bias_adc, AdcConfig::default());
        // With the queue of contexts every write to JSQR is a context of its own, and the driver writes it three times.
        pac::ADC2.cfgr().modify(|cfgr| cfgr.set_jqdis(true));
        let bias = bias.setup_injected_conversions(
            [(wiring.bias.degrade_adc(), SampleTime::CYCLES247_5)],
            TIM6_TRGO,
            Exten::RISING_EDGE,
            false,
        );
        let force = Adc::new(
            wiring.force_adc,
            AdcConfig {
                oversampling_ratio: Some(RATIO),
                oversampling_shift: Some(0),
                oversampling_mode: Some((Rovsm::CONTINUED, Trovs::AUTOMATIC, true)),
                ..AdcConfig::default()
            },
        );
        let mut ring = force.into_ring_buffered(
            wiring.dma,
            memory::RING.init([0; 2 * BLOCK]),
            Interrupts,
            [(wiring.force.degrade_adc(), SampleTime::CYCLES92_5)].into_iter(),
            TIM6_TRGO,
            Exten::RISING_EDGE,
        );
        // After an overrun go on with a whole block: one that straddles the halves would always come too late.
        ring.set_alignment(BLOCK);
        ring.start();
        let timer = Timer::new(wiring.timer);
        timer.set_frequency(Hertz(SAMPLE_RATE_HZ), RoundTo::Slower);
        timer.regs_basic().cr2().modify(|cr2| cr2.set_mms(MasterMode::UPDATE));
        timer.start();
        Self { ring, bias, _timer: timer, started: Instant::now(), next_index: 0, after_gap: None }
    }

    fn info(&mut self) -> BlockInfo {
        let [code] = self.bias.read_injected_samples();
        let first_index = self.next_index;
        self.next_index += BLOCK as u64;
        BlockInfo { first_index, bias: Volt(bias_volt(code)) }
    }
}

impl Samples for AdcSamples {
    async fn next_block(&mut self, block: &mut [AdcCode; BLOCK]) -> Result<BlockInfo, Overrun> {
        if let Some(held) = self.after_gap.take() {
            *block = held;
            return Ok(self.info());
        }
        if self.ring.read(block).await.is_ok() {
            return Ok(self.info());
        }
        let mut held = [0; BLOCK];
        // The driver begins anew after an error; should that block be overrun too, the gap is the longer.
        while self.ring.read(&mut held).await.is_err() {}
        let first_index = block_completed_at(self.started.elapsed().as_micros());
        let lost = first_index.saturating_sub(self.next_index);
        self.next_index = first_index.max(self.next_index);
        self.after_gap = Some(held);
        Err(Overrun { lost: u32::try_from(lost).unwrap_or(u32::MAX) })
    }
}

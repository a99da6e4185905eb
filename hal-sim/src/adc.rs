//! The ADC: blocks of codes at exact instants, in a ring that can be lapped.
//!
//! ```text
//! timer ──▶ sample n at power-up + n/f_s ──▶ DMA ring of two halves ──▶ next_block
//!                                            │ half k │ half k+1 │   half k is overwritten by the first sample of half k+2
//! ```
//!
//! The ring belongs to the hardware and fills whether or not anybody reads. Samples are computed when they are read
//! or lost, never dropped from the chain's own time.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use embassy_time::{Duration, Instant, Timer};
use thud_firmware::board::{AdcCode, BLOCK, BlockInfo, Overrun, Samples};

use crate::chain::MeasuringChain;
use crate::force::ForceSource;

/// From the trigger to the code in memory: 16-fold oversampling of 15 cycles at 40 MHz.
pub const CONVERSION: Duration = Duration::from_micros(16 * 15 / 40);

/// Halves of the DMA ring.
const HALVES: u64 = 2;

/// The converter with everything before it, as the board holds it from power-up to power-down.
pub struct Converter {
    chain: MeasuringChain,
    force: Box<dyn ForceSource>,
    started: Instant,
    period_us: f64,
    /// Number of the next sample that is read, since the start.
    next: u64,
    gaps: VecDeque<Gap>,
    lost: u64,
    hangs: bool,
}

#[derive(Clone, Copy)]
struct Gap {
    at: u64,
    samples: u32,
}

impl Converter {
    /// A converter that has not been started.
    #[must_use]
    pub fn new(chain: MeasuringChain, force: impl ForceSource + 'static) -> Self {
        let period_us = 1e6 / f64::from(chain.sample_rate().0);
        let force = Box::new(force);
        Self { chain, force, started: Instant::MIN, period_us, next: 0, gaps: VecDeque::new(), lost: 0, hangs: false }
    }

    /// Begins with sample 0 at `now`.
    pub fn start(&mut self, now: Instant) {
        self.started = now;
        self.next = 0;
        self.hangs = false;
    }

    /// The chain, to break and mend it.
    pub fn chain(&mut self) -> &mut MeasuringChain {
        &mut self.chain
    }

    /// Loses this many samples at the first block that begins at or after sample `at` (counted since power-up), as
    /// if the ring had been lapped.
    pub fn lose(&mut self, at: u64, samples: u32) {
        self.gaps.push_back(Gap { at, samples });
    }

    /// Stops handing on samples until the next start, as when the trigger timer or the DMA stands still.
    pub fn hang(&mut self) {
        self.hangs = true;
    }

    /// Samples lost since the board exists.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// The world's instant of a sample since power-up, rounded up to the clock's microsecond.
    #[must_use]
    pub fn instant_of(&self, sample: u64) -> Instant {
        self.started + Duration::from_micros((sample as f64 * self.period_us).ceil() as u64)
    }

    fn in_memory(&self, sample: u64) -> Instant {
        self.instant_of(sample) + CONVERSION
    }

    fn injected_gap(&mut self) -> Option<u32> {
        let due = self.gaps.iter().position(|gap| gap.at <= self.next)?;
        self.gaps.remove(due).map(|gap| gap.samples)
    }

    /// How many samples are overwritten before the oldest half that can still be read.
    fn lapped(&self, now: Instant) -> u64 {
        let block = BLOCK as u64;
        if now < self.in_memory(self.next + HALVES * block) {
            return 0;
        }
        let elapsed_us = (now - self.started - CONVERSION).as_micros() as f64;
        let converted = (elapsed_us / self.period_us) as u64 + 1;
        let complete_blocks = (converted - self.next) / block;
        (complete_blocks - 1) * block
    }

    fn skip(&mut self, samples: u64) {
        let mut codes = [0; BLOCK];
        let mut rest = samples;
        while rest > 0 {
            let some = rest.min(BLOCK as u64);
            self.convert(&mut codes[..some as usize]);
            rest -= some;
        }
        self.lost += samples;
    }

    fn convert(&mut self, codes: &mut [AdcCode]) {
        let mut newtons = [0.0; BLOCK];
        let newtons = &mut newtons[..codes.len()];
        let first_s = (self.started.as_micros() as f64 + self.next as f64 * self.period_us) * 1e-6;
        self.force.fill(first_s, self.period_us * 1e-6, newtons);
        self.chain.convert(newtons, codes);
        self.next += codes.len() as u64;
    }
}

/// The sampling half of the board, as the firmware sees it.
pub struct Adc {
    converter: Rc<RefCell<Converter>>,
}

impl Adc {
    /// Reads from this converter.
    #[must_use]
    pub fn new(converter: Rc<RefCell<Converter>>) -> Self {
        Self { converter }
    }
}

impl Samples for Adc {
    async fn next_block(&mut self, block: &mut [AdcCode; BLOCK]) -> Result<BlockInfo, Overrun> {
        let complete = {
            let converter = self.converter.borrow();
            converter.in_memory(converter.next + BLOCK as u64 - 1)
        };
        Timer::at(complete).await;
        if self.converter.borrow().hangs {
            std::future::pending::<()>().await;
        }
        let mut converter = self.converter.borrow_mut();
        let lost = converter.injected_gap().map_or_else(|| converter.lapped(Instant::now()), u64::from);
        if lost > 0 {
            converter.skip(lost);
            return Err(Overrun { lost: u32::try_from(lost).unwrap_or(u32::MAX) });
        }
        let first_index = converter.next;
        converter.convert(block);
        Ok(BlockInfo { first_index, bias: converter.chain.bias() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::ChainSettings;
    use crate::time::Scheduler;

    /// A force that is its own sample number, in codes; what was read, and when.
    type Seen = Vec<(u64, Result<(u64, [AdcCode; BLOCK]), Overrun>)>;

    fn read(sample_rate: f32, prepare: impl Fn(&mut Converter), pauses_us: &'static [u64]) -> Seen {
        let settings =
            ChainSettings { sample_rate: thud_firmware::units::Hertz(sample_rate), ..ChainSettings::transparent() };
        let newton_per_code = settings.front_end.newton_per_code();
        let rate = f64::from(sample_rate);
        let chain = MeasuringChain::new(&settings, 0);
        let mut converter = Converter::new(chain, move |at_s: f64| at_s * rate * newton_per_code);
        converter.start(Instant::MIN);
        prepare(&mut converter);
        let mut adc = Adc::new(Rc::new(RefCell::new(converter)));
        let seen = Rc::new(RefCell::new(Seen::new()));
        let log = seen.clone();
        let mut scheduler = Scheduler::new();
        let slot = scheduler.add("reader");
        scheduler.start(slot, async move {
            for pause_us in pauses_us {
                Timer::after(Duration::from_micros(*pause_us)).await;
                let mut block = [0; BLOCK];
                let result = adc.next_block(&mut block).await.map(|info| (info.first_index, block));
                log.borrow_mut().push((Instant::now().as_micros(), result));
            }
        });
        while let Some(next) = scheduler.settle().unwrap() {
            scheduler.clock().jump_to(next);
        }
        seen.take()
    }

    fn codes(first: u64) -> Result<(u64, [AdcCode; BLOCK]), Overrun> {
        Ok((first, std::array::from_fn(|index| 32_768 + first as u16 + index as u16)))
    }

    #[test]
    fn blocks_come_at_exact_instants() {
        // The 8th sample is taken at 350 µs and in memory 6 µs later.
        assert_eq!(read(20_000.0, |_| (), &[0; 3]), [(356, codes(0)), (756, codes(8)), (1156, codes(16))]);
        // 78.125 µs a sample, rounded up to the clock.
        assert_eq!(read(12_800.0, |_| (), &[0; 2]), [(547 + 6, codes(0)), (1172 + 6, codes(8))]);
    }

    #[test]
    fn who_comes_late_but_in_time_loses_nothing() {
        // Half 0 is overwritten by sample 16, in memory at 806 µs.
        assert_eq!(read(20_000.0, |_| (), &[805, 0]), [(805, codes(0)), (805, codes(8))]);
    }

    #[test]
    fn who_comes_too_late_is_told_how_much_is_gone() {
        let seen = read(20_000.0, |_| (), &[806, 0, 0]);
        assert_eq!(seen, [(806, Err(Overrun { lost: 8 })), (806, codes(8)), (1156, codes(16))]);
        // 10 ms later: 200 samples, the newest complete half begins at 192.
        let seen = read(20_000.0, |_| (), &[10_000, 0]);
        assert_eq!(seen, [(10_000, Err(Overrun { lost: 192 })), (10_000, codes(192))]);
    }

    #[test]
    fn an_injected_gap_is_visible_and_exact() {
        let seen = read(20_000.0, |converter| converter.lose(5, 3), &[0; 4]);
        assert_eq!(seen[0].1, codes(0));
        assert_eq!(seen[1].1, Err(Overrun { lost: 3 }));
        assert_eq!(seen[2].1, codes(11));
        assert_eq!(seen[3].1, codes(19));
    }
}

//! The stages of the per-sample path one by one, over the first stretch of the recording.

use core::hint::black_box;

use semihosting::println;
use thud_firmware::board::AdcCode;
use thud_firmware::calibration::Calibration;
use thud_firmware::configuration::{Chain, FilterProfile};
use thud_firmware::filter::{Causal, TWO_PASS_CORRECTION};
use thud_firmware::idle::Idle;
use thud_firmware::onset::OnsetDetector;
use thud_firmware::units::Hertz;

use super::counter::Counter;

/// Samples in the stretch: a quarter of a second.
pub const STRETCH: usize = 5000;

/// A section of `cascade.c`.
#[repr(C)]
#[derive(Clone, Copy)]
struct Section {
    b0: f32,
    b1: f32,
    b2: f32,
    a1: f32,
    a2: f32,
    s1: f32,
    s2: f32,
}

#[expect(unsafe_code, reason = "the filter in C, as cascade.c declares it")]
unsafe extern "C" {
    fn cascade(sections: *mut Section, x: *const f32, y: *mut f32, count: u32);
}

/// Counts them.
pub fn measure(counter: &Counter, codes: &[AdcCode; STRETCH]) {
    let chain = Chain::REFERENCE;
    let rate = chain.sample_rate;
    let tell = |part: &str, instructions: f64| println!("count {part} {STRETCH} {instructions:.0}");
    let mut force = [0.0; STRETCH];
    let mut output = [0.0; STRETCH];

    let calibration = black_box(Calibration::new(&chain));
    let ((), instructions) = counter.count(|| calibrate(&calibration, codes, &mut force));
    tell("calibrate", instructions);

    let mut idle = Idle::new();
    idle.start(rate, calibration.quantisation_noise(), force[0]);
    let ((), instructions) = counter.count(|| track(&mut idle, &force, &mut output));
    tell("track", instructions);

    let mut onset = OnsetDetector::new();
    onset.set_noise(0.3, 0.11, 6.0, 0.5);
    let (onsets, instructions) = counter.count(|| detect(&mut onset, &output));
    black_box(onsets);
    tell("detect", instructions);

    let corner = FilterProfile::IsoPas5672.corner().unwrap_or(Hertz(100.0));
    let mut causal = Causal::new(corner, rate);
    let ((), instructions) = counter.count(|| filter(&mut causal, &force, &mut output));
    tell("filter", instructions);

    let mut sections = [Section::low_pass(corner, rate); 2];
    let mut expected = [0.0; STRETCH];
    let ((), instructions) = counter.count(|| in_c(&mut sections, &force, &mut expected));
    tell("filter-in-c", instructions);
    let difference = output.iter().zip(&expected).fold(0.0f32, |worst, (a, b)| worst.max((a - b).abs()));
    println!("difference {difference}");
}

#[inline(never)]
fn calibrate(calibration: &Calibration, codes: &[AdcCode], force: &mut [f32]) {
    for (force, code) in force.iter_mut().zip(codes) {
        *force = calibration.force(*code);
    }
}

#[inline(never)]
fn track(idle: &mut Idle, force: &[f32], rest: &mut [f32]) {
    let mut pairs = force.iter().zip(rest);
    loop {
        let (mut gathering, mut taken) = (idle.gathering(), 0);
        for (force, rest) in pairs.by_ref().take(idle.until_group_ends()) {
            *rest = gathering.remove(*force);
            gathering.learn(*rest);
            taken += 1;
        }
        if taken == 0 {
            return;
        }
        idle.gather(&gathering, taken, 1.8);
    }
}

#[inline(never)]
fn detect(onset: &mut OnsetDetector, rest: &[f32]) -> u32 {
    rest.iter().map(|rest| u32::from(onset.push(*rest))).sum()
}

#[inline(never)]
fn filter(causal: &mut Causal, x: &[f32], y: &mut [f32]) {
    for (x, y) in x.iter().zip(y) {
        *y = causal.step(*x);
    }
}

#[expect(unsafe_code, reason = "both slices have STRETCH samples")]
fn in_c(sections: &mut [Section; 2], x: &[f32; STRETCH], y: &mut [f32; STRETCH]) {
    unsafe { cascade(sections.as_mut_ptr(), x.as_ptr(), y.as_mut_ptr(), STRETCH as u32) }
}

impl Section {
    /// Butterworth of two poles by the bilinear transform, as `thud_firmware::filter` has it.
    fn low_pass(corner: Hertz, rate: Hertz) -> Self {
        // tan x for a small x.
        let x = core::f32::consts::PI * corner.0 * TWO_PASS_CORRECTION / rate.0;
        let g = x + x * x * x / 3.0;
        let norm = 1.0 / (1.0 + core::f32::consts::SQRT_2 * g + g * g);
        let b0 = g * g * norm;
        let a1 = 2.0 * (g * g - 1.0) * norm;
        let a2 = (1.0 - core::f32::consts::SQRT_2 * g + g * g) * norm;
        Self { b0, b1: 2.0 * b0, b2: b0, a1, a2, s1: 0.0, s2: 0.0 }
    }
}

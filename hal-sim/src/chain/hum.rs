//! Hum from the mains: a sine and its harmonics.
//!
//! ```text
//! h(t) = A·sin(2πft) + Σ A·rₖ·sin(2πkft),  k = 2, 3, …
//! ```
//!
//! Each line is a pointer that turns by a fixed angle a sample; every 4096 samples it is set anew from the sample
//! number, so that neither its length nor its phase drifts away.

use thud_firmware::units::{Hertz, Newton};

/// Hum.
#[derive(Clone, Debug, PartialEq)]
pub struct Hum {
    /// 50 or 60 Hz, give or take what the grid does.
    pub fundamental: Hertz,
    /// Amplitude (peak) of the fundamental.
    pub amplitude: Newton,
    /// Amplitudes of the second, third, … harmonic, relative to the fundamental.
    pub harmonics: Vec<f32>,
}

const SAMPLES_PER_SETTING: u64 = 4096;

pub(super) struct Source {
    lines: Vec<Line>,
    index: u64,
}

struct Line {
    amplitude: f64,
    turns_per_sample: f64,
    turn: (f64, f64),
    pointer: (f64, f64),
}

impl Source {
    pub(super) fn new(hum: &Hum, period_s: f64) -> Self {
        let relative = std::iter::once(1.0).chain(hum.harmonics.iter().copied());
        let lines = relative
            .enumerate()
            .filter(|(_, relative)| *relative != 0.0)
            .map(|(index, relative)| {
                let turns_per_sample = (index + 1) as f64 * f64::from(hum.fundamental.0) * period_s;
                let (sin, cos) = (std::f64::consts::TAU * turns_per_sample).sin_cos();
                Line {
                    amplitude: f64::from(hum.amplitude.0 * relative),
                    turns_per_sample,
                    turn: (cos, sin),
                    pointer: (0.0, 0.0),
                }
            })
            .collect();
        Self { lines, index: 0 }
    }

    pub(super) fn add(&mut self, newtons: &mut [f64]) {
        let mut rest = newtons;
        while !rest.is_empty() {
            let since_setting = self.index % SAMPLES_PER_SETTING;
            if since_setting == 0 {
                self.lines.iter_mut().for_each(|line| line.set(self.index));
            }
            let run = rest.len().min((SAMPLES_PER_SETTING - since_setting) as usize);
            let (now, later) = rest.split_at_mut(run);
            self.lines.iter_mut().for_each(|line| line.add(now));
            self.index += run as u64;
            rest = later;
        }
    }
}

impl Line {
    fn set(&mut self, index: u64) {
        let turns = (index as f64 * self.turns_per_sample).fract();
        let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
        self.pointer = (self.amplitude * cos, self.amplitude * sin);
    }

    fn add(&mut self, newtons: &mut [f64]) {
        let (turn_x, turn_y) = self.turn;
        let (mut x, mut y) = self.pointer;
        for sample in newtons {
            *sample += y;
            (x, y) = (x * turn_x - y * turn_y, x * turn_y + y * turn_x);
        }
        self.pointer = (x, y);
    }
}

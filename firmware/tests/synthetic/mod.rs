//! Forces whose truth is known, and the reference chain that turns them into counts.

#![allow(dead_code, reason = "each test and bench uses its part")]

pub mod trial;

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use thud_firmware::board::{BLOCK, BlockInfo};
use thud_firmware::configuration::{Chain, Configuration};
use thud_firmware::detector::{ImpactContext, Signal, Stamped};
use thud_firmware::event::{Event, Onset};
use thud_firmware::limits::Region;
use thud_firmware::sensor::Sensor;
use thud_firmware::units::{Hertz, Kilogram, Volt};

pub const RATE: f64 = 20_000.0;

/// A robot of mass `m` meets a spring `k` on a rigid wall at `v`: F = v·√(km)·sin ωt, ω = √(k/m), for half a period.
#[derive(Clone, Copy, Debug)]
pub struct HalfSine {
    pub peak: f64,
    pub omega: f64,
}

impl HalfSine {
    pub fn new(v: f64, k: f64, m: f64) -> Self {
        Self { peak: v * (k * m).sqrt(), omega: (k / m).sqrt() }
    }

    pub fn of_duration(peak: f64, duration: f64) -> Self {
        Self { peak, omega: std::f64::consts::PI / duration }
    }

    pub fn duration(&self) -> f64 {
        std::f64::consts::PI / self.omega
    }

    pub fn impulse(&self) -> f64 {
        2.0 * self.peak / self.omega
    }

    pub fn at(&self, t: f64) -> f64 {
        if t <= 0.0 || t >= self.duration() { 0.0 } else { self.peak * (self.omega * t).sin() }
    }
}

/// What lies on the force before it is sampled.
#[derive(Clone, Copy, Debug)]
pub struct Disturbance {
    /// White noise, N rms.
    pub noise: f64,
    pub hum_hertz: f64,
    pub hum_amplitude: f64,
    pub hum_phase: f64,
    /// N/s.
    pub drift: f64,
    /// N.
    pub offset: f64,
    /// Spikes of one sample a second, of any height.
    pub spikes: f64,
}

impl Disturbance {
    pub const NONE: Self =
        Self { noise: 0.0, hum_hertz: 50.0, hum_amplitude: 0.0, hum_phase: 0.0, drift: 0.0, offset: 0.0, spikes: 0.0 };
    pub const USUAL: Self = Self {
        noise: 0.3,
        hum_hertz: 50.0,
        hum_amplitude: 0.5,
        hum_phase: 1.0,
        drift: 0.014,
        offset: 3.0,
        spikes: 0.0,
    };

    pub fn at(&self, t: f64) -> f64 {
        self.offset + self.drift * t + self.hum_amplitude * (TAU * self.hum_hertz * t + self.hum_phase).sin()
    }
}

pub fn code(force: f64, chain: &Chain) -> u16 {
    (force / f64::from(chain.newton_per_code) + f64::from(chain.zero_code)).round().clamp(0.0, 65_535.0) as u16
}

pub fn configuration(rate: f64) -> Configuration {
    let mut configuration = Configuration::DEFAULT;
    configuration.region = Some(Region::Chest);
    configuration.effective_mass = Some(Kilogram(6.0));
    // The synthetic forces pass no filter.
    configuration.chain = configuration.chain.undelayed();
    configuration.chain.sample_rate = Hertz(rate as f32);
    configuration
}

pub fn stamped(configuration: Configuration) -> Stamped {
    Stamped { configuration, revision: 7, hash: 0xC0FF_EE00 }
}

/// A sensor on a bench: forces in, everything it says out.
pub struct Bench<const N: usize> {
    pub sensor: Box<Sensor<N>>,
    pub chain: Chain,
    pub rate: f64,
    pub next: u64,
    pub rng: ChaCha8Rng,
    pub onsets: Vec<(u64, Onset)>,
    pub contexts: Vec<ImpactContext>,
    pub events: Vec<Event>,
    pub signals: Vec<(u64, Signal)>,
}

impl<const N: usize> Bench<N> {
    pub fn new(configuration: Configuration, seed: u64) -> Self {
        Self {
            sensor: Box::new(Sensor::new(stamped(configuration))),
            chain: configuration.chain,
            rate: f64::from(configuration.chain.sample_rate.0),
            next: 0,
            rng: ChaCha8Rng::seed_from_u64(seed),
            onsets: Vec::new(),
            contexts: Vec::new(),
            events: Vec::new(),
            signals: Vec::new(),
        }
    }

    /// Pushes blocks of `force(t)`, t in seconds since power-up, with the disturbance, for `seconds`.
    pub fn run(&mut self, seconds: f64, disturbance: &Disturbance, force: impl Fn(f64) -> f64) {
        let blocks = (seconds * self.rate / BLOCK as f64).ceil() as u64;
        for _ in 0..blocks {
            let mut codes = [0; BLOCK];
            for (i, slot) in codes.iter_mut().enumerate() {
                let t = (self.next + i as u64) as f64 / self.rate;
                let mut sum = force(t) + disturbance.at(t);
                if disturbance.noise > 0.0 {
                    let noise: f64 = StandardNormal.sample(&mut self.rng);
                    sum += disturbance.noise * noise;
                }
                if disturbance.spikes > 0.0 {
                    use rand::RngExt as _;
                    if self.rng.random_bool(disturbance.spikes / self.rate) {
                        sum += self.rng.random_range(-5000.0..5000.0);
                    }
                }
                *slot = code(sum, &self.chain);
            }
            self.push(&codes, 10.0);
        }
    }

    pub fn push(&mut self, codes: &[u16], bias: f32) {
        let signals = self.sensor.push(codes, &BlockInfo { first_index: self.next, bias: Volt(bias) });
        self.next += codes.len() as u64;
        for signal in signals {
            match &signal {
                Signal::Onset(onset) => self.onsets.push((self.next, *onset)),
                Signal::Over(context) => {
                    self.contexts.push(*context);
                    self.events.extend(self.sensor.evaluate(context));
                }
                _ => {}
            }
            self.signals.push((self.next, signal));
        }
    }
}

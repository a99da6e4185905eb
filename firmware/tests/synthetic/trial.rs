//! One known impact through the sensor, what it made of it, and what no estimator could do better.

use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use thud_firmware::capture::CAPTURE;
use thud_firmware::event::Event;

use super::{Bench, Disturbance, HalfSine, RATE, configuration};

/// A grid point of the promised range.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// m/s.
    pub v: f64,
    /// N/m.
    pub k: f64,
    /// kg.
    pub m: f64,
}

/// The promised range: 0.05 to 0.6 m/s, 10 to 150 N/mm, 4 to 12 kg.
pub fn grid() -> Vec<Hit> {
    let mut hits = Vec::new();
    for v in [0.05, 0.15, 0.35, 0.6] {
        for k in [10e3, 25e3, 75e3, 150e3] {
            for m in [4.0, 6.0, 12.0] {
                hits.push(Hit { v, k, m });
            }
        }
    }
    hits
}

/// What a trial found, as errors against the truth.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// s.
    pub contact: f64,
    /// s.
    pub separation: f64,
    /// N.
    pub raw_peak: f64,
    /// As a share.
    pub impulse: f64,
    /// From the true force passing six times the noise to the end of the block that raised the alarm, s.
    pub alarm: f64,
}

/// Noise of the chain with its quantiser, N rms.
pub const NOISE: f64 = 0.3;

/// One hit at a random instant, under hum of random phase and slightly wrong frequency, and drift. `ring` adds a decaying
/// ring (share of the peak, Hz) that begins with the contact.
pub fn once(hit: Hit, seed: u64, ring: Option<(f64, f64)>) -> (Errors, Event) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x7475_6864);
    let pulse = HalfSine::new(hit.v, hit.k, hit.m);
    let disturbance = Disturbance {
        noise: NOISE,
        hum_hertz: 50.0 + rng.random_range(-0.2..0.2),
        hum_amplitude: 0.5,
        hum_phase: rng.random_range(0.0..std::f64::consts::TAU),
        drift: rng.random_range(-0.014..0.014),
        offset: rng.random_range(-20.0..20.0),
        spikes: 0.0,
    };
    let contact = 2.5 + rng.random_range(0.0..0.1);
    let force = |t: f64| {
        let u = t - contact;
        let mut sum = pulse.at(u);
        if let Some((share, hertz)) = ring
            && u > 0.0
            && u < pulse.duration()
        {
            let decay = (-u / 0.01).exp();
            sum += share * pulse.peak * decay * (std::f64::consts::TAU * hertz * u).sin();
        }
        sum
    };
    let mut bench = Bench::<CAPTURE>::new(configuration(RATE), seed);
    bench.run(3.2, &disturbance, force);
    assert_eq!(bench.onsets.len(), 1, "{hit:?}, seed {seed}: onsets {:?}", bench.onsets);
    assert_eq!(bench.events.len(), 1, "{hit:?}, seed {seed}: {} contacts", bench.events.len());
    let event = bench.events[0];
    let contact_found = (event.contact_instant.index as f64 + f64::from(event.contact_instant.fraction)) / RATE;
    let passes = contact + (6.0 * NOISE / pulse.peak).min(1.0).asin() / pulse.omega;
    let errors = Errors {
        contact: contact_found - contact,
        separation: contact_found + f64::from(event.duration.0) - contact - pulse.duration(),
        raw_peak: f64::from(event.raw_peak.0) - pulse.peak,
        impulse: f64::from(event.impulse.0) / pulse.impulse() - 1.0,
        alarm: bench.onsets[0].0 as f64 / RATE - passes,
    };
    (errors, event)
}

/// Cramér–Rao bound of the contact instant, s: half-sine of unknown height, frequency and instant, every sample of the pulse,
/// white noise, zero and hum known.
pub fn bound(hit: Hit) -> f64 {
    let pulse = HalfSine::new(hit.v, hit.k, hit.m);
    let variance =
        NOISE * NOISE + (f64::from(thud_firmware::configuration::Chain::REFERENCE.newton_per_code)).powi(2) / 12.0;
    // Scaled to height, phase angle and instant in 1/ω, so that the matrix is well conditioned.
    let mut fisher = [[0.0f64; 3]; 3];
    let samples = (pulse.duration() * RATE) as usize;
    for i in 0..samples {
        let t = i as f64 / RATE;
        let phase = pulse.omega * t;
        let gradient = [phase.sin(), pulse.peak * phase.cos() * phase, -pulse.peak * phase.cos()];
        for row in 0..3 {
            for column in 0..3 {
                fisher[row][column] += gradient[row] * gradient[column] / variance;
            }
        }
    }
    let [[a, b, c], [_, d, e], [_, _, f]] = fisher;
    let determinant = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d);
    ((a * d - b * b) / determinant).sqrt() / pulse.omega
}

/// Root mean square.
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0f64);
    for value in values {
        sum += value * value;
        count += 1.0;
    }
    (sum / count.max(1.0)).sqrt()
}
